//! A model with an empirical term added to what it predicts.

use rayon::prelude::*;

use crate::adequacy::linearised::DEGREE;
use crate::data::Recording;
use crate::fit::optimum::Fit;
use crate::fit::prediction::residuals;
use crate::law::added::AddedLaw;
use crate::linalg::dot;
use crate::model::{Model, Parameter, PredictError, Quantity, Scope, Spec};
use crate::problem::Problem;
use crate::statistics::median;

/// Degree of a curved scale.
const CURVED: usize = 3;
/// Values that differ by less than this part of the largest have no scale that could be curved.
const LEAST_SPAN: f64 = 0.1;

/// A model with an empirical term added to its channels.
pub(crate) struct Extended<'a> {
    pub(super) inner: &'a dyn Model,
    pub(super) spec: Spec,
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
    /// A polynomial of what is simulated (over its largest size) added to it: a scale that is curved.
    Reading { channel: usize, largest: f64 },
    /// A polynomial of a variable (scaled to [-1, 1] by centre and half-width) on one channel.
    Smooth { channel: usize, variable: usize, centre: f64, half_width: f64 },
    /// A power of a variable (over its largest value) by which a channel is multiplied: another exponent than the model has.
    Power { channel: usize, variable: usize, largest: f64 },
}

impl<'a> Extended<'a> {
    fn new(model: &'a dyn Model, recording: &Recording, parameters: Vec<Parameter>, term: Added) -> Self {
        let mut spec = model.spec().clone();
        // Mechanisms and terms stay in the list so that their parameters stay off.
        let (inner_shared, inner_nuisance) = (spec.count(Scope::Shared), spec.count(Scope::PerRun));
        spec.parameters.extend(parameters);
        Self {
            inner: model,
            spec,
            inner_shared,
            inner_nuisance,
            channels: recording.channels.len(),
            noise_along: recording.noise_along,
            term,
        }
    }

    /// A model with a law that was found before; none where the recording has not its channel or variable.
    pub(crate) fn again(
        model: &'a dyn Model,
        recording: &Recording,
        law: &AddedLaw,
        sigma: &[f64],
    ) -> Option<Self> {
        let at = |list: &[Quantity], name: &str| list.iter().position(|q| q.name == name);
        let place = |channel: &str, variable: &str| {
            Some((at(&recording.channels, channel)?, at(&recording.variables, variable)?))
        };
        let (parameters, term) = match law {
            AddedLaw::Terms { .. } => return None,
            AddedLaw::Power { channel, variable, largest } => {
                let (channel, variable) = place(channel, variable)?;
                (vec![exponent()], Added::Power { channel, variable, largest: *largest })
            }
            AddedLaw::Reading { channel, largest } => {
                let channel = at(&recording.channels, channel)?;
                (
                    curve(&recording.channels[channel].unit, *largest),
                    Added::Reading { channel, largest: *largest },
                )
            }
            AddedLaw::Smooth { channel, variable, centre, half_width } => {
                let (channel, variable) = place(channel, variable)?;
                let (centre, half_width) = (*centre, *half_width);
                let term = Added::Smooth { channel, variable, centre, half_width };
                (powers(&recording.channels[channel].unit), term)
            }
            AddedLaw::Periodic => {
                (oscillation(recording, sigma, [0.0, f64::INFINITY], 1.0, 1.0), Added::Periodic)
            }
        };
        Some(Self::new(model, recording, parameters, term))
    }

