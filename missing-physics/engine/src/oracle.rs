//! What could be known of a recording at best: the answer of an analysis that knows which mechanisms are at work, to measure a
//! diagnosis by.

use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use crate::data::Recording;
use crate::engine::begin::{Begun, begin};
use crate::engine::{DiagnoseError, Options};
use crate::model::Model;
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
    let Begun { problem, rule, baseline, .. } = begin(model, recording, options)?;
    let mut set = Vec::with_capacity(truth.len());
    for id in truth {
        let at = problem.spec().mechanisms.iter().position(|m| m.id == *id);
        set.push(at.ok_or_else(|| DiagnoseError::Unknown { id: id.clone() })?);
    }
    set.sort_unstable();
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
