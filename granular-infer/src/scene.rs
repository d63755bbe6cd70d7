//! The pours of chapter 3: grains through a funnel onto cloth, for a prior over what grains are.
//!
//! A simulation's numbers are the grains' centres, not statistics of them: one campaign serves every camera, every flaw of a
//! picture and every choice of statistics.

use bayes_sim::campaign::{SimulationFailure, Simulator};
use bayes_sim::error::Error;
use bayes_sim::prior::{Marginal, Prior};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::campaign::{Grains, MODULUS_PA, Rig};
use crate::dem::{Coefficients, DemError, Funnel, Law, Pour, Rest};

/// Step in m to which the centres of a campaign are rounded: what a text file keeps of them.
const ROUNDED_M: f64 = 1e-5;

/// What is unknown of the grains: theta of the posterior, in this order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grain {
    /// Sliding friction `mu_s`, among grains and on the cloth.
    pub sliding_friction: f64,
    /// Rolling friction `mu_r` among grains: largest couple over (reduced radius times normal force).
    pub rolling_friction: f64,
    /// Restitution e, among grains and on the cloth.
    pub restitution: f64,
}

/// Heights in m of the outlet from which a series of pours is made: low enough that grains hardly bounce, and three times as high as one pour.
pub const SERIES_M: [f64; 3] = [0.04, 0.12, 0.24];

/// Range of the rolling friction of cloths, from felt that grains roll on to velvet that holds them.
pub const CLOTHS: [f64; 2] = [0.1, 1.0];

/// Couscous as [Matl 2021] inferred it (section 3.6); its `mu_r = 8e-7` means something in its solver alone.
pub const COUSCOUS: Grain = Grain { sliding_friction: 0.6687, rolling_friction: 0.05, restitution: 0.7689 };

impl Grain {
    /// From `[mu_s, mu_r, e]`; none for another number of parameters.
    pub fn from_theta(theta: &[f64]) -> Option<Self> {
        let &[sliding_friction, rolling_friction, restitution] = theta else { return None };
        Some(Self { sliding_friction, rolling_friction, restitution })
    }

    /// `[mu_s, mu_r, e]`.
    pub fn theta(&self) -> [f64; 3] {
        [self.sliding_friction, self.rolling_friction, self.restitution]
    }
}

/// The prior under which nine in ten pours from 12 cm have half of their grains within 10 cm, as couscous has, in a heap or a ring:
/// `mu_s` flat in 0.1 to 1, `mu_r` flat in its logarithm in 1e-3 to 0.5, e flat in 0.05 to 0.8.
///
/// # Errors
/// None; the bounds are in order.
pub fn prior() -> Result<Prior, Error> {
    Prior::new(vec![
        Marginal::Uniform { low: 0.1, high: 1.0 },
        Marginal::LogUniform { low: 1e-3, high: 0.5 },
        Marginal::Uniform { low: 0.05, high: 0.8 },
    ])
}

/// A prior from which grains cannot be drawn.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PriorError {
    /// It is over another number of parameters.
    #[error("a prior over {received} parameters, expected 3: mu_s, mu_r, e")]
    Dimensions {
        /// Parameters that it has.
        received: usize,
    },
    /// It reaches outside physics.
    #[error("the prior reaches outside physics: {0}")]
    Outside(#[from] DemError),
}

/// Whether every draw of a prior over `[mu_s, mu_r, e]` can be poured; a campaign under another is a list of failures.
///
/// # Errors
/// [`PriorError`]; a prior without bounds reaches outside.
pub fn check_prior(prior: &Prior) -> Result<(), PriorError> {
    let ends = |m: &Marginal| match m {
        Marginal::LogUniform { .. } | Marginal::LogNormal { .. } => m.bounds().map(f64::exp),
        Marginal::Uniform { .. } | Marginal::Normal { .. } => m.bounds(),
    };
    let &[sliding, rolling, restitution] = prior.marginals().iter().map(ends).collect::<Vec<_>>().as_slice()
    else {
        return Err(PriorError::Dimensions { received: prior.dim() });
    };
    for end in 0..2 {
        Coefficients::dry(restitution[end], sliding[end], rolling[end]).check()?;
    }
    Ok(())
}

/// Where grains are poured: the rig and the cloth under it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scene {
    /// Grains and funnel.
    pub rig: Rig,
    /// Rolling friction of a grain on the cloth. It is the cloth's and not the grains': on a hard floor spheres with a small
    /// `mu_r` roll away in any simulator, on velvet they stop.
    pub cloth_rolling_friction: f64,
    /// The longest pour in s; grains that still roll by then are far off.
    pub most_s: f64,
}

impl Default for Scene {
    /// Six hundred grains of 4 mm and 1,300 kg/m3 through an outlet of 28 mm onto velvet.
    fn default() -> Self {
        Self {
            rig: Rig {
                count: 600,
                diameter_m: 4e-3,
                mass_kg: 4.356e-5,
                outlet_radius_m: 0.014,
                cone_half_angle_rad: std::f64::consts::FRAC_PI_4,
                tube_radius_m: 0.04,
            },
            cloth_rolling_friction: 0.3,
            most_s: 2.0,
        }
    }
}

