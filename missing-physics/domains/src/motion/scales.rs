//! How large a machine's motions, inputs and readings are: what effects and their bounds are measured by.

use super::equations::Equations;
use super::units::{quotient, text};
use crate::mechanics::{Clock, JointSizes, JointUnits};

/// Sizes of a recording.
#[derive(Debug, Clone, Default)]
pub(super) struct Scales {
    pub(super) states: Vec<f64>,
    /// How far each state moves: its size, or its range where that is smaller (a temperature in kelvins).
    pub(super) moves: Vec<f64>,
    pub(super) joints: Vec<JointSizes>,
    /// By joint: whether its drive moves it more or less by the machine's pose, and its forces with it.
    pub(super) levers: Vec<bool>,
    pub(super) inputs: Vec<Range>,
    pub(super) outputs: Vec<Range>,
    /// Smallest and largest value of each level.
    pub(super) levels: Vec<[f64; 2]>,
    /// Median time between rows, s.
    pub(super) step_s: f64,
    /// The longest run, s.
    pub(super) duration_s: f64,
    pub(super) runs: usize,
}

/// Smallest and largest value of a column.
#[derive(Debug, Clone, Default)]
pub(super) struct Range {
    pub(super) range: [f64; 2],
}

/// Smallest and largest of the finite values; a unit apart where they are all the same.
pub(super) fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if high > low {
        [low, high]
    } else if high == low {
        [low - 0.5, high + 0.5]
    } else {
        [-0.5, 0.5]
    }
}

/// Root mean square, at least a little above zero.
pub(super) fn rms(values: &[f64]) -> f64 {
    let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let mean = finite.iter().map(|v| v * v).sum::<f64>() / finite.len().max(1) as f64;
    if mean > 0.0 { mean.sqrt() } else { 1.0 }
}

impl Scales {
    pub(super) fn clock(&self) -> Clock {
        Clock { step_s: self.step_s, duration_s: self.duration_s }
    }

    /// Sizes of nothing in particular: all of them one.
    pub(super) fn of_example(equations: &Equations) -> Self {
        let one = || Range { range: [-1.0, 1.0] };
        let scales = Self {
            inputs: equations.inputs.iter().map(|_| one()).collect(),
            outputs: equations.outputs.iter().map(|_| one()).collect(),
            step_s: 0.01,
            duration_s: 1.0,
            ..Self::default()
        };
        let motion = vec![vec![-1.0, 1.0]; equations.states.len()];
        scales.measure(equations, &motion, &motion)
    }

    /// The sizes of motions that were simulated: `states[state]` and `rates[state]` over all rows of all runs.
    pub(super) fn measure(mut self, equations: &Equations, states: &[Vec<f64>], rates: &[Vec<f64>]) -> Self {
        self.states = states.iter().map(|s| rms(s)).collect();
        let moves = |(s, size): (&Vec<f64>, &f64)| {
            let [low, high] = range(s.iter().copied());
            size.min(high - low)
        };
        self.moves = states.iter().zip(&self.states).map(moves).collect();
        self.joints = equations
            .joints
            .iter()
            .map(|joint| {
                let [low, high] = range(states[joint.position].iter().copied());
                let position = text(&equations.states[joint.position].name);
                let per = |unit: &str, power: i32| quotient(unit, &[(&position, power)]);
                let units = JointUnits {
                    speed: quotient(&position, &[("s", 1)]),
                    force: quotient(&position, &[("s", 2)]),
                    damping: ["1/s".to_owned(), per("", 1), per("s", 2)],
                    stiffness: ["1/s^2".to_owned(), per("1/s^2", 1), per("1/s^2", 2)],
                    position,
                };
                JointSizes {
                    force: rms(&rates[joint.velocity]),
                    speed: rms(&states[joint.velocity]),
                    reach: low.abs().max(high.abs()).max(1e-9),
                    range: [low, high],
                    step_s: self.step_s,
                    turns: joint.turns,
                    units,
                }
            })
            .collect();
        self.levels = equations.levels.iter().map(|&l| range(states[l].iter().copied())).collect();
        self
    }
}
