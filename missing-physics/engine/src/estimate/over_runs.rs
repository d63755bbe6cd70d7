//! Values that each run has of its own.

use crate::diagnosis::Estimate;
use crate::estimate::propagate::{errors, quadratic, slopes};
use crate::estimate::reach::student;
use crate::fit::optimum::covariance;
use crate::model::{DerivedPerRun, Over};
use crate::selection::candidate::Candidate;

/// A value that each run has of its own, over the runs, with what the errors of the runs' nuisance and of the shared parameters make of it,
/// and with what the runs differ beyond those (DerSimonian and Laird 1986, doi:10.1016/0197-2456(86)90046-2).
pub(crate) fn over_runs(candidate: &Candidate, quantity: &DerivedPerRun, reach: f64) -> Estimate {
    let covariance = covariance(&candidate.fit.information);
    let shared_errors = errors(&covariance);
    let runs: Vec<OfRun> = (0..candidate.fit.nuisance.len())
        .map(|run| OfRun::new(candidate, quantity, &shared_errors, run))
        .collect();
    let (value, half) = match quantity.over {
        Over::Mean => {
            let n = runs.len().max(1) as f64;
            let mean = runs.iter().map(|run| run.value).sum::<f64>() / n;
            let slope = |k: usize| runs.iter().map(|run| run.by_shared[k]).sum::<f64>() / n;
            let along: Vec<f64> = (0..candidate.selection.shared.len()).map(slope).collect();
            let differ = between(&runs);
            let determined =
                runs.iter().map(|run| run.variance).sum::<f64>() / (n * n) + quadratic(&along, &covariance);
            // What the runs differ by is known from the runs alone (Hartung and Knapp 2001, doi:10.1002/sim.791).
            (mean, (reach * reach * determined.max(0.0) + student(n - 1.0).powi(2) * differ / n).sqrt())
        }
        Over::Largest => {
            let largest = runs.iter().max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
            largest.map_or((f64::NAN, f64::NAN), |run| {
                let determined = run.variance + quadratic(&run.by_shared, &covariance);
                (run.value, reach * determined.max(0.0).sqrt())
            })
        }
    };
    let name = quantity.name.clone();
    Estimate { name, unit: quantity.unit.clone(), value, ci95: [value - half, value + half] }
}

/// The value of one run.
struct OfRun {
    value: f64,
    /// Its variance for given shared parameters.
    variance: f64,
    /// Its slopes along the free shared parameters, which move the run's nuisance parameters too.
    by_shared: Vec<f64>,
}

impl OfRun {
    fn new(candidate: &Candidate, quantity: &DerivedPerRun, shared_errors: &[f64], run: usize) -> Self {
        let Candidate { fit, selection, .. } = candidate;
        let (nuisance, errors) = (&fit.nuisance[run], &fit.nuisance_errors[run]);
        let by_nuisance = slopes(&selection.nuisance, nuisance, &errors.error, &|nuisance| {
            (quantity.value)(&fit.shared, nuisance)
        });
        let mut by_shared = slopes(&selection.shared, &fit.shared, shared_errors, &|shared| {
            (quantity.value)(shared, nuisance)
        });
        for (slope, moved) in by_nuisance.iter().zip(&errors.slope) {
            by_shared.iter_mut().zip(moved).for_each(|(a, m)| *a += slope * m);
        }
        let determined = by_nuisance.iter().zip(&errors.error).filter(|(_, e)| e.is_finite());
        let variance = determined.map(|(s, e)| (s * e).powi(2)).sum();
        Self { value: (quantity.value)(&fit.shared, nuisance), variance, by_shared }
    }
}

/// The variance of runs' values beyond their own errors, by moments; none where it cannot be told.
fn between(runs: &[OfRun]) -> f64 {
    let values = || runs.iter().map(|run| run.value);
    if runs.len() < 2 || runs.iter().any(|run| !(run.variance > 0.0)) {
        let n = runs.len().max(1) as f64;
        let mean = values().sum::<f64>() / n;
        return values().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    }
    let weights: Vec<f64> = runs.iter().map(|run| 1.0 / run.variance).collect();
    let total: f64 = weights.iter().sum();
    let mean = weights.iter().zip(values()).map(|(w, v)| w * v).sum::<f64>() / total;
    let spread: f64 = weights.iter().zip(values()).map(|(w, v)| w * (v - mean).powi(2)).sum();
    let scale = total - weights.iter().map(|w| w * w).sum::<f64>() / total;
    ((spread - (runs.len() - 1) as f64) / scale).max(0.0)
}
