//! The diagnosis from end to end.

use crate::adequacy::outliers::set_aside;
use crate::adequacy::test::{self, Adequacy};
use crate::answer::Answer;
use crate::data::{Recording, RecordingError};
use crate::diagnosis::{ChannelFit, Confusion, Diagnosis, Outlier, Verdict};
use crate::experiment;
use crate::fit::alternate::fit;
use crate::fit::gauss_newton::solve;
use crate::fit::optimum::Fit;
use crate::fit::prediction::predictions;
use crate::law::search::find;
use crate::locate::locations::locate;
use crate::model::{Experiment, Model, PredictError, Scope, Spec, SpecError};
use crate::noise::process::rough_sigma;
use crate::noise::rule::{NoiseRule, NoiseState, noise_rule};
use crate::observer::{Observer, Progress};
use crate::problem::Problem;
use crate::selection::candidate::{Candidate, candidate};
use crate::selection::confusion::confusion;
use crate::selection::held_out::{HeldOut, held_out};
use crate::selection::ranking::{Best, Ranking, clearly};
use crate::selection::search::search;
use crate::statistics::median;

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
    /// The model's specification makes no sense.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The recording is not sound.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// There are too few rows for the baseline's nuisance parameters.
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
    /// An experiment that the model cannot predict.
    #[error("experiment \"{words}\": {got} {what}, expected {expected}")]
    Experiment {
        /// The action in words.
        words: String,
        /// What is miscounted.
        what: &'static str,
        /// Number found.
        got: usize,
        /// Number expected.
        expected: usize,
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
    match model.extensions().program.and_then(|program| program.fatal_error()) {
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
    model.spec().check()?;
    check(recording, options)?;
    let problem = Problem::new(model, recording.clone());
    enough_rows(&problem)?;
    let (cleaned, outliers) = set_aside(&problem)?;
    let problem = Problem::new(model, cleaned);
    let rule = noise_rule(&problem);
    enough_rows(&problem)?;
    let selection = problem.select(&[], &[]);
    let start = fit(&problem, &selection, &rule, (&problem.shared.start, &problem.nuisance_start), None)?;
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
    tell(observer, "reading the noise", 0.0)?;
    model.spec().check()?;
    experiments.iter().try_for_each(|e| check_experiment(model.spec(), recording, e))?;
    let begun = begin(model, recording, options)?;
    let least_squares = least_squares_baseline(&begun)?;
    Course { begun: &begun, least_squares: &least_squares, experiments, options, observer }.run()
}

fn tell(observer: &dyn Observer, stage: &str, done: f64) -> Result<(), DiagnoseError> {
    if observer.progress(Progress { stage, done }) { Ok(()) } else { Err(DiagnoseError::Stopped) }
}

/// What a plain least-squares simulation looks like beside the data: drawn, located and counted as "before".
fn least_squares_baseline(begun: &Begun<'_>) -> Result<Candidate, PredictError> {
    let Begun { problem, rule, baseline, start, .. } = begun;
    let white = NoiseState { shape: vec![0; problem.channels()], sigma: rough_sigmas(problem, rule, start) };
    let fit = solve(problem, &baseline.selection, &white, &start.shared, &start.nuisance)?;
    Ok(Candidate { fit, ..baseline.clone() })
}

/// The way from a fitted baseline to an answer.
struct Course<'a> {
    begun: &'a Begun<'a>,
    least_squares: &'a Candidate,
    experiments: &'a [Experiment],
    options: &'a Options,
    observer: &'a dyn Observer,
}

