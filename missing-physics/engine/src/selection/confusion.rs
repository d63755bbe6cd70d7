//! How often data of one set of mechanisms are taken for another's.

use rayon::prelude::*;

use crate::adequacy::linearised::Linearised;
use crate::adequacy::null::draw;
use crate::fit::prediction::residuals;
use crate::model::PredictError;
use crate::noise::rule::{NoiseRule, NoiseState};
use crate::problem::Problem;
use crate::selection::candidate::Candidate;

/// `matrix[i][j]`: how often data simulated from rival `i` favour rival `j`.
pub(crate) fn confusion(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    rivals: &[&Candidate],
    draws: usize,
    seed: u64,
) -> Result<Vec<Vec<f64>>, PredictError> {
    let mut shapes: Vec<usize> =
        rivals.iter().flat_map(|r| r.fit.noise.shape.iter().copied()).chain([0]).collect();
    shapes.sort_unstable();
    shapes.dedup();
    let rivals: Vec<Rival<'_>> =
        rivals.iter().map(|rival| Rival::new(problem, rule, rival, &shapes)).collect::<Result<_, _>>()?;
    let row = |(number, truth): (usize, &Rival<'_>)| -> Vec<f64> {
        let favoured: Vec<usize> = (0..draws as u64)
            .into_par_iter()
            .map(|k| {
                let noise = draw(problem, &truth.noise, rule, seed ^ (0xc0f + number as u64), k);
                let scores: Vec<f64> = rivals.iter().map(|rival| rival.score(truth, &noise)).collect();
                (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b])).unwrap_or(number)
            })
            .collect();
        let share = |j| favoured.iter().filter(|w| **w == j).count() as f64 / draws.max(1) as f64;
        (0..rivals.len()).map(share).collect()
    };
    Ok(rivals.iter().enumerate().map(row).collect())
}

/// A set that is simulated from, and that judges simulations.
struct Rival<'a> {
    linearised: Linearised<'a>,
    /// What its fit leaves of the data.
    residual: Vec<Vec<Vec<f64>>>,
    noise: Vec<(usize, f64)>,
    /// Its evidence beyond the score of its linearised model.
    constant: f64,
}

impl<'a> Rival<'a> {
    /// `shapes` are the shapes of noise that are tried.
    fn new(
        problem: &'a Problem<'a>,
        rule: &NoiseRule,
        rival: &Candidate,
        shapes: &[usize],
    ) -> Result<Self, PredictError> {
        let mut linearised =
            Linearised::new(problem, &rival.selection, &rival.fit, &[], rule)?.without_alternatives();
        linearised.play(shapes);
        let residual = residuals(problem, &rival.fit)?;
        let constant = rival.evidence - linearised.read(&residual).score;
        Ok(Self { linearised, residual, noise: noise_pairs(&rival.fit.noise), constant })
    }

    /// Log evidence of this set for data that are simulated from `truth` with this noise.
    fn score(&self, truth: &Self, noise: &[Vec<Vec<f64>>]) -> f64 {
        // Simulated less predicted: noise, plus what truth predicts more than this set does.
        let column = |run: usize, channel: usize| -> Vec<f64> {
            let predicted = self.residual[run][channel].iter().zip(&truth.residual[run][channel]);
            noise[run][channel].iter().zip(predicted).map(|(n, (mine, theirs))| n + mine - theirs).collect()
        };
        let of_run = |run: usize| (0..noise[run].len()).map(|channel| column(run, channel)).collect();
        let data: Vec<Vec<Vec<f64>>> = (0..noise.len()).map(of_run).collect();
        self.linearised.read(&data).score + self.constant
    }
}

/// Shape and sigma of each channel.
fn noise_pairs(noise: &NoiseState) -> Vec<(usize, f64)> {
    noise.shape.iter().copied().zip(noise.sigma.iter().copied()).collect()
}
