//! From the 16 statistics of one picture to a posterior over `mu_s`, `ln mu_r` and e (section 3.4).

use bayes_sim::error::Error;
use bayes_sim::mdn::MixtureDensity;
use bayes_sim::mdrff::{Mdrff, MdrffSettings};
use bayes_sim::novelty::{Novelty, Resemblance};
use bayes_sim::posterior::{ConditionalDensity, Posterior};
use bayes_sim::prior::Prior;
use bayes_sim::simulations::Simulations;
use bayes_sim::training::TrainingSettings;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::scene::Grain;
use crate::shipped::{self, ShippedError};
use crate::summary::COUNT;

/// The shipped posterior, as `granular-infer/examples/study.rs` writes it.
const SHIPPED: &[u8] = include_bytes!("../posterior.json.gz");
/// Draws of which an estimate is the mean.
const DRAWS: usize = 4000;

/// What was learned from a campaign.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GrainPosterior {
    density: Mdrff,
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

/// Settings that learn chapter 3's posterior: Matern 5/2, as the thesis; few frequencies and two components, with weights that
/// decay, since a thousand pictures of 16 numbers are soon learned by heart.
pub fn settings() -> MdrffSettings {
    let training =
        TrainingSettings { weight_decay: 0.05, max_epochs: 200, ..MdrffSettings::default().training };
    MdrffSettings { frequencies: 40, components: 2, training, ..MdrffSettings::default() }
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

    /// The density of parameters given statistics, for calibration.
    pub fn density(&self) -> &dyn ConditionalDensity {
        &self.density
    }

    /// How many pictures it was learned from.
    pub fn simulations(&self) -> usize {
        self.simulations
    }

    /// The posterior at the statistics of a picture.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    pub fn infer(&self, statistics: &[f64; COUNT]) -> Result<Inferred, Error> {
        Ok(Inferred {
            posterior: self.density.posterior(statistics)?,
            resemblance: self.novelty.compare(statistics)?,
        })
    }

    /// Distance of two pictures' statistics, each in standard deviations of the training's: the thesis's L2 error.
    pub fn distance(&self, a: &[f64; COUNT], b: &[f64; COUNT]) -> f64 {
        a.iter().zip(b).zip(&self.sd).map(|((a, b), sd)| ((a - b) / sd).powi(2)).sum::<f64>().sqrt()
    }
}

impl Inferred {
    /// The posterior's mean in `(mu_s, ln mu_r, e)`, from 4,000 draws of a generator of its own: the estimate whose squared
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
