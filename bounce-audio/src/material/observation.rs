//! What is observed of one drop.

use super::error::MaterialError;
use super::spectrum::{Analyser, BANDS, CONTACT, FEATURES, LATE_S, middle_hz};
use crate::chain::{Candidate, impacts};
use crate::onset::{Listened, OnsetSettings};
use crate::quantile::quantile;
use crate::wav::Sound;
use std::f64::consts::PI;

/// Impacts of a drop that are listened to at most.
const MOST: usize = 5;
/// Speed that is taken where none is known, m/s, and one sigma of its logarithm.
const SPEED: [f64; 2] = [1.5, 0.5];
/// Contact times go with this power of the speed (Hertz).
const POWER: f64 = -0.2;
/// Least ratio of an impact's power to the noise's, dB.
const LEAST_DB: f64 = 6.0;
/// Greatest sample rate, Hz.
const GREATEST_HZ: f64 = 400e3;
/// Samples in a row at the end of the range that are clipped.
const CLIPPED: usize = 3;
/// A sound at this share of the impacts' median amplitude, or louder, has to be one of the ball's.
const LOUD: f64 = 0.4;
const GRAVITY: f64 = 9.80665;

/// What is known of a ball and of its drop besides the sound.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Given {
    /// Mass, kg.
    pub mass_kg: Option<f64>,
    /// Diameter, m.
    pub diameter_m: Option<f64>,
    /// Height that it was let go at, m.
    pub height_m: Option<f64>,
}

/// What is observed of one drop: features of its sound, its restitution, its density and size.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Features of each impact that was listened to; NaN where the sample rate shows none.
    pub(super) sounds: Vec<[f64; FEATURES]>,
    /// Variance that the contact time's feature has from speeds that are not known.
    pub(super) speed_variance: f64,
    /// Logarithm of e / (1 - e).
    pub(super) logit_restitution: Option<f64>,
    /// Logarithm of mass over the volume of a sphere, kg/m^3.
    pub(super) ln_density: Option<f64>,
    /// Logarithm of the diameter, m.
    pub(super) ln_diameter: Option<f64>,
}

impl Observation {
    /// Listens to the first channel of a drop's recording (full scale any): impacts, their flights and their spectra.
    ///
    /// # Errors
    /// [`MaterialError`]: no impact, several balls, all impacts clipped, in the noise or too close to each other, a rate below 5.3 kHz, a mass or
    /// size that is not above 0.
    pub fn of(sound: &Sound, given: &Given) -> Result<Self, MaterialError> {
        let (rate_hz, least) = (sound.rate_hz, Analyser::least_rate_hz());
        if !(rate_hz >= least) {
            return Err(MaterialError::Rate { least, got: rate_hz });
        }
        if rate_hz > GREATEST_HZ {
            let expected = "at most 400 kHz";
            return Err(MaterialError::Value { what: "the sample rate", expected, got: rate_hz });
        }
        let (ln_density, ln_diameter) = weighed(given)?;
        let x = sound.channels.first().map(Vec::as_slice).unwrap_or_default();
        let seconds = x.len() as f64 / rate_hz;
        // A dead channel has no noise to be louder than.
        if !x.iter().any(|v| *v != 0.0) && x.iter().all(|v| v.is_finite()) {
            return Err(MaterialError::Silent { seconds });
        }
        let limit = x.iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let (all, kept) = chain(x, rate_hz, limit)?;
        if kept.is_empty() {
            return Err(MaterialError::Silent { seconds });
        }
        let flights: Vec<f64> = kept.windows(2).map(|w| w[1] - w[0]).collect();
        let restitution = restitution(&flights, given.height_m);
        let (mut sounds, mut known, mut loudest_db) = (Vec::new(), 0, f64::NEG_INFINITY);
        let (mut alone, mut clipped) = (0, 0);
        let analyser = Analyser::new(x, rate_hz);
        for (k, &at_s) in kept.iter().enumerate() {
            let next = all.iter().copied().find(|t| *t > at_s).unwrap_or(seconds);
            if next - at_s < LATE_S + 1e-3 || sounds.len() == MOST {
                continue;
            }
            alone += 1;
            if is_clipped(x, rate_hz, at_s, limit) {
                clipped += 1;
                continue;
            }
            let mut timbre = analyser.timbre(x, at_s);
            let db = 10.0 * timbre.over_noise.log10();
            loudest_db = loudest_db.max(db);
            if db < LEAST_DB {
                continue;
            }
            let speed = speed(k, &flights, restitution, given.height_m);
            known += usize::from(speed.is_some());
            timbre.features[CONTACT] -= POWER * speed.unwrap_or(SPEED[0]).ln();
            sounds.push(timbre.features);
        }
        if sounds.is_empty() {
            return Err(if alone == 0 {
                MaterialError::Crowded { heard: all.len(), needed_s: LATE_S }
            } else if clipped == alone {
                MaterialError::Clipped { clipped, heard: all.len() }
            } else {
                MaterialError::Quiet { least_db: LEAST_DB, got_db: loudest_db }
            });
        }
        let unknown = 1.0 - known as f64 / sounds.len() as f64;
        Ok(Self {
            sounds,
            speed_variance: unknown * (POWER * SPEED[1]).powi(2),
            logit_restitution: restitution.map(|e| (e / (1.0 - e)).ln()),
            ln_density,
            ln_diameter,
        })
    }

