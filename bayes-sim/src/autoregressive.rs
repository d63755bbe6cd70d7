//! One parameter after another: q(theta | x) = prod q(theta_i | theta_<i, x), each factor a mixture in one dimension that is cut to
//! the prior's interval (a conditional form of RNADE; Uria, Murray and Larochelle 2013, arXiv:1306.0186).
//!
//! The cut is part of the density that is trained, exact in one dimension: nothing leaks, no draw is refused, and any shape can be
//! learned, curved ridges included. The price is that a posterior is no mixture in all dimensions together.

use rand::{Rng, RngExt};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::ensemble::{Ensemble, networks};
use crate::error::Error;
use crate::head::choose;
use crate::mdn::check_components;
use crate::network::Scratch;
use crate::points::{Points, check_length, check_row};
use crate::posterior::ConditionalDensity;
use crate::prior::Prior;
use crate::scaling::{InputScaling, OutputScaling};
use crate::simulations::{Prepared, Simulations};
use crate::training::{Pairs, TrainingReport, TrainingSettings};

/// Settings of [`Autoregressive::train`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AutoregressiveSettings {
    /// Components of each factor.
    pub components: usize,
    /// Units of each hidden layer.
    pub hidden: Vec<usize>,
    /// Networks for each factor; a linear Gaussian regression joins them, and all are weighted by held-out density.
    pub members: usize,
    /// How each is trained.
    pub training: TrainingSettings,
}

impl Default for AutoregressiveSettings {
    fn default() -> Self {
        Self { components: 10, hidden: vec![64, 64, 64], members: 2, training: TrainingSettings::default() }
    }
}

/// A trained autoregressive density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Autoregressive {
    prior: Prior,
    input: InputScaling,
    output: OutputScaling,
    factors: Vec<Ensemble>,
}

impl Autoregressive {
    /// Learns q(theta | x) from simulations whose parameters were drawn from the prior. Same seed, same bits, on any number of
    /// threads.
    ///
    /// # Errors
    /// [`Error::OutsidePrior`], [`Error::Length`], [`Error::Setting`], [`Error::Diverged`].
    pub fn train(
        prior: &Prior,
        simulations: &Simulations,
        settings: &AutoregressiveSettings,
        seed: u64,
    ) -> Result<Self, Error> {
        check_components(settings.components, &settings.hidden, settings.members)?;
        settings.training.check()?;
        let prepared = Prepared::new(prior, simulations, settings.training.validation_share, seed)?;
        let plans = networks(&settings.hidden, settings.components, settings.members);
        let bounds = prepared.bounds(prior);
        let factors = (0..prior.dim())
            .into_par_iter()
            .map(|i| {
                let (pairs, held_out) = prepared.pairs(i, i..i + 1);
                let cut = bounds[i].map(|b| b.is_finite().then_some(b));
                let cut = cut.iter().any(Option::is_some).then_some(cut);
                Ensemble::train(
                    &plans,
                    cut,
                    &bounds[i..=i],
                    [&pairs, &held_out],
                    &settings.training,
                    seed.wrapping_add(i as u64),
                )
            })
            .collect::<Result<_, _>>()?;
        Ok(Self { prior: prior.clone(), input: prepared.input, output: prepared.output, factors })
    }

    /// How each member's training went, factor by factor.
    pub fn reports(&self) -> Vec<&[TrainingReport]> {
        self.factors.iter().map(|f| f.reports.as_slice()).collect()
    }

    fn scaled(&self, x: &[f64]) -> Result<Vec<f64>, Error> {
        check_row("observation", x, self.input.dim())?;
        let mut out = Vec::with_capacity(x.len());
        self.input.apply(x, &mut out);
        Ok(out)
    }

