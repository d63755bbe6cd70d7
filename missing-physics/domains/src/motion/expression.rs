//! Expressions of a recording's equations: parsed once, evaluated in any number.
//!
//! The usual precedence: `^` before a sign before `*` and `/` before `+` and `-`; `^` groups to the right, so that `-x^2` is `-(x^2)`.

use joint_laws::Number;

/// Functions of one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum One {
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Sqrt,
    Exp,
    Ln,
    Abs,
    Sign,
}

/// Functions of two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Two {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Atan2,
    Min,
    Max,
}

/// A step of an evaluation on a stack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Step {
    Number(f64),
    Name(usize),
    Negate,
    One(One),
    Two(Two),
    /// A whole power.
    Whole(i32),
}

/// Functions of one number by name.
const ONES: [(&str, One); 14] = [
    ("sin", One::Sin),
    ("cos", One::Cos),
    ("tan", One::Tan),
    ("asin", One::Asin),
    ("acos", One::Acos),
    ("atan", One::Atan),
    ("sinh", One::Sinh),
    ("cosh", One::Cosh),
    ("tanh", One::Tanh),
    ("sqrt", One::Sqrt),
    ("exp", One::Exp),
    ("ln", One::Ln),
    ("abs", One::Abs),
    ("sign", One::Sign),
];
const TWOS: [(&str, Two); 3] = [("atan2", Two::Atan2), ("min", Two::Min), ("max", Two::Max)];
/// The word for a derivative, which Modelica has too.
const DERIVATIVE: &str = "der";
/// Brackets within brackets; more are no equation.
const DEEPEST: usize = 60;

/// A parsed expression of names that are known by their places in a list.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Expression {
    steps: Vec<Step>,
}

/// How the derivative of a state is written: `der(x)`.
pub(super) fn derivative(state: &str) -> String {
    format!("{DERIVATIVE}({state})")
}

/// Why a text is no expression: what is wrong, and at which character (from 1).
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Wrong {
    pub(super) at: usize,
    pub(super) what: String,
}

impl Expression {
    /// Parses a text in which the names `names` may stand; a name such as `der(x)` is that of a derivative ([`derivative`]).
    pub(super) fn parse(text: &str, names: &[String]) -> Result<Self, Wrong> {
        let chars: Vec<char> = text.chars().collect();
        let mut parser = Parser { chars: &chars, at: 0, names, steps: Vec::new(), depth: 0 };
        parser.sum()?;
        match parser.peek() {
            None => Ok(Self { steps: parser.steps }),
            Some(c) => Err(parser.wrong(format!("\"{}\" was not expected", c.escape_default()))),
        }
    }

    /// The name that is all of the expression, if one is.
    pub(super) fn bare_name(&self) -> Option<usize> {
        match self.steps[..] {
            [Step::Name(name)] => Some(name),
            _ => None,
        }
    }

    /// What it is, and beside it so many times what one expression is more than another.
    pub(super) fn beside(&self, factor: f64, more: &Self, than: &Self) -> Self {
        let parts = [&self.steps[..], &more.steps, &than.steps, &[Step::Two(Two::Subtract)]];
        let scaled = [Step::Number(factor), Step::Two(Two::Multiply), Step::Two(Two::Add)];
        Self { steps: parts.into_iter().flatten().chain(&scaled).copied().collect() }
    }

    /// The expression that is a name.
    pub(super) fn of_name(name: usize) -> Self {
        Self { steps: vec![Step::Name(name)] }
    }

    /// Whether a name stands in it.
    pub(super) fn has(&self, name: usize) -> bool {
        self.steps.contains(&Step::Name(name))
    }

    /// The steps of its evaluation on a stack.
    pub(super) fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// Its value where the names have these values, step by step; `stack` is room.
    pub(super) fn value<T: Number>(&self, values: &[T], stack: &mut Vec<T>) -> T {
        stack.clear();
        for step in &self.steps {
            match *step {
                Step::Number(v) => stack.push(T::from(v)),
                Step::Name(name) => stack.push(values[name]),
                Step::Negate => change(stack, |a| -a),
                Step::Whole(n) => change(stack, |a| a.powi(n)),
                Step::One(f) => change(stack, |a| one(f, a)),
                Step::Two(f) => {
                    let b = stack.pop().unwrap_or(T::from(f64::NAN));
                    change(stack, |a| two(f, a, b));
                }
            }
        }
        stack.pop().unwrap_or(T::from(f64::NAN))
    }
}

fn change<T: Number>(stack: &mut [T], f: impl FnOnce(T) -> T) {
    if let Some(top) = stack.last_mut() {
        *top = f(*top);
    }
}

