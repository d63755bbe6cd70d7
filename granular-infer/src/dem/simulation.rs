//! The simulation: a set-up, its state, the step.

use super::{
    clump::{Bodies, Placed},
    energy::{Energy, energy, kinetic},
    error::{DemError, finite, positive, within},
    forces::Forces,
    frame::WallMotion,
    grains::{Grains, Load},
    material::{Coefficients, Factors, Law, stable_step_s},
    neighbours::{Counters, Neighbours},
    vector::{V3, along, dot, scale},
    wall::{Shape, Wall, Walls},
};

/// The largest number of grains.
pub const MAX_GRAINS: usize = 20_000;

/// Steps between two looks at the kinetic energy.
const LOOK_EVERY: u64 = 20;

/// What does not change during a simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// The law of all contacts.
    pub law: Law,
    /// Density of the grains in kg/m3, positive.
    pub density_kg_m3: f64,
    /// Coefficients of grains against grains.
    pub grains: Coefficients,
    /// The walls, each with its coefficients.
    pub walls: Vec<Wall>,
    /// Gravity in m/s2.
    pub gravity_m_s2: [f64; 3],
    /// Quadratic air drag k in 1/m, zero or more: `a = -k |v| v`.
    pub drag_per_m: f64,
    /// Step in s, at most [`stable_step_s`] of the smallest grain.
    pub step_s: f64,
    /// Speed in m/s of the fastest impact that the step has to follow, positive.
    pub fastest_m_s: f64,
}

/// When grains count as being at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// Mean kinetic energy of a grain in J, positive.
    pub kinetic_j: f64,
    /// How long it has to stay below, in s, positive.
    pub hold_s: f64,
}

impl Rest {
    /// A millionth of the energy of a fall through a mean diameter (m), for 0.1 s.
    pub fn usual(mass_kg: f64, diameter_m: f64, gravity_m_s2: f64) -> Self {
        Self { kinetic_j: 1e-6 * mass_kg * diameter_m * gravity_m_s2, hold_s: 0.1 }
    }
}

/// Grains in motion.
#[derive(Debug, Clone)]
pub struct Simulation {
    gravity: V3,
    drag: f64,
    step: f64,
    fastest: f64,
    steps: u64,
    factors: Factors,
    grains: Grains,
    bodies: Option<Bodies>,
    neighbours: Neighbours,
    forces: Forces,
    walls: Walls,
    counters: Counters,
    fresh: bool,
}

impl Simulation {
    /// Grains at rest at `positions_m`; a set-up or a step out of range is refused.
    pub fn new(setup: &Setup, radii_m: &[f64], positions_m: &[[f64; 3]]) -> Result<Self, DemError> {
        let n = radii_m.len();
        if n == 0 || n > MAX_GRAINS {
            return Err(DemError::Count { received: n, most: MAX_GRAINS });
        }
        if positions_m.len() != n {
            return Err(DemError::Length { name: "positions_m", expected: n, received: positions_m.len() });
        }
        radii_m.iter().try_for_each(|&r| positive("radius_m", r))?;
        positions_m.iter().try_for_each(|&p| finite("position_m", p))?;
        let grains = Grains::new(radii_m, positions_m, setup.density_kg_m3, setup.step_s);
        Self::of(setup, grains, None)
    }

