//! How firm the tip is: effective modulus against pressure, normal force, smallest force that shows.
//!
//! The tip is treated as an elastic ball (section 5.3): `F = 4/3 E/(1 - nu^2) sqrt(R) delta^(3/2)` with
//! `1/R = 1/R_tip + 1/R_probe`, which corrects eqs 5.1 to 5.3.

use hertz_contact::calibrated::{Beyond, Calibrated, distinct};
use hertz_contact::fit::{Curve, Fit, FitError, Loss, Workspace};
use hertz_contact::indenter::{Indenter, effective_radius_m};
use hertz_contact::law::{Elastic, InverseError, Law, LawError};

use crate::load::SLACK;
use crate::regression::Linear;

/// Poisson's ratio of rubber.
pub const POISSON_RATIO: f64 = 0.5;

/// Why there is no modulus or force.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ModulusError {
    /// The curve cannot be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// A length or a modulus that makes no contact.
    #[error(transparent)]
    Law(#[from] LawError),
    /// No indentation has that force.
    #[error(transparent)]
    Inverse(#[from] InverseError),
    /// A number out of range.
    #[error("{what} is {got}; expected {expected}")]
    Value {
        /// Which.
        what: &'static str,
        /// What it has to be.
        expected: &'static str,
        /// What it is.
        got: f64,
    },
    /// Too few states for a curve.
    #[error("moduli at {got} different pressures; expected {expected} or more")]
    TooFew {
        /// Least number.
        expected: usize,
        /// Different pressures.
        got: usize,
    },
    /// A pressure beyond the calibrated ones.
    #[error(transparent)]
    Beyond(#[from] Beyond),
}

/// What is pressed onto what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Radius of the tip, m.
    pub tip_m: f64,
    /// Radius of the probe, m; infinite for a plate.
    pub probe_m: f64,
}

impl Pair {
    fn indenter(&self) -> Result<Indenter, ModulusError> {
        for (what, got) in [("the tip's radius", self.tip_m), ("the probe's radius", self.probe_m)] {
            if !(got > 0.0) {
                return Err(ModulusError::Value { what, expected: "above 0", got });
            }
        }
        let indenter = Indenter::Sphere { radius_m: effective_radius_m(self.tip_m, self.probe_m) };
        indenter.check()?;
        Ok(indenter)
    }
}

/// Young's modulus E of the ball that the tip resembles, at one pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effective {
    /// E, Pa.
    pub modulus_pa: f64,
    /// Its 95 % interval, by profile likelihood.
    pub interval_pa: (f64, f64),
    /// Where the tip was touched, m on the stage's scale.
    pub contact_m: f64,
    /// Whether the residuals have a trend: the tip is no elastic ball over this range.
    pub misfit: bool,
}

/// Modulus from an indentation at one pressure; the contact point is looked for (a touch read off by hand shifts the modulus by
/// 15 % for a tenth of the depth).
///
/// # Errors
/// [`ModulusError::Value`], [`ModulusError::Fit`].
pub fn effective(indentation_m: &[f64], force_n: &[f64], pair: &Pair) -> Result<Effective, ModulusError> {
    let fit = Fit { loss: Loss::Square, ..Fit::new(pair.indenter()?, POISSON_RATIO) };
    let curve = Curve { indentation_m, force_n, sigma_n: None };
    let report = fit.run(&[curve], &mut Workspace::new())?;
    let of_curve = report.curves.first();
    Ok(Effective {
        modulus_pa: report.modulus_pa,
        interval_pa: report.modulus_interval_pa,
        contact_m: of_curve.map_or(f64::NAN, |c| c.contact_m),
        misfit: of_curve.is_some_and(|c| c.flags.misfit),
    })
}

/// A modulus and a tip radius that were measured at a pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Gauge pressure, Pa.
    pub pressure_pa: f64,
    /// Effective modulus E, Pa.
    pub modulus_pa: f64,
    /// Radius of the tip, m.
    pub tip_m: f64,
}

/// Effective modulus and tip radius over the pressure: quadratic from five pressures on, else linear.
#[derive(Debug, Clone, PartialEq)]
pub struct Stiffness {
    modulus: Linear,
    radius: Linear,
    degree: usize,
    pressure_pa: Calibrated,
}

/// A value with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounded {
    /// The value.
    pub value: f64,
    /// Its interval.
    pub interval: (f64, f64),
}

impl Stiffness {
    /// Fits measured states, at three different pressures or more.
    ///
    /// # Errors
    /// [`ModulusError::Value`], [`ModulusError::TooFew`].
    pub fn fit(states: &[State]) -> Result<Self, ModulusError> {
        for s in states {
            for (what, got, holds) in [
                ("a pressure", s.pressure_pa, s.pressure_pa >= 0.0),
                ("a modulus", s.modulus_pa, s.modulus_pa > 0.0),
                ("a tip radius", s.tip_m, s.tip_m > 0.0),
            ] {
                if !(holds && got.is_finite()) {
                    return Err(ModulusError::Value { what, expected: "a finite number, not below 0", got });
                }
            }
        }
        let pressures = distinct(states.iter().map(|s| s.pressure_pa));
        let too_few = ModulusError::TooFew { expected: 3, got: pressures.len() };
        if pressures.len() < 3 {
            return Err(too_few);
        }
        let degree = if pressures.len() >= 5 { 2 } else { 1 };
        let fit = |of: fn(&State) -> f64, degree: usize| {
            let rows: Vec<Vec<f64>> = states.iter().map(|s| powers(s.pressure_pa, degree)).collect();
            let values: Vec<f64> = states.iter().map(of).collect();
            Linear::fit(&rows, &values).ok_or(too_few)
        };
        let (modulus, radius) = (fit(|s| s.modulus_pa, degree)?, fit(|s| s.tip_m, 1)?);
        let pressure_pa = Calibrated::over("the pressure in Pa", pressures, SLACK);
        Ok(Self { modulus, radius, degree, pressure_pa })
    }

