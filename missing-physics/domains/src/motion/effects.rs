//! The mechanisms of the domain: which parameters each has, where they act, and what it is in words.

use super::equations::Equations;
use super::law::LawTerm;
use super::scales::Scales;
use crate::mechanics::{self, Declares, InputEffect, JointEffect, JointHas, OutputEffect};
use missing_physics::model::{Mechanism, ParameterRef, Quantity, SpecBuilder, UNBOUNDED};

/// What a shared parameter is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// A parameter of the recording's.
    Stated(usize),
    /// The same of one run, where runs are cut into windows.
    OfRun(usize, usize),
    /// A joint's.
    Joint(usize, JointEffect),
    /// An input's.
    Input(usize, InputEffect),
    /// An output's.
    Output(usize, OutputEffect),
    /// The height at which a level overflows.
    Overflow(usize),
    /// The rate at which a level leaks.
    Leak(usize),
    /// By how much the clock is fast.
    Clock,
    /// The coefficient of a candidate term of an unknown law.
    Term(usize),
}

/// A specification in the making, with what each shared parameter is.
pub(super) struct Effects<'a> {
    pub(super) builder: SpecBuilder,
    pub(super) roles: Vec<Role>,
    equations: &'a Equations,
    scales: &'a Scales,
}

/// Non-negative numbers.
const POSITIVE: [f64; 2] = [0.0, f64::INFINITY];
const TEXTBOOK: &str = "textbook mechanics";

impl<'a> Effects<'a> {
    pub(super) fn new(equations: &'a Equations, scales: &'a Scales) -> Self {
        Self {
            builder: SpecBuilder::new("the equations of motion as they stand in the recording"),
            roles: Vec::new(),
            equations,
            scales,
        }
    }

    fn add(
        &mut self,
        role: Role,
        name: &str,
        unit: &str,
        start: f64,
        bounds: [f64; 2],
        scale: f64,
    ) -> ParameterRef {
        let scale = if scale.is_finite() && scale > 0.0 { scale } else { 1.0 };
        let at = self.builder.shared(name, unit, start, bounds, scale);
        self.roles.push(role);
        at
    }

    /// Declares what the recording says: its parameters, and the states that are free at each run's start. Of runs that are cut into
    /// windows these are their labels: windows share what is of a run, and begin anywhere.
    pub(super) fn stated(&mut self, starts: &[f64], cut: Option<&[String]>) {
        for (k, p) in self.equations.parameters.iter().enumerate().filter(|(_, p)| !p.known) {
            if let (true, Some(labels)) = (p.per_run, cut) {
                for (run, label) in labels.iter().enumerate() {
                    let name = format!("{} of run {label}", p.name);
                    let start = p.start_of(label).unwrap_or(starts[k]);
                    self.add(Role::OfRun(k, run), &name, &p.unit, start, p.bounds, p.scale);
                }
            } else if p.per_run {
                self.builder.nuisance_from(&p.name, &p.unit, starts[k], p.bounds, p.scale);
            } else {
                self.add(Role::Stated(k), &p.name, &p.unit, starts[k], p.bounds, p.scale);
            }
        }
        for (state, scale) in self.equations.states.iter().zip(&self.scales.states) {
            if cut.is_some() || state.start == super::equations::Start::Free {
                let unit = super::units::text(&state.name);
                self.builder.nuisance(&format!("{}_at_start", state.name), &unit, UNBOUNDED, *scale);
            }
        }
    }

    /// Declares what may differ from run to run: each of the recording's parameters that all runs share. Gives the slot of each one's change.
    pub(super) fn between_runs(&mut self) -> Vec<Option<usize>> {
        let mut of = |p: &super::equations::Parameter| {
            (!p.known && !p.per_run).then(|| {
                let name = &p.name;
                let change = self.builder.nuisance(&format!("{name}_change"), &p.unit, UNBOUNDED, p.scale);
                let text = [
                    &*format!("{name} that differs from run to run"),
                    "Nobody kept it the same: a battery, a load, a temperature.",
                    &*format!("{name} -> {name} + change of the run"),
                    "Laird and Ware 1982, doi:10.2307/2529876 (random effects)",
                ];
                self.builder.between_runs(&format!("{name}-by-run"), &[change], text, &[]);
                change.slot
            })
        };
        self.equations.parameters.iter().map(&mut of).collect()
    }

    /// Declares all mechanisms.
    pub(super) fn all(&mut self) {
        for joint in 0..self.equations.joints.len() {
            self.joint(joint);
        }
        for input in 0..self.equations.inputs.len() {
            // What no equation uses can have no effect.
            let place = self.equations.input_name(input);
            if self.equations.states.iter().any(|s| s.rate.has(place)) {
                self.input(input);
            }
        }
        for output in 0..self.equations.outputs.len() {
            self.output(output);
        }
        for level in 0..self.equations.levels.len() {
            self.level(level);
        }
        let rate = self.add(Role::Clock, "rate", "", 0.0, [-0.5, 0.5], 0.01);
        let text = ["clock", "The recording's clock runs fast or slow.", "t = (1 + rate) t_true", TEXTBOOK];
        self.builder.mechanism("clock-rate", &[rate], text, &["inertia", "sensor-gain", "input-gain"]);
    }

