//! What acts on the joints and inputs of somebody else's simulator: forces as text, which the simulator evaluates at its own steps, and
//! inputs as a drive passes them on.

use joint_laws::signal::{Between, Drive, Signal};
use missing_physics::data::Run;
use missing_physics::model::{Quantity, SpecBuilder, UNBOUNDED};
use serde::Serialize;

use super::carrier::{Carrier, Part};
use crate::mechanics::{self, Clock, InputEffect, JointEffect, JointHas, JointSizes, JointUnits};
use crate::recording::{Header, ReadError, Section, quoted};

/// A lag below this part of the time between rows is a delay.
const SHORTEST_LAG: f64 = 0.25;
/// The range of a joint of which nothing was measured.
const UNKNOWN: [f64; 2] = [-1e12, 1e12];
/// Speeds are differences over this part of a run.
const SPEED_OVER: usize = 100;

/// What acts on a joint beside what its simulator knows, as expressions in `x` (position), `v` (velocity) and `u` (the driving force).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct JointForce {
    /// A force that adds to all others.
    pub force: String,
    /// The modulus of a friction that opposes the motion, and holds at rest what is below it; at least 0.
    pub friction: String,
}

/// What a shared parameter is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Joint(usize, JointEffect),
    Input(usize, InputEffect),
}

/// An input that drives the simulator.
#[derive(Debug)]
struct Input {
    /// Its number among the inputs.
    column: usize,
    between: Between,
    range: [f64; 2],
}

/// The joints and inputs that a recording speaks of.
#[derive(Debug, Default)]
pub(super) struct Machine {
    names: Vec<String>,
    joints: Vec<JointSizes>,
    inputs: Vec<Input>,
    parts: Vec<Part<Role>>,
    step_s: f64,
}

/// Reads what a recording says of its simulator's joints and inputs, and declares what may act on them.
pub(super) fn declare(
    header: &Header,
    b: &mut SpecBuilder,
    inputs: &[Quantity],
    channels: &[Quantity],
    runs: &[Run],
) -> Result<Machine, ReadError> {
    let mut machine = Machine::default();
    let declared: Vec<String> = b.so_far().mechanisms.iter().map(|m| m.id.clone()).collect();
    let clock = Clock::of(runs);
    machine.step_s = clock.step_s;
    let sections = header.root().sections("joint")?;
    for section in &sections {
        let expected = "a name, unlike the other joints'";
        let name = section.text("name", expected)?;
        if name.is_empty() || machine.names.iter().any(|n| n == name) {
            return Err(section.unfit("name", quoted(name), expected));
        }
        let (sizes, has) = joint(header, section, channels, runs, clock.step_s)?;
        let without = section.texts("without")?.unwrap_or_default();
        let at = machine.joints.len();
        let mut carrier = Carrier {
            b,
            parts: &mut machine.parts,
            of: (sections.len() > 1).then_some(name),
            role: |effect| Role::Joint(at, effect),
            but: declared.iter().map(String::as_str).chain(without).collect(),
            unasked: false,
        };
        mechanics::joints(&mut carrier, &sizes, has);
        machine.joints.push(sizes);
        machine.names.push(name.to_owned());
    }
    let driving = driving(header, inputs, runs)?;
    for input in &driving {
        let at = machine.inputs.len();
        let quantity = &inputs[input.column];
        let mut carrier = Carrier {
            b,
            parts: &mut machine.parts,
            of: (driving.len() > 1).then_some(quantity.name.as_str()),
            role: |effect| Role::Input(at, effect),
            but: declared.iter().map(String::as_str).collect(),
            unasked: false,
        };
        mechanics::inputs(&mut carrier, &quantity.unit, input.range, clock.step_s, clock.longest_s());
        machine.inputs.push(Input { ..*input });
    }
    Ok(machine)
}

