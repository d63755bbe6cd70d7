//! The scene: a funnel is filled, opened, and its grains fall onto a plane.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    clump::{Clump, Placed},
    error::{DemError, finite, positive, within},
    fill::{fill, radii},
    funnel::Funnel,
    heap::{Heap, heap},
    material::{Coefficients, Law, stable_step_s},
    neighbours::Counters,
    simulation::{MAX_GRAINS, Rest, Setup, Simulation},
    vector::dot,
    wall::{Shape, Wall},
};

/// Grains that are poured from a funnel onto the plane z = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pour {
    /// Number of grains, 1 to [`MAX_GRAINS`].
    pub count: usize,
    /// Mean diameter in m, positive.
    pub diameter_m: f64,
    /// Coefficient of variation of the diameter, 0 to 0.5 (log-normal, cut at 0.4 and 2.5 means); 0 for equal grains.
    pub size_variation: f64,
    /// Density in kg/m3, positive.
    pub density_kg_m3: f64,
    /// Law of all contacts.
    pub law: Law,
    /// Coefficients among grains and against the funnel.
    pub grains: Coefficients,
    /// Coefficients against the ground.
    pub ground: Coefficients,
    /// The funnel, its outlet above the ground.
    pub funnel: Funnel,
    /// Gravity in m/s2; one that leans stands for ground that does.
    pub gravity_m_s2: [f64; 3],
    /// Quadratic air drag k in 1/m, zero or more.
    pub drag_per_m: f64,
    /// How long the outlet stays closed, s, zero or more.
    pub closed_s: f64,
    /// Step in s; none for the longest stable one.
    pub step_s: Option<f64>,
    /// When to stop; none for [`Rest::usual`].
    pub rest: Option<Rest>,
    /// The longest time after the outlet's opening, s, positive.
    pub most_s: f64,
}

/// What lies on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Poured {
    /// Centres in m.
    pub positions_m: Vec<[f64; 3]>,
    /// Radii in m.
    pub radii_m: Vec<f64>,
    /// Time from the outlet's opening to the end, s.
    pub time_s: f64,
    /// Whether the grains came to rest before the longest time was over.
    pub at_rest: bool,
    /// What it took.
    pub counters: Counters,
    /// The funnel's axis, m.
    pub axis_m: [f64; 2],
}

impl Poured {
    /// The heap's numbers about the funnel's axis.
    pub fn heap(&self) -> Result<Heap, DemError> {
        heap(&self.positions_m, &self.radii_m, self.axis_m)
    }
}

impl Pour {
    /// Walls of the funnel, which move together: cone and tube.
    pub const FUNNEL: [usize; 2] = [1, 2];
    /// The wall that closes the outlet.
    pub const GATE: usize = 3;

    /// Refuses numbers outside their ranges.
    pub fn check(&self) -> Result<(), DemError> {
        if self.count == 0 || self.count > MAX_GRAINS {
            return Err(DemError::Count { received: self.count, most: MAX_GRAINS });
        }
        positive("diameter_m", self.diameter_m)?;
        within("size_variation", self.size_variation, 0.0, 0.5)?;
        positive("outlet_height_m", self.funnel.outlet_height_m)?;
        positive("most_s", self.most_s)?;
        within("closed_s", self.closed_s, 0.0, 1e3)?;
        finite("gravity_m_s2", self.gravity_m_s2)?;
        self.funnel.check()
    }

    /// Ground, cone, tube and the outlet's gate, in this order.
    fn walls(&self) -> Vec<Wall> {
        let up = [0.0, 0.0, 1.0];
        let plane = |height: f64| Shape::Plane { point_m: [0.0, 0.0, height], normal: up };
        let [cone, tube] = self.funnel.shapes();
        let with = |shape, coefficients| Wall { shape, coefficients };
        // A funnel is made not to stick.
        let funnel = Coefficients { work_of_adhesion_j_m2: 0.0, ..self.grains };
        vec![
            with(plane(0.0), self.ground),
            with(cone, funnel),
            with(tube, funnel),
            with(plane(self.funnel.outlet_height_m), funnel),
        ]
    }

    /// The filled funnel, its outlet ([`Pour::GATE`]) still closed.
    pub fn filled(&self, seed: u64) -> Result<Simulation, DemError> {
        self.filled_among(&[], &[], &[], seed)
    }

