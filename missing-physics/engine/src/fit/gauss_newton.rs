//! Bounded Gauss-Newton for a given noise.

use crate::fit::bordered::BorderedNormal;
use crate::fit::columns::{normal_of_run, nuisance_departure, whitened_columns};
use crate::fit::optimum::Fit;
use crate::fit::step::{NormalEquations, Step};
use crate::linalg::dot;
use crate::model::PredictError;
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};

const MAX_ITERATIONS: usize = 60;
/// The same of a model that knows many mechanisms: most of what is tried explains nothing, and is not worth more.
const ITERATIONS_OF_MANY: usize = 24;
/// The same where a fit to all data shows where one to a part of them ends.
const ITERATIONS_AGAIN: usize = 6;
/// Gain in the sum of squares that a step promises, in units of what is left of a value, below which it is not taken by a model that knows
/// many mechanisms: it would move no parameter by more than a tenth of its error.
const NOT_WORTH: f64 = 1e-2;
/// The same of a fit that only shows where a better one begins, or what is left of the data.
pub(crate) const NOT_WORTH_ROUGHLY: f64 = 0.5;
/// What a step may promise at most, in parts of the sum of squares, where a fit that does not go down any more is at its end.
const STALLED: f64 = 1e-4;
/// Gain in the sum of squares that a step promises, in the same units, below which one that does not go down shortened either is at a
/// kink, for a model that knows many mechanisms.
const NO_GAIN: f64 = 0.1;
/// Gain of a shortened step, in the same units, that is next to none.
const HARDLY: f64 = 1e-3;
/// Gain of a step, promised and had, in the same units, at which a fit is at its end.
const SETTLED: f64 = 1e-5;
/// How many times what a step promises a fit may still gain, from the second step on.
const HOPE: f64 = 2.0;
/// The least part of a step that is tried.
const SHORTEST: f64 = 0.1;
/// A step of which more than this part would have been best is not shortened.
const WHOLE: f64 = 0.75;
/// Shortened steps in a row that gain next to nothing, after which a fit is at its end: dry friction and jumps leave kinks.
const PATIENCE: usize = 3;
/// A step that gains less than this part of what it promised leads along a crease of the sum of squares, ...
const POOR: f64 = 0.1;
/// ... and one that gains less than this next to nothing: for a model that knows many mechanisms, where dry friction leaves creases.
const CREASE: f64 = 0.02;
/// So many damped steps of such a model ...
const CREEPING: usize = 5;
/// ... that gain less than this together, in units of what is left of a value, end a fit: no likelihood is compared so finely.
const CREEP: f64 = 0.5;
/// The same of the last fit of a set that may be named: its estimates move by less than a tenth of their errors.
const CREEP_AT_LAST: f64 = 1e-2;

pub(crate) fn linearise(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    shared: &[f64],
    nuisance: &[Vec<f64>],
) -> Result<NormalEquations, PredictError> {
    NormalEquations::with(problem, |run| {
        normal_of_run(problem, selection, noise, run, shared, &nuisance[run])
    })
}

/// The sum of squares alone, without derivatives.
pub(crate) fn sum_of_squares(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    shared: &[f64],
    nuisance: &[Vec<f64>],
) -> Result<f64, PredictError> {
    let nothing = Selection::default();
    let of_run = |run: usize| {
        let mut residual = whitened_columns(problem, &nothing, noise, run, shared, &nuisance[run])?;
        let residual = residual.pop().unwrap_or_default();
        Ok(dot(&residual, &residual) + nuisance_departure(problem, selection, run, &nuisance[run]))
    };
    Ok(problem.by_run(of_run)?.into_iter().sum())
}

/// The normal equations where a step leads, and the sum of squares there (infinite where the model says nothing); without derivatives
/// where that is not below a bound: what follows a step that failed often fails as well, and is not worth them.
fn tried(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    step: &Step,
    below: Option<f64>,
) -> (Option<NormalEquations>, f64) {
    let at = (&step.shared[..], &step.nuisance[..]);
    if let Some(bound) = below {
        let reached = sum_of_squares(problem, selection, noise, at.0, at.1).unwrap_or(f64::INFINITY);
        if !(reached <= bound) {
            return (None, reached);
        }
    }
    let next = linearise(problem, selection, noise, at.0, at.1).ok();
    let reached = next.as_ref().map_or(f64::INFINITY, |next| next.chi2);
    (next, reached)
}

/// The part of a step at which the sum of squares is least along it: of the parabola with the slope that the step was made from, through
/// what a part of it gained (`-infinity` where it led nowhere).
fn best_length(length: f64, predicted: f64, gained: f64) -> f64 {
    // The sum of squares falls by `2 a predicted` to first order at a part `a`.
    let bent = 2.0 * length * predicted - gained;
    let best = predicted * length * length / bent;
    if bent > 0.0 && best < WHOLE { best } else { 1.0 }
}

