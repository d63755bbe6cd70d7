//! What is known of the noise before any fit: a calibration, replicates, a reading's last digit.

use std::collections::HashMap;

use crate::model::FEWEST_RUNS_THAT_DIFFER;
use crate::noise::process::Shape;
use crate::problem::Problem;

/// The noise of all channels as a fit assumes it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NoiseState {
    /// Index into the family of shapes, by channel.
    pub(crate) shape: Vec<usize>,
    /// One sigma, by channel.
    pub(crate) sigma: Vec<f64>,
}

/// How the noise is chosen while a model is fitted.
#[derive(Debug, Clone)]
pub(crate) struct NoiseRule {
    /// A channel's sigma where a calibration or replicates fix it.
    pub(crate) fixed_sigma: Vec<Option<f64>>,
    /// How well each fixed sigma is known: its relative standard error.
    pub(crate) uncertainty: Vec<f64>,
    /// The shapes that are tried one by one; those between them follow from the best.
    pub(crate) allowed: Vec<usize>,
    /// The longest correlation that is believed, in median steps between rows.
    pub(crate) longest: f64,
    /// Further log prior weight against correlated noise. Where mechanisms compete, colour that only some of them need is
    /// one more thing that they assume; it cancels where all of them need it.
    pub(crate) against_colour: f64,
    /// The largest product of a channel's sigma and the size of accumulated errors that is believed; `None` where none accumulate.
    pub(crate) most_accumulated: Vec<Option<f64>>,
    /// Whether steps of accumulated errors may be alike: in too few runs such errors look like what a model lacks.
    pub(crate) may_remember: bool,
    /// The smallest sigma that is believed, by channel (a reading has a last digit).
    pub(crate) floor: Vec<f64>,
}

impl NoiseRule {
    /// Log prior weight of a shape.
    pub(crate) fn log_prior(&self, problem: &Problem<'_>, shape: usize) -> f64 {
        let weight = problem.family.shape(shape).log_prior();
        if weight < 0.0 { weight - self.against_colour } else { weight }
    }

    /// Whether a shape between the allowed ones may be chosen.
    pub(crate) fn admits(&self, shape: &Shape) -> bool {
        shape.length_steps <= self.longest && (shape.memory <= 0.0 || self.may_remember)
    }

    /// The rule beside a leftover: what is known of a channel's noise is only the least that there is.
    pub(crate) fn beside_a_leftover(&self) -> Self {
        let floor =
            self.fixed_sigma.iter().zip(&self.floor).map(|(fixed, floor)| fixed.unwrap_or(*floor)).collect();
        Self { fixed_sigma: vec![None; self.floor.len()], floor, ..self.clone() }
    }

    /// The sigma of a channel under a shape, where the residual has `found`.
    pub(crate) fn sigma(&self, channel: usize, shape: &Shape, found: f64) -> f64 {
        if let Some(sigma) = self.fixed_sigma[channel] {
            return sigma;
        }
        let most = self.most_accumulated[channel].filter(|_| shape.accumulated > 0.0);
        let believed = most.map_or(found, |most| found.min(most / shape.accumulated));
        believed.max(self.floor[channel])
    }

    /// Whether a channel may have a shape of noise: errors accumulate only where the model says so, and no more than it says.
    pub(crate) fn may_have(&self, channel: usize, shape: &Shape) -> bool {
        let least = self.fixed_sigma[channel].unwrap_or(self.floor[channel]);
        shape.accumulated <= 0.0
            || self.most_accumulated[channel].is_some_and(|most| least * shape.accumulated <= most)
    }

    /// The rule where mechanisms compete.
    pub(crate) fn competing(&self) -> Self {
        Self { against_colour: 6.0, ..self.clone() }
    }
}

