//! What a residual says by itself, where no listed mechanism explains it.
//!
//! Three kinds of law are tried, the simplest first, each judged on data that its fit has not seen: a few of the model's
//! candidate terms, an oscillation of one frequency, and a smooth curve over a variable.

use crate::adequacy::linearised::DEGREE;
use crate::data::Run;
use crate::diagnosis::{Estimate, Law};
use crate::estimate::estimates::estimates;
use crate::fit::gauss_newton::{Fit, NoiseRule};
use crate::linalg::dot;
use crate::model::{Model, Parameter, PredictError, Scope, Spec, Term};
use crate::problem::Problem;
use crate::selection::compare::{Candidate, HeldOut, candidate, held_out};
use rayon::prelude::*;

/// A law must gain this much log score on unseen data.
const LEAST_GAIN: f64 = 5.0;
/// And lower the error on some channel at least by this factor.
const LEAST_IMPROVEMENT: f64 = 0.9;

/// A law and the model that holds it.
pub(crate) struct Found {
    pub(crate) law: Law,
    /// Predictions with the law, `[run][channel][row]`.
    pub(crate) predictions: Vec<Vec<Vec<f64>>>,
    pub(crate) held_out: HeldOut,
    pub(crate) fit: Fit,
}

/// Looks for a law beyond `baseline`.
pub(crate) fn find(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    baseline: &Candidate,
    seen: &HeldOut,
) -> Result<Option<Found>, PredictError> {
    let mut best: Option<Found> = None;
    let mut consider = |found: Option<Found>| {
        if let Some(found) = found
            // A more general kind must be clearly better than a simpler one.
            && best.as_ref().is_none_or(|b| found.held_out.log_score > b.held_out.log_score + LEAST_GAIN)
        {
            best = Some(found);
        }
    };
    consider(sparse(problem, rule, baseline, seen)?);
    if let Some(periodic) = Extended::periodic(problem, &baseline.fit)? {
        consider(extended(problem, rule, baseline, seen, &periodic)?);
    }
    for channel in 0..problem.channels() {
        for variable in 0..problem.recording.variables.len() {
            if let Some(smooth) = Extended::smooth(problem, channel, variable) {
                consider(extended(problem, rule, baseline, seen, &smooth)?);
            }
        }
    }
    Ok(best)
}

fn improves(seen: &HeldOut, law: &HeldOut) -> bool {
    law.log_score - seen.log_score >= LEAST_GAIN
        && law.rmse.iter().zip(&seen.rmse).any(|(with, without)| *with < LEAST_IMPROVEMENT * without)
        && law.rmse.iter().zip(&seen.rmse).all(|(with, without)| *with < 1.1 * without)
}

/// Forward selection among the model's candidate terms, each step judged on unseen data.
fn sparse(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    baseline: &Candidate,
    seen: &HeldOut,
) -> Result<Option<Found>, PredictError> {
    let spec = problem.spec();
    let mut chosen: Vec<usize> = Vec::new();
    let mut current: Option<(Candidate, HeldOut)> = None;
    while chosen.len() < 3 {
        let tried: Vec<(usize, Candidate, HeldOut)> = (0..spec.terms.len())
            .into_par_iter()
            .filter(|t| !chosen.contains(t))
            .filter_map(|t| {
                let terms: Vec<usize> = chosen.iter().copied().chain([t]).collect();
                let near = current.as_ref().map_or(&baseline.fit, |c| &c.0.fit);
                let fitted = candidate(problem, rule, &[], &terms, near, &[]).ok()?;
                let score = held_out(problem, &fitted).ok()?;
                (fitted.ruled_out.is_none() && fitted.evidence.is_finite()).then_some((t, fitted, score))
            })
            .collect();
        let next = tried.into_iter().max_by(|a, b| a.2.log_score.total_cmp(&b.2.log_score));
        let bar = current.as_ref().map_or(seen.log_score, |c| c.1.log_score) + LEAST_GAIN;
        match next {
            Some((t, fitted, score)) if score.log_score > bar => {
                chosen.push(t);
                current = Some((fitted, score));
            }
            _ => break,
        }
    }
    let Some((fitted, score)) = current.filter(|(_, score)| improves(seen, score)) else { return Ok(None) };
    let terms: Vec<&Term> = chosen.iter().map(|&t| &spec.terms[t]).collect();
    let coefficients =
        estimates(problem, &fitted, &terms.iter().map(|t| t.parameter).collect::<Vec<_>>(), &[], rule, false);
    let adds_to = terms[0].adds_to.clone();
    let sum: Vec<String> = terms
        .iter()
        .zip(&coefficients)
        .map(|(t, c)| format!("{:.4e} {} * {}", c.value, c.unit, t.formula))
        .collect();
    let mut variables: Vec<String> = terms.iter().flat_map(|t| t.variables.clone()).collect();
    variables.sort();
    variables.dedup();
    Ok(Some(Found {
        law: Law {
            formula: format!("{} += {}", adds_to.name, sum.join(" + ")),
            kind: "sparse",
            adds_to: (adds_to.name, adds_to.unit),
            variables: variables.into_iter().map(|v| (v, String::new())).collect(),
            coefficients,
            heldout_rmse: compared(problem, seen, &score),
            heldout_log_score_gain: score.log_score - seen.log_score,
        },
        predictions: predictions(problem, &fitted.fit)?,
        held_out: score,
        fit: fitted.fit,
    }))
}

