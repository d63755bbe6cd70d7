//! What is known of a wave that is recorded.

use liquid_haptics::slosh::{SloshError, UprightCylinder};

/// What was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// The torque about the horizontal axis across the motion.
    Torque,
    /// The sideways force.
    Force,
}

impl Channel {
    /// Name of the column.
    pub fn name(self) -> &'static str {
        if self == Self::Torque { "tau_z_nm" } else { "fx_n" }
    }

    /// Unit of the readings.
    pub fn unit(self) -> &'static str {
        if self == Self::Torque { "N m" } else { "N" }
    }

    /// The unit as a suffix of a parameter's name.
    pub(super) fn suffix(self) -> &'static str {
        if self == Self::Torque { "nm" } else { "n" }
    }
}

/// What is known of the set-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// Inner radius of the cylinder in m.
    pub radius_m: f64,
    /// Its length in m, where it is known.
    pub length_m: Option<f64>,
    /// Volume of the liquid in m^3.
    pub volume_m3: f64,
    /// Density of the liquid in kg/m^3.
    pub density_kg_m3: f64,
    /// Gravity in m/s^2.
    pub gravity_m_s2: f64,
    /// What was measured.
    pub channel: Channel,
}

/// A glass of water whose torque is read, for tests.
#[cfg(test)]
pub(super) const GLASS: Setup = Setup {
    radius_m: 0.035,
    length_m: None,
    volume_m3: 2e-4,
    density_kg_m3: 997.0,
    gravity_m_s2: 9.81,
    channel: Channel::Torque,
};

/// The cylinder with a share of the recorded volume in it.
pub(super) fn cylinder(setup: &Setup, share: f64) -> Result<UprightCylinder, SloshError> {
    let depth = share * setup.volume_m3 / (std::f64::consts::PI * setup.radius_m * setup.radius_m);
    UprightCylinder::new(setup.radius_m, depth, setup.gravity_m_s2)
}
