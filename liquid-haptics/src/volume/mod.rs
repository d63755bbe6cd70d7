//! Mass and volume of a liquid from the wrenches of settled poses ([Matl 2021], section 2.4).
//!
//! The mass comes from the forces by linear regression ([`fit_mass`]), the volume from the torques of all poses at once by bounded
//! least squares ([`VolumeFit`]). The torque cannot tell an empty container from a full one, and its misfit may have more than one
//! valley: an estimate carries a [`Verdict`] that says what the poses leave open.

mod correlation;
mod error;
mod estimate;
mod mass;
mod next;
mod profile;
mod valleys;

pub use correlation::ErrorCorrelation;
pub use error::VolumeError;
pub use estimate::VolumeFit;
pub use mass::{ForceGain, MassEstimate, MassFit, fit_mass};
pub use next::NextTilt;

use crate::wrench::PlanarWrench;

/// One settled pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SettledPose {
    /// Clockwise tilt from upright, rad.
    pub tilt_rad: f64,
    /// What the sensor reads.
    pub wrench: PlanarWrench,
}

/// What is known of the liquid besides the torques, which depend on its mass and its volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Liquid {
    /// The mass is known, for instance from the forces.
    Mass {
        /// The mass, kg.
        mass_kg: f64,
        /// Standard error of the mass, kg; 0 for a mass that is exact.
        error_kg: f64,
    },
    /// The density is known, kg/m^3.
    ///
    /// This leaves twins: gripped at half its height, a cylinder's torque is the same at every tilt with a volume of liquid as with
    /// all but that volume.
    Density(f64),
    /// Mass and density are known.
    MassAndDensity {
        /// The mass, kg.
        mass_kg: f64,
        /// Standard error of the mass, kg, above 0.
        error_kg: f64,
        /// The density, kg/m^3; taken as exact.
        density_kg_m3: f64,
    },
}

impl From<&MassEstimate> for Liquid {
    fn from(mass: &MassEstimate) -> Self {
        Self::Mass { mass_kg: mass.mass_kg, error_kg: mass.error_kg }
    }
}

/// A volume that explains the poses, and the interval about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Where the misfit is least, m^3.
    pub volume_m3: f64,
    /// The stretch of volumes about it within the 95 % level, m^3.
    pub interval_m3: [f64; 2],
}

/// Why the poses do not determine the volume.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The torques hardly depend on the volume.
    Flat,
    /// The poses all have one tilt, so that nothing checks the torque against the model.
    AlikePoses,
    /// Separate volumes explain the poses.
    SeveralVolumes,
}

/// What the poses say about the volume.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The volume is as estimated, within its interval.
    Determined,
    /// The liquid's mass cannot be distinguished from zero.
    Empty,
    /// The volume cannot be distinguished from the container's capacity.
    Full,
    /// The volume is open.
    Undetermined {
        /// Why.
        cause: Cause,
        /// Every stretch of volumes that explains the poses, rising.
        candidates: Vec<Candidate>,
    },
    /// No volume explains the torques with the noise that was given: another container, or a departure that was not stated.
    Misfit,
}

/// An estimate of a volume.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeEstimate {
    /// The volume, m^3: where the misfit is least; 0 for [`Verdict::Empty`].
    pub volume_m3: f64,
    /// From the least to the greatest volume within the 95 % level of the profile likelihood, m^3; for [`Verdict::Empty`] these
    /// are all volumes that the torques leave open.
    pub interval_m3: [f64; 2],
    /// The liquid's mass at that volume, kg.
    pub mass_kg: f64,
    /// The torque's noise, given or estimated, N m.
    pub sigma_nm: f64,
    /// The chance of a misfit as large as this one; none where the noise was estimated or nothing is left to check it.
    pub misfit_p: Option<f64>,
    /// What the poses say.
    pub verdict: Verdict,
}

/// Poses that hold numbers only, at least one.
fn checked(poses: &[SettledPose]) -> Result<(), VolumeError> {
    if poses.is_empty() {
        return Err(VolumeError::TooFew { what: "poses", got: 0, least: 1 });
    }
    for (index, pose) in poses.iter().enumerate() {
        let PlanarWrench { fx_n, fy_n, tau_z_nm } = pose.wrench;
        if let Some(&got) = [pose.tilt_rad, fx_n, fy_n, tau_z_nm].iter().find(|v| !v.is_finite()) {
            return Err(VolumeError::Pose { index, got });
        }
    }
    Ok(())
}