impl Course<'_> {
    fn tell(&self, stage: &str, done: f64) -> Result<(), DiagnoseError> {
        tell(self.observer, stage, done)
    }

    /// Is a candidate adequate?
    fn test(&self, candidate: &Candidate, stream: u64) -> Result<Adequacy, PredictError> {
        let Begun { problem, rule, .. } = self.begun;
        let rivals: Vec<usize> =
            (0..problem.spec().mechanisms.len()).filter(|m| !candidate.set.contains(m)).collect();
        let seed = self.options.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ stream;
        let replicates = self.options.replicates;
        test::test(problem, &candidate.selection, &candidate.fit, &rivals, rule, replicates, seed)
    }

    fn run(&self) -> Result<Diagnosis, DiagnoseError> {
        let Begun { problem, rule, baseline, .. } = self.begun;
        self.tell("adequacy of the baseline", 0.0)?;
        let adequacy = self.test(baseline, 1)?;
        self.tell("adequacy of the baseline", 1.0)?;
        let answer = Answer {
            problem,
            rule,
            baseline,
            least_squares: &self.least_squares.fit,
            outliers: &self.begun.outliers,
        };
        if adequacy.p_value > self.options.alpha {
            return Ok(answer.skeleton(&adequacy, Verdict::Adequate, baseline, self.before(&answer)?)?);
        }
        let mut ranking = self.compare()?;
        self.tell("adequacy of the best explanation", 0.0)?;
        let best = ranking.best(self.options.alpha, |c, stream| self.test(c, stream))?;
        self.tell("predicting unseen data", 0.0)?;
        ranking.score(problem, best.as_ref());
        // The chosen set has been selected to fit: only a clear failure speaks against it.
        let fails = |best: &Best| best.p_value <= clearly(self.options.alpha);
        let explained = best.as_ref().filter(|b| !fails(b) && ranking.gains(b.at));

        let ended_with = explained.map_or(baseline, |b| ranking.at(b.at));
        let mut diagnosis =
            answer.skeleton(&adequacy, Verdict::Unexplained, ended_with, self.before(&answer)?)?;
        diagnosis.mechanisms = answer.mechanisms(&ranking, best.as_ref());
        diagnosis.sets = answer.sets(&ranking, best.as_ref());
        let sigma = match explained {
            Some(_) => ended_with.fit.noise.sigma.clone(),
            None => rough_sigmas(problem, rule, &baseline.fit),
        };
        diagnosis.location = locate(problem, &baseline.selection, &self.least_squares.fit, &sigma)?;
        if let Some(chosen) = explained {
            diagnosis.final_p_value = Some(chosen.p_value);
            self.explained(&mut diagnosis, &answer, &ranking, chosen)?;
        } else {
            if let Some(closest) = &best {
                diagnosis.remarks.push(answer.closest(&ranking, closest, fails(closest)));
            }
            self.unexplained(&mut diagnosis, &answer, ranking.base())?;
        }
        self.tell("done", 1.0)?;
        Ok(diagnosis)
    }

    /// Errors of the plain simulation.
    fn before(&self, answer: &Answer<'_>) -> Result<Vec<ChannelFit>, PredictError> {
        answer.errors(&self.least_squares.fit, &held_out(&self.begun.problem, self.least_squares)?)
    }

    /// Every set of mechanisms worth looking at, fitted.
    fn compare(&self) -> Result<Ranking, DiagnoseError> {
        const STAGE: &str = "comparing mechanisms";
        let Begun { problem, rule, baseline, .. } = self.begun;
        self.tell(STAGE, 0.0)?;
        let competing = rule.competing();
        let among = candidate(problem, &competing, &[], &[], &baseline.fit, &[])?;
        let everything: Vec<usize> = (0..problem.spec().mechanisms.len()).collect();
        let progress = |done| self.observer.progress(Progress { stage: STAGE, done });
        let all = search(problem, &competing, among, &everything, &progress).ok_or(DiagnoseError::Stopped)?;
        Ok(Ranking::new(all, held_out(problem, baseline)?))
    }

    /// A set explains the data: does another as well, and what would tell them apart?
    fn explained(
        &self,
        diagnosis: &mut Diagnosis,
        answer: &Answer<'_>,
        ranking: &Ranking,
        best: &Best,
    ) -> Result<(), DiagnoseError> {
        let problem = &self.begun.problem;
        let chosen = ranking.at(best.at);
        diagnosis.chosen = answer.ids(&chosen.set);
        let after = predictions(problem, &chosen.fit)?;
        if let Some(score) = ranking.score_of(&chosen.set) {
            diagnosis.after = answer.errors_of(&after, score);
        }
        draw(diagnosis, &after);
        diagnosis.undetermined.extend(answer.open_numbers(chosen));
        self.tell("telling the rivals apart", 0.0)?;
        let rivals = ranking.rivals(best);
        if rivals.len() == 1 {
            diagnosis.verdict = Verdict::Explained;
            return Ok(());
        }
        diagnosis.verdict = Verdict::Ambiguous;
        let mut sets: Vec<Vec<String>> = rivals.iter().map(|c| answer.ids(&c.set)).collect();
        let matrix = confusion(problem, &self.begun.rule.competing(), &rivals, 100, self.options.seed)?;
        diagnosis.confusion = Some(Confusion { sets: sets.clone(), matrix });
        diagnosis.confused_with = sets.split_off(1);
        self.tell("choosing the next experiment", 0.0)?;
        diagnosis.next_experiment = experiment::best(problem, &rivals, self.experiments);
        let names: Vec<String> = rivals.iter().map(|c| answer.names(&c.set)).collect();
        diagnosis.undetermined.push(format!("{} cannot be told apart in these data", listed(&names)));
        if let Some((simpler, p_value)) = best.doubted {
            let names = answer.names(&ranking.at(simpler).set);
            diagnosis
                .undetermined
                .push(format!("{names} alone is hardly less likely and fits doubtfully (p = {p_value})"));
        }
        if diagnosis.next_experiment.is_none() {
            diagnosis.undetermined.push("no experiment in the rig's range would separate them".into());
        }
        Ok(())
    }

    /// Nothing on the list explains the data: is there a law in what is left?
    fn unexplained(
        &self,
        diagnosis: &mut Diagnosis,
        answer: &Answer<'_>,
        base: &HeldOut,
    ) -> Result<(), DiagnoseError> {
        let Begun { problem, rule, baseline, .. } = self.begun;
        self.tell("looking for a law in the residual", 0.0)?;
        if let Some(found) = find(problem, &rule.competing(), baseline, base)? {
            diagnosis.after = answer.errors_of(&found.predictions, &found.held_out);
            draw(diagnosis, &found.predictions);
            diagnosis.noise = answer.noise(&found.fit);
            diagnosis.law = Some(found.law);
        }
        Ok(())
    }
}

