//! Where the table stands, and how well impacts are heard there.

use crate::Failure;
use bounce_audio::drop::each;
use bounce_audio::fake::{Burst, Court, Panel, Room};
use bounce_audio::hear::HearSettings;
use bounce_audio::listen::{Delays, Listener, Sounded};
use bounce_audio::track::HearingError;
use rand::RngExt;
use rand_distr::StandardNormal;

/// A place heard this far from the truth is an outlier, m.
pub(crate) const OUTLIER_M: f64 = 0.03;
/// Silence before each tap, s.
const LEAD_S: f64 = 0.12;

/// Where the table stands.
pub(crate) struct Place {
    pub(crate) name: &'static str,
    is_furnished: bool,
}

/// A board, a cupboard and a shelf 20 to 30 cm from the table.
fn furniture() -> [Panel; 3] {
    [
        Panel::upright([-0.3, -0.2], [0.5, -0.2], [-0.3, 0.5], 0.75),
        Panel::upright([-0.3, 0.1], [-0.3, 0.8], [-0.5, 0.6], 0.8),
        Panel::upright([-0.1, 0.8], [0.6, 0.75], [-0.5, 0.6], 0.7),
    ]
}

/// How far each microphone is from where it is taken to be, m.
const MISPLACED_M: [[f64; 3]; 3] =
    [[3.7e-3, -2.2e-3, 1.1e-3], [-3.0e-3, 3.3e-3, -1.9e-3], [0.7e-3, 4.1e-3, 3.0e-3]];

pub(crate) const FURNISHED: Place =
    Place { name: "a living room with furniture, echo of 0.3 s", is_furnished: true };

pub(crate) const BARE: Place = Place { name: "a bare living room, echo of 0.3 s", is_furnished: false };

impl Place {
    pub(crate) fn room(&self) -> Result<Room, Failure> {
        let panels = furniture();
        Ok(Court::living_room(0.3)?.furnished(if self.is_furnished { &panels } else { &[] })?)
    }

    /// Where the microphones of a room are taken to be, m.
    pub(crate) fn microphones_m(&self, room: &Room) -> Vec<[f64; 3]> {
        let off = if self.is_furnished { 1.0 } else { 0.0 };
        let one = |(m, d): (&[f64; 3], &[f64; 3])| std::array::from_fn(|k| m[k] + off * d[k]);
        room.microphones_m().iter().zip(&MISPLACED_M).map(one).collect()
    }
}

/// What became of taps at known places.
pub(crate) struct Taps {
    pub(crate) count: usize,
    /// Errors of those that were heard, m.
    pub(crate) errors_m: Vec<f64>,
}

impl Taps {
    pub(crate) fn mean_m(&self) -> f64 {
        mean(self.errors_m.iter().copied().filter(|e| *e <= OUTLIER_M))
    }

    pub(crate) fn outliers(&self) -> usize {
        self.errors_m.iter().filter(|e| **e > OUTLIER_M).count()
    }

    /// How impacts are heard, as far as the taps tell.
    pub(crate) fn hearing(&self) -> HearingError {
        let rate = |n: usize| (n as f64 / self.count.max(1) as f64).clamp(0.01, 0.5);
        let sigma = |wrong: bool| {
            let errors = self.errors_m.iter().filter(|e| (**e > OUTLIER_M) == wrong);
            (0.5 * mean(errors.map(|e| e * e))).sqrt()
        };
        let (sigma_m, outlier_sigma_m) = (sigma(false), sigma(true));
        let default = HearingError::default();
        HearingError {
            sigma_m: if sigma_m > 0.0 { sigma_m } else { default.sigma_m },
            outliers: rate(self.outliers()),
            outlier_sigma_m: if outlier_sigma_m > 0.0 { outlier_sigma_m } else { default.outlier_sigma_m },
            unheard: rate(self.count - self.errors_m.len()),
            ..default
        }
    }
}

/// The mean; 0 of none.
pub(crate) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), v| (sum + v, n + 1.0));
    if n > 0.0 { sum / n } else { 0.0 }
}

/// Taps all over the table, each heard in a stream: a calibration before anything is thrown.
pub(crate) fn taps(place: &Place, delays: Delays, count: usize) -> Result<Taps, Failure> {
    let room = place.room()?;
    let errors = each(count, 41, |_, rng| -> Result<Option<f64>, Failure> {
        let at = [0, 1].map(|_| 0.03 + 0.49 * rng.random::<f64>());
        let rate_hz = room.rate_hz();
        let mut channels = vec![vec![0.0; (0.16 * rate_hz) as usize]; room.microphones_m().len()];
        let at_s = LEAD_S + rng.random::<f64>() / rate_hz;
        room.strike([at[0], at[1], 0.0], at_s, &Burst::new(0.035, rng), &mut channels);
        let frames: Vec<f32> = (0..channels[0].len())
            .flat_map(|i| channels.iter().map(move |x| x[i]))
            .map(|x| (x + 1e-3 * rng.sample::<f64, _>(StandardNormal)) as f32)
            .collect();
        let settings = HearSettings::default();
        let (c, microphones) = (room.speed_m_s(), place.microphones_m(&room));
        let mut listener = Listener::new(&microphones, rate_hz, c, &settings, delays)?;
        let mut heard = None;
        listener.push(0.0, &frames, |s| {
            if let (Sounded::Impact(p), None) = (s, heard) {
                heard = Some((p.location.x_m - at[0]).hypot(p.location.y_m - at[1]));
            }
        })?;
        Ok(heard)
    });
    let errors: Result<Vec<Option<f64>>, Failure> = errors.into_iter().collect();
    Ok(Taps { count, errors_m: errors?.into_iter().flatten().collect() })
}
