//! Measured laws of damping for tanks of other shapes, as published: C1, n1 and the characteristic length.
//!
//! The book's tables were not at hand; its laws are those of Abramson (1966, NASA SP-106, ch. 4) which Dodge (2000, ch. 2) repeats,
//! here as the open reimplementation of Dodge's program has them (SLOSH-ML 1.0.0, Gonzalez et al. 2024, AAS Guidance, Navigation
//! and Control Conference; github.com/LGST-LAB/slosh_ml). They give logarithmic decrements; here they are over 2 pi.

use std::f64::consts::{PI, TAU};

use super::super::ViscosityError;
use super::Tank;

/// A measured law: `gamma = c1 (nu / (d^(3/2) sqrt(g)))^n1` at this depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PublishedLaw {
    /// The coefficient, with the law's dependence on the depth in it.
    pub c1: f64,
    /// The exponent.
    pub n1: f64,
    /// The characteristic length d, m.
    pub length_m: f64,
    /// Where it stands.
    pub source: &'static str,
}

impl PublishedLaw {
    /// Damping ratio at a kinematic viscosity (m^2/s).
    pub fn damping_ratio(&self, kinematic_m2_s: f64, gravity_m_s2: f64) -> f64 {
        self.c1 * (kinematic_m2_s.max(0.0) / self.unit(gravity_m_s2)).powf(self.n1)
    }

    /// Kinematic viscosity (m^2/s) of a damping ratio.
    pub fn kinematic_viscosity_m2_s(&self, damping_ratio: f64, gravity_m_s2: f64) -> f64 {
        (damping_ratio.max(0.0) / self.c1).powf(1.0 / self.n1) * self.unit(gravity_m_s2)
    }

    fn unit(&self, gravity: f64) -> f64 {
        self.length_m.powf(1.5) * gravity.sqrt()
    }
}

impl Tank {
    /// The measured law for this shape, where one was found: upright cylinder ([Matl 2021], eq. 2.4), sphere, cone. None for the ring, the box
    /// and the cylinder on its side: theirs is [`Tank::mode`]'s alone.
    ///
    /// # Errors
    /// As [`Tank::mode`].
    pub fn published(&self) -> Result<Option<PublishedLaw>, ViscosityError> {
        self.check()?;
        Ok(match *self {
            Self::UprightCylinder { radius_m, depth_m } => Some(cylinder(radius_m, depth_m)),
            Self::Sphere { radius_m, depth_m } => Some(sphere(radius_m, depth_m)),
            Self::Cone { half_angle_rad, depth_m } => Some(cone(half_angle_rad, depth_m)),
            Self::Annulus { .. } | Self::Rectangular { .. } | Self::HorizontalCylinder { .. } => None,
        })
    }
}

/// Decrement `4.98 nu^(1/2) R^(-3/4) g^(-1/4)` and a bracket for shallow liquid.
fn cylinder(radius_m: f64, depth_m: f64) -> PublishedLaw {
    let depth = depth_m / radius_m;
    let x = 1.84 * depth;
    #[allow(clippy::approx_constant, reason = "the law's coefficient, not 1/pi")]
    let shallow = if x > 300.0 { 0.0 } else { 0.318 / x.sinh() * (1.0 + (1.0 - depth) / x.cosh()) };
    PublishedLaw {
        c1: 4.98 / TAU * (1.0 + shallow),
        n1: 0.5,
        length_m: radius_m,
        source: "Mikishev and Dorozhkin 1961, in NASA SP-106, ch. 4",
    }
}

/// Decrement `0.131 B^0.359 R / h` up to half full, `B = 10^4 nu / (g^(1/2) (2 R)^(3/2))`; above it a rational function of the
/// air's depth.
fn sphere(radius_m: f64, depth_m: f64) -> PublishedLaw {
    const POWER: f64 = 0.359;
    let depth = depth_m / radius_m;
    let fill = if depth <= 1.0 { 1.0 / depth } else { (1.0 + 0.46 * (2.0 - depth)) / (1.46 * (2.0 - depth)) };
    PublishedLaw {
        c1: 0.131 / TAU * (1e4 / 8f64.sqrt()).powf(POWER) * fill,
        n1: POWER,
        length_m: radius_m,
        source: "Mikishev and Dorozhkin 1961, in NASA SP-106, ch. 4",
    }
}

