//! Maximum-likelihood fits: bounded Gauss-Newton with every run's nuisance parameters eliminated run by run.

use nalgebra::DMatrix;

use crate::fit::step::{Eliminated, NormalEquations, Step, reduce};
use crate::linalg::{backward, cholesky, determined, dot, forward, gram, log_determinant};
use crate::model::PredictError;
use crate::noise::process::Shape;
use crate::problem::{Problem, Selection};

/// The noise of all channels as a fit assumes it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NoiseState {
    /// Index into the family of shapes, by channel.
    pub(crate) shape: Vec<usize>,
    /// One sigma, by channel.
    pub(crate) sigma: Vec<f64>,
}

/// A point in parameter space and what the data say there.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub(crate) shared: Vec<f64>,
    pub(crate) nuisance: Vec<Vec<f64>>,
    pub(crate) noise: NoiseState,
    /// Weighted sum of squared residuals.
    pub(crate) chi2: f64,
    /// Log likelihood with the runs' nuisance parameters integrated out over a wide prior.
    pub(crate) log_likelihood: f64,
    /// How well each run tells its nuisance parameters.
    pub(crate) nuisance_errors: Vec<NuisanceErrors>,
    /// Information matrix of the free shared parameters (nuisance ones eliminated).
    pub(crate) information: DMatrix<f64>,
    pub(crate) converged: bool,
    /// Free shared slots that ended at a bound.
    pub(crate) at_bound: Vec<usize>,
}

/// How well a run tells its free nuisance parameters, in the order of the selection.
#[derive(Debug, Clone)]
pub(crate) struct NuisanceErrors {
    /// Standard errors for given shared parameters; infinite where the run does not tell.
    pub(crate) error: Vec<f64>,
    /// How each moves with each free shared parameter: `[own][shared]`.
    pub(crate) slope: Vec<Vec<f64>>,
}

/// How wide the prior of a run's nuisance parameter is, in units of its scale.
const NUISANCE_PRIOR: f64 = 1e3;
/// The same for one that a mechanism adds.
const ADDED_NUISANCE_PRIOR: f64 = 10.0;

/// Standard deviation of the prior of the `i`-th free nuisance parameter.
pub(crate) fn nuisance_prior_width(problem: &Problem<'_>, selection: &Selection, i: usize) -> f64 {
    let width = if selection.added_nuisance[i] { ADDED_NUISANCE_PRIOR } else { NUISANCE_PRIOR };
    width * problem.nuisance.scale[selection.nuisance[i]]
}

const MAX_ITERATIONS: usize = 60;

/// Whitened columns of one run: Jacobian by nuisance, by shared parameters, and the residual; channels one after the other.
pub(crate) fn whitened_columns(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    run: usize,
    shared: &[f64],
    nuisance: &[f64],
) -> Result<Vec<Vec<f64>>, PredictError> {
    let data = &problem.recording.runs[run];
    let rows = problem.channels() * data.len();
    let free = selection.shared.len() + selection.nuisance.len();
    let (mut out, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * free]);
    problem.model.jacobian(
        data,
        shared,
        nuisance,
        &selection.shared,
        &selection.nuisance,
        &mut out,
        &mut jacobian,
    )?;
    if let Some(bad) = out.iter().chain(&jacobian).find(|v| !v.is_finite()) {
        return Err(PredictError { run: data.label.clone(), reason: format!("the prediction holds {bad}") });
    }
    let mut columns = vec![Vec::with_capacity(rows); free + 1];
    for channel in 0..problem.channels() {
        let whitener = problem.whitener(run, channel, noise.shape[channel]);
        let inverse_sigma = 1.0 / noise.sigma[channel];
        let mut push = |target: usize, mut picked: Vec<f64>| {
            whitener.whiten(&mut picked);
            columns[target].extend(picked.into_iter().map(|v| v * inverse_sigma));
        };
        for k in 0..free {
            // The model lists shared columns first; the normal equations eliminate nuisance ones first.
            let source = if k < selection.nuisance.len() {
                selection.shared.len() + k
            } else {
                k - selection.nuisance.len()
            };
            push(k, problem.pick(run, channel, &jacobian[source * rows..(source + 1) * rows]));
        }
        let residual: Vec<f64> = problem.rows[run].valid[channel]
            .iter()
            .map(|&i| data.outputs[channel][i] - out[channel * data.len() + i])
            .collect();
        push(free, residual);
    }
    Ok(columns)
}