fn compared(problem: &Problem<'_>, before: &HeldOut, after: &HeldOut) -> Vec<(String, f64, f64)> {
    let names = problem.recording.channels.iter().map(|c| c.name.clone());
    names.zip(before.rmse.iter().zip(&after.rmse)).map(|(n, (b, a))| (n, *b, *a)).collect()
}

/// Predictions of a fit, `[run][channel][row]`.
pub(crate) fn predictions(problem: &Problem<'_>, fit: &Fit) -> Result<Vec<Vec<Vec<f64>>>, PredictError> {
    problem
        .recording
        .runs
        .iter()
        .zip(&fit.nuisance)
        .map(|(run, nuisance)| {
            let n = run.len();
            let mut out = vec![0.0; n * problem.channels()];
            problem.model.predict(run, &fit.shared, nuisance, &mut out)?;
            Ok((0..problem.channels()).map(|c| out[c * n..(c + 1) * n].to_vec()).collect())
        })
        .collect()
}

/// A model with an empirical term added to its channels.
struct Extended<'a> {
    inner: &'a dyn Model,
    spec: Spec,
    inner_shared: usize,
    inner_nuisance: usize,
    channels: usize,
    noise_along: Option<usize>,
    term: Added,
}

enum Added {
    /// `a cos(omega s) + b sin(omega s)` with amplitudes of each run and channel; omega shared.
    Periodic,
    /// A polynomial of a variable (scaled to [-1, 1] by centre and half-width) on one channel.
    Smooth { channel: usize, variable: usize, centre: f64, half_width: f64 },
}

impl<'a> Extended<'a> {
    fn new(problem: &Problem<'a>, parameters: Vec<Parameter>, term: Added) -> Self {
        let mut spec = problem.spec().clone();
        // Mechanisms and terms stay in the list so that their parameters stay off.
        let (inner_shared, inner_nuisance) = (spec.count(Scope::Shared), spec.count(Scope::PerRun));
        spec.parameters.extend(parameters);
        Self {
            inner: problem.model,
            spec,
            inner_shared,
            inner_nuisance,
            channels: problem.channels(),
            noise_along: problem.recording.noise_along,
            term,
        }
    }

