//! The equations of motion as a recording states them.

use joint_laws::signal::Between;

use super::expression::{Expression, derivative};
use super::tape::Tape;
use super::units;
use crate::recording::{Header, Memory, ReadError, Section, Source, quoted};

/// A state and its derivative.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub(super) name: String,
    pub(super) rate: Expression,
    pub(super) start: Start,
}

/// What is known of a state at a run's first row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Start {
    /// Nothing: it is fitted in each run.
    Free,
    /// Its value.
    Known(f64),
    /// It is the first value of this output.
    Measured(usize),
}

/// A measured column and what it should read.
#[derive(Debug, Clone)]
pub(super) struct Output {
    pub(super) name: String,
    pub(super) expression: Expression,
    /// The state that it is, where it is one as it stands.
    pub(super) state: Option<usize>,
}

/// A column that is known exactly.
#[derive(Debug, Clone)]
pub(super) struct Input {
    pub(super) name: String,
    pub(super) between: Between,
}

/// A parameter of the baseline.
#[derive(Debug, Clone)]
pub(super) struct Parameter {
    pub(super) name: String,
    pub(super) unit: String,
    /// Where a fit begins, or the known value.
    pub(super) value: f64,
    pub(super) bounds: [f64; 2],
    pub(super) scale: f64,
    pub(super) known: bool,
    pub(super) per_run: bool,
    /// Where fits begin in each run by its label, of a parameter that has a value in each; as `value` in a run that is not listed.
    pub(super) of_runs: Vec<(String, f64)>,
}

impl Parameter {
    /// Where fits begin in a run, if that is known better than for all.
    pub(super) fn start_of(&self, label: &str) -> Option<f64> {
        self.of_runs.iter().find(|(run, _)| run == label).map(|(_, value)| *value)
    }
}

/// Where a joint's effects may act.
#[derive(Debug, Clone)]
pub(super) struct Joint {
    pub(super) name: String,
    pub(super) position: usize,
    pub(super) velocity: usize,
    /// The input that drives it.
    pub(super) drive: Option<usize>,
    pub(super) turns: bool,
    /// Whether it is driven by the command of a position: the joint is to follow it.
    pub(super) follows: bool,
    /// Other states that its drive acts on: the joint's forces do as well.
    pub(super) reacts: Vec<usize>,
}

/// The equations, and where effects may act.
///
/// Names in expressions are states, inputs, parameters and `t_s`, in this order, and in outputs' expressions the states' derivatives.
#[derive(Debug, Clone)]
pub(super) struct Equations {
    pub(super) states: Vec<State>,
    pub(super) outputs: Vec<Output>,
    pub(super) inputs: Vec<Input>,
    pub(super) parameters: Vec<Parameter>,
    pub(super) joints: Vec<Joint>,
    /// States that hold an amount.
    pub(super) levels: Vec<usize>,
    /// The states' derivatives, and the outputs, to be evaluated.
    pub(super) rates: Tape,
    pub(super) readings: Tape,
    /// Whether any output depends on a derivative.
    pub(super) reads_rates: bool,
}

