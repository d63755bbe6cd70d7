//! The state of all grains, in one array for each phase of the step.

use std::f64::consts::PI;

use super::vector::V3;

/// Velocity in m/s and angular velocity in rad/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Motion {
    pub(crate) velocity: V3,
    pub(crate) spin: V3,
}

/// Force in N and torque in N m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Load {
    pub(crate) force: V3,
    pub(crate) torque: V3,
}

/// All grains.
#[derive(Debug, Clone)]
pub(crate) struct Grains {
    /// x, y, z and the radius in m.
    pub(crate) place: Vec<[f64; 4]>,
    pub(crate) motion: Vec<Motion>,
    pub(crate) load: Vec<Load>,
    /// kg.
    pub(crate) mass: Vec<f64>,
    /// The body that each is part of; bodies do not touch themselves.
    pub(crate) body: Vec<u32>,
    /// Half a step over the mass and over the moment of inertia.
    pub(crate) kick: Vec<[f64; 2]>,
}

impl Grains {
    /// Solid spheres at rest.
    pub(crate) fn new(radii: &[f64], positions: &[V3], density: f64, step: f64) -> Self {
        let mass: Vec<f64> = radii.iter().map(|r| 4.0 / 3.0 * PI * r.powi(3) * density).collect();
        let kick =
            radii.iter().zip(&mass).map(|(r, m)| [0.5 * step / m, 0.5 * step / (0.4 * m * r * r)]).collect();
        Self {
            place: positions.iter().zip(radii).map(|(p, &r)| [p[0], p[1], p[2], r]).collect(),
            motion: vec![Motion::default(); radii.len()],
            load: vec![Load::default(); radii.len()],
            mass,
            body: (0..radii.len() as u32).collect(),
            kick,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.place.len()
    }
}
