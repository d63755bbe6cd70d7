//! The diagnosis from end to end.

use rayon::prelude::*;

use crate::adequacy;
use crate::compare::{Candidate, HeldOut, candidate, confusion, held_out, nested, search};
use crate::data::{Recording, RecordingError};
use crate::diagnosis::{
    ChannelFit, ChannelNoise, Confusion, Curves, Diagnosis, MechanismReport, NoiseSource, Outlier, SetReport,
    Verdict,
};
use crate::estimate::{estimates, of_mechanism};
use crate::experiment;
use crate::fit::{Fit, NoiseRule, NoiseState, fit, solve};
use crate::law;
use crate::locate::locate;
use crate::model::{Experiment, Model, PredictError};
use crate::noise::{median, rough_sigma};
use crate::noise_rule::noise_rule;
use crate::observer::{Observer, Progress};
use crate::outliers::set_aside;
use crate::problem::Problem;
use crate::repaired::Repaired;

/// How a diagnosis is made.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// False-alarm rate of the adequacy test, in (0, 0.5).
    pub alpha: f64,
    /// Seed of every random draw.
    pub seed: u64,
    /// Bootstrap replicates of an adequacy test.
    pub replicates: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { alpha: 0.05, seed: 1, replicates: 999 }
    }
}

/// Why there is no diagnosis.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DiagnoseError {
    /// The recording is not sound.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// There are too few rows for the baseline's own parameters.
    #[error(
        "{rows} measured values are too few for the {parameters} parameters of the baseline and its noise"
    )]
    TooFewRows {
        /// Measured values.
        rows: usize,
        /// Parameters of the baseline.
        parameters: usize,
    },
    /// The simulation gave no prediction.
    #[error(transparent)]
    Predict(#[from] PredictError),
    /// An option is out of its range.
    #[error("{name} is {value}, expected {expected}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// A mechanism that the model has not.
    #[error("the model has no mechanism {id}")]
    Unknown {
        /// The identifier.
        id: String,
    },
    /// The observer stopped the work.
    #[error("stopped")]
    Stopped,
}

/// Rivals within this log evidence of the best fit equally well (odds of 20 to 1).
const RIVAL_GAP: f64 = 3.0;
/// A richer set must beat an adequate simpler one by this log evidence.
const EARNED: f64 = 3.0;

/// Diagnoses a recording: is the baseline adequate; if not, where does it miss, and which mechanisms explain it?
///
/// The same recording, options and machine give the same bits on any number of threads; work runs in rayon's current
/// pool. `experiments` are what the rig could do next.
///
/// # Errors
/// [`DiagnoseError`]; a verdict, whichever it is, is no error.
pub fn diagnose(
    model: &dyn Model,
    recording: &Recording,
    experiments: &[Experiment],
    options: &Options,
    observer: &dyn Observer,
) -> Result<Diagnosis, DiagnoseError> {
    let diagnosis = diagnose_with(model, recording, experiments, options, observer);
    // A simulation that broke half way leaves an answer that may rest on what it did not say.
    match model.broken() {
        Some(error) => Err(error.into()),
        None => diagnosis,
    }
}

/// The beginning of every diagnosis.
struct Begun<'a> {
    /// The recording without its wild readings.
    problem: Problem<'a>,
    outliers: Vec<Outlier>,
    rule: NoiseRule,
    baseline: Candidate,
    /// The first fit of the baseline.
    start: Fit,
}

fn begin<'a>(
    model: &'a dyn Model,
    recording: &Recording,
    options: &Options,
) -> Result<Begun<'a>, DiagnoseError> {
    check(recording, options)?;
    let problem = Problem::new(model, recording.clone());
    enough_rows(&problem)?;
    let (cleaned, outliers) = set_aside(&problem)?;
    let problem = Problem::new(model, cleaned);
    let rule = noise_rule(&problem);
    enough_rows(&problem)?;
    let selection = problem.select(&[], &[]);
    let start = fit(&problem, &selection, &rule, (&problem.shared.start, &problem.own_start), None)?;
    let baseline = candidate(&problem, &rule, &[], &[], &start, &[])?;
    Ok(Begun { problem, outliers, rule, baseline, start })
}

/// The baseline's fit to a recording without its wild readings.
pub(crate) fn baseline_of<'a>(
    model: &'a dyn Model,
    recording: &Recording,
    options: &Options,
) -> Result<(Problem<'a>, NoiseRule, Candidate), DiagnoseError> {
    let begun = begin(model, recording, options)?;
    Ok((begun.problem, begun.rule, begun.baseline))
}