/// A function of one number.
#[inline(never)]
pub(super) fn one<T: Number>(f: One, a: T) -> T {
    match f {
        One::Sin => a.sin(),
        One::Cos => a.cos(),
        One::Tan => a.tan(),
        One::Asin => a.asin(),
        One::Acos => a.acos(),
        One::Atan => a.atan(),
        One::Sinh => a.sinh(),
        One::Cosh => a.cosh(),
        One::Tanh => a.tanh(),
        // A level that has run dry: the derivative at zero is infinite, and would spoil all others.
        One::Sqrt if a.re() == 0.0 => T::from(0.0),
        One::Sqrt => a.sqrt(),
        One::Exp => a.exp(),
        One::Ln => a.ln(),
        One::Abs => a.modulus(),
        One::Sign => T::from(if a.re() > 0.0 {
            1.0
        } else if a.re() < 0.0 {
            -1.0
        } else {
            0.0
        }),
    }
}

/// A function of two numbers.
#[inline]
pub(super) fn two<T: Number>(f: Two, a: T, b: T) -> T {
    match f {
        Two::Add => a + b,
        Two::Subtract => a - b,
        Two::Multiply => a * b,
        Two::Divide => a / b,
        Two::Power => power(a, b),
        Two::Atan2 => a.atan2(b),
        Two::Min => {
            if b.re() < a.re() {
                b
            } else {
                a
            }
        }
        Two::Max => {
            if b.re() > a.re() {
                b
            } else {
                a
            }
        }
    }
}

/// `a^b` for `a` not below zero; zero to a power above zero is zero.
fn power<T: Number>(a: T, b: T) -> T {
    if a.re() == 0.0 && b.re() > 0.0 { T::from(0.0) } else { (a.ln() * b).exp() }
}

struct Parser<'a> {
    chars: &'a [char],
    at: usize,
    names: &'a [String],
    steps: Vec<Step>,
    depth: usize,
}