impl Equations {
    /// Reads the sections `[model]`, `[[parameter]]`, `[start]`, `[[joint]]` and `[[level]]`.
    ///
    /// # Errors
    /// [`ReadError`]: the first thing that is wrong, with what would be right.
    pub(super) fn read(header: &Header) -> Result<Self, ReadError> {
        let model = header.section("model")?;
        let states = model.section("states")?;
        let outputs = model.section("outputs")?;
        let inputs = read_inputs(&model.section("inputs")?)?;
        let parameters =
            header.root().sections("parameter")?.iter().map(read_parameter).collect::<Result<Vec<_>, _>>()?;
        let state_names = states.keys();
        if state_names.is_empty() {
            return Err(model.unfit(
                "states",
                "absent",
                "each state with its derivative, such as { x_m = \"v_m_s\" }",
            ));
        }
        if outputs.keys().is_empty() {
            return Err(model.unfit("outputs", "absent", "at least one column with its expression"));
        }
        let names: Vec<String> = state_names
            .iter()
            .chain(inputs.iter().map(|i| &i.name))
            .chain(parameters.iter().map(|p| &p.name))
            .cloned()
            .chain(["t_s".to_owned()])
            .collect();
        unlike_each_other(&model, &names)?;
        let derivatives = state_names.iter().map(|state| derivative(state));
        let output_names: Vec<String> = names.iter().cloned().chain(derivatives).collect();
        let states = state_names
            .iter()
            .map(|name| {
                let rate = expression(&states, name, &names)?;
                if let Some(other) = rate.bare_name() {
                    units::check_rate(&states, name, &names[other])?;
                }
                Ok(State { name: name.clone(), rate, start: Start::Free })
            })
            .collect::<Result<Vec<_>, ReadError>>()?;
        let outputs = outputs
            .keys()
            .iter()
            .map(|name| {
                let expression = expression(&outputs, name, &output_names)?;
                let bare = expression.bare_name();
                match bare {
                    Some(other) if other < names.len() => {
                        units::check_same(&outputs, name, &names[other])?;
                    }
                    Some(rate) => {
                        units::check_derivative(&outputs, name, &state_names[rate - names.len()])?;
                    }
                    None => {}
                }
                if names.contains(name) && bare.map(|b| &output_names[b]) != Some(name) {
                    return Err(outputs.unfit(
                        name,
                        "also the name of a state, input or parameter",
                        "a name of its own",
                    ));
                }
                Ok(Output { name: name.clone(), expression, state: bare.filter(|b| *b < states.len()) })
            })
            .collect::<Result<Vec<_>, ReadError>>()?;
        let of_motion = states.len() + inputs.len();
        let mut known: Vec<Option<f64>> = vec![None; of_motion];
        known.extend(parameters.iter().map(|p| (p.known && !p.per_run).then_some(p.value)));
        known.push(None);
        let mut stays: Vec<bool> = (0..known.len()).map(|n| n >= of_motion && n + 1 < known.len()).collect();
        let rates = Tape::new(states.iter().map(|s| &s.rate), &known, &stays);
        let (joints, levels, readings) = (Vec::new(), Vec::new(), Tape::new(std::iter::empty(), &[], &[]));
        let reads_rates = false;
        let mut equations =
            Self { states, outputs, inputs, parameters, joints, levels, rates, readings, reads_rates };
        equations.read_starts(&header.section("start")?)?;
        for section in header.root().sections("joint")? {
            let joint = equations.read_joint(&section)?;
            equations.joints.push(joint);
        }
        for section in header.root().sections("level")? {
            let level = equations.state(&section, "state")?;
            equations.levels.push(level);
        }
        equations.sense_accelerations();
        known.extend(equations.states.iter().map(|_| None));
        stays.extend(equations.states.iter().map(|_| false));
        equations.readings = Tape::new(equations.outputs.iter().map(|o| &o.expression), &known, &stays);
        let rate_names = equations.names()..known.len();
        equations.reads_rates =
            rate_names.into_iter().any(|r| equations.outputs.iter().any(|o| o.expression.has(r)));
        Ok(equations)
    }

    /// A machine with one of everything, to list what the domain knows.
    pub(super) fn example() -> Self {
        let header =
            Header::parse(Source::Memory(Memory::new("an example")), include_str!("example.toml"), false);
        // The text is the crate's own; a test reads it.
        header.and_then(|h| Self::read(&h)).unwrap_or(Self {
            states: Vec::new(),
            outputs: Vec::new(),
            inputs: Vec::new(),
            parameters: Vec::new(),
            joints: Vec::new(),
            levels: Vec::new(),
            rates: Tape::new(std::iter::empty(), &[], &[]),
            readings: Tape::new(std::iter::empty(), &[], &[]),
            reads_rates: false,
        })
    }

    /// The same equations with every state free at a run's start: for runs that begin in the middle.
    pub(super) fn free(&self) -> Self {
        let mut free = self.clone();
        free.states.iter_mut().for_each(|s| s.start = Start::Free);
        free
    }

    /// The same with inputs that are joined by straight lines.
    pub(super) fn joined(&self) -> Self {
        let mut joined = self.clone();
        joined.inputs.iter_mut().for_each(|i| i.between = Between::Linear);
        joined
    }

    /// The place of a parameter among the names of expressions.
    pub(super) fn parameter_name(&self, parameter: usize) -> usize {
        self.states.len() + self.inputs.len() + parameter
    }

    /// The place of an input among the names of expressions.
    pub(super) fn input_name(&self, input: usize) -> usize {
        self.states.len() + input
    }

    /// The place of a state's derivative among the names of outputs' expressions.
    pub(super) fn rate_name(&self, state: usize) -> usize {
        self.names() + state
    }

    /// Number of names in expressions of derivatives.
    pub(super) fn names(&self) -> usize {
        self.states.len() + self.inputs.len() + self.parameters.len() + 1
    }

    fn read_starts(&mut self, section: &Section<'_>) -> Result<(), ReadError> {
        for name in section.keys() {
            let Some(state) = self.states.iter().position(|s| s.name == name) else {
                let known: Vec<&str> = self.states.iter().map(|s| s.name.as_str()).collect();
                let expected = format!("one of the states {}", known.join(", "));
                return Err(section.unfit(&name, "no state", expected));
            };
            let expected = "a number, or \"measured\"";
            self.states[state].start = match section.number_or_text(&name, expected)? {
                Ok(value) => Start::Known(value),
                Err("measured") => match self.outputs.iter().position(|o| o.state == Some(state)) {
                    Some(output) => Start::Measured(output),
                    None => {
                        let expected = "an output that is this state as it stands";
                        return Err(section.unfit(&name, "\"measured\"", expected));
                    }
                },
                Err(other) => return Err(section.unfit(&name, quoted(other), expected)),
            };
        }
        Ok(())
    }

