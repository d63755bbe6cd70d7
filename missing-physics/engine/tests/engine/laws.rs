//! A law that was found is kept in the model, and predicts runs that were not there.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use crate::common::{Curve, mechanism, parameter, recording};
use missing_physics::data::{Recording, Run};
use missing_physics::diagnosis::{Diagnosis, Verdict};
use missing_physics::engine::{Options, diagnose};
use missing_physics::model::{Model, PredictError, Quantity, Spec, Term};
use missing_physics::observer::Silent;
use missing_physics::repaired::{AddedLaw, Repaired, RepairedError};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
const NOISE: f64 = 0.05;

/// A slope, a mechanism that is not at work, and x^4 as a candidate term.
struct Line(Curve);

impl Line {
    fn new() -> Self {
        let parameters = [("slope", 1.0), ("kink", 0.0), ("quartic", 0.0)];
        let parameters = parameters.map(|(name, start)| parameter(name, start, ANY)).into();
        let kink = mechanism("kink", vec![1]);
        let law =
            |s: &[f64], _: &[f64], x: f64| s[0] * x + s[1] * (x - 3.0).clamp(0.0, 0.1) + s[2] * x.powi(4);
        Self(Curve::new(parameters, vec![kink], law))
    }
}

/// A curve with candidate terms.
struct WithTerms(Curve, Spec);

impl WithTerms {
    /// Terms by formula, each with the parameter that is its coefficient.
    fn new(curve: Curve, terms: &[(&str, usize)]) -> Self {
        let term = |&(formula, parameter): &(&str, usize)| Term {
            parameter,
            formula: formula.into(),
            adds_to: Quantity::new("y", ""),
            variables: vec!["x".into()],
        };
        let spec = Spec { terms: terms.iter().map(term).collect(), ..curve.spec().clone() };
        Self(curve, spec)
    }
}

impl Model for WithTerms {
    fn spec(&self) -> &Spec {
        &self.1
    }

    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        self.0.predict(run, shared, nuisance, out)
    }
}

fn draw(law: fn(f64) -> f64, seed: u64) -> Recording {
    let noise = Normal::new(0.0, NOISE).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let xs: Vec<f64> = (1..=120).map(|i| 0.05 * f64::from(i)).collect();
    let runs = ["1", "2", "3"].map(|label| Run {
        label: label.into(),
        outputs: vec![xs.iter().map(|x| law(*x) + noise.sample(&mut rng)).collect()],
        inputs: vec![xs.clone()],
        kind: 0,
    });
    recording("x", runs.into(), Some(NOISE))
}

fn answer(model: &dyn Model, recording: &Recording) -> Diagnosis {
    let options = Options { replicates: 199, ..Options::default() };
    diagnose(model, recording, &[], &options, &Silent).unwrap()
}

/// The error (root mean square) of what a model says of the later third of runs whose beginnings it sees.
fn error(repaired: &Repaired, model: &dyn Model, law: fn(f64) -> f64) -> f64 {
    let mut next = draw(law, 77);
    for run in &mut next.runs {
        run.outputs[0][80..].fill(f64::NAN);
    }
    let predicted = repaired.predict(model, &next).unwrap();
    let (mut squares, mut n) = (0.0, 0.0);
    for (run, said) in next.runs.iter().zip(&predicted) {
        for row in 80..run.len() {
            squares += (said.channels[0][row] - law(run.inputs[0][row])).powi(2);
            n += 1.0;
        }
    }
    f64::sqrt(squares / n)
}

/// Diagnoses a law that the list has not, writes the model, reads it, and predicts with it.
fn kept(model: &dyn Model, law: fn(f64) -> f64) -> Repaired {
    let found = answer(model, &draw(law, 5));
    assert_eq!(found.verdict, Verdict::Unexplained);
    let written = serde_json::to_string(&found.repaired).unwrap();
    let read: Repaired = serde_json::from_str(&written).unwrap();
    assert_eq!(read, found.repaired);
    let with = error(&read, model, law);
    let baseline = answer(model, &draw(|x| x, 5)).repaired;
    let without = error(&baseline, model, law);
    assert!(with < NOISE && without > 5.0 * with, "{:?}: {without} -> {with}", read.law);
    read
}

