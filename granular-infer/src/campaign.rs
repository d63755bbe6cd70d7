//! Many small pours over a range of conditions, from which an emulator of pictures is made.

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::dem::{Clump, Coefficients, DemError, Funnel, Law, Pour, Poured};

/// Young's modulus of the grains in campaigns, Pa. Softer than real grains: a pour takes a fifth of the time of one with 5 MPa
/// and its heap is the same within the spread from pour to pour.
pub const MODULUS_PA: f64 = 1e6;

/// Where grains are put that the funnel takes with it, in diameters from the axis.
const GONE_D: f64 = 1000.0;

/// What is poured, and through which funnel; the same for all pours of a campaign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rig {
    /// Number of grains.
    pub count: usize,
    /// Mean diameter in m.
    pub diameter_m: f64,
    /// Mean mass in kg.
    pub mass_kg: f64,
    /// Radius of the funnel's outlet in m.
    pub outlet_radius_m: f64,
    /// Half angle of the funnel's cone in rad.
    pub cone_half_angle_rad: f64,
    /// Radius of the funnel's tube in m.
    pub tube_radius_m: f64,
}

/// What differs from pour to pour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// Sliding friction among grains.
    pub sliding_friction: f64,
    /// Rolling friction.
    pub rolling_friction: f64,
    /// Restitution.
    pub restitution: f64,
    /// Share of critical damping of the rolling spring.
    pub rolling_damping: f64,
    /// Height of the outlet above the ground in m.
    pub height_m: f64,
    /// Work of adhesion in J/m2.
    pub work_of_adhesion_j_m2: f64,
    /// Sliding friction against the ground over that among grains.
    pub ground_ratio: f64,
    /// Coefficient of variation of the diameter.
    pub size_variation: f64,
    /// Downhill slope of the ground along x and y, rad.
    pub tilt_rad: [f64; 2],
    /// Quadratic air drag k in 1/m.
    pub drag_per_m: f64,
    /// Length of a grain over its width: 1 for spheres, more for rods with round ends of the same volume.
    pub aspect_ratio: f64,
}

/// Ranges of [`Conditions`]: friction and restitution within which real grains lie, and effects up to a strong one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ranges {
    /// Sliding friction, on a log scale.
    pub sliding_friction: [f64; 2],
    /// Rolling friction, on a log scale.
    pub rolling_friction: [f64; 2],
    /// Restitution.
    pub restitution: [f64; 2],
    /// Largest share of critical damping of the rolling spring.
    pub rolling_damping: f64,
    /// Height of the outlet in m.
    pub height_m: [f64; 2],
    /// Largest work of adhesion in J/m2.
    pub work_of_adhesion_j_m2: f64,
    /// Largest factor between the frictions against the ground and among grains.
    pub ground_ratio: f64,
    /// Largest coefficient of variation.
    pub size_variation: f64,
    /// Largest tilt in rad.
    pub tilt_rad: f64,
    /// Largest drag in 1/m.
    pub drag_per_m: f64,
    /// Largest length over width.
    pub aspect_ratio: f64,
}

impl Default for Ranges {
    fn default() -> Self {
        Self {
            sliding_friction: [0.15, 1.0],
            rolling_friction: [0.04, 0.4],
            restitution: [0.2, 0.8],
            rolling_damping: 0.6,
            height_m: [0.025, 0.14],
            work_of_adhesion_j_m2: 0.25,
            ground_ratio: 4.0,
            size_variation: 0.4,
            tilt_rad: 0.12,
            drag_per_m: 6.0,
            aspect_ratio: 2.5,
        }
    }
}

/// Number of effects of [`Conditions`] that may be off.
const EFFECTS: usize = 6;

impl Ranges {
    /// The middle of friction, restitution and height, no effect on.
    pub fn baseline(&self) -> Conditions {
        let middle = |[a, b]: [f64; 2]| 0.5 * (a + b);
        Conditions {
            sliding_friction: middle(self.sliding_friction.map(f64::ln)).exp(),
            rolling_friction: middle(self.rolling_friction.map(f64::ln)).exp(),
            restitution: middle(self.restitution),
            rolling_damping: Coefficients::ROLLING_DAMPING,
            height_m: middle(self.height_m),
            work_of_adhesion_j_m2: 0.0,
            ground_ratio: 1.0,
            size_variation: 0.0,
            tilt_rad: [0.0; 2],
            drag_per_m: 0.0,
            aspect_ratio: 1.0,
        }
    }

