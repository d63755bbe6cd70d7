//! Runs that differ, and runs that contradict the others.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test stops where it fails")]

use crate::common::{self, Ball, Curve, World, mechanism, parameter};
use missing_physics::data::{Recording, Run};
use missing_physics::diagnosis::{Diagnosis, Verdict};
use missing_physics::engine::{Options, diagnose};
use missing_physics::model::{
    Extensions, Mechanism, Model, Parameter, PredictError, Scope, Spec, WindowedModel,
};
use missing_physics::observer::Silent;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

fn answer(recording: &Recording) -> Diagnosis {
    let options = Options { replicates: 199, ..Options::default() };
    diagnose(&Ball::default(), recording, &[], &options, &Silent).unwrap()
}

/// Eight flights, each with a drag of its own.
fn flights(seed: u64, scatter: f64) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let drag = Normal::new(0.3, scatter).unwrap();
    let mut one = |run: u64| {
        World { runs: 1, linear_drag: drag.sample(&mut rng), ..World::NULL }.draw(1000 * seed + run)
    };
    let mut recording = one(0);
    for run in 1..8 {
        let mut next = one(run).runs.remove(0);
        next.label = (run + 1).to_string();
        recording.runs.push(next);
    }
    recording
}

/// How often runs are said to differ, and how often the interval holds the mean drag, of answers that name the drag.
fn judged(scatter: f64) -> [usize; 3] {
    let (mut named, mut differ, mut hold) = (0, 0, 0);
    for seed in 0..60 {
        let answer = answer(&flights(seed, scatter));
        let Some(drag) =
            answer.mechanisms.iter().find(|m| m.id == "linear-drag" && answer.chosen == [m.id.clone()])
        else {
            continue;
        };
        let [low, high] = drag.parameters[0].ci95;
        named += 1;
        differ += usize::from(!answer.between_runs.is_empty());
        hold += usize::from(low <= 0.3 && 0.3 <= high);
    }
    println!("scatter {scatter}: {named} named, {differ} said to differ, {hold} intervals hold");
    [named, differ, hold]
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_an_interval_allows_for_runs_that_differ() {
    let [named, differ, hold] = judged(0.0);
    assert!(named >= 55 && differ <= 3 && hold as f64 >= 0.88 * named as f64);
    let [named, differ, hold] = judged(0.05);
    assert!(named >= 40 && differ as f64 >= 0.8 * named as f64 && hold as f64 >= 0.85 * named as f64);
}

/// Six flights, the fourth of which is knocked half way.
fn knocked(linear_drag: f64) -> Recording {
    let mut recording = World { runs: 6, linear_drag, ..World::NULL }.draw(11);
    let run = &mut recording.runs[3];
    for (z, t) in run.outputs[0].iter_mut().zip(&run.inputs[0]) {
        *z += 0.5 * (t - 0.6).max(0.0);
    }
    recording
}

#[test]
fn a_run_that_contradicts_the_others_is_named_and_the_answer_without_it_said() {
    for (drag, verdict, chosen) in
        [(0.0, Verdict::Adequate, None), (0.4, Verdict::Explained, Some("linear-drag"))]
    {
        let options = Options::default();
        let answer = diagnose(&Ball::default(), &knocked(drag), &[], &options, &Silent).unwrap();
        assert_ne!(answer.verdict, Verdict::Adequate);
        let found = answer.contradiction.unwrap();
        assert_eq!((found.runs, found.verdict), (vec!["4".to_owned()], verdict));
        assert!(
            found.share > 0.8 && found.chosen.iter().map(String::as_str).eq(chosen),
            "{:?}",
            found.chosen
        );
    }
}

#[test]
fn runs_that_share_a_misfit_do_not_contradict_each_other() {
    let mut recording = World { runs: 6, ..World::NULL }.draw(12);
    for run in &mut recording.runs {
        for (z, t) in run.outputs[0].iter_mut().zip(&run.inputs[0]) {
            *z += 0.02 * (15.0 * t).sin();
        }
    }
    let answer = answer(&recording);
    assert_eq!((answer.verdict, answer.contradiction), (Verdict::Unexplained, None));
}

/// A ball's flights, each half of which is a window of one recording.
struct Halves(Ball);

impl Model for Halves {
    fn spec(&self) -> &Spec {
        self.0.spec()
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

    fn extensions(&self) -> Extensions<'_> {
        Extensions { windows: Some(self), ..Extensions::default() }
    }
}

impl WindowedModel for Halves {
    fn whole(&self, window: &Run) -> Option<&str> {
        Some(if ["1", "2", "3"].contains(&window.label.as_str()) { "morning" } else { "evening" })
    }
}

/// An answer speaks of the runs as they were recorded, not of the windows that they were cut into; a single window that contradicts the
/// rest keeps its label.
#[test]
fn windows_are_said_by_the_runs_that_they_are_of() {
    let mut recording = knocked(0.4);
    recording.runs[1].outputs[0][7] += 0.3;
    let rows = recording.runs[0].len();
    let answer = diagnose(&Halves(Ball::default()), &recording, &[], &Options::default(), &Silent).unwrap();
    let labels: Vec<&str> = answer.curves.iter().map(|c| c.run.as_str()).collect();
    assert_eq!(labels, ["morning", "evening"]);
    for curves in &answer.curves {
        let columns = [&curves.inputs[0], &curves.measured[0], &curves.before[0], &curves.after[0]];
        assert_eq!(columns.map(Vec::len), [3 * rows; 4]);
    }
    assert!(!answer.location.is_empty());
    for location in answer.location.iter().chain(&answer.leftover) {
        assert!(location.runs.iter().all(|run| labels.contains(&run.as_str())), "{:?}", location.runs);
    }
    let wild = &answer.outliers[0];
    assert_eq!((wild.run.as_str(), wild.row), ("morning", rows + 7));
    assert_eq!(answer.contradiction.unwrap().runs, ["4"]);
}

/// A swing of 3 rad/s that may die away, may be slower the larger it is, may be faster, and may have another rate in each run.
fn swing() -> Curve {
    let of_run = |name: &str, scale: f64| {
        let free = parameter(name, 0.0, [f64::NEG_INFINITY, f64::INFINITY]);
        Parameter { scope: Scope::PerRun, scale, ..free }
    };
    let by_run = Mechanism { between_runs: true, ..mechanism("another-rate", vec![4]) };
    Curve::new(
        vec![
            Parameter { scale: 0.1, ..parameter("decay", 0.0, [-5.0, 5.0]) },
            Parameter { scale: 0.1, ..parameter("cubic", 0.0, [-1.0, 1.0]) },
            Parameter { scale: 0.05, ..parameter("faster", 0.0, [-1.0, 1.0]) },
            of_run("amplitude", 1.0),
            of_run("rate_change", 0.05),
        ],
        vec![
            mechanism("damping", vec![0]),
            mechanism("softening", vec![1]),
            mechanism("spring", vec![2]),
            by_run,
        ],
        |shared, run, x| {
            let rate = (3.0 + shared[2] + run[1]) * (1.0 + shared[1] * run[0] * run[0]);
            run[0] * (-shared[0] * x).exp() * (rate * x).cos()
        },
    )
}

/// Swings of different sizes, their rate higher by `faster` and lower by `leak` in each further run.
fn swings(runs: usize, [decay, cubic, faster, leak]: [f64; 4]) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let noise = Normal::new(0.0, 0.01).unwrap();
    let of_run = |number: usize| {
        let x: Vec<f64> = (0..120).map(|i| 0.05 * f64::from(i)).collect();
        let size = [1.0, 0.6, 1.3, 0.8, 1.1, 0.7][number % 6];
        let rate = (3.0 + faster - leak * number as f64) * (1.0 + cubic * size * size);
        let swing = |x: &f64| size * (-decay * x).exp() * (rate * x).cos() + noise.sample(&mut rng);
        let y = x.iter().map(swing).collect();
        Run { label: (number + 1).to_string(), inputs: vec![x], outputs: vec![y], kind: 0 }
    };
    let runs = (0..runs).map(of_run).collect();
    common::recording("t_s", runs, None)
}

