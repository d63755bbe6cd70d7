//! What an unknown law could be made of, where nothing is known but names: powers and products of the known inputs, of the
//! predicted channels and of how fast these change.

use missing_physics::model::{Quantity, SpecBuilder};

/// A variable of a term.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Variable {
    /// A known input.
    Input(usize),
    /// A predicted channel.
    Channel(usize),
    /// Its rate of change along the first input.
    Rate(usize),
}

/// What is done to the variables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    One,
    Linear,
    Square,
    Cube,
    Modulus,
    Sign,
    Product(Variable),
}

/// A candidate term: it adds `coefficient * shape(variable)` to a channel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) slot: usize,
    pub(super) channel: usize,
    variable: Variable,
    shape: Shape,
}

/// A variable with its name, unit and the size of its values.
struct Known {
    variable: Variable,
    name: String,
    unit: String,
    /// For a rate: the unit that it is divided by.
    per: Option<String>,
    size: f64,
}

impl Known {
    /// Its units, each with whether it divides.
    fn units(&self) -> impl Iterator<Item = (&str, bool)> {
        [(self.unit.as_str(), false)].into_iter().chain(self.per.as_deref().map(|u| (u, true)))
    }
}

/// Names, units and the size of values of what was measured or is known.
pub(super) struct Sizes<'a> {
    pub(super) inputs: &'a [(Quantity, f64)],
    pub(super) channels: &'a [(Quantity, f64)],
    /// Whether rates along the first input make sense, and its extent.
    pub(super) extent: Option<f64>,
}

/// More variables than these make too many products to tell apart.
const MOST_VARIABLES: usize = 8;

/// Adds the candidate terms of every channel to a specification.
pub(super) fn add(b: &mut SpecBuilder, sizes: &Sizes<'_>) -> Vec<Candidate> {
    let known = variables(sizes);
    let mut candidates = Vec::new();
    for (channel, (quantity, typical)) in sizes.channels.iter().enumerate() {
        let mut term = |variable, shape, formula: String, size: f64, of: &[&Known]| {
            let scale = 0.1 * typical / size;
            if !(scale.is_finite() && scale > 0.0) {
                return;
            }
            let mut names: Vec<String> = of.iter().map(|k| k.name.clone()).collect();
            names.dedup();
            let unit = if shape == Shape::Sign { quantity.unit.clone() } else { unit_of(quantity, of) };
            let name = format!("factor of {formula}");
            let at = b.shared(&name, &unit, 0.0, [-1e4 * scale, 1e4 * scale], scale);
            candidates.push(Candidate { slot: at.slot, channel, variable, shape });
            b.term(at, formula, quantity.clone(), names);
        };
        term(Variable::Channel(channel), Shape::One, "1".into(), 1.0, &[]);
        for (i, k) in known.iter().enumerate() {
            let (n, s, v) = (&k.name, k.size, k.variable);
            term(v, Shape::Linear, n.clone(), s, &[k]);
            term(v, Shape::Square, format!("{n}^2"), s * s, &[k, k]);
            term(v, Shape::Cube, format!("{n}^3"), s * s * s, &[k, k, k]);
            term(v, Shape::Modulus, format!("|{n}| {n}"), s * s, &[k, k]);
            term(v, Shape::Sign, format!("sign({n})"), 1.0, &[k]);
            for other in &known[i + 1..] {
                let formula = format!("{n} * {}", other.name);
                term(v, Shape::Product(other.variable), formula, s * other.size, &[k, other]);
            }
        }
    }
    candidates
}

/// The unit of a coefficient: that of the channel over those of the variables, with what stands above and below left out.
fn unit_of(channel: &Quantity, variables: &[&Known]) -> String {
    let mut above: Vec<&str> = vec![&channel.unit];
    let mut below: Vec<&str> = Vec::new();
    for part in variables.iter().flat_map(|k| k.units()) {
        let (into, out_of, unit) = match part {
            (unit, false) => (&mut below, &mut above, unit),
            (unit, true) => (&mut above, &mut below, unit),
        };
        match out_of.iter().position(|u| *u == unit) {
            Some(at) => _ = out_of.remove(at),
            None => into.push(unit),
        }
    }
    above.retain(|u| !u.is_empty());
    below.retain(|u| !u.is_empty());
    match (above.join(" "), below.join(" ")) {
        (above, below) if below.is_empty() => above,
        (above, below) => {
            let above = if above.is_empty() { "1" } else { &above };
            let (open, close) = if below.contains([' ', '/']) { ("(", ")") } else { ("", "") };
            format!("{above}/{open}{below}{close}")
        }
    }
}

fn variables(sizes: &Sizes<'_>) -> Vec<Known> {
    let mut known = Vec::new();
    let mut add = |variable, name: String, unit: &str, per: Option<&str>, size: f64| {
        if size > 0.0 && size.is_finite() && known.len() < MOST_VARIABLES {
            known.push(Known { variable, name, unit: unit.into(), per: per.map(str::to_owned), size });
        }
    };
    for (i, (quantity, size)) in sizes.inputs.iter().enumerate() {
        add(Variable::Input(i), quantity.name.clone(), &quantity.unit, None, *size);
    }
    for (c, (quantity, size)) in sizes.channels.iter().enumerate() {
        add(Variable::Channel(c), format!("sim_{}", quantity.name), &quantity.unit, None, *size);
    }
    if let (Some(extent), Some((along, _))) = (sizes.extent, sizes.inputs.first()) {
        for (c, (quantity, size)) in sizes.channels.iter().enumerate() {
            let name = format!("d(sim_{})/d({})", quantity.name, along.name);
            add(Variable::Rate(c), name, &quantity.unit, Some(&along.unit), size / extent * 10.0);
        }
    }
    known
}

impl Candidate {
    /// Adds the term to its channel; `predicted` holds all channels as the simulator gave them.
    pub(super) fn apply(&self, coefficient: f64, inputs: &[Vec<f64>], predicted: &[f64], out: &mut [f64]) {
        let rows = inputs.first().map_or(0, Vec::len);
        let value = |variable: Variable, i: usize| match variable {
            Variable::Input(k) => inputs[k][i],
            Variable::Channel(c) => predicted[c * rows + i],
            Variable::Rate(c) => rate(&inputs[0], &predicted[c * rows..(c + 1) * rows], i),
        };
        for (i, out) in out[self.channel * rows..(self.channel + 1) * rows].iter_mut().enumerate() {
            let v = || value(self.variable, i);
            *out += coefficient
                * match self.shape {
                    Shape::One => 1.0,
                    Shape::Linear => v(),
                    Shape::Square => v() * v(),
                    Shape::Cube => v().powi(3),
                    Shape::Modulus => v().abs() * v(),
                    Shape::Sign if v() == 0.0 => 0.0,
                    Shape::Sign => v().signum(),
                    Shape::Product(other) => v() * value(other, i),
                };
        }
    }
}

/// Rate of change at a row: the slope of the parabola through it and its neighbours, one-sided at the ends.
pub(super) fn rate(x: &[f64], y: &[f64], i: usize) -> f64 {
    let slope = |a: usize, b: usize| (y[b] - y[a]) / (x[b] - x[a]);
    match (i > 0, i + 1 < x.len()) {
        (true, true) => {
            let (before, after) = (x[i] - x[i - 1], x[i + 1] - x[i]);
            (slope(i - 1, i) * after + slope(i, i + 1) * before) / (before + after)
        }
        (true, false) => slope(i - 1, i),
        (false, true) => slope(i, i + 1),
        (false, false) => 0.0,
    }
}
