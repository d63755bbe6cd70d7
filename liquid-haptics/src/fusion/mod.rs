//! Volume, density and viscosity of a liquid in a held cylinder, from its settled poses and from a swing to upright, as one posterior.
//!
//! The poses' wrenches know the mass and how it lies; the swing's frequency depends on the level and its damping on viscosity and level; a film that
//! drains down the wall is weighed. One likelihood has them all, with what is not known of grasp, sensor and laws integrated out:
//!
//! * *Poses*: given volume and density the wrenches are normal, errors of grasp, tilt, masses, gain and offsets included exactly; the density at a
//!   volume is normal about its maximum.
//! * *Slosh*: `exp(-gamma omega t)` of the first mode, its amplitude and phase integrated out, with a contact line that may stick. Frequency
//!   and damping are those of [`crate::slosh::UprightCylinder`], with the damping of the liquid's interior added, times factors of which the size is
//!   stated ([`SwingErrors`]); boundary layers lower the frequency by their damping ratio.
//! * *Drain*: [`crate::viscosity::Drain`], whose scale is the density.
//!
//! What remains is a sum over volumes, placed where the posterior is, of normal laws of the other two: it may have any number of modes.

mod check;
mod error;
mod film;
mod fit;
mod gaussian;
mod law;
mod laws;
mod marginal;
mod nuisance;
mod posterior;
mod rows;
mod swing;
mod tilt;

pub use error::FusionError;
pub use fit::FusionFit;
pub use marginal::Marginal;
pub use posterior::{Posterior, Quantity};
pub use swing::Motion;

/// What is known beforehand: every volume of the container is as probable, and so are equal ratios of densities and of viscosities in these ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Least and largest density, kg/m^3.
    pub density_kg_m3: [f64; 2],
    /// Least and largest kinematic viscosity, m^2/s.
    pub viscosity_m2_s: [f64; 2],
}

impl Default for Prior {
    /// Alcohol to heavy brine, below water to bitumen.
    fn default() -> Self {
        Self { density_kg_m3: [600.0, 2000.0], viscosity_m2_s: [3e-7, 0.1] }
    }
}

/// Standard deviations of what is not known of a tilted container and its sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseErrors {
    /// White noise of a pose's torque, N m, above 0.
    pub torque_nm: f64,
    /// A slow wander of the torque, N m.
    pub torque_wander_nm: f64,
    /// Constant offset of the torque, N m.
    pub torque_offset_nm: f64,
    /// Height of the grasp, m.
    pub grasp_m: f64,
    /// Tilt, rad.
    pub tilt_rad: f64,
    /// Mass of the empty container, kg.
    pub container_kg: f64,
    /// Height of the empty container's centre of mass, m.
    pub shell_center_m: f64,
    /// The forces; absent where the sensor has none, or they are not to be trusted.
    pub force: Option<ForceErrors>,
    /// How long the wander remembers, s, above 0.
    pub wander_s: f64,
    /// Time from pose to pose, s.
    pub between_poses_s: f64,
}

/// Standard deviations of what is not known of the forces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceErrors {
    /// White noise of a pose's force along gravity, N, above 0.
    pub noise_n: f64,
    /// A slow wander of the forces, N.
    pub wander_n: f64,
    /// Constant offsets of the forces in the sensor's frame, N.
    pub offset_n: f64,
    /// Relative error of the forces.
    pub gain: f64,
}

/// Standard deviations of what is not known of a swing, its sensor and the laws of its motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwingErrors {
    /// White noise of a reading's torque, N m, above 0.
    pub torque_nm: f64,
    /// A slow wander of the torque, N m.
    pub torque_wander_nm: f64,
    /// How long the wander remembers, s, above 0.
    pub wander_s: f64,
    /// Constant offset of the torque, N m, above 0.
    pub torque_offset_nm: f64,
    /// Surface tension over density, m^3/s^2: mean and standard deviation over liquids (water 7.3e-5, oils 3.5e-5).
    pub tension_over_density: [f64; 2],
    /// Relative error of the frequency: radius, bottom, contact line, amplitude.
    pub frequency: f64,
    /// Error of the frequency's drop by boundary layers, over that drop.
    pub layer: f64,
    /// What the wave's shape misses, over its amplitude: higher modes, a frequency that changes as it fades.
    pub shape: f64,
    /// Error of the logarithm of the damping ratio's law.
    pub ln_damping: f64,
    /// What the drain's shape misses, over its size at each time.
    pub film_shape: f64,
    /// Relative error of the drain's weight.
    pub film: f64,
    /// Error of the logarithm of the viscosity by the drain's law.
    pub ln_film_viscosity: f64,
}

impl SwingErrors {
    /// What the laws are good to, with a sensor's noise (N m, a reading), wander (N m) and its memory (s), and offset (N m).
    ///
    /// Damping: published laws and boundary layers of a clean surface differ by 1.4 to 1.6 in an upright cylinder (see the README), and a surface
    /// that does not slide would damp by twice the latter.
    pub fn of_sensor(torque_nm: f64, torque_wander_nm: f64, wander_s: f64, torque_offset_nm: f64) -> Self {
        Self {
            torque_nm,
            torque_wander_nm,
            wander_s,
            torque_offset_nm,
            tension_over_density: [5e-5, 2e-5],
            frequency: 0.007,
            layer: 0.3,
            shape: 0.07,
            ln_damping: 0.25,
            film_shape: 0.03,
            film: 0.03,
            ln_film_viscosity: 0.1,
        }
    }
}

/// The torque about the horizontal axis after a container has been swung from its side to upright.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swing<'a> {
    /// Times since it stands upright, s, from 0 on, rising.
    pub t_s: &'a [f64],
    /// The torque at those times, N m.
    pub tau_z_nm: &'a [f64],
    /// How long gravity has pulled along the wall before the first time, s: for a turn at a constant rate `2 / pi` of its duration.
    pub head_start_s: f64,
}