/// By how much a step is damped, as a part of the information of each parameter.
struct Damping {
    part: f64,
    growth: f64,
    many: bool,
}

impl Damping {
    /// Of the first step that is damped.
    const FIRST: f64 = 1e-2;
    /// By how much it grows with the first step that fails, and with each further one so many times as much.
    const GROWTH: f64 = 2.0;
    /// The same of a model that knows few mechanisms: it grows and falls by decades.
    const FIRST_OF_FEW: f64 = 1e-3;
    const DECADE: f64 = 10.0;
    /// By how much it grows at the most with a step that goes down.
    const POOR: f64 = 2.0;
    /// Beyond this no step goes down.
    const MOST: f64 = 1e8;

    fn none(many: bool) -> Self {
        Self { part: 0.0, growth: Self::GROWTH, many }
    }

    /// After a step that does not go down.
    fn failed(&mut self) {
        let (first, growth) =
            if self.many { (Self::FIRST, self.growth) } else { (Self::FIRST_OF_FEW, Self::DECADE) };
        self.part = if self.part == 0.0 { first } else { self.part * growth };
        self.growth *= Self::GROWTH;
    }

    /// After a step that gained a part of what it promised (for a model that knows many mechanisms, Nielsen 1999, Damping parameter in
    /// Marquardt's method, IMM-REP-1999-05).
    fn succeeded(&mut self, part: f64) {
        self.growth = Self::GROWTH;
        let (least, factor) = if self.many {
            (1e-2 * Self::FIRST, (1.0 - (2.0 * part - 1.0).powi(3)).clamp(1.0 / Self::DECADE, Self::POOR))
        } else {
            (1e-3 * Self::FIRST_OF_FEW, 1.0 / Self::DECADE)
        };
        self.part = if self.part < least { 0.0 } else { self.part * factor };
    }

    /// After a step that hardly gained anything of what it promised: along a crease its direction is wrong, not its length.
    fn misled(&mut self) {
        self.growth = Self::GROWTH;
        self.part = if self.part == 0.0 { Self::FIRST } else { self.part * Self::POOR };
    }
}

/// When a fit ends.
#[derive(Clone, Copy)]
pub(crate) struct End {
    iterations: usize,
    /// Where the sum of squares will hardly get below this, the fit is given up; by a model that knows many mechanisms.
    hopeless_above: f64,
    /// Gain of a step that is not taken by such a model, in units of what is left of a value.
    not_worth: f64,
    /// Gain of damped steps that ends a fit of such a model, in the same units.
    creep: f64,
}

impl End {
    /// In so many iterations at most.
    pub(crate) fn after(iterations: usize) -> Self {
        Self { iterations, hopeless_above: f64::INFINITY, not_worth: NOT_WORTH, creep: CREEP }
    }

    /// In as many as a fit to all data may take.
    pub(crate) fn of(problem: &Problem<'_>) -> Self {
        Self::after(if problem.knows_many() { ITERATIONS_OF_MANY } else { MAX_ITERATIONS })
    }

    /// Of a fit to a part of the data, from where one to all of them ended.
    pub(crate) fn again(problem: &Problem<'_>) -> Self {
        Self::after(if problem.knows_many() { ITERATIONS_AGAIN } else { MAX_ITERATIONS }).roughly()
    }

    /// As well as another fit needs that goes on from there.
    pub(crate) fn roughly(self) -> Self {
        Self { not_worth: NOT_WORTH_ROUGHLY, ..self }
    }

    /// As finely as an estimate is reported.
    pub(crate) fn finely(self) -> Self {
        Self { creep: CREEP_AT_LAST, ..self }
    }

    /// Given up where the sum of squares will hardly get below `most`.
    pub(crate) fn below(self, most: f64) -> Self {
        Self { hopeless_above: most, ..self }
    }
}

/// Fits the free parameters for a given noise, from a given start.
pub(crate) fn solve(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    shared: &[f64],
    nuisance: &[Vec<f64>],
) -> Result<Fit, PredictError> {
    solve_until(End::of(problem), problem, selection, noise, (shared, nuisance))
}

/// The same to another end.
pub(crate) fn solve_until(
    end: End,
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    start: (&[f64], &[Vec<f64>]),
) -> Result<Fit, PredictError> {
    let linear = linearise(problem, selection, noise, start.0, start.1)?;
    Ok(descend(end, problem, selection, noise, start, linear))
}

