//! Mixture density networks (Bishop 1994): a small network whose outputs are a mixture of Gaussians with full covariance.

use nalgebra::{DMatrix, DVector};
use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::component::Component;
use crate::ensemble::{Ensemble, Plan, networks};
use crate::error::Error;
use crate::mixture::Mixture;
use crate::network::Scratch;
use crate::points::{Points, check_row};
use crate::posterior::{ConditionalDensity, Posterior};
use crate::prior::Prior;
use crate::scaling::{InputScaling, OutputScaling};
use crate::simulations::{Prepared, Simulations};
use crate::training::{TrainingReport, TrainingSettings};

/// Settings of [`Mdn::train`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MdnSettings {
    /// Gaussian components of each network.
    pub components: usize,
    /// Units of each hidden layer.
    pub hidden: Vec<usize>,
    /// Networks; a linear Gaussian regression joins them, and all are weighted by held-out density.
    pub members: usize,
    /// How each is trained.
    pub training: TrainingSettings,
}

impl Default for MdnSettings {
    fn default() -> Self {
        Self { components: 8, hidden: vec![64, 64, 64], members: 2, training: TrainingSettings::default() }
    }
}

/// A density whose posterior at any observation is a mixture of Gaussians: [`Mdn`] or [`crate::mdrff::Mdrff`].
pub trait MixtureDensity: ConditionalDensity {
    /// The posterior at an observation, as a value.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::NotFinite`].
    fn posterior(&self, x: &[f64]) -> Result<Posterior, Error>;

    /// How each member's training went.
    fn reports(&self) -> &[TrainingReport];
}

/// What both kinds of mixture density are once they are trained.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Trained {
    pub(crate) prior: Prior,
    input: InputScaling,
    output: OutputScaling,
    pub(crate) ensemble: Ensemble,
}

impl Trained {
    pub(crate) fn train(
        prior: &Prior,
        simulations: &Simulations,
        plans: &[Plan],
        training: &TrainingSettings,
        seed: u64,
    ) -> Result<Self, Error> {
        training.check()?;
        let prepared = Prepared::new(prior, simulations, training.validation_share, seed)?;
        let (pairs, held_out) = prepared.pairs(0, 0..prior.dim());
        let bounds = prepared.bounds(prior);
        let ensemble = Ensemble::train(plans, None, &bounds, [&pairs, &held_out], training, seed)?;
        Ok(Self { prior: prior.clone(), input: prepared.input, output: prepared.output, ensemble })
    }

    pub(crate) fn x_dim(&self) -> usize {
        self.input.dim()
    }

    pub(crate) fn posterior(&self, x: &[f64]) -> Result<Posterior, Error> {
        check_row("observation", x, self.x_dim())?;
        let mut inputs = Vec::with_capacity(x.len());
        self.input.apply(x, &mut inputs);
        let (mut scratch, mut components) = (Scratch::default(), Vec::new());
        for (member, weight) in self.ensemble.members.iter().zip(&self.ensemble.weights) {
            let outputs = member.outputs(&inputs, 1, &mut scratch);
            let stride = member.head.stride();
            let logits = outputs.iter().step_by(stride).copied();
            let ln_total = crate::normal::ln_sum_exp(logits);
            for block in outputs.chunks_exact(stride) {
                let ln_weight = weight.ln() + block[0] - ln_total;
                // Components that no draw would ever come from.
                if ln_weight > -16.0 {
                    components.push(self.component(&member.head, block, ln_weight));
                }
            }
        }
        Posterior::new(self.prior.clone(), Mixture::normalised(components))
    }

    /// One component in the prior's coordinates.
    fn component(&self, head: &crate::head::Head, block: &[f64], ln_weight: f64) -> Component {
        let d = head.dim;
        let OutputScaling { centre, scale } = &self.output;
        let mean = DVector::from_fn(d, |i, _| centre[i] + scale[i] * block[1 + i]);
        let mut factor = DMatrix::zeros(d, d);
        let mut at = 2 * d + 1;
        for i in 0..d {
            let precision = head.precision(block, i);
            for j in 0..i {
                factor[(i, j)] = precision * block[at] / scale[j];
                at += 1;
            }
            factor[(i, i)] = precision / scale[i];
        }
        Component { ln_weight, mean, factor }
    }
}

/// A trained mixture density network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mdn {
    trained: Trained,
}

impl Mdn {
    /// Learns q(theta | x) from simulations whose parameters were drawn from the prior. Same seed, same bits, on any number of
    /// threads.
    ///
    /// # Errors
    /// [`Error::OutsidePrior`], [`Error::Length`], [`Error::Setting`], [`Error::Diverged`].
    pub fn train(
        prior: &Prior,
        simulations: &Simulations,
        settings: &MdnSettings,
        seed: u64,
    ) -> Result<Self, Error> {
        check_components(settings.components, &settings.hidden, settings.members)?;
        let plans = networks(&settings.hidden, settings.components, settings.members);
        Ok(Self { trained: Trained::train(prior, simulations, &plans, &settings.training, seed)? })
    }
}

pub(crate) fn check_components(components: usize, hidden: &[usize], members: usize) -> Result<(), Error> {
    let least = |name, value: usize| {
        if value == 0 { Err(Error::Setting { name, value: 0.0, rule: "at least 1" }) } else { Ok(()) }
    };
    least("components", components)?;
    least("members", members)?;
    hidden.iter().try_for_each(|&h| least("hidden", h))
}

/// Both mixture densities answer alike.
macro_rules! mixture_density {
    ($name:ty) => {
        impl ConditionalDensity for $name {
            fn prior(&self) -> &Prior {
                &self.trained.prior
            }

            fn x_dim(&self) -> usize {
                self.trained.x_dim()
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

        impl MixtureDensity for $name {
            fn posterior(&self, x: &[f64]) -> Result<Posterior, Error> {
                self.trained.posterior(x)
            }

            fn reports(&self) -> &[TrainingReport] {
                &self.trained.ensemble.reports
            }
        }
    };
}
pub(crate) use mixture_density;

mixture_density!(Mdn);
