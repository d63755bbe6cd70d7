//! Several networks for one target, weighted by how well they foretell held-out simulations.

use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::head::{Head, HeadScratch};
use crate::kernel::Kernel;
use crate::linear::{Regression, ridge};
use crate::network::{Activation, Network, Scratch, Shape};
use crate::random_features::{Draw, RandomFeatures};
use crate::training::{Pairs, TrainingReport, TrainingSettings, ln_densities, train};

/// What one member is made of.
#[derive(Debug, Clone)]
pub(crate) enum Plan {
    /// Means linear in the inputs, all else constant.
    Linear,
    /// A network with these hidden layers and this many components.
    Network { hidden: Vec<usize>, components: usize },
    /// Linear in random features; the length scale is chosen among multiples of the kernel's by held-out error.
    Features { kernel: Kernel, count: usize, draw: Draw, components: usize },
}

/// One trained network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Member {
    features: Option<RandomFeatures>,
    pub(crate) network: Network,
    pub(crate) head: Head,
}

/// Members, their weights and how their training went.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ensemble {
    pub(crate) members: Vec<Member>,
    pub(crate) weights: Vec<f64>,
    pub(crate) reports: Vec<TrainingReport>,
}

/// A random split into what is learned from and what is held out.
pub(crate) fn split(n: usize, share: f64, seed: u64) -> (Vec<usize>, Vec<usize>) {
    let mut order: Vec<usize> = (0..n).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    let held_out = ((n as f64 * share).ceil() as usize).clamp(1, n - 1);
    let rest = order.split_off(held_out);
    (rest, order)
}

/// Random features of each input of `dim` numbers, times `unit`, with the input itself behind.
fn widened(features: &RandomFeatures, unit: f64, inputs: &[f64], dim: usize) -> Vec<f64> {
    let wide_dim = features.len() + dim;
    let mut wide = vec![0.0; wide_dim * (inputs.len() / dim)];
    for (out, x) in wide.chunks_exact_mut(wide_dim).zip(inputs.chunks_exact(dim)) {
        let (head, tail) = out.split_at_mut(features.len());
        features.write(x, head);
        head.iter_mut().for_each(|f| *f *= unit);
        tail.copy_from_slice(x);
    }
    wide
}

/// The same of pairs. What trains has [`RandomFeatures::unit`]: a step of Adam is as long for every weight, and at a unit of one the
/// steps of hundreds of features add up to jumps as long as a component is wide.
fn expanded(features: &RandomFeatures, unit: f64, pairs: &Pairs) -> Pairs {
    let inputs = widened(features, unit, &pairs.inputs, pairs.input_dim);
    let input_dim = features.len() + pairs.input_dim;
    Pairs { input_dim, inputs, target_dim: pairs.target_dim, targets: pairs.targets.clone() }
}

impl Member {
    /// Outputs for `batch` inputs, column after column.
    pub(crate) fn outputs<'a>(&self, inputs: &[f64], batch: usize, scratch: &'a mut Scratch) -> &'a [f64] {
        match &self.features {
            None => self.network.forward(inputs, batch, scratch),
            Some(features) => {
                self.network.forward(&widened(features, 1.0, inputs, inputs.len() / batch), batch, scratch);
            }
        }
        &scratch.outputs[..self.head.outputs() * batch]
    }

    /// Log density of each target.
    fn ln_densities(&self, pairs: &Pairs) -> Vec<f64> {
        match &self.features {
            None => ln_densities(&self.network, &self.head, pairs),
            Some(features) => ln_densities(&self.network, &self.head, &expanded(features, 1.0, pairs)),
        }
    }

    fn train(
        plan: &Plan,
        cut: Option<[Option<f64>; 2]>,
        pairs: &Pairs,
        held_out: &Pairs,
        settings: &TrainingSettings,
        rng: &mut ChaCha8Rng,
    ) -> Result<(Self, TrainingReport), Error> {
        let (hidden, components): (&[usize], usize) = match plan {
            Plan::Linear => (&[], 1),
            Plan::Network { hidden, components } => (hidden, *components),
            Plan::Features { components, .. } => (&[], *components),
        };
        let head = Head { dim: pairs.target_dim, components, cut };
        let mut features = None;
        let wide = match plan {
            Plan::Features { kernel, count, draw, .. } => {
                let (chosen, wide) = choose_features(kernel, *count, *draw, pairs, held_out, rng)?;
                let tests = expanded(&chosen, chosen.unit(), held_out);
                features = Some(chosen);
                Some((wide, tests))
            }
            _ => None,
        };
        let (pairs, held_out) = wide.as_ref().map_or((pairs, held_out), |w| (&w.0, &w.1));
        let regression = best_ridge(pairs, held_out).ok_or(Error::Diverged)?;
        let body = !matches!(plan, Plan::Linear);
        let mut network = start(&head, hidden, body, pairs.input_dim, &regression, rng);
        let report = train(&mut network, &head, pairs, held_out, settings, rng);
        if let Some(features) = &features {
            network.scale_inputs(features.len(), features.unit());
        }
        Ok((Self { features, network, head }, report))
    }
}

