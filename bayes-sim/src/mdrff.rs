//! Mixture densities on random Fourier features: BayesSim's MDRFF (Ramos, Possas and Fox 2019, doi:10.15607/RSS.2019.XV.029).

use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::ensemble::Plan;
use crate::error::Error;
use crate::kernel::{Family, Form, Kernel};
use crate::mdn::{MixtureDensity, Trained, check_components, mixture_density};
use crate::points::Points;
use crate::posterior::{ConditionalDensity, Posterior};
use crate::prior::Prior;
use crate::random_features::Draw;
use crate::simulations::Simulations;
use crate::training::{TrainingReport, TrainingSettings};

/// Settings of [`Mdrff::train`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MdrffSettings {
    /// How fast the kernel falls; [Matl 2021], chapter 3, uses Matern 5/2.
    pub family: Family,
    /// How dimensions are put together.
    pub form: Form,
    /// How frequencies are drawn.
    pub draw: Draw,
    /// Length scale in standard deviations of the features; a quarter to four times it are tried by held-out error. None for the
    /// root of the number of features, about the distance of two observations.
    pub length_scale: Option<f64>,
    /// Frequencies: half the number of features.
    pub frequencies: usize,
    /// Gaussian components of each member.
    pub components: usize,
    /// Members, each with frequencies of its own; a linear Gaussian regression joins them, and all are weighted by held-out density.
    pub members: usize,
    /// How the outputs are trained.
    pub training: TrainingSettings,
}

impl Default for MdrffSettings {
    fn default() -> Self {
        Self {
            family: Family::Matern52,
            form: Form::Isotropic,
            draw: Draw::QuasiRandom,
            length_scale: None,
            frequencies: 150,
            components: 8,
            members: 3,
            training: TrainingSettings { learning_rate: 3e-3, ..TrainingSettings::default() },
        }
    }
}

/// A trained mixture density on random Fourier features.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mdrff {
    trained: Trained,
}

impl Mdrff {
    /// Learns q(theta | x) from simulations whose parameters were drawn from the prior. Same seed, same bits, on any number of
    /// threads.
    ///
    /// # Errors
    /// [`Error::OutsidePrior`], [`Error::Length`], [`Error::Setting`], [`Error::Diverged`].
    pub fn train(
        prior: &Prior,
        simulations: &Simulations,
        settings: &MdrffSettings,
        seed: u64,
    ) -> Result<Self, Error> {
        check_components(settings.components, &[], settings.members)?;
        let length_scale = settings.length_scale.unwrap_or((simulations.x().dim() as f64).sqrt());
        let kernel = Kernel { family: settings.family, form: settings.form, length_scale };
        let features = Plan::Features {
            kernel,
            count: settings.frequencies,
            draw: settings.draw,
            components: settings.components,
        };
        let mut plans = vec![Plan::Linear];
        plans.resize(1 + settings.members, features);
        Ok(Self { trained: Trained::train(prior, simulations, &plans, &settings.training, seed)? })
    }
}

mixture_density!(Mdrff);