/// What differs from run to run is no cause that is named: it is left over by the cause that is, or said where nothing is.
#[test]
fn what_differs_from_run_to_run_is_left_over() {
    let of = |runs: usize, hidden: [f64; 4]| {
        let options = Options { replicates: 199, ..Options::default() };
        diagnose(&swing(), &swings(runs, hidden), &[], &options, &Silent).unwrap()
    };
    let said = |answer: &Diagnosis| answer.run_differences.iter().any(|of| of.name == "another rate");
    for runs in [3, 6] {
        let both = of(runs, [0.15, 0.0, 0.0, 0.02]);
        assert_eq!((both.verdict, &both.chosen[..]), (Verdict::Partly, &["damping".to_owned()][..]));
        assert!(said(&both) && both.explained_share.unwrap() > 0.9 && !both.leftover.is_empty());
        let damping = both.mechanisms.iter().find(|m| m.id == "damping").unwrap();
        let [low, high] = damping.parameters[0].ci95;
        assert!(low < 0.15 && 0.15 < high && high - low < 0.02, "{low} to {high}");
        assert!(both.mechanisms.iter().all(|m| m.id != "another-rate"));
        let alone = of(runs, [0.0, 0.0, 0.0, 0.02]);
        assert_eq!((alone.verdict, alone.chosen.len()), (Verdict::Unexplained, 0));
        assert!(said(&alone));
    }
    for (hidden, id) in [
        ([0.15, 0.0, 0.0, 0.0], "damping"),
        ([0.0, 0.02, 0.0, 0.0], "softening"),
        ([0.0, 0.0, 0.1, 0.0], "spring"),
    ] {
        let answer = of(6, hidden);
        assert_eq!((answer.verdict, &answer.chosen[..]), (Verdict::Explained, &[id.to_owned()][..]));
        assert!(!said(&answer));
    }
    // What is nearly the same in all runs is a cause.
    let shifted = of(6, [0.0, 0.0, 0.1, 0.004]);
    assert_eq!((shifted.verdict, &shifted.chosen[..]), (Verdict::Partly, &["spring".to_owned()][..]));
    assert!(said(&shifted), "{:?}", shifted.undetermined);
    assert!(!said(&of(2, [0.15, 0.0, 0.0, 0.02])), "two runs do not say how runs differ");
}
