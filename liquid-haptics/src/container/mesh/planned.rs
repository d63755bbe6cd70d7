//! A mesh with a memo of the plans of the tilts that it was asked about.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::UnitVector3;

use super::{MeshContainer, MeshPlan};
use crate::container::{Container, ContainerError, Fill};

/// How many tilts are remembered; then it begins anew.
const MOST: usize = 512;

/// A [`MeshContainer`] for programmes that come back to the same tilts: each is planned once. Safe to share between threads.
#[derive(Debug)]
pub struct PlannedMesh {
    mesh: MeshContainer,
    plans: Mutex<HashMap<[u64; 3], Arc<MeshPlan>>>,
}

impl PlannedMesh {
    /// Remembers the plans of `mesh`.
    pub fn new(mesh: MeshContainer) -> Self {
        Self { mesh, plans: Mutex::default() }
    }

    /// The mesh.
    pub fn mesh(&self) -> &MeshContainer {
        &self.mesh
    }

    fn plan(&self, up: &UnitVector3<f64>) -> Arc<MeshPlan> {
        let key = [up.x.to_bits(), up.y.to_bits(), up.z.to_bits()];
        // A thread that panicked while it held the lock cannot have left half a plan.
        let lock = || self.plans.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(plan) = lock().get(&key) {
            return Arc::clone(plan);
        }
        let plan = Arc::new(self.mesh.plan(up));
        let mut plans = lock();
        if plans.len() >= MOST {
            plans.clear();
        }
        plans.insert(key, Arc::clone(&plan));
        plan
    }
}

impl Container for PlannedMesh {
    fn capacity_m3(&self) -> f64 {
        self.mesh.capacity_m3()
    }

    fn fill(&self, up: &UnitVector3<f64>, volume_m3: f64) -> Result<Fill, ContainerError> {
        self.plan(up).fill(volume_m3)
    }

    fn volume_below(&self, up: &UnitVector3<f64>, height_m: f64) -> Result<f64, ContainerError> {
        self.plan(up).volume_below(height_m)
    }
}
