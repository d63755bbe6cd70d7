//! How wide an ensemble has to be, learned from simulations that it was not trained on.

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::ensemble::{Ensemble, Plan};
use crate::error::Error;
use crate::head::{Head, HeadScratch, choose};
use crate::network::Scratch;
use crate::normal::ln_sum_exp;
use crate::training::{Pairs, TrainingSettings};

/// Held-out simulations that are enough to say it.
const ENOUGH: usize = 500;
/// Most that are asked.
const MOST: usize = 2000;
/// Parts that the simulations are cut into where too few are held out.
const FOLDS: usize = 5;
/// Draws that say how credible a region is.
const DRAWS: u32 = 32;
/// Logarithms of the factors on all spreads among which one is looked for, and how often their interval is cut.
const RANGE: [f64; 2] = [-0.4, 0.8];
const SECTIONS: usize = 9;
/// What of the mean log density may be given for coverage, and how a loss beyond it counts.
const GIVEN: f64 = 0.02;
const BEYOND: f64 = 10.0;
/// No single target counts for less than this log density.
const LEAST_LN: f64 = -20.0;

impl Ensemble {
    /// Trains, and widens or narrows all components alike so that regions of highest density hold simulations that were not trained on
    /// as often as they should. `bounds` are those of the targets.
    ///
    /// Where few are held out they say little: then all are asked, a fifth at a time, of ensembles that are trained on the rest
    /// (cross-validation).
    pub(crate) fn train(
        plans: &[Plan],
        cut: Option<[Option<f64>; 2]>,
        bounds: &[[f64; 2]],
        [pairs, held_out]: [&Pairs; 2],
        settings: &TrainingSettings,
        seed: u64,
    ) -> Result<Self, Error> {
        let mut out = Self::fit(plans, cut, pairs, held_out, settings, seed)?;
        let judges = if held_out.len() >= ENOUGH {
            vec![Judge::new(&out, held_out.select(0..held_out.len().min(MOST)))]
        } else {
            let all = pairs.joined(held_out);
            let parts = parts(all.len(), seed);
            let judge = |k: usize| {
                let others = parts.iter().enumerate().filter(|(j, _)| *j != k);
                let learned = all.select(others.flat_map(|(_, part)| part.iter().copied()));
                let unseen = all.select(parts[k].iter().copied());
                let seed = seed.wrapping_add((k as u64 + 1) << 32);
                let fold = Self::fit(plans, cut, &learned, &unseen, settings, seed)?;
                Ok(Judge::new(&fold, unseen))
            };
            (0..FOLDS).into_par_iter().map(judge).collect::<Result<_, Error>>()?
        };
        out.widen(wanted(judges, bounds, seed));
        Ok(out)
    }

    /// Multiplies all spreads by `exp(by)`.
    fn widen(&mut self, by: f64) {
        for member in &mut self.members {
            let rows = member.head.precision_rows();
            member.network.shift_biases(&rows, -by);
        }
    }
}

/// Rows in equal parts, at random.
fn parts(n: usize, seed: u64) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..n).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(u64::MAX);
    order.shuffle(&mut rng);
    (0..FOLDS).map(|k| order[k * n / FOLDS..(k + 1) * n / FOLDS].to_vec()).collect()
}

/// An ensemble's answers for pairs that it has not seen.
struct Judge {
    weights: Vec<f64>,
    heads: Vec<Head>,
    /// Outputs of each member, column after column.
    outputs: Vec<Vec<f64>>,
    pairs: Pairs,
}

impl Judge {
    fn new(ensemble: &Ensemble, pairs: Pairs) -> Self {
        let mut scratch = Scratch::default();
        let members = &ensemble.members;
        Self {
            outputs: members
                .iter()
                .map(|m| m.outputs(&pairs.inputs, pairs.len(), &mut scratch).to_vec())
                .collect(),
            heads: members.iter().map(|m| m.head.clone()).collect(),
            weights: ensemble.weights.clone(),
            pairs,
        }
    }

    fn widen(&mut self, by: f64) {
        for (head, outputs) in self.heads.iter().zip(&mut self.outputs) {
            let rows = head.precision_rows();
            for column in outputs.chunks_exact_mut(head.outputs()) {
                rows.iter().for_each(|&r| column[r] -= by);
            }
        }
    }

    fn column(&self, member: usize, i: usize) -> &[f64] {
        let n = self.heads[member].outputs();
        &self.outputs[member][i * n..(i + 1) * n]
    }

    fn ln_density(&self, i: usize, target: &[f64], scratch: &mut HeadScratch) -> f64 {
        let members = self.heads.iter().zip(&self.weights).enumerate();
        let terms: Vec<f64> = members
            .map(|(m, (head, weight))| weight.ln() - head.loss(self.column(m, i), target, scratch))
            .collect();
        ln_sum_exp(terms.into_iter())
    }