    fn read_joint(&self, section: &Section<'_>) -> Result<Joint, ReadError> {
        let expected = "a name, unlike the other joints'";
        let name = section.text("name", expected)?.to_owned();
        if name.is_empty() || self.joints.iter().any(|j| j.name == name) {
            return Err(section.unfit("name", quoted(&name), expected));
        }
        let (position, velocity) = (self.state(section, "position")?, self.state(section, "velocity")?);
        if position == velocity {
            return Err(section.unfit(
                "velocity",
                quoted(&self.states[velocity].name),
                "another state than position",
            ));
        }
        let drive = match section.optional_text("drive", "the name of an input")? {
            None => None,
            Some(drive) => match self.inputs.iter().position(|i| i.name == drive) {
                Some(input) => Some(input),
                None => return Err(section.unfit("drive", quoted(drive), "the name of an input")),
            },
        };
        let turns = section.flag("turns")?.unwrap_or(false);
        let acts = |state: usize| drive.is_some_and(|d| self.states[state].rate.has(self.input_name(d)));
        let mut reacts: Vec<usize> = (0..self.states.len()).filter(|s| *s != velocity && acts(*s)).collect();
        if !acts(velocity) {
            reacts.clear();
        }
        let follows = drive.is_some_and(|d| {
            let unit = units::of(&self.inputs[d].name);
            unit.is_some() && unit == units::of(&self.states[position].name)
        });
        Ok(Joint { name, position, velocity, drive, turns, follows, reacts })
    }

    fn state(&self, section: &Section<'_>, key: &str) -> Result<usize, ReadError> {
        let name = section.text(key, "the name of a state")?;
        match self.states.iter().position(|s| s.name == name) {
            Some(state) => Ok(state),
            None => {
                let known: Vec<&str> = self.states.iter().map(|s| s.name.as_str()).collect();
                Err(section.unfit(key, quoted(name), format!("one of the states {}", known.join(", "))))
            }
        }
    }
}

fn read_inputs(section: &Section<'_>) -> Result<Vec<Input>, ReadError> {
    let expected = "\"hold\" or \"linear\"";
    let one = |name: &String| {
        let between = match section.text(name, expected)? {
            "hold" => Between::Hold,
            "linear" => Between::Linear,
            other => return Err(section.unfit(name, quoted(other), expected)),
        };
        Ok(Input { name: name.clone(), between })
    };
    section.keys().iter().map(one).collect()
}

fn read_parameter(section: &Section<'_>) -> Result<Parameter, ReadError> {
    let name = section.text("name", "a name, unlike the others'")?.to_owned();
    let unit = section.optional_text("unit", "a unit, such as \"1/s\"")?.unwrap_or_default().to_owned();
    let any = [f64::NEG_INFINITY, f64::INFINITY];
    let known = section.number("value", -1e300, 1e300)?;
    let lower = section.number("lower", any[0], any[1])?.unwrap_or(any[0]);
    let upper = section.number("upper", any[0], any[1])?.unwrap_or(any[1]);
    if !(upper > lower) {
        return Err(section.unfit("upper", upper.to_string(), format!("a number above lower ({lower})")));
    }
    let start = section.number("start", lower.max(-1e300), upper.min(1e300))?;
    let value = match (known, start) {
        (Some(_), Some(_)) => {
            return Err(section.unfit("value", "given beside start", "value (known) or start (fitted)"));
        }
        (Some(value), None) => value,
        (None, Some(start)) => start,
        (None, None) => section.required("start", lower.max(-1e300), upper.min(1e300))?,
    };
    let scale = section.number("scale", f64::MIN_POSITIVE, 1e300)?;
    // A tenth of what it is, or of its range; where neither is known, a unit.
    let range = upper - lower;
    let usual = if value != 0.0 {
        0.1 * value.abs()
    } else if range.is_finite() {
        0.1 * range
    } else {
        1.0
    };
    let per_run = section.flag("per_run")?.unwrap_or(false);
    Ok(Parameter {
        name,
        unit,
        value,
        bounds: [lower, upper],
        scale: scale.unwrap_or(usual),
        known: known.is_some(),
        per_run,
        of_runs: Vec::new(),
    })
}

fn expression(section: &Section<'_>, key: &str, names: &[String]) -> Result<Expression, ReadError> {
    let text = section.text(key, "an expression")?;
    Expression::parse(text, names).map_err(|wrong| {
        section.unfit(key, quoted(text), format!("an expression (character {}: {})", wrong.at, wrong.what))
    })
}

fn unlike_each_other(model: &Section<'_>, names: &[String]) -> Result<(), ReadError> {
    for (k, name) in names.iter().enumerate() {
        let sound = name.chars().all(|c| c.is_alphanumeric() || c == '_')
            && name.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_');
        if !sound || name == "pi" || name == "run" {
            return Err(model.unfit("states", quoted(name), "names of letters, digits and underscores"));
        }
        if names[..k].contains(name) {
            return Err(model.unfit("states", format!("{} twice", quoted(name)), "names unlike each other"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_has_one_of_everything() {
        let example = Equations::example();
        assert!(!example.joints.is_empty() && !example.levels.is_empty() && !example.inputs.is_empty());
        assert!(example.joints[0].follows && example.joints[0].turns);
    }
}