fn diagnose_with(
    model: &dyn Model,
    recording: &Recording,
    experiments: &[Experiment],
    options: &Options,
    observer: &dyn Observer,
) -> Result<Diagnosis, DiagnoseError> {
    let tell = |stage: &str, done: f64| -> Result<(), DiagnoseError> {
        if observer.progress(Progress { stage, done }) { Ok(()) } else { Err(DiagnoseError::Stopped) }
    };
    tell("reading the noise", 0.0)?;
    let Begun { problem, outliers, rule, baseline, start } = begin(model, recording, options)?;
    let (rows, unknowns) = enough_rows(&problem)?;
    // What a plain least-squares simulation looks like beside the data: drawn, located and counted as "before".
    let white =
        NoiseState { shape: vec![0; problem.channels()], sigma: rough_sigmas(&problem, &rule, &start) };
    let plain = Candidate {
        fit: solve(&problem, &baseline.selection, &white, &start.shared, &start.own)?,
        ..baseline.clone()
    };
    let everything: Vec<usize> = (0..problem.spec().mechanisms.len()).collect();
    tell("adequacy of the baseline", 0.0)?;
    let test = |c: &Candidate, stream: u64| {
        let rivals: Vec<usize> = everything.iter().copied().filter(|m| !c.set.contains(m)).collect();
        let seed = options.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ stream;
        adequacy::test(&problem, &c.selection, &c.fit, &rivals, &rule, options.replicates, seed)
    };
    let adequacy = test(&baseline, 1)?;
    tell("adequacy of the baseline", 1.0)?;

    let mut work = Work {
        problem: &problem,
        rule: &rule,
        baseline: &baseline,
        plain: &plain.fit,
        outliers,
        rows,
        unknowns,
    };
    if adequacy.p_value > options.alpha {
        let mut diagnosis = work.skeleton(&adequacy, Verdict::Adequate, &baseline)?;
        diagnosis.before = work.errors(&plain.fit, &held_out(&problem, &plain)?)?;
        diagnosis.after = diagnosis.before.clone();
        return Ok(diagnosis);
    }

    tell("comparing mechanisms", 0.0)?;
    let competing = rule.competing();
    let among = candidate(&problem, &competing, &[], &[], &baseline.fit, &[])?;
    let all = search(&problem, &competing, among, &everything, &|done| {
        observer.progress(Progress { stage: "comparing mechanisms", done })
    })
    .ok_or(DiagnoseError::Stopped)?;
    let mut physical: Vec<&Candidate> =
        all.iter().filter(|c| c.ruled_out.is_none() && c.evidence.is_finite()).collect();
    physical.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let probability = probabilities(&physical);

    tell("adequacy of the best explanation", 0.0)?;
    // The chosen set has been selected to fit: only a clear failure (a fifth of alpha) speaks against it.
    let enough = options.alpha / 5.0;
    // The baseline has been rejected: it is no candidate any more, however cheap it is.
    let mut best: Option<(&Candidate, f64)> = None;
    let mut failing = String::new();
    if let Some(&first) = physical.iter().find(|c| !c.set.is_empty()) {
        let tested = test(first, 2)?;
        failing = tested.tests.first().map_or_else(String::new, |t| t.name.clone());
        let mut current = (first, tested.p_value);
        loop {
            let simpler = physical.iter().find(|c| {
                !c.set.is_empty()
                    && c.selection.shared.len() + c.selection.own.len()
                        < current.0.selection.shared.len() + current.0.selection.own.len()
                    && nested(c, current.0)
                    && c.evidence > current.0.evidence - EARNED
            });
            let Some(&simpler) = simpler else { break };
            let p = test(simpler, 3)?.p_value;
            if p <= options.alpha && p < current.1 {
                break;
            }
            current = (simpler, p);
        }
        best = Some(current);
    }
    tell("predicting unseen data", 0.0)?;
    let base_score = held_out(&problem, &baseline)?;
    let scores: Vec<Option<HeldOut>> = all
        .par_iter()
        .map(|c| {
            let wanted = c.set.len() <= 1 || best.is_some_and(|b| b.0.set == c.set);
            if wanted && c.evidence.is_finite() { held_out(&problem, c).ok() } else { None }
        })
        .collect();
    let score_of = |set: &[usize]| all.iter().position(|c| c.set == set).and_then(|i| scores[i].as_ref());
    let explained = best
        .filter(|(c, p)| *p > enough && score_of(&c.set).is_some_and(|s| s.log_score > base_score.log_score));

    let final_model = explained.map_or(&baseline, |(c, _)| c);
    let mut diagnosis = work.skeleton(&adequacy, Verdict::Unexplained, final_model)?;
    diagnosis.before = work.errors(&plain.fit, &held_out(&problem, &plain)?)?;
    diagnosis.after = diagnosis.before.clone();
    work.mechanisms(&mut diagnosis, &all, &scores, &base_score, &physical, &probability, best.map(|b| b.0));
    work.sets(&mut diagnosis, &all, &scores, &base_score, &physical, &probability, best);
    let sigma = match explained {
        Some((c, _)) => c.fit.noise.sigma.clone(),
        None => rough_sigmas(&problem, &rule, &baseline.fit),
    };
    diagnosis.location = locate(&problem, &baseline.selection, &plain.fit, &sigma)?;

    if let Some((chosen, p)) = explained {
        diagnosis.final_p_value = Some(p);
        diagnosis.chosen = work.ids(&chosen.set);
        if let Some(score) = score_of(&chosen.set) {
            diagnosis.after = work.errors(&chosen.fit, score)?;
        }
        work.draw(&mut diagnosis, &chosen.fit)?;
        tell("telling the rivals apart", 0.0)?;
        let mut rivals = vec![chosen];
        rivals.extend(physical.iter().copied().filter(|c| {
            c.set != chosen.set
                && !c.set.is_empty()
                && c.evidence > chosen.evidence - RIVAL_GAP
                && !nested(chosen, c)
                && !nested(c, chosen)
        }));
        keep_minimal(&mut rivals);
        rivals.truncate(6);
        if rivals.len() > 1 {
            diagnosis.verdict = Verdict::Ambiguous;
            diagnosis.confused_with = rivals[1..].iter().map(|c| work.ids(&c.set)).collect();
            let matrix = confusion(&problem, &competing, &rivals, 100, options.seed)?;
            diagnosis.confusion =
                Some(Confusion { sets: rivals.iter().map(|c| work.ids(&c.set)).collect(), matrix });
            tell("choosing the next experiment", 0.0)?;
            diagnosis.next_experiment = experiment::best(&problem, &rivals, experiments);
            let names: Vec<String> = rivals.iter().map(|c| work.names(&c.set)).collect();
            diagnosis.undetermined.push(format!("{} cannot be told apart in these data", listed(&names)));
            if diagnosis.next_experiment.is_none() {
                diagnosis.undetermined.push("no experiment in the rig's range would separate them".into());
            }
        } else {
            diagnosis.verdict = Verdict::Explained;
        }
    } else {
        if let Some((closest, p)) = best {
            let but = if p > enough {
                "it predicts data that it has not seen no better than the baseline".to_owned()
            } else {
                format!("it leaves a misfit of its own (p = {p:.3}; {failing})")
            };
            diagnosis
                .remarks
                .push(format!("the closest explanation is {}, but {but}", work.names(&closest.set)));
        }
        tell("looking for a law in the residual", 0.0)?;
        if let Some(found) = law::find(&problem, &competing, &baseline, &base_score)? {
            diagnosis.after = work.errors_of(&found.predictions, &found.held_out);
            for (run, curves) in diagnosis.curves.iter_mut().enumerate() {
                curves.after.clone_from(&found.predictions[run]);
            }
            diagnosis.noise = work.noise(&found.fit);
            diagnosis.law = Some(found.law);
        }
    }
    tell("done", 1.0)?;
    Ok(diagnosis)
}

