//! Which row, which sensor: each whole number gets a fit of its own, and those that the data do not tell apart stay open.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use missing_physics::data::{Recording, Run};
use missing_physics::engine::{Options, diagnose};
use missing_physics::model::{Mechanism, Model, Parameter, PredictError, Quantity, Scope, Spec};
use missing_physics::observer::Silent;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const ROWS: usize = 30;

/// A step of a size from a row on.
struct Step(Spec);

impl Step {
    fn new() -> Self {
        let parameter = |name: &str, start: f64, [lower, upper]: [f64; 2]| Parameter {
            name: name.into(),
            unit: String::new(),
            scope: Scope::Shared,
            start,
            lower,
            upper,
            scale: 1.0,
        };
        let parameters =
            vec![parameter("size", 0.0, [-10.0, 10.0]), parameter("row", -1.0, [-1.0, ROWS as f64])];
        let mechanism =
            Mechanism { id: "step".into(), parameters: vec![0, 1], places: vec![1], ..Mechanism::default() };
        Self(Spec { parameters, mechanisms: vec![mechanism], ..Spec::default() })
    }
}

impl Model for Step {
    fn spec(&self) -> &Spec {
        &self.0
    }

    fn predict(&self, run: &Run, shared: &[f64], _: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
        let on = |row: f64| shared[1] >= 0.0 && row >= shared[1];
        out.iter_mut().zip(&run.inputs[0]).for_each(|(y, row)| *y = if on(*row) { shared[0] } else { 0.0 });
        Ok(())
    }

    fn starts(&self, _: usize, _: &[Run], _: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        (1..ROWS).map(|row| vec![(1, row as f64)]).collect()
    }
}

/// A step of one at row 10; a row may be missing.
fn draw(missing: Option<usize>) -> Recording {
    let noise = Normal::new(0.0, 0.1).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let readings = (0..ROWS).map(|row| {
        let reading = f64::from(u8::from(row >= 10)) + noise.sample(&mut rng);
        if missing == Some(row) { f64::NAN } else { reading }
    });
    let run = Run {
        label: "1".into(),
        outputs: vec![readings.collect()],
        inputs: vec![(0..ROWS).map(|row| row as f64).collect()],
        kind: 0,
    };
    Recording {
        channels: vec![Quantity::new("y", "")],
        variables: vec![Quantity::new("row", "")],
        runs: vec![run],
        noise_along: Some(0),
        calibration: vec![Some(0.1)],
        resolution: vec![0.0],
    }
}

#[test]
fn rows_that_nothing_tells_apart_stay_open() {
    let model = Step::new();
    let options = Options { replicates: 99, ..Options::default() };
    let sure = diagnose(&model, &draw(None), &[], &options, &Silent).unwrap();
    assert_eq!(sure.chosen, ["step"]);
    let row = &sure.mechanisms[0].parameters[1];
    assert!(row.value == 10.0 && row.ci95[0].is_nan(), "{row:?}");
    assert!(sure.undetermined.is_empty(), "{:?}", sure.undetermined);
    // Nobody read row 10: the step may be there or at the row after it.
    let open = diagnose(&model, &draw(Some(10)), &[], &options, &Silent).unwrap();
    assert_eq!(open.chosen, ["step"]);
    let [size, row] = &open.mechanisms[0].parameters[..] else { unreachable!("two parameters") };
    assert_eq!(row.ci95, [10.0, 11.0]);
    assert!(size.ci95[0] < 1.0 && size.ci95[1] > 1.0 && size.ci95[1] - size.ci95[0] < 0.2, "{size:?}");
    assert!(open.undetermined[0].starts_with("row: 1"), "{:?}", open.undetermined);
}
