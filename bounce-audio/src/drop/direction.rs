//! Directions scattered about a mean: the von Mises-Fisher distribution on the sphere.

use super::{DropError, Vector, positive_or_zero};
use rand::{Rng, RngExt};
use std::f64::consts::PI;

/// Scatter of a direction about its mean, density `kappa / (2 pi (e^kappa - e^-kappa)) e^(kappa mu.x)` a steradian ([Matl 2021], section 4.3;
/// Fisher 1953, doi:10.1098/rspa.1953.0064), in a form that does not overflow at any concentration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    kappa: f64,
}

impl Scatter {
    /// With the given concentration: 0 for any direction alike, infinity for none but the mean.
    ///
    /// # Errors
    /// [`DropError::Value`] below zero or for NaN.
    pub fn new(kappa: f64) -> Result<Self, DropError> {
        if kappa == f64::INFINITY {
            return Ok(Self { kappa });
        }
        Ok(Self { kappa: positive_or_zero("kappa", kappa)? })
    }

    /// The concentration.
    pub fn kappa(&self) -> f64 {
        self.kappa
    }

    /// Log density a steradian at a unit vector, about another one.
    pub fn ln_density(&self, mean: &Vector, x: &Vector) -> f64 {
        // 1 - mu.x without cancellation.
        let off = 0.5 * (0..3).map(|i| (x[i] - mean[i]).powi(2)).sum::<f64>();
        self.ln_peak() - self.kappa * off
    }

    /// Log density a steradian at the mean.
    pub fn ln_peak(&self) -> f64 {
        // 2 kappa / (1 - e^(-2 kappa)) is 1 for a concentration of 0.
        let x = 2.0 * self.kappa;
        let share = if x < 1e-12 { 1.0 + 0.5 * x } else { x / -(-x).exp_m1() };
        share.ln() - (4.0 * PI).ln()
    }

    /// Draws a unit vector about a mean one: `1 - w = -ln(1 - u (1 - e^(-2 kappa))) / kappa` for the cosine `w`.
    pub fn draw<R: Rng + ?Sized>(&self, mean: &Vector, rng: &mut R) -> Vector {
        let (u, turn): (f64, f64) = (rng.random(), rng.random());
        let off = if self.kappa == 0.0 {
            2.0 * u
        } else {
            (-(u * (-2.0 * self.kappa).exp_m1()).ln_1p() / self.kappa).clamp(0.0, 2.0)
        };
        let (sin, cos) = (2.0 * PI * turn).sin_cos();
        let across = (off * (2.0 - off)).sqrt();
        let [a, b] = across_of(mean);
        let mut x = [0.0; 3];
        for i in 0..3 {
            x[i] = (1.0 - off) * mean[i] + across * (cos * a[i] + sin * b[i]);
        }
        x
    }
}

/// Two unit vectors across a third and each other (Duff et al. 2017, JCGT 6(1)).
pub(super) fn across_of(n: &Vector) -> [Vector; 2] {
    let sign = 1f64.copysign(n[2]);
    let a = -1.0 / (sign + n[2]);
    let b = n[0] * n[1] * a;
    [[1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]], [b, sign + n[1] * n[1] * a, -n[1]]]
}
