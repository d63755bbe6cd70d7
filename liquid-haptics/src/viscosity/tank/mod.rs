//! Damping of the first mode in tanks of other shapes: `gamma = C1 (nu / (d^(3/2) sqrt(g)))^n1`, d a characteristic length.
//!
//! [`Tank::published`] has the measured laws that could be found (Dodge 2000, The New Dynamic Behavior of Liquids in Moving
//! Containers, ch. 2; Ibrahim 2005, doi:10.1017/CBO9780511536656, ch. 3): upright cylinder, sphere, cone. For every shape C1 is
//! computed as well, with n1 = 1/2, from the tank's own first mode and the boundary layer it drags along the wetted wall (Landau and
//! Lifshitz 1987, Fluid Mechanics, section 25; Keulegan 1959, doi:10.1017/S0022112059000404; Case and Parkinson 1957,
//! doi:10.1017/S0022112057000154):
//!
//! `gamma = sqrt(nu / (8 omega)) int_wall |grad phi|^2 dS / int |grad phi|^2 dV`.
//!
//! Measured damping is larger than this: the contact line and a surface that is not clean add to it. In the upright cylinder the
//! measured law is 1.42 times the computed one ([`MEASURED_OVER_COMPUTED`]); for shapes without a measured law that factor is a guess,
//! and is the caller's to make.

mod harmonic;
mod published;
mod ritz;
mod upright;

pub use published::PublishedLaw;

use super::ViscosityError;

/// By how much the measured law for a deep upright cylinder (C1 = 0.79) exceeds the computed one (0.5576).
pub const MEASURED_OVER_COMPUTED: f64 = 0.79 / 0.557_6;

/// A tank's shape, filled to a depth (all lengths in m); the first mode that moves the centre of mass sideways.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tank {
    /// Upright circular cylinder. d: radius.
    UprightCylinder {
        /// Inner radius.
        radius_m: f64,
        /// Depth of the liquid.
        depth_m: f64,
    },
    /// Upright ring between two cylinders. d: outer radius.
    Annulus {
        /// Outer radius.
        outer_m: f64,
        /// Inner radius.
        inner_m: f64,
        /// Depth of the liquid.
        depth_m: f64,
    },
    /// Rectangular box that sloshes along its length. d: length.
    Rectangular {
        /// Length, along which it sloshes.
        length_m: f64,
        /// Width.
        width_m: f64,
        /// Depth of the liquid.
        depth_m: f64,
    },
    /// Cone with its tip down. d: radius of the surface.
    Cone {
        /// Angle between axis and wall, rad, 0.2 to 1.1.
        half_angle_rad: f64,
        /// Depth of the liquid above the tip.
        depth_m: f64,
    },
    /// Sphere. d: radius.
    Sphere {
        /// Inner radius.
        radius_m: f64,
        /// Depth of the liquid, 0.2 to 1.5 radii.
        depth_m: f64,
    },
    /// Cylinder on its side that sloshes across its axis. d: radius.
    HorizontalCylinder {
        /// Inner radius.
        radius_m: f64,
        /// Length.
        length_m: f64,
        /// Depth of the liquid, 0.2 to 1.5 radii.
        depth_m: f64,
    },
}

/// The first mode of a tank.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TankMode {
    /// `omega^2 / g`, 1/m.
    pub wave_number_per_m: f64,
    /// Characteristic length d, m.
    pub length_m: f64,
    /// C1 of a clean wall and surface; n1 is 1/2.
    pub c1: f64,
}

impl TankMode {
    /// Angular frequency, rad/s.
    pub fn angular_frequency_rad_s(&self, gravity_m_s2: f64) -> f64 {
        (self.wave_number_per_m * gravity_m_s2).max(0.0).sqrt()
    }

    /// Damping ratio at a kinematic viscosity (m^2/s).
    pub fn damping_ratio(&self, kinematic_m2_s: f64, gravity_m_s2: f64) -> f64 {
        self.c1 * (kinematic_m2_s.max(0.0) / self.unit(gravity_m_s2)).sqrt()
    }

    /// Kinematic viscosity (m^2/s) of a damping ratio, of which the walls' boundary layers make up `1 / excess`: 1 for clean ones,
    /// [`MEASURED_OVER_COMPUTED`] for those of the law of [Matl 2021], eq. 2.4.
    pub fn kinematic_viscosity_m2_s(&self, damping_ratio: f64, excess: f64, gravity_m_s2: f64) -> f64 {
        (damping_ratio.max(0.0) / (excess * self.c1)).powi(2) * self.unit(gravity_m_s2)
    }

    fn unit(&self, gravity: f64) -> f64 {
        self.length_m.powf(1.5) * gravity.sqrt()
    }
}

