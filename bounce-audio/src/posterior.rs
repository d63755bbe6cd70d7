//! Learned posteriors over (e, log10 kappa): drops for [`bayes_sim`], and what is read off its answer.

use crate::drop::{Ball, Bounce, DropModel, Release, Table};
use crate::features::{Features, Observed, Scale};
use bayes_sim::campaign::{SimulationFailure, Simulator};
use bayes_sim::error::Error;
use bayes_sim::posterior::Posterior;
use bayes_sim::prior::Prior;
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Bounds of (e, log10 kappa) in [Matl 2021], chapter 4.
pub const BOUNDS: [[f64; 2]; 2] = [[0.55, 0.95], [1.0, 5.0]];
/// The height of the drops in [Matl 2021], m.
pub const DROP_HEIGHT_M: f64 = 0.26;
/// Points at which a marginal is looked at for its peak.
const LATTICE: usize = 801;

/// The flat prior of [Matl 2021], chapter 4, over (e, log10 kappa).
///
/// # Errors
/// None in practice: the bounds are valid.
pub fn prior() -> Result<Prior, Error> {
    Prior::uniform(&BOUNDS)
}

/// How well impacts are measured.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Hearing {
    /// Standard deviation of a time, s.
    pub time_sigma_s: f64,
    /// Standard deviation of each coordinate of a place, m.
    pub position_sigma_m: f64,
}

impl Hearing {
    /// Impacts as they would be measured.
    pub fn blur<R: Rng + ?Sized>(&self, impacts: &mut [Bounce], rng: &mut R) {
        for one in impacts {
            let mut normal = || rng.sample::<f64, _>(StandardNormal);
            one.t_s += self.time_sigma_s * normal();
            one.position_m[0] += self.position_sigma_m * normal();
            one.position_m[1] += self.position_sigma_m * normal();
        }
    }
}

/// Simulates drops for a campaign: parameters (e, log10 kappa), features of the first three impacts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DropSimulator {
    /// How the ball is let go.
    pub release: Release,
    /// Gravity, m/s^2.
    pub gravity_m_s2: f64,
    /// How well impacts are measured.
    pub hearing: Hearing,
    /// Which features are looked at.
    pub observed: Observed,
    /// How distances are put.
    pub scale: Scale,
}

impl DropSimulator {
    /// The simulator of [Matl 2021]: from 0.26 m, measured without noise, all features.
    pub fn new() -> Self {
        Self {
            release: Release::at(DROP_HEIGHT_M),
            gravity_m_s2: 9.80665,
            hearing: Hearing::default(),
            observed: Observed::Both,
            scale: Scale::Metres,
        }
    }

    /// The features of one drop of a ball with `theta` = (e, log10 kappa).
    ///
    /// # Errors
    /// [`SimulationFailure`] for parameters out of range, a ball that comes to rest, or noise that swaps two impacts.
    pub fn features<R: Rng + ?Sized>(
        &self,
        theta: &[f64],
        rng: &mut R,
    ) -> Result<Features, SimulationFailure> {
        let failed = |reason: String| SimulationFailure { reason };
        let &[e, log10_kappa] = theta else {
            return Err(failed(format!("{} parameters, expected 2", theta.len())));
        };
        let ball = Ball::new(e, 10f64.powf(log10_kappa)).map_err(|e| failed(e.to_string()))?;
        let model =
            DropModel::new(ball, Table::LEVEL, self.gravity_m_s2).map_err(|e| failed(e.to_string()))?;
        let mut impacts = [Bounce::default(); 3];
        let start = self.release.draw(rng);
        let count = model.run(&start, rng, &mut impacts).map_err(|e| failed(e.to_string()))?;
        self.hearing.blur(&mut impacts, rng);
        Features::of(&impacts[..count]).map_err(|e| failed(e.to_string()))
    }
}

impl Default for DropSimulator {
    fn default() -> Self {
        Self::new()
    }
}

impl Simulator for DropSimulator {
    fn x_dim(&self) -> usize {
        let zero = Features { time_ratio: 1.0, d1_m: 1.0, d2_m: 1.0, alpha_rad: 0.0 };
        zero.numbers(self.observed, self.scale).len()
    }

    fn simulate(&self, theta: &[f64], rng: &mut ChaCha8Rng) -> Result<Vec<f64>, SimulationFailure> {
        Ok(self.features(theta, rng)?.numbers(self.observed, self.scale))
    }
}

/// The peak of one parameter's marginal within the prior (what [Matl 2021] compares with the truth), to 1/800 of the prior's width.
///
/// # Errors
/// [`Error::Length`] for a parameter that is not there.
pub fn marginal_peak(posterior: &Posterior, parameter: usize) -> Result<f64, Error> {
    let marginal = posterior.mixture().marginal(&[parameter])?;
    let [low, high] = posterior.prior().bounds()[parameter];
    let mut best = (f64::NEG_INFINITY, low);
    for i in 0..LATTICE {
        let at = low + (high - low) * i as f64 / (LATTICE - 1) as f64;
        let height = marginal.ln_density(&[at])?;
        if height > best.0 {
            best = (height, at);
        }
    }
    Ok(best.1)
}

/// The joint posterior as [Matl 2021] makes it: each mixture taken for one Gaussian, their product, nothing divided out (a flat prior).
///
/// # Errors
/// [`Error`] for none, or for posteriors over different priors.
pub fn projected_product(posteriors: &[Posterior]) -> Result<Posterior, Error> {
    let mut gaussians = Vec::with_capacity(posteriors.len());
    for posterior in posteriors {
        gaussians.push(Posterior::new(posterior.prior().clone(), posterior.mixture().projection()?)?);
    }
    Posterior::product(&gaussians)
}
