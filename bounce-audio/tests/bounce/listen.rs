//! Hearing as it happens: the same impacts as offline, in any buffers, in a room made by other means.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::path::Path;

use crate::common::{Dice, bundled, hiss, quantile, shared};
use bounce_audio::fake::{Burst, Court, Panel, Room, RoomError};
use bounce_audio::hear::{HearError, HearSettings, hear};
use bounce_audio::listen::{Delays, Listener, Placed, Sounded};
use bounce_audio::onset::OnsetError;
use bounce_audio::playback::Playback;
use bounce_audio::wav::Sound;
use hw_traits::microphones::Microphones;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A room with impacts at known times and places.
fn struck(rt60_s: f64, impacts: &[(f64, [f64; 3])], noise: f64) -> (Room, Sound) {
    let room = Court::living_room(rt60_s).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut channels = vec![vec![0.0; 60_000]; 3];
    for (t_s, place) in impacts {
        room.strike(*place, *t_s, &Burst::new(0.03, &mut rng), &mut channels);
    }
    hiss(&mut channels, noise, &mut Dice(3));
    let rate_hz = room.rate_hz();
    (room, Sound { rate_hz, channels })
}

fn listen(sound: &Sound, microphones: &[[f64; 3]], delays: Delays, buffer: usize) -> Vec<Sounded> {
    let mut listener =
        Listener::new(microphones, sound.rate_hz, 343.0, &HearSettings::default(), delays).unwrap();
    let mut heard = Vec::new();
    let n = sound.channels[0].len();
    for from in (0..n).step_by(buffer) {
        let to = (from + buffer).min(n);
        let frames: Vec<f32> =
            (from..to).flat_map(|i| sound.channels.iter().map(move |x| x[i] as f32)).collect();
        listener.push(100.0 + from as f64 / sound.rate_hz, &frames, |s| heard.push(s)).unwrap();
    }
    heard
}

fn placed(heard: &[Sounded]) -> Vec<Placed> {
    heard.iter().filter_map(|s| if let Sounded::Impact(p) = s { Some(*p) } else { None }).collect()
}

const IMPACTS: [(f64, [f64; 3]); 5] = [
    (0.1503, [0.1, 0.2, 0.0]),
    (0.4507, [0.3, 0.3, 0.0]),
    (0.7011, [0.42, 0.15, 0.0]),
    (0.9003, [0.2, 0.45, 0.0]),
    (1.0607, [0.5, 0.5, 0.0]),
];

/// In a living room with a third of a second of echo each impact is heard once, in time and in place, as offline.
#[test]
fn a_stream_hears_what_a_recording_does() {
    let (room, sound) = struck(0.3, &IMPACTS, 2e-3);
    let offline = hear(&sound, room.microphones_m(), 343.0, &HearSettings::default()).unwrap();
    let stream = placed(&listen(&sound, room.microphones_m(), Delays::Phase, 485));
    assert_eq!((offline.impacts.len(), stream.len()), (5, 5), "{:?}", offline.strays);
    for ((truth, stream), offline) in IMPACTS.iter().zip(&stream).zip(&offline.impacts) {
        let off = |x: f64, y: f64| (x - truth.1[0]).hypot(y - truth.1[1]);
        let there = offline.location.unwrap();
        let (a, b) = (off(stream.location.x_m, stream.location.y_m), off(there.x_m, there.y_m));
        println!(
            "{:.2} mm in the stream, {:.2} mm offline; {:.0} us late",
            1e3 * a,
            1e3 * b,
            1e6 * (stream.t_s - 100.0 - truth.0)
        );
        assert!(a < 4e-3 && b < 4e-3, "{a} m and {b} m off");
        assert!((stream.t_s - 100.0 - truth.0).abs() < 2e-4 && (offline.t_s - truth.0).abs() < 2e-4);
    }
}

/// How samples are cut into buffers is nothing to it.
#[test]
fn buffers_of_any_length_give_the_same() {
    let (room, sound) = struck(0.2, &IMPACTS[..3], 2e-3);
    let of = |buffer| placed(&listen(&sound, room.microphones_m(), Delays::Phase, buffer));
    let whole = of(60_000);
    assert_eq!(whole.len(), 3);
    for buffer in [1, 7, 485, 4_096] {
        let other = of(buffer);
        assert_eq!(whole.len(), other.len());
        for (a, b) in whole.iter().zip(&other) {
            assert_eq!(a.location, b.location, "buffers of {buffer}");
            // The clock of the samples is summed up in other steps.
            assert!((a.t_s - b.t_s).abs() < 1e-9);
        }
    }
}

/// Peak times, as in [Matl 2021]: they work where nothing echoes.
#[test]
fn peak_times_are_right_without_echoes() {
    let (room, sound) = struck(0.0, &IMPACTS, 1e-3);
    let heard = placed(&listen(&sound, room.microphones_m(), Delays::Peaks, 485));
    assert_eq!(heard.len(), 5);
    let off: Vec<f64> = heard
        .iter()
        .zip(&IMPACTS)
        .map(|(h, t)| 1e3 * (h.location.x_m - t.1[0]).hypot(h.location.y_m - t.1[1]))
        .collect();
    println!("peak times: {off:.1?} mm");
    assert!(quantile(&off, 0.5) < 10.0, "{off:?} mm");
}