/// The same, where the normal equations at the start are known.
pub(crate) fn descend(
    end: End,
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    (shared, nuisance): (&[f64], &[Vec<f64>]),
    mut linear: NormalEquations,
) -> Fit {
    let n_shared = selection.shared.len();
    let (mut shared, mut nuisance) = (shared.to_vec(), nuisance.to_vec());
    let many = problem.knows_many();
    let mut damping = Damping::none(many);
    let mut converged = false;
    let mut held = vec![false; n_shared];
    // What part of a step is taken, whether one from here failed, and whether it was shortened since.
    let (mut length, mut failed, mut shortened) = (1.0, false, false);
    let (mut hardly, mut promised) = (0, f64::INFINITY);
    // The sum of squares before each step, of such a model.
    let mut course = Vec::new();
    let values: usize = (0..problem.channels()).map(|c| problem.count(c)).sum();
    for iteration in 0..end.iterations {
        // Where a fit leaves many times the noise, what a step gains counts in units of that.
        let left = (linear.chi2 / values.max(1) as f64).max(1.0);
        let step = Step::new(problem, selection, &linear, (&shared, &nuisance), damping.part);
        let predicted = step.predicted;
        promised = predicted;
        held.clone_from(&step.held);
        let least = if many { end.not_worth * left } else { 1e-9 * (1.0 + 1e-6 * linear.chi2) };
        if !(predicted > least) {
            converged = true;
            break;
        }
        if many && iteration > 0 && linear.chi2 - HOPE * predicted > end.hopeless_above {
            break;
        }
        let before = course.len().checked_sub(CREEPING).map(|k| course[k]);
        if many && damping.part > 0.0 && before.is_some_and(|chi2: f64| chi2 - linear.chi2 < end.creep * left)
        {
            break;
        }
        course.push(linear.chi2);
        let step = step.part(length, &shared, &nuisance);
        let (next, reached) = tried(problem, selection, noise, &step, failed.then_some(linear.chi2));
        let gained = linear.chi2 - reached;
        let best = best_length(length, predicted, gained);
        match next {
            Some(next) if next.chi2 <= linear.chi2 * (1.0 + 1e-14) => {
                (shared, nuisance, linear) = (step.shared, step.nuisance, next);
                let of_promised = gained / (predicted * length * (2.0 - length));
                let hardly_any = gained < HARDLY * left && (many || damping.part > 0.0);
                hardly = if hardly_any || many && of_promised < CREASE { hardly + 1 } else { 0 };
                failed = damping.part > 0.0;
                if hardly == PATIENCE {
                    converged = predicted < STALLED * (1.0 + linear.chi2);
                    break;
                }
                if many && of_promised < POOR {
                    length = 1.0;
                    damping.misled();
                } else {
                    length = best;
                    damping.succeeded(gained / predicted);
                }
                shortened = many && damping.part > 0.0;
                if gained < SETTLED * left && predicted < SETTLED * left {
                    converged = true;
                    break;
                }
            }
            _ if damping.part > Damping::MOST || many && shortened && predicted < NO_GAIN * left => {
                // No step goes down any more: rounding, a bound of a nuisance parameter, or a kink.
                converged = predicted < STALLED * (1.0 + linear.chi2);
                break;
            }
            // A step that leads too far is shortened, one that leads astray is damped.
            _ if !shortened && best > SHORTEST => (length, failed, shortened) = (best, true, true),
            _ => {
                damping.failed();
                (length, failed, shortened) = (1.0, true, many);
            }
        }
    }
    converged |= many && promised < 10.0 * STALLED * (1.0 + linear.chi2);
    let bordered = linear.bordered(n_shared);
    let log_likelihood = log_likelihood(problem, noise, &bordered, linear.chi2);
    let nuisance_errors = bordered.runs().iter().map(|run| run.errors(n_shared)).collect();
    let at_bound = (0..n_shared).filter(|&i| held[i]).map(|i| selection.shared[i]).collect();
    Fit {
        shared,
        nuisance,
        noise: noise.clone(),
        chi2: linear.chi2,
        log_likelihood,
        nuisance_errors,
        information: bordered.information(),
        converged,
        at_bound,
    }
}

/// Log likelihood of the noise at a sum of squares, up to a constant, the nuisance parameters integrated out.
fn log_likelihood(problem: &Problem<'_>, noise: &NoiseState, bordered: &BorderedNormal, chi2: f64) -> f64 {
    let mut log_likelihood = -0.5 * chi2;
    for run in bordered.runs() {
        log_likelihood -= 0.5 * run.log_determinant();
    }
    for channel in 0..problem.channels() {
        log_likelihood -= problem.count(channel) as f64 * noise.sigma[channel].ln();
        for run in 0..problem.rows.len() {
            log_likelihood -= 0.5 * problem.whitener(run, channel, noise.shape[channel]).log_determinant;
        }
    }
    log_likelihood
}
