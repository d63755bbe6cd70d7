use std::f64::consts::TAU;

use super::drain_fit::DrainFit;
use super::mode::{ModeFit, fit_mode};
use super::{Bottle, ViscosityError, checked};
use crate::slosh::UprightCylinder;

/// The first mode's frequency lies within these shares of the theory's (surface tension, a bottom that is not flat, a fill that is
/// somewhat off, and damping shift it).
const BAND: [f64; 2] = [0.8, 1.25];
/// A mode or a film is felt where its amplitude is above this many of its standard errors.
const FELT: f64 = 5.0;
/// A film has developed after this many times the root of the wall's length above the pool over gravity.
const DEVELOPED: f64 = 3.0;
/// Fewest readings.
const LEAST: usize = 20;
/// A shallower layer than this share of the radius has no mode and no film to speak of.
const SHALLOW: f64 = 0.05;
/// Damping ratios above this one are not of a law of thin boundary layers.
const MOST_DAMPING: f64 = 0.5;

/// Which of the two motions the readings show.
#[derive(Debug, Clone, PartialEq)]
pub enum Regime {
    /// The surface swings and decays.
    Oscillating(ModeFit),
    /// The liquid drains down the wall.
    Draining {
        /// The reading that the drain ends at.
        offset: f64,
        /// Standard deviation of the residuals.
        sigma: f64,
    },
}

/// A viscosity with its 95 % interval.
#[derive(Debug, Clone, PartialEq)]
pub struct ViscosityEstimate {
    /// Kinematic viscosity, m^2/s.
    pub kinematic_m2_s: f64,
    /// The kinematic viscosity's 95 % interval, m^2/s: the readings' noise, and for a drain the error of the mass; not the error of the
    /// law itself.
    pub interval_m2_s: [f64; 2],
    /// Dynamic viscosity, Pa s: the kinematic one times mass over volume.
    pub dynamic_pa_s: f64,
    /// What was seen.
    pub regime: Regime,
}

/// Why the readings do not tell the viscosity.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// There is no liquid, or a layer too shallow to move as the laws have it.
    Empty {
        /// Level of the liquid over the radius.
        level_over_radius: f64,
        /// The least at which the laws are used.
        least: f64,
    },
    /// The readings end too soon.
    TooShort {
        /// How long they last, s.
        got_s: f64,
        /// How long they should, s.
        least_s: f64,
    },
    /// No motion stands out of the noise.
    NothingMoves {
        /// Standard deviation of the readings, in their unit.
        spread: f64,
    },
    /// Something moves, but the viscosity is open by more than the widest factor.
    TooNoisy {
        /// The interval, m^2/s.
        interval_m2_s: [f64; 2],
        /// The widest allowed ratio of its ends.
        widest_factor: f64,
    },
    /// Something moves that is neither the first mode nor a drain.
    NeitherLaw {
        /// Correlation, over half a period of the mode, of what the nearer law leaves.
        correlation: f64,
    },
}

/// What the readings say.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// A viscosity.
    Viscosity(ViscosityEstimate),
    /// No viscosity, and why.
    Refused(Refusal),
}

/// The viscosity from the torque about the horizontal axis after a bottle has been swung from its side to upright.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViscosityFit {
    /// The bottle.
    pub bottle: Bottle,
    /// Standard error of the liquid's mass over that mass (0 where it is exact): a drain is weighed, so that it counts.
    pub mass_error_share: f64,
    /// How long gravity has pulled along the wall before the first time (t = 0), s: for a turn from its side to upright at a
    /// constant rate `2 / pi` of its duration.
    pub head_start_s: f64,
    /// An interval whose ends differ by more than this factor is a refusal (above 1; 4 is usual).
    pub widest_factor: f64,
}

impl ViscosityFit {
    /// The viscosity from readings of the torque (N m) at times (s) after the bottle stands upright.
    ///
    /// # Errors
    /// [`ViscosityError`] for readings or settings that are none; what the readings leave open is a [`Verdict::Refused`].
    pub fn estimate(&self, t_s: &[f64], tau_z_nm: &[f64]) -> Result<Verdict, ViscosityError> {
        self.check()?;
        checked(t_s, tau_z_nm, LEAST)?;
        if let Some(first) = t_s.first().filter(|t| **t < 0.0) {
            let expected = "0 or more";
            return Err(ViscosityError::Reading { index: 0, what: "time", got: *first, expected });
        }
        let bottle = &self.bottle;
        let level = bottle.level_m() / bottle.radius_m;
        if !(level >= SHALLOW && bottle.mass_kg > 0.0) {
            return Ok(Verdict::Refused(Refusal::Empty { level_over_radius: level, least: SHALLOW }));
        }
        let cylinder = UprightCylinder::new(bottle.radius_m, bottle.level_m(), bottle.gravity_m_s2)
            .map_err(|_| ViscosityError::Range { name: "bottle", got: level, expected: "sizes above 0" })?;
        let omega = cylinder.angular_frequency_rad_s(0, 0.0);
        let wall = (bottle.length_m - bottle.level_m()).max(0.0);
        let developed = DEVELOPED * (wall / bottle.gravity_m_s2).sqrt();
        let (got_s, least_s) = (t_s[t_s.len() - 1] - t_s[0], developed + TAU / omega);
        let from = t_s.partition_point(|t| *t < developed);
        if got_s < least_s || t_s.len() - from < LEAST {
            return Ok(Verdict::Refused(Refusal::TooShort { got_s, least_s }));
        }
        let mode = fit_mode(t_s, tau_z_nm, BAND.map(|share| share * omega)).ok();
        let drain =
            DrainFit::new(bottle, self.head_start_s, self.mass_error_share, &t_s[from..], &tau_z_nm[from..]);
        Ok(self.judge(&cylinder, mode, drain, t_s, tau_z_nm, from))
    }

