//! What a force, a resistance or a flow does that acts at some rows only; and the positions and speeds along which it may act.

use joint_laws::integrate::{Machine as _, Point};
use missing_physics::data::Run;
use missing_physics::model::{LocalCauses, LocalUnknown, PredictError, Quantity};
use nalgebra::{DMatrix, DVector};

use super::equations::Joint;
use super::model::MotionModel;
use super::units;

/// A step in a state, in parts of its size, at which the change of a derivative is asked for.
const STEP: f64 = 1e-5;
/// Terms of the exponential series by which a deviation is followed from row to row.
const TERMS: usize = 4;

/// The motion's linearisation at a row.
struct Linear {
    /// How a deviation of the states changes their derivatives, and the outputs.
    rates: DMatrix<f64>,
    outputs: DMatrix<f64>,
    /// How what may be acted on changes the derivatives, and at once the outputs that read these.
    pushes: Vec<DVector<f64>>,
    felt: Vec<Vec<f64>>,
    /// The states.
    states: Vec<f64>,
}

/// How a deviation of the states goes on from row to row, and what it does to the outputs.
struct Propagation {
    states: usize,
    /// Row by row, for each half of the time since the row before: what a deviation becomes, state by state, and last what a unit of the
    /// amount adds.
    halves: Vec<[Vec<f64>; 2]>,
    /// Row by row, what the outputs read of a deviation, output by output, and of a unit of the amount itself.
    outputs: Vec<Vec<f64>>,
    felt: Vec<Vec<f64>>,
}

impl Propagation {
    /// Under a unit of what may be acted on.
    fn new(run: &Run, linear: &[Linear], acted_on: usize) -> Self {
        let states = linear.first().map_or(0, |first| first.states.len());
        let half = |at: &Linear, time_s: f64| -> Vec<f64> {
            let (mut all, mut push) = (DMatrix::identity(states, states), DVector::zeros(states));
            let mut term = DMatrix::identity(states, states) * time_s;
            for k in 1..=TERMS {
                push += &term * &at.pushes[acted_on];
                let next = &at.rates * &term;
                all += &next;
                term = next * (time_s / (k + 1) as f64);
            }
            (0..states)
                .flat_map(|i| all.row(i).iter().copied().chain([push[i]]).collect::<Vec<_>>())
                .collect()
        };
        let halves = |row: usize| {
            let half_s = 0.5 * (run.inputs[0][row] - run.inputs[0][row - 1]);
            [half(&linear[row - 1], half_s), half(&linear[row], half_s)]
        };
        let outputs =
            |at: &Linear| at.outputs.row_iter().flat_map(|r| r.iter().copied().collect::<Vec<_>>()).collect();
        Self {
            states,
            halves: (1..linear.len()).map(halves).collect(),
            outputs: linear.iter().map(outputs).collect(),
            felt: linear.iter().map(|at| at.felt[acted_on].clone()).collect(),
        }
    }

    /// What an amount at each row does to each of so many outputs, channel after channel.
    fn deviation(&self, amounts: &[f64], outputs: usize) -> Vec<f64> {
        let n = amounts.len();
        let mut out = vec![0.0; outputs * n];
        let Some(first) = amounts.iter().position(|a| *a != 0.0) else { return out };
        let (mut deviation, mut before) = (vec![0.0; self.states], vec![0.0; self.states]);
        for row in first..n {
            let halves = row.checked_sub(1).map_or(&[][..], |before| &self.halves[before]);
            for (half, amount) in halves.iter().zip([amounts[row.saturating_sub(1)], amounts[row]]) {
                before.copy_from_slice(&deviation);
                for (to, weights) in deviation.iter_mut().zip(half.chunks(self.states + 1)) {
                    let (of_states, of_amount) = weights.split_at(self.states);
                    *to = of_states.iter().zip(&before).map(|(w, d)| w * d).sum::<f64>()
                        + of_amount[0] * amount;
                }
            }
            for (c, (weights, felt)) in self.outputs[row].chunks(self.states).zip(&self.felt[row]).enumerate()
            {
                let of_states = weights.iter().zip(&deviation).map(|(w, d)| w * d);
                out[c * n + row] = of_states.sum::<f64>() + felt * amounts[row];
            }
        }
        out
    }
}

