//! From the 16 statistics of a picture, or of several, to a posterior over `mu_s`, `ln mu_r` and e (section 3.4).

use bayes_sim::error::Error;
use bayes_sim::mdn::MixtureDensity;
use bayes_sim::mdrff::{Mdrff, MdrffSettings};
use bayes_sim::mixture::Mixture;
use bayes_sim::novelty::{Novelty, Resemblance};
use bayes_sim::points::Points;
use bayes_sim::posterior::{ConditionalDensity, Posterior};
use bayes_sim::prior::Prior;
use bayes_sim::simulations::Simulations;
use bayes_sim::training::TrainingSettings;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::scene::Grain;
use crate::shipped::{self, ShippedError};
use crate::summary::COUNT;

/// The shipped posterior, as `granular-infer/examples/study.rs` writes it.
const SHIPPED: &[u8] = include_bytes!("../posterior.json.gz");
/// The shipped posterior of a series, as `granular-infer/examples/series.rs` writes it.
const SHIPPED_SERIES: &[u8] = include_bytes!("../series.json.gz");
/// The same on any cloth.
const SHIPPED_CLOTHS: &[u8] = include_bytes!("../cloths.json.gz");
/// Draws of which an estimate is the mean.
const DRAWS: usize = 4000;
/// Factors on variances that are tried.
const WIDENINGS: [f64; 13] = [0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0];

/// What was learned from a campaign; its variances may be multiplied by what unseen simulations ask for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GrainPosterior {
    density: Mdrff,
    widening: f64,
    novelty: Novelty,
    /// Spread of the statistics over the training's pictures.
    sd: Vec<f64>,
    simulations: usize,
}

/// What a picture tells of its grains.
#[derive(Debug, Clone)]
pub struct Inferred {
    /// The posterior over `[mu_s, mu_r, e]`; its coordinates are `mu_s`, `ln mu_r` and e.
    pub posterior: Posterior,
    /// Whether the picture is like those that were learned from.
    pub resemblance: Resemblance,
}

/// Settings that learn a posterior of so many pictures of the same grains: Matern 5/2 as in [Matl 2021], chapter 3; two components, with weights that
/// decay, since a thousand pictures of 16 numbers are soon learned by heart. One picture is learned from as well with few frequencies.
pub fn settings(pictures: usize) -> MdrffSettings {
    let (frequencies, weight_decay) = if pictures > 1 { (400, 0.1) } else { (40, 0.05) };
    let training = TrainingSettings { weight_decay, max_epochs: 200, ..MdrffSettings::default().training };
    MdrffSettings { frequencies, components: 2, training, ..MdrffSettings::default() }
}

impl GrainPosterior {
    /// Learns from pictures of pours whose parameters were drawn from the prior.
    ///
    /// # Errors
    /// [`Error`] of `bayes-sim`: parameters outside the prior, too few simulations, a training that diverged.
    pub fn train(
        prior: &Prior,
        simulations: &Simulations,
        settings: &MdrffSettings,
        seed: u64,
    ) -> Result<Self, Error> {
        let n = simulations.len() as f64;
        let spread = |column: Vec<f64>| {
            let mean = column.iter().sum::<f64>() / n;
            (column.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
        };
        Ok(Self {
            density: Mdrff::train(prior, simulations, settings, seed)?,
            widening: 1.0,
            novelty: Novelty::new(simulations.x(), seed)?,
            sd: (0..simulations.x().dim()).map(|j| spread(simulations.x().column(j))).collect(),
            simulations: simulations.len(),
        })
    }

    /// The same, its variances multiplied by the factor under which simulations that it has not seen are likeliest: what is
    /// learned from a thousand pictures is too sure of itself. (As a temperature is found: Guo et al. 2017, arXiv:1706.04599.)
    ///
    /// # Errors
    /// [`Error`] of `bayes-sim`, for statistics that are not finite.
    pub fn widened(mut self, unseen: &Simulations) -> Result<Self, Error> {
        let mut best = (f64::NEG_INFINITY, 1.0);
        for widening in WIDENINGS {
            self.widening = widening;
            let mut sum = 0.0;
            for (theta, x) in unseen.theta().rows().zip(unseen.x().rows()) {
                sum += self.ln_density(theta, x)?;
            }
            if sum > best.0 {
                best = (sum, widening);
            }
        }
        self.widening = best.1;
        Ok(self)
    }

    /// The posterior that is shipped: pours of [`crate::scene::Scene::default`] from 12 cm, seen by
    /// [`crate::view::View::default`], under [`crate::scene::prior`].
    ///
    /// # Errors
    /// [`ShippedError`], if the crate's file is damaged.
    pub fn shipped() -> Result<Self, ShippedError> {
        Self::from_bytes(SHIPPED)
    }

    /// The posterior of a series that is shipped: the same grains poured once from each of [`crate::scene::SERIES_M`], else as
    /// [`GrainPosterior::shipped`]. [`GrainPosterior::infer_series`] takes the three pictures. Like that one it takes the cloth for velvet of the
    /// scene's rolling friction, and is too sure of itself on any other: see [`GrainPosterior::shipped_cloths`].
    ///
    /// # Errors
    /// [`ShippedError`], if the crate's file is damaged.
    pub fn shipped_series() -> Result<Self, ShippedError> {
        Self::from_bytes(SHIPPED_SERIES)
    }

    /// The same for a cloth whose rolling friction is not known, anywhere in [`crate::scene::CLOTHS`]: a nuisance parameter, integrated out.
    ///
    /// # Errors
    /// [`ShippedError`], if the crate's file is damaged.
    pub fn shipped_cloths() -> Result<Self, ShippedError> {
        Self::from_bytes(SHIPPED_CLOTHS)
    }

    /// Reads what [`GrainPosterior::to_bytes`] wrote.
    ///
    /// # Errors
    /// [`ShippedError`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ShippedError> {
        shipped::unpack(bytes)
    }

