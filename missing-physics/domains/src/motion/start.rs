//! Where fits begin: states from a run's first rows, effects from the sizes of the motion.

use missing_physics::data::Run;
use missing_physics::model::{Mechanism, Scope, Spec};

use super::effects::Role;
use super::equations::{Equations, Start};
use super::scales::Scales;
use crate::mechanics;

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
    let parameters = &mechanism.parameters;
    let Some(&first) = parameters.first() else { return Vec::new() };
    match role(first) {
        Role::Joint(joint, effect) => {
            let sizes = &scales.joints[joint];
            mechanics::joint_starts(effect, parameters, sizes, sizes.least_yield(scales.step_s))
        }
        Role::Input(input, effect) => {
            mechanics::input_starts(effect, parameters, scales.inputs[input].range, scales.step_s)
        }
        Role::Output(output, effect) => {
            mechanics::output_starts(effect, parameters, scales.outputs[output].range, scales.step_s)
        }
        Role::Overflow(level) => {
            let state = scales.levels[level];
            [0.99, 0.95, 0.9, 0.8, 0.6].map(|f| vec![(first, state[0] + f * (state[1] - state[0]))]).to_vec()
        }
        _ => Vec::new(),
    }
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