impl Tank {
    /// The first sideways mode.
    ///
    /// # Errors
    /// [`ViscosityError::Range`] for sizes that are no tank or outside of where the mode is computed.
    pub fn mode(&self) -> Result<TankMode, ViscosityError> {
        self.check()?;
        let (length, sums) = match *self {
            Self::UprightCylinder { radius_m, depth_m } => {
                (radius_m, upright::annulus(radius_m, 0.0, depth_m))
            }
            Self::Annulus { outer_m, inner_m, depth_m } => {
                (outer_m, upright::annulus(outer_m, inner_m, depth_m))
            }
            Self::Rectangular { length_m, width_m, depth_m } => {
                (length_m, Some(upright::rectangular(length_m, width_m, depth_m)))
            }
            Self::Cone { half_angle_rad, depth_m } => {
                let tangent = half_angle_rad.tan();
                // Heights from the surface down; the profile from its rim to the tip.
                let wall = |t: f64| [tangent * depth_m * (1.0 - t), -depth_m * t];
                (tangent * depth_m, harmonic::axisymmetric(&wall))
            }
            Self::Sphere { radius_m, depth_m } => (radius_m, harmonic::axisymmetric(&arc(radius_m, depth_m))),
            Self::HorizontalCylinder { radius_m, length_m, depth_m } => {
                (radius_m, harmonic::canal(&arc(radius_m, depth_m), length_m))
            }
        };
        let Some(sums) = sums.filter(|s| s.wave_number > 0.0 && s.volume > 0.0) else {
            return Err(ViscosityError::NoFit { what: "mode of this tank" });
        };
        // gamma = sqrt(nu / (8 omega)) W / V, and nu = unit x^2 with unit = d^1.5 sqrt(g): gravity drops out.
        let c1 = sums.wall / sums.volume * (length.powf(1.5) / (8.0 * sums.wave_number.sqrt())).sqrt();
        Ok(TankMode { wave_number_per_m: sums.wave_number, length_m: length, c1 })
    }

    fn check(&self) -> Result<(), ViscosityError> {
        let above = |name, got: f64| {
            let fine = got > 0.0 && got.is_finite();
            if fine { Ok(()) } else { Err(ViscosityError::Range { name, got, expected: "above 0" }) }
        };
        let within = |name, got: f64, low: f64, high: f64, expected| {
            let fine = got >= low && got <= high;
            if fine { Ok(()) } else { Err(ViscosityError::Range { name, got, expected }) }
        };
        match *self {
            Self::UprightCylinder { radius_m, depth_m } => {
                above("radius_m", radius_m)?;
                above("depth_m", depth_m)
            }
            Self::Annulus { outer_m, inner_m, depth_m } => {
                above("outer_m", outer_m)?;
                above("depth_m", depth_m)?;
                within("inner_m", inner_m, 0.0, 0.95 * outer_m, "0 to 0.95 of the outer radius")
            }
            Self::Rectangular { length_m, width_m, depth_m } => {
                above("length_m", length_m)?;
                above("width_m", width_m)?;
                above("depth_m", depth_m)
            }
            Self::Cone { half_angle_rad, depth_m } => {
                above("depth_m", depth_m)?;
                within("half_angle_rad", half_angle_rad, 0.2, 1.1, "0.2 to 1.1")
            }
            Self::Sphere { radius_m, depth_m } => {
                above("radius_m", radius_m)?;
                within("depth_m", depth_m, 0.2 * radius_m, 1.5 * radius_m, "0.2 to 1.5 radii")
            }
            Self::HorizontalCylinder { radius_m, length_m, depth_m } => {
                above("radius_m", radius_m)?;
                above("length_m", length_m)?;
                within("depth_m", depth_m, 0.2 * radius_m, 1.5 * radius_m, "0.2 to 1.5 radii")
            }
        }
    }
}