/// Puts what a fit predicts into the curves.
fn draw(diagnosis: &mut Diagnosis, predictions: &[Vec<Vec<f64>>]) {
    for (curves, after) in diagnosis.curves.iter_mut().zip(predictions) {
        curves.after.clone_from(after);
    }
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

/// An experiment's runs have the recording's inputs, and values for the model's nuisance parameters.
fn check_experiment(
    spec: &Spec,
    recording: &Recording,
    experiment: &Experiment,
) -> Result<(), DiagnoseError> {
    let equal = |what, got: usize, expected: usize| {
        if got == expected {
            return Ok(());
        }
        Err(DiagnoseError::Experiment { words: experiment.words.clone(), what, got, expected })
    };
    equal("lists of nuisance parameters", experiment.nuisance.len(), experiment.runs.len())?;
    let unknowns = spec.count(Scope::PerRun);
    experiment.nuisance.iter().try_for_each(|n| equal("nuisance parameters of a run", n.len(), unknowns))?;
    for run in &experiment.runs {
        equal("inputs of a run", run.inputs.len(), recording.variables.len())?;
        run.inputs.iter().try_for_each(|column| equal("rows of an input", column.len(), run.len()))?;
    }
    Ok(())
}

fn enough_rows(problem: &Problem<'_>) -> Result<(), DiagnoseError> {
    let (rows, parameters) = problem.size();
    if rows <= parameters { Err(DiagnoseError::TooFewRows { rows, parameters }) } else { Ok(()) }
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