    /// Clumps at rest where they are placed. What the simulation tells of grains it then tells of the clumps' spheres, one
    /// clump after another.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn of_clumps(setup: &Setup, placed: &[Placed]) -> Result<Self, DemError> {
        let spheres: usize = placed.iter().map(|p| p.clump.radii().len()).sum();
        if spheres == 0 || spheres > MAX_GRAINS {
            return Err(DemError::Count { received: spheres, most: MAX_GRAINS });
        }
        let (bodies, grains) = Bodies::new(placed, setup.density_kg_m3)?;
        Self::of(setup, grains, Some(bodies))
    }

    fn of(setup: &Setup, grains: Grains, bodies: Option<Bodies>) -> Result<Self, DemError> {
        finite("gravity_m_s2", setup.gravity_m_s2)?;
        within("drag_per_m", setup.drag_per_m, 0.0, 1e6)?;
        setup.grains.check()?;
        for wall in &setup.walls {
            wall.shape.check()?;
            wall.coefficients.check()?;
        }
        positive("step_s", setup.step_s)?;
        let smallest = grains.place.iter().fold(f64::INFINITY, |a, p| a.min(p[3]));
        let stable_s = stable_step_s(&setup.law, setup.density_kg_m3, smallest, setup.fastest_m_s)?;
        if setup.step_s > stable_s {
            return Err(DemError::Step { received_s: setup.step_s, stable_s });
        }
        let shapes: Vec<Shape> = setup.walls.iter().map(|w| w.shape.clone()).collect();
        let factors = setup.walls.iter().map(|w| setup.law.factors(&w.coefficients)).collect();
        Ok(Self {
            gravity: setup.gravity_m_s2,
            drag: setup.drag_per_m,
            step: setup.step_s,
            fastest: setup.fastest_m_s,
            steps: 0,
            factors: setup.law.factors(&setup.grains),
            neighbours: Neighbours::new(&grains),
            forces: Forces::default(),
            walls: Walls::new(&shapes, factors, grains.len()),
            grains,
            bodies,
            counters: Counters::default(),
            fresh: true,
        })
    }

    /// Sets velocity in m/s and angular velocity in rad/s of a grain or a clump.
    pub fn set_motion(&mut self, grain: usize, velocity_m_s: V3, spin_rad_s: V3) -> Result<(), DemError> {
        finite("velocity_m_s", velocity_m_s)?;
        finite("spin_rad_s", spin_rad_s)?;
        if let Some(bodies) = &mut self.bodies {
            self.fresh = true;
            return bodies.set_motion(grain, velocity_m_s, spin_rad_s, &mut self.grains);
        }
        let count = self.grains.len();
        let motion = self.grains.motion.get_mut(grain).ok_or(DemError::Index {
            name: "grain",
            received: grain,
            count,
        })?;
        (motion.velocity, motion.spin) = (velocity_m_s, spin_rad_s);
        self.fresh = true;
        Ok(())
    }

    /// Takes a wall away, as the gate of a funnel; its index is that in [`Setup::walls`].
    pub fn remove_wall(&mut self, wall: usize) -> Result<(), DemError> {
        self.walls.remove(wall)
    }

    /// Lets a wall move from now on, as a funnel along a path or a bowl about a pivot; its index is that in [`Setup::walls`].
    ///
    /// # Errors
    /// [`DemError::Index`]; [`DemError::OutOfRange`] for what is not finite, and for a wall faster than [`Setup::fastest_m_s`].
    pub fn move_wall(&mut self, wall: usize, motion: WallMotion) -> Result<(), DemError> {
        finite("velocity_m_s", motion.velocity_m_s)?;
        finite("spin_rad_s", motion.spin_rad_s)?;
        finite("about_m", motion.about_m)?;
        let v = motion.velocity_m_s;
        within("speed of a wall in m/s", dot(v, v).sqrt(), 0.0, self.fastest)?;
        self.fresh = true;
        self.walls.set_motion(wall, motion)
    }

    /// One step of velocity Verlet; dashpots act on the velocities at half the step.
    pub fn step(&mut self) {
        if self.fresh {
            self.rebuild();
            self.react();
            self.fresh = false;
        }
        let mut left = self.walls.advance(self.step);
        if let Some(bodies) = &mut self.bodies {
            bodies.advance(&mut self.grains, self.gravity, self.drag, self.step);
            left |= self.grains.place.iter().enumerate().any(|(i, p)| self.neighbours.left(i, p));
        } else {
            left |= self.drift();
        }
        if left {
            self.rebuild();
        }
        self.react();
        if let Some(bodies) = &mut self.bodies {
            bodies.finish(&mut self.grains, self.gravity, self.drag, self.step);
        } else {
            let grains = &mut self.grains;
            for ((motion, load), kick) in grains.motion.iter_mut().zip(&grains.load).zip(&grains.kick) {
                motion.velocity = along(motion.velocity, kick[0], load.force);
                motion.spin = along(motion.spin, kick[1], load.torque);
            }
        }
        self.steps += 1;
        self.counters.steps += 1;
    }

    /// Half a kick and the drift of grains that are spheres; tells whether one has left its margin.
    fn drift(&mut self) -> bool {
        let mut left = false;
        let grains = &mut self.grains;
        for (i, (((place, motion), load), kick)) in
            grains.place.iter_mut().zip(&mut grains.motion).zip(&grains.load).zip(&grains.kick).enumerate()
        {
            motion.velocity = along(motion.velocity, kick[0], load.force);
            motion.spin = along(motion.spin, kick[1], load.torque);
            for (x, v) in place.iter_mut().zip(motion.velocity) {
                *x += self.step * v;
            }
            left |= self.neighbours.left(i, place);
        }
        left
    }

    /// Takes a number of steps; motion that is no longer finite is an error.
    pub fn run(&mut self, steps: u64) -> Result<(), DemError> {
        for _ in 0..steps {
            self.step();
        }
        self.finite_energy().map(|_| ())
    }

    /// Runs until the grains rest, for at most `most_s` seconds; tells whether they do.
    pub fn run_until_rest(&mut self, rest: &Rest, most_s: f64) -> Result<bool, DemError> {
        positive("kinetic_j", rest.kinetic_j)?;
        positive("hold_s", rest.hold_s)?;
        positive("most_s", most_s)?;
        let hold = (rest.hold_s / self.step).ceil() as u64;
        let end = self.steps + (most_s / self.step).round() as u64;
        let mut still = 0;
        while self.steps < end {
            let count = LOOK_EVERY.min(end - self.steps);
            self.run(count)?;
            let quiet = self.finite_energy()? <= rest.kinetic_j * self.bodies_or_grains() as f64;
            still = if quiet { still + count } else { 0 };
            if still >= hold {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn finite_energy(&self) -> Result<f64, DemError> {
        let kinetic = self.bodies.as_ref().map_or_else(|| kinetic(&self.grains), Bodies::kinetic);
        if kinetic.is_finite() { Ok(kinetic) } else { Err(DemError::Diverged { time_s: self.time_s() }) }
    }

    fn bodies_or_grains(&self) -> usize {
        self.bodies.as_ref().map_or(self.grains.len(), Bodies::len)
    }

    fn rebuild(&mut self) {
        self.neighbours.rebuild(&self.grains, self.step);
        self.walls.rebuild(&self.grains, &self.neighbours.margin);
        self.counters.rebuilds += 1;
    }

    /// All forces at the present places.
    fn react(&mut self) {
        if self.bodies.is_some() {
            // Gravity and drag act on clumps, not on their spheres.
            self.grains.load.fill(Load::default());
        } else {
            self.fields();
        }
        self.counters.contacts +=
            self.forces.react(&mut self.neighbours, &mut self.grains, &self.factors, self.step);
        self.counters.pairs += self.neighbours.len() as u64;
        self.walls.react(&mut self.grains, self.step);
    }

    /// Gravity and drag.
    fn fields(&mut self) {
        for ((load, mass), motion) in
            self.grains.load.iter_mut().zip(&self.grains.mass).zip(&self.grains.motion)
        {
            let mut acceleration = self.gravity;
            if self.drag > 0.0 {
                let v = motion.velocity;
                acceleration = along(acceleration, -self.drag * dot(v, v).sqrt(), v);
            }
            *load = Load { force: scale(acceleration, *mass), torque: [0.0; 3] };
        }
    }

    /// The force in N of all grains on a wall in the last step: what a load cell under it would read.
    ///
    /// # Errors
    /// [`DemError::Index`].
    pub fn wall_load_n(&self, wall: usize) -> Result<[f64; 3], DemError> {
        self.walls.load(wall)
    }

    /// The step in s.
    pub fn step_s(&self) -> f64 {
        self.step
    }

    /// Simulated time in s.
    pub fn time_s(&self) -> f64 {
        self.steps as f64 * self.step
    }

    /// Centres in m.
    pub fn positions_m(&self) -> impl ExactSizeIterator<Item = [f64; 3]> + '_ {
        self.grains.place.iter().map(|p| [p[0], p[1], p[2]])
    }

    /// Radii in m.
    pub fn radii_m(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.grains.place.iter().map(|p| p[3])
    }

    /// Masses in kg; of a clump's spheres, the clump's.
    pub fn masses_kg(&self) -> &[f64] {
        &self.grains.mass
    }

    /// Velocities in m/s.
    pub fn velocities_m_s(&self) -> impl ExactSizeIterator<Item = [f64; 3]> + '_ {
        self.grains.motion.iter().map(|m| m.velocity)
    }

    /// Angular velocities in rad/s.
    pub fn spins_rad_s(&self) -> impl ExactSizeIterator<Item = [f64; 3]> + '_ {
        self.grains.motion.iter().map(|m| m.spin)
    }

    /// Energies at the present places, springs as of the last step.
    pub fn energy(&self) -> Energy {
        let spheres = energy(&self.grains, self.gravity, &self.factors, &self.neighbours, &self.walls);
        self.bodies.as_ref().map_or(spheres, |b| b.energy(self.gravity, spheres))
    }

    /// Centre of mass (m) and rotation (unit quaternion x, y, z, w from principal axes to the world) of each clump.
    pub fn clump_poses(&self) -> impl Iterator<Item = ([f64; 3], [f64; 4])> + '_ {
        self.bodies.iter().flat_map(Bodies::poses)
    }

    /// Velocity (m/s) and angular velocity (rad/s) of each clump.
    pub fn clump_motions(&self) -> impl Iterator<Item = ([f64; 3], [f64; 3])> + '_ {
        self.bodies.iter().flat_map(Bodies::motions)
    }

    /// What has been done so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }
}
