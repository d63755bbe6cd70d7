//! Liquids told apart by a linear machine: clouds that are apart, clouds that are one, and what is no data.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use liquid_haptics::classify::{Classifier, ClassifyError, cross_validate};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

fn clouds(
    places: &[(&str, f64)],
    spread: f64,
    each: usize,
    rng: &mut ChaCha8Rng,
) -> (Vec<Vec<f64>>, Vec<String>) {
    let (mut rows, mut labels) = (Vec::new(), Vec::new());
    let noise = Normal::new(0.0, spread).unwrap();
    for (name, place) in places {
        for _ in 0..each {
            rows.push(vec![place + noise.sample(rng), 1e3 * noise.sample(rng)]);
            labels.push((*name).to_owned());
        }
    }
    (rows, labels)
}

#[test]
fn liquids_apart_are_told_apart_and_liquids_alike_are_not() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let liquids = [("water", -6.0), ("oil", -4.2), ("soap", -3.3), ("honey", -2.1)];
    let (rows, labels) = clouds(&liquids, 0.1, 15, &mut rng);
    let apart = cross_validate(&rows, &labels, 1.0, 5, &mut rng).unwrap();
    assert!(apart.accuracy() > 0.98, "{apart:?}");
    assert_eq!(apart.classes, ["honey", "oil", "soap", "water"]);
    let machine = Classifier::fit(&rows, &labels, 1.0).unwrap();
    assert_eq!(machine.predict(&[-4.1, 0.0]).unwrap(), "oil");
    // The same cloud under two names: the folds must not know better.
    let (rows, labels) = clouds(&[("a", 0.0), ("b", 0.0)], 1.0, 100, &mut rng);
    let alike = cross_validate(&rows, &labels, 1.0, 5, &mut rng).unwrap();
    assert!((0.38..0.62).contains(&alike.accuracy()), "{alike:?}");
    assert_eq!(alike.counts.iter().flatten().sum::<usize>(), 200);
}

/// Two normal clouds at a distance of two of their deviations: no machine does better than Phi(1) = 84 %, and a linear one comes near.
#[test]
fn it_comes_near_the_best_there_is() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let (rows, labels) = clouds(&[("a", 0.0), ("b", 2.0)], 1.0, 200, &mut rng);
    let got = cross_validate(&rows, &labels, 1.0, 5, &mut rng).unwrap().accuracy();
    assert!((0.79..0.89).contains(&got), "{got}");
}

#[test]
fn what_is_no_data_is_an_error() {
    let rows = vec![vec![0.0], vec![1.0], vec![2.0]];
    let labels = ["a", "a", "b"].map(str::to_owned);
    assert!(matches!(Classifier::fit(&rows, &labels[..2], 1.0), Err(ClassifyError::Labels { .. })));
    assert!(matches!(Classifier::fit(&rows, &labels, 0.0), Err(ClassifyError::Penalty { .. })));
    assert!(matches!(Classifier::fit(&rows[..2], &labels[..2], 1.0), Err(ClassifyError::TooFew { .. })));
    assert!(matches!(Classifier::fit(&[], &[], 1.0), Err(ClassifyError::TooFew { .. })));
    let odd = vec![vec![0.0], vec![1.0, 2.0], vec![f64::NAN]];
    assert!(matches!(Classifier::fit(&odd, &labels, 1.0), Err(ClassifyError::Length { row: 1, .. })));
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    assert!(matches!(cross_validate(&rows, &labels, 1.0, 2, &mut rng), Err(ClassifyError::TooFew { .. })));
    let machine = Classifier::fit(&rows, &labels, 1.0).unwrap();
    assert!(matches!(machine.predict(&[f64::NAN]), Err(ClassifyError::Feature { .. })));
    assert!(machine.predict(&[]).is_err());
}