#[test]
fn another_power_predicts() {
    let kept = kept(&Line::new().0, |x| 2.0 * x.powf(1.4));
    assert!(matches!(kept.law, Some(AddedLaw::Power { .. })), "{:?}", kept.law);
    let exponent = kept.parameters.last().unwrap();
    assert!(exponent.name == "exponent" && (exponent.value - 0.4).abs() < 0.02, "{exponent:?}");
}

/// A reading whose scale is curved, of a wave: in time it is an oscillation at three times the frequency.
#[test]
fn a_curved_scale_predicts() {
    let parameters = [("amplitude", 1.0), ("rate", 1.3), ("kink", 0.0)];
    let parameters = parameters.map(|(name, start)| parameter(name, start, ANY)).into();
    let law = |s: &[f64], _: &[f64], x: f64| s[0] * (s[1] * x).sin() + s[2] * (x - 3.0).clamp(0.0, 0.1);
    let wave = Curve::new(parameters, vec![mechanism("kink", vec![2])], law);
    let curved = |x: f64| {
        let y = 1.2 * (1.4 * x).sin();
        y + 0.4 * y.powi(3)
    };
    let kept = kept(&wave, curved);
    let Some(AddedLaw::Reading { channel, largest }) = &kept.law else { panic!("{:?}", kept.law) };
    assert!(channel == "y" && *largest > 1.0, "{:?}", kept.law);
}

#[test]
fn an_oscillation_predicts() {
    let kept = kept(&Line::new().0, |x| x + 0.6 * (5.0 * x).sin());
    assert_eq!(kept.law, Some(AddedLaw::Periodic));
}

/// Where every other row was measured, an oscillation is not its alias, of which these rows show the same.
#[test]
fn an_oscillation_of_every_other_row_is_the_slow_one() {
    let mut every_other = draw(|x| x + 0.6 * (5.0 * x).sin(), 5);
    for run in &mut every_other.runs {
        run.outputs[0].iter_mut().skip(1).step_by(2).for_each(|v| *v = f64::NAN);
    }
    let law = answer(&Line::new().0, &every_other).law.unwrap();
    let omega = &law.coefficients[0];
    assert!(omega.name == "omega" && (omega.value - 5.0).abs() < 0.05, "{omega:?}");
}

#[test]
fn terms_predict() {
    let model = WithTerms::new(Line::new().0, &[("x^4", 2)]);
    let kept = kept(&model, |x| x + 0.004 * x.powi(4));
    assert_eq!(kept.law, Some(AddedLaw::Terms { coefficients: vec!["quartic".into()] }));
}

/// Two terms, of which a third is nearly the sum: it comes first, and goes when both are there.
#[test]
fn a_term_that_stood_in_for_others_goes() {
    let parameters = ["slope", "kink", "slow", "fast", "both"];
    let parameters = parameters.map(|name| parameter(name, f64::from(name == "slope"), ANY)).into();
    let law = |s: &[f64], _: &[f64], x: f64| {
        let kink = s[1] * (x - 3.0).clamp(0.0, 0.1);
        s[0] * x
            + kink
            + s[2] * x.sin()
            + s[3] * (2.0 * x).cos()
            + s[4] * (x.sin() + (2.0 * x).cos() + 0.4 * (5.0 * x).sin())
    };
    let curve = Curve::new(parameters, vec![mechanism("kink", vec![1])], law);
    let model = WithTerms::new(curve, &[("sin(x)", 2), ("cos(2 x)", 3), ("both(x)", 4)]);
    let kept = kept(&model, |x| x + x.sin() + 0.9 * (2.0 * x).cos());
    let two = ["slow", "fast"].map(String::from).into();
    assert_eq!(kept.law, Some(AddedLaw::Terms { coefficients: two }));
}

#[test]
fn a_law_of_another_simulation_is_refused() {
    let model = Line::new().0;
    let mut kept = kept(&model, |x| 2.0 * x.powf(1.4));
    kept.law = Some(AddedLaw::Power { channel: "z".into(), variable: "x".into(), largest: 6.0 });
    let refused = kept.predict(&model, &draw(|x| x, 1)).unwrap_err();
    assert!(matches!(refused, RepairedError::Damaged(why) if why.contains("channel or variable")));
    kept.law = Some(AddedLaw::Terms { coefficients: vec!["sextic".into()] });
    kept.parameters.pop();
    let refused = kept.predict(&model, &draw(|x| x, 1)).unwrap_err();
    assert!(matches!(refused, RepairedError::Damaged(why) if why.contains("term")));
}