/// Normal equations of one run with the prior of its nuisance parameters, which come first, then the shared ones, then the residual.
pub(crate) fn normal_of_run(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    run: usize,
    shared: &[f64],
    nuisance: &[f64],
) -> Result<DMatrix<f64>, PredictError> {
    let mut gram = gram(&whitened_columns(problem, selection, noise, run, shared, nuisance)?);
    let last = gram.nrows() - 1;
    for (i, &slot) in selection.nuisance.iter().enumerate() {
        let precision = 1.0 / nuisance_prior_width(problem, selection, i).powi(2);
        let departure = problem.nuisance_start[run][slot] - nuisance[slot];
        gram[(i, i)] += precision;
        gram[(i, last)] += precision * departure;
        gram[(last, i)] += precision * departure;
        gram[(last, last)] += precision * departure * departure;
    }
    Ok(gram)
}

fn linearise(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    shared: &[f64],
    nuisance: &[Vec<f64>],
) -> Result<NormalEquations, PredictError> {
    let mut normals = Vec::with_capacity(nuisance.len());
    let mut chi2 = 0.0;
    for (run, values) in nuisance.iter().enumerate() {
        let gram = normal_of_run(problem, selection, noise, run, shared, values)?;
        let last = gram.nrows() - 1;
        chi2 += gram[(last, last)];
        normals.push(gram);
    }
    Ok(NormalEquations { normals, chi2 })
}

/// Fits the free parameters for a given noise, from a given start.
pub(crate) fn solve(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    shared: &[f64],
    nuisance: &[Vec<f64>],
) -> Result<Fit, PredictError> {
    let (n_nuisance, n_shared) = (selection.nuisance.len(), selection.shared.len());
    let (mut shared, mut nuisance) = (shared.to_vec(), nuisance.to_vec());
    let mut linear = linearise(problem, selection, noise, &shared, &nuisance)?;
    let mut damping = 0.0;
    let mut converged = false;
    let mut held = vec![false; n_shared];
    for _ in 0..MAX_ITERATIONS {
        let step = Step::new(problem, selection, &linear, (&shared, &nuisance), damping);
        let predicted = step.predicted;
        held = step.held;
        if !(predicted > 1e-9 * (1.0 + 1e-6 * linear.chi2)) {
            converged = true;
            break;
        }
        match linearise(problem, selection, noise, &step.shared, &step.nuisance) {
            Ok(next) if next.chi2 <= linear.chi2 * (1.0 + 1e-14) => {
                let gained = linear.chi2 - next.chi2;
                (shared, nuisance, linear) = (step.shared, step.nuisance, next);
                damping = if damping < 1e-6 { 0.0 } else { damping * 0.1 };
                if gained < 1e-7 && predicted < 1e-5 {
                    converged = true;
                    break;
                }
            }
            _ if damping > 1e8 => {
                // No step goes down any more: rounding, a bound of a nuisance parameter, or a kink.
                converged = predicted < 1e-4 * (1.0 + linear.chi2);
                break;
            }
            _ => damping = if damping == 0.0 { 1e-3 } else { damping * 10.0 },
        }
    }
    let free = vec![false; n_nuisance];
    let eliminated: Vec<Eliminated> = linear.normals.iter().map(|n| Eliminated::new(n, &free, 0.0)).collect();
    let (information, _) = reduce(&linear, &eliminated, n_nuisance, n_shared);
    let mut log_likelihood = -0.5 * linear.chi2;
    for e in &eliminated {
        log_likelihood -= 0.5 * e.log_determinant;
    }
    for channel in 0..problem.channels() {
        log_likelihood -= problem.count(channel) as f64 * noise.sigma[channel].ln();
        for run in 0..problem.rows.len() {
            log_likelihood -= 0.5 * problem.whitener(run, channel, noise.shape[channel]).log_determinant;
        }
    }
    let nuisance_errors = eliminated.iter().map(|e| e.nuisance_errors(n_shared)).collect();
    let at_bound = (0..n_shared).filter(|&i| held[i]).map(|i| selection.shared[i]).collect();
    Ok(Fit {
        shared,
        nuisance,
        noise: noise.clone(),
        chi2: linear.chi2,
        log_likelihood,
        nuisance_errors,
        information,
        converged,
        at_bound,
    })
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
        shape.length_steps <= self.longest
    }

    /// The same rule for mechanisms that compete.
    pub(crate) fn competing(&self) -> Self {
        Self { against_colour: 6.0, ..self.clone() }
    }
}