/// The sizes of a joint's motion, and what makes sense for it.
fn joint(
    header: &Header,
    section: &Section<'_>,
    channels: &[Quantity],
    runs: &[Run],
    step_s: f64,
) -> Result<(JointSizes, JointHas), ReadError> {
    let position = section.text("position", "the name of its position")?;
    let channel = channels.iter().position(|c| c.name == position);
    let (measured_range, measured_speed) = match channel {
        Some(channel) => (span(runs, channel), speed(runs, channel)),
        None => (None, None),
    };
    let range = match section.list("range", UNBOUNDED[0], UNBOUNDED[1])? {
        Some(list) if list.len() == 2 && list[0] < list[1] => Some([list[0], list[1]]),
        Some(list) => {
            let got = format!("a list of {}", list.len());
            return Err(section.unfit("range", got, "two rising numbers: between which positions it moves"));
        }
        None => measured_range,
    };
    let missing = |key: &str, what: &str| {
        let expected = format!("{what}: {} is no channel that was measured and moves", quoted(position));
        section.unfit(key, "absent", expected)
    };
    // What is to be predicted has the speeds of what was diagnosed, and nothing is fitted to it.
    let unknown = channel.is_some() && header.gaps();
    let range = range.or(unknown.then_some(UNKNOWN)).ok_or_else(|| missing("range", "two rising numbers"))?;
    let speed = section
        .number("speed", f64::MIN_POSITIVE, f64::MAX)?
        .or(measured_speed)
        .or(unknown.then_some(1.0))
        .ok_or_else(|| missing("speed", "a typical speed"))?;
    let force = section.required("typical_force", f64::MIN_POSITIVE, f64::MAX)?;
    let force_unit = section.optional_text("force_unit", "a unit, such as \"N m\"")?.unwrap_or_default();
    let unit = match channel {
        Some(channel) => channels[channel].unit.clone(),
        None => section.optional_text("unit", "a unit, such as \"rad\"")?.unwrap_or_default().to_owned(),
    };
    let has = JointHas { drive: section.flag("driven")?.unwrap_or(false), ..JointHas::default() };
    let turns = section.flag("turns")?.unwrap_or(false);
    let reach = range[0].abs().max(range[1].abs());
    let units = units(&unit, force_unit);
    Ok((JointSizes { force, speed, reach, range, step_s, turns, units }, has))
}

/// Units of what multiplies powers of speed and position to a force.
fn units(position: &str, force: &str) -> JointUnits {
    let speed = if position.is_empty() { "1/s".to_owned() } else { format!("{position}/s") };
    let over = |of: &str, power: usize| match (of.is_empty(), power) {
        (true, _) => force.to_owned(),
        (false, 1) => format!("{force} per {of}"),
        (false, _) if of.contains(['/', ' ']) => format!("{force} per ({of})^{power}"),
        (false, _) => format!("{force} per {of}^{power}"),
    };
    JointUnits {
        damping: [1, 2, 3].map(|power| over(&speed, power)),
        stiffness: [1, 2, 3].map(|power| over(position, power)),
        position: position.to_owned(),
        force: force.to_owned(),
        speed,
    }
}

/// Smallest and largest reading of a channel, where they differ.
fn span(runs: &[Run], channel: usize) -> Option<[f64; 2]> {
    let readings = runs.iter().flat_map(|run| run.outputs[channel].iter().copied()).filter(|v| v.is_finite());
    let [low, high] =
        readings.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
    (low < high).then_some([low, high])
}

/// Root mean square of a channel's differences over time.
fn speed(runs: &[Run], channel: usize) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0usize);
    for run in runs {
        let (t, y) = (&run.inputs[0], &run.outputs[channel]);
        let apart = t.len().div_ceil(SPEED_OVER).max(1);
        for i in apart..t.len() {
            let slope = (y[i] - y[i - apart]) / (t[i] - t[i - apart]);
            if slope.is_finite() {
                sum += slope * slope;
                count += 1;
            }
        }
    }
    let mean = sum / count.max(1) as f64;
    (mean > 0.0).then(|| mean.sqrt())
}

/// The inputs of which a recording says what they are between rows.
fn driving(header: &Header, inputs: &[Quantity], runs: &[Run]) -> Result<Vec<Input>, ReadError> {
    let mut found = Vec::new();
    for (column, section) in header.root().sections("input")?.iter().enumerate() {
        let expected = "\"hold\" (a value lasts until the next row) or \"linear\" (straight lines join them)";
        let between = match section.optional_text("acts", expected)? {
            None => continue,
            Some("hold") => Between::Hold,
            Some("linear") => Between::Linear,
            Some(other) => return Err(section.unfit("acts", quoted(other), expected)),
        };
        let rises = |run: &Run| run.inputs[0].windows(2).all(|w| w[0] < w[1]);
        if column == 0 || inputs[0].name != "t_s" || !runs.iter().all(rises) {
            let expected = "no such key, unless the first input is t_s and rises in every run";
            return Err(section.unfit("acts", "given", expected));
        }
        let values = runs.iter().flat_map(|run| run.inputs[column].iter().copied());
        let [low, high] =
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
        // One that never changes shows little of what is done to it, and has no range.
        if low < high {
            found.push(Input { column, between, range: [low, high] });
        }
    }
    Ok(found)
}

