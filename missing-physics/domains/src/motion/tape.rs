//! Expressions of many quantities, evaluated together: what they have in common is computed once, and what only parameters enter once a
//! prediction.

use joint_laws::Number;

use super::expression::{Expression, One, Step, Two, one, two};

/// Where a value stands: a number that is known, or a register.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    Number(f64),
    Register(usize),
}

/// What a register holds, of others before it.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Op {
    Constant(f64),
    Negate(usize),
    /// `a + v`.
    Shift(usize, f64),
    /// `a v`.
    Scale(usize, f64),
    /// `v / a`.
    Over(f64, usize),
    Whole(usize, i32),
    One(One, usize),
    Two(Two, usize, usize),
}

impl Op {
    /// The registers that it reads.
    fn operands(self) -> impl Iterator<Item = usize> {
        let (first, second) = match self {
            Self::Constant(_) => (None, None),
            Self::Negate(a) | Self::Shift(a, _) | Self::Scale(a, _) | Self::Over(_, a) => (Some(a), None),
            Self::Whole(a, _) | Self::One(_, a) => (Some(a), None),
            Self::Two(_, a, b) => (Some(a), Some(b)),
        };
        first.into_iter().chain(second)
    }
}

/// Expressions as a list of operations on registers: the first of these hold what names stand for.
#[derive(Debug, Clone)]
pub(super) struct Tape {
    names: usize,
    ops: Vec<Op>,
    /// Operations that only parameters enter, and the others, in order.
    still: Vec<usize>,
    moving: Vec<usize>,
    results: Vec<Place>,
}

