//! From a recording to the impacts in it: when each was, and where, if the microphones' places are known.

use crate::localise::{Array, ArrayError, LocaliseError, Localiser, Location};
use crate::onset::{Instant, Listened, Onset, OnsetError, OnsetSettings};
use crate::quantile::quantile;
use crate::wav::Sound;
use thiserror::Error;

/// Power, in the noise's, of a sound of which half the agreement of the channels is asked for.
const EXCUSED: f64 = 4.0;

/// How impacts are heard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HearSettings {
    /// How impacts are distinguished from the rest of the sound.
    pub onset: OnsetSettings,
    /// The buffer that a place is found in starts this long before the onset, s.
    pub lead_s: f64,
    /// Length of the buffer, s, beyond the time that sound takes between the microphones farthest from each other.
    pub length_s: f64,
    /// How far outside the rectangle around the microphones an impact may be, in diagonals of it.
    pub reach: f64,
    /// How far time differences may be from adding up around triangles, s.
    pub closure_s: f64,
    /// Least agreement of the channels' phases ([`Location::coherence`]) for a loud sound; noise excuses a weak one.
    pub coherence: f64,
}

impl Default for HearSettings {
    fn default() -> Self {
        Self {
            onset: OnsetSettings::default(),
            lead_s: 1.2e-3,
            length_s: 5e-3,
            reach: 0.3,
            closure_s: 5e-5,
            coherence: 0.6,
        }
    }
}

/// Why a recording cannot be listened to.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum HearError {
    /// The sound cannot be searched.
    #[error(transparent)]
    Onset(#[from] OnsetError),
    /// Places cannot be found.
    #[error(transparent)]
    Localise(#[from] LocaliseError),
    /// Not one microphone a channel.
    #[error("{got} microphones for {expected} channels, expected one each")]
    Microphones {
        /// Number of channels.
        expected: usize,
        /// Number of microphones.
        got: usize,
    },
}

impl From<ArrayError> for HearError {
    fn from(error: ArrayError) -> Self {
        Self::Localise(error.into())
    }
}

/// One impact.
#[derive(Debug, Clone, PartialEq)]
pub struct Impact {
    /// Counted from 0, the first that was heard.
    pub number: usize,
    /// When it was, from the first sample, s: at the table if its place is known, else when the first channel heard it.
    pub t_s: f64,
    /// Standard deviation of that time, s.
    pub t_sigma_s: f64,
    /// Where it was, with its covariance; `None` without the microphones' places.
    pub location: Option<Location>,
    /// When each channel heard it, from the first sample, s.
    pub arrivals_s: Vec<f64>,
    /// The impact's loudness over the noise, a ratio of amplitudes.
    pub amplitude_sigmas: f64,
}

/// A sound that was no impact on the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stray {
    /// When the first channel heard it, s from the first sample.
    pub t_s: f64,
    /// Why it is no impact.
    pub reason: StrayReason,
}

/// Why a sound is no impact on the table.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum StrayReason {
    /// It came from beyond reach: this far outside the rectangle around the microphones, m.
    Outside(f64),
    /// The time differences do not add up, by this much, s: no single source.
    Scattered(f64),
    /// The channels did not hear one sound: this little of it is common to them, 1 at best.
    Incoherent(f64),
}

/// What was heard in a recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Heard {
    /// Impacts, in order of time.
    pub impacts: Vec<Impact>,
    /// Sounds that were taken for no impacts.
    pub strays: Vec<Stray>,
}

/// The impacts in a recording without the microphones' places: times only, one channel is enough.
///
/// With one channel a click beyond the table cannot be distinguished from an impact.
pub fn hear_times(sound: &Sound, settings: &HearSettings) -> Result<Heard, HearError> {
    let listened = Listened::new(&sound.channels, sound.rate_hz, settings.onset)?;
    let impact = |(number, onset): (usize, Onset)| {
        let first = onset.first();
        Impact {
            number,
            t_s: first.t_s,
            t_sigma_s: first.sigma_s,
            location: None,
            arrivals_s: onset.channels.iter().map(|c| c.t_s).collect(),
            amplitude_sigmas: onset.amplitude_sigmas,
        }
    };
    Ok(Heard { impacts: listened.onsets().into_iter().enumerate().map(impact).collect(), strays: Vec::new() })
}

