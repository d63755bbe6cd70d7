//! Containers: where a liquid of a given volume lies when its container is tilted.
//!
//! The container's frame has z along its axis, z = 0 at its outer bottom, and x on the side that goes down when it is
//! tilted: at a tilt `theta` (clockwise, 0 upright, pi upside down) world's up is `(-sin theta, 0, cos theta)` in it.

mod cylinder;
mod error;
#[cfg(feature = "mesh")]
pub mod mesh;
mod segment;
mod wedge;

pub use cylinder::Cylinder;
pub use error::ContainerError;

use nalgebra::{UnitVector3, Vector3};

/// Where the liquid lies, in the container's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fill {
    /// Volume of the liquid, m^3.
    pub volume_m3: f64,
    /// Height of the liquid's surface along up, from the frame's origin, m.
    pub surface_height_m: f64,
    /// The liquid's centre of mass, m; for no liquid the lowest point of the cavity.
    pub center_of_mass: Vector3<f64>,
}

/// A cavity that holds a liquid with a level surface; the liquid is at rest and no air is trapped.
pub trait Container {
    /// Volume of the cavity, m^3.
    fn capacity_m3(&self) -> f64;

    /// Where a volume of liquid lies; `up` is world's up in the container's frame.
    ///
    /// # Errors
    /// [`ContainerError`] where the volume does not fit.
    fn fill(&self, up: &UnitVector3<f64>, volume_m3: f64) -> Result<Fill, ContainerError>;

    /// Volume of the cavity below the height `height_m` along `up`, m^3.
    ///
    /// # Errors
    /// [`ContainerError`] where the height is no number.
    fn volume_below(&self, up: &UnitVector3<f64>, height_m: f64) -> Result<f64, ContainerError>;
}

/// World's up in the frame of a container that is tilted clockwise by `tilt_rad`.
pub fn up_at_tilt(tilt_rad: f64) -> UnitVector3<f64> {
    let (sin, cos) = tilt_rad.sin_cos();
    UnitVector3::new_unchecked(Vector3::new(-sin, 0.0, cos))
}
