//! The next experiment: the action within the rig's range after which the least doubt between the rivals is expected.

use crate::data::{Recording, Run};
use crate::diagnosis::NextExperiment;
use crate::fit::bordered::BorderedNormal;
use crate::fit::columns::whitened_columns;
use crate::linalg::gram;
use crate::model::{Experiment, PredictError};
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};
use crate::selection::candidate::Candidate;

/// Below this expected log Bayes factor an experiment is not worth doing.
const WORTHWHILE: f64 = 1.0;

/// The experiment after which the truth is expected to be most probable, whichever rival it is; where none tells all of them
/// apart, the words say which one it tells from the rest.
pub(crate) fn best(
    problem: &Problem<'_>,
    rivals: &[&Candidate],
    experiments: &[Experiment],
) -> Option<NextExperiment> {
    let most = rivals.iter().map(|r| r.evidence).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = rivals.iter().map(|r| (r.evidence - most).exp()).collect();
    let outlooks: Vec<Outlook> =
        experiments.iter().map(|experiment| Outlook::by(problem, rivals, &weights, experiment)).collect();
    let at = (0..outlooks.len()).max_by(|&a, &b| outlooks[a].worth.total_cmp(&outlooks[b].worth))?;
    let apart = &outlooks[at].over_nearest;
    let (least, greatest) =
        (apart.iter().copied().fold(f64::INFINITY, f64::min), apart.iter().copied().fold(0.0, f64::max));
    let value = if least >= WORTHWHILE { least } else { greatest };
    if !(value >= WORTHWHILE && value.is_finite()) {
        return None;
    }
    let named = |m: &&usize| !problem.spec().mechanisms[**m].between_runs;
    let id = |&m: &usize| problem.spec().mechanisms[m].id.clone();
    let mut separates: Vec<String> = rivals.iter().flat_map(|r| r.set.iter().filter(named).map(id)).collect();
    separates.sort();
    separates.dedup();
    let names = |set: &Candidate| {
        let names: Vec<&str> = set.set.iter().map(|&m| problem.spec().mechanisms[m].name.as_str()).collect();
        names.join(" with ")
    };
    let experiment = &experiments[at];
    let alone = apart.iter().position(|v| *v == greatest).filter(|_| least < WORTHWHILE);
    let words = match alone {
        Some(i) => format!(
            "{} (it tells {} from the others, not these from each other)",
            experiment.words,
            names(rivals[i])
        ),
        None => experiment.words.clone(),
    };
    let variables = &problem.recording.variables;
    let named =
        |run: &Run| variables.iter().map(|v| v.name.clone()).zip(run.inputs.iter().cloned()).collect();
    Some(NextExperiment {
        action: experiment.action.clone(),
        inputs: experiment.runs.iter().map(named).collect(),
        words,
        separates,
        expected_log_bayes_factor: value,
    })
}

/// What an experiment is expected to tell.
struct Outlook {
    /// For each rival: the log Bayes factor over the nearest other, if that rival is the truth.
    over_nearest: Vec<f64>,
    /// How little doubt is left: minus the logarithm of the chance that the truth does not come out first.
    worth: f64,
}

impl Outlook {
    fn by(problem: &Problem<'_>, rivals: &[&Candidate], weights: &[f64], experiment: &Experiment) -> Self {
        let mut over_nearest = vec![f64::INFINITY; rivals.len()];
        let mut doubt = f64::MIN_POSITIVE;
        for (i, truth) in rivals.iter().enumerate() {
            for (j, other) in rivals.iter().enumerate().filter(|(j, _)| *j != i) {
                let factor = expected(problem, truth, other, experiment).unwrap_or(0.0);
                over_nearest[i] = over_nearest[i].min(factor);
                // Bhattacharyya's bound on confusing two normal laws whose mean log likelihood ratio this is (Kailath 1967,
                // doi:10.1109/TCOM.1967.1089532).
                doubt += (weights[i] * weights[j]).sqrt() * (-0.25 * factor).exp();
            }
        }
        Self { over_nearest, worth: -doubt.ln() }
    }
}

/// Expected log Bayes factor of `truth` over `other` after the experiment: half the squared distance that is left once
/// `other` has moved its parameters as far as the present data allow.
fn expected(
    problem: &Problem<'_>,
    truth: &Candidate,
    other: &Candidate,
    experiment: &Experiment,
) -> Result<f64, PredictError> {
    let channels = problem.channels();
    let mut recording = Recording { runs: experiment.runs.clone(), ..problem.recording.clone() };
    for (run, nuisance) in recording.runs.iter_mut().zip(&experiment.nuisance) {
        let n = run.len();
        let mut out = vec![0.0; n * channels];
        problem.model.predict(run, &truth.fit.shared, &nuisance_of_next(truth, nuisance), &mut out)?;
        run.outputs = (0..channels).map(|c| out[c * n..(c + 1) * n].to_vec()).collect();
    }
    let future = problem.with(recording);
    // The rivals' noise is a property of the rig: white at the level that the present data show.
    let noise = NoiseState { shape: vec![0; channels], sigma: truth.fit.noise.sigma.clone() };
    let selection: &Selection = &other.selection;
    let mut bordered = BorderedNormal::with_prior(other.fit.information.clone());
    for run in 0..future.rows.len() {
        let nuisance = nuisance_of_next(other, &experiment.nuisance[run]);
        bordered.add(&gram(&whitened_columns(
            &future,
            selection,
            &noise,
            run,
            &other.fit.shared,
            &nuisance,
        )?));
    }
    Ok(0.5 * bordered.solve(&bordered.factor()).1)
}

/// A further run's nuisance parameters: those that a mechanism added have the mean of the runs so far.
fn nuisance_of_next(candidate: &Candidate, stated: &[f64]) -> Vec<f64> {
    let Selection { nuisance: slots, added_nuisance: added, .. } = &candidate.selection;
    let mut nuisance = stated.to_vec();
    for (&slot, _) in slots.iter().zip(added).filter(|(_, added)| **added) {
        let runs = &candidate.fit.nuisance;
        nuisance[slot] = runs.iter().map(|run| run[slot]).sum::<f64>() / runs.len().max(1) as f64;
    }
    nuisance
}