impl Tape {
    /// Of expressions in names: of each, its value where that is known for good, and whether it stays the same all through a prediction.
    pub(super) fn new<'a>(
        expressions: impl Iterator<Item = &'a Expression>,
        known: &[Option<f64>],
        stays: &[bool],
    ) -> Self {
        let names = known.len();
        let mut tape =
            Self { names, ops: Vec::new(), still: Vec::new(), moving: Vec::new(), results: Vec::new() };
        for expression in expressions {
            let mut stack: Vec<Place> = Vec::new();
            for step in expression.steps() {
                let place = tape.place(*step, &mut stack, known);
                stack.push(place);
            }
            tape.results.push(stack.pop().unwrap_or(Place::Number(f64::NAN)));
        }
        let mut same: Vec<bool> = stays.to_vec();
        for (k, op) in tape.ops.iter().enumerate() {
            let stays = op.operands().all(|a| same[a]);
            same.push(stays);
            if stays { &mut tape.still } else { &mut tape.moving }.push(k);
        }
        tape
    }

    /// Number of registers.
    pub(super) fn registers(&self) -> usize {
        self.names + self.ops.len()
    }

    fn place(&mut self, step: Step, stack: &mut Vec<Place>, known: &[Option<f64>]) -> Place {
        let mut pop = || stack.pop().unwrap_or(Place::Number(f64::NAN));
        match step {
            Step::Number(v) => Place::Number(v),
            Step::Name(name) => known[name].map_or(Place::Register(name), Place::Number),
            Step::Negate => match pop() {
                Place::Number(v) => Place::Number(-v),
                Place::Register(a) => self.push(Op::Negate(a)),
            },
            Step::Whole(n) => match pop() {
                Place::Number(v) => Place::Number(v.powi(n)),
                Place::Register(a) if n == 2 => self.push(Op::Two(Two::Multiply, a, a)),
                Place::Register(a) => self.push(Op::Whole(a, n)),
            },
            Step::One(f) => match pop() {
                Place::Number(v) => Place::Number(one(f, v)),
                Place::Register(a) => self.push(Op::One(f, a)),
            },
            Step::Two(f) => {
                let b = pop();
                let a = pop();
                self.both(f, a, b)
            }
        }
    }

    fn both(&mut self, f: Two, a: Place, b: Place) -> Place {
        match (f, a, b) {
            (_, Place::Number(a), Place::Number(b)) => Place::Number(two(f, a, b)),
            (Two::Add, Place::Register(a), Place::Number(v))
            | (Two::Add, Place::Number(v), Place::Register(a)) => self.push(Op::Shift(a, v)),
            (Two::Subtract, Place::Register(a), Place::Number(v)) => self.push(Op::Shift(a, -v)),
            (Two::Multiply, Place::Register(a), Place::Number(v))
            | (Two::Multiply, Place::Number(v), Place::Register(a)) => self.push(Op::Scale(a, v)),
            (Two::Divide, Place::Register(a), Place::Number(v)) if v != 0.0 => {
                self.push(Op::Scale(a, v.recip()))
            }
            (Two::Divide, Place::Number(v), Place::Register(a)) => self.push(Op::Over(v, a)),
            _ => {
                let (a, b) = (self.register(a), self.register(b));
                self.push(Op::Two(f, a, b))
            }
        }
    }

    fn register(&mut self, place: Place) -> usize {
        match place {
            Place::Register(a) => a,
            Place::Number(v) => match self.push(Op::Constant(v)) {
                Place::Register(a) => a,
                Place::Number(_) => 0,
            },
        }
    }

    /// The register of an operation: a new one unless it was asked for before.
    fn push(&mut self, op: Op) -> Place {
        let at = self.ops.iter().position(|o| *o == op).unwrap_or_else(|| {
            self.ops.push(op);
            self.ops.len() - 1
        });
        Place::Register(self.names + at)
    }

    /// Computes what only parameters enter.
    pub(super) fn prepare<T: Number>(&self, registers: &mut [T]) {
        self.still.iter().for_each(|&k| self.compute(k, registers));
    }

    /// Computes all else.
    #[inline(always)]
    pub(super) fn run<T: Number>(&self, registers: &mut [T]) {
        for &k in &self.moving {
            self.compute(k, registers);
        }
    }

    /// The operations that a name enters, in order.
    pub(super) fn behind(&self, name: usize) -> Vec<usize> {
        let mut enters = vec![false; self.names];
        enters[name] = true;
        for op in &self.ops {
            let behind = op.operands().any(|a| enters[a]);
            enters.push(behind);
        }
        (0..self.ops.len()).filter(|k| enters[self.names + k]).collect()
    }

    /// Computes some operations, where all others are.
    pub(super) fn again<T: Number>(&self, operations: &[usize], registers: &mut [T]) {
        operations.iter().for_each(|&k| self.compute(k, registers));
    }

    #[inline(always)]
    fn compute<T: Number>(&self, k: usize, registers: &mut [T]) {
        let (r, rest) = registers.split_at_mut(self.names + k);
        let Some(out) = rest.first_mut() else { return };
        match self.ops[k] {
            Op::Two(Two::Add, a, b) => out.set_sum(&r[a], &r[b]),
            Op::Two(Two::Subtract, a, b) => out.set_difference(&r[a], &r[b]),
            Op::Two(Two::Multiply, a, b) => out.set_product(&r[a], &r[b]),
            Op::Scale(a, v) => out.set_scaled(&r[a], v),
            Op::Negate(a) => out.set_scaled(&r[a], -1.0),
            Op::Constant(v) => *out = T::from(v),
            Op::Shift(a, v) => *out = r[a] + v,
            Op::Over(v, a) => *out = r[a].recip() * v,
            Op::Whole(a, n) => *out = r[a].powi(n),
            Op::One(f, a) => *out = one(f, r[a]),
            Op::Two(f, a, b) => *out = two(f, r[a], r[b]),
        }
    }

    /// The value of an expression, once all is computed.
    #[inline(always)]
    pub(super) fn result<T: Number>(&self, registers: &[T], expression: usize) -> T {
        match self.results[expression] {
            Place::Number(v) => T::from(v),
            Place::Register(a) => registers[a],
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// A tape gives what each expression gives by itself, and computes what they share once.
    #[test]
    fn a_tape_is_its_expressions() {
        let names: Vec<String> = ["x", "v", "p", "k"].iter().map(|s| (*s).to_owned()).collect();
        let texts = [
            "-p*sin(x) - k*v/4 + 2*3",
            "(p*sin(x) + 1)^2/(2 - v)",
            "k/x - 1/(k + 1) + max(v, 2) - atan2(1, k)",
            "x^p - abs(-v)*x^3 + (k - x)^-1",
            "k",
            "4 - v",
        ];
        let expressions: Vec<Expression> =
            texts.iter().map(|t| Expression::parse(t, &names).unwrap()).collect();
        let values = [0.7, -1.2, 1.5, 2.5];
        let known = [None, None, None, Some(2.5)];
        let tape = Tape::new(expressions.iter(), &known, &[false, false, true, true]);
        let mut registers = vec![0.0; tape.registers()];
        registers[..4].copy_from_slice(&values);
        tape.prepare(&mut registers);
        tape.run(&mut registers);
        for (i, expression) in expressions.iter().enumerate() {
            let expected = expression.value(&values, &mut Vec::new());
            assert!((tape.result(&registers, i) - expected).abs() < 1e-14, "{}", texts[i]);
        }
        let sines = tape.ops.iter().filter(|op| matches!(op, Op::One(One::Sin, _))).count();
        assert_eq!(sines, 1);
    }
}
