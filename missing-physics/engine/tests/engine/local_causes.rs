//! Rows that are not alone: each reading is the sum of all steps so far, so that a step that departs shows in all readings after it.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use crate::common::{parameter, recording};
use missing_physics::data::{Recording, Run};
use missing_physics::diagnosis::Location;
use missing_physics::engine::{Options, diagnose};
use missing_physics::model::{
    Extensions, LocalCauses, LocalUnknown, Model, Parameter, PredictError, Quantity, Scope, Spec,
};
use missing_physics::observer::Silent;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

/// Steps from a beginning of each run's own.
struct Steps {
    spec: Spec,
    /// Whether it says what a step that departs does.
    tells: bool,
}

fn sums(start: f64, steps: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
    steps.scan(start, |sum, step| {
        *sum += step;
        Some(*sum)
    })
}

impl Model for Steps {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn predict(&self, run: &Run, _: &[f64], nuisance: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
        out.iter_mut().zip(sums(nuisance[0], run.inputs[0].iter().copied())).for_each(|(y, sum)| *y = sum);
        Ok(())
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions { local_causes: self.tells.then_some(self as &dyn LocalCauses), ..Extensions::default() }
    }
}

impl LocalCauses for Steps {
    fn unknowns(&self) -> Vec<LocalUnknown> {
        vec![LocalUnknown::new("longer steps", vec![Quantity::new("part", "")])]
    }

    fn response(
        &self,
        _: (usize, usize),
        runs: &[Run],
        _: &[f64],
        _: &[Vec<f64>],
        amounts: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        let change = |(run, amounts): (&Run, &Vec<f64>)| {
            sums(0.0, run.inputs[0].iter().zip(amounts).map(|(x, amount)| x * amount)).collect()
        };
        Ok(runs.iter().zip(amounts).map(change).collect())
    }
}

/// Steps beyond a length are longer by a part, from a run on.
fn walks(beyond: f64, longer: f64, from_run: usize) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let walk = |run: usize| {
        let x: Vec<f64> = (0..60).map(|_| rng.random_range(0.0..1.0)).collect();
        let taken = x.iter().map(|&x| if run >= from_run && x > beyond { (1.0 + longer) * x } else { x });
        let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
        let y = sums(run as f64, taken).map(|y| y + 0.05 * noise()).collect();
        Run { label: run.to_string(), inputs: vec![x], outputs: vec![y], kind: 0 }
    };
    recording("x", (0..5).map(walk).collect(), Some(0.05))
}

fn place(tells: bool, from_run: usize) -> Location {
    let free = parameter("begin", 0.0, [f64::NEG_INFINITY, f64::INFINITY]);
    let parameters = vec![Parameter { scope: Scope::PerRun, ..free }];
    let model = Steps { spec: Spec { parameters, ..Spec::default() }, tells };
    let options = Options { replicates: 199, ..Options::default() };
    let answer = diagnose(&model, &walks(0.7, 0.1, from_run), &[], &options, &Silent).unwrap();
    answer.location[0].clone()
}

#[test]
fn a_step_that_departs_is_found_where_it_departs() {
    let place = place(true, 0);
    let (from, to) = (place.from.unwrap(), place.to.unwrap());
    assert!((from - 0.7).abs() < 0.06 && to > 0.95, "{place:?}");
    assert_eq!(place.runs.len(), 5);
    let as_if = place.as_if.unwrap();
    // A tenth more beyond 0.7, as it was made, seen as a size in the interval that was found: by least squares, each walk's begin free.
    assert_eq!(as_if.what, "longer steps");
    let walked = |run: &Run, least: f64| -> Vec<f64> {
        let at: Vec<f64> =
            sums(0.0, run.inputs[0].iter().map(|&x| if x >= least && x <= to { x } else { 0.0 })).collect();
        let mean = at.iter().sum::<f64>() / at.len() as f64;
        at.into_iter().map(|v| v - mean).collect()
    };
    let (mut product, mut square) = (0.0, 0.0);
    for run in &walks(0.7, 0.1, 0).runs {
        let (found, made) = (walked(run, from), walked(run, 0.7));
        product += found.iter().zip(made).map(|(f, m)| 0.1 * f * m).sum::<f64>();
        square += found.iter().map(|f| f * f).sum::<f64>();
    }
    let mean = product / square;
    let [low, high] = as_if.sizes[0].ci95;
    assert!(low < mean && mean < high && high - low < 0.02, "{mean} {:?}", as_if.sizes);
}

#[test]
fn a_change_between_runs_is_found_with_its_runs() {
    let place = place(true, 3);
    assert_eq!(place.runs, ["3", "4"], "{place:?}");
    assert!((place.from.unwrap() - 0.7).abs() < 0.06, "{place:?}");
}

/// So is what the model tells of it needed.
#[test]
fn readings_that_are_off_do_not_say_which_step_departed() {
    let place = place(false, 0);
    let found =
        place.from.is_some_and(|from| (from - 0.7).abs() < 0.06) && place.to.is_some_and(|to| to > 0.95);
    assert!(!found, "{place:?}");
}
