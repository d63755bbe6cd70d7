//! What is known of the noise before any fit: a calibration, replicates, a reading's last digit.

use std::collections::HashMap;

use crate::fit::gauss_newton::NoiseRule;
use crate::problem::Problem;

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
                s == 0 || long && heard && shape.length_steps <= longest
            })
            .collect(),
        longest,
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
