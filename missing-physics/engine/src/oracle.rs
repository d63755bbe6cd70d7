//! What could be known of a recording at best: the answer of an analysis that knows which mechanisms are at work, to measure a
//! diagnosis by.

use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use crate::data::Recording;
use crate::engine::begin::{Begun, begin};
use crate::engine::{DiagnoseError, Options};
use crate::fit::columns::whitened_columns;
use crate::fit::gauss_newton::solve;
use crate::locate::projection::{Projection, dot};
use crate::model::Model;
use crate::problem::Problem;
use crate::selection::candidate::{Candidate, candidate};
use crate::selection::held_out::held_out;
use crate::selection::search::search;

/// What the data say of the mechanisms that are truly at work.
#[derive(Debug, Clone, PartialEq)]
pub struct Oracle {
    /// Twice the gain in log likelihood of the true mechanisms over the baseline, each fitted with its own noise.
    pub likelihood_ratio: f64,
    /// Shared parameters that the true mechanisms add.
    pub degrees: usize,
    /// p-value of that ratio (chi squared; Wilks 1938, doi:10.1214/aoms/1177732360).
    pub p_value: f64,
    /// Log Bayes factor of the true set against the best set that lacks one of its mechanisms; where it is large, the data
    /// alone decide.
    pub decisive: f64,
    /// Root mean square error of the true model's refit on runs left out, by channel.
    pub heldout_rmse: Vec<f64>,
}

/// Fits the true mechanisms (identifiers) and all their rivals.
///
/// # Errors
/// [`DiagnoseError`]; [`DiagnoseError::Unknown`] for a mechanism that the model has not.
pub fn oracle(
    model: &dyn Model,
    recording: &Recording,
    truth: &[String],
    options: &Options,
) -> Result<Oracle, DiagnoseError> {
    let Begun { problem, rule, baseline, .. } = begin(model, recording, options, &[])?;
    let set = numbers(&problem, truth)?;
    let competing = rule.competing();
    let everything = problem.spec().named();
    let among = candidate(&problem, &competing, &[], &[], &baseline.fit, &[])?;
    let all = search(&problem, &competing, among, &everything, &|_| true).ok_or(DiagnoseError::Stopped)?.all;
    let at_work = problem.at_work(&set);
    let known = all.iter().find(|c| problem.at_work(&c.set) == at_work).cloned();
    let truth = match known {
        Some(found) => found,
        None => candidate(&problem, &competing, &set, &[], &baseline.fit, &[])?,
    };
    let lacking = |c: &&Candidate| {
        let there = problem.at_work(&c.set);
        !set.iter().all(|m| there.contains(m)) && c.ruled_out.is_none()
    };
    let rival = all.iter().filter(lacking).map(|c| c.evidence).fold(f64::NEG_INFINITY, f64::max);
    let likelihood_ratio = 2.0 * (truth.fit.log_likelihood - all[0].fit.log_likelihood);
    let degrees = truth.selection.shared.len() - all[0].selection.shared.len();
    let p_value = ChiSquared::new(degrees.max(1) as f64).map_or(1.0, |law| law.sf(likelihood_ratio.max(0.0)));
    Ok(Oracle {
        likelihood_ratio,
        degrees,
        p_value,
        decisive: truth.evidence - rival,
        heldout_rmse: held_out(&problem, &truth)?.rmse,
    })
}

/// What the data say of something small beside the mechanisms that are truly at work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OracleOfLeftover {
    /// Log Bayes factor of an effect of the true shape and a free size against none, the noise known (Schwarz 1978,
    /// doi:10.1214/aos/1176344136); where it is large, the data show it.
    pub decisive: f64,
}

/// Looks for what a recording has that another with the same noise has not, beside the true mechanisms (identifiers), which both have;
/// `None` where their rows do not correspond, or they do not differ.
///
/// # Errors
/// As [`oracle`].
pub fn oracle_of_leftover(
    model: &dyn Model,
    (recording, without): (&Recording, &Recording),
    truth: &[String],
    options: &Options,
) -> Result<Option<OracleOfLeftover>, DiagnoseError> {
    let lengths = |r: &Recording| r.runs.iter().map(|run| run.len()).collect::<Vec<_>>();
    if lengths(recording) != lengths(without) {
        return Ok(None);
    }
    let Begun { problem, rule, baseline, .. } = begin(model, without, options, &[])?;
    let set = numbers(&problem, truth)?;
    let clean = candidate(&problem, &rule.competing(), &set, &[], &baseline.fit, &[])?;
    let Begun { problem, .. } = begin(model, recording, options, &[])?;
    let (selection, noise) = (&clean.selection, &clean.fit.noise);
    let fit = solve(&problem, selection, noise, &clean.fit.shared, &clean.fit.nuisance)?;
    let columns = (0..problem.rows.len())
        .map(|run| whitened_columns(&problem, selection, noise, run, &fit.shared, &fit.nuisance[run]))
        .collect::<Result<Vec<_>, _>>()?;
    let changed = (0..problem.rows.len()).map(|run| {
        let of_channel = |channel: usize| {
            let [with, without] = [recording, without].map(|r| &r.runs[run].outputs[channel]);
            let change = problem.rows[run].valid[channel].iter().map(|&i| with[i] - without[i]);
            let mut change: Vec<f64> = change.map(|v| if v.is_finite() { v } else { 0.0 }).collect();
            problem.whitener(run, channel, noise.shape[channel]).whiten(&mut change);
            change.iter_mut().for_each(|v| *v /= noise.sigma[channel]);
            change
        };
        (0..problem.channels()).flat_map(of_channel).collect::<Vec<f64>>()
    });
    let projection = Projection::new(&columns, (selection.nuisance.len(), selection.shared.len()));
    let rest = projection.rest(changed.collect());
    let square: f64 = rest.iter().map(|run| dot(run, run)).sum();
    let product: f64 = rest.iter().zip(&projection.residual).map(|(rest, left)| dot(rest, left)).sum();
    let decisive = 0.5 * (product * product / square - projection.rows.ln());
    Ok((square > 0.0).then_some(OracleOfLeftover { decisive }))
}

/// The numbers of mechanisms, rising.
fn numbers(problem: &Problem<'_>, ids: &[String]) -> Result<Vec<usize>, DiagnoseError> {
    let number = |id: &String| {
        let at = problem.spec().mechanisms.iter().position(|m| m.id == *id);
        at.ok_or_else(|| DiagnoseError::Unknown { id: id.clone() })
    };
    let mut set = ids.iter().map(number).collect::<Result<Vec<_>, _>>()?;
    set.sort_unstable();
    Ok(set)
}
