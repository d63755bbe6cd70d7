//! Drops that come as sound: one WAV file a run.

use bounce_audio::hear::{HearSettings, hear, hear_times};
use bounce_audio::wav::Sound;

use super::array::Microphones;
use super::drop::Drop;
use super::read::{Heard, Rig};
use crate::recording::{Header, ReadError, inside};

/// What was heard, and with which microphones.
pub(super) struct Listened {
    pub(super) heard: Vec<Heard>,
    pub(super) microphones: Microphones,
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
    let mut heard = Vec::new();
    for name in files {
        let path = inside(&header.folder, &header.file, "audio.files", name)?;
        let open = |why: String| ReadError::Open { file: path.display().to_string(), why };
        let sound = Sound::read(&path).map_err(|e| open(e.fault.to_string()))?;
        let settings = HearSettings::default();
        let found = match &microphones {
            Some(places) => hear(&sound, places, speed, &settings),
            None => hear_times(&sound, &settings),
        };
        let mut impacts = found.map_err(|e| open(e.to_string()))?.impacts;
        impacts.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
        let fewest = rig.fewest();
        if impacts.len() < fewest {
            return Err(ReadError::TooFewRows {
                file: path.display().to_string(),
                what: "the sound".into(),
                got: impacts.len(),
                expected: format!("at least {fewest} impacts"),
            });
        }
        let places = impacts.iter().filter_map(|i| i.location.map(|l| [l.x_m, l.y_m])).collect();
        let drop = Drop {
            times_s: impacts.iter().map(|i| i.t_s).collect(),
            places_m: places,
            height_m: rig.drop_height_m,
            arrivals_s: impacts.iter().map(|i| i.arrivals_s.clone()).collect(),
            unheard: vec![0; impacts.len()],
            known: vec![0; impacts.len()],
            ..Drop::default()
        };
        let numbers = (1..=impacts.len()).map(|n| n as f64).collect();
        // Runs are counted from 1, in the order of the files.
        heard.push(Heard { label: (heard.len() + 1).to_string(), row: 0, drop, numbers });
    }
    let microphones = Microphones { places_m: microphones.unwrap_or_default(), speed_of_sound_m_s: speed };
    Ok(Some(Listened { heard, microphones }))
}

/// The impacts, as they were heard.
pub(super) fn impacts(heard: &[Heard]) -> Vec<crate::domains::Impact> {
    let mut list = Vec::new();
    for h in heard {
        for (i, t_s) in h.drop.times_s.iter().enumerate() {
            list.push(crate::domains::Impact {
                run: h.label.clone(),
                t_s: *t_s,
                place_m: h.drop.places_m.get(i).copied(),
            });
        }
    }
    list
}
