//! Candidate terms of a law that nobody has listed: what they are of, and what they add to.

use joint_laws::Number;

use super::equations::Equations;
use super::expression::{Expression, derivative};
use super::scales::Scales;
use super::tape::Tape;
use super::units;

/// The most terms that are tried.
const MOST: usize = 80;

/// What a term adds to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Adds {
    /// The derivative of a joint's velocity, as its forces do.
    Force(usize),
    /// The derivative of a state.
    Rate(usize),
    /// What an output reads.
    Reading(usize),
}

/// A candidate term: a product of powers and functions of states, inputs and time.
#[derive(Debug, Clone)]
pub(super) struct LawTerm {
    pub(super) adds: Adds,
    /// What it adds to, and the unit of that.
    pub(super) to: (String, String),
    pub(super) formula: String,
    pub(super) variables: Vec<String>,
    /// The unit of its coefficient, and a typical size.
    pub(super) unit: String,
    pub(super) scale: f64,
    tape: Tape,
}

impl LawTerm {
    /// Registers that its evaluation needs.
    pub(super) fn registers(&self) -> usize {
        self.tape.registers()
    }

    /// Its value where names have the values that stand first in `room`.
    #[inline(always)]
    pub(super) fn value<T: Number>(&self, room: &mut [T]) -> T {
        self.tape.run(room);
        self.tape.result(room, 0)
    }
}

/// A factor of a term: how it is written, its unit to the power that it has, its size; the name in it.
#[derive(Clone)]
struct Factor {
    text: String,
    unit: (String, i32),
    size: f64,
    names: Vec<String>,
}

/// Something that varies: a state, an input, or the time.
#[derive(Clone)]
struct Variable {
    name: String,
    unit: String,
    size: f64,
}

impl Variable {
    fn factor(&self, text: String, power: i32) -> Factor {
        let names = vec![self.name.clone()];
        Factor { text, unit: (self.unit.clone(), power), size: self.size.powi(power), names }
    }

    fn power(&self, power: i32) -> Factor {
        let text = if power == 1 { self.name.clone() } else { format!("{}^{power}", self.name) };
        self.factor(text, power)
    }

    /// `|x| x`.
    fn signed_square(&self) -> [Factor; 2] {
        [self.factor(format!("abs({})", self.name), 1), self.power(1)]
    }

    /// A function of an angle.
    fn wave(&self, function: &str, periods: i32) -> Factor {
        let of = if periods == 1 { self.name.clone() } else { format!("{periods}*{}", self.name) };
        Factor { size: 1.0, ..self.factor(format!("{function}({of})"), 0) }
    }

    /// A power of the difference of two.
    fn less(&self, other: &Self, power: i32) -> Factor {
        Factor {
            text: format!("({} - {})^{power}", self.name, other.name),
            unit: (self.unit.clone(), power),
            size: self.size.max(other.size).powi(power),
            names: vec![self.name.clone(), other.name.clone()],
        }
    }
}

/// The candidate terms of a machine.
pub(super) fn terms(equations: &Equations, scales: &Scales) -> Vec<LawTerm> {
    let mut candidates = Candidates::new(equations, scales);
    for joint in 0..equations.joints.len() {
        candidates.joint(joint);
    }
    for state in 0..equations.states.len() {
        if !candidates.of_joint(state) && equations.states[state].rate.bare_name().is_none() {
            candidates.rate(state);
        }
    }
    for output in 0..equations.outputs.len() {
        candidates.reading(output);
    }
    candidates.found.truncate(MOST);
    candidates.found
}

struct Candidates<'a> {
    equations: &'a Equations,
    scales: &'a Scales,
    names: Vec<String>,
    states: Vec<Variable>,
    /// Those that any equation uses.
    inputs: Vec<(usize, Variable)>,
    time: Variable,
    found: Vec<LawTerm>,
}

impl<'a> Candidates<'a> {
    fn new(equations: &'a Equations, scales: &'a Scales) -> Self {
        let variable = |name: &str, size: f64| Variable { name: name.into(), unit: units::text(name), size };
        let states: Vec<Variable> =
            equations.states.iter().zip(&scales.states).map(|(s, size)| variable(&s.name, *size)).collect();
        let used = |k: &usize| equations.states.iter().any(|s| s.rate.has(equations.input_name(*k)));
        let inputs = (0..equations.inputs.len()).filter(used).map(|k| {
            let [low, high] = scales.inputs[k].range;
            (k, variable(&equations.inputs[k].name, low.abs().max(high.abs())))
        });
        let mut names: Vec<String> = states.iter().map(|s| s.name.clone()).collect();
        names.extend(equations.inputs.iter().map(|i| i.name.clone()));
        names.extend(equations.parameters.iter().map(|p| p.name.clone()));
        names.push("t_s".into());
        Self {
            equations,
            scales,
            names,
            inputs: inputs.collect(),
            states,
            time: variable("t_s", scales.duration_s),
            found: Vec::new(),
        }
    }

    /// Whether a state is a joint's position or velocity.
    fn of_joint(&self, state: usize) -> bool {
        self.equations.joints.iter().any(|joint| joint.velocity == state || joint.position == state)
    }

    /// All states but one, if any, and the inputs.
    fn others(&self, state: Option<usize>) -> Vec<Variable> {
        let others = self.states.iter().enumerate().filter(|(other, _)| Some(*other) != state);
        others.map(|(_, other)| other).chain(self.inputs.iter().map(|(_, input)| input)).cloned().collect()
    }