    /// The same, of a drop that was only weighed and measured: nothing was heard.
    ///
    /// # Errors
    /// [`MaterialError::Value`] for a mass or size that is not above 0; [`MaterialError::Blind`] without both.
    pub fn weighed(given: &Given) -> Result<Self, MaterialError> {
        let (ln_density, ln_diameter) = weighed(given)?;
        if ln_density.is_none() {
            return Err(MaterialError::Blind { senses: "mass and diameter".into() });
        }
        Ok(Self { sounds: Vec::new(), speed_variance: 0.0, logit_restitution: None, ln_density, ln_diameter })
    }

    /// How many impacts were listened to.
    pub fn impacts(&self) -> usize {
        self.sounds.len()
    }

    /// The restitution that the flights show: the median over the drop, 0 to 1.
    pub fn restitution(&self) -> Option<f64> {
        self.logit_restitution.map(|l| 1.0 / (1.0 + (-l).exp()))
    }

    /// Mass over the volume of a sphere, kg/m^3, where both were given.
    pub fn density_kg_m3(&self) -> Option<f64> {
        self.ln_density.map(f64::exp)
    }

    /// Levels of half octaves of the impacts' sound: middle (Hz), and dB over the lowest, mean over the drop. Those that the sample rate shows.
    pub fn levels_db(&self) -> Vec<[f64; 2]> {
        let n = self.sounds.len() as f64;
        let mut level = 0.0;
        let slopes = (0..BANDS - 1).map(|k| self.sounds.iter().map(|s| s[k]).sum::<f64>() / n);
        let above = slopes.take_while(|s| s.is_finite()).enumerate().map(|(k, slope)| {
            level += 10.0 / std::f64::consts::LN_10 * slope;
            [middle_hz(k + 1), level]
        });
        std::iter::once([middle_hz(0), 0.0]).chain(above).collect()
    }

    /// How long impacts of 1 m/s would touch the table (s): the geometric mean over the drop.
    pub fn contact_time_s(&self) -> Option<f64> {
        let n = self.sounds.len() as f64;
        let mean = self.sounds.iter().map(|s| s[CONTACT]).sum::<f64>() / n;
        (n > 0.0).then(|| mean.exp())
    }

    /// The same with the first impacts alone, and no restitution: as if the ball had been caught.
    #[must_use]
    pub fn first(&self, impacts: usize) -> Self {
        let sounds = self.sounds.iter().take(impacts).copied().collect();
        Self { sounds, logit_restitution: None, ..self.clone() }
    }
}