    /// An oscillation; its frequency starts where the residual's power is largest. None where runs are so short that none would
    /// turn one and a half times.
    fn periodic(problem: &Problem<'a>, fit: &Fit) -> Result<Option<Self>, PredictError> {
        let residual = crate::adequacy::test::residuals(problem, fit)?;
        let span = problem
            .rows
            .iter()
            .flat_map(|r| &r.positions)
            .filter_map(|p| Some(p.last()? - p.first()?))
            .fold(0.0, f64::max);
        let power = |omega: f64| -> f64 {
            let mut total = 0.0;
            for (rows, row) in problem.rows.iter().zip(&residual) {
                for ((positions, y), sigma) in rows.positions.iter().zip(row).zip(&fit.noise.sigma) {
                    let (c, s): (Vec<f64>, Vec<f64>) =
                        positions.iter().map(|p| ((omega * p).cos(), (omega * p).sin())).unzip();
                    let (cc, ss, cs) = (dot(&c, &c), dot(&s, &s), dot(&c, &s));
                    let (yc, ys) = (dot(y, &c), dot(y, &s));
                    let determinant = cc * ss - cs * cs;
                    if determinant > 1e-6 * cc * ss {
                        total += (yc * yc * ss - 2.0 * yc * ys * cs + ys * ys * cc)
                            / determinant
                            / (sigma * sigma);
                    }
                }
            }
            total
        };
        let lowest = std::f64::consts::TAU * 1.5 / span.max(f64::MIN_POSITIVE);
        let highest = std::f64::consts::PI / problem.step;
        if highest <= lowest {
            return Ok(None);
        }
        let steps = (((highest - lowest) * span).max(0.0) as usize).clamp(8, 4000);
        let omegas: Vec<f64> =
            (0..=steps).map(|k| lowest + (highest - lowest) * k as f64 / steps as f64).collect();
        let powers: Vec<f64> = omegas.par_iter().map(|w| power(*w)).collect();
        let start =
            (0..omegas.len()).max_by(|&a, &b| powers[a].total_cmp(&powers[b])).map_or(lowest, |k| omegas[k]);
        let mut parameters = vec![Parameter {
            name: "omega".into(),
            unit: "rad".into(),
            scope: Scope::Shared,
            start,
            lower: 0.5 * lowest,
            upper: highest,
            scale: 1.0 / span.max(f64::MIN_POSITIVE),
        }];
        for c in 0..problem.channels() {
            for part in ["cos", "sin"] {
                parameters.push(Parameter {
                    name: format!("{part}_{c}"),
                    unit: problem.recording.channels[c].unit.clone(),
                    scope: Scope::PerRun,
                    start: 0.0,
                    lower: f64::NEG_INFINITY,
                    upper: f64::INFINITY,
                    // Nuisance parameters have a prior a thousand scales wide: here about the size of the residual.
                    scale: 3e-3 * fit.noise.sigma[c],
                });
            }
        }
        Ok(Some(Self::new(problem, parameters, Added::Periodic)))
    }

    fn smooth(problem: &Problem<'a>, channel: usize, variable: usize) -> Option<Self> {
        let (low, high) = problem
            .recording
            .runs
            .iter()
            .flat_map(|r| &r.inputs[variable])
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let half_width = 0.5 * (high - low);
        if !(half_width > 1e-12 * high.abs().max(low.abs())) {
            return None;
        }
        let quantity = &problem.recording.channels[channel];
        let parameters = (1..=DEGREE + 1)
            .map(|d| Parameter {
                name: format!("c{d}"),
                unit: quantity.unit.clone(),
                scope: Scope::Shared,
                start: 0.0,
                lower: f64::NEG_INFINITY,
                upper: f64::INFINITY,
                scale: 1.0,
            })
            .collect();
        let term = Added::Smooth { channel, variable, centre: 0.5 * (low + high), half_width };
        Some(Self::new(problem, parameters, term))
    }
}

impl Model for Extended<'_> {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        self.inner.predict(run, &shared[..self.inner_shared], &nuisance[..self.inner_nuisance], out)?;
        let n = run.len();
        match &self.term {
            Added::Periodic => {
                let rows: Vec<f64> = match self.noise_along.and_then(|v| run.inputs.get(v)) {
                    Some(column) => column.clone(),
                    None => (0..n).map(|i| i as f64).collect(),
                };
                for (i, position) in rows.iter().enumerate() {
                    let (sin, cos) = (shared[self.inner_shared] * position).sin_cos();
                    for c in 0..self.channels {
                        let at = self.inner_nuisance + 2 * c;
                        out[c * n + i] += nuisance[at] * cos + nuisance[at + 1] * sin;
                    }
                }
            }
            Added::Smooth { channel, variable, centre, half_width } => {
                for (i, v) in run.inputs[*variable].iter().enumerate() {
                    let x = (v - centre) / half_width;
                    let mut power = 1.0;
                    for c in &shared[self.inner_shared..] {
                        power *= x;
                        out[channel * n + i] += c * power;
                    }
                }
            }
        }
        Ok(())
    }

    fn relative_step(&self) -> f64 {
        self.inner.relative_step()
    }

    fn nuisance_start(&self, run: &Run, nuisance: &mut [f64]) {
        self.inner.nuisance_start(run, &mut nuisance[..self.inner_nuisance]);
    }
}

