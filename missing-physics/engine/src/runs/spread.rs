//! By how much a mechanism's parameters differ from run to run, beyond what the noise of each run makes them differ.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use crate::diagnosis::RunSpread;
use crate::estimate::reach::{Z95, student};
use crate::fit::bordered::BorderedNormal;
use crate::fit::columns::normal_of_run;
use crate::fit::optimum::{Fit, covariance};
use crate::model::{FEWEST_RUNS_THAT_DIFFER, PredictError};
use crate::problem::Problem;
use crate::selection::candidate::Candidate;

/// Chance, over all parameters, that runs which do not differ are said to.
const BY_CHANCE: f64 = 0.01;

/// How the runs differ in the parameters that a candidate's mechanisms add.
pub(crate) struct Spread {
    /// Position among the candidate's free shared parameters, and the standard deviation between runs.
    found: Vec<(usize, f64)>,
    /// What it adds to the covariance of the free shared parameters.
    covariance: DMatrix<f64>,
}

/// The standard deviation between runs of each shared parameter that a candidate's mechanisms add, by the moments of the runs' own
/// estimates (DerSimonian and Laird 1986, doi:10.1016/0197-2456(86)90046-2), each run's estimate being one step from the common one.
pub(crate) fn spread(problem: &Problem<'_>, candidate: &Candidate) -> Result<Option<Spread>, PredictError> {
    let Candidate { selection, fit, .. } = candidate;
    let (runs, n) = (problem.rows.len(), selection.shared.len());
    if runs < FEWEST_RUNS_THAT_DIFFER || n == 0 {
        return Ok(None);
    }
    let of_run = |run: usize| -> Result<(DMatrix<f64>, Vec<f64>), PredictError> {
        let nuisance = &fit.nuisance[run];
        let normal = normal_of_run(problem, selection, &fit.noise, run, &fit.shared, nuisance)?;
        let mut one = BorderedNormal::new(n);
        one.add(&normal);
        Ok((one.information(), one.gradient().to_vec()))
    };
    let each: Vec<_> = (0..runs).map(of_run).collect::<Result<_, _>>()?;
    let known =
        covariance(&each.iter().fold(DMatrix::zeros(n, n), |sum, (information, _)| sum + information));
    let asked: Vec<usize> =
        (0..n).filter(|&i| selection.added_shared[i] && known[(i, i)].is_finite()).collect();
    let mut found = Vec::new();
    let mut added = DMatrix::zeros(n, n);
    for &i in &asked {
        let run_information = |(information, _): &(DMatrix<f64>, Vec<f64>)| information[(i, i)];
        let total: f64 = each.iter().map(run_information).sum();
        let (mut scatter, mut expected, mut squares) = (0.0, 0.0, 0.0);
        // How the common estimate moves where run by run the parameter does.
        let mut moved = DMatrix::zeros(n, n);
        for (information, gradient) in each.iter().filter(|run| run_information(run) > 1e-9 * total) {
            let row: DVector<f64> = information.column(i).into_owned();
            scatter += gradient[i] * gradient[i] / row[i];
            expected += 1.0 - (row.transpose() * &known * &row)[(0, 0)] / row[i];
            squares += row[i] * row[i];
            let follows = &known * &row;
            moved += &follows * follows.transpose();
        }
        if !(expected > 0.5) {
            continue;
        }
        let chance = ChiSquared::new(expected).map_or(1.0, |law| law.sf(scatter));
        let variance = (scatter - expected) / (total - squares / total);
        if chance < BY_CHANCE / asked.len() as f64 && variance > 0.0 && variance.is_finite() {
            found.push((i, variance.sqrt()));
            // Few runs know how much runs differ less well than many.
            let reach = student(runs as f64 - 1.0) / Z95;
            added += moved * (variance * reach * reach);
        }
    }
    Ok((!found.is_empty()).then_some(Spread { found, covariance: added }))
}

impl Spread {
    /// The candidate with intervals that allow for runs that differ.
    pub(crate) fn widened(&self, candidate: &Candidate) -> Candidate {
        let wide = covariance(&candidate.fit.information) + &self.covariance;
        let information = match wide.cholesky().map(|factor| factor.inverse()) {
            Some(information) if information.iter().all(|v| v.is_finite()) => information,
            _ => candidate.fit.information.clone(),
        };
        Candidate { fit: Fit { information, ..candidate.fit.clone() }, ..candidate.clone() }
    }

    /// For the answer.
    pub(crate) fn report(&self, problem: &Problem<'_>, candidate: &Candidate) -> Vec<RunSpread> {
        let of = |&(i, standard_deviation): &(usize, f64)| {
            let parameter = &problem.spec().parameters[problem.shared.index[candidate.selection.shared[i]]];
            RunSpread {
                parameter: parameter.name.clone(),
                unit: parameter.unit.clone(),
                value: candidate.fit.shared[candidate.selection.shared[i]],
                standard_deviation,
            }
        };
        self.found.iter().map(of).collect()
    }
}
