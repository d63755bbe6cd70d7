//! Sloshing: the modes of a liquid in an upright cylinder, their damping, and the decay that a wrist feels.
//!
//! Linear theory of small waves in a rigid upright cylinder (Ibrahim 2005, Liquid Sloshing Dynamics, ch. 1 and 3; Dodge
//! 2000, The New Dynamic Behavior of Liquids in Moving Containers): mode n of the antisymmetric family has the wave number
//! `k = xi_n / R`, where `xi_n` is the n-th root of the derivative of the Bessel function J1, and
//! `omega^2 = (g k + sigma k^3 / rho) tanh(k h)`.

mod decay;
mod integrator;
mod linear;

pub use decay::{Decay, DecayError, Effects, LinearDecay};

/// Roots of J1', the antisymmetric modes (Abramowitz and Stegun 1964, table 9.5).
pub const ANTISYMMETRIC_ROOTS: [f64; 3] =
    [1.841_183_781_340_659_3, 5.331_442_773_525_033, 8.536_316_366_346_285];

/// Why there is no slosh mode.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SloshError {
    /// A number is outside its range.
    #[error("{name} is {got}, expected {expected}")]
    Value {
        /// What it is.
        name: &'static str,
        /// What came.
        got: f64,
        /// What is allowed.
        expected: &'static str,
    },
}

/// An upright circular cylinder with liquid in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UprightCylinder {
    radius_m: f64,
    fill_height_m: f64,
    gravity_m_s2: f64,
}

impl UprightCylinder {
    /// A cylinder of inner radius `radius_m`, filled to `fill_height_m`; all above zero and finite.
    ///
    /// # Errors
    /// [`SloshError::Value`].
    pub fn new(radius_m: f64, fill_height_m: f64, gravity_m_s2: f64) -> Result<Self, SloshError> {
        for (name, got) in
            [("radius_m", radius_m), ("fill_height_m", fill_height_m), ("gravity_m_s2", gravity_m_s2)]
        {
            if !(got > 0.0 && got.is_finite()) {
                return Err(SloshError::Value { name, got, expected: "above 0" });
            }
        }
        Ok(Self { radius_m, fill_height_m, gravity_m_s2 })
    }

    /// The same cylinder with so many times its fill height; unchanged where that is not above zero and finite.
    #[must_use]
    pub fn filled_by(&self, times: f64) -> Self {
        let filled = Self::new(self.radius_m, times * self.fill_height_m, self.gravity_m_s2);
        filled.unwrap_or(*self)
    }

    /// Wave number of an antisymmetric mode (0: the first), in 1/m; the last root known for higher ones.
    pub fn wave_number_per_m(&self, mode: usize) -> f64 {
        ANTISYMMETRIC_ROOTS[mode.min(ANTISYMMETRIC_ROOTS.len() - 1)] / self.radius_m
    }

    /// Angular frequency of a mode without damping, in rad/s.
    ///
    /// `tension_over_density` is the surface tension over the density in m^3/s^2 (0: gravity waves alone, [Matl 2021], eq. 2.3
    /// corrected; water 7.3e-5).
    pub fn angular_frequency_rad_s(&self, mode: usize, tension_over_density: f64) -> f64 {
        let k = self.wave_number_per_m(mode);
        let square =
            (self.gravity_m_s2 * k + tension_over_density * k.powi(3)) * (k * self.fill_height_m).tanh();
        square.max(0.0).sqrt()
    }

    #[allow(clippy::approx_constant, reason = "0.318 is the law's fitted coefficient, not 1/pi")]
    /// Damping ratio of the first mode over the square root of the kinematic viscosity, in (m^2/s)^-1/2.
    fn damping_per_root(&self) -> f64 {
        let depth = self.fill_height_m / self.radius_m;
        let x = 1.84 * depth;
        // Both hyperbolic functions overflow long after the bracket has become 1.
        let shallow = if x > 300.0 { 0.0 } else { 0.318 / x.sinh() * (1.0 + (1.0 - depth) / x.cosh()) };
        0.79 / (self.radius_m.powf(1.5) * self.gravity_m_s2.sqrt()).sqrt() * (1.0 + shallow)
    }

    /// Damping ratio of the first mode in a liquid of the given kinematic viscosity (m^2/s), [Matl 2021], eq. 2.4 corrected.
    ///
    /// An empirical law for damping ratios well below 1 (Mikishev and Dorozhkin 1961, in Abramson 1966, NASA SP-106,
    /// ch. 4): boundary layers at wall and bottom.
    pub fn damping_ratio(&self, kinematic_viscosity_m2_s: f64) -> f64 {
        self.damping_per_root() * kinematic_viscosity_m2_s.max(0.0).sqrt()
    }

    /// The kinematic viscosity (m^2/s) at which the first mode has the given damping ratio; inverse of
    /// [`Self::damping_ratio`].
    pub fn kinematic_viscosity_m2_s(&self, damping_ratio: f64) -> f64 {
        (damping_ratio.max(0.0) / self.damping_per_root()).powi(2)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// J1' by its power series, another way to the roots.
    fn bessel_derivative(x: f64) -> f64 {
        let mut sum = 0.0;
        let mut term = 0.5;
        for k in 0..60 {
            sum += term * f64::from(2 * k + 1);
            let n = f64::from(k + 1);
            term *= -x * x / 4.0 / (n * (n + 1.0));
        }
        sum
    }

    #[test]
    fn the_roots_are_roots() {
        for root in ANTISYMMETRIC_ROOTS {
            assert!(bessel_derivative(root).abs() < 1e-9, "{root}: {}", bessel_derivative(root));
        }
    }

    /// Water 80 mm deep in a cylinder of 49 mm radius: 3.048 Hz (worked out by hand from the dispersion relation).
    #[test]
    fn a_published_set_up_has_its_frequency() {
        let cylinder = UprightCylinder::new(0.049, 0.08, 9.80665).unwrap();
        let hertz = cylinder.angular_frequency_rad_s(0, 0.0) / std::f64::consts::TAU;
        approx::assert_relative_eq!(hertz, 3.048, max_relative = 2e-3);
        // Surface tension of water stiffens it by sigma k^2 / (2 rho g).
        let stiffer = cylinder.angular_frequency_rad_s(0, 0.0728 / 998.2) / std::f64::consts::TAU;
        let k = 1.841_183_781 / 0.049;
        approx::assert_relative_eq!(
            stiffer / hertz,
            (1.0 + 0.0728 / 998.2 * k * k / 9.80665f64).sqrt(),
            max_relative = 1e-9
        );
    }

    #[test]
    fn viscosity_and_damping_invert_each_other() {
        for (radius, height) in [(0.02, 0.001), (0.05, 0.1), (1.0, 40.0)] {
            let cylinder = UprightCylinder::new(radius, height, 9.80665).unwrap();
            for viscosity in [1e-7, 1e-6, 1e-4] {
                let ratio = cylinder.damping_ratio(viscosity);
                assert!(ratio.is_finite() && ratio > 0.0);
                approx::assert_relative_eq!(
                    cylinder.kinematic_viscosity_m2_s(ratio),
                    viscosity,
                    max_relative = 1e-12
                );
            }
        }
        assert!(UprightCylinder::new(0.0, 0.1, 9.8).is_err());
        assert!(UprightCylinder::new(0.1, f64::NAN, 9.8).is_err());
    }
}