impl MotionModel {
    /// The states that an unknown acts on through their derivative: of each joint its velocity, and of each level itself.
    fn acted_on(&self) -> Vec<(Quantity, usize)> {
        let equations = self.equations();
        let quantity = |what: &str, name: &str, several: bool, state: usize| {
            let name = if several { format!("{what}_on_{name}") } else { what.to_owned() };
            Quantity::new(name, units::text_of_rate(&equations.states[state].name))
        };
        let several = equations.joints.len() > 1;
        let joints =
            equations.joints.iter().map(|j| (quantity("force", &j.name, several, j.velocity), j.velocity));
        let several = equations.levels.len() > 1;
        let flow =
            |&level: &usize| (quantity("inflow", &equations.states[level].name, several, level), level);
        joints.chain(equations.levels.iter().map(flow)).collect()
    }

    /// The states along which a cause may act, and the outputs that measure them as they stand.
    fn places(&self) -> Vec<(usize, Option<usize>)> {
        let equations = self.equations();
        let of_joints = equations.joints.iter().flat_map(|j| [j.position, j.velocity]);
        let mut states: Vec<usize> = of_joints.chain(equations.levels.iter().copied()).collect();
        states.sort_unstable();
        states.dedup();
        let measured = |state| equations.outputs.iter().position(|o| o.state == Some(state));
        states.into_iter().map(|state| (state, measured(state))).collect()
    }

    /// The linearisation at each row of a run.
    fn linear(&self, run: &Run, shared: &[f64], nuisance: &[f64]) -> Result<Vec<Linear>, PredictError> {
        let (states, outputs) = (self.equations().states.len(), self.equations().outputs.len());
        let (joints, levels) = (self.equations().joints.len(), &self.equations().levels);
        let sizes = self.state_sizes();
        let mut all = Vec::with_capacity(run.len());
        let (mut beside, mut rates) = (Vec::new(), vec![[0.0; 2]; states]);
        self.along(run, shared, nuisance, |machine, t, x| {
            let mut here = Linear {
                rates: DMatrix::zeros(states, states),
                outputs: DMatrix::zeros(outputs, states),
                pushes: vec![DVector::zeros(states); joints + levels.len()],
                felt: vec![vec![0.0; outputs]; joints + levels.len()],
                states: x[..states].to_vec(),
            };
            let mut direction = vec![0.0; x.len()];
            for (k, push) in here.pushes.iter_mut().enumerate() {
                if k < joints {
                    direction.fill(0.0);
                    machine.act(k, 1.0, t, x, &mut direction);
                    push.copy_from_slice(&direction[..states]);
                } else {
                    push[levels[k - joints]] = 1.0;
                }
            }
            let (mut room, mut smooth) = (vec![0.0; x.len()], vec![0.0; x.len()]);
            let mut read = vec![[0.0; 2]; outputs];
            let slope = |[up, down]: [f64; 2], step: f64| (up - down) / (2.0 * step);
            if self.equations().reads_rates {
                machine.smooth(t, x, &mut smooth);
                for (push, felt) in here.pushes.iter().zip(&mut here.felt) {
                    for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                        room.copy_from_slice(&smooth);
                        room.iter_mut().zip(push).for_each(|(rate, push)| *rate += sign * STEP * push);
                        machine.outputs(
                            t,
                            Point { x, rates: &room },
                            |_| true,
                            |c, value| read[c][side] = value,
                        );
                    }
                    felt.iter_mut().zip(&read).for_each(|(felt, sides)| *felt = slope(*sides, STEP));
                }
            }
            for state in 0..states {
                let step = STEP * sizes[state];
                for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                    beside.clear();
                    beside.extend_from_slice(x);
                    beside[state] += sign * step;
                    machine.smooth(t, &beside, &mut room);
                    rates.iter_mut().zip(&room).for_each(|(rate, now)| rate[side] = *now);
                    let at = Point { x: &beside, rates: &room };
                    machine.outputs(t, at, |_| true, |c, value| read[c][side] = value);
                }
                for (k, rate) in rates.iter().enumerate() {
                    here.rates[(k, state)] = slope(*rate, step);
                }
                for (c, value) in read.iter().enumerate() {
                    here.outputs[(c, state)] = slope(*value, step);
                }
            }
            all.push(here);
        })
        .map_err(|reason| PredictError { run: run.label.clone(), reason })?;
        Ok(all)
    }
}