/// The practice taps in the midst of their own noise, streamed.
#[test]
#[ignore = "needs ../shared"]
fn shared_practice_taps_are_heard_in_a_stream() {
    let folder = shared("practice/localisation");
    let triangle = [[0.0, 0.0, 0.0762], [0.55, 0.0, 0.0762], [0.275, 0.55, 0.0762]];
    let mut errors = Vec::new();
    for line in std::fs::read_to_string(folder.join("truth.csv")).unwrap().lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let truth: Vec<f64> = cells[1..].iter().map(|c| c.parse().unwrap()).collect();
        let mut sound = Sound::read(folder.join(cells[0])).unwrap();
        // The taps come 6 ms after their sound starts, and a stream wants to know the noise first: it hears its noise before.
        let mut dice = Dice(1);
        for x in &mut sound.channels {
            let lead = &x[..220];
            let sigma = (lead.iter().map(|v| v * v).sum::<f64>() / 220.0).sqrt();
            let before: Vec<f64> = (0..4_000).map(|_| sigma * dice.normal()).collect();
            x.splice(0..0, before);
        }
        let heard = placed(&listen(&sound, &triangle, Delays::Phase, 485));
        assert_eq!(heard.len(), 1, "{}", cells[0]);
        errors.push(1e3 * (heard[0].location.x_m - truth[0]).hypot(heard[0].location.y_m - truth[1]));
    }
    let (median, worst) = (quantile(&errors, 0.5), quantile(&errors, 1.0));
    println!("taps in a stream: median {median:.2} mm, worst {worst:.2} mm");
    assert!(errors.len() == 30 && median < 0.6 && worst < 3.0, "median {median} mm, worst {worst} mm");
}

/// After it was planned a stream allocates nothing, impacts or not.
#[test]
fn a_stream_allocates_nothing() {
    let (room, sound) = struck(0.3, &IMPACTS, 2e-3);
    let frames: Vec<f32> =
        (0..60_000).flat_map(|i| sound.channels.iter().map(move |x| x[i] as f32)).collect();
    for delays in [Delays::Phase, Delays::Peaks] {
        let mut listener =
            Listener::new(room.microphones_m(), 44_100.0, 343.0, &HearSettings::default(), delays).unwrap();
        let mut impacts = 0;
        let counted = allocation_counter::measure(|| {
            for (k, buffer) in frames.chunks(3 * 485).enumerate() {
                let t_s = k as f64 * 485.0 / 44_100.0;
                listener
                    .push(t_s, buffer, |s| impacts += usize::from(matches!(s, Sounded::Impact(_))))
                    .unwrap();
            }
        });
        assert!(impacts >= 4, "{impacts} impacts");
        assert_eq!(counted.count_total, 0, "{counted:?}");
    }
}

/// The practice drops (made by another package), played back behind the microphones' trait: what a recording shows, a stream hears.
fn drops_are_heard_in_a_stream(folder: &Path, cases: &[&str], least: usize) {
    let (mut offline, mut stream, mut late) = (0, 0, Vec::new());
    for case in cases {
        let toml: toml::Table =
            std::fs::read_to_string(folder.join(case).join("recording.toml")).unwrap().parse().unwrap();
        let audio = toml["audio"].as_table().unwrap();
        let number = |v: &toml::Value| v.as_float().or(v.as_integer().map(|i| i as f64)).unwrap();
        let microphones: Vec<[f64; 3]> = audio["microphones_m"]
            .as_array()
            .unwrap()
            .iter()
            .map(|m| std::array::from_fn(|k| number(&m.as_array().unwrap()[k])))
            .collect();
        let speed = audio.get("speed_of_sound_m_s").map_or(343.0, number);
        for file in audio["files"].as_array().unwrap().iter().take(2) {
            let sound = Sound::read(folder.join(case).join(file.as_str().unwrap())).unwrap();
            let settings = HearSettings::default();
            let whole = hear(&sound, &microphones, speed, &settings).unwrap();
            let mut listener =
                Listener::new(&microphones, sound.rate_hz, speed, &settings, Delays::Phase).unwrap();
            let mut playback = Playback::new(sound);
            let mut buffer = vec![0.0f32; microphones.len() * 485];
            let mut heard = Vec::new();
            while let Ok(t_s) = playback.read(&mut buffer) {
                listener.push(t_s, &buffer, |s| heard.push(s)).unwrap();
            }
            let heard = placed(&heard);
            // A stream gets to know the noise for 50 ms first; these recordings begin with an impact.
            for one in whole.impacts.iter().filter(|i| i.t_s > 0.06) {
                offline += 1;
                let Some(same) = heard.iter().find(|h| (h.t_s - one.t_s).abs() < 5e-4) else {
                    println!(
                        "{case}: {:.3} s, {:.0} sigmas, not in the stream",
                        one.t_s, one.amplitude_sigmas
                    );
                    continue;
                };
                stream += 1;
                late.push(1e6 * (same.t_s - one.t_s).abs());
                let there = one.location.unwrap();
                let off = (same.location.x_m - there.x_m).hypot(same.location.y_m - there.y_m);
                assert!(off < 2e-3, "{case}: {off} m between stream and recording");
            }
            assert!(heard.len() <= whole.impacts.len(), "{case}: the stream invents impacts");
        }
    }
    println!("{stream} of {offline} heard in the stream, median {:.0} us apart", quantile(&late, 0.5));
    assert!(offline >= least && stream == offline, "{stream} of {offline}");
}