    /// Modulus E in Pa at a pressure.
    ///
    /// # Errors
    /// [`ModulusError::Beyond`].
    pub fn modulus_pa(&self, pressure_pa: f64) -> Result<Bounded, ModulusError> {
        self.pressure_pa.check(pressure_pa)?;
        let (value, error) = self.modulus.at(&powers(pressure_pa, self.degree));
        let half = self.modulus.half_width() * error;
        Ok(Bounded { value, interval: (value - half, value + half) })
    }

    /// Radius of the tip in m at a pressure.
    ///
    /// # Errors
    /// [`ModulusError::Beyond`].
    pub fn tip_m(&self, pressure_pa: f64) -> Result<f64, ModulusError> {
        self.pressure_pa.check(pressure_pa)?;
        Ok(self.radius.at(&powers(pressure_pa, 1)).0)
    }

    /// Force in N of a tip that is pressed in by a probe (radius in m, infinite for a plate): eq. 5.3, corrected. The interval has
    /// the modulus's and that of an indentation with the given standard deviation.
    ///
    /// # Errors
    /// [`ModulusError`].
    pub fn force_n(
        &self,
        pressure_pa: f64,
        indentation_m: f64,
        indentation_sigma_m: f64,
        probe_m: f64,
    ) -> Result<Bounded, ModulusError> {
        for (what, got) in [
            ("the indentation", indentation_m),
            ("the indentation's standard deviation", indentation_sigma_m),
        ] {
            if !(got >= 0.0 && got.is_finite()) {
                return Err(ModulusError::Value { what, expected: "a finite number, 0 or more", got });
            }
        }
        let modulus = self.modulus_pa(pressure_pa)?;
        let indenter = Pair { tip_m: self.tip_m(pressure_pa)?, probe_m }.indenter()?;
        let law = |modulus_pa: f64| Elastic { indenter, modulus_pa, poisson_ratio: POISSON_RATIO };
        law(modulus.value).check()?;
        let (value, slope) = law(modulus.value).both(indentation_m);
        let of_modulus = law(modulus.interval.1).force(indentation_m) - value;
        let half = of_modulus.hypot(1.96 * slope * indentation_sigma_m);
        Ok(Bounded { value, interval: ((value - half).max(0.0), value + half) })
    }

    /// Smallest force in N that shows at a pressure (figure 5.7): that of the smallest indentation that the camera sees.
    ///
    /// # Errors
    /// [`ModulusError`].
    pub fn smallest_force_n(
        &self,
        pressure_pa: f64,
        smallest_indentation_m: f64,
        probe_m: f64,
    ) -> Result<Bounded, ModulusError> {
        self.force_n(pressure_pa, smallest_indentation_m, 0.0, probe_m)
    }
}

/// Eq. 5.3 of [Matl 2021] as printed, by whose factor of 4/6 its figure 5.11 was drawn: `F = 4/6 sqrt(R) E* delta^(3/2)`. It is 3/8 of the
/// corrected one with nu = 1/2.
pub fn printed_force_n(modulus_pa: f64, tip_m: f64, indentation_m: f64) -> f64 {
    4.0 / 6.0 * tip_m.sqrt() * modulus_pa * indentation_m.max(0.0).powf(1.5)
}

/// Smallest indentation in m that `markers` markers show at once: each has noise `sigma_px` an axis, and moves
/// `gain_px_m` for each metre of indentation (root mean square over the markers). Seen in nine of ten pictures, feigned by
/// noise in one of a thousand: `(z_0.999 + z_0.9) sigma / (gain sqrt(n))`.
///
/// # Errors
/// [`ModulusError::Value`].
pub fn smallest_indentation_m(sigma_px: f64, gain_px_m: f64, markers: usize) -> Result<f64, ModulusError> {
    let count = markers as f64;
    for (what, got) in [("the noise", sigma_px), ("the gain", gain_px_m), ("the number of markers", count)] {
        if !(got > 0.0 && got.is_finite()) {
            return Err(ModulusError::Value { what, expected: "a finite number above 0", got });
        }
    }
    // Quantiles of the normal distribution.
    const SUM: f64 = 3.090_232_306_167_813 + 1.281_551_565_544_600_4;
    Ok(SUM * sigma_px / (gain_px_m * count.sqrt()))
}

fn powers(x: f64, degree: usize) -> Vec<f64> {
    (0..=degree).map(|k| x.powi(k as i32)).collect()
}