/// Drops rivals that only add to another rival.
fn keep_minimal(rivals: &mut Vec<&Candidate>) {
    let all = rivals.clone();
    rivals
        .retain(|c| !all.iter().any(|o| o.set != c.set && nested(o, c) && o.evidence > c.evidence - EARNED));
}

fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} and {last}", most.join(", ")),
    }
}

fn check(recording: &Recording, options: &Options) -> Result<(), DiagnoseError> {
    recording.check()?;
    if !(options.alpha > 0.0 && options.alpha < 0.5) {
        return Err(DiagnoseError::Option {
            name: "alpha",
            value: options.alpha,
            expected: "above 0 and below 0.5",
        });
    }
    if options.replicates < 19 {
        let value = options.replicates as f64;
        return Err(DiagnoseError::Option { name: "replicates", value, expected: "at least 19" });
    }
    Ok(())
}

/// Measured values and unknowns of the baseline, where the former are more.
fn enough_rows(problem: &Problem<'_>) -> Result<(usize, usize), DiagnoseError> {
    let selection = problem.select(&[], &[]);
    let rows: usize = (0..problem.channels()).map(|c| problem.count(c)).sum();
    let unknowns = selection.shared.len() + selection.own.len() * problem.rows.len() + problem.channels();
    if rows <= unknowns {
        return Err(DiagnoseError::TooFewRows { rows, parameters: unknowns });
    }
    Ok((rows, unknowns))
}