    /// The law without its coefficients.
    pub(crate) fn law(&self, recording: &Recording) -> AddedLaw {
        let names = |channel: usize, variable: usize| {
            (recording.channels[channel].name.clone(), recording.variables[variable].name.clone())
        };
        match self.term {
            Added::Periodic => AddedLaw::Periodic,
            Added::Reading { channel, largest } => {
                AddedLaw::Reading { channel: recording.channels[channel].name.clone(), largest }
            }
            Added::Smooth { channel, variable, centre, half_width } => {
                let (channel, variable) = names(channel, variable);
                AddedLaw::Smooth { channel, variable, centre, half_width }
            }
            Added::Power { channel, variable, largest } => {
                let (channel, variable) = names(channel, variable);
                AddedLaw::Power { channel, variable, largest }
            }
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
        let highest = std::f64::consts::PI / measured_step(problem);
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
        let scale = 1.0 / span.max(f64::MIN_POSITIVE);
        let bounds = [lowest, highest];
        let parameters = oscillation(&problem.recording, &fit.noise.sigma, bounds, start, scale);
        Ok(Some(Self::new(problem.model, &problem.recording, parameters, Added::Periodic)))
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
        let term = Added::Power { channel, variable, largest };
        Some(Self::new(problem.model, &problem.recording, vec![exponent()], term))
    }

    /// A curved scale of one channel, whose values a fit has simulated; none where these hardly differ.
    pub(crate) fn reading(
        problem: &Problem<'a>,
        channel: usize,
        simulated: &[Vec<Vec<f64>>],
    ) -> Option<Self> {
        let values = simulated.iter().flat_map(|run| &run[channel]).filter(|v| v.is_finite());
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let largest = high.abs().max(low.abs());
        if !(high - low > LEAST_SPAN * largest) {
            return None;
        }
        let parameters = curve(&problem.recording.channels[channel].unit, largest);
        let term = Added::Reading { channel, largest };
        Some(Self::new(problem.model, &problem.recording, parameters, term))
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
        let parameters = powers(&problem.recording.channels[channel].unit);
        let term = Added::Smooth { channel, variable, centre: 0.5 * (low + high), half_width };
        Some(Self::new(problem.model, &problem.recording, parameters, term))
    }
}

/// The shortest, of all channels, median step between measured rows: what oscillates faster than twice in it is the alias of something
/// slower.
fn measured_step(problem: &Problem<'_>) -> f64 {
    let of_channel = |channel: usize| {
        let gaps = problem.rows.iter().flat_map(|r| r.positions[channel].windows(2).map(|w| w[1] - w[0]));
        median(&mut gaps.filter(|gap| *gap > 0.0).collect::<Vec<f64>>())
    };
    (0..problem.channels()).filter_map(of_channel).fold(f64::INFINITY, f64::min)
}

/// A shared parameter that starts at zero and is free in both directions up to a bound.
fn free(name: String, unit: &str, scale: f64, bound: f64) -> Parameter {
    let unit = unit.to_owned();
    Parameter { name, unit, scope: Scope::Shared, start: 0.0, lower: -bound, upper: bound, scale }
}

/// The frequency of an oscillation, shared, and its amplitudes on each channel of each run.
fn oscillation(
    recording: &Recording,
    sigma: &[f64],
    [lower, upper]: [f64; 2],
    start: f64,
    scale: f64,
) -> Vec<Parameter> {
    let mut parameters = vec![Parameter { start, lower, upper, ..free("omega".into(), "rad", scale, 0.0) }];
    for (c, (channel, sigma)) in recording.channels.iter().zip(sigma).enumerate() {
        for part in ["cos", "sin"] {
            // Nuisance parameters have a prior a thousand scales wide: here about the size of the residual.
            let amplitude = free(format!("{part}_{c}"), &channel.unit, 3e-3 * sigma, f64::INFINITY);
            parameters.push(Parameter { scope: Scope::PerRun, ..amplitude });
        }
    }
    parameters
}

/// By how much the exponent of a variable is larger.
fn exponent() -> Parameter {
    free("exponent".into(), "", 0.3, 3.0)
}

/// Coefficients of a curved scale: none changes the largest reading by more than half.
fn curve(unit: &str, largest: f64) -> Vec<Parameter> {
    (1..=CURVED).map(|d| free(format!("c{d}"), unit, 0.1 * largest, 0.5 * largest)).collect()
}

/// Coefficients of a polynomial without its constant.
fn powers(unit: &str) -> Vec<Parameter> {
    (1..=DEGREE + 1).map(|d| free(format!("c{d}"), unit, 1.0, f64::INFINITY)).collect()
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
