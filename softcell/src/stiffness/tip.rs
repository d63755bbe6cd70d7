//! The tip as a spring: its modulus over pressure and contact, calibrated on gels of known modulus.

use hertz_contact::calibrated::{Beyond, Calibrated, distinct};

use crate::load::SLACK;
use crate::regression::Linear;

/// Why there is no calibrated tip.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TipError {
    /// A number that is none of a press: pressures are zero or more, all else is above zero.
    #[error(
        "sample {sample}: {what} is {got}; expected a finite number, a pressure from 0 on and all else above 0"
    )]
    Value {
        /// Its index.
        sample: usize,
        /// Which column.
        what: &'static str,
        /// Its value.
        got: f64,
    },
    /// The samples do not determine the modulus.
    #[error(
        "{samples} samples at {pressures} pressures do not determine the tip's modulus: press it on gels of known modulus, at three pressures or more, to several depths"
    )]
    Undetermined {
        /// Samples.
        samples: usize,
        /// Different pressures.
        pressures: usize,
    },
}

/// The tip pressed on a flat gel whose modulus is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// Gauge pressure, Pa, zero or more.
    pub pressure_pa: f64,
    /// Indentation of the tip at its apex, by the camera, m, above 0.
    pub tip_m: f64,
    /// Indentation of the gel: what the travel has beside that of the tip, m, above 0.
    pub gel_m: f64,
    /// Radius of the contact, by the camera, m, above 0.
    pub contact_m: f64,
    /// Modulus of the gel in plane strain, `E/(1 - nu^2)`, Pa, above 0.
    pub gel_pa: f64,
}

/// Modulus `E*` of the tip in plane strain: two bodies share one contact of radius a and one force `F = 4/3 E* a delta` (Johnson 1985, eqs 4.22 to 4.24), so that moduli are to each
/// other inversely as indentations, whatever the bodies' curvature.
#[derive(Debug, Clone, PartialEq)]
pub struct TipModulus {
    linear: Linear,
    /// Samples of a curve, on average.
    of_curve: f64,
    pressure_pa: Calibrated,
    contact_m: Calibrated,
}

/// A tip's modulus in one state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipState {
    /// `E*`, Pa.
    pub modulus_pa: f64,
    /// Part of it that grows with the square of the tip's indentation, Pa.
    pub stretched_pa: f64,
    /// Part of it that is there without pressure: the rubber's, from 0 to 1.
    pub rubber_share: f64,
    /// Standard deviation of the fit there, as a share: what scatters about it is the model's error.
    pub error_share: f64,
}

/// Contact and indentation of the regression, m.
const CONTACT_M: f64 = 0.008;
const TIP_M: f64 = 0.002;
/// Terms without pressure.
const RUBBER: usize = 4;
/// The one that grows with the square of the tip's indentation.
const STRETCHED: usize = 3;

impl TipModulus {
    /// Fits samples by least squares, relative to their moduli: `E* = c0 + c1 a + c2 a^2 + c3 delta^2/a + p (c4 + c5/a + c6 a) + c7 p^2`. The
    /// term with delta is the tension of a skin that is stretched by its slopes.
    ///
    /// # Errors
    /// [`TipError`].
    pub fn fit(samples: &[Calibration]) -> Result<Self, TipError> {
        for (sample, s) in samples.iter().enumerate() {
            for (what, got, holds) in [
                ("the pressure", s.pressure_pa, s.pressure_pa >= 0.0),
                ("the tip's indentation", s.tip_m, s.tip_m > 0.0),
                ("the gel's indentation", s.gel_m, s.gel_m > 0.0),
                ("the contact's radius", s.contact_m, s.contact_m > 0.0),
                ("the gel's modulus", s.gel_pa, s.gel_pa > 0.0),
            ] {
                if !(holds && got.is_finite()) {
                    return Err(TipError::Value { sample, what, got });
                }
            }
        }
        let relative = |s: &Calibration| -> Vec<f64> {
            let modulus_pa = s.gel_pa * s.gel_m / s.tip_m;
            row(s.pressure_pa, s.contact_m, s.tip_m).iter().map(|v| v / modulus_pa).collect()
        };
        let rows: Vec<Vec<f64>> = samples.iter().map(relative).collect();
        let pressures = distinct(samples.iter().map(|s| s.pressure_pa));
        let undetermined = TipError::Undetermined { samples: samples.len(), pressures: pressures.len() };
        let linear = Linear::fit(&rows, &vec![1.0; samples.len()]).ok_or(undetermined)?;
        let mut curves: Vec<(u64, u64)> =
            samples.iter().map(|s| (s.pressure_pa.to_bits(), s.gel_pa.to_bits())).collect();
        curves.sort_unstable();
        curves.dedup();
        let contacts = samples.iter().map(|s| s.contact_m);
        Ok(Self {
            linear,
            of_curve: samples.len() as f64 / curves.len() as f64,
            pressure_pa: Calibrated::over("the pressure in Pa", pressures, SLACK),
            contact_m: Calibrated::over("the contact's radius in m", contacts, SLACK),
        })
    }

    /// The tip's modulus at a pressure (Pa), a radius of the contact (m) and an indentation of the tip (m); contacts smaller than half of the smallest calibrated
    /// one are taken for that.
    ///
    /// # Errors
    /// [`Beyond`], for a pressure or a larger contact than calibrated.
    pub fn at(&self, pressure_pa: f64, contact_m: f64, tip_m: f64) -> Result<TipState, Beyond> {
        self.pressure_pa.check(pressure_pa)?;
        let low_m = self.contact_m.low();
        self.contact_m.check(contact_m.max(low_m))?;
        let row = row(pressure_pa.max(0.0), contact_m.max(0.5 * low_m), tip_m);
        let parts: Vec<f64> = row.iter().zip(self.linear.coefficients.iter()).map(|(r, c)| r * c).collect();
        let modulus_pa: f64 = parts.iter().sum();
        let relative: Vec<f64> = row.iter().map(|v| v / modulus_pa).collect();
        Ok(TipState {
            modulus_pa,
            stretched_pa: parts[STRETCHED],
            rubber_share: (parts[..RUBBER].iter().sum::<f64>() / modulus_pa).clamp(0.0, 1.0),
            // The samples of one curve have its errors in common: they count as one.
            error_share: self.of_curve.sqrt() * self.linear.at(&relative).1,
        })
    }

    /// Scatter of the samples about the fit, as a share: noise, and what the regression leaves out.
    pub fn scatter_share(&self) -> f64 {
        self.linear.variance.sqrt()
    }

    /// Least and greatest calibrated pressure, Pa.
    pub fn pressures_pa(&self) -> (f64, f64) {
        (self.pressure_pa.low(), self.pressure_pa.high())
    }
}

fn row(pressure_pa: f64, contact_m: f64, tip_m: f64) -> Vec<f64> {
    let (a, p, d) = (contact_m / CONTACT_M, pressure_pa, tip_m / TIP_M);
    vec![1.0, a, a * a, d * d / a, p, p / a, p * a, p * p]
}