/// Sigma of each channel's rough part, whatever the model: what is left once everything smooth is taken away.
fn rough_sigmas(problem: &Problem<'_>, rule: &NoiseRule, fallback: &Fit) -> Vec<f64> {
    (0..problem.channels())
        .map(|c| {
            let mut sigmas: Vec<f64> = problem
                .rows
                .iter()
                .enumerate()
                .filter_map(|(r, rows)| {
                    let column = &problem.recording.runs[r].outputs[c];
                    let values: Vec<f64> = rows.valid[c].iter().map(|&i| column[i]).collect();
                    rough_sigma(&rows.positions[c], &values)
                })
                .collect();
            rule.fixed_sigma[c]
                .or_else(|| median(&mut sigmas))
                .map_or(fallback.noise.sigma[c], |s| s.max(rule.floor[c]))
        })
        .collect()
}

fn probabilities(physical: &[&Candidate]) -> Vec<f64> {
    let most = physical.iter().map(|c| c.evidence).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = physical.iter().map(|c| (c.evidence - most).exp()).collect();
    let total: f64 = weights.iter().sum();
    weights.into_iter().map(|w| w / total).collect()
}

/// What the parts of a diagnosis are made from.
struct Work<'a> {
    problem: &'a Problem<'a>,
    rule: &'a NoiseRule,
    baseline: &'a Candidate,
    plain: &'a Fit,
    outliers: Vec<Outlier>,
    rows: usize,
    unknowns: usize,
}

