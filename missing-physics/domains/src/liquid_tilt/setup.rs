//! What is known of a container that is tilted.

use std::sync::Arc;

use liquid_haptics::container::mesh::{MeshContainer, PlannedMesh};
use liquid_haptics::container::{Container, Cylinder};
use liquid_haptics::wrench::Grasp;

/// The container, by its outer surface.
#[derive(Debug, Clone, PartialEq)]
pub enum Vessel {
    /// A circular cylinder.
    Cylinder {
        /// Outer radius, m.
        radius_m: f64,
        /// Outer length, m.
        length_m: f64,
    },
    /// Any shape: z along the axis, the bottom at z = 0.
    Mesh(Arc<MeshContainer>),
}

/// What a liquid may be in, shared between threads.
pub(super) type Cavity = Arc<dyn Container + Send + Sync>;

impl Vessel {
    /// Outer length along the axis, m.
    pub fn length_m(&self) -> f64 {
        match self {
            Self::Cylinder { length_m, .. } => *length_m,
            Self::Mesh(mesh) => mesh.bounds().1.z,
        }
    }

    /// Volume inside the outer surface, m^3.
    pub fn capacity_m3(&self) -> f64 {
        match self {
            Self::Cylinder { radius_m, length_m } => std::f64::consts::PI * radius_m * radius_m * length_m,
            Self::Mesh(mesh) => mesh.capacity_m3(),
        }
    }

    /// The thickest wall that leaves a cavity worth the name, m.
    pub(super) fn thickest_m(&self) -> f64 {
        match self {
            Self::Cylinder { radius_m, length_m } => 0.5 * radius_m.min(0.5 * length_m),
            Self::Mesh(mesh) => {
                let (low, high) = mesh.bounds();
                let sound = |wall: &f64| mesh.with_wall(*wall).is_ok();
                (1..8).map(|k| 0.25 * (high - low).min() * 0.5f64.powi(k)).find(sound).unwrap_or(0.0)
            }
        }
    }

    /// The inside of a wall of some thickness, m.
    pub(super) fn cavity(&self, wall_m: f64) -> Result<Cavity, String> {
        Ok(match self {
            Self::Cylinder { radius_m, length_m } => {
                Arc::new(Cylinder::new(*radius_m, *length_m, wall_m).map_err(|e| e.to_string())?)
            }
            Self::Mesh(mesh) => {
                Arc::new(PlannedMesh::new(mesh.with_wall(wall_m).map_err(|e| e.to_string())?))
            }
        })
    }
}

/// What is known of the set-up.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// The container.
    pub vessel: Vessel,
    /// How it is held.
    pub grasp: Grasp,
    /// Density of the liquid, where it is known, kg/m^3.
    pub density_kg_m3: Option<f64>,
    /// Whether the volume of each run was measured (input 2).
    pub volumes_known: bool,
}

/// By how much one pose is off.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Off {
    /// Of the liquid's mass and volume, relative.
    pub(super) liquid: f64,
    pub(super) angle_rad: f64,
    pub(super) grasp_m: f64,
}

impl Off {
    /// One of the unknowns of a cause that acts in some poses, and nothing else.
    pub(super) fn of(unknown: usize, size: f64) -> Self {
        match unknown {
            0 => Self { liquid: size, ..Self::default() },
            1 => Self { grasp_m: size, ..Self::default() },
            _ => Self { angle_rad: size, ..Self::default() },
        }
    }
}