    /// Adds the waves of an angle.
    fn waves(&mut self, adds: Adds, angle: &Variable) {
        for (function, periods) in [("sin", 1), ("cos", 1), ("sin", 2), ("cos", 2)] {
            self.add(adds, &[angle.wave(function, periods)]);
        }
    }

    fn add(&mut self, adds: Adds, factors: &[Factor]) {
        let (name, unit, size) = match adds {
            Adds::Force(joint) => {
                let velocity = &self.equations.states[self.equations.joints[joint].velocity].name;
                let size = self.scales.joints[joint].force;
                (derivative(velocity), units::text_of_rate(velocity), size)
            }
            Adds::Rate(state) => {
                let name = &self.equations.states[state].name;
                (derivative(name), units::text_of_rate(name), self.states[state].size / self.time.size)
            }
            Adds::Reading(output) => {
                let [low, high] = self.scales.outputs[output].range;
                let name = &self.equations.outputs[output].name;
                (name.clone(), units::text(name), high - low)
            }
        };
        let text: Vec<&str> = factors.iter().map(|f| f.text.as_str()).collect();
        let formula = if text.is_empty() { "1".to_owned() } else { text.join("*") };
        // What these names make of each other is an expression.
        let Ok(expression) = Expression::parse(&formula, &self.names) else { return };
        let of: Vec<(&str, i32)> = factors.iter().map(|f| (f.unit.0.as_str(), f.unit.1)).collect();
        let mut variables: Vec<String> = factors.iter().flat_map(|f| f.names.clone()).collect();
        variables.dedup();
        let scale = 0.1 * size / factors.iter().map(|f| f.size).product::<f64>();
        let nothing = (vec![None; self.names.len()], vec![false; self.names.len()]);
        self.found.push(LawTerm {
            adds,
            unit: units::quotient(&unit, &of),
            to: (name, unit),
            formula,
            variables,
            scale: if scale.is_finite() && scale > 0.0 { scale } else { 1.0 },
            tape: Tape::new(std::iter::once(&expression), &nothing.0, &nothing.1),
        });
    }

    /// Forces on a joint that no mechanism is: of its position and its velocity, of both, of the time, of what drives it and of other joints.
    fn joint(&mut self, number: usize) {
        let joint = &self.equations.joints[number];
        let (x, v) = (self.states[joint.position].clone(), self.states[joint.velocity].clone());
        let t = self.time.clone();
        let to = Adds::Force(number);
        for (in_x, in_v) in [(1, 1), (2, 1), (0, 2), (1, 2), (0, 5), (4, 0), (5, 0)] {
            let factors: Vec<Factor> = [(&x, in_x), (&v, in_v)]
                .into_iter()
                .filter(|(_, power)| *power > 0)
                .map(|(of, power)| of.power(power))
                .collect();
            self.add(to, &factors);
        }
        self.add(to, &x.signed_square());
        if joint.turns {
            self.waves(to, &x);
        }
        self.add(to, &[t.power(1)]);
        self.add(to, &[t.power(1), x.power(1)]);
        self.add(to, &[t.power(1), v.power(1)]);
        for (input, u) in self.inputs.clone() {
            if joint.drive != Some(input) {
                self.add(to, &[u.power(1)]);
            }
            self.add(to, &u.signed_square());
            self.add(to, &[u.power(2)]);
            self.add(to, &[u.power(3)]);
            for other in [&x, &v, &t] {
                self.add(to, &[u.power(1), other.power(1)]);
            }
        }
        for other in (0..self.equations.joints.len()).filter(|other| *other != number) {
            let other = &self.equations.joints[other];
            let (y, w) = (self.states[other.position].clone(), self.states[other.velocity].clone());
            self.add(to, &[y.power(1)]);
            self.add(to, &[w.power(1)]);
            if x.unit == y.unit {
                self.add(to, &[x.less(&y, 2)]);
                self.add(to, &[x.less(&y, 3)]);
            }
        }
        for (state, z) in self.states.clone().iter().enumerate() {
            if !self.of_joint(state) {
                self.add(to, &[z.power(1)]);
                self.add(to, &[z.power(1), x.power(1)]);
                self.add(to, &[z.power(1), v.power(1)]);
            }
        }
    }

    /// What may change a state that is no joint's: polynomials of it, of the time, of inputs and of other states.
    fn rate(&mut self, state: usize) {
        let to = Adds::Rate(state);
        let (z, t) = (self.states[state].clone(), self.time.clone());
        self.add(to, &[]);
        (1..=4).for_each(|power| self.add(to, &[z.power(power)]));
        self.add(to, &[t.power(1)]);
        self.add(to, &[t.power(1), z.power(1)]);
        for other in self.others(Some(state)) {
            self.add(to, &[other.power(1)]);
            self.add(to, &[other.power(2)]);
            self.add(to, &[other.power(1), z.power(1)]);
        }
    }

    /// What may change a reading that no mechanism is: a wave of the angle that it measures, what else moves, what is commanded.
    fn reading(&mut self, output: usize) {
        let to = Adds::Reading(output);
        let measured = self.equations.outputs[output].state;
        if let Some(state) = measured
            && self.equations.joints.iter().any(|j| j.turns && j.position == state)
        {
            let angle = self.states[state].clone();
            self.waves(to, &angle);
        }
        self.others(measured).iter().for_each(|other| self.add(to, &[other.power(1)]));
    }
}
