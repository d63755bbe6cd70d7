//! Runs of a few rows.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use missing_physics::data::{Recording, Run};
use missing_physics::diagnosis::Verdict;
use missing_physics::engine::{Options, diagnose};
use missing_physics::model::{Model, Parameter, PredictError, Quantity, Scope, Spec};
use missing_physics::observer::Silent;

/// One level for all.
struct Level(Spec);

impl Model for Level {
    fn spec(&self) -> &Spec {
        &self.0
    }

    fn predict(
        &self,
        _run: &Run,
        shared: &[f64],
        _nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        out.fill(shared[0]);
        Ok(())
    }
}

/// The specification of one level, in m.
fn level() -> Spec {
    let level = Parameter {
        name: "level".into(),
        unit: "m".into(),
        scope: Scope::Shared,
        start: 0.0,
        lower: -10.0,
        upper: 10.0,
        scale: 1.0,
    };
    Spec { baseline: "a level".into(), parameters: vec![level], ..Spec::default() }
}

/// Two or three rows hold no oscillation: what is wrong with them is said without one.
#[test]
fn no_oscillation_is_looked_for_in_a_few_rows() {
    let spec = level();
    for rows in [2, 3] {
        let run = |r: u32| {
            let reading = |i: u32| 0.1 * f64::from(r * r % 7) + 0.001 * f64::from((5 * r + 3 * i) % 11);
            Run {
                label: r.to_string(),
                inputs: vec![(0..rows).map(f64::from).collect()],
                outputs: vec![(0..rows).map(reading).collect()],
                kind: 0,
            }
        };
        let recording = Recording {
            channels: vec![Quantity::new("y_m", "m")],
            variables: vec![Quantity::new("t_s", "s")],
            runs: (0..30).map(run).collect(),
            noise_along: Some(0),
            calibration: vec![Some(0.003)],
            resolution: vec![0.0],
        };
        let options = Options { replicates: 99, ..Options::default() };
        let answer = diagnose(&Level(spec.clone()), &recording, &[], &options, &Silent).unwrap();
        assert_eq!(answer.verdict, Verdict::Unexplained);
        assert!(answer.law.is_none(), "{:?}", answer.law);
    }
}

/// Data that are the simulation, printed with five digits: sawteeth of rounding are no physics.
#[test]
fn what_equals_its_baseline_to_the_last_digit_is_adequate() {
    let spec = level();
    let answer = |digit: f64, drift: f64| {
        let times: Vec<f64> = (0..60).map(f64::from).collect();
        let read = |t: &f64| if digit > 0.0 { (drift * t / digit).round() * digit } else { drift * t };
        let column: Vec<f64> = times.iter().map(read).collect();
        let run = Run { label: "1".into(), inputs: vec![times], outputs: vec![column], kind: 0 };
        let recording = Recording {
            channels: vec![Quantity::new("y_m", "m")],
            variables: vec![Quantity::new("t_s", "s")],
            runs: vec![run],
            noise_along: Some(0),
            calibration: vec![None],
            resolution: vec![digit],
        };
        let options = Options { replicates: 99, ..Options::default() };
        diagnose(&Level(spec.clone()), &recording, &[], &options, &Silent).unwrap()
    };
    // All is rounded to zero; or there is nothing to round.
    for (digit, drift) in [(1e-5, 8e-8), (0.0, 0.0)] {
        let found = answer(digit, drift);
        assert_eq!((found.verdict, found.p_value), (Verdict::Adequate, 1.0));
    }
    // One digit more, and there is something to look at.
    assert!(answer(1e-6, 8e-8).p_value < 1.0);
}