/// A measured column with its gaps closed by straight lines; `None` where nothing was measured.
fn closed(times: &[f64], column: &[f64]) -> Option<Vec<f64>> {
    let known: Vec<usize> = (0..column.len()).filter(|&i| column[i].is_finite()).collect();
    let (first, last) = (*known.first()?, *known.last()?);
    let at = |i: usize| {
        let next = known.partition_point(|&k| k < i);
        if column[i].is_finite() {
            column[i]
        } else if i <= first {
            column[first]
        } else if i >= last {
            column[last]
        } else {
            let (a, b) = (known[next - 1], known[next]);
            column[a] + (column[b] - column[a]) * (times[i] - times[a]) / (times[b] - times[a])
        }
    };
    Some((0..column.len()).map(at).collect())
}

impl LocalCauses for MotionModel {
    /// A force or a flow on each joint or level by itself, and a resistance of each joint: what acts on one of them often moves the others
    /// as well, so that two together would say hardly more than each alone.
    fn unknowns(&self) -> Vec<LocalUnknown> {
        let joints = &self.equations().joints;
        let (joint_count, several) = (joints.len(), self.acted_on().len() > 1);
        let unknown = |what: &str, of: &str, component: Quantity| {
            let name = if several { format!("{what} on {of}") } else { what.to_owned() };
            LocalUnknown::new(name, vec![component])
        };
        let of_state = |(k, (component, state)): (usize, (Quantity, usize))| match joints.get(k) {
            Some(joint) => unknown("a force", &joint.name, component),
            None => unknown("a flow", &self.equations().states[state].name, component),
        };
        let resistance = |joint: &Joint| {
            let name = if joint_count > 1 {
                format!("rate_on_{}_per_s", joint.name)
            } else {
                "rate_per_s".to_owned()
            };
            unknown("a resistance", &joint.name, Quantity::new(name, "1/s"))
        };
        let acted_on = self.acted_on().into_iter().enumerate().map(of_state);
        acted_on.chain(joints.iter().map(resistance)).collect()
    }

    fn response(
        &self,
        of: (usize, usize),
        runs: &[Run],
        shared: &[f64],
        nuisance: &[Vec<f64>],
        amounts: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        let mut all = self.responses(of, runs, shared, nuisance, &[amounts.to_vec()])?;
        Ok(all.pop().unwrap_or_default())
    }

    fn responses(
        &self,
        (unknown, _): (usize, usize),
        runs: &[Run],
        shared: &[f64],
        nuisance: &[Vec<f64>],
        amounts: &[Vec<Vec<f64>>],
    ) -> Result<Vec<Vec<Vec<f64>>>, PredictError> {
        let all_acted_on = self.acted_on();
        // A resistance is a force against the velocity; joints come first among what is acted on.
        let resists = unknown >= all_acted_on.len();
        let acted_on = if resists { unknown - all_acted_on.len() } else { unknown };
        let state = all_acted_on[acted_on].1;
        let mut all = vec![Vec::with_capacity(runs.len()); amounts.len()];
        for (k, (run, nuisance)) in runs.iter().zip(nuisance).enumerate() {
            let acts = amounts.iter().any(|choice| choice[k].iter().any(|a| *a != 0.0));
            let linear = if acts { self.linear(run, shared, nuisance)? } else { Vec::new() };
            let propagation = Propagation::new(run, &linear, acted_on);
            for (all, choice) in all.iter_mut().zip(amounts) {
                let mut force = choice[k].clone();
                if resists {
                    force.iter_mut().zip(&linear).for_each(|(a, at)| *a *= -at.states[state]);
                }
                all.push(propagation.deviation(&force, run.outputs.len()));
            }
        }
        Ok(all)
    }