    /// Probability of the smallest region that holds target `i`, and the log density there; none where no draw is within the bounds.
    fn credibility(&self, i: usize, bounds: &[[f64; 2]], rng: &mut ChaCha8Rng) -> Option<[f64; 2]> {
        let mut scratch = HeadScratch::default();
        let truth = self.ln_density(i, self.pairs.target(i), &mut scratch);
        let mut draw = vec![0.0; self.pairs.target_dim];
        let (mut inside, mut above) = (0, 0);
        for _ in 0..DRAWS {
            let m = choose(self.weights.iter().copied(), rng.random());
            self.heads[m].draw(self.column(m, i), &mut draw, rng);
            if draw.iter().zip(bounds).all(|(z, b)| *z >= b[0] && *z <= b[1]) {
                inside += 1;
                above += u32::from(self.ln_density(i, &draw, &mut scratch) > truth);
            }
        }
        (inside > 0)
            .then(|| [(f64::from(above) + rng.random::<f64>()) / f64::from(inside + 1), truth.max(LEAST_LN)])
    }
}

/// The logarithm of the factor on all spreads with which coverage is nearest to its level, over all levels, by golden sections. Where the
/// shape is wrong no factor mends it: one that costs density is not taken.
fn wanted(judges: Vec<Judge>, bounds: &[[f64; 2]], seed: u64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let mut court = Court { judges, at: 0.0, ln_density: f64::NEG_INFINITY };
    court.ln_density = court.seen(0.0, bounds, seed).1;
    let [mut low, mut high] = RANGE;
    let inner = |low: f64, high: f64| [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
    let mut points = inner(low, high);
    let mut errors = points.map(|p| court.error(p, bounds, seed));
    for _ in 0..SECTIONS {
        if errors[0] < errors[1] {
            high = points[1];
            points = inner(low, high);
            errors = [court.error(points[0], bounds, seed), errors[0]];
        } else {
            low = points[0];
            points = inner(low, high);
            errors = [errors[1], court.error(points[1], bounds, seed)];
        }
    }
    0.5 * (low + high)
}

/// Judges, all widened alike.
struct Court {
    judges: Vec<Judge>,
    at: f64,
    /// Mean log density before.
    ln_density: f64,
}

impl Court {
    /// What is to be least where spreads are multiplied by `exp(by)`.
    fn error(&mut self, by: f64, bounds: &[[f64; 2]], seed: u64) -> f64 {
        let (off, ln_density) = self.seen(by, bounds, seed);
        off + BEYOND * (self.ln_density - GIVEN - ln_density).max(0.0)
    }

    /// Mean square of coverage less level over all levels (Cramer and von Mises), and the mean log density.
    fn seen(&mut self, by: f64, bounds: &[[f64; 2]], seed: u64) -> (f64, f64) {
        self.judges.iter_mut().for_each(|j| j.widen(by - self.at));
        self.at = by;
        // The same random numbers for every factor, and for any number of threads.
        let credibility = |(k, i): (usize, usize)| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(((k as u64) << 32) + i as u64);
            self.judges[k].credibility(i, bounds, &mut rng)
        };
        let judges = self.judges.iter().enumerate();
        let rows: Vec<_> = judges.flat_map(|(k, j)| (0..j.pairs.len()).map(move |i| (k, i))).collect();
        let mut all: Vec<[f64; 2]> = rows.into_par_iter().filter_map(credibility).collect();
        all.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let n = all.len().max(1) as f64;
        let off = all.iter().enumerate().map(|(i, c)| (c[0] - (i as f64 + 0.5) / n).powi(2)).sum::<f64>();
        (off / n, all.iter().map(|c| c[1]).sum::<f64>() / n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};

    /// Targets linear in one input, with correlated noise of standard deviation 0.3, accepted where they are below `most`.
    fn pairs(n: usize, target_dim: usize, most: f64, seed: u64) -> Pairs {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut out = Pairs { input_dim: 1, inputs: Vec::new(), target_dim, targets: Vec::new() };
        while out.len() < n {
            let x: f64 = StandardNormal.sample(&mut rng);
            let mut y = x;
            let target: Vec<f64> = (0..target_dim)
                .map(|_| {
                    let z: f64 = StandardNormal.sample(&mut rng);
                    y = 0.5 * y + 0.3 * z;
                    y
                })
                .collect();
            if target.iter().all(|t| *t < most) {
                out.inputs.push(x);
                out.targets.extend(target);
            }
        }
        out
    }

    /// What an ensemble was widened or narrowed by is taken back, with full covariance and with components that are cut.
    #[test]
    fn spreads_that_are_off_either_way_are_told() {
        for (dim, most) in [(3, f64::INFINITY), (1, 0.4)] {
            let cut = most.is_finite().then_some([None, Some(most)]);
            let (learned, stop, unseen) =
                (pairs(4000, dim, most, 1), pairs(400, dim, most, 2), pairs(2000, dim, most, 3));
            let settings = TrainingSettings { max_epochs: 20, ..TrainingSettings::default() };
            let right = Ensemble::fit(&[Plan::Linear], cut, &learned, &stop, &settings, 1);
            let right = right.unwrap_or_else(|e| panic!("{e}"));
            let bounds = vec![[f64::NEG_INFINITY, most]; dim];
            for off in [-0.25, 0.0, 0.4] {
                let mut wrong = right.clone();
                wrong.widen(off);
                let found = wanted(vec![Judge::new(&wrong, unseen.select(0..unseen.len()))], &bounds, 5);
                // The mean of 2000 credibilities is uncertain by 0.0065; it moves by 0.6 (three dimensions) or 0.3 with the logarithm.
                assert!((found + off).abs() < 0.05, "{dim}: {off} {found}");
            }
        }
    }
}
