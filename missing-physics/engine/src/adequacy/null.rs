//! Worlds of the null hypothesis: the model is right, and noise is all there is.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::noise::rule::NoiseRule;
use crate::problem::Problem;

/// Noise alone, `[run][channel]`: what the residual of a true model looks like before the model is fitted.
pub(crate) fn draw(
    problem: &Problem<'_>,
    noise: &[(usize, f64)],
    rule: &NoiseRule,
    seed: u64,
    stream: u64,
) -> Vec<Vec<Vec<f64>>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream + 1);
    let factors: Vec<f64> = rule
        .fixed_sigma
        .iter()
        .zip(&rule.uncertainty)
        .map(|(fixed, uncertainty)| {
            let z: f64 = StandardNormal.sample(&mut rng);
            if fixed.is_some() { (uncertainty * z).exp() } else { 1.0 }
        })
        .collect();
    // One world for all runs; drawn from the stream's number, so that a model without any draws what it always drew.
    let world = stream as usize;
    let single = problem.rows.len() == 1;
    (0..problem.rows.len())
        .map(|run| {
            let errors = problem.model.extensions().errors;
            let worlds = errors.map_or(&[][..], |errors| errors.null_samples(&problem.recording.runs[run]));
            let copies = worlds.get(world.checked_rem(worlds.len()).unwrap_or(0));
            let copy = copies.and_then(|copies| {
                // Runs make many worlds together; a single one makes no two that are alike if its copies take turns.
                let in_turn = world / worlds.len() % copies.len().max(1);
                let any = rng.random_range(0..copies.len().max(1));
                copies.get(if single { in_turn } else { any })
            });
            (0..problem.channels())
                .map(|c| {
                    let valid = &problem.rows[run].valid[c];
                    let mut column: Vec<f64> = match copy {
                        Some(copy) => valid.iter().map(|&i| copy[c][i]).collect(),
                        None => valid.iter().map(|_| StandardNormal.sample(&mut rng)).collect(),
                    };
                    problem.whitener(run, c, noise[c].0).colour(&mut column);
                    column.iter_mut().for_each(|v| *v *= noise[c].1 * factors[c]);
                    column
                })
                .collect()
        })
        .collect()
}