    fn check(&self) -> Result<(), ViscosityError> {
        let b = &self.bottle;
        let range = |name, got: f64, expected, fine: bool| {
            if fine { Ok(()) } else { Err(ViscosityError::Range { name, got, expected }) }
        };
        for (name, got) in
            [("radius_m", b.radius_m), ("length_m", b.length_m), ("gravity_m_s2", b.gravity_m_s2)]
        {
            range(name, got, "above 0", got > 0.0 && got.is_finite())?;
        }
        for (name, got) in [
            ("volume_m3", b.volume_m3),
            ("mass_kg", b.mass_kg),
            ("mass_error_share", self.mass_error_share),
            ("head_start_s", self.head_start_s),
        ] {
            range(name, got, "0 or more", got >= 0.0 && got.is_finite())?;
        }
        range("widest_factor", self.widest_factor, "above 1", self.widest_factor > 1.0)
    }

    fn judge(
        &self,
        cylinder: &UprightCylinder,
        mode: Option<ModeFit>,
        drain: Option<DrainFit>,
        t_s: &[f64],
        reading: &[f64],
        from: usize,
    ) -> Verdict {
        let step_s = (t_s[t_s.len() - 1] - t_s[0]) / (t_s.len() - 1) as f64;
        let half_period_s = 0.5 * TAU / cylinder.angular_frequency_rad_s(0, 0.0);
        let rows = (half_period_s / step_s).ceil() as usize;
        let left = |m: &ModeFit| -> Vec<f64> {
            t_s.iter().zip(reading).map(|(t, y)| y - m.at(t - t_s[0])).collect()
        };
        let swings =
            mode.filter(|m| m.amplitude() > FELT * m.amplitude_error && m.damping_ratio < MOST_DAMPING);
        let drains = drain.filter(|d| d.fall > FELT * d.fall_error);
        // Both are judged on the rows where the film has developed. Sums of squares of noise differ by a few of their standard deviations.
        let slack = 1.0 + 1.5 * (2.0 / (reading.len() - from) as f64).sqrt();
        match (swings, drains) {
            (Some(mode), drain) => {
                let residuals = left(&mode);
                let late: f64 = residuals[from..].iter().map(|r| r * r).sum();
                match drain {
                    Some(drain) if drain.fit.squares() * slack < late => self.drained(&drain, rows),
                    _ => {
                        let interval = mode.damping_interval().map(|g| cylinder.kinematic_viscosity_m2_s(g));
                        let viscosity = cylinder.kinematic_viscosity_m2_s(mode.damping_ratio);
                        self.answer(
                            viscosity,
                            interval,
                            autocorrelation(&residuals, rows),
                            Regime::Oscillating(mode),
                        )
                    }
                }
            }
            (None, Some(drain)) => self.drained(&drain, rows),
            (None, None) => {
                let correlation = autocorrelation(reading, rows);
                let spread = spread(reading);
                Verdict::Refused(if correlation > NEITHER {
                    Refusal::NeitherLaw { correlation }
                } else {
                    Refusal::NothingMoves { spread }
                })
            }
        }
    }

    fn drained(&self, drain: &DrainFit, rows: usize) -> Verdict {
        let regime = Regime::Draining { offset: drain.fit.params[1], sigma: drain.fit.sigma() };
        self.answer(
            drain.viscosity(),
            drain.interval(),
            autocorrelation(drain.fit.residuals.as_slice(), rows),
            regime,
        )
    }

    fn answer(&self, kinematic: f64, interval: [f64; 2], correlation: f64, regime: Regime) -> Verdict {
        if correlation > NEITHER {
            return Verdict::Refused(Refusal::NeitherLaw { correlation });
        }
        if !(interval[1] <= self.widest_factor * interval[0]) {
            let widest_factor = self.widest_factor;
            return Verdict::Refused(Refusal::TooNoisy { interval_m2_s: interval, widest_factor });
        }
        Verdict::Viscosity(ViscosityEstimate {
            kinematic_m2_s: kinematic,
            interval_m2_s: interval,
            dynamic_pa_s: kinematic * self.bottle.density_kg_m3(),
            regime,
        })
    }
}

/// Residuals whose correlation over half a period of the mode is above this are motion that the law does not have; noise, even
/// smoothed over a tenth of a period, forgets sooner.
const NEITHER: f64 = 0.5;

/// Standard deviation.
fn spread(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// Autocorrelation of values at a lag of that many rows; 0 of values that are all alike.
fn autocorrelation(values: &[f64], lag: usize) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let whole: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let pairs = values.iter().zip(&values[lag.min(values.len())..]);
    let along: f64 = pairs.map(|(a, b)| (a - mean) * (b - mean)).sum();
    if whole > 0.0 { along / whole } else { 0.0 }
}
