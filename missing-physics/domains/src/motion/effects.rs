//! The mechanisms of the domain: which parameters each has, where they act, and what it is in words.

use std::f64::consts::PI;

use super::equations::Equations;
use super::scales::Scales;
use missing_physics::model::{Mechanism, ParameterRef, SpecBuilder, UNBOUNDED};

/// What a shared parameter is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// A parameter of the recording's.
    Stated(usize),
    /// The same of one run, where runs are cut into windows.
    OfRun(usize, usize),
    /// A joint's.
    Joint(usize, OfJoint),
    /// An input's.
    Input(usize, OfInput),
    /// An output's.
    Output(usize, OfOutput),
    /// The height at which a level overflows.
    Overflow(usize),
    /// The rate at which a level leaks.
    Leak(usize),
    /// By how much the clock is fast.
    Clock,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OfJoint {
    Coulomb,
    Asymmetry,
    StribeckLevel,
    StribeckSpeed,
    Damping(usize),
    LoadFraction,
    Stiffness(usize),
    Constant,
    CogAmplitude,
    CogPhase,
    CogPeriods,
    Gap,
    StopPosition,
    StopStiffness,
    Inertia,
    YieldStiffness,
    Yield,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OfInput {
    Gain,
    Offset,
    Delay,
    Lag,
    Upper,
    Lower,
    DeadZone,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum OfOutput {
    Gain,
    Offset,
    Drift,
    Delay,
    Lag,
    Upper,
    Lower,
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
const ARMSTRONG: &str =
    "Armstrong-Helouvry, Dupont and Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7";
const WEN: &str = "Wen 1976, doi:10.1061/JMCEA3.0002106";
const NORDIN: &str = "Nordin and Gutman 2002, doi:10.1016/S0005-1098(02)00047-X";
const TEXTBOOK: &str = "textbook mechanics";
const CONTROL: &str = "Astrom and Murray, Feedback Systems, 2nd ed. 2021";
const PERIODS: [f64; 2] = [1.0, 60.0];

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
                    self.add(Role::OfRun(k, run), &name, &p.unit, starts[k], p.bounds, p.scale);
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

    /// Declares all mechanisms.
    pub(super) fn all(&mut self) {
        for joint in 0..self.equations.joints.len() {
            self.friction(joint);
            self.elastic(joint);
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

    /// A mechanism, of a carrier that is named where there are several of its kind: its parameters, its name, what it is, its equation and
    /// its source, what it is easily confused with.
    fn mechanism(
        &mut self,
        kind: &str,
        of: Option<&str>,
        own: &[ParameterRef],
        text: [&str; 4],
        confused: &[&str],
    ) -> &mut Mechanism {
        let (id, name) = match of {
            Some(of) => (format!("{kind}@{of}"), format!("{} of {of}", text[0])),
            None => (kind.to_owned(), text[0].to_owned()),
        };
        self.builder.mechanism(&id, own, [&name, text[1], text[2], text[3]], confused)
    }

    fn joint_mechanism(
        &mut self,
        joint: usize,
        kind: &str,
        own: &[ParameterRef],
        text: [&str; 4],
        confused: &[&str],
    ) -> &mut Mechanism {
        let equations = self.equations;
        let of = (equations.joints.len() > 1).then_some(equations.joints[joint].name.as_str());
        self.mechanism(kind, of, own, text, confused)
    }

    fn friction(&mut self, joint: usize) {
        let s = self.scales.joints[joint].clone();
        let unit = s.force_unit.as_str();
        let force = 0.1 * s.acceleration;
        let role = |r| Role::Joint(joint, r);
        let level = self.add(role(OfJoint::Coulomb), "level", unit, 0.0, POSITIVE, force);
        self.joint_mechanism(
            joint,
            "coulomb-friction",
            &[level],
            [
                "dry friction",
                "A force of one size opposes the motion, and holds at rest what is below it.",
                "-level sign(v)",
                ARMSTRONG,
            ],
            &["viscous-friction", "hysteresis", "backlash"],
        );
        let more = self.add(role(OfJoint::Asymmetry), "forward_less_backward", unit, 0.0, UNBOUNDED, force);
        self.joint_mechanism(
            joint,
            "asymmetric-friction",
            &[more],
            [
                "friction that differs with the direction",
                "Dry friction is larger in one direction than in the other.",
                "-(level +- forward_less_backward / 2) sign(v)",
                ARMSTRONG,
            ],
            &["constant-force", "input-offset"],
        );
        let level = self.add(role(OfJoint::StribeckLevel), "level", unit, 0.0, POSITIVE, force);
        let speed = self.add(
            role(OfJoint::StribeckSpeed),
            "speed",
            &s.speed_unit,
            0.1 * s.speed,
            [1e-3 * s.speed, s.speed],
            0.1 * s.speed,
        );
        self.joint_mechanism(
            joint,
            "stribeck-friction",
            &[level, speed],
            [
                "Stribeck friction",
                "Dry friction that fades as the joint moves faster.",
                "-level exp(-(v/speed)^2) sign(v)",
                ARMSTRONG,
            ],
            &["coulomb-friction"],
        )
        .shape_parameters = vec![speed.index];
        for (power, (kind, name, unit, what, equation)) in [
            ("viscous-friction", "rate_per_s", "1/s".to_owned(), "viscous friction", "-rate v"),
            ("quadratic-damping", "coefficient", per(&s.position_unit), "quadratic damping", "-c |v| v"),
            ("cubic-damping", "coefficient", format!("s/({})^2", s.position_unit), "cubic damping", "-c v^3"),
        ]
        .into_iter()
        .enumerate()
        {
            let scale = force / s.speed.powi(power as i32 + 1);
            let at = self.add(role(OfJoint::Damping(power)), name, &unit, 0.0, POSITIVE, scale);
            self.joint_mechanism(
                joint,
                kind,
                &[at],
                [what, "A force that opposes the motion and grows with the speed.", equation, TEXTBOOK],
                &["coulomb-friction", "quadratic-damping", "cubic-damping", "viscous-friction"],
            );
        }
        if self.equations.joints[joint].drive.is_some() {
            let fraction = self.add(role(OfJoint::LoadFraction), "fraction", "", 0.0, [0.0, 1.0], 0.1);
            self.joint_mechanism(
                joint,
                "load-dependent-friction",
                &[fraction],
                [
                    "friction that grows with the load",
                    "Dry friction in proportion to the driving force.",
                    "-fraction |driving force| sign(v)",
                    ARMSTRONG,
                ],
                &["coulomb-friction", "input-gain"],
            );
        }
    }

    fn elastic(&mut self, joint: usize) {
        let s = self.scales.joints[joint].clone();
        let force = 0.1 * s.acceleration;
        let role = |r| Role::Joint(joint, r);
        for (power, (kind, what, equation)) in [
            ("stiffness", "a spring", "-k x"),
            ("quadratic-stiffness", "a spring that pushes to one side", "-k x^2"),
            ("cubic-stiffness", "a spring that hardens or softens", "-k x^3"),
        ]
        .into_iter()
        .enumerate()
        {
            let unit = if power == 0 {
                "1/s^2".to_owned()
            } else {
                format!("1/(s^2 {}{})", s.position_unit, if power == 2 { "^2" } else { "" })
            };
            let scale = force / s.reach.powi(power as i32 + 1);
            let at = self.add(role(OfJoint::Stiffness(power)), "coefficient", &unit, 0.0, UNBOUNDED, scale);
            self.joint_mechanism(
                joint,
                kind,
                &[at],
                [what, "A force that depends on where the joint is.", equation, TEXTBOOK],
                &["stiffness", "cubic-stiffness", "quadratic-stiffness"],
            );
        }
        let level = self.add(role(OfJoint::Constant), "level", &s.force_unit, 0.0, UNBOUNDED, force);
        self.joint_mechanism(
            joint,
            "constant-force",
            &[level],
            [
                "a constant force",
                "A force that is always the same: a weight, a slope, a bias.",
                "+level",
                TEXTBOOK,
            ],
            &["input-offset", "asymmetric-friction"],
        );
        if self.equations.joints[joint].turns {
            self.cogging(joint);
        }
        self.ends(joint);
        self.yielding(joint);
    }

    fn cogging(&mut self, joint: usize) {
        let s = self.scales.joints[joint].clone();
        let force = 0.1 * s.acceleration;
        let role = |r| Role::Joint(joint, r);
        let amplitude =
            self.add(role(OfJoint::CogAmplitude), "amplitude", &s.force_unit, 0.0, POSITIVE, force);
        let phase = self.add(role(OfJoint::CogPhase), "phase_rad", "rad", 0.0, [-PI, PI], 1.0);
        let periods = self.add(role(OfJoint::CogPeriods), "periods", "", 1.0, PERIODS, 1.0);
        let m = self.joint_mechanism(
            joint,
            "cogging",
            &[amplitude, phase, periods],
            [
                "cogging",
                "A force that repeats with the angle, some times a turn: magnets, teeth.",
                "amplitude sin(periods angle + phase)",
                TEXTBOOK,
            ],
            &["cubic-stiffness"],
        );
        m.shape_parameters = vec![phase.index];
        m.integer_parameters = vec![periods.index];
    }

    /// What happens at the ends of a joint's range, and of its play.
    fn ends(&mut self, joint: usize) {
        let s = self.scales.joints[joint].clone();
        let role = |r| Role::Joint(joint, r);
        if self.equations.joints[joint].follows {
            let gap = self.add(
                role(OfJoint::Gap),
                "gap",
                &s.position_unit,
                0.0,
                [0.0, s.range[1] - s.range[0]],
                0.02 * s.reach,
            );
            self.joint_mechanism(
                joint,
                "backlash",
                &[gap],
                [
                    "backlash",
                    "Play between what drives the joint and the joint, from end to end.",
                    "the joint follows the command at half the gap",
                    NORDIN,
                ],
                &["coulomb-friction", "hysteresis", "input-dead-zone"],
            );
        }
        let [low, high] = s.range;
        let span = high - low;
        let position = self.add(
            role(OfJoint::StopPosition),
            "position",
            &s.position_unit,
            high - 0.05 * span,
            [low, high],
            0.1 * span,
        );
        let stiffness = self.add(
            role(OfJoint::StopStiffness),
            "stiffness",
            "1/s^2",
            0.0,
            POSITIVE,
            10.0 * s.acceleration / s.reach,
        );
        self.joint_mechanism(
            joint,
            "end-stop",
            &[position, stiffness],
            [
                "an end stop",
                "Beyond a position something pushes back.",
                "-stiffness (x - position) beyond it",
                TEXTBOOK,
            ],
            &["cubic-stiffness", "sensor-saturation"],
        )
        .shape_parameters = vec![position.index];
    }

    fn yielding(&mut self, joint: usize) {
        let s = self.scales.joints[joint].clone();
        let role = |r| Role::Joint(joint, r);
        let fraction = self.add(role(OfJoint::Inertia), "fraction", "", 0.0, [-0.9, 10.0], 0.1);
        self.joint_mechanism(
            joint,
            "inertia",
            &[fraction],
            [
                "more inertia",
                "All accelerations of the joint are smaller by one factor.",
                "dv/dt / (1 + fraction)",
                TEXTBOOK,
            ],
            &["clock-rate", "input-gain"],
        );
        let stiffness = self.add(
            role(OfJoint::YieldStiffness),
            "stiffness",
            "1/s^2",
            0.0,
            POSITIVE,
            s.acceleration / s.reach,
        );
        let yields = self.add(
            role(OfJoint::Yield),
            "yield",
            &s.position_unit,
            0.03 * s.reach,
            [s.least_yield(self.scales.step_s), 2.0 * s.reach],
            0.03 * s.reach,
        );
        self.joint_mechanism(
            joint,
            "hysteresis",
            &[stiffness, yields],
            [
                "hysteresis",
                "A spring that yields: dry friction that gives before it slides.",
                "-stiffness z, dz/dt = v - (|v| z + v |z|) / (2 yield)",
                WEN,
            ],
            &["coulomb-friction", "backlash"],
        )
        .shape_parameters = vec![yields.index];
    }

    fn input(&mut self, input: usize) {
        let s = self.scales.inputs[input].clone();
        let (name, several) = (self.equations.inputs[input].name.clone(), self.equations.inputs.len() > 1);
        let unit = super::units::text(&name);
        let role = |r| Role::Input(input, r);
        let [low, high] = s.range;
        let span = high - low;
        let longest = (100.0 * self.scales.step_s).min(0.2 * self.scales.duration_s);
        let gain = self.add(role(OfInput::Gain), "gain", "", 0.0, [-0.9, 10.0], 0.1);
        let offset = self.add(role(OfInput::Offset), "offset", &unit, 0.0, UNBOUNDED, 0.1 * span);
        let delay = self.add(role(OfInput::Delay), "delay_s", "s", 0.0, [0.0, longest], self.scales.step_s);
        let lag = self.add(role(OfInput::Lag), "tau_s", "s", 0.0, [0.0, longest], self.scales.step_s);
        let [upper, lower] = self.bounds([role(OfInput::Upper), role(OfInput::Lower)], &unit, s.range);
        let most = low.abs().max(high.abs());
        let zone = self.add(role(OfInput::DeadZone), "width", &unit, 0.0, [0.0, most], 0.05 * most);
        let of = several.then_some(name.as_str());
        self.mechanism(
            "input-gain",
            of,
            &[gain],
            ["the input's gain", "What acts is the command times a factor.", "(1 + gain) u", CONTROL],
            &["sensor-gain", "inertia"],
        );
        self.mechanism(
            "input-offset",
            of,
            &[offset],
            ["the input's offset", "What acts is the command and a constant.", "u + offset", CONTROL],
            &["constant-force", "asymmetric-friction"],
        );
        self.mechanism(
            "input-delay",
            of,
            &[delay],
            ["the input's delay", "The command acts later than it is given.", "u(t - delay)", CONTROL],
            &["sensor-delay", "input-lag"],
        );
        self.mechanism(
            "input-lag",
            of,
            &[lag],
            [
                "the input's lag",
                "What acts follows the command with a first-order lag.",
                "tau du'/dt = u - u'",
                CONTROL,
            ],
            &["input-delay", "sensor-lag"],
        );
        self.mechanism(
            "input-saturation",
            of,
            &[upper, lower],
            [
                "the input's saturation",
                "Commands beyond a bound act as the bound.",
                "min(max(u, lower), upper)",
                CONTROL,
            ],
            &["quadratic-damping", "input-gain"],
        )
        .may_be_open = vec![upper.index, lower.index];
        if low < 0.0 || high > 0.0 {
            self.mechanism(
                "input-dead-zone",
                of,
                &[zone],
                [
                    "the input's dead zone",
                    "Small commands do nothing, and all others act smaller by as much.",
                    "u - width sign(u), 0 below width",
                    CONTROL,
                ],
                &["coulomb-friction", "input-gain"],
            );
        }
    }

    fn output(&mut self, output: usize) {
        let s = self.scales.outputs[output].clone();
        let (name, several) = (self.equations.outputs[output].name.clone(), self.equations.outputs.len() > 1);
        let unit = super::units::text(&name);
        let role = |r| Role::Output(output, r);
        let [low, high] = s.range;
        let span = high - low;
        let longest = (100.0 * self.scales.step_s).min(0.2 * self.scales.duration_s);
        let rate_unit = if unit.is_empty() { "1/s".to_owned() } else { format!("{unit}/s") };
        let gain = self.add(role(OfOutput::Gain), "gain", "", 0.0, [-0.9, 10.0], 0.1);
        let offset = self.add(role(OfOutput::Offset), "offset", &unit, 0.0, UNBOUNDED, 0.05 * span);
        let drift = self.add(
            role(OfOutput::Drift),
            "rate_per_s",
            &rate_unit,
            0.0,
            UNBOUNDED,
            0.05 * span / self.scales.duration_s,
        );
        let delay = self.add(role(OfOutput::Delay), "delay_s", "s", 0.0, [0.0, longest], self.scales.step_s);
        let lag = self.add(role(OfOutput::Lag), "tau_s", "s", 0.0, [0.0, longest], self.scales.step_s);
        let [upper, lower] = self.bounds([role(OfOutput::Upper), role(OfOutput::Lower)], &unit, s.range);
        let of = several.then_some(name.as_str());
        self.mechanism(
            "sensor-gain",
            of,
            &[gain],
            ["the sensor's gain", "Readings are the quantity times a factor.", "(1 + gain) y", CONTROL],
            &["input-gain"],
        );
        self.mechanism(
            "sensor-offset",
            of,
            &[offset],
            ["the sensor's offset", "Readings are the quantity and a constant.", "y + offset", CONTROL],
            &["input-offset", "constant-force"],
        );
        self.mechanism(
            "sensor-drift",
            of,
            &[drift],
            [
                "the sensor's drift",
                "Readings walk off steadily from each run's start.",
                "y + rate t",
                CONTROL,
            ],
            &["constant-force"],
        );
        self.mechanism(
            "sensor-delay",
            of,
            &[delay],
            ["the sensor's delay", "Readings are old when they come.", "y(t - delay)", CONTROL],
            &["input-delay", "sensor-lag"],
        );
        self.mechanism(
            "sensor-lag",
            of,
            &[lag],
            [
                "the sensor's lag",
                "Readings follow the quantity with a first-order lag.",
                "tau dy'/dt = y - y'",
                CONTROL,
            ],
            &["sensor-delay", "input-lag"],
        );
        self.mechanism(
            "sensor-saturation",
            of,
            &[upper, lower],
            [
                "the sensor's saturation",
                "Beyond a bound the sensor reads the bound.",
                "min(max(y, lower), upper)",
                CONTROL,
            ],
            &["end-stop"],
        );
    }

    /// An upper and a lower bound of what comes between two values: open a tenth beyond them.
    fn bounds(&mut self, [above, below]: [Role; 2], unit: &str, [low, high]: [f64; 2]) -> [ParameterRef; 2] {
        let tenth = 0.1 * (high - low);
        let upper = self.add(above, "upper", unit, high + tenth, [low, high + 2.0 * tenth], tenth);
        [upper, self.add(below, "lower", unit, low - tenth, [low - 2.0 * tenth, high], tenth)]
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

/// One over a unit.
fn per(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!("1/{unit}") }
}