/// The wetted arc of a circle as the wall's profile: distance from the axis and height above the surface, from the rim (0) to the lowest
/// point (1).
fn arc(radius_m: f64, depth_m: f64) -> impl Fn(f64) -> [f64; 2] {
    let center = radius_m - depth_m;
    let rim = (center / radius_m).clamp(-1.0, 1.0).acos();
    move |t| {
        let (sin, cos) = (rim * (1.0 - t)).sin_cos();
        [radius_m * sin, center - radius_m * cos]
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use std::f64::consts::PI;

    use super::*;

    /// The deep cylinder: 1.8412, and C1 = (1 + xi^2) / ((xi^2 - 1) sqrt(8) xi^(1/4)), integrated by hand over Bessel's function.
    #[test]
    fn the_deep_cylinder_is_as_by_hand() {
        let mode = Tank::UprightCylinder { radius_m: 0.04, depth_m: 0.4 }.mode().unwrap();
        let xi: f64 = 1.841_183_781_340_659_3;
        approx::assert_relative_eq!(mode.wave_number_per_m * 0.04, xi, max_relative = 1e-7);
        let by_hand = (1.0 + xi * xi) / ((xi * xi - 1.0) * 8f64.sqrt() * xi.powf(0.25));
        approx::assert_relative_eq!(mode.c1, by_hand, max_relative = 1e-6);
        approx::assert_relative_eq!(0.79 / mode.c1, MEASURED_OVER_COMPUTED, max_relative = 1e-3);
    }

    /// The factor for shallow liquid of [Matl 2021], eq. 2.4, is empirical: near the theory's down to half a radius.
    #[test]
    fn the_shallow_cylinder_follows_the_published_factor() {
        let deep = Tank::UprightCylinder { radius_m: 1.0, depth_m: 20.0 }.mode().unwrap();
        for depth_m in [0.5, 0.7, 1.0, 1.5] {
            let mode = Tank::UprightCylinder { radius_m: 1.0, depth_m }.mode().unwrap();
            let x: f64 = 1.84 * depth_m;
            #[allow(clippy::approx_constant, reason = "the law's coefficient, not 1/pi")]
            let factor = 1.0 + 0.318 / x.sinh() * (1.0 + (1.0 - depth_m) / x.cosh());
            let ratio = mode.c1 / deep.c1 / factor;
            assert!((ratio - 1.0).abs() < 0.1, "{depth_m}: {ratio}");
        }
    }

    /// Frequencies that are known: half-full sphere 1.5602 and canal 1.3557 (Budiansky 1960, doi:10.2514/8.8467; Lamb 1932, section
    /// 259), and the cone and wedge of 45 degrees, whose mode is x z exactly (omega^2 h / g = 1).
    #[test]
    fn known_frequencies_come_back() {
        let sphere = Tank::Sphere { radius_m: 0.05, depth_m: 0.05 }.mode().unwrap();
        approx::assert_relative_eq!(sphere.wave_number_per_m * 0.05, 1.5602, max_relative = 2e-3);
        let canal = Tank::HorizontalCylinder { radius_m: 0.05, length_m: 1.0, depth_m: 0.05 }.mode().unwrap();
        approx::assert_relative_eq!(canal.wave_number_per_m * 0.05, 1.3557, max_relative = 2e-3);
        let cone = Tank::Cone { half_angle_rad: 0.25 * PI, depth_m: 0.1 }.mode().unwrap();
        approx::assert_relative_eq!(cone.wave_number_per_m * 0.1, 1.0, max_relative = 1e-9);
        // The squared gradient of x z is x^2 + z^2: over the cone pi h^5 (1/20 + 1/5); along the wall, by hand, 3/4 sqrt(2) pi h^4.
        let h: f64 = 0.1;
        let volume = PI * h.powi(5) * (1.0 / 20.0 + 1.0 / 5.0);
        let wall = PI * 2f64.sqrt() * h.powi(4) * 0.75;
        let by_hand = wall / volume * (h.powf(1.5) / (8.0 * (1.0 / h).sqrt())).sqrt();
        approx::assert_relative_eq!(cone.c1, by_hand, max_relative = 1e-6);
    }

    /// Keulegan's box: a wide deep one is damped at its two ends alone.
    #[test]
    fn the_box_and_the_ring_have_their_limits() {
        let wide = Tank::Rectangular { length_m: 0.1, width_m: 1e3, depth_m: 1.0 }.mode().unwrap();
        let k: f64 = PI / 0.1;
        approx::assert_relative_eq!(wide.wave_number_per_m, k, max_relative = 1e-9);
        // Ends: 2 k^2 int e^(2kz) = k; volume: k a / 2. So W / V = 2 / a.
        let by_hand = 2.0 / 0.1 * (0.1f64.powf(1.5) / (8.0 * k.sqrt())).sqrt();
        approx::assert_relative_eq!(wide.c1, by_hand, max_relative = 1e-3);
        // A thin ring is a canal that closes on itself: k = 1 / R.
        let thin = Tank::Annulus { outer_m: 0.1, inner_m: 0.095, depth_m: 1.0 }.mode().unwrap();
        approx::assert_relative_eq!(thin.wave_number_per_m * 0.0975, 1.0, max_relative = 1e-3);
        assert!(Tank::Annulus { outer_m: 0.1, inner_m: 0.1, depth_m: 1.0 }.mode().is_err());
        assert!(Tank::Sphere { radius_m: 0.1, depth_m: 0.2 }.mode().is_err());
        assert!(Tank::Cone { half_angle_rad: f64::NAN, depth_m: 0.2 }.mode().is_err());
    }

    #[test]
    fn damping_and_viscosity_invert_each_other() {
        let mode = Tank::Sphere { radius_m: 0.05, depth_m: 0.04 }.mode().unwrap();
        let ratio = mode.damping_ratio(3e-6, 9.81);
        approx::assert_relative_eq!(
            mode.kinematic_viscosity_m2_s(ratio, 1.0, 9.81),
            3e-6,
            max_relative = 1e-12
        );
    }
}
