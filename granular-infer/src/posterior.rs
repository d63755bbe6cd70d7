//! From the 16 statistics of a picture, or of several, to a posterior over `mu_s`, `ln mu_r` and e (section 3.4).

use bayes_sim::autoregressive::{Autoregressive, AutoregressiveSettings};
use bayes_sim::error::Error;
use bayes_sim::novelty::{Novelty, Resemblance};
use bayes_sim::points::Points;
use bayes_sim::posterior::{ConditionalDensity, Given};
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

/// What was learned from a campaign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GrainPosterior {
    density: Autoregressive,
    novelty: Novelty,
    /// Spread of the statistics over the training's pictures.
    sd: Vec<f64>,
    simulations: usize,
}

/// What a picture tells of its grains.
#[derive(Debug, Clone)]
pub struct Inferred {
    /// The posterior over `[mu_s, mu_r, e]`; its coordinates are `mu_s`, `ln mu_r` and e.
    pub posterior: Given<Autoregressive>,
    /// Whether the picture is like those that were learned from.
    pub resemblance: Resemblance,
}

/// Settings that learn a posterior: small networks whose weights decay, since a thousand pictures of 16 numbers are soon learned by heart. Each
/// factor is cut to the prior's interval while it is learned; a mixture that is cut afterwards ([Matl 2021]'s way) is left with a bias where the
/// prior ends, as of a sliding friction that no heap shows any more.
pub fn settings() -> AutoregressiveSettings {
    let training = TrainingSettings { weight_decay: 0.3, ..TrainingSettings::default() };
    AutoregressiveSettings { components: 4, hidden: vec![32, 32], members: 3, training }
}

impl GrainPosterior {
    /// Learns from pictures of pours whose parameters were drawn from the prior.
    ///
    /// # Errors
    /// [`Error`] of `bayes-sim`: parameters outside the prior, too few simulations, a training that diverged.
    pub fn train(
        prior: &Prior,
        simulations: &Simulations,
        settings: &AutoregressiveSettings,
        seed: u64,
    ) -> Result<Self, Error> {
        let n = simulations.len() as f64;
        let spread = |column: Vec<f64>| {
            let mean = column.iter().sum::<f64>() / n;
            (column.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
        };
        Ok(Self {
            density: Autoregressive::train(prior, simulations, settings, seed)?,
            novelty: Novelty::new(simulations.x(), seed)?,
            sd: (0..simulations.x().dim()).map(|j| spread(simulations.x().column(j))).collect(),
            simulations: simulations.len(),
        })
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
            posterior: Given::new(self.density.clone(), statistics)?,
            resemblance: self.novelty.compare(statistics)?,
        })
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
        self.density.ln_density(theta, x)
    }

    fn ln_densities(&self, theta: &Points, x: &[f64]) -> Result<Vec<f64>, Error> {
        self.density.ln_densities(theta, x)
    }

    fn sample(&self, x: &[f64], count: usize, rng: &mut dyn Rng) -> Result<Points, Error> {
        self.density.sample(x, count, rng)
    }
}

impl Inferred {
    /// The posterior's mean in `(mu_s, ln mu_r, e)`, from 4,000 draws of a separate generator: the estimate whose squared
    /// error is expected to be least.
    ///
    /// # Errors
    /// [`Error`] of `bayes-sim`.
    pub fn estimate(&self) -> Result<Grain, Error> {
        let draws = self.posterior.sample(DRAWS, &mut ChaCha8Rng::seed_from_u64(0))?;
        let mut sum = [0.0; 3];
        for row in draws.rows() {
            let u = self.posterior.prior().coordinates(row);
            sum.iter_mut().zip(u).for_each(|(s, u)| *s += u);
        }
        let mean = sum.map(|s| s / DRAWS as f64);
        Ok(Grain { sliding_friction: mean[0], rolling_friction: mean[1].exp(), restitution: mean[2] })
    }
}