impl Scene {
    /// The same on a cloth whose rolling friction lies within a range, at a part of it from 0 to 1, even in the logarithm.
    #[must_use]
    pub fn on_cloth(self, [low, high]: [f64; 2], part: f64) -> Self {
        Self { cloth_rolling_friction: low * (high / low).powf(part), ..self }
    }

    /// The pour of grains from an outlet at a height in m above the cloth.
    pub fn pour(&self, grain: &Grain, height_m: f64) -> Pour {
        let grains = Coefficients::dry(grain.restitution, grain.sliding_friction, grain.rolling_friction);
        let usual = Rest::usual(self.rig.mass_kg, self.rig.diameter_m, 9.80665);
        Pour {
            count: self.rig.count,
            diameter_m: self.rig.diameter_m,
            size_variation: 0.0,
            density_kg_m3: self.rig.density_kg_m3(),
            law: Law::Hertz { modulus_pa: MODULUS_PA, poisson_ratio: 0.25 },
            grains,
            ground: Coefficients { rolling_friction: self.cloth_rolling_friction, ..grains },
            funnel: Funnel {
                outlet_radius_m: self.rig.outlet_radius_m,
                cone_half_angle_rad: self.rig.cone_half_angle_rad,
                tube_radius_m: self.rig.tube_radius_m,
                outlet_height_m: height_m,
                axis_m: [0.0; 2],
            },
            gravity_m_s2: [0.0, 0.0, -9.80665],
            drag_per_m: 0.0,
            closed_s: 0.0,
            step_s: None,
            // From here on grains move by less than a pixel's noise.
            rest: Some(Rest { kinetic_j: 100.0 * usual.kinetic_j, hold_s: 0.05 }),
            most_s: self.most_s,
        }
    }

    /// Pours once; the same seed gives the same grains.
    ///
    /// # Errors
    /// [`DemError`] for coefficients outside physics.
    pub fn grains(&self, grain: &Grain, height_m: f64, seed: u64) -> Result<Grains, DemError> {
        let poured = self.pour(grain, height_m).run(seed)?;
        Ok(Grains { positions_m: poured.positions_m, radii_m: poured.radii_m })
    }

    /// The grains of a simulation's numbers; none where they are not three a grain.
    pub fn from_features(&self, x: &[f64]) -> Option<Grains> {
        (x.len() == 3 * self.rig.count).then(|| Grains {
            positions_m: x.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect(),
            radii_m: vec![0.5 * self.rig.diameter_m; self.rig.count],
        })
    }

    fn features(
        &self,
        grain: &Grain,
        height_m: f64,
        rng: &mut ChaCha8Rng,
    ) -> Result<Vec<f64>, SimulationFailure> {
        let grains = self
            .grains(grain, height_m, rng.random())
            .map_err(|e| SimulationFailure { reason: e.to_string() })?;
        // Divided by a whole number, so that the text is short.
        let rounded = |v: f64| (v / ROUNDED_M).round() / (1.0 / ROUNDED_M).round();
        Ok(grains.positions_m.iter().flatten().map(|&v| rounded(v)).collect())
    }
}

/// Pours of grains of any kind, once from each of some heights: theta is `[mu_s, mu_r, e]`, x the centres, pour after pour.
#[derive(Debug, Clone, PartialEq)]
pub struct FromHeights {
    /// Rig and cloth.
    pub scene: Scene,
    /// Heights of the outlet in m.
    pub heights_m: Vec<f64>,
    /// Range within which the cloth's rolling friction is drawn, flat in its logarithm, once for all heights: a nuisance parameter. None for the
    /// scene's.
    pub cloths: Option<[f64; 2]>,
}

impl Simulator for FromHeights {
    fn x_dim(&self) -> usize {
        3 * self.scene.rig.count * self.heights_m.len()
    }

    fn simulate(&self, theta: &[f64], rng: &mut ChaCha8Rng) -> Result<Vec<f64>, SimulationFailure> {
        let grain = Grain::from_theta(theta).ok_or_else(|| SimulationFailure {
            reason: format!("{} parameters instead of 3", theta.len()),
        })?;
        let scene = self.cloths.map_or(self.scene, |range| self.scene.on_cloth(range, rng.random()));
        let mut x = Vec::with_capacity(self.x_dim());
        for &height_m in &self.heights_m {
            x.extend(scene.features(&grain, height_m, rng)?);
        }
        Ok(x)
    }
}

/// Pours of one kind of grain from any height: theta is the height in m, x the centres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OfGrain {
    /// Rig and cloth.
    pub scene: Scene,
    /// The grain.
    pub grain: Grain,
}

impl Simulator for OfGrain {
    fn x_dim(&self) -> usize {
        3 * self.scene.rig.count
    }

    fn simulate(&self, theta: &[f64], rng: &mut ChaCha8Rng) -> Result<Vec<f64>, SimulationFailure> {
        let &[height_m] = theta else {
            return Err(SimulationFailure { reason: format!("{} parameters instead of 1", theta.len()) });
        };
        self.scene.features(&self.grain, height_m, rng)
    }
}