impl Machine {
    /// Whether there are neither joints nor inputs that drive.
    pub(super) fn is_empty(&self) -> bool {
        self.joints.is_empty() && self.inputs.is_empty()
    }

    /// The joints' names.
    pub(super) fn joints(&self) -> &[String] {
        &self.names
    }

    /// The values of its parameters: inputs' first, then joints'.
    pub(super) fn values(&self, shared: &[f64]) -> impl Iterator<Item = f64> {
        self.sorted().map(|part| shared[part.slot])
    }

    /// How many of those are the inputs'.
    pub(super) fn of_inputs(&self) -> usize {
        self.parts.iter().filter(|p| matches!(p.role, Role::Input(..))).count()
    }

    fn sorted(&self) -> impl Iterator<Item = &Part<Role>> {
        let of_input = |p: &&Part<Role>| matches!(p.role, Role::Input(..));
        self.parts.iter().filter(of_input).chain(self.parts.iter().filter(move |p| !of_input(p)))
    }

    /// Why nothing can be predicted at [`values`](Self::values), where that is so: on which side of a joint a stop stands is known by its range.
    pub(super) fn unknown(&self, values: &[f64]) -> Option<String> {
        let stands = |(part, v): (&Part<Role>, &f64)| match part.role {
            Role::Joint(joint, JointEffect::StopStiffness) if *v != part.off => Some(joint),
            _ => None,
        };
        let mut stops = self.sorted().zip(values).filter_map(stands);
        let joint = stops.find(|joint| self.joints[*joint].range == UNKNOWN)?;
        Some(format!("the joint {} has an end stop: its range has to be stated", quoted(&self.names[joint])))
    }

    /// What acts on each joint at [`values`](Self::values).
    pub(super) fn forces(&self, values: &[f64]) -> Vec<JointForce> {
        (0..self.joints.len()).map(|joint| self.force(joint, values)).collect()
    }

    fn force(&self, joint: usize, values: &[f64]) -> JointForce {
        let value = |effect: JointEffect| {
            self.sorted().zip(values).find(|(p, _)| p.role == Role::Joint(joint, effect)).map(|(_, v)| *v)
        };
        let shape = |effect: JointEffect| number(value(effect).unwrap_or(1.0));
        let (mut force, mut friction) = (Vec::new(), Vec::new());
        for (part, v) in self.sorted().zip(values) {
            let Role::Joint(of, effect) = part.role else { continue };
            if of != joint || *v == part.off {
                continue;
            }
            let (plus, minus) = (number(*v), number(-v));
            let [low, high] = self.joints[joint].range;
            match effect {
                JointEffect::Coulomb => friction.push(plus),
                JointEffect::Asymmetry => friction.push(format!("{} * sign(v)", number(0.5 * v))),
                JointEffect::StribeckLevel => {
                    let speed = shape(JointEffect::StribeckSpeed);
                    friction.push(format!("{plus} * exp(-(v / {speed}) * (v / {speed}))"));
                }
                JointEffect::LoadFraction => friction.push(format!("{plus} * abs(u)")),
                JointEffect::Damping(power) => {
                    let by = ["v", "abs(v) * v", "v * v * v"][power.min(2)];
                    force.push(format!("{minus} * {by}"));
                }
                JointEffect::Stiffness(power) => {
                    let by = ["x", "x * x", "x * x * x"][power.min(2)];
                    force.push(format!("{minus} * {by}"));
                }
                JointEffect::Constant => force.push(plus),
                JointEffect::CogAmplitude => {
                    let [phase, periods] = [JointEffect::CogPhase, JointEffect::CogPeriods].map(shape);
                    force.push(format!("{plus} * sin({periods} * x + {phase})"));
                }
                JointEffect::StopStiffness => {
                    // A stop stands on the side of the middle where its position is.
                    let at = value(JointEffect::StopPosition).unwrap_or(high);
                    let side = if at > 0.5 * (low + high) { "max" } else { "min" };
                    force.push(format!("{minus} * {side}(x - {}, 0)", number(at)));
                }
                // They shape what others switch on, or are not declared.
                JointEffect::StribeckSpeed
                | JointEffect::CogPhase
                | JointEffect::CogPeriods
                | JointEffect::StopPosition
                | JointEffect::Gap
                | JointEffect::Inertia
                | JointEffect::YieldStiffness
                | JointEffect::Yield => {}
            }
        }
        let sum = |terms: Vec<String>| if terms.is_empty() { "0".to_owned() } else { terms.join(" + ") };
        let friction = if friction.is_empty() { "0".into() } else { format!("max({}, 0)", sum(friction)) };
        JointForce { force: sum(force), friction }
    }