/// Logarithms of mean density and diameter.
fn weighed(given: &Given) -> Result<(Option<f64>, Option<f64>), MaterialError> {
    let sizes =
        [("the mass", given.mass_kg), ("the diameter", given.diameter_m), ("the height", given.height_m)];
    for (what, got) in sizes.into_iter().filter_map(|(what, v)| Some((what, v?))) {
        if !(got > 0.0 && got.is_finite()) {
            return Err(MaterialError::Value { what, expected: "a finite number above 0", got });
        }
    }
    let density = given.mass_kg.zip(given.diameter_m).map(|(m, d)| (6.0 * m / (PI * d.powi(3))).ln());
    Ok((density, given.diameter_m.map(f64::ln)))
}

/// All sounds, and those of the ball, s.
fn chain(x: &[f64], rate_hz: f64, limit: f64) -> Result<(Vec<f64>, Vec<f64>), MaterialError> {
    let usual = OnsetSettings::default();
    let settings = OnsetSettings { high_pass_hz: usual.high_pass_hz.min(0.1 * rate_hz), ..usual };
    let onsets = Listened::new(&[x.to_vec()], rate_hz, settings)?.onsets();
    let heard: Vec<Candidate> =
        onsets.iter().map(|o| Candidate { t_s: o.first().t_s, loudness: o.amplitude_sigmas.ln() }).collect();
    let all: Vec<f64> = heard.iter().map(|c| c.t_s).collect();
    let clipped = all.iter().filter(|t| is_clipped(x, rate_hz, **t, limit)).count();
    if 2 * clipped > all.len() {
        return Err(MaterialError::Clipped { clipped, heard: all.len() });
    }
    let chosen = impacts(std::slice::from_ref(&heard)).pop().unwrap_or_default();
    let mut loudness: Vec<f64> = chosen.iter().map(|&i| heard[i].loudness).collect();
    let loud = quantile(&mut loudness, 0.5).unwrap_or(0.0) + LOUD.ln();
    let left_out = (0..heard.len()).filter(|i| !chosen.contains(i) && heard[*i].loudness >= loud).count();
    // One stray sound may be anything; of three that are no chain all are kept, and there is nothing to be left out.
    if left_out >= 2 {
        return Err(MaterialError::SeveralBalls { left_out, heard: heard.len() });
    }
    Ok((all, chosen.into_iter().map(|i| heard[i].t_s).collect()))
}

/// The median ratio of neighbouring flights, or what one flight shows of a drop from a known height.
fn restitution(flights_s: &[f64], height_m: Option<f64>) -> Option<f64> {
    let mut ratios: Vec<f64> = flights_s.windows(2).map(|w| w[1] / w[0]).collect();
    let by_height = || {
        let (first, height) = (flights_s.first()?, height_m?);
        Some(0.5 * GRAVITY * first / (2.0 * GRAVITY * height).sqrt())
    };
    quantile(&mut ratios, 0.5).or_else(by_height).filter(|e| (0.02..0.995).contains(e))
}

/// Speed at which an impact came down, m/s.
fn speed(impact: usize, flights_s: &[f64], restitution: Option<f64>, height_m: Option<f64>) -> Option<f64> {
    if impact > 0 {
        return flights_s.get(impact - 1).map(|t| 0.5 * GRAVITY * t);
    }
    let by_flight = || Some(0.5 * GRAVITY * flights_s.first()? / restitution?);
    height_m.map(|h| (2.0 * GRAVITY * h).sqrt()).or_else(by_flight)
}

/// Whether a sound that begins at a time (s) stays at the end of the range.
fn is_clipped(x: &[f64], rate_hz: f64, at_s: f64, limit: f64) -> bool {
    let from = ((at_s - 1e-3) * rate_hz).max(0.0) as usize;
    let to = (((at_s + LATE_S) * rate_hz) as usize).min(x.len());
    let mut run = 0;
    x.get(from..to).unwrap_or_default().windows(2).any(|w| {
        run = if w[0] == w[1] && w[0].abs() >= 0.999 * limit { run + 1 } else { 0 };
        run + 1 >= CLIPPED
    })
}