    /// Draws the next standardised coordinate of each row of `inputs` (column after column).
    fn draw_factor(&self, i: usize, inputs: &[f64], count: usize, mut rng: &mut dyn Rng) -> Vec<f64> {
        let factor = &self.factors[i];
        let mut scratches: Vec<Scratch> = factor.members.iter().map(|_| Scratch::default()).collect();
        let outputs: Vec<&[f64]> = factor
            .members
            .iter()
            .zip(&mut scratches)
            .map(|(member, scratch)| member.outputs(inputs, count, scratch))
            .collect();
        (0..count)
            .map(|row| {
                let m = choose(factor.weights.iter().copied(), rng.random());
                let head = &factor.members[m].head;
                let mut drawn = [0.0];
                head.draw(
                    &outputs[m][row * head.outputs()..(row + 1) * head.outputs()],
                    &mut drawn,
                    &mut rng,
                );
                drawn[0]
            })
            .collect()
    }
}

impl ConditionalDensity for Autoregressive {
    fn prior(&self) -> &Prior {
        &self.prior
    }

    fn x_dim(&self) -> usize {
        self.input.dim()
    }

    fn ln_density(&self, theta: &[f64], x: &[f64]) -> Result<f64, Error> {
        let mut inputs = self.scaled(x)?;
        check_length("parameters", theta, self.prior.dim())?;
        if !self.prior.contains(theta) {
            return Ok(f64::NEG_INFINITY);
        }
        let u = self.prior.coordinates(theta);
        let z = self.output.apply(&u);
        let mut ln = self.prior.ln_jacobian(&u) - self.output.ln_scale();
        for (factor, z) in self.factors.iter().zip(&z) {
            ln += factor.ln_density(&inputs, &[*z]);
            inputs.push(*z);
        }
        Ok(ln)
    }

    fn ln_densities(&self, theta: &Points, x: &[f64]) -> Result<Vec<f64>, Error> {
        let scaled = self.scaled(x)?;
        check_length("parameters", &vec![0.0; theta.dim()], self.prior.dim())?;
        let u: Vec<Vec<f64>> = theta.rows().map(|t| self.prior.coordinates(t)).collect();
        let z: Vec<Vec<f64>> = u.iter().map(|u| self.output.apply(u)).collect();
        let mut ln: Vec<f64> = u.iter().map(|u| self.prior.ln_jacobian(u) - self.output.ln_scale()).collect();
        for (i, factor) in self.factors.iter().enumerate() {
            let mut pairs =
                Pairs { input_dim: scaled.len() + i, inputs: Vec::new(), target_dim: 1, targets: Vec::new() };
            for z in &z {
                pairs.inputs.extend_from_slice(&scaled);
                pairs.inputs.extend_from_slice(&z[..i]);
                pairs.targets.push(z[i]);
            }
            ln.iter_mut().zip(factor.ln_densities(&pairs)).for_each(|(l, f)| *l += f);
        }
        let inside = theta.rows().map(|t| self.prior.contains(t));
        Ok(ln.into_iter().zip(inside).map(|(l, i)| if i { l } else { f64::NEG_INFINITY }).collect())
    }

    fn sample(&self, x: &[f64], count: usize, rng: &mut dyn Rng) -> Result<Points, Error> {
        const CHUNK: usize = 512;
        let scaled = self.scaled(x)?;
        let d = self.prior.dim();
        let bounds = self.prior.bounds();
        let mut theta = Points::new(d);
        for start in (0..count).step_by(CHUNK) {
            let rows = CHUNK.min(count - start);
            let mut z: Vec<Vec<f64>> = vec![Vec::with_capacity(d); rows];
            for i in 0..d {
                let inputs: Vec<f64> = z.iter().flat_map(|z| scaled.iter().chain(z)).copied().collect();
                let drawn = self.draw_factor(i, &inputs, rows, rng);
                z.iter_mut().zip(drawn).for_each(|(z, v)| z.push(v));
            }
            for z in &z {
                let unscaled = |i: usize| self.output.centre[i] + self.output.scale[i] * z[i];
                let u: Vec<f64> = (0..d).map(|i| unscaled(i).clamp(bounds[i][0], bounds[i][1])).collect();
                theta.push(&self.prior.values(&u))?;
            }
        }
        Ok(theta)
    }
}
