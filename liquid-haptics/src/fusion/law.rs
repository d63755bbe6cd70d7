//! The wave's frequency and damping at a level: the law of boundary layers, and what the liquid's interior adds.

use super::SwingErrors;
use crate::slosh::UprightCylinder;

/// The first mode of an upright cylinder.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wave {
    upright: UprightCylinder,
    /// Angular frequency without damping, rad/s, and the error of its logarithm by the surface tension.
    omega: f64,
    by_tension: f64,
    /// Damping ratio of the layers over the root of the viscosity, and of the interior over the viscosity, `2 k^2 / omega` (Lamb 1932, Hydrodynamics,
    /// section 348).
    layers: f64,
    interior: f64,
}

impl Wave {
    pub(super) fn new(upright: UprightCylinder, errors: &SwingErrors) -> Self {
        let [tension, spread] = errors.tension_over_density;
        let at = |t: f64| upright.angular_frequency_rad_s(0, t.max(0.0));
        let omega = at(tension);
        Self {
            upright,
            omega,
            by_tension: 0.5 * (at(tension + spread) / at(tension - spread)).ln(),
            layers: upright.damping_ratio(1.0),
            interior: 2.0 * upright.wave_number_per_m(0).powi(2) / omega,
        }
    }

    /// The kinematic viscosity (m^2/s) at which the wave has a damping ratio.
    pub(super) fn viscosity_m2_s(&self, damping: f64) -> f64 {
        let (a, b) = (self.layers, self.interior);
        let root = 2.0 * damping / (a + (a * a + 4.0 * b * damping).sqrt());
        root * root
    }

    /// Change of the damping ratio's logarithm with the viscosity's: a half in thin liquids, one in thick ones.
    pub(super) fn slope(&self, damping: f64) -> f64 {
        1.0 - 0.5 * self.upright.damping_ratio(self.viscosity_m2_s(damping)) / damping
    }

    /// Logarithm of the angular frequency (rad/s) at which a wave of a damping ratio swings, and its standard deviation: layers lower it by their
    /// damping ratio, damping itself by a root.
    pub(super) fn ln_frequency(&self, damping: f64, errors: &SwingErrors) -> [f64; 2] {
        let layers = self.upright.damping_ratio(self.viscosity_m2_s(damping));
        let mean = self.omega.ln() + (1.0 - layers).ln() + 0.5 * (1.0 - damping * damping).ln();
        [mean, errors.frequency.hypot(self.by_tension).hypot(errors.layer * layers)]
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    #[test]
    fn viscosity_and_slope_are_those_of_the_damping() {
        let upright = UprightCylinder::new(0.034, 0.06, 9.81).unwrap();
        let wave = Wave::new(upright, &SwingErrors::of_sensor(1e-3, 1e-4, 30.0, 0.01));
        let damping = |nu: f64| wave.layers * nu.sqrt() + wave.interior * nu;
        for nu in [1e-6, 7e-5, 7.5e-4] {
            let ratio = damping(nu);
            approx::assert_relative_eq!(wave.viscosity_m2_s(ratio), nu, max_relative = 1e-10);
            let slope = (damping(nu * 1.001) / damping(nu / 1.001)).ln() / (2.0 * 1.001f64.ln());
            approx::assert_relative_eq!(wave.slope(ratio), slope, max_relative = 1e-5);
        }
    }
}
