//! Laws of an extended model: fitted, judged and put into words.

use nalgebra::DVector;

use crate::diagnosis::{Estimate, Law};
use crate::estimate::estimates::estimates;
use crate::fit::optimum::{Fit, covariance};
use crate::fit::prediction::predictions;
use crate::law::extended::{Added, Extended};
use crate::law::found::{Found, LEAST_GAIN, compared, improves};
use crate::model::{Parameter, PredictError};
use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::repaired::Repaired;
use crate::selection::candidate::{Candidate, candidate};
use crate::selection::held_out::{HeldOut, held_out};

/// Fits an extended model and says what law it is.
pub(crate) fn extended(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    start: &Candidate,
    seen: &HeldOut,
    model: &Extended<'_>,
) -> Result<Option<Found>, PredictError> {
    let wide = Problem::new(model, problem.recording.clone());
    let mut near = start.fit.clone();
    near.shared.extend_from_slice(&wide.shared.start[model.inner_shared..]);
    for nuisance in &mut near.nuisance {
        nuisance.extend_from_slice(&wide.nuisance.start[model.inner_nuisance..]);
    }
    // What is added is off at first, and the rest where it was without it.
    let Ok(fitted) = candidate(&wide, rule, &start.set, &[], &near, &[vec![]]) else { return Ok(None) };
    // At a bound a law is a part of another one.
    if fitted.fit.at_bound.iter().any(|slot| *slot >= model.inner_shared) {
        return Ok(None);
    }
    if !departs(&fitted, model.inner_shared) {
        return Ok(None);
    }
    let Ok(score) = held_out(&wide, &fitted) else { return Ok(None) };
    if !improves(seen, &score) {
        return Ok(None);
    }
    let added: Vec<usize> =
        (0..wide.shared.index.len()).skip(model.inner_shared).map(|slot| wide.shared.index[slot]).collect();
    let coefficients = estimates(&wide, &fitted, &added, &[], rule, false);
    // Of a coefficient that may have any value nothing is known.
    let open = |(e, &p): (&Estimate, &usize)| {
        let Parameter { lower, upper, .. } = wide.spec().parameters[p];
        e.ci95[0] <= lower && upper <= e.ci95[1]
    };
    if coefficients.iter().zip(&added).any(open) {
        return Ok(None);
    }
    let (heldout_rmse, gain) = (compared(problem, seen, &score), score.log_score - seen.log_score);
    let law = Law {
        heldout_rmse,
        heldout_log_score_gain: gain,
        ..match &model.term {
            Added::Periodic => periodic(problem, model, &fitted.fit, coefficients),
            Added::Reading { channel, largest } => reading(problem, *channel, *largest, coefficients),
            Added::Smooth { channel, variable, centre, half_width } => {
                smooth(problem, *channel, *variable, [*centre, *half_width], coefficients)
            }
            Added::Power { channel, variable, largest } => {
                power(problem, *channel, *variable, *largest, coefficients)
            }
        }
    };
    let predictions = predictions(&wide, &fitted.fit)?;
    let repaired = Repaired { law: Some(model.law(&problem.recording)), ..Repaired::of(&wide, &fitted) };
    Ok(Some(Found { law, predictions, held_out: score, fit: fitted.fit, repaired, of_terms: None }))
}

/// Whether what was added, off where its parameters are zero, is known to be there: all of them together, by Wald's statistic. Of what has its
/// amplitudes in each run evidence alone says so.
fn departs(fitted: &Candidate, first: usize) -> bool {
    let (fit, selection) = (&fitted.fit, &fitted.selection);
    let at: Vec<usize> = (0..selection.shared.len()).filter(|&i| selection.shared[i] >= first).collect();
    let values = DVector::from_iterator(at.len(), at.iter().map(|&i| fit.shared[selection.shared[i]]));
    let of_them = covariance(&fit.information).select_rows(&at).select_columns(&at);
    // Errors without bounds are those of what is not known at all.
    let statistic = of_them.cholesky().map(|factor| values.dot(&factor.solve(&values)));
    statistic.is_some_and(|statistic| statistic > 2.0 * LEAST_GAIN)
}