    /// The conditions of a pour: a third of the pours has no effect on, the others have one or two. Only pours of even number may be
    /// of rods, and every other one of odd number has another rolling damping than [`Coefficients::ROLLING_DAMPING`].
    pub fn draw(&self, seed: u64, pour: u64) -> Conditions {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(pour);
        let mut unit = || rng.random::<f64>();
        let log = |[a, b]: [f64; 2], u: f64| a * (b / a).powf(u);
        let line = |[a, b]: [f64; 2], u: f64| a + (b - a) * u;
        let mut conditions = Conditions {
            sliding_friction: log(self.sliding_friction, unit()),
            rolling_friction: log(self.rolling_friction, unit()),
            restitution: line(self.restitution, unit()),
            height_m: line(self.height_m, unit()),
            ..self.baseline()
        };
        let first = (unit() * EFFECTS as f64 * 1.5) as usize;
        let second = (unit() * EFFECTS as f64 * 2.0) as usize;
        for effect in [first, second] {
            let (u, azimuth) = (unit(), TAU * unit());
            if first >= EFFECTS {
                continue;
            }
            match effect {
                0 => conditions.work_of_adhesion_j_m2 = self.work_of_adhesion_j_m2 * u * u,
                1 => conditions.ground_ratio = log([1.0 / self.ground_ratio, self.ground_ratio], u),
                2 => conditions.size_variation = self.size_variation * u,
                3 => {
                    let (sine, cosine) = azimuth.sin_cos();
                    conditions.tilt_rad = [self.tilt_rad * u * cosine, self.tilt_rad * u * sine];
                }
                4 => conditions.drag_per_m = self.drag_per_m * u,
                // A pour of rods takes ten times as long.
                5 if pour.is_multiple_of(2) => conditions.aspect_ratio = line([1.0, self.aspect_ratio], u),
                _ => {}
            }
        }
        if pour % 4 == 3 {
            // Little damping matters most.
            conditions.rolling_damping = self.rolling_damping * unit().powi(2);
        }
        conditions
    }
}

/// Grains that lie on the ground, seen from above.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Grains {
    /// Centres in m; the funnel's axis is at x = y = 0.
    pub positions_m: Vec<[f64; 3]>,
    /// Radii in m.
    pub radii_m: Vec<f64>,
}

impl Rig {
    /// Volume of a mean grain, m3.
    pub fn grain_volume_m3(&self) -> f64 {
        PI / 6.0 * self.diameter_m.powi(3)
    }

    /// Density of the grains, kg/m3.
    pub fn density_kg_m3(&self) -> f64 {
        self.mass_kg / self.grain_volume_m3()
    }

    /// The scene of a pour of spheres: from a funnel that opens at once over grains that do not touch yet.
    pub fn scene(&self, conditions: &Conditions) -> Pour {
        let c = conditions;
        let grains = Coefficients {
            work_of_adhesion_j_m2: c.work_of_adhesion_j_m2,
            rolling_damping: c.rolling_damping,
            ..Coefficients::dry(c.restitution, c.sliding_friction, c.rolling_friction)
        };
        let ground = Coefficients { sliding_friction: c.ground_ratio * c.sliding_friction, ..grains };
        let [x, y] = c.tilt_rad.map(f64::sin);
        let down = (1.0 - x * x - y * y).max(0.0).sqrt();
        Pour {
            count: self.count,
            diameter_m: self.diameter_m,
            size_variation: c.size_variation,
            density_kg_m3: self.density_kg_m3(),
            law: Law::Hertz { modulus_pa: MODULUS_PA, poisson_ratio: 0.25 },
            grains,
            ground,
            funnel: Funnel {
                outlet_radius_m: self.outlet_radius_m,
                cone_half_angle_rad: self.cone_half_angle_rad,
                tube_radius_m: self.tube_radius_m,
                outlet_height_m: c.height_m,
                axis_m: [0.0; 2],
            },
            gravity_m_s2: [x, y, -down].map(|g| 9.80665 * g),
            drag_per_m: c.drag_per_m,
            closed_s: 0.0,
            step_s: None,
            rest: None,
            most_s: 3.0,
        }
    }

    /// Pours once; the same seed gives the same grains. Those that stick in the funnel go with it, far out of any picture.
    ///
    /// # Errors
    /// [`DemError`] for conditions outside physics.
    pub fn pour(&self, conditions: &Conditions, seed: u64) -> Result<Grains, DemError> {
        let scene = self.scene(conditions);
        let poured = if conditions.aspect_ratio > 1.0 {
            scene.run_with(&Clump::rod(self.diameter_m, conditions.aspect_ratio)?, seed)?
        } else {
            scene.run(seed)?
        };
        Ok(Grains::lying(poured, &scene))
    }
}

impl Grains {
    /// What lies in a scene when its funnel is taken away, and what sticks in it.
    pub fn lying(poured: Poured, scene: &Pour) -> Self {
        let gone = [GONE_D * scene.diameter_m, 0.0, 0.0];
        let stays = |p: [f64; 3]| if p[2] < scene.funnel.outlet_height_m { p } else { gone };
        Self { positions_m: poured.positions_m.into_iter().map(stays).collect(), radii_m: poured.radii_m }
    }
}