#[test]
fn the_practice_drops_are_heard_in_a_stream() {
    drops_are_heard_in_a_stream(&bundled("practice/bounce-audio"), &["c04"], 5);
}

#[test]
#[ignore = "needs ../shared"]
fn shared_practice_drops_are_heard_in_a_stream() {
    drops_are_heard_in_a_stream(&shared("practice/bounce-audio"), &["c01", "c02", "c03", "c04"], 21);
}

/// After lost samples it starts anew and goes on hearing.
#[test]
fn a_gap_is_survived() {
    let (room, sound) = struck(0.2, &IMPACTS, 2e-3);
    let mut listener =
        Listener::new(room.microphones_m(), 44_100.0, 343.0, &HearSettings::default(), Delays::Phase)
            .unwrap();
    let mut heard = Vec::new();
    for from in (0..59_000).step_by(500) {
        // 0.45 s to 0.57 s are lost.
        if (20_000..25_000).contains(&from) {
            continue;
        }
        let frames: Vec<f32> =
            (from..from + 500).flat_map(|i| sound.channels.iter().map(move |x| x[i] as f32)).collect();
        listener.push(from as f64 / 44_100.0, &frames, |s| heard.push(s)).unwrap();
    }
    let times: Vec<f64> = placed(&heard).iter().map(|p| p.t_s).collect();
    for t in [0.1503, 0.7011, 0.9003, 1.0607] {
        assert!(times.iter().any(|heard| (heard - t).abs() < 2e-4), "{t} not among {times:?}");
    }
}

#[test]
fn nonsense_is_an_error() {
    let room = Court::living_room(0.3).unwrap();
    let new =
        |rate| Listener::new(room.microphones_m(), rate, 343.0, &HearSettings::default(), Delays::Phase);
    assert!(matches!(new(f64::NAN), Err(HearError::Onset(OnsetError::Setting { .. }))));
    let two =
        Listener::new(&room.microphones_m()[..2], 44_100.0, 343.0, &HearSettings::default(), Delays::Phase);
    assert!(matches!(two, Err(HearError::Localise(_))));
    let mut listener = new(44_100.0).unwrap();
    let ragged = listener.push(0.0, &[0.0; 4], |_| {});
    assert!(matches!(ragged, Err(HearError::Onset(OnsetError::Length { .. }))), "{ragged:?}");
    let broken = listener.push(0.0, &[0.0, f32::NAN, 0.0], |_| {});
    assert_eq!(broken, Err(HearError::Onset(OnsetError::NotFinite { channel: 1, sample: 0 })));
    assert!(matches!(Court::living_room(-1.0), Err(RoomError { .. })));
    assert!(Court::living_room(1e-3).is_err(), "no wall absorbs that much");
}

/// A panel adds the same sound once more: later by the way to its mirror image, fainter by that way and by what it swallows.
#[test]
fn furniture_sends_a_sound_back_once() {
    let heard = |panels: &[Panel], from_s: f64, loudness: f64| {
        let room = Court::living_room(0.0).unwrap().furnished(panels).unwrap();
        let mut channels = vec![vec![0.0; 4_000]; 3];
        let burst = Burst::new(loudness, &mut ChaCha8Rng::seed_from_u64(1));
        room.strike([0.1, 0.2, 0.0], from_s, &burst, &mut channels);
        channels.swap_remove(0)
    };
    let panel = Panel::upright([-0.3, -1.0], [-0.3, 1.0], [-0.5, 0.5], 0.6);
    let (plain, both) = (heard(&[], 0.01, 0.03), heard(&[panel], 0.01, 0.03));
    // The microphone in the corner (0, 0, 0.0762), and the image at (-0.7, 0.2, 0).
    let way = |x: f64| (x * x + 0.04 + 0.0762f64.powi(2)).sqrt();
    let (direct, back) = (way(0.1), way(0.7));
    let echo = heard(&[], 0.01 + (back - direct) / 343.0, 0.03 * 0.6 * direct / back);
    let off = (0..4_000).map(|i| (both[i] - plain[i] - echo[i]).abs()).fold(0.0, f64::max);
    let most = echo.iter().map(|v| v.abs()).fold(0.0, f64::max);
    assert!(most > 1e-3 && off < 0.1 * most, "{off} of {most}");
    assert!(Court::living_room(0.0).unwrap().furnished(&[Panel { reflection: 2.0, ..panel }]).is_err());
}
