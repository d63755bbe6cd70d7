//! Impacts that are heard in a recording.

use bounce_audio::hear::{HearSettings, StrayReason, hear, hear_times};
use bounce_audio::wav::Sound;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::array::rows;
use crate::errors::refused;

/// The impacts in a sound, rows of samples (channels, samples) at a rate (Hz): when each was, and where on the table, where the places of
/// the microphones (microphones, 3), m, are given; and sounds that were none, with why.
#[pyfunction]
#[pyo3(signature = (sound, rate_hz, microphones_m, speed_of_sound_m_s))]
pub(crate) fn hear_impacts<'py>(
    py: Python<'py>,
    sound: &Bound<'py, PyAny>,
    rate_hz: f64,
    microphones_m: Option<Vec<[f64; 3]>>,
    speed_of_sound_m_s: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let sound = Sound { rate_hz, channels: rows(sound, "sound")? };
    let settings = HearSettings::default();
    let heard = py
        .detach(|| match &microphones_m {
            Some(places) => hear(&sound, places, speed_of_sound_m_s, &settings),
            None => hear_times(&sound, &settings),
        })
        .map_err(refused)?;
    let impacts = heard.impacts.into_iter().map(|impact| {
        let place = impact.location.map(|l| ((l.x_m, l.y_m), l.covariance_m2));
        (impact.t_s, impact.t_sigma_s, place, impact.arrivals_s, impact.amplitude_sigmas)
    });
    let said = PyDict::new(py);
    said.set_item("impacts", impacts.collect::<Vec<_>>())?;
    let strays = heard.strays.into_iter().map(|stray| {
        let reason = match stray.reason {
            StrayReason::Outside(m) => format!("from {m:.3} m beyond the microphones"),
            StrayReason::Scattered(s) => format!("times that do not add up, by {:.1} us", 1e6 * s),
            StrayReason::Incoherent(share) => format!("no one sound: {share:.2} in common"),
            _ => "no impact".to_owned(),
        };
        (stray.t_s, reason)
    });
    said.set_item("strays", strays.collect::<Vec<_>>())?;
    Ok(said)
}