impl Work<'_> {
    fn ids(&self, set: &[usize]) -> Vec<String> {
        set.iter().map(|&m| self.problem.spec().mechanisms[m].id.clone()).collect()
    }

    fn names(&self, set: &[usize]) -> String {
        let names: Vec<String> =
            set.iter().map(|&m| self.problem.spec().mechanisms[m].name.clone()).collect();
        names.join(" with ")
    }

    fn skeleton(
        &mut self,
        adequacy: &adequacy::Adequacy,
        verdict: Verdict,
        model: &Candidate,
    ) -> Result<Diagnosis, PredictError> {
        let recording = &self.problem.recording;
        let pairs =
            |list: &[crate::model::Quantity]| list.iter().map(|q| (q.name.clone(), q.unit.clone())).collect();
        let mut remarks = Vec::new();
        if !self.baseline.fit.converged {
            remarks.push("the baseline's fit did not converge; its best estimate is used".to_owned());
        }
        if self.rows < 3 * self.unknowns {
            remarks.push(format!("few data: {} measured values for {} unknowns", self.rows, self.unknowns));
        }
        let free: Vec<usize> =
            self.baseline.selection.shared.iter().map(|&slot| self.problem.shared.index[slot]).collect();
        let mut diagnosis = Diagnosis {
            verdict,
            p_value: adequacy.p_value,
            p_floor: adequacy.p_floor,
            tests: adequacy.tests.clone(),
            channels: pairs(&recording.channels),
            variables: pairs(&recording.variables),
            baseline: self.problem.spec().baseline.clone(),
            baseline_parameters: estimates(self.problem, self.baseline, &free, &[], None),
            noise: self.noise(&model.fit),
            location: Vec::new(),
            mechanisms: Vec::new(),
            sets: Vec::new(),
            chosen: Vec::new(),
            confused_with: Vec::new(),
            confusion: None,
            final_p_value: None,
            before: Vec::new(),
            after: Vec::new(),
            law: None,
            next_experiment: None,
            undetermined: Vec::new(),
            outliers: std::mem::take(&mut self.outliers),
            remarks,
            repaired: Repaired::of(self.problem, model),
            curves: Vec::new(),
        };
        let before = law::predictions(self.problem, self.plain)?;
        diagnosis.curves = recording
            .runs
            .iter()
            .zip(before)
            .map(|(run, before)| Curves {
                run: run.label.clone(),
                inputs: run.inputs.clone(),
                measured: run.outputs.clone(),
                after: before.clone(),
                before,
            })
            .collect();
        Ok(diagnosis)
    }

    fn noise(&self, fit: &Fit) -> Vec<ChannelNoise> {
        let recording = &self.problem.recording;
        (0..self.problem.channels())
            .map(|c| {
                let shape = self.problem.family.shape(fit.noise.shape[c]);
                ChannelNoise {
                    channel: recording.channels[c].name.clone(),
                    sigma: fit.noise.sigma[c],
                    source: match (self.rule.fixed_sigma[c], recording.calibration.get(c)) {
                        (None, _) => NoiseSource::Differences,
                        (Some(_), Some(Some(_))) => NoiseSource::Calibration,
                        (Some(_), _) => NoiseSource::Replicates,
                    },
                    correlated_share: shape.correlated,
                    correlation_length: shape.length_steps * self.problem.step,
                }
            })
            .collect()
    }

    fn errors(&self, fit: &Fit, score: &HeldOut) -> Result<Vec<ChannelFit>, PredictError> {
        Ok(self.errors_of(&law::predictions(self.problem, fit)?, score))
    }

    fn errors_of(&self, predictions: &[Vec<Vec<f64>>], score: &HeldOut) -> Vec<ChannelFit> {
        let recording = &self.problem.recording;
        (0..self.problem.channels())
            .map(|c| {
                let squares = recording.runs.iter().zip(predictions).flat_map(|(run, predicted)| {
                    run.outputs[c]
                        .iter()
                        .zip(&predicted[c])
                        .map(|(m, p)| (m - p).powi(2))
                        .filter(|v| v.is_finite())
                });
                let (sum, n) = squares.fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
                ChannelFit {
                    channel: recording.channels[c].name.clone(),
                    rmse: (sum / n.max(1) as f64).sqrt(),
                    heldout_rmse: score.rmse[c],
                }
            })
            .collect()
    }

    fn draw(&self, diagnosis: &mut Diagnosis, fit: &Fit) -> Result<(), PredictError> {
        for (curves, after) in diagnosis.curves.iter_mut().zip(law::predictions(self.problem, fit)?) {
            curves.after = after;
        }
        Ok(())
    }

    #[allow(clippy::too_many_arguments, reason = "the parts of one table")]
    fn mechanisms(
        &self,
        diagnosis: &mut Diagnosis,
        all: &[Candidate],
        scores: &[Option<HeldOut>],
        base: &HeldOut,
        physical: &[&Candidate],
        probability: &[f64],
        best: Option<&Candidate>,
    ) {
        let channels = &self.problem.recording.channels;
        for (m, mechanism) in self.problem.spec().mechanisms.iter().enumerate() {
            let single = all.iter().position(|c| c.set == [m]);
            let holder = best
                .filter(|c| c.set.contains(&m))
                .or_else(|| physical.iter().copied().find(|c| c.set.contains(&m)))
                .or_else(|| single.map(|i| &all[i]));
            let Some(holder) = holder else { continue };
            let alone = single.map(|i| &all[i]);
            let score = all
                .iter()
                .position(|c| c.set == holder.set)
                .and_then(|i| scores[i].as_ref())
                .or_else(|| single.and_then(|i| scores[i].as_ref()));
            let profile = best.is_some_and(|b| b.set == holder.set).then_some(self.rule);
            diagnosis.mechanisms.push(MechanismReport {
                id: mechanism.id.clone(),
                name: mechanism.name.clone(),
                equation: mechanism.equation.clone(),
                reference: mechanism.reference.clone(),
                probability: physical
                    .iter()
                    .zip(probability)
                    .filter(|(c, _)| c.set.contains(&m))
                    .map(|(_, p)| p)
                    .sum::<f64>()
                    .min(1.0),
                parameters: of_mechanism(self.problem, holder, mechanism, profile),
                heldout_log_score_gain: score.map_or(f64::NAN, |s| s.log_score - base.log_score),
                heldout_rmse: score.map_or(Vec::new(), |s| {
                    channels.iter().zip(&s.rmse).map(|(c, v)| (c.name.clone(), *v)).collect()
                }),
                ruled_out: alone.and_then(|c| c.ruled_out.clone()),
            });
        }
        diagnosis.mechanisms.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    }

    #[allow(clippy::too_many_arguments, reason = "the parts of one table")]
    fn sets(
        &self,
        diagnosis: &mut Diagnosis,
        all: &[Candidate],
        scores: &[Option<HeldOut>],
        base: &HeldOut,
        physical: &[&Candidate],
        probability: &[f64],
        best: Option<(&Candidate, f64)>,
    ) {
        diagnosis.sets = physical
            .iter()
            .zip(probability)
            .take(12)
            .map(|(c, &probability)| {
                let at = all.iter().position(|o| o.set == c.set);
                SetReport {
                    ids: self.ids(&c.set),
                    probability,
                    p_value: best.filter(|b| b.0.set == c.set).map(|b| b.1),
                    heldout_log_score_gain: at
                        .and_then(|i| scores[i].as_ref())
                        .map(|s| s.log_score - base.log_score),
                    ruled_out: None,
                }
            })
            .collect();
    }
}
