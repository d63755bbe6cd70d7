//! A model with an empirical term added to what it predicts.

use rayon::prelude::*;

use crate::adequacy::linearised::DEGREE;
use crate::data::Run;
use crate::fit::optimum::Fit;
use crate::fit::prediction::residuals;
use crate::linalg::dot;
use crate::model::{Model, Parameter, PredictError, Scope, Spec};
use crate::problem::Problem;

/// A model with an empirical term added to its channels.
pub(crate) struct Extended<'a> {
    inner: &'a dyn Model,
    spec: Spec,
    pub(crate) inner_shared: usize,
    pub(crate) inner_nuisance: usize,
    pub(crate) channels: usize,
    pub(crate) noise_along: Option<usize>,
    pub(crate) term: Added,
}

/// What is added.
pub(crate) enum Added {
    /// `a cos(omega s) + b sin(omega s)` with amplitudes of each run and channel; omega shared.
    Periodic,
    /// A polynomial of a variable (scaled to [-1, 1] by centre and half-width) on one channel.
    Smooth { channel: usize, variable: usize, centre: f64, half_width: f64 },
    /// A power of a variable (over its largest value) by which a channel is multiplied: another exponent than the model has.
    Power { channel: usize, variable: usize, largest: f64 },
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

    /// An oscillation; its frequency starts where the residual's power is largest. None where runs are so short that it would
    /// not turn one and a half times.
    pub(crate) fn periodic(problem: &Problem<'a>, fit: &Fit) -> Result<Option<Self>, PredictError> {
        let span = problem
            .rows
            .iter()
            .flat_map(|r| &r.positions)
            .filter_map(|p| Some(p.last()? - p.first()?))
            .fold(0.0, f64::max);
        let lowest = std::f64::consts::TAU * 1.5 / span.max(f64::MIN_POSITIVE);
        let highest = std::f64::consts::PI / problem.step;
        if highest <= lowest {
            return Ok(None);
        }
        let steps = (((highest - lowest) * span).max(0.0) as usize).clamp(8, 4000);
        let omegas: Vec<f64> =
            (0..=steps).map(|k| lowest + (highest - lowest) * k as f64 / steps as f64).collect();
        let residual = residuals(problem, fit)?;
        let powers: Vec<f64> = omegas.par_iter().map(|w| power(problem, fit, &residual, *w)).collect();
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

    /// A power of a variable by which a channel is multiplied; none where the variable is not positive nearly everywhere, or spans less
    /// than a factor of three.
    pub(crate) fn power(problem: &Problem<'a>, channel: usize, variable: usize) -> Option<Self> {
        let mut values: Vec<f64> =
            problem.recording.runs.iter().flat_map(|r| r.inputs[variable].iter().copied()).collect();
        values.sort_by(f64::total_cmp);
        let largest = *values.last()?;
        let low = values[values.len() / 10];
        if !(low > 0.0 && largest.is_finite() && largest > 3.0 * low) {
            return None;
        }
        let parameters = vec![Parameter {
            name: "exponent".into(),
            unit: String::new(),
            scope: Scope::Shared,
            start: 0.0,
            lower: -3.0,
            upper: 3.0,
            scale: 0.3,
        }];
        Some(Self::new(problem, parameters, Added::Power { channel, variable, largest }))
    }

    /// A smooth curve over a variable on one channel; none where the variable does not vary.
    pub(crate) fn smooth(problem: &Problem<'a>, channel: usize, variable: usize) -> Option<Self> {
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
            Added::Power { channel, variable, largest } => {
                let exponent = shared[self.inner_shared];
                for (i, v) in run.inputs[*variable].iter().enumerate().filter(|(_, v)| **v > 0.0) {
                    out[channel * n + i] *= (v / largest).powf(exponent);
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

/// The sum of squares, in units of the noise, that an oscillation of a frequency takes from a residual; amplitude and phase are of each
/// run and channel.
fn power(problem: &Problem<'_>, fit: &Fit, residual: &[Vec<Vec<f64>>], omega: f64) -> f64 {
    let mut total = 0.0;
    for (rows, row) in problem.rows.iter().zip(residual) {
        for ((positions, y), sigma) in rows.positions.iter().zip(row).zip(&fit.noise.sigma) {
            let (c, s): (Vec<f64>, Vec<f64>) =
                positions.iter().map(|p| ((omega * p).cos(), (omega * p).sin())).unzip();
            let (cc, ss, cs) = (dot(&c, &c), dot(&s, &s), dot(&c, &s));
            let (yc, ys) = (dot(y, &c), dot(y, &s));
            let determinant = cc * ss - cs * cs;
            if determinant > 1e-6 * cc * ss {
                total += (yc * yc * ss - 2.0 * yc * ys * cs + ys * ys * cc) / determinant / (sigma * sigma);
            }
        }
    }
    total
}