fn best_ridge(pairs: &Pairs, held_out: &Pairs) -> Option<Regression> {
    let fits = ridge(pairs, &[1e-2, 1.0, 1e2, 1e4]);
    let errors = fits.into_iter().map(|r| (r.ln_error(held_out), r));
    errors.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, r)| r)
}

/// Features whose length scale leaves the least held-out error of a ridge regression.
fn choose_features(
    kernel: &Kernel,
    count: usize,
    draw: Draw,
    pairs: &Pairs,
    held_out: &Pairs,
    rng: &mut ChaCha8Rng,
) -> Result<(RandomFeatures, Pairs), Error> {
    let mut best: Option<(f64, RandomFeatures, Pairs)> = None;
    for factor in [0.25, 0.5, 1.0, 2.0, 4.0] {
        let scaled = Kernel { length_scale: kernel.length_scale * factor, ..*kernel };
        let features = RandomFeatures::draw(&scaled, pairs.input_dim, count, draw, rng)?;
        let wide = expanded(&features, features.unit(), pairs);
        let tests = expanded(&features, features.unit(), held_out);
        let Some(regression) = best_ridge(&wide, &tests) else { continue };
        let error = regression.ln_error(&tests);
        if best.as_ref().is_none_or(|b| error < b.0) {
            best = Some((error, features, wide));
        }
    }
    best.map(|(_, f, w)| (f, w)).ok_or(Error::Diverged)
}

/// A network whose components all start at the regression, spread by what it leaves.
fn start<R: Rng + ?Sized>(
    head: &Head,
    hidden: &[usize],
    body: bool,
    inputs: usize,
    regression: &Regression,
    rng: &mut R,
) -> Network {
    let shape = Shape {
        inputs,
        hidden: hidden.to_vec(),
        outputs: head.outputs(),
        body,
        linear: if hidden.is_empty() && body { vec![] } else { head.mean_rows() },
        activation: Activation::Isrlu,
    };
    let mut network = Network::new(shape, 1.7, if hidden.is_empty() { 0.0 } else { 0.1 }, rng);
    let spread = if head.components == 1 { 0.0 } else { 1.0 };
    for k in 0..head.components {
        // Without hidden layers nothing but this sets components apart: narrow and wide ones, since what is left is seldom of one width.
        let last = (head.components - 1).max(1) as f64;
        let narrower = if hidden.is_empty() { 2.0 * k as f64 / last } else { 0.5 * spread };
        for i in 0..head.dim {
            let (row, sd) = (k * head.stride() + 1 + i, regression.residual_sd[i]);
            (0..inputs).for_each(|j| network.set_linear(row, j, regression.coefficients[(j, i)]));
            let z: f64 = StandardNormal.sample(rng);
            let bias = network.output_bias_mut();
            bias[row] = regression.intercept[i] + spread * sd * z;
            bias[row + head.dim] = narrower - sd.ln();
        }
    }
    network
}

