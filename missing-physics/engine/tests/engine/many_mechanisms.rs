//! Models that know so many mechanisms that only those which promise anything are fitted; parameters that may stay open.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use crate::common::{Curve, mechanism, parameter, recording};
use missing_physics::data::{Recording, Run};
use missing_physics::diagnosis::{Diagnosis, Verdict};
use missing_physics::engine::{Options, diagnose};
use missing_physics::model::{Mechanism, Model};
use missing_physics::observer::Silent;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const WAVES: usize = 24;
const ANY: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// An offset, and 24 waves that may be on.
fn waves() -> Curve {
    let amplitudes = (1..=WAVES).map(|k| parameter(&format!("amplitude_{k}"), 0.0, ANY));
    let parameters = std::iter::once(parameter("offset", 0.0, ANY)).chain(amplitudes).collect();
    let mechanisms = (1..=WAVES).map(|k| mechanism(&format!("wave-{k}"), vec![k])).collect();
    Curve::new(parameters, mechanisms, |s, _, x| {
        s[0] + (1..=WAVES).map(|k| s[k] * (k as f64 * x).sin()).sum::<f64>()
    })
}

/// Two runs of a law with noise of 0.1.
fn draw(law: impl Fn(f64) -> f64) -> Recording {
    let noise = Normal::new(0.0, 0.1).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let xs: Vec<f64> = (0..120).map(|i| 0.05 * f64::from(i)).collect();
    let runs = ["1", "2"].map(|label| Run {
        label: label.into(),
        outputs: vec![xs.iter().map(|x| law(*x) + noise.sample(&mut rng)).collect()],
        inputs: vec![xs.clone()],
        kind: 0,
    });
    recording("x", runs.into(), Some(0.1))
}

fn answer(model: &dyn Model, recording: &Recording) -> Diagnosis {
    let options = Options { replicates: 99, ..Options::default() };
    diagnose(model, recording, &[], &options, &Silent).unwrap()
}

#[test]
fn two_of_many_are_found() {
    let found = answer(&waves(), &draw(|x| 1.0 + 0.4 * (5.0 * x).sin() - 0.3 * (17.0 * x).sin()));
    let mut chosen = found.chosen;
    chosen.sort();
    assert_eq!(chosen, ["wave-17", "wave-5"]);
}

#[test]
fn none_of_many_is_named_for_nothing() {
    assert!(answer(&waves(), &draw(|_| 1.0)).chosen.is_empty());
}

/// An interval by profile likelihood, which is longer on one side, is the same beside many mechanisms, where profiles go by what the linearised
/// model foresees, as beside none.
#[test]
fn intervals_of_one_of_many_are_those_of_one_alone() {
    let decay = |s: &[f64], _: &[f64], x: f64| s[0] + s[1] * (-s[2] * x).exp();
    let among_waves = |s: &[f64], _: &[f64], x: f64| {
        let waves: f64 = (1..=WAVES).map(|k| s[k + 2] * (k as f64 * x).sin()).sum();
        s[0] + s[1] * (-s[2] * x).exp() + waves
    };
    let decays = |waves: usize, law| {
        let mut parameters = vec![parameter("offset", 0.0, ANY), parameter("size", 0.0, ANY)];
        parameters.push(parameter("rate", 1.0, [0.0, 50.0]));
        parameters.extend((1..=waves).map(|k| parameter(&format!("amplitude_{k}"), 0.0, ANY)));
        let mut mechanisms = vec![mechanism("decay", vec![1, 2])];
        mechanisms.extend((1..=waves).map(|k| mechanism(&format!("wave-{k}"), vec![k + 2])));
        Curve::new(parameters, mechanisms, law)
    };
    let recording = draw(|x| 1.0 + 0.4 * (-3.0 * x).exp());
    let [alone, of_many] = [decays(0, decay), decays(WAVES, among_waves)].map(|model| {
        let found = answer(&model, &recording);
        assert_eq!(found.chosen, ["decay"]);
        let rate = found.mechanisms.iter().find(|m| m.id == "decay").unwrap().parameters[1].clone();
        assert_eq!(rate.name, "rate");
        rate
    });
    let [below, above] = [of_many.value - of_many.ci95[0], of_many.ci95[1] - of_many.value];
    assert!(above > 1.3 * below, "{of_many:?}");
    for (a, b) in alone.ci95.iter().zip(&of_many.ci95) {
        assert!((a - b).abs() < 0.05 * (above + below), "{alone:?}, {of_many:?}");
    }
}

