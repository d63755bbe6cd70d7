//! The grains of a fake rig: in the funnel, in the air, on the cloth.

use crate::campaign::Grains;
use crate::dem::{Clump, DemError, Placed, Pour, Simulation, WallMotion};
use crate::scene::{Grain, Scene};

/// What a rig's grains are.
#[derive(Debug, Clone, PartialEq)]
pub struct Kind {
    /// Friction and restitution.
    pub grain: Grain,
    /// Their shape; none for spheres.
    pub shape: Option<Clump>,
    /// Coefficient of variation of the diameter of spheres, 0 to 0.5.
    pub size_variation: f64,
    /// Work of adhesion in J/m2.
    pub work_of_adhesion_j_m2: f64,
}

/// Grains of one kind that are poured one funnel after another.
#[derive(Debug, Clone)]
pub struct FakeGrains {
    scene: Scene,
    kind: Kind,
    seed: u64,
    fills: u64,
    simulation: Option<Simulation>,
    open: bool,
    quiet_s: f64,
}

/// How long all has to be quiet before time passes without simulating, s.
const QUIET: f64 = 0.1;

impl FakeGrains {
    /// Nothing is in the funnel or on the cloth.
    pub fn new(scene: Scene, kind: Kind, seed: u64) -> Self {
        Self { scene, kind, seed, fills: 0, simulation: None, open: false, quiet_s: 0.0 }
    }

    /// Fills the funnel, whose outlet is at a place in m, and closes the gate; what lies stays where it is.
    ///
    /// # Errors
    /// [`DemError`] for an outlet on the cloth or a kind outside physics.
    pub fn fill(&mut self, outlet_m: [f64; 3]) -> Result<(), DemError> {
        let kind = &self.kind;
        let mut pour = self.scene.pour(&kind.grain, outlet_m[2]);
        pour.funnel.axis_m = [outlet_m[0], outlet_m[1]];
        pour.size_variation = kind.size_variation;
        pour.grains.work_of_adhesion_j_m2 = kind.work_of_adhesion_j_m2;
        pour.ground.work_of_adhesion_j_m2 = kind.work_of_adhesion_j_m2;
        self.fills += 1;
        let seed = self.seed.wrapping_mul(1_000_003).wrapping_add(self.fills);
        let simulation = if let Some(clump) = &kind.shape {
            let lying: Vec<Placed> = self
                .simulation
                .iter()
                .flat_map(Simulation::clump_poses)
                .map(|(position_m, rotation_xyzw)| Placed { clump: clump.clone(), position_m, rotation_xyzw })
                .collect();
            pour.filled_with(clump, &lying, seed)?
        } else {
            let lying = self.grains();
            pour.filled_among(&[], &lying.positions_m, &lying.radii_m, seed)?
        };
        self.simulation = Some(simulation);
        (self.open, self.quiet_s) = (false, 0.0);
        Ok(())
    }

    /// Opens the gate.
    ///
    /// # Errors
    /// None; the gate is there.
    pub fn open(&mut self) -> Result<(), DemError> {
        if let Some(simulation) = self.simulation.as_mut().filter(|_| !self.open) {
            simulation.remove_wall(Pour::GATE)?;
            (self.open, self.quiet_s) = (true, 0.0);
        }
        Ok(())
    }

    /// Lets time in s pass while the funnel moves with a velocity in m/s.
    ///
    /// # Errors
    /// [`DemError`] for a funnel faster than grains fall.
    pub fn pass(&mut self, duration_s: f64, velocity_m_s: [f64; 3]) -> Result<(), DemError> {
        let Some(simulation) = &mut self.simulation else { return Ok(()) };
        let moves = velocity_m_s != [0.0; 3];
        let motion = WallMotion { velocity_m_s, ..WallMotion::default() };
        let gate = (!self.open).then_some(Pour::GATE);
        for wall in Pour::FUNNEL.into_iter().chain(gate) {
            simulation.move_wall(wall, motion)?;
        }
        if moves {
            self.quiet_s = 0.0;
        }
        let threshold = 1e-4 * self.scene.rig.mass_kg * 9.80665 * self.scene.rig.diameter_m;
        let mut left = duration_s;
        while left > 0.0 && self.quiet_s < QUIET {
            let span = left.min(0.02);
            simulation.run((span / simulation.step_s()).round().max(1.0) as u64)?;
            left -= span;
            let grains = simulation.masses_kg().len() as f64;
            let quiet = simulation.energy().kinetic_j < threshold * grains;
            self.quiet_s = if quiet && !moves { self.quiet_s + span } else { 0.0 };
        }
        Ok(())
    }

    /// All grains, sphere by sphere.
    pub fn grains(&self) -> Grains {
        self.simulation.as_ref().map_or_else(Grains::default, |s| Grains {
            positions_m: s.positions_m().collect(),
            radii_m: s.radii_m().collect(),
        })
    }

    /// Where and in what the grains are poured.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
}
