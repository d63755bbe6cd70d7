//! Shear load from the mean shear, by pressure (figure 5.10).
//!
//! A firmer tip gives way less: `F = (k_0 + k_1 p) u + (q_0 + q_1 p) u^2`, fitted by least squares to loads that were known. The square takes
//! in that the rim of the contact slips first (Mindlin): the load rises ever more slowly.

use hertz_contact::calibrated::{Beyond, Calibrated, distinct};

use crate::regression::Linear;

/// Why there is no load.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LoadError {
    /// A sample is no number, or a pressure or a load is below zero.
    #[error("sample {sample}: {what} is {got}")]
    Value {
        /// Its index.
        sample: usize,
        /// Which column.
        what: &'static str,
        /// Its value.
        got: f64,
    },
    /// The samples do not determine the curve: it takes three shears at two pressures, and five samples or more.
    #[error("{samples} samples at {pressures} pressures do not determine the loads")]
    Undetermined {
        /// Samples.
        samples: usize,
        /// Different pressures.
        pressures: usize,
    },
    /// A question beyond what was calibrated.
    #[error(transparent)]
    Beyond(#[from] Beyond),
}

/// One known load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sheared {
    /// Gauge pressure, Pa, zero or more.
    pub pressure_pa: f64,
    /// Mean shear of the markers, m (or pixels, if the question is in pixels too).
    pub shear_m: f64,
    /// Shear load, N, zero or more.
    pub load_n: f64,
}

/// Part of the calibrated range that may be asked for beyond it.
pub(crate) const SLACK: f64 = 0.02;

/// A calibrated skin.
#[derive(Debug, Clone, PartialEq)]
pub struct ShearLoad {
    linear: Linear,
    pressure_pa: Calibrated,
    shear_m: Calibrated,
}

impl ShearLoad {
    /// Fits the samples.
    ///
    /// # Errors
    /// [`LoadError::Value`], [`LoadError::Undetermined`].
    pub fn fit(samples: &[Sheared]) -> Result<Self, LoadError> {
        for (sample, s) in samples.iter().enumerate() {
            for (what, got, least) in [
                ("the pressure", s.pressure_pa, 0.0),
                ("the shear", s.shear_m, f64::MIN),
                ("the load", s.load_n, 0.0),
            ] {
                if !(got.is_finite() && got >= least) {
                    return Err(LoadError::Value { sample, what, got });
                }
            }
        }
        let rows: Vec<Vec<f64>> = samples.iter().map(|s| row(s.pressure_pa, s.shear_m)).collect();
        let loads: Vec<f64> = samples.iter().map(|s| s.load_n).collect();
        let pressures = distinct(samples.iter().map(|s| s.pressure_pa));
        let undetermined = LoadError::Undetermined { samples: samples.len(), pressures: pressures.len() };
        let linear = Linear::fit(&rows, &loads).ok_or(undetermined)?;
        let range = |what, of: fn(&Sheared) -> f64| Calibrated::over(what, samples.iter().map(of), SLACK);
        let pressure_pa = range("the pressure", |s| s.pressure_pa);
        Ok(Self { linear, pressure_pa, shear_m: range("the shear", |s| s.shear_m) })
    }

    /// Load in N at a pressure and a mean shear, with the standard deviation of a new one.
    ///
    /// # Errors
    /// [`LoadError::Beyond`]: a polynomial says nothing beyond its samples (a fiftieth of the range is allowed).
    pub fn load_n(&self, pressure_pa: f64, shear_m: f64) -> Result<(f64, f64), LoadError> {
        self.pressure_pa.check(pressure_pa)?;
        self.shear_m.check(shear_m)?;
        let row = row(pressure_pa, shear_m);
        Ok((self.linear.at(&row).0, self.linear.new_sigma(&row)))
    }
}

fn row(p: f64, u: f64) -> Vec<f64> {
    vec![u, p * u, u * u, p * u * u]
}
