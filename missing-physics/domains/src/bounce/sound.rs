//! Drops that come as sound: one WAV file a run.

use bounce_audio::chain::{Candidate, impacts as impacts_of};
use bounce_audio::hear::{HearSettings, Impact, hear, hear_times};
use bounce_audio::wav::Sound;

use super::array::Microphones;
use super::drop::{Drop, Relative};
use super::read::{Heard, Rig};
use serde_json::{Value, json};

use crate::recording::{Header, NamedFile, ReadError};

/// What was heard, and with which microphones.
pub(super) struct Listened {
    pub(super) heard: Vec<Heard>,
    pub(super) microphones: Microphones,
    /// Hearing's own estimate of its errors: sigma of a typical time (s) and place (m).
    pub(super) estimated: Option<[f64; 2]>,
    /// How many sounds were taken for none of the ball's, and which, in words.
    pub(super) strays: Vec<String>,
    /// What each run sounded like.
    pub(super) waves: Vec<Wave>,
}

/// What a run sounded like, to be drawn.
pub(super) struct Wave {
    /// The first channel's lowest and highest samples in equal parts of its time, each with the middle of that, s.
    pub(super) envelope: Vec<(f64, [f64; 2])>,
    /// When sounds were heard that were taken for none of the ball's, s.
    pub(super) strays_s: Vec<f64>,
}

/// Parts of a sound that are told apart in a picture.
const PARTS: usize = 500;

/// The lowest and highest samples of the parts of a sound.
fn envelope(sound: &Sound) -> Vec<(f64, [f64; 2])> {
    let Some(samples) = sound.channels.first() else { return Vec::new() };
    let long = samples.len().div_ceil(PARTS).max(1);
    let ends = |part: &[f64]| {
        part.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(*v), high.max(*v)])
    };
    let middle = |k: usize| (k as f64 + 0.5) * long as f64 / sound.rate_hz;
    samples.chunks(long).enumerate().map(|(k, part)| (middle(k), ends(part))).collect()
}

/// What was heard in one file.
struct Run {
    impacts: Vec<Impact>,
    /// When sounds were heard that were no impacts, s.
    strays: Vec<f64>,
    envelope: Vec<(f64, [f64; 2])>,
}

/// Listens to the files of a recording; `None` where it has no sound.
///
/// # Errors
/// [`ReadError`].
pub(super) fn listen(header: &Header, rig: &Rig) -> Result<Option<Listened>, ReadError> {
    let audio = header.section("audio")?;
    let microphones = audio.points("microphones_m")?;
    let temperature = audio.number("temperature_k", 100.0, 1e3)?;
    let stated = audio.number("speed_of_sound_m_s", 100.0, 1e4)?;
    let speed = stated.or_else(|| temperature.map(|t| 331.3 * (t / 273.15).sqrt())).unwrap_or(343.0);
    let Some(files) = audio.texts("files")? else { return Ok(None) };
    let mut all = Vec::new();
    for name in files {
        let file = header.named_file(&header.file, "audio.files", name)?;
        all.push(impacts_in(&file, microphones.as_deref(), speed, rig)?);
    }
    let strays = take_out(&mut all);
    let of_run = |run: Run| (run.impacts, Wave { envelope: run.envelope, strays_s: run.strays });
    let (all, waves): (Vec<Vec<Impact>>, Vec<Wave>) = all.into_iter().map(of_run).unzip();
    let mut heard: Vec<Heard> =
        all.iter().enumerate().map(|(run, impacts)| drop_of(run, impacts, rig)).collect();
    let microphones = Microphones { places_m: microphones.unwrap_or_default(), speed_of_sound_m_s: speed };
    let estimated = weigh(&mut heard, &all);
    Ok(Some(Listened { heard, microphones, estimated, strays, waves }))
}

/// The impacts in a file, in the order of time.
fn impacts_in(
    file: &NamedFile,
    microphones: Option<&[[f64; 3]]>,
    speed_m_s: f64,
    rig: &Rig,
) -> Result<Run, ReadError> {
    let open = |why: String| ReadError::Open { file: file.file.clone(), why };
    let sound = Sound::from_bytes(&file.bytes).map_err(|e| open(e.to_string()))?;
    let settings = HearSettings::default();
    let found = match microphones {
        Some(places) => hear(&sound, places, speed_m_s, &settings),
        None => hear_times(&sound, &settings),
    };
    let found = found.map_err(|e| open(e.to_string()))?;
    let strays = found.strays.iter().map(|stray| stray.t_s).collect();
    let mut impacts = found.impacts;
    impacts.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
    let fewest = rig.fewest();
    if impacts.len() < fewest {
        return Err(ReadError::TooFewRows {
            file: file.file.clone(),
            what: "the sound".into(),
            got: impacts.len(),
            expected: format!("at least {fewest} impacts"),
        });
    }
    Ok(Run { impacts, strays, envelope: envelope(&sound) })
}