/// Fits an extended model and says what law it is.
fn extended(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    baseline: &Candidate,
    seen: &HeldOut,
    model: &Extended<'_>,
) -> Result<Option<Found>, PredictError> {
    let wide = Problem::new(model, problem.recording.clone());
    let mut near = baseline.fit.clone();
    near.shared.extend_from_slice(&wide.shared.start[model.inner_shared..]);
    for nuisance in &mut near.nuisance {
        nuisance.extend_from_slice(&wide.nuisance.start[model.inner_nuisance..]);
    }
    let Ok(fitted) = candidate(&wide, rule, &[], &[], &near, &[]) else { return Ok(None) };
    let Ok(score) = held_out(&wide, &fitted) else { return Ok(None) };
    if !improves(seen, &score) {
        return Ok(None);
    }
    let added: Vec<usize> =
        (0..wide.shared.index.len()).skip(model.inner_shared).map(|slot| wide.shared.index[slot]).collect();
    let coefficients: Vec<Estimate> = estimates(&wide, &fitted, &added, &[], rule, false);
    let along = match model.noise_along {
        Some(v) => (problem.recording.variables[v].name.clone(), problem.recording.variables[v].unit.clone()),
        None => ("row".into(), String::new()),
    };
    let (formula, kind, adds_to, variables, coefficients) = match &model.term {
        Added::Periodic => {
            let omega = fitted.fit.shared[model.inner_shared];
            let amplitudes: Vec<String> = (0..model.channels)
                .map(|c| {
                    let at = model.inner_nuisance + 2 * c;
                    let mean = fitted
                        .fit
                        .nuisance
                        .iter()
                        .map(|nuisance| nuisance[at].hypot(nuisance[at + 1]))
                        .sum::<f64>()
                        / fitted.fit.nuisance.len() as f64;
                    let channel = &problem.recording.channels[c];
                    format!("{} {mean:.2e} {}", channel.name, channel.unit)
                })
                .collect();
            let coefficients = coefficients
                .into_iter()
                .map(|mut e| {
                    e.name = "omega".into();
                    e.unit = if along.1.is_empty() { "rad".into() } else { format!("rad/{}", along.1) };
                    e
                })
                .collect();
            (
                format!(
                    "measured += A cos({omega:.4} {}) + B sin({omega:.4} {}), A and B of each run; mean amplitude: {}",
                    along.0,
                    along.0,
                    amplitudes.join(", ")
                ),
                "periodic",
                ("measured".to_owned(), String::new()),
                vec![along],
                coefficients,
            )
        }
        Added::Smooth { channel, variable, centre, half_width } => {
            let (quantity, v) =
                (&problem.recording.channels[*channel], &problem.recording.variables[*variable]);
            (
                format!(
                    "{} += an empirical curve of {}: sum of c_k x^k, x = ({} - {centre:.6e}) / {half_width:.6e}",
                    quantity.name, v.name, v.name
                ),
                "smooth",
                (quantity.name.clone(), quantity.unit.clone()),
                vec![(v.name.clone(), v.unit.clone())],
                coefficients,
            )
        }
    };
    Ok(Some(Found {
        law: Law {
            formula,
            kind,
            adds_to,
            variables,
            coefficients,
            heldout_rmse: compared(problem, seen, &score),
            heldout_log_score_gain: score.log_score - seen.log_score,
        },
        predictions: predictions(&wide, &fitted.fit)?,
        held_out: score,
        fit: fitted.fit,
    }))
}
