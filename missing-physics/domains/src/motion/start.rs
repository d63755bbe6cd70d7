//! Where fits begin: states from a run's first rows, effects from the sizes of the motion.

use joint_laws::{Dual, Number};
use missing_physics::data::Run;
use missing_physics::model::{Mechanism, Spec};
use nalgebra::{DMatrix, DVector};

use super::effects::Role;
use super::equations::{Equations, Output, Start, State};
use super::scales::{Scales, range};
use crate::mechanics;

/// Values of unknown states from which those that give an output its first rows are sought.
const STARTS: [f64; 5] = [0.0, 1.0, -1.0, 0.1, -0.1];
/// Steps of that search.
const ITERATIONS: usize = 30;
/// Squares of what outputs miss their first rows by, in parts of their ranges, at which it ends.
const FOUND: f64 = 1e-12;

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
    by_outputs(equations, run, &mut known);
    for (slot, value) in free.iter().zip(known) {
        if let (Some(slot), Some(value)) = (slot, value) {
            nuisance[*slot] = value;
        }
    }
}

/// Fills in states that are not known yet and that outputs depend on: those at which the outputs have the value and the slope of their first
/// rows (Levenberg-Marquardt, from a few starts).
fn by_outputs(equations: &Equations, run: &Run, known: &mut [Option<f64>]) {
    let unknown: Vec<usize> = (0..known.len()).filter(|&k| known[k].is_none()).collect();
    let tells = |c: &usize| {
        let Output { expression, state, .. } = &equations.outputs[*c];
        let by_rate = |(s, state): (usize, &State)| {
            expression.has(equations.rate_name(s)) && unknown.iter().any(|&k| state.rate.has(k))
        };
        let by_itself = || unknown.iter().any(|&k| expression.has(k));
        state.is_none() && (by_itself() || equations.states.iter().enumerate().any(by_rate))
    };
    let Some(&begin) = run.inputs[0].first() else { return };
    let first_rows = |c: usize| {
        let column = &run.outputs[c];
        let [low, high] = range(column.iter().copied());
        let [value, slope] = beginning(&run.inputs[0], column)?;
        let rises = (high - low) / (run.inputs[0][run.len() - 1] - begin);
        (high > low).then_some((c, [value, slope], [high - low, slope.abs().max(rises)]))
    };
    let begins: Vec<_> = (0..equations.outputs.len()).filter(tells).filter_map(first_rows).collect();
    if begins.is_empty() {
        return;
    }
    let mut values: Vec<f64> = known.iter().map(|state| state.unwrap_or(0.0)).collect();
    values.extend(run.inputs[1..].iter().map(|column| column[0]));
    values.extend(equations.parameters.iter().map(|p| p.start_of(&run.label).unwrap_or(p.value)));
    values.push(begin);
    let missed = |at: &DVector<f64>| -> DVector<f64> {
        let mut names = values.clone();
        unknown.iter().zip(at.iter()).for_each(|(&state, value)| names[state] = *value);
        let names: Vec<Dual<1>> = names.into_iter().map(Dual::from).collect();
        // Along the motion: the derivatives of the outputs are their slopes.
        let mut names_along = names.clone();
        for (along, rate) in names_along.iter_mut().zip(rates(equations, &names)) {
            along.eps = [rate.re];
        }
        let mut seen = vec![Dual::<1>::from(0.0); equations.readings.registers()];
        let rates_along = rates(equations, &names_along);
        seen.iter_mut()
            .zip(names_along.into_iter().chain(rates_along))
            .for_each(|(seen, value)| *seen = value);
        equations.readings.prepare(&mut seen);
        equations.readings.run(&mut seen);
        let of_output = |(c, [value, slope], [size, steep]): &(usize, [f64; 2], [f64; 2])| {
            let read = equations.readings.result(&seen, *c);
            [(read.re - value) / size, (read.eps[0] - slope) / steep]
        };
        DVector::from_iterator(2 * begins.len(), begins.iter().flat_map(of_output))
    };
    let found = STARTS.iter().map(|start| fitted(&missed, DVector::from_element(unknown.len(), *start)));
    let mut best: Option<(f64, DVector<f64>)> = None;
    for (squares, at) in found {
        if squares.is_finite() && best.as_ref().is_none_or(|(least, _)| squares < *least) {
            best = Some((squares, at));
        }
        if best.as_ref().is_some_and(|(least, _)| *least < FOUND) {
            break;
        }
    }
    if let Some((_, at)) = best {
        unknown.iter().zip(at.iter()).for_each(|(&state, value)| known[state] = Some(*value));
    }
}

/// The states' derivatives where names of the equations have these values.
pub(super) fn rates<T: Number>(equations: &Equations, names: &[T]) -> Vec<T> {
    let mut registers = vec![T::from(0.0); equations.rates.registers()];
    registers[..names.len()].copy_from_slice(names);
    equations.rates.prepare(&mut registers);
    equations.rates.run(&mut registers);
    (0..equations.states.len()).map(|state| equations.rates.result(&registers, state)).collect()
}

/// Where the squares of what is missed are least, from a start, and their sum there.
fn fitted(missed: &impl Fn(&DVector<f64>) -> DVector<f64>, mut at: DVector<f64>) -> (f64, DVector<f64>) {
    let mut left = missed(&at);
    let mut damping = 1e-3;
    for _ in 0..ITERATIONS {
        let mut jacobian = DMatrix::zeros(left.len(), at.len());
        for k in 0..at.len() {
            let step = 1e-6 * at[k].abs().max(1.0);
            let there = |to: f64| {
                let mut there = at.clone();
                there[k] += to;
                missed(&there)
            };
            jacobian.set_column(k, &((there(step) - there(-step)) / (2.0 * step)));
        }
        let (mut normal, gradient) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&left));
        // What nothing tells of stays where it is.
        (0..at.len()).for_each(|k| normal[(k, k)] += damping * normal[(k, k)] + f64::MIN_POSITIVE.sqrt());
        let Some(step) = normal.cholesky().map(|normal| normal.solve(&gradient)) else { break };
        let there = &at - step;
        let now = missed(&there);
        if now.norm_squared() < left.norm_squared() {
            (at, left) = (there, now);
            damping *= 0.1;
        } else {
            damping *= 10.0;
        }
        if left.norm_squared() < FOUND {
            break;
        }
    }
    (left.norm_squared(), at)
}

/// Value and slope at a column's first row, by a parabola through its first rows.
pub(super) fn beginning(times: &[f64], column: &[f64]) -> Option<[f64; 2]> {
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
    let parameters = &mechanism.parameters;
    let Some(&first) = parameters.first().filter(|_| !mechanism.between_runs) else { return Vec::new() };
    match roles[spec.slots()[first]] {
        Role::Joint(joint, effect) => {
            let sizes = &scales.joints[joint];
            mechanics::joint_starts(effect, parameters, sizes)
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