    fn states(&self) -> Vec<Quantity> {
        let equations = self.equations();
        let named = |(state, output): (usize, Option<usize>)| {
            let name = output.map_or(&equations.states[state].name, |o| &equations.outputs[o].name);
            Quantity::new(name.as_str(), units::text(name))
        };
        self.places().into_iter().map(named).collect()
    }

    fn state(&self, run: &Run, shared: &[f64], nuisance: &[f64]) -> Result<Vec<Vec<f64>>, PredictError> {
        let followed = self
            .course(run, shared, nuisance)
            .map_err(|reason| PredictError { run: run.label.clone(), reason })?;
        let place = |(state, output): (usize, Option<usize>)| {
            let measured = output.and_then(|o| closed(&run.inputs[0], &run.outputs[o]));
            measured.unwrap_or_else(|| followed.states[state].clone())
        };
        Ok(self.places().into_iter().map(place).collect())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;
    use crate::motion::equations::Equations;
    use crate::motion::model::Pace;
    use crate::motion::scales::Scales;
    use missing_physics::model::{Model as _, Scope};

    /// A force that acts at all rows alike is the mechanism `constant-force`, by its derivative, and a resistance `viscous-friction`.
    #[test]
    fn what_acts_at_all_rows_is_a_mechanism() {
        let all = Equations::example();
        let scales = Scales::of_example(&all);
        let starts: Vec<f64> = all.parameters.iter().map(|p| p.value).collect();
        let inputs = all.inputs.len();
        let outputs = all.outputs.len();
        let model = MotionModel::baseline(all, Pace::default()).full(scales, &starts, None);
        let times: Vec<f64> = (0..200).map(|k| 0.005 * f64::from(k)).collect();
        let wave: Vec<f64> = times.iter().map(|t| (5.0 * t).sin()).collect();
        let run = Run {
            label: "1".into(),
            inputs: std::iter::once(times.clone()).chain(vec![wave; inputs]).collect(),
            outputs: vec![vec![0.1; times.len()]; outputs],
            kind: 0,
        };
        let spec = model.spec();
        let of = |scope| {
            spec.parameters.iter().filter(move |p| p.scope == scope).map(|p| p.start).collect::<Vec<f64>>()
        };
        let (shared, nuisance) = (of(Scope::Shared), of(Scope::PerRun));
        let rows = outputs * times.len();
        let resistance = model.acted_on().len();
        for (unknown, id) in [(0, "constant-force"), (resistance, "viscous-friction")] {
            let like = spec.mechanisms.iter().find(|m| m.id.starts_with(id)).unwrap();
            let slot = spec.slots()[like.parameters[0]];
            let (mut out, mut jacobian) = (vec![0.0; rows], vec![0.0; rows]);
            model.jacobian(&run, &shared, &nuisance, &[slot], &[], &mut out, &mut jacobian).unwrap();
            let amounts = [vec![1.0; times.len()]];
            let response = model
                .response(
                    (unknown, 0),
                    std::slice::from_ref(&run),
                    &shared,
                    std::slice::from_ref(&nuisance),
                    &amounts,
                )
                .unwrap();
            let largest = jacobian.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            assert!(largest > 0.0);
            for (a, b) in response[0].iter().zip(&jacobian) {
                assert!((a - b).abs() < 2e-3 * largest, "{id}: {a} {b}");
            }
        }
    }
}