/// Takes out sounds that fit no bounce, and says which.
fn take_out(all: &mut [Run]) -> Vec<String> {
    let candidate = |i: &Impact| Candidate { t_s: i.t_s, loudness: i.amplitude_sigmas.max(1.0).ln() };
    let candidates: Vec<Vec<Candidate>> =
        all.iter().map(|run| run.impacts.iter().map(candidate).collect()).collect();
    let sounds: usize = all.iter().map(|run| run.impacts.len() + run.strays.len()).sum();
    let mut taken = Vec::new();
    for ((number, run), kept) in all.iter_mut().enumerate().zip(impacts_of(&candidates)) {
        for (i, impact) in std::mem::take(&mut run.impacts).into_iter().enumerate() {
            if kept.contains(&i) {
                run.impacts.push(impact);
            } else {
                run.strays.push(impact.t_s);
            }
        }
        run.strays.sort_by(f64::total_cmp);
        let times: Vec<String> = run.strays.iter().map(|t_s| format!("{t_s:.3} s")).collect();
        if !times.is_empty() {
            taken.push(format!("{} into run {}", times.join(", "), number + 1));
        }
    }
    let count: usize = all.iter().map(|run| run.strays.len()).sum();
    if count == 0 {
        return Vec::new();
    }
    vec![format!(
        "{count} of {sounds} sounds fit no bounce and were left out: {} (an impact of the ball follows the one before it by a \
         steady part of the time between those)",
        taken.join("; ")
    )]
}

/// What was heard in a file; runs are counted from 1, in the order of the files.
fn drop_of(run: usize, impacts: &[Impact], rig: &Rig) -> Heard {
    let drop = Drop {
        times_s: impacts.iter().map(|i| i.t_s).collect(),
        places_m: impacts.iter().filter_map(|i| i.location.map(|l| [l.x_m, l.y_m])).collect(),
        height_m: rig.drop_height_m,
        arrivals_s: impacts.iter().map(|i| i.arrivals_s.clone()).collect(),
        loudness: impacts.iter().map(|i| i.amplitude_sigmas.max(1.0).ln()).collect(),
        unheard: vec![0; impacts.len()],
        known: vec![0; impacts.len()],
        ..Drop::default()
    };
    let numbers = (1..=impacts.len()).map(|n| n as f64).collect();
    Heard { label: (run + 1).to_string(), row: 0, drop, numbers }
}

/// Gives each impact its part of hearing's own estimate of its errors, and the sizes of typical ones; nothing where there are no
/// places.
fn weigh(heard: &mut [Heard], impacts: &[Vec<Impact>]) -> Option<[f64; 2]> {
    let root = |impact: &Impact| {
        let [[xx, xy], [_, yy]] = impact.location?.covariance_m2;
        let (a, b) = (xx.sqrt(), xy / xx.sqrt());
        let c = (yy - b * b).sqrt();
        [impact.t_sigma_s, a, c].iter().all(|v| v.is_normal()).then_some([[a, 0.0], [b, c]])
    };
    let roots: Option<Vec<Vec<[[f64; 2]; 2]>>> =
        impacts.iter().map(|run| run.iter().map(root).collect()).collect();
    let roots = roots?;
    let mean = |logs: Vec<f64>| (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp();
    let time_s = mean(impacts.iter().flatten().map(|i| i.t_sigma_s.ln()).collect());
    let place_m = mean(roots.iter().flatten().map(|r| 0.5 * (r[0][0] * r[1][1]).ln()).collect());
    for ((heard, impacts), roots) in heard.iter_mut().zip(impacts).zip(roots) {
        let relative = |(impact, root): (&Impact, [[f64; 2]; 2])| Relative {
            time: impact.t_sigma_s / time_s,
            place: root.map(|row| row.map(|v| v / place_m)),
        };
        heard.drop.relative = impacts.iter().zip(roots).map(relative).collect();
    }
    Some([time_s, place_m])
}

/// The impacts, as they were heard, as the answer's `impacts`.
pub(super) fn impacts(heard: &[Heard]) -> Value {
    let of_run = |h: &Heard| {
        let place = |i: usize| h.drop.places_m.get(i).copied();
        let impact = |(i, t_s): (usize, &f64)| match place(i) {
            Some([x, y]) => json!({"run": h.label, "t_s": t_s, "x_m": x, "y_m": y}),
            None => json!({"run": h.label, "t_s": t_s}),
        };
        h.drop.times_s.iter().enumerate().map(impact).collect::<Vec<Value>>()
    };
    heard.iter().flat_map(of_run).collect()
}