/// An oscillation in words.
fn periodic(problem: &Problem<'_>, model: &Extended<'_>, fit: &Fit, coefficients: Vec<Estimate>) -> Law {
    let omega = fit.shared[model.inner_shared];
    let amplitude = |c: usize| {
        let at = model.inner_nuisance + 2 * c;
        let of_runs = fit.nuisance.iter().map(|nuisance| nuisance[at].hypot(nuisance[at + 1]));
        let mean = of_runs.sum::<f64>() / fit.nuisance.len() as f64;
        let channel = &problem.recording.channels[c];
        format!("{} {mean:.2e} {}", channel.name, channel.unit)
    };
    let amplitudes: Vec<String> = (0..model.channels).map(amplitude).collect();
    let (along, unit) = match model.noise_along {
        Some(v) => (problem.recording.variables[v].name.clone(), problem.recording.variables[v].unit.clone()),
        None => ("row".into(), String::new()),
    };
    let named = |e: Estimate| Estimate {
        name: "omega".into(),
        unit: if unit.is_empty() { "rad".into() } else { format!("rad/{unit}") },
        ..e
    };
    Law {
        formula: format!(
            "measured += A cos({omega:.4} {along}) + B sin({omega:.4} {along}), A and B of each run; mean amplitude: {}",
            amplitudes.join(", ")
        ),
        kind: "periodic",
        beside: Vec::new(),
        adds_to: ("measured".to_owned(), String::new()),
        coefficients: coefficients.into_iter().map(named).collect(),
        variables: vec![(along, unit)],
        heldout_rmse: Vec::new(),
        heldout_log_score_gain: 0.0,
        p_value: None,
    }
}

/// A power in words.
fn power(
    problem: &Problem<'_>,
    channel: usize,
    variable: usize,
    largest: f64,
    coefficients: Vec<Estimate>,
) -> Law {
    let (quantity, v) = (&problem.recording.channels[channel], &problem.recording.variables[variable]);
    let exponent = coefficients.first().map_or(f64::NAN, |e| e.value);
    Law {
        formula: format!("{} *= ({} / {} {})^{exponent:.3}", quantity.name, v.name, number(largest), v.unit),
        kind: "power",
        beside: Vec::new(),
        adds_to: (quantity.name.clone(), quantity.unit.clone()),
        variables: vec![(v.name.clone(), v.unit.clone())],
        coefficients,
        heldout_rmse: Vec::new(),
        heldout_log_score_gain: 0.0,
        p_value: None,
    }
}

/// A curved scale in words.
fn reading(problem: &Problem<'_>, channel: usize, largest: f64, coefficients: Vec<Estimate>) -> Law {
    let quantity = &problem.recording.channels[channel];
    // Three digits of the largest; each coefficient is what its term adds to the largest reading.
    let most = coefficients.iter().map(|c| c.value.abs()).fold(f64::MIN_POSITIVE, f64::max);
    let digits = (2.0 - most.log10().floor()).clamp(0.0, 15.0) as usize;
    let power = |k: usize| if k == 0 { "x".to_owned() } else { format!("x^{}", k + 1) };
    let sum: Vec<String> =
        coefficients.iter().enumerate().map(|(k, c)| format!("{:.digits$} {}", c.value, power(k))).collect();
    Law {
        formula: format!(
            "{} += {} {}, x = (its simulated value) / {largest:.4} {}",
            quantity.name,
            sum.join(" + ").replace("+ -", "- "),
            quantity.unit,
            quantity.unit
        ),
        kind: "reading",
        beside: Vec::new(),
        adds_to: (quantity.name.clone(), quantity.unit.clone()),
        variables: vec![(quantity.name.clone(), quantity.unit.clone())],
        coefficients,
        heldout_rmse: Vec::new(),
        heldout_log_score_gain: 0.0,
        p_value: None,
    }
}

/// A smooth curve in words.
fn smooth(
    problem: &Problem<'_>,
    channel: usize,
    variable: usize,
    [centre, half_width]: [f64; 2],
    coefficients: Vec<Estimate>,
) -> Law {
    let (quantity, v) = (&problem.recording.channels[channel], &problem.recording.variables[variable]);
    Law {
        formula: format!(
            "{} += an empirical curve of {}: sum of c_k x^k, x = ({} - {}) / {}",
            quantity.name,
            v.name,
            v.name,
            number(centre),
            number(half_width)
        ),
        kind: "smooth",
        beside: Vec::new(),
        adds_to: (quantity.name.clone(), quantity.unit.clone()),
        variables: vec![(v.name.clone(), v.unit.clone())],
        coefficients,
        heldout_rmse: Vec::new(),
        heldout_log_score_gain: 0.0,
        p_value: None,
    }
}

/// A number with five digits, without an exponent where that reads well.
pub(crate) fn number(value: f64) -> String {
    let rounded = format!("{value:.4e}");
    match rounded.parse::<f64>() {
        Ok(plain) if (1e-4..1e6).contains(&plain.abs()) => plain.to_string(),
        _ => rounded,
    }
}