    /// The inputs as they act at [`values`](Self::values), where they are not as they were recorded.
    ///
    /// Of one that holds from row to row, integral and first moment are kept: a delay by a part of a row is passed on in parts, the mean over
    /// the time to the next row and, where the signal changes within that, a little of it in the rows beside.
    pub(super) fn inputs(&self, values: &[f64], run: &Run) -> Option<Vec<Vec<f64>>> {
        let mut acting: Option<Vec<Vec<f64>>> = None;
        for (at, input) in self.inputs.iter().enumerate() {
            let mut drive = Drive::<f64>::perfect();
            let mut changed = false;
            for (part, v) in self.sorted().zip(values) {
                let Role::Input(of, effect) = part.role else { continue };
                if of != at || *v == part.off {
                    continue;
                }
                changed = true;
                match effect {
                    InputEffect::Gain => drive.gain = *v,
                    InputEffect::Offset => drive.offset = *v,
                    InputEffect::Delay => drive.delay_s = *v,
                    InputEffect::Lag => drive.lag_s = Some(*v),
                    InputEffect::Upper => drive.upper = *v,
                    InputEffect::Lower => drive.lower = *v,
                    InputEffect::DeadZone => drive.dead_zone = *v,
                }
            }
            if changed {
                let (times, commands) = (&run.inputs[0], &run.inputs[input.column]);
                let shortest_s = SHORTEST_LAG * self.step_s;
                let signal = Signal::new(times, commands, input.between, &drive, shortest_s);
                acting.get_or_insert_with(|| run.inputs.clone())[input.column] =
                    by_rows(&signal, times, input.between);
            }
        }
        acting
    }

    /// Where to begin fitting a mechanism with these parameters.
    pub(super) fn starts(&self, parameters: &[usize]) -> Vec<Vec<(usize, f64)>> {
        let first = parameters.first().and_then(|first| self.parts.iter().find(|p| p.index == *first));
        match first.map(|part| part.role) {
            Some(Role::Joint(joint, effect)) => {
                let sizes = &self.joints[joint];
                mechanics::joint_starts(effect, parameters, sizes)
            }
            Some(Role::Input(input, effect)) => {
                mechanics::input_starts(effect, parameters, self.inputs[input].range, self.step_s)
            }
            None => Vec::new(),
        }
    }
}

/// A number within an expression, to its last digit.
fn number(value: f64) -> String {
    if value < 0.0 { format!("({value:?})") } else { format!("{value:?}") }
}