/// The likeliest noise of each channel given a fit's residuals (restricted to what the nuisance parameters leave).
pub(crate) fn estimate_noise(
    problem: &Problem<'_>,
    selection: &Selection,
    rule: &NoiseRule,
    shared: &[f64],
    nuisance: &[Vec<f64>],
) -> Result<NoiseState, PredictError> {
    let channels = problem.channels();
    let all = Leftovers::new(problem, selection, shared, nuisance)?;
    let mut state = NoiseState { shape: vec![0; channels], sigma: vec![1.0; channels] };
    for channel in 0..channels {
        let left = all.of(problem, rule, channel, selection);
        let higher = |a: &(f64, f64), b: &(f64, f64)| a.0 > b.0;
        let mut best = (0, (f64::NEG_INFINITY, 1.0));
        for &shape in &rule.allowed {
            let value = left.under(shape);
            if higher(&value, &best.1) {
                best = (shape, value);
            }
        }
        let (shape, (_, sigma)) =
            problem.family.climb(best, |s| rule.admits(s), |shape| left.under(shape), higher);
        state.shape[channel] = shape;
        state.sigma[channel] = sigma;
    }
    Ok(state)
}

/// A shape that the noise of a channel may have, its sigma then, and how probable that is.
pub(crate) struct OpenShape {
    pub(crate) shape: usize,
    pub(crate) sigma: f64,
    pub(crate) weight: f64,
}

/// Of each channel the shapes of noise that a fit's residuals leave open, for somebody who prefers no kind.
pub(crate) fn open_shapes(
    problem: &Problem<'_>,
    selection: &Selection,
    rule: &NoiseRule,
    fit: &Fit,
) -> Result<Vec<Vec<OpenShape>>, PredictError> {
    /// Shapes that are less likely than the best by more than this factor are left out.
    const LEAST: f64 = 0.05;
    let all = Leftovers::new(problem, selection, &fit.shared, &fit.nuisance)?;
    let prior = problem.family.indifferent(&rule.allowed);
    let open = |channel: usize| {
        let left = all.of(problem, rule, channel, selection);
        let scored: Vec<(usize, f64, f64)> = rule
            .allowed
            .iter()
            .zip(&prior)
            .map(|(&shape, weight)| {
                let (score, sigma) = left.under(shape);
                (shape, sigma, score - rule.log_prior(problem, shape) + weight.ln())
            })
            .collect();
        let best = scored.iter().map(|s| s.2).fold(f64::NEG_INFINITY, f64::max);
        let weighed = scored.into_iter().map(|(shape, sigma, log)| (shape, sigma, (log - best).exp()));
        let kept: Vec<_> = weighed.filter(|k| k.2 >= LEAST).collect();
        let total: f64 = kept.iter().map(|k| k.2).sum();
        kept.into_iter().map(|(shape, sigma, w)| OpenShape { shape, sigma, weight: w / total }).collect()
    };
    Ok((0..problem.channels()).map(open).collect())
}

/// What a fit leaves in all channels, not yet whitened.
struct Leftovers {
    raw: Vec<Vec<Vec<f64>>>,
    nuisance_columns: Vec<Vec<Vec<usize>>>,
}

impl Leftovers {
    fn new(
        problem: &Problem<'_>,
        selection: &Selection,
        shared: &[f64],
        nuisance: &[Vec<f64>],
    ) -> Result<Self, PredictError> {
        let channels = problem.channels();
        let white = NoiseState { shape: vec![0; channels], sigma: vec![1.0; channels] };
        let raw = nuisance
            .iter()
            .enumerate()
            .map(|(run, values)| whitened_columns(problem, selection, &white, run, shared, values))
            .collect::<Result<Vec<_>, _>>()?;
        let nuisance_columns = (0..nuisance.len())
            .map(|run| channel_columns(problem, run, &raw[run][..selection.nuisance.len()]))
            .collect();
        Ok(Self { raw, nuisance_columns })
    }

    fn of<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        rule: &'a NoiseRule,
        channel: usize,
        selection: &'a Selection,
    ) -> Left<'a> {
        Left { problem, rule, raw: &self.raw, nuisance_columns: &self.nuisance_columns, channel, selection }
    }
}

/// What a fit leaves in one channel: residuals and nuisance parameters' columns, not yet whitened.
struct Left<'a> {
    problem: &'a Problem<'a>,
    rule: &'a NoiseRule,
    raw: &'a [Vec<Vec<f64>>],
    nuisance_columns: &'a [Vec<Vec<usize>>],
    channel: usize,
    selection: &'a Selection,
}