impl Parser<'_> {
    fn peek(&mut self) -> Option<char> {
        while self.chars.get(self.at).is_some_and(|c| c.is_whitespace()) {
            self.at += 1;
        }
        self.chars.get(self.at).copied()
    }

    fn take(&mut self, c: char) -> bool {
        let there = self.peek() == Some(c);
        self.at += usize::from(there);
        there
    }

    fn wrong(&self, what: String) -> Wrong {
        Wrong { at: self.at + 1, what }
    }

    fn expect(&mut self, c: char) -> Result<(), Wrong> {
        if self.take(c) { Ok(()) } else { Err(self.wrong(format!("\"{c}\" is missing"))) }
    }

    fn sum(&mut self) -> Result<(), Wrong> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.wrong(format!("more than {DEEPEST} brackets within each other")));
        }
        self.product()?;
        loop {
            let f = match self.peek() {
                Some('+') => Two::Add,
                Some('-') => Two::Subtract,
                _ => break,
            };
            self.at += 1;
            self.product()?;
            self.steps.push(Step::Two(f));
        }
        self.depth -= 1;
        Ok(())
    }

    fn product(&mut self) -> Result<(), Wrong> {
        self.signed()?;
        loop {
            let f = match self.peek() {
                Some('*') => Two::Multiply,
                Some('/') => Two::Divide,
                _ => return Ok(()),
            };
            self.at += 1;
            self.signed()?;
            self.steps.push(Step::Two(f));
        }
    }

    fn signed(&mut self) -> Result<(), Wrong> {
        let mut negative = false;
        while let Some(c) = self.peek().filter(|c| matches!(c, '-' | '+')) {
            negative ^= c == '-';
            self.at += 1;
        }
        self.raised()?;
        if negative {
            self.steps.push(Step::Negate);
        }
        Ok(())
    }

    fn raised(&mut self) -> Result<(), Wrong> {
        self.atom()?;
        if !self.take('^') {
            return Ok(());
        }
        let exponent = self.steps.len();
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.wrong(format!("more than {DEEPEST} powers within each other")));
        }
        self.signed()?;
        self.depth -= 1;
        // A whole number may raise anything, also what is below zero.
        let whole = |v: f64| v.fract() == 0.0 && v.abs() <= 1e3;
        match self.steps[exponent..] {
            [Step::Number(v)] if whole(v) => {
                self.steps.truncate(exponent);
                self.steps.push(Step::Whole(v as i32));
            }
            [Step::Number(v), Step::Negate] if whole(v) => {
                self.steps.truncate(exponent);
                self.steps.push(Step::Whole(-v as i32));
            }
            _ => self.steps.push(Step::Two(Two::Power)),
        }
        Ok(())
    }

    fn atom(&mut self) -> Result<(), Wrong> {
        match self.peek() {
            Some('(') => {
                self.at += 1;
                self.sum()?;
                self.expect(')')
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' => self.name(),
            Some(c) => Err(self.wrong(format!("\"{}\" was not expected", c.escape_default()))),
            None => Err(self.wrong("something is missing at the end".into())),
        }
    }

    fn number(&mut self) -> Result<(), Wrong> {
        let begin = self.at;
        let digits = |at: &mut usize, chars: &[char]| {
            while chars.get(*at).is_some_and(|c| c.is_ascii_digit() || *c == '.') {
                *at += 1;
            }
        };
        digits(&mut self.at, self.chars);
        if self.chars.get(self.at).is_some_and(|c| matches!(c, 'e' | 'E')) {
            let sign = usize::from(self.chars.get(self.at + 1).is_some_and(|c| matches!(c, '-' | '+')));
            if self.chars.get(self.at + 1 + sign).is_some_and(char::is_ascii_digit) {
                self.at += 1 + sign;
                digits(&mut self.at, self.chars);
            }
        }
        let text: String = self.chars[begin..self.at].iter().collect();
        match text.parse::<f64>() {
            Ok(v) if v.is_finite() => {
                self.steps.push(Step::Number(v));
                Ok(())
            }
            _ => Err(Wrong { at: begin + 1, what: format!("\"{text}\" is no number") }),
        }
    }

    fn identifier(&mut self) {
        while self.chars.get(self.at).is_some_and(|c| c.is_alphanumeric() || *c == '_') {
            self.at += 1;
        }
    }

    fn name(&mut self) -> Result<(), Wrong> {
        let begin = self.at;
        self.identifier();
        let mut name: String = self.chars[begin..self.at].iter().collect();
        if name == DERIVATIVE && self.take('(') {
            self.peek();
            let begin = self.at;
            self.identifier();
            name = derivative(&self.chars[begin..self.at].iter().collect::<String>());
            self.expect(')')?;
        }
        if let Some(place) = self.names.iter().position(|n| *n == name) {
            self.steps.push(Step::Name(place));
            return Ok(());
        }
        if name == "pi" {
            self.steps.push(Step::Number(std::f64::consts::PI));
            return Ok(());
        }
        let step = if let Some((_, f)) = ONES.iter().find(|(n, _)| *n == name) {
            self.expect('(')?;
            self.sum()?;
            Step::One(*f)
        } else if let Some((_, f)) = TWOS.iter().find(|(n, _)| *n == name) {
            self.expect('(')?;
            self.sum()?;
            self.expect(',')?;
            self.sum()?;
            Step::Two(*f)
        } else {
            let known = self.names.join(", ");
            let short: String = name.chars().take(40).collect();
            let what = format!("the name {short} is not known, expected one of: {known}");
            return Err(Wrong { at: begin + 1, what });
        };
        self.steps.push(step);
        self.expect(')')
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    fn value(text: &str) -> f64 {
        let names: Vec<String> = ["x", "v_m_s"].iter().map(|s| (*s).to_owned()).collect();
        Expression::parse(text, &names).unwrap().value(&[2.0, -3.0], &mut Vec::new())
    }

    /// The values are those of Python, with `**` for `^`.
    #[test]
    fn precedence_is_the_usual_one() {
        for (text, expected) in [
            ("-x^2", -4.0),
            ("2^3^2", 512.0),
            ("2^-1", 0.5),
            ("v_m_s^2", 9.0),
            ("1 - 2 - 3", -4.0),
            ("8/4/2", 1.0),
            ("-x*-v_m_s", -6.0),
            ("2*(x + 1e-1)", 4.2),
            ("max(x, 3) - min(1, v_m_s)", 6.0),
            ("abs(v_m_s)*v_m_s", -9.0),
            ("sign(v_m_s)*sqrt(abs(-16))", -4.0),
            ("atan2(1, 1)*4 - pi", 0.0),
            ("x^1.5", 2.0_f64.powf(1.5)),
            ("exp(ln(x)) + sin(0)", 2.0),
        ] {
            assert!((value(text) - expected).abs() < 1e-12, "{text}: {}", value(text));
        }
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        for (text, at, word) in [
            ("x + ", 5, "missing at the end"),
            ("x ** 2", 4, "was not expected"),
            ("sin x", 5, "\"(\" is missing"),
            ("2*(x + 1", 9, "\")\" is missing"),
            ("x + speed", 5, "speed is not known"),
            ("1.2.3", 1, "no number"),
            ("2*der(y)", 3, "der(y) is not known"),
            ("der(x", 6, "\")\" is missing"),
            ("x; y", 2, "was not expected"),
        ] {
            let wrong = Expression::parse(text, &["x".to_owned()]).unwrap_err();
            assert!(wrong.at == at && wrong.what.contains(word), "{text}: {wrong:?}");
        }
        assert!(Expression::parse(&"(".repeat(5000), &[]).is_err());
        assert!(Expression::parse(&format!("1{}", "^1".repeat(5000)), &[]).is_err());
    }
}