/// What a signal is in each row: its value there, or what keeps its integral and its first moment where it holds until the next row.
fn by_rows(signal: &Signal<f64>, times: &[f64], between: Between) -> Vec<f64> {
    let begins: Vec<f64> = signal.begins().collect();
    let at = |t: f64| signal.value(begins.partition_point(|b| *b <= t), t);
    if between == Between::Linear {
        return times.iter().map(|t| at(*t)).collect();
    }
    // Integral over a row, and its first moment about the middle of it.
    let moments = |from: f64, to: f64| {
        let (mut begin, mut sums) = (from, [0.0; 2]);
        let mut piece = begins.partition_point(|b| *b <= from);
        while begin < to {
            let end = begins.get(piece).copied().unwrap_or(to).min(to);
            let middle = 0.5 * (begin + end);
            // Simpson's rule: exact where a piece is straight.
            for (t, weight) in [(begin, 1.0), (middle, 4.0), (end, 1.0)] {
                let part = weight * (end - begin) / 6.0 * signal.value(piece, t);
                sums[0] += part;
                sums[1] += part * (t - 0.5 * (from + to));
            }
            (begin, piece) = (end, piece + 1);
        }
        sums
    };
    let spans: Vec<[f64; 2]> = times.windows(2).map(|w| [w[0], w[1]]).collect();
    let moments: Vec<[f64; 2]> = spans.iter().map(|[from, to]| moments(*from, *to)).collect();
    let length = |k: usize| spans[k][1] - spans[k][0];
    let mut rows: Vec<f64> = (0..spans.len()).map(|k| moments[k][0] / length(k)).collect();
    for k in 1..spans.len().saturating_sub(1) {
        let [before, after] = [k - 1, k + 1].map(|k| 0.5 * (spans[k][0] + spans[k][1]));
        let moved = moments[k][1] / (after - before);
        rows[k - 1] -= moved / length(k - 1);
        rows[k + 1] += moved / length(k + 1);
    }
    rows.extend(times.last().map(|t| at(*t)));
    rows
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;
    use crate::recording::{Memory, Source};
    use approx::assert_abs_diff_eq;
    use missing_physics::model::{Scope, Spec};

    const JOINT: &str = "[[joint]]\nname = \"hinge\"\nposition = \"angle_rad\"\ntypical_force = 2.0\nforce_unit = \"N m\"\n\
                         turns = true\ndriven = true\n";

    /// A machine whose angle swings between -1 and 1 rad, and whose command steps from 0 to 1 at the fourth of eight rows.
    fn machine(more: &str) -> Result<(Machine, Spec, Run), ReadError> {
        let header =
            format!("[[input]]\nname = \"t_s\"\n[[input]]\nname = \"command_v\"\nunit = \"V\"\n{more}");
        let memory = Memory::new("m")
            .with_file("recording.toml", format!("format = 1\ndomain = \"custom\"\n{header}"));
        let header = Header::read(&Source::Memory(memory)).unwrap();
        let t: Vec<f64> = (0..8).map(|i| 0.1 * f64::from(i)).collect();
        let command = (0..8).map(|i| if i < 3 { 0.0 } else { 1.0 }).collect();
        let angle = (0..8).map(|i| if i % 2 == 0 { -1.0 } else { 1.0 }).collect();
        let run = Run { label: "1".into(), inputs: vec![t, command], outputs: vec![angle], kind: 0 };
        let mut b = SpecBuilder::default();
        let inputs = [Quantity::new("t_s", "s"), Quantity::new("command_v", "V")];
        let channels = [Quantity::new("angle_rad", "rad")];
        let machine = declare(&header, &mut b, &inputs, &channels, std::slice::from_ref(&run))?;
        Ok((machine, b.build().unwrap(), run))
    }

    /// What acts where these parameters of a mechanism have these values.
    fn values(machine: &Machine, spec: &Spec, mechanism: &str, set: &[f64]) -> Vec<f64> {
        let mut shared = spec.starts(Scope::Shared);
        let parameters = &spec.mechanisms.iter().find(|m| m.id == mechanism).unwrap().parameters;
        for (index, value) in parameters.iter().zip(set) {
            shared[*index] = *value;
        }
        machine.values(&shared).collect()
    }

    #[test]
    fn each_force_is_written_as_its_law() {
        let (machine, spec, _) = machine(JOINT).unwrap();
        for (mechanism, set, force, friction) in [
            ("coulomb-friction", &[0.25][..], "0", "max(0.25, 0)"),
            ("asymmetric-friction", &[-0.5], "0", "max((-0.25) * sign(v), 0)"),
            ("stribeck-friction", &[0.5, 0.125], "0", "max(0.5 * exp(-(v / 0.125) * (v / 0.125)), 0)"),
            ("load-dependent-friction", &[0.1], "0", "max(0.1 * abs(u), 0)"),
            ("viscous-friction", &[0.5], "(-0.5) * v", "0"),
            ("quadratic-damping", &[0.5], "(-0.5) * abs(v) * v", "0"),
            ("cubic-stiffness", &[-2.0], "2.0 * x * x * x", "0"),
            ("constant-force", &[1e-9], "1e-9", "0"),
            ("cogging", &[0.1, -0.5, 6.0], "0.1 * sin(6.0 * x + (-0.5))", "0"),
            ("end-stop", &[0.75, 8.0], "(-8.0) * max(x - 0.75, 0)", "0"),
            ("end-stop", &[-0.75, 8.0], "(-8.0) * min(x - (-0.75), 0)", "0"),
        ] {
            let forces = machine.forces(&values(&machine, &spec, mechanism, set));
            assert_eq!(
                (forces[0].force.as_str(), forces[0].friction.as_str()),
                (force, friction),
                "{mechanism}"
            );
        }
        let damping = spec.mechanisms.iter().find(|m| m.id == "quadratic-damping").unwrap();
        assert_eq!(spec.parameters[damping.parameters[0]].unit, "N m per (rad/s)^2");
        let off: Vec<f64> = machine.values(&spec.starts(Scope::Shared)).collect();
        assert_eq!(machine.forces(&off)[0], JointForce { force: "0".into(), friction: "0".into() });
    }

    /// A held command that comes half a row late acts by halves in one row; between rows joined by lines it is itself, earlier.
    #[test]
    fn inputs_act_as_a_drive_passes_them_on() {
        let acts = |between: &str, mechanism: &str, set: &[f64]| {
            let text = format!("acts = \"{between}\"\n");
            let (machine, spec, run) = machine(&text).unwrap();
            machine.inputs(&values(&machine, &spec, mechanism, set), &run).unwrap().swap_remove(1)
        };
        let expect = |found: Vec<f64>, expected: [f64; 8]| {
            for (a, b) in found.iter().zip(expected) {
                assert_abs_diff_eq!(*a, b, epsilon = 1e-12);
            }
        };
        // Half of it is there in the row, and a sixteenth passes from the row before to the row after, which keeps the moment.
        let late = acts("hold", "input-delay", &[0.05]);
        expect(late.clone(), [0.0, 0.0, -0.0625, 0.5, 1.0625, 1.0, 1.0, 1.0]);
        let moment: f64 = late[..7].iter().enumerate().map(|(k, u)| 0.1 * u * (0.1 * k as f64 + 0.05)).sum();
        assert_abs_diff_eq!(moment, 0.5 * (0.7 * 0.7 - 0.35 * 0.35), epsilon = 1e-12);
        expect(acts("linear", "input-delay", &[0.05]), [0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0]);
        expect(acts("hold", "input-gain", &[0.5]), [0.0, 0.0, 0.0, 1.5, 1.5, 1.5, 1.5, 1.5]);
        expect(
            acts("hold", "input-saturation", &[0.75, -0.1]),
            [0.0, 0.0, 0.0, 0.75, 0.75, 0.75, 0.75, 0.75],
        );
        let lag = acts("hold", "input-lag", &[0.1]);
        // The integral of 1 - exp(-t / tau) over four rows as long as tau.
        assert_abs_diff_eq!(lag[..7].iter().sum::<f64>(), 4.0 - 1.0 + (-4.0_f64).exp(), epsilon = 2e-3);
        let (machine, spec, run) = machine("acts = \"hold\"\n").unwrap();
        assert_eq!(
            machine.inputs(&machine.values(&spec.starts(Scope::Shared)).collect::<Vec<_>>(), &run),
            None
        );
    }

    /// A stop's side of a joint that nothing was measured of is not guessed.
    #[test]
    fn a_stop_needs_a_range() {
        let (mut machine, spec, _) = machine(JOINT).unwrap();
        let stop = values(&machine, &spec, "end-stop", &[0.5, 2.0]);
        assert_eq!(machine.unknown(&stop), None);
        machine.joints[0].range = UNKNOWN;
        assert!(machine.unknown(&stop).unwrap().contains("hinge"));
        assert_eq!(machine.unknown(&values(&machine, &spec, "coulomb-friction", &[0.5])), None);
    }

    #[test]
    fn what_is_declared_or_done_without_is_not_tried() {
        let (_, spec, _) = machine(&format!("{JOINT}without = [\"cogging\", \"stiffness\"]\n")).unwrap();
        let ids: Vec<&str> = spec.mechanisms.iter().map(|m| m.id.as_str()).collect();
        assert!(
            ids.contains(&"coulomb-friction") && !ids.contains(&"cogging") && !ids.contains(&"stiffness")
        );
        let second = JOINT.replace("hinge", "wrist");
        let (_, spec, _) = machine(&format!("{JOINT}{second}")).unwrap();
        assert!(spec.mechanisms.iter().any(|m| m.id == "coulomb-friction@wrist"));
    }

    #[test]
    fn what_is_wrong_with_a_joint_or_an_input_is_said() {
        let says = |more: &str| machine(more).err().map(|e| e.to_string()).unwrap();
        for (text, word) in [
            (JOINT.replace("typical_force = 2.0\n", ""), "typical_force"),
            (JOINT.replace("angle_rad", "place_rad"), "range"),
            (JOINT.replace("typical_force = 2.0", "typical_force = 2.0\nrange = [1.0, 1.0]"), "rising"),
            (format!("{JOINT}{JOINT}"), "unlike the other joints'"),
            ("acts = \"step\"\n".into(), "hold"),
        ] {
            assert!(says(&text).contains(word), "{}", says(&text));
        }
    }
}
