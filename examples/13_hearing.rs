//! Where impacts are heard: 200 places on a table in a room that echoes, offline and streamed, beside the 6.7 and 7.9 mm of [Matl 2021].
//!
//! ```text
//! cargo run --release -p examples --example 13_hearing -- --small              20 places
//! cargo run --release -p examples --example 13_hearing -- --picture FILE.svg   200 places, four rooms
//! ```
#![allow(clippy::print_stdout, reason = "an example prints what it measures")]

use bounce_audio::drop::each;
use bounce_audio::fake::{Burst, Room};
use bounce_audio::hear::{HearSettings, hear};
use bounce_audio::listen::{Delays, Listener, Sounded};
use bounce_audio::wav::Sound;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use std::error::Error;

type Failure = Box<dyn Error + Send + Sync>;

/// Errors beyond this are counted as outliers, m.
const OUTLIER_M: f64 = 0.03;
/// Silence before each impact, s.
const LEAD_S: f64 = 0.12;

/// The microphones of [Matl 2021], m.
const MICROPHONES: [[f64; 3]; 3] = [[0.0, 0.0, 0.0762], [0.55, 0.0, 0.0762], [0.275, 0.55, 0.0762]];
/// The table's origin in a room of 4 x 5 x 2.7 m: amidst it, and 30 cm from two walls, m.
const MIDDLE: [f64; 3] = [1.7, 2.2, 0.75];
const CORNER: [f64; 3] = [0.3, 0.3, 0.75];

/// One impact, as each listener placed it; `None` where it was not heard, or taken for something else.
struct Tap {
    place: [f64; 2],
    heard: [Option<[f64; 2]>; 3],
    invented: [usize; 3],
}

const LISTENERS: [(&str, &str); 3] = [
    ("offline, phase correlation", "6.7"),
    ("buffers of 11 ms, phase correlation", "-"),
    ("buffers of 11 ms, peak times", "7.9"),
];

fn main() -> Result<(), Failure> {
    let count = if examples::small() { 20 } else { 200 };
    println!(
        "{count} places, three microphones, white noise 20 dB below the sound of the first 20 ms; errors in mm"
    );
    println!(
        "{:10} {:38} {:>7} {:>7} {:>7} {:>7} {:>9} {:>7} {:>9} {:>11}",
        "RT60, s", "heard", "median", "mean", "95 %", "worst", "over 30mm", "missed", "invented", "Matl 2021"
    );
    let all =
        [("none", 0.0, MIDDLE), ("0.3", 0.3, MIDDLE), ("0.5", 0.5, MIDDLE), ("0.5 corner", 0.5, CORNER)];
    let rooms = if examples::small() { &all[3..] } else { &all[..] };
    let mut drawn = Vec::new();
    for &(room, rt60_s, table_m) in rooms {
        let taps = taps(rt60_s, table_m, count)?;
        for (k, (name, published)) in LISTENERS.iter().enumerate() {
            let mut off: Vec<f64> = taps.iter().filter_map(|t| Some(error_m(t.place, t.heard[k]?))).collect();
            off.sort_by(f64::total_cmp);
            let missed = taps.len() - off.len();
            let invented: usize = taps.iter().map(|t| t.invented[k]).sum();
            let outliers = off.iter().filter(|e| **e > OUTLIER_M).count();
            let n = off.len().max(1);
            let mean = off.iter().filter(|e| **e <= OUTLIER_M).sum::<f64>() / (n - outliers).max(1) as f64;
            let quantile =
                |q: f64| off.get(((n - 1) as f64 * q).round() as usize).map_or(f64::NAN, |e| 1e3 * e);
            println!(
                "{room:<10} {name:38} {:>7.2} {:>7.2} {:>7.2} {:>7.1} {outliers:>9} {missed:>7} {invented:>9} {published:>11}",
                quantile(0.5),
                1e3 * mean,
                quantile(0.95),
                quantile(1.0)
            );
        }
        drawn.push((room, taps));
    }
    println!(
        "\nThe mean leaves the outliers out, as the figure of [Matl 2021] does. Its room was a real one; ours are image sources."
    );
    if let Some(file) = examples::argument("--picture") {
        std::fs::write(&file, picture(&drawn)?)?;
        println!("drawn: {file}");
    }
    Ok(())
}