    /// The filled funnel among further walls (their indices begin after the gate's), over grains that lie already: centres and
    /// radii in m. Those that are poured come after them.
    ///
    /// # Errors
    /// As [`Pour::filled`]; [`DemError::Length`] for lists of two lengths.
    pub fn filled_among(
        &self,
        walls: &[Wall],
        lying_m: &[[f64; 3]],
        lying_radii_m: &[f64],
        seed: u64,
    ) -> Result<Simulation, DemError> {
        self.check()?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let radii = radii(self.count, 0.5 * self.diameter_m, self.size_variation, &mut rng);
        let places = fill(&self.funnel, &radii, &mut rng)?;
        let (places, radii) = ([lying_m, &places].concat(), [lying_radii_m, &radii].concat());
        let smallest = radii.iter().fold(f64::INFINITY, |a, &r| a.min(r));
        Simulation::new(&self.setup(walls, &places, smallest)?, &radii, &places)
    }

    /// The funnel filled with clumps of one shape, turned at random, over clumps that lie already; the diameter and its
    /// variation do not count.
    ///
    /// # Errors
    /// As [`Pour::filled`].
    pub fn filled_with(&self, clump: &Clump, lying: &[Placed], seed: u64) -> Result<Simulation, DemError> {
        self.check()?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let places = fill(&self.funnel, &vec![clump.reach_m(); self.count], &mut rng)?;
        let smallest = clump.radii().iter().fold(f64::INFINITY, |a, &r| a.min(r));
        let mut placed = lying.to_vec();
        for &position_m in &places {
            // Four Gaussian numbers point anywhere on the sphere of rotations.
            let q: [f64; 4] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
            let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
            let rotation_xyzw = q.map(|c| c / length);
            placed.push(Placed { clump: clump.clone(), position_m, rotation_xyzw });
        }
        Simulation::of_clumps(&self.setup(&[], &places, smallest)?, &placed)
    }

    fn setup(&self, walls: &[Wall], places: &[[f64; 3]], smallest: f64) -> Result<Setup, DemError> {
        let top = places.iter().fold(0.0, |a: f64, p| a.max(p[2]));
        let gravity = dot(self.gravity_m_s2, self.gravity_m_s2).sqrt();
        // No impact is faster than a fall from the top of the fill.
        let fastest_m_s = (2.0 * gravity * top).sqrt().max(1e-3);
        let stable = stable_step_s(&self.law, self.density_kg_m3, smallest, fastest_m_s)?;
        Ok(Setup {
            law: self.law,
            density_kg_m3: self.density_kg_m3,
            grains: self.grains,
            walls: [&self.walls(), walls].concat(),
            gravity_m_s2: self.gravity_m_s2,
            drag_per_m: self.drag_per_m,
            step_s: self.step_s.unwrap_or(stable),
            fastest_m_s,
        })
    }

    /// Pours: the same seed gives the same bits.
    pub fn run(&self, seed: u64) -> Result<Poured, DemError> {
        self.pour_out(self.filled(seed)?)
    }

    /// Pours clumps of one shape; what lies on the ground is told sphere by sphere.
    ///
    /// # Errors
    /// As [`Pour::run`].
    pub fn run_with(&self, clump: &Clump, seed: u64) -> Result<Poured, DemError> {
        self.pour_out(self.filled_with(clump, &[], seed)?)
    }

    /// Opens the outlet of a filled funnel and waits for rest.
    ///
    /// # Errors
    /// As [`Pour::run`].
    pub fn pour_out(&self, mut simulation: Simulation) -> Result<Poured, DemError> {
        if self.closed_s > 0.0 {
            let steps = (self.closed_s / simulation.step_s()).round() as u64;
            simulation.run(steps)?;
        }
        simulation.remove_wall(Self::GATE)?;
        let opened_s = simulation.time_s();
        let mass = simulation.masses_kg().iter().sum::<f64>() / simulation.masses_kg().len() as f64;
        let gravity = dot(self.gravity_m_s2, self.gravity_m_s2).sqrt();
        let rest = self.rest.unwrap_or_else(|| Rest::usual(mass, self.diameter_m, gravity));
        let at_rest = simulation.run_until_rest(&rest, self.most_s)?;
        Ok(Poured {
            positions_m: simulation.positions_m().collect(),
            radii_m: simulation.radii_m().collect(),
            time_s: simulation.time_s() - opened_s,
            at_rest,
            counters: simulation.counters(),
            axis_m: self.funnel.axis_m,
        })
    }
}
