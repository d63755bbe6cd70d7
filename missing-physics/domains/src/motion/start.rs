//! Where fits begin: states from a run's first rows, effects from the sizes of the motion.

use missing_physics::data::Run;
use missing_physics::model::{Mechanism, Scope, Spec};

use super::effects::{OfInput, OfJoint, OfOutput, Role};
use super::equations::{Equations, Start};
use super::scales::Scales;

/// Fills in the free states at a run's start (of which the recording may know some): what is measured as it stands from the first rows, its derivative from their slope.
pub(super) fn states(
    equations: &Equations,
    run: &Run,
    knows: bool,
    free: &[Option<usize>],
    nuisance: &mut [f64],
) {
    let stated = |start: Start| if let Start::Known(v) = start { Some(v).filter(|_| knows) } else { None };
    let mut known: Vec<Option<f64>> = equations.states.iter().map(|s| stated(s.start)).collect();
    for (c, output) in equations.outputs.iter().enumerate() {
        let Some(state) = output.state else { continue };
        let Some([value, slope]) = beginning(&run.inputs[0], &run.outputs[c]) else { continue };
        known[state].get_or_insert(value);
        if let Some(rate) = equations.states[state].rate.bare_name().filter(|r| *r < known.len())
            && equations.outputs.iter().all(|o| o.state != Some(rate))
        {
            known[rate].get_or_insert(slope);
        }
    }
    for (slot, value) in free.iter().zip(known) {
        if let (Some(slot), Some(value)) = (slot, value) {
            nuisance[*slot] = value;
        }
    }
}

/// Value and slope at a column's first row, by a parabola through its first rows.
fn beginning(times: &[f64], column: &[f64]) -> Option<[f64; 2]> {
    let rows: Vec<(f64, f64)> = times
        .iter()
        .zip(column)
        .filter(|(_, v)| v.is_finite())
        .map(|(t, v)| (t - times[0], *v))
        .take((times.len() / 40).clamp(6, 24))
        .collect();
    let last = rows.last()?.0;
    if rows.len() < 3 || last <= 0.0 {
        return rows.first().map(|r| [r.1, 0.0]);
    }
    let terms = |t: f64| nalgebra::Vector3::new(1.0, t / last, (t / last).powi(2));
    let (mut a, mut b) = (nalgebra::Matrix3::<f64>::zeros(), nalgebra::Vector3::<f64>::zeros());
    for (t, v) in rows {
        let row = terms(t);
        a += row * row.transpose();
        b += row * v;
    }
    let fit = a.cholesky()?.solve(&b);
    Some([fit[0], fit[1] / last])
}

/// Starts of a mechanism's fit, as lists of shared parameters with their values.
pub(super) fn mechanism(
    mechanism: &Mechanism,
    spec: &Spec,
    roles: &[Role],
    scales: &Scales,
) -> Vec<Vec<(usize, f64)>> {
    let slots = slots(spec);
    let role = |index: usize| roles[slots[index]];
    let own = &mechanism.parameters;
    let Some(&first) = own.first() else { return Vec::new() };
    match role(first) {
        Role::Joint(joint, what) => {
            let s = &scales.joints[joint];
            let (force, [low, high]) = (s.acceleration, s.range);
            match what {
                OfJoint::Coulomb | OfJoint::Asymmetry | OfJoint::Constant => {
                    [1e-3, 0.01, 0.1, 0.4].map(|f| vec![(first, f * force)]).to_vec()
                }
                OfJoint::StribeckLevel => [0.01, 0.05, 0.3]
                    .iter()
                    .flat_map(|v| [3e-3, 0.05, 0.3].map(|f| vec![(first, f * force), (own[1], v * s.speed)]))
                    .collect(),
                OfJoint::LoadFraction => [0.05, 0.3].map(|f| vec![(first, f)]).to_vec(),
                // In proportion to its amplitude, a wave of any phase is a sum of these two: the better one leads to it.
                OfJoint::CogAmplitude => (1..=24)
                    .flat_map(|n| {
                        [0.5, 0.5 + std::f64::consts::FRAC_PI_2]
                            .map(|phase| vec![(first, 0.02 * force), (own[1], phase), (own[2], f64::from(n))])
                    })
                    .collect(),
                OfJoint::Gap => [0.003, 0.01, 0.03, 0.1].map(|f| vec![(first, f * (high - low))]).to_vec(),
                OfJoint::StopPosition => [0.99, 0.95, 0.88, 0.75, 0.01, 0.05, 0.12, 0.25]
                    .iter()
                    .flat_map(|at| {
                        [3.0, 30.0]
                            .map(|k| vec![(first, low + at * (high - low)), (own[1], k * force / s.reach)])
                    })
                    .collect(),
                OfJoint::YieldStiffness => [3e-3, 0.02, 0.1, 0.4]
                    .iter()
                    .map(|y| (y * s.reach).max(s.least_yield(scales.step_s)))
                    .map(|y| vec![(first, 0.05 * force / y), (own[1], y)])
                    .collect(),
                _ => Vec::new(),
            }
        }
        Role::Input(input, what) => {
            let [low, high] = scales.inputs[input].range;
            match what {
                OfInput::Delay | OfInput::Lag => late(first, scales),
                OfInput::Upper => bounds(first, own[1], low, high),
                OfInput::DeadZone => {
                    let most = low.abs().max(high.abs());
                    [0.01, 0.05, 0.15, 0.4].map(|f| vec![(first, f * most)]).to_vec()
                }
                _ => Vec::new(),
            }
        }
        Role::Output(output, what) => {
            let [low, high] = scales.outputs[output].range;
            match what {
                OfOutput::Delay | OfOutput::Lag => late(first, scales),
                OfOutput::Upper => bounds(first, own[1], low, high),
                _ => Vec::new(),
            }
        }
        Role::Overflow(level) => {
            let state = scales.levels[level];
            [0.99, 0.95, 0.9, 0.8, 0.6].map(|f| vec![(first, state[0] + f * (state[1] - state[0]))]).to_vec()
        }
        _ => Vec::new(),
    }
}

/// Delays and lags of a few rows.
fn late(parameter: usize, scales: &Scales) -> Vec<Vec<(usize, f64)>> {
    [0.5, 2.0, 8.0, 30.0].map(|rows| vec![(parameter, rows * scales.step_s)]).to_vec()
}

/// One bound, the other, or both within a range.
fn bounds(upper: usize, lower: usize, low: f64, high: f64) -> Vec<Vec<(usize, f64)>> {
    let span = high - low;
    [0.03, 0.12, 0.3]
        .iter()
        .flat_map(|cut| {
            let (above, below) = ((upper, high - cut * span), (lower, low + cut * span));
            [vec![above], vec![below], vec![above, below]]
        })
        .collect()
}

/// The slot of each shared parameter by its index.
fn slots(spec: &Spec) -> Vec<usize> {
    let mut next = 0;
    spec.parameters
        .iter()
        .map(|p| {
            let slot = next;
            next += usize::from(p.scope == Scope::Shared);
            slot
        })
        .collect()
}