/// Decrement `4.964 C5 C4^(-1/2) nu^(1/2) R^(-3/4) g^(-1/4)`, R the surface's radius; C4 and C5 are SLOSH-ML's polynomials in the half
/// angle (degrees), read from the report's graphs.
fn cone(half_angle_rad: f64, depth_m: f64) -> PublishedLaw {
    let degrees = half_angle_rad * 180.0 / PI;
    let c5 = 0.0126 * degrees + 1.0037;
    let c4 = -0.0003 * degrees * degrees - 0.0031 * degrees + 1.001;
    PublishedLaw {
        // The graph ends where its polynomial does.
        c1: 4.964 / TAU * c5 / c4.max(0.0).sqrt(),
        n1: 0.5,
        length_m: depth_m * half_angle_rad.tan(),
        source: "NASA SP-106, ch. 4, its graphs as read by SLOSH-ML 1.0.0",
    }
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::unwrap_used,
        clippy::print_stdout,
        reason = "a test stops where it fails, and says what it saw"
    )]
    use super::*;
    use crate::slosh::UprightCylinder;

    const GRAVITY: f64 = 9.80665;

    /// The decrement of a half-full sphere of 0.1 m with water by hand: B = 10^4 1e-6 / (3.1316 0.2^1.5) = 0.035702,
    /// 0.131 B^0.359 = 0.039594; and the cylinder's law is the one that the first mode has.
    #[test]
    fn laws_are_as_by_hand() {
        let sphere = Tank::Sphere { radius_m: 0.1, depth_m: 0.1 }.published().unwrap().unwrap();
        approx::assert_relative_eq!(
            sphere.damping_ratio(1e-6, GRAVITY) * TAU,
            0.039_594,
            max_relative = 1e-3
        );
        for (radius_m, depth_m) in [(0.04, 0.02), (0.04, 0.05), (0.05, 0.4)] {
            let law = Tank::UprightCylinder { radius_m, depth_m }.published().unwrap().unwrap();
            let mode = UprightCylinder::new(radius_m, depth_m, GRAVITY).unwrap();
            approx::assert_relative_eq!(
                law.damping_ratio(1e-5, GRAVITY),
                mode.damping_ratio(1e-5),
                max_relative = 4e-3
            );
        }
        for tank in [
            Tank::Sphere { radius_m: 0.1, depth_m: 0.13 },
            Tank::Cone { half_angle_rad: 0.5, depth_m: 0.1 },
            Tank::UprightCylinder { radius_m: 0.1, depth_m: 0.1 },
        ] {
            let law = tank.published().unwrap().unwrap();
            let ratio = law.damping_ratio(3e-6, GRAVITY);
            approx::assert_relative_eq!(
                law.kinematic_viscosity_m2_s(ratio, GRAVITY),
                3e-6,
                max_relative = 1e-9
            );
        }
        assert!(Tank::Sphere { radius_m: 0.1, depth_m: 0.2 }.published().is_err());
    }

    /// Where both are known, measured damping lies above that of clean boundary layers, by a factor below four; the table of it.
    #[test]
    fn what_is_measured_lies_above_what_is_computed() {
        let (radius_m, length_m) = (0.05, 0.15);
        let tanks = [
            ("upright cylinder, h = R", Tank::UprightCylinder { radius_m, depth_m: 0.05 }),
            ("ring, inner = R / 2, h = R", Tank::Annulus { outer_m: 0.05, inner_m: 0.025, depth_m: 0.05 }),
            ("box 1:1, h = length / 2", Tank::Rectangular { length_m: 0.1, width_m: 0.1, depth_m: 0.05 }),
            ("cone, 30 degrees", Tank::Cone { half_angle_rad: PI / 6.0, depth_m: 0.087 }),
            ("cone, 45 degrees", Tank::Cone { half_angle_rad: PI / 4.0, depth_m: 0.05 }),
            ("sphere, half full", Tank::Sphere { radius_m, depth_m: 0.05 }),
            ("sphere, h = R / 2", Tank::Sphere { radius_m, depth_m: 0.025 }),
            (
                "cylinder on its side, half full",
                Tank::HorizontalCylinder { radius_m, length_m, depth_m: 0.05 },
            ),
        ];
        println!(
            "{:<32} {:>9} {:>9} {:>6} {:>10} {:>9}",
            "tank", "C1 ours", "C1 publ.", "n1", "water publ.", "ratio"
        );
        for (name, tank) in tanks {
            let mode = tank.mode().unwrap();
            let Some(law) = tank.published().unwrap() else {
                println!("{name:<32} {:>9.3} {:>9} {:>6} {:>10} {:>9}", mode.c1, "-", "-", "-", "-");
                continue;
            };
            let measured = law.damping_ratio(1e-6, GRAVITY);
            let ratio = measured / mode.damping_ratio(1e-6, GRAVITY);
            println!(
                "{name:<32} {:>9.3} {:>9.3} {:>6} {measured:>10.5} {ratio:>9.2}",
                mode.c1, law.c1, law.n1
            );
            assert!((1.0..4.0).contains(&ratio), "{name}: {ratio}");
        }
    }
}