    /// Compressed JSON; reading it gives the same bits.
    ///
    /// # Errors
    /// [`ShippedError`].
    pub fn to_bytes(&self) -> Result<Vec<u8>, ShippedError> {
        shipped::pack(self)
    }

    /// The factor on the variances of what was learned.
    pub fn widening(&self) -> f64 {
        self.widening
    }

    /// How many pictures it was learned from.
    pub fn simulations(&self) -> usize {
        self.simulations
    }

    /// How many pictures an inference takes: one, or those of a series of pours from different heights.
    pub fn pictures(&self) -> usize {
        self.density.x_dim() / COUNT
    }

    /// The posterior at the statistics of a picture.
    ///
    /// # Errors
    /// [`Error::NotFinite`]; [`Error::Length`] where a series was learned.
    pub fn infer(&self, statistics: &[f64; COUNT]) -> Result<Inferred, Error> {
        self.infer_series(&[*statistics])
    }

    /// The posterior at the statistics of a series of pours of the same grains, in the order of the heights that were learned
    /// ([`crate::scene::SERIES_M`]).
    ///
    /// # Errors
    /// [`Error::NotFinite`]; [`Error::Length`] for another number of pictures than [`Self::pictures`].
    pub fn infer_series(&self, pictures: &[[f64; COUNT]]) -> Result<Inferred, Error> {
        let statistics = pictures.as_flattened();
        Ok(Inferred {
            posterior: self.posterior(statistics)?,
            resemblance: self.novelty.compare(statistics)?,
        })
    }

    fn posterior(&self, x: &[f64]) -> Result<Posterior, Error> {
        let learned = self.density.posterior(x)?;
        let (mixture, prior) = (learned.mixture(), learned.prior());
        let (mut means, mut covariances) = (Points::new(prior.dim()), Vec::new());
        for k in 0..mixture.len() {
            means.push(mixture.component_mean(k))?;
            covariances
                .push(mixture.component_covariance(k).into_iter().map(|v| self.widening * v).collect());
        }
        Posterior::new(prior.clone(), Mixture::new(&mixture.weights(), &means, &covariances)?)
    }

    /// Distance of two pictures' statistics, each in standard deviations of the training's: the L2 error of [Matl 2021].
    pub fn distance(&self, a: &[f64; COUNT], b: &[f64; COUNT]) -> f64 {
        a.iter().zip(b).zip(&self.sd).map(|((a, b), sd)| ((a - b) / sd).powi(2)).sum::<f64>().sqrt()
    }
}

impl ConditionalDensity for GrainPosterior {
    fn prior(&self) -> &Prior {
        self.density.prior()
    }

    fn x_dim(&self) -> usize {
        self.density.x_dim()
    }

    fn ln_density(&self, theta: &[f64], x: &[f64]) -> Result<f64, Error> {
        self.posterior(x)?.ln_density(theta)
    }

    fn ln_densities(&self, theta: &Points, x: &[f64]) -> Result<Vec<f64>, Error> {
        let posterior = self.posterior(x)?;
        theta.rows().map(|t| posterior.ln_density(t)).collect()
    }

    fn sample(&self, x: &[f64], count: usize, rng: &mut dyn Rng) -> Result<Points, Error> {
        Ok(self.posterior(x)?.sample(count, rng).theta)
    }
}

impl Inferred {
    /// The posterior's mean in `(mu_s, ln mu_r, e)`, from 4,000 draws of a separate generator: the estimate whose squared
    /// error is expected to be least.
    pub fn estimate(&self) -> Grain {
        let draws = self.posterior.sample(DRAWS, &mut ChaCha8Rng::seed_from_u64(0)).theta;
        let mut sum = [0.0; 3];
        for row in draws.rows() {
            let u = self.posterior.prior().coordinates(row);
            sum.iter_mut().zip(u).for_each(|(s, u)| *s += u);
        }
        let mean = sum.map(|s| s / DRAWS as f64);
        Grain { sliding_friction: mean[0], rolling_friction: mean[1].exp(), restitution: mean[2] }
    }
}
