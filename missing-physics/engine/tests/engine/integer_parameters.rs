//! Which row, which sensor: each whole number gets a fit of its own, and those that the data do not tell apart stay open.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use crate::common::{Curve, mechanism, parameter, recording};
use missing_physics::data::{Recording, Run};
use missing_physics::engine::{Options, diagnose};
use missing_physics::model::Mechanism;
use missing_physics::observer::Silent;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const ROWS: usize = 30;

/// A step of a size from a row on.
fn step() -> Curve {
    let size = parameter("size", 0.0, [-10.0, 10.0]);
    let row = parameter("row", -1.0, [-1.0, ROWS as f64]);
    let step = Mechanism { integer_parameters: vec![1], ..mechanism("step", vec![0, 1]) };
    Curve::new(vec![size, row], vec![step], |s, _, row| if s[1] >= 0.0 && row >= s[1] { s[0] } else { 0.0 })
        .from(|_| (1..ROWS).map(|row| vec![(1, row as f64)]).collect())
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
    recording("row", vec![run], Some(0.1))
}

#[test]
fn rows_that_nothing_tells_apart_stay_open() {
    let model = step();
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
