//! The exact likelihood of a drop's features under the model of [Matl 2021], chapter 4, and the posterior that follows: what a learned one is measured by.
//!
//! A ball falls from rest but for a Gaussian velocity of sigma in each component, from a height h on a level table; restitution takes
//! its part of the whole velocity, directions scatter. With `q` the length of the velocity that it was let go with, the speed at the first
//! impact is `s = sqrt(2 g h + q^2)`: q is Maxwell distributed, its direction uniform. Let theta_1 and theta_2 be the angles from the
//! vertical at which the ball leaves the first two impacts, then
//!
//! `d1 = 2/g e^2 s^2 sin theta_1 cos theta_1`, `d2 = 2/g e^4 s^2 sin theta_2 cos theta_2`, `t2/t1 = e cos theta_2 / cos theta_1`,
//!
//! so for a given e the features and (s, theta_1, theta_2, alpha) determine each other, and the density of the features is
//!
//! `p(s) p(theta_1 | s, kappa) f(x_2; x_1, kappa) sin theta_2 / |J|`, `|J| = 2 r d1 d2 |T_2^2 - T_1^2| / (s T_1 T_2)`,
//!
//! `r = t2/t1`, `T = tan theta`. One integral is left, over the direction in which the ball was let go.
//!
//! Without noise in the measurement the features all but determine e: `s` has to be just above `sqrt(2 g h)`, which two restitutions at
//! most can make it.

mod bessel;
mod grid;

pub use grid::{ExactPosterior, exact_posterior};

use crate::drop::{DropError, value};
use crate::features::Features;
use std::f64::consts::PI;

/// Nodes of the integral over the direction at release (midpoints; the integrand is smooth and even at both ends).
const NODES: usize = 16;

/// What is known of the drops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactModel {
    energy_m2_s2: f64,
    sigma_m_s: f64,
    gravity_m_s2: f64,
}

/// What the features say once e is given.
#[derive(Debug, Clone, Copy)]
struct Latent {
    /// Speed at the first impact, m/s.
    speed: f64,
    /// Square of the speed at release; below zero where no release explains the features.
    release: f64,
    theta: [f64; 2],
    ln_jacobian: f64,
}

impl ExactModel {
    /// Drops from a height (m) under gravity (m/s^2), let go with a velocity of `sigma_m_s` in each component; all above zero.
    ///
    /// # Errors
    /// [`DropError::Value`]. A sigma of 0 has no density over the features: three numbers then determine the fourth.
    pub fn new(height_m: f64, sigma_m_s: f64, gravity_m_s2: f64) -> Result<Self, DropError> {
        for (what, v) in [("height_m", height_m), ("sigma_m_s", sigma_m_s), ("gravity_m_s2", gravity_m_s2)] {
            value(what, v, "a finite number above 0", v > 0.0 && v.is_finite())?;
        }
        Ok(Self { energy_m2_s2: 2.0 * gravity_m_s2 * height_m, sigma_m_s, gravity_m_s2 })
    }

    /// `ln p(X | e, log10 kappa)` per second-free unit of the features (m^2 rad); minus infinity where they cannot come from this e.
    pub fn ln_likelihood(&self, x: &Features, e: f64, log10_kappa: f64) -> f64 {
        match self.latent(x, e) {
            Some(latent) if latent.release > 0.0 => {
                self.ln_density(x, &latent, 10f64.powf(log10_kappa), log10_kappa)
            }
            _ => f64::NEG_INFINITY,
        }
    }

    fn latent(&self, x: &Features, e: f64) -> Option<Latent> {
        let r = x.time_ratio;
        if !(e > 0.0 && x.d1_m > 0.0 && x.d2_m > 0.0 && r > 0.0) {
            return None;
        }
        let (k2, r2) = ((x.d2_m / (x.d1_m * e * r)).powi(2), (r / e).powi(2));
        // sin^2 theta_1, from cos theta_2 = r/e cos theta_1 and sin theta_2 = k sin theta_1.
        let square = (1.0 - r2) / (k2 - r2);
        if !(square > 0.0 && square < 1.0) {
            return None;
        }
        let (sin1, cos1) = (square.sqrt(), (1.0 - square).sqrt());
        let (sin2, cos2) = (k2.sqrt() * sin1, r / e * cos1);
        let speed = (0.5 * self.gravity_m_s2 * x.d1_m / (e * e * sin1 * cos1)).sqrt();
        let (t1, t2) = (sin1 / cos1, sin2 / cos2);
        let jacobian = 2.0 * r * x.d1_m * x.d2_m * (t2 * t2 - t1 * t1).abs() / (speed * t1 * t2);
        Some(Latent {
            speed,
            release: speed * speed - self.energy_m2_s2,
            theta: [sin1.atan2(cos1), sin2.atan2(cos2)],
            ln_jacobian: jacobian.ln(),
        })
    }

    fn ln_density(&self, x: &Features, latent: &Latent, kappa: f64, log10_kappa: f64) -> f64 {
        let (s, q) = (latent.speed, latent.release.sqrt());
        let sigma = self.sigma_m_s;
        // Maxwell's density of q, turned into one of s by dq/ds = s/q.
        let ln_speed = 0.5 * (2.0 / PI).ln() + 2.0 * q.ln() - 3.0 * sigma.ln() - 0.5 * (q / sigma).powi(2)
            + (s / q).ln();
        // kappa / (2 pi (1 - e^(-2 kappa)))
        let ln_peak =
            log10_kappa * std::f64::consts::LN_10 - (2.0 * PI).ln() - (-(-2.0 * kappa).exp()).ln_1p();
        let [theta1, theta2] = latent.theta;
        let mut sum = 0.0;
        for node in 0..NODES {
            let c = (node as f64 + 0.5) / NODES as f64;
            let theta0 = (q * (1.0 - c * c).sqrt() / s).asin();
            // Into the table is mirrored.
            for theta in [theta1, PI - theta1] {
                sum += around(kappa, theta0, theta);
            }
        }
        let ln_first = (2.0 * PI * theta1.sin() * sum / NODES as f64).ln() + ln_peak;
        let across = theta1.sin() * theta2.sin();
        let turned = 2.0 * across * (0.5 * x.alpha_rad).sin().powi(2);
        let off = 2.0 * (0.5 * (theta1 - theta2)).sin().powi(2) + turned;
        let off_mirrored = 2.0 * (0.5 * (theta1 + theta2)).cos().powi(2) + turned;
        let mirrored = (-kappa * (off_mirrored - off)).exp();
        let ln_second = ln_peak - kappa * off + mirrored.ln_1p() + theta2.sin().ln();
        ln_speed + ln_first + ln_second - latent.ln_jacobian
    }
}

/// Mean over the azimuth of `e^(kappa (cos angle - 1))` between directions at two angles from the vertical.
fn around(kappa: f64, theta0: f64, theta: f64) -> f64 {
    let exponent = 2.0 * kappa * (0.5 * (theta - theta0)).sin().powi(2);
    if exponent > 700.0 {
        return 0.0;
    }
    (-exponent).exp() * bessel::i0_scaled(kappa * theta0.sin() * theta.sin())
}