fn error_m(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn taps(rt60_s: f64, table_m: [f64; 3], count: usize) -> Result<Vec<Tap>, Failure> {
    let room = || Room::new([4.0, 5.0, 2.7], table_m, rt60_s, 343.0, &MICROPHONES, 44_100.0);
    each(count, 14, |_, rng| tap(&room()?, rng)).into_iter().collect()
}

fn tap<R: Rng>(room: &Room, rng: &mut R) -> Result<Tap, Failure> {
    let place = [0, 1].map(|_| 0.03 + 0.49 * rng.random::<f64>());
    let rate_hz = room.rate_hz();
    let mut channels = vec![vec![0.0; (0.2 * rate_hz) as usize]; room.microphones_m().len()];
    // Some part of a sample late.
    let at_s = LEAD_S + rng.random::<f64>() / rate_hz;
    room.strike([place[0], place[1], 0.003], at_s, &Burst::new(0.03, rng), &mut channels);
    let (from, to) = ((LEAD_S * rate_hz) as usize, ((LEAD_S + 0.02) * rate_hz) as usize);
    let power = channels.iter().flat_map(|x| &x[from..to]).map(|v| v * v).sum::<f64>();
    let sigma = 0.1 * (power / ((to - from) * channels.len()) as f64).sqrt();
    for v in channels.iter_mut().flatten() {
        let normal: f64 = StandardNormal.sample(rng);
        *v += sigma * normal;
    }
    let settings = HearSettings::default();
    let sound = Sound { rate_hz, channels };
    let offline = hear(&sound, room.microphones_m(), room.speed_m_s(), &settings)?;
    let offline: Vec<[f64; 2]> =
        offline.impacts.iter().filter_map(|i| i.location).map(|l| [l.x_m, l.y_m]).collect();
    let found = [offline, streamed(room, &sound, Delays::Phase)?, streamed(room, &sound, Delays::Peaks)?];
    Ok(Tap {
        place,
        heard: std::array::from_fn(|k| found[k].first().copied()),
        invented: std::array::from_fn(|k| found[k].len().saturating_sub(1)),
    })
}

fn streamed(room: &Room, sound: &Sound, delays: Delays) -> Result<Vec<[f64; 2]>, Failure> {
    let settings = HearSettings::default();
    let mut listener =
        Listener::new(room.microphones_m(), sound.rate_hz, room.speed_m_s(), &settings, delays)?;
    let mut heard = Vec::new();
    let n = sound.channels[0].len();
    for from in (0..n).step_by(485) {
        let to = (from + 485).min(n);
        let frames: Vec<f32> =
            (from..to).flat_map(|i| sound.channels.iter().map(move |x| x[i] as f32)).collect();
        listener.push(from as f64 / sound.rate_hz, &frames, |s| {
            if let Sounded::Impact(p) = s {
                heard.push([p.location.x_m, p.location.y_m]);
            }
        })?;
    }
    Ok(heard)
}

/// Each place with a line to where it was heard, a panel a room and listener.
fn picture(rooms: &[(&str, Vec<Tap>)]) -> Result<String, Failure> {
    use std::fmt::Write;
    let (size, gap) = (280.0, 40.0);
    let (width, height) = (3.0 * (size + gap) + gap, rooms.len() as f64 * (size + gap) + gap);
    let mut svg = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}' font-family='sans-serif' font-size='12'><rect width='{width}' height='{height}' fill='white'/>"
    );
    for (row, (rt60, taps)) in rooms.iter().enumerate() {
        for (k, (name, _)) in LISTENERS.iter().enumerate() {
            let (left, top) = (gap + k as f64 * (size + gap), gap + row as f64 * (size + gap));
            let at = |p: [f64; 2]| {
                let [x, y] = p.map(|v| v.clamp(-0.05, 0.6) / 0.55 * size);
                (left + x, top + size - y)
            };
            write!(
                svg,
                "<text x='{left}' y='{:.0}'>{name}, RT60 {rt60} s</text><rect x='{left}' y='{top}' width='{size}' height='{size}' fill='none' stroke='#888'/>",
                top - 8.0
            )?;
            for tap in taps {
                let (x, y) = at(tap.place);
                let Some(heard) = tap.heard[k] else {
                    write!(svg, "<circle cx='{x:.1}' cy='{y:.1}' r='4' fill='none' stroke='#d62728'/>")?;
                    continue;
                };
                let colour = if error_m(tap.place, heard) > OUTLIER_M { "#d62728" } else { "#1f77b4" };
                let (u, v) = at(heard);
                write!(
                    svg,
                    "<line x1='{x:.1}' y1='{y:.1}' x2='{u:.1}' y2='{v:.1}' stroke='{colour}'/><circle cx='{x:.1}' cy='{y:.1}' r='1.5' fill='{colour}'/>"
                )?;
            }
        }
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}