/// The impacts in a recording and their places on the table: microphones in the table's frame (m, z = 0 at its top), one a
/// channel, at least 3 that are not on one line; speed of sound in m/s.
///
/// ```
/// use bounce_audio::hear::{HearSettings, hear};
/// use bounce_audio::wav::Sound;
///
/// let silence = Sound { rate_hz: 44_100.0, channels: vec![vec![0.0; 44_100]; 3] };
/// let microphones = [[0.0, 0.0, 0.08], [0.5, 0.0, 0.08], [0.25, 0.5, 0.08]];
/// assert!(hear(&silence, &microphones, 343.0, &HearSettings::default())?.impacts.is_empty());
/// # Ok::<(), bounce_audio::hear::HearError>(())
/// ```
pub fn hear(
    sound: &Sound,
    microphones_m: &[[f64; 3]],
    speed_of_sound_m_s: f64,
    settings: &HearSettings,
) -> Result<Heard, HearError> {
    let (expected, got) = (sound.channels.len(), microphones_m.len());
    if expected != got {
        return Err(HearError::Microphones { expected, got });
    }
    let listened = Listened::new(&sound.channels, sound.rate_hz, settings.onset)?;
    let array = Array::new(microphones_m, speed_of_sound_m_s)?;
    let length = ((settings.length_s + array.longest_lag_s()) * sound.rate_hz).ceil();
    let mut localiser = Localiser::new(microphones_m, sound.rate_hz, speed_of_sound_m_s, length as usize)?;
    let mut buffers = vec![vec![0.0; localiser.buffer()]; got];
    let mut heard = Heard::default();
    for onset in listened.onsets() {
        let first = onset.first().t_s;
        let start = ((first - settings.lead_s) * sound.rate_hz).round() as isize;
        for (buffer, x) in buffers.iter_mut().zip(&sound.channels) {
            cut(x, start, buffer);
        }
        let slices: Vec<&[f64]> = buffers.iter().map(Vec::as_slice).collect();
        let location = match localiser.locate(&slices) {
            Ok(location) => location,
            // A channel that is dead just then says nothing about where the sound came from.
            Err(LocaliseError::Energy { .. }) => {
                heard.strays.push(Stray { t_s: first, reason: StrayReason::Incoherent(0.0) });
                continue;
            }
            Err(error) => return Err(error.into()),
        };
        let reason = doubt(&array, &location, onset.amplitude_sigmas, settings);
        if let Some(reason) = reason {
            heard.strays.push(Stray { t_s: first, reason });
            continue;
        }
        heard.impacts.push(timed(&listened, &localiser, &onset, location, heard.impacts.len())?);
    }
    Ok(heard)
}

/// Why a sound that was localised is no impact on the table.
pub(crate) fn doubt(
    array: &Array,
    location: &Location,
    amplitude_sigmas: f64,
    settings: &HearSettings,
) -> Option<StrayReason> {
    let outside = array.outside_m(location.x_m, location.y_m);
    let power = amplitude_sigmas.powi(2);
    let coherence = settings.coherence * power / (power + EXCUSED);
    if !(location.coherence >= coherence) {
        Some(StrayReason::Incoherent(location.coherence))
    } else if !(location.closure_s <= settings.closure_s) {
        Some(StrayReason::Scattered(location.closure_s))
    } else if !(outside <= settings.reach * array.diagonal_m()) {
        Some(StrayReason::Outside(outside))
    } else {
        None
    }
}

/// The time of an impact whose place is known: all channels, aligned by their measured time differences, show one onset; the mean
/// travel time is taken off.
fn timed(
    listened: &Listened,
    localiser: &Localiser,
    onset: &Onset,
    location: Location,
    number: usize,
) -> Result<Impact, HearError> {
    let relative = localiser.arrivals_s();
    let mut means: Vec<f64> = onset.channels.iter().zip(relative).map(|(c, r)| c.t_s - r).collect();
    // An onset has a channel; without one there is no time to look near.
    let near_s = quantile(&mut means, 0.5).unwrap_or(0.0);
    let Instant { t_s: mean, sigma_s } = listened.aligned(near_s, relative)?;
    let array = localiser.array();
    let n = relative.len();
    let travel = (0..n).map(|i| array.travel_s(i, location.x_m, location.y_m)).sum::<f64>() / n as f64;
    Ok(Impact {
        number,
        t_s: mean - travel,
        t_sigma_s: sigma_s,
        location: Some(location),
        arrivals_s: relative.iter().map(|r| mean + r).collect(),
        amplitude_sigmas: onset.amplitude_sigmas,
    })
}

/// A stretch of a channel from a sample on, with silence beyond its ends.
fn cut(x: &[f64], start: isize, into: &mut [f64]) {
    for (k, v) in into.iter_mut().enumerate() {
        let at = usize::try_from(start + k as isize).ok();
        *v = at.and_then(|i| x.get(i)).copied().unwrap_or(0.0);
    }
}