/// A regression and alike networks.
pub(crate) fn networks(hidden: &[usize], components: usize, members: usize) -> Vec<Plan> {
    let mut plans = vec![Plan::Linear];
    plans.resize(1 + members, Plan::Network { hidden: hidden.to_vec(), components });
    plans
}

impl Ensemble {
    /// Trains a member a plan, in parallel; each has a seed of its own, so that the result does not depend on threads.
    pub(crate) fn fit(
        plans: &[Plan],
        cut: Option<[Option<f64>; 2]>,
        pairs: &Pairs,
        held_out: &Pairs,
        settings: &TrainingSettings,
        seed: u64,
    ) -> Result<Self, Error> {
        let trained: Vec<(Member, TrainingReport, Vec<f64>)> = plans
            .par_iter()
            .enumerate()
            .map(|(m, plan)| {
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                rng.set_stream(m as u64 + 1);
                let (member, report) = Member::train(plan, cut, pairs, held_out, settings, &mut rng)?;
                let ln = member.ln_densities(held_out);
                Ok((member, report, ln))
            })
            .collect::<Result<_, Error>>()?;
        let usable: Vec<_> = trained.into_iter().filter(|t| t.1.validation_loss.is_finite()).collect();
        if usable.is_empty() {
            return Err(Error::Diverged);
        }
        let columns: Vec<&[f64]> = usable.iter().map(|t| t.2.as_slice()).collect();
        let weights = stacking(&columns);
        let mut out = Self { members: Vec::new(), weights: Vec::new(), reports: Vec::new() };
        for ((member, report, _), weight) in usable.into_iter().zip(weights) {
            out.reports.push(report);
            // A member of no weight would only cost time.
            if weight > 0.01 {
                out.members.push(member);
                out.weights.push(weight);
            }
        }
        let total: f64 = out.weights.iter().sum();
        out.weights.iter_mut().for_each(|w| *w /= total);
        Ok(out)
    }

    /// Log density of each target under the weighted members.
    pub(crate) fn ln_densities(&self, pairs: &Pairs) -> Vec<f64> {
        let columns: Vec<Vec<f64>> = self.members.iter().map(|m| m.ln_densities(pairs)).collect();
        (0..pairs.len())
            .map(|i| {
                let terms = columns.iter().zip(&self.weights).map(|(c, w)| w.ln() + c[i]);
                crate::normal::ln_sum_exp(terms)
            })
            .collect()
    }

    /// Log density of one target, from inputs as a network sees them.
    pub(crate) fn ln_density(&self, inputs: &[f64], target: &[f64]) -> f64 {
        let (mut scratch, mut head) = (Scratch::default(), HeadScratch::default());
        let terms: Vec<f64> = self
            .members
            .iter()
            .zip(&self.weights)
            .map(|(m, w)| w.ln() - m.head.loss(m.outputs(inputs, 1, &mut scratch), target, &mut head))
            .collect();
        crate::normal::ln_sum_exp(terms.into_iter())
    }
}

/// Weights that maximise the held-out log density of the weighted sum (stacking of predictive distributions, Yao et al. 2018,
/// doi:10.1214/17-BA1091), by expectation-maximisation, with one pseudo-count for each member.
fn stacking(ln_densities: &[&[f64]]) -> Vec<f64> {
    let (members, n) = (ln_densities.len(), ln_densities[0].len());
    let mut weights = vec![1.0 / members as f64; members];
    for _ in 0..300 {
        let mut counts = vec![1.0; members];
        for i in 0..n {
            let terms = weights.iter().zip(ln_densities).map(|(w, c)| w.ln() + c[i]);
            let total = crate::normal::ln_sum_exp(terms.clone());
            if total.is_finite() {
                counts.iter_mut().zip(terms).for_each(|(c, t)| *c += (t - total).exp());
            }
        }
        let total: f64 = counts.iter().sum();
        weights = counts.iter().map(|c| c / total).collect();
    }
    weights
}
