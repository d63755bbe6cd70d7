//! Where fits of a mechanism begin: lists of shared parameters, by their indices, with values.

use std::f64::consts::FRAC_PI_2;

use super::{InputEffect, JointEffect, JointSizes, OutputEffect};

/// Starts.
type Starts = Vec<Vec<(usize, f64)>>;

/// Starts of a joint's mechanism with these parameters, the first of which is `effect`.
pub(crate) fn joint_starts(effect: JointEffect, parameters: &[usize], s: &JointSizes) -> Starts {
    let Some(&first) = parameters.first() else { return Vec::new() };
    let (force, [low, high]) = (s.force, s.range);
    match effect {
        JointEffect::Coulomb | JointEffect::Asymmetry | JointEffect::Constant => {
            [1e-3, 0.01, 0.1, 0.4].map(|f| vec![(first, f * force)]).to_vec()
        }
        JointEffect::StribeckLevel => [0.01, 0.05, 0.3]
            .iter()
            .flat_map(|v| [3e-3, 0.05, 0.3].map(|f| vec![(first, f * force), (parameters[1], v * s.speed)]))
            .collect(),
        JointEffect::LoadFraction => [0.05, 0.3].map(|f| vec![(first, f)]).to_vec(),
        // In proportion to its amplitude, a wave of any phase is a sum of these two: the better one leads to it.
        JointEffect::CogAmplitude => (1..=s.periods().map_or(0, |most| most.min(24.0) as u32))
            .flat_map(|n| {
                [0.5, 0.5 + FRAC_PI_2].map(|phase| {
                    vec![(first, 0.02 * force), (parameters[1], phase), (parameters[2], f64::from(n))]
                })
            })
            .collect(),
        JointEffect::Gap => [0.003, 0.01, 0.03, 0.1].map(|f| vec![(first, f * (high - low))]).to_vec(),
        JointEffect::StopPosition => [0.99, 0.95, 0.88, 0.75, 0.01, 0.05, 0.12, 0.25]
            .iter()
            .flat_map(|at| {
                [3.0, 30.0]
                    .map(|k| vec![(first, low + at * (high - low)), (parameters[1], k * force / s.reach)])
            })
            .collect(),
        JointEffect::YieldStiffness => (s.yields().iter())
            .flat_map(|&[least, most]| {
                [3e-3, 0.02, 0.1, 0.4].map(|y| (y * s.reach.min(most)).clamp(least, 0.9 * most))
            })
            .map(|y| vec![(first, 0.05 * force / y), (parameters[1], y)])
            .collect(),
        _ => Vec::new(),
    }
}

/// Starts of an input's mechanism with these parameters, the first of which is `effect`.
pub(crate) fn input_starts(
    effect: InputEffect,
    parameters: &[usize],
    range: [f64; 2],
    step_s: f64,
) -> Starts {
    match (effect, parameters) {
        (InputEffect::Delay | InputEffect::Lag, [first, ..]) => late(*first, step_s),
        (InputEffect::Upper, [upper, lower, ..]) => two_bounds([*upper, *lower], range, &[0.03, 0.12, 0.3]),
        (InputEffect::DeadZone, [first, ..]) => {
            let most = range[0].abs().max(range[1].abs());
            [0.01, 0.05, 0.15, 0.4].map(|f| vec![(*first, f * most)]).to_vec()
        }
        _ => Vec::new(),
    }
}

/// Starts of an output's mechanism with these parameters, the first of which is `effect`.
pub(crate) fn output_starts(
    effect: OutputEffect,
    parameters: &[usize],
    range: [f64; 2],
    step_s: f64,
) -> Starts {
    match (effect, parameters) {
        (OutputEffect::Delay | OutputEffect::Lag, [first, ..]) => late(*first, step_s),
        // A bound of readings has been seen where it is one.
        (OutputEffect::Upper, [upper, lower, ..]) => {
            two_bounds([*upper, *lower], range, &[0.0, 0.03, 0.12, 0.3])
        }
        _ => Vec::new(),
    }
}

/// Delays and lags of a few rows.
fn late(parameter: usize, step_s: f64) -> Starts {
    [0.5, 2.0, 8.0, 30.0].map(|rows| vec![(parameter, rows * step_s)]).to_vec()
}

/// One bound, the other, or both, by these parts of a range within it.
fn two_bounds([upper, lower]: [usize; 2], [low, high]: [f64; 2], parts: &[f64]) -> Starts {
    let span = high - low;
    let at = |part: &f64| {
        let (above, below) = ((upper, high - part * span), (lower, low + part * span));
        [vec![above], vec![below], vec![above, below]]
    };
    parts.iter().flat_map(at).collect()
}