/// Relative standard error of a calibrated sigma.
const CALIBRATION_UNCERTAINTY: f64 = 0.02;
/// Degrees of freedom from which replicates fix a channel's sigma (to 16 % and better).
const REPLICATE_FREEDOM: usize = 20;
/// Below this mean number of rows in a run, correlation along a run is not looked for.
const ROWS_FOR_COLOUR: usize = 8;

/// How the noise of a recording is chosen: calibrated where it was, else from replicates where there are enough, and
/// never below a reading's last digit.
pub(crate) fn noise_rule(problem: &Problem<'_>) -> NoiseRule {
    let recording = &problem.recording;
    let floor: Vec<f64> = (0..problem.channels())
        .map(|c| {
            let largest = recording
                .runs
                .iter()
                .flat_map(|r| &r.outputs[c])
                .filter(|v| v.is_finite())
                .fold(0.0, |m: f64, v| m.max(v.abs()));
            let digit = recording.resolution.get(c).copied().unwrap_or(0.0) / 12f64.sqrt();
            digit.max(1e-9 * largest).max(f64::MIN_POSITIVE)
        })
        .collect();
    let rows: usize = recording.runs.iter().map(|r| r.len()).sum();
    let long = rows >= ROWS_FOR_COLOUR * problem.rows.len().max(1);
    let longest =
        problem.model.extensions().errors.map_or(f64::INFINITY, |errors| errors.longest_correlation());
    let largest_step =
        problem.model.extensions().errors.map_or(f64::INFINITY, |errors| errors.largest_step());
    let most_accumulated: Vec<Option<f64>> =
        problem.accumulated.iter().map(|unit| unit.map(|unit| unit * largest_step)).collect();
    let accumulates = most_accumulated.iter().any(Option::is_some);
    let (fixed_sigma, uncertainty) = (0..problem.channels())
        .map(|c| match recording.calibration.get(c).copied().flatten() {
            Some(sigma) => (Some(sigma), CALIBRATION_UNCERTAINTY),
            None => match replicates(problem, c) {
                // Readings that repeat to the last digit say nothing of the noise.
                Some((sigma, freedom)) if sigma > floor[c] => {
                    (Some(sigma), 1.0 / (2.0 * freedom as f64).sqrt())
                }
                _ => (None, 0.0),
            },
        })
        .unzip();
    NoiseRule {
        fixed_sigma,
        uncertainty,
        against_colour: 0.0,
        allowed: problem
            .family
            .few()
            .filter(|&s| {
                let shape = problem.family.shape(s);
                let heard = !shape.by_row || problem.uneven;
                if shape.accumulated > 0.0 {
                    return accumulates;
                }
                s == 0 || long && heard && shape.length_steps <= longest
            })
            .collect(),
        longest,
        most_accumulated,
        may_remember: problem.rows.len() >= FEWEST_RUNS_THAT_DIFFER,
        floor,
    }
}

/// Pooled sigma of rows of a run that share all inputs, and its degrees of freedom ("pure error").
fn replicates(problem: &Problem<'_>, channel: usize) -> Option<(f64, usize)> {
    let (mut squares, mut freedom) = (0.0, 0);
    for (run, rows) in problem.recording.runs.iter().zip(&problem.rows) {
        let mut groups: HashMap<Vec<u64>, Vec<f64>> = HashMap::new();
        let mut order = Vec::new();
        for &i in &rows.valid[channel] {
            let key: Vec<u64> = run.inputs.iter().map(|column| (column[i] + 0.0).to_bits()).collect();
            let group = groups.entry(key.clone()).or_insert_with(|| {
                order.push(key);
                Vec::new()
            });
            group.push(run.outputs[channel][i]);
        }
        // In the order of the rows: a sum's last bit is not to depend on a hash.
        for group in order.iter().filter_map(|key| groups.get(key)) {
            let mean = group.iter().sum::<f64>() / group.len() as f64;
            squares += group.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
            freedom += group.len() - 1;
        }
    }
    (freedom >= REPLICATE_FREEDOM).then(|| ((squares / freedom as f64).sqrt(), freedom))
}