/// A sine that is cut at its top alone: the upper bound is reported, the lower one stays open and unsaid.
#[test]
fn a_bound_that_nothing_reaches_stays_open() {
    let cut = |may_be_open| {
        let bound = |name, start| parameter(name, start, [-2.0, 2.0]);
        let parameters = vec![parameter("amplitude", 1.0, ANY), bound("upper", 1.5), bound("lower", -1.5)];
        let saturation = Mechanism { may_be_open, ..mechanism("saturation", vec![1, 2]) };
        Curve::new(parameters, vec![saturation], |s, _, x| (s[0] * x.sin()).min(s[1]).max(s[2]))
            .from(|_| vec![vec![(1, 0.8)], vec![(2, -0.8)]])
    };
    let recording = draw(|x| x.sin().min(0.6));
    let found = answer(&cut(vec![1, 2]), &recording);
    assert_eq!(found.chosen, ["saturation"]);
    let [upper] = &found.mechanisms[0].parameters[..] else { unreachable!("the upper bound alone") };
    assert!(upper.name == "upper" && upper.ci95[0] < 0.6 && upper.ci95[1] > 0.6, "{upper:?}");
    // Where both have to be determined, one that is not rules the mechanism out.
    assert!(answer(&cut(vec![]), &recording).chosen.is_empty());
}

/// A mechanism that cannot be computed where its fit would begin is not passed over in silence.
#[test]
fn a_mechanism_that_cannot_be_fitted_is_named() {
    let parameters = vec![parameter("offset", 0.0, ANY), parameter("slope", 0.0, ANY)];
    let law = |s: &[f64], _: &[f64], x: f64| if s[1] > 5.0 { f64::NAN } else { s[0] + s[1] * x };
    let model =
        Curve::new(parameters, vec![mechanism("a-slope", vec![1])], law).from(|_| vec![vec![(1, 9.0)]]);
    let found = answer(&model, &draw(|x| 0.5 * x));
    let said = found.remarks.iter().any(|r| r.starts_with("a slope could not be fitted: "));
    assert!(said, "{:?}", found.remarks);
}

/// A mechanism whose effect can be computed nowhere is named, and loses no answer.
#[test]
fn a_mechanism_that_cannot_be_computed_loses_no_answer() {
    let parameters = ["offset", "slope", "curvature"].map(|name| parameter(name, 0.0, ANY)).into();
    let law = |s: &[f64], _: &[f64], x: f64| if s[1] == 0.0 { s[0] + s[2] * x * x } else { f64::NAN };
    let model =
        Curve::new(parameters, vec![mechanism("a-slope", vec![1]), mechanism("a-curvature", vec![2])], law);
    let found = answer(&model, &draw(|x| 0.5 * x * x));
    assert_eq!(found.chosen, ["a-curvature"]);
    let said = found.remarks.iter().any(|r| r.starts_with("a slope could not be fitted: "));
    assert!(said, "{:?}", found.remarks);
    // As where nothing is wrong.
    assert_eq!(answer(&model, &draw(|_| 0.5)).verdict, Verdict::Adequate);
}

/// Moving air acts through drag, which is free then: drag with moving air is the same set by another name, and is counted once.
#[test]
fn sets_that_differ_by_a_companion_alone_are_counted_once() {
    let parameters = ["offset", "drag", "air"].map(|name| parameter(name, 0.0, ANY)).into();
    let moving = Mechanism {
        companions: vec![1],
        companions_unless: vec!["drag".into()],
        ..mechanism("moving-air", vec![2])
    };
    let law = |s: &[f64], _: &[f64], x: f64| s[0] - s[1] * (x - s[2]).powi(2);
    let model = Curve::new(parameters, vec![mechanism("drag", vec![1]), moving], law);
    let found = answer(&model, &draw(|x| 1.0 - 0.1 * x * x));
    assert_eq!(found.chosen, ["drag"]);
    let held: Vec<&[String]> = found.sets.iter().map(|s| &s.ids[..]).filter(|ids| !ids.is_empty()).collect();
    assert_eq!(held.len(), 2, "{held:?}");
    // Whichever of the two it is, drag is at work.
    let drag = found.mechanisms.iter().find(|m| m.id == "drag").unwrap();
    assert!(drag.probability > 0.99, "{}", drag.probability);
}

/// A mechanism that comes with another is looked at beside a third as well, though three others alone do better than that third.
#[test]
fn what_comes_with_another_is_found_beside_a_third() {
    let names = ["offset", "wave", "chirp", "early", "midway", "late", "ripple"];
    let parameters = names.map(|name| parameter(name, 0.0, ANY)).into();
    let chirp = Mechanism { companions: vec![1], ..mechanism("chirp", vec![2]) };
    let mut mechanisms = vec![mechanism("wave", vec![1]), chirp];
    mechanisms.extend((3..names.len()).map(|k| mechanism(names[k], vec![k])));
    let law = |s: &[f64], _: &[f64], x: f64| {
        let burst =
            |(at, size): (f64, &f64)| size * (-(x - at).powi(2)).exp() * (5.0 * x + 0.5 * x * x).sin();
        let bursts: f64 = [1.0, 3.0, 5.0].into_iter().zip(&s[3..]).map(burst).sum();
        s[0] + s[1] * (5.0 * x + s[2] * x * x).sin() + bursts + s[6] * (17.0 * x).sin()
    };
    let model = Curve::new(parameters, mechanisms, law).from(|_| vec![vec![(1, 1.0), (2, 0.45)]]);
    let found = answer(&model, &draw(|x| (5.0 * x + 0.5 * x * x).sin() + 0.12 * (17.0 * x).sin()));
    assert_eq!(found.chosen, ["chirp", "ripple"], "{:?}", found.sets);
}