    /// Declares the candidate terms of an unknown law.
    pub(super) fn terms(&mut self, terms: &[LawTerm]) {
        for (k, term) in terms.iter().enumerate() {
            let name = format!("coefficient of {} in {}", term.formula, term.to.0);
            let coefficient = self.add(Role::Term(k), &name, &term.unit, 0.0, UNBOUNDED, term.scale);
            let to = Quantity::new(&*term.to.0, &*term.to.1);
            self.builder.term(coefficient, &*term.formula, to, term.variables.clone());
        }
    }

    /// A mechanism, of a carrier that is named where there are several of its kind: its parameters, its name, what it is, its equation and
    /// its source, what it is easily confused with.
    fn mechanism(
        &mut self,
        kind: &str,
        of: Option<&str>,
        parameters: &[ParameterRef],
        text: [&str; 4],
        confused: &[&str],
    ) -> &mut Mechanism {
        let (id, name) = match of {
            Some(of) => (format!("{kind}@{of}"), format!("{} of {of}", text[0])),
            None => (kind.to_owned(), text[0].to_owned()),
        };
        self.builder.mechanism(&id, parameters, [&name, text[1], text[2], text[3]], confused)
    }

    fn joint(&mut self, joint: usize) {
        let (equations, scales) = (self.equations, self.scales);
        let of = (equations.joints.len() > 1).then_some(equations.joints[joint].name.as_str());
        let (stated, sizes) = (&equations.joints[joint], &scales.joints[joint]);
        let has = JointHas {
            drive: stated.drive.is_some(),
            follows: stated.follows,
            yields: sizes.yields(),
            inertia: true,
        };
        mechanics::joints(&mut Carrier { effects: self, of, role: |e| Role::Joint(joint, e) }, sizes, has);
    }

    fn input(&mut self, input: usize) {
        let (equations, scales) = (self.equations, self.scales);
        let name = equations.inputs[input].name.as_str();
        let of = (equations.inputs.len() > 1).then_some(name);
        let longest_s = scales.clock().longest_s();
        let (unit, range) = (super::units::text(name), scales.inputs[input].range);
        let mut carrier = Carrier { effects: self, of, role: |e| Role::Input(input, e) };
        mechanics::inputs(&mut carrier, &unit, range, scales.step_s, longest_s);
    }

    fn output(&mut self, output: usize) {
        let (equations, scales) = (self.equations, self.scales);
        let name = equations.outputs[output].name.as_str();
        let of = (equations.outputs.len() > 1).then_some(name);
        let (unit, range) = (super::units::text(name), scales.outputs[output].range);
        let mut carrier = Carrier { effects: self, of, role: |e| Role::Output(output, e) };
        mechanics::outputs(&mut carrier, &unit, range, Some(&scales.clock()));
    }

    fn level(&mut self, level: usize) {
        let state = self.equations.levels[level];
        let (name, several) = (self.equations.states[state].name.clone(), self.equations.levels.len() > 1);
        let [low, high] = self.scales.levels[level];
        let span = high - low;
        let unit = super::units::text(&name);
        let height = self.add(
            Role::Overflow(level),
            "height",
            &unit,
            high + 0.1 * span,
            [low, high + 0.2 * span],
            0.1 * span,
        );
        let rate =
            self.add(Role::Leak(level), "rate_per_s", "1/s", 0.0, POSITIVE, 0.1 / self.scales.duration_s);
        let of = several.then_some(name.as_str());
        self.mechanism(
            "overflow",
            of,
            &[height],
            ["an overflow", "What comes above a height is lost.", "level <= height", TEXTBOOK],
            &["sensor-saturation", "input-saturation"],
        );
        self.mechanism(
            "leak",
            of,
            &[rate],
            ["a leak", "The level falls in proportion to its height.", "-rate level", TEXTBOOK],
            &["sensor-gain"],
        );
    }
}

/// One joint, input or output of a specification in the making.
struct Carrier<'e, 'a, R> {
    effects: &'e mut Effects<'a>,
    /// Its name, where there are several of its kind.
    of: Option<&'e str>,
    role: R,
}

impl<E, R: Fn(E) -> Role> Declares<E> for Carrier<'_, '_, R> {
    fn wants(&self, _: &str) -> bool {
        true
    }

    fn parameter(
        &mut self,
        effect: E,
        name: &str,
        unit: &str,
        off: f64,
        bounds: [f64; 2],
        scale: f64,
    ) -> ParameterRef {
        self.effects.add((self.role)(effect), name, unit, off, bounds, scale)
    }

    fn mechanism(
        &mut self,
        kind: &str,
        parameters: &[ParameterRef],
        text: [&str; 4],
        confused: &[&str],
    ) -> &mut Mechanism {
        self.effects.mechanism(kind, self.of, parameters, text, confused)
    }
}