impl Left<'_> {
    /// Log likelihood with the prior's weight, and sigma, under a shape of noise.
    fn under(&self, shape: usize) -> (f64, f64) {
        let Self { problem, rule, channel, .. } = *self;
        let mut sums = Sums::default();
        for (run, columns) in self.raw.iter().enumerate() {
            let start: usize = (0..channel).map(|c| problem.rows[run].valid[c].len()).sum();
            let end = start + problem.rows[run].valid[channel].len();
            let whitener = problem.whitener(run, channel, shape);
            let mine = &self.nuisance_columns[run][channel];
            let n_nuisance = mine.len();
            let whitened: Vec<Vec<f64>> = mine
                .iter()
                .copied()
                .chain([columns.len() - 1])
                .map(|k| {
                    let mut column = columns[k][start..end].to_vec();
                    whitener.whiten(&mut column);
                    column
                })
                .collect();
            let residual = &whitened[n_nuisance];
            let mut nuisance_gram = gram(&whitened[..n_nuisance]);
            let kept = cholesky(&mut nuisance_gram, 1e-9);
            // The nuisance parameters are fitted anew under each shape: what they were under another one is no evidence.
            let mut right: Vec<f64> = whitened[..n_nuisance].iter().map(|c| dot(c, residual)).collect();
            forward(&nuisance_gram, &kept, &mut right);
            sums.squares += (dot(residual, residual) - dot(&right, &right)).max(0.0);
            sums.log_determinant += whitener.log_determinant + log_determinant(&nuisance_gram, &kept);
            sums.used += kept.iter().filter(|k| **k).count();
            sums.rows += end - start;
        }
        let total: usize = (0..problem.channels()).map(|c| problem.count(c)).sum();
        let share = sums.rows as f64 / total.max(1) as f64;
        let freedom =
            (sums.rows as f64 - sums.used as f64 - share * self.selection.shared.len() as f64).max(1.0);
        let sigma = match rule.fixed_sigma[channel] {
            Some(sigma) => sigma,
            None => (sums.squares / freedom).sqrt().max(rule.floor[channel]),
        };
        let score = rule.log_prior(problem, shape)
            - freedom * sigma.ln()
            - 0.5 * sums.log_determinant
            - 0.5 * sums.squares / (sigma * sigma);
        (score, sigma)
    }
}

/// For each channel, which of a run's nuisance columns (all channels one after the other) it determines.
fn channel_columns(problem: &Problem<'_>, run: usize, columns: &[Vec<f64>]) -> Vec<Vec<usize>> {
    let mut start = 0;
    let squares: Vec<Vec<f64>> = problem.rows[run]
        .valid
        .iter()
        .map(|rows| {
            let part = start..start + rows.len();
            start = part.end;
            columns.iter().map(|c| dot(&c[part.clone()], &c[part.clone()])).collect()
        })
        .collect();
    let largest: Vec<f64> =
        (0..columns.len()).map(|k| squares.iter().map(|s| s[k]).fold(0.0, f64::max)).collect();
    squares.iter().map(|here| determined(here, &largest)).collect()
}

#[derive(Default)]
struct Sums {
    squares: f64,
    log_determinant: f64,
    used: usize,
    rows: usize,
}

/// Fits parameters and noise in turn until neither moves.
pub(crate) fn fit(
    problem: &Problem<'_>,
    selection: &Selection,
    rule: &NoiseRule,
    start: (&[f64], &[Vec<f64>]),
    noise: Option<&NoiseState>,
) -> Result<Fit, PredictError> {
    let first = match noise {
        Some(noise) => noise.clone(),
        None => {
            let sigma = rule.fixed_sigma.iter().zip(&rule.floor).map(|(s, f)| s.unwrap_or(*f)).collect();
            NoiseState { shape: vec![0; problem.channels()], sigma }
        }
    };
    let mut best = solve(problem, selection, &first, start.0, start.1)?;
    for _ in 0..6 {
        let noise = estimate_noise(problem, selection, rule, &best.shared, &best.nuisance)?;
        let still = noise.shape == best.noise.shape
            && noise.sigma.iter().zip(&best.noise.sigma).all(|(a, b)| (a / b - 1.0).abs() < 1e-4);
        if still {
            break;
        }
        best = solve(problem, selection, &noise, &best.shared, &best.nuisance)?;
    }
    Ok(best)
}

/// A parameter with less than this share of its own information left, the others being free, is not determined.
pub(crate) const UNDETERMINED: f64 = 1e-13;

/// The covariance of the free shared parameters; infinite variance where the data do not determine one of them.
pub(crate) fn covariance(information: &DMatrix<f64>) -> DMatrix<f64> {
    let n = information.nrows();
    let mut factor = information.clone();
    let kept = cholesky(&mut factor, UNDETERMINED);
    let mut inverse = DMatrix::zeros(n, n);
    for j in 0..n {
        if !kept[j] {
            inverse[(j, j)] = f64::INFINITY;
            continue;
        }
        let mut column = vec![0.0; n];
        column[j] = 1.0;
        forward(&factor, &kept, &mut column);
        backward(&factor, &kept, &mut column);
        inverse.column_mut(j).copy_from_slice(&column);
    }
    inverse
}
