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

/// Two or three rows hold no oscillation: what is wrong with them is said without one.
#[test]
fn no_oscillation_is_looked_for_in_a_few_rows() {
    let level = Parameter {
        name: "level".into(),
        unit: "m".into(),
        scope: Scope::Shared,
        start: 0.0,
        lower: -10.0,
        upper: 10.0,
        scale: 1.0,
    };
    let spec = Spec { baseline: "a level".into(), parameters: vec![level], ..Spec::default() };
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
