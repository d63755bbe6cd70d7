//! Bodies whose force relaxes, pressed along any history.
//!
//! The modulus after a step is `E psi(t)` with `psi(0) = 1`. While the contact grows the force is
//! `F(t) = int psi(t - s) d f(delta(s))`, f being the instantaneous law (Lee and Radok 1960, doi:10.1115/1.3644020). While it
//! shrinks, it has the radius that it had at the earlier time `t_1` with `int_{t_1}^t psi(t - s) d delta(s) = 0`, and only the
//! history up to `t_1` counts: `F(t) = int_0^{t_1} psi(t - s) d f(delta(s))` (Ting 1966, doi:10.1115/1.3625192). Contact ends
//! where there is no such time. A cylinder's contact does not shrink: its force follows the first formula until it is zero.
//!
//! This holds for sphere and cone with a Poisson's ratio that does not change in time, for one loading, hold and unloading.
//! Pressing again while a contact still shrinks is followed by the same rule, which is then an approximation.

mod general;
mod solid;

pub use general::forces_by_quadrature;
pub use solid::Scratch;

use crate::Number;
use crate::law::LawError;

/// Why there are no forces.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum HistoryError {
    /// Columns differ in length.
    #[error("{expected} times need as many indentations and forces, got {got}")]
    Length {
        /// Number of times.
        expected: usize,
        /// The other length.
        got: usize,
    },
    /// A time is not a finite number, or falls.
    #[error("time {index} is {value} s, expected finite times that do not fall")]
    Times {
        /// Index of the time.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// An indentation is not a finite number.
    #[error("indentation {index} is {value} m, expected a finite number")]
    Indentation {
        /// Its index.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A parameter of the relaxation makes no sense.
    #[error(transparent)]
    Parameter(#[from] LawError),
}

/// What the contact does when the indenter goes back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// It shrinks: sphere and cone.
    Shrinks,
    /// Its area is fixed: a cylinder.
    Fixed,
}

/// How the modulus relaxes after a step.
pub trait Relaxation<T: Number> {
    /// Whether the parameters make sense.
    ///
    /// # Errors
    /// [`LawError`].
    fn check(&self) -> Result<(), LawError>;

    /// The part of the modulus that is left a time (s, zero or more) after a step; 1 at zero, never rising.
    fn remaining(&self, time_s: T) -> T;

    /// Integral of [`Relaxation::remaining`] from zero on, in s.
    fn integral(&self, time_s: T) -> T;

    /// Integral of [`Relaxation::integral`] from zero on, in s^2.
    fn double_integral(&self, time_s: T) -> T;
}

/// The standard linear solid: `psi(t) = 1 - g (1 - exp(-t/tau))`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearSolid<T> {
    /// The part g of the instantaneous modulus that relaxes, from 0 (elastic) to 1 (a fluid).
    pub relaxed_fraction: T,
    /// Time constant tau in s, positive.
    pub tau_s: T,
}

/// Power-law relaxation: `psi(t) = (1 + t/t_0)^(-n)`, a straight line over logarithms beyond `t_0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLawSolid {
    /// Exponent n, from 0 (elastic) to below 1.
    pub exponent: f64,
    /// Time `t_0` in s before which nothing relaxes, positive.
    pub onset_s: f64,
}

impl<T: Number> Relaxation<T> for LinearSolid<T> {
    fn check(&self) -> Result<(), LawError> {
        let value = self.relaxed_fraction.re();
        if !(0.0..=1.0).contains(&value) {
            return Err(LawError::OutOfRange { name: "relaxed_fraction", value, low: 0.0, high: 1.0 });
        }
        crate::law::positive("tau_s", self.tau_s.re())
    }

    fn remaining(&self, time_s: T) -> T {
        T::from(1.0) - self.relaxed_fraction + self.relaxed_fraction * solid::decay(time_s / self.tau_s)
    }

    fn integral(&self, time_s: T) -> T {
        let mean = solid::moments(time_s / self.tau_s).0;
        time_s * (T::from(1.0) - self.relaxed_fraction + self.relaxed_fraction * mean)
    }

    fn double_integral(&self, time_s: T) -> T {
        let moment = solid::moments(time_s / self.tau_s).1;
        time_s * time_s * ((T::from(1.0) - self.relaxed_fraction) * 0.5 + self.relaxed_fraction * moment)
    }
}

impl Relaxation<f64> for PowerLawSolid {
    fn check(&self) -> Result<(), LawError> {
        if !(self.exponent >= 0.0 && self.exponent < 1.0) {
            let value = self.exponent;
            return Err(LawError::OutOfRange { name: "exponent", value, low: 0.0, high: 1.0 });
        }
        crate::law::positive("onset_s", self.onset_s)
    }

    fn remaining(&self, time_s: f64) -> f64 {
        (-self.exponent * (time_s / self.onset_s).ln_1p()).exp()
    }

    fn integral(&self, time_s: f64) -> f64 {
        // t_0 ((1 + x)^(1 - n) - 1)/(1 - n), without the difference.
        let power = 1.0 - self.exponent;
        self.onset_s * (power * (time_s / self.onset_s).ln_1p()).exp_m1() / power
    }

    fn double_integral(&self, time_s: f64) -> f64 {
        let (one, two) = (1.0 - self.exponent, 2.0 - self.exponent);
        let x = time_s / self.onset_s;
        if x < 1e-2 {
            // The differences below would cancel: x^2/2 - n x^3/6 + n (n + 1) x^4/24 - ...
            let (mut term, mut sum) = (0.5 * x * x, 0.0);
            for k in 0..10 {
                sum += term;
                term *= -(self.exponent + f64::from(k)) * x / f64::from(k + 3);
            }
            return self.onset_s * self.onset_s * sum;
        }
        self.onset_s * self.onset_s * ((two * x.ln_1p()).exp_m1() / two - x) / one
    }
}

/// The columns fit together and hold numbers.
fn check_history<T: Number>(
    times_s: &[f64],
    indentations_m: &[T],
    forces: usize,
) -> Result<(), HistoryError> {
    for got in [indentations_m.len(), forces] {
        if got != times_s.len() {
            return Err(HistoryError::Length { expected: times_s.len(), got });
        }
    }
    let mut last = f64::NEG_INFINITY;
    for (index, (&value, d)) in times_s.iter().zip(indentations_m).enumerate() {
        if !(value >= last && value.is_finite()) {
            return Err(HistoryError::Times { index, value });
        }
        if !d.re().is_finite() {
            return Err(HistoryError::Indentation { index, value: d.re() });
        }
        last = value;
    }
    Ok(())
}
