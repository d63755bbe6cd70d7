//! The shipped posterior on pours it has not seen, and what it refuses.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use bayes_sim::error::Error;
use bayes_sim::prior::{Marginal, Prior};
use granular_infer::posterior::GrainPosterior;
use granular_infer::scene::{Grain, PriorError, SERIES_M, Scene, check_prior, prior};
use granular_infer::tasks::{Ring, RingHeights};
use granular_infer::view::View;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Restitution shows in a heap: estimates of soft and of hard grains lie apart, each nearer to its own.
#[test]
fn soft_grains_are_told_from_hard_ones() {
    let (posterior, scene, view) = (GrainPosterior::shipped().unwrap(), Scene::default(), View::default());
    let [soft, hard] = [0.15, 0.7].map(|restitution| {
        let grain = Grain { sliding_friction: 0.6, rolling_friction: 0.05, restitution };
        let heap = scene.grains(&grain, 0.12, 3).unwrap();
        let seen = view.features(&heap, &scene.rig, &mut ChaCha8Rng::seed_from_u64(3)).unwrap();
        let inferred = posterior.infer(&seen).unwrap();
        assert!(!inferred.resemblance.is_doubtful());
        assert!(prior().unwrap().contains(&inferred.estimate().unwrap().theta()));
        inferred.estimate().unwrap().restitution
    });
    assert!(soft < 0.4 && hard > 0.5, "{soft} and {hard}");
}

/// A posterior of one picture takes no series, and nothing is inferred from nothing.
#[test]
fn a_posterior_of_one_picture_takes_one() {
    let posterior = GrainPosterior::shipped().unwrap();
    assert_eq!(posterior.pictures(), 1);
    for got in [0, 2] {
        let refused = posterior.infer_series(&vec![[0.02; 16]; got]).unwrap_err();
        assert!(matches!(refused, Error::Length { expected: 16, got: n, .. } if n == 16 * got), "{refused}");
    }
}

/// From three heights the restitution of grains that were not learned from shows to a few hundredths, within what the posterior says.
#[test]
fn a_series_from_three_heights_tells_the_restitution() {
    let (posterior, scene, view) =
        (GrainPosterior::shipped_series().unwrap(), Scene::default(), View::default());
    assert_eq!(posterior.pictures(), SERIES_M.len());
    for restitution in [0.2, 0.45, 0.7] {
        let grain = Grain { sliding_friction: 0.6, rolling_friction: 0.05, restitution };
        let of = |height_m: f64| {
            let heap = scene.grains(&grain, height_m, 11).unwrap();
            view.features(&heap, &scene.rig, &mut ChaCha8Rng::seed_from_u64(11)).unwrap()
        };
        let inferred = posterior.infer_series(&SERIES_M.map(of)).unwrap();
        assert!(!inferred.resemblance.is_doubtful());
        let draws = inferred.posterior.sample(2000, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        let mut e = draws.column(2);
        e.sort_by(f64::total_cmp);
        assert!((e[10]..e[1989]).contains(&restitution), "{restitution}: {} to {}", e[10], e[1989]);
        let found = inferred.estimate().unwrap().restitution;
        assert!((found - restitution).abs() < 0.15, "{found} for {restitution}");
    }
    assert!(posterior.infer(&[0.02; 16]).is_err());
}

/// On a cloth that holds grains less than the velvet that one posterior takes for granted, the one for any cloth still holds the restitution.
#[test]
fn a_series_on_an_unknown_cloth_tells_the_restitution() {
    let posterior = GrainPosterior::shipped_cloths().unwrap();
    let view = View::default();
    for cloth_rolling_friction in [0.12, 0.8] {
        let scene = Scene { cloth_rolling_friction, ..Scene::default() };
        let grain = Grain { sliding_friction: 0.6, rolling_friction: 0.05, restitution: 0.5 };
        let of = |height_m: f64| {
            let heap = scene.grains(&grain, height_m, 12).unwrap();
            view.features(&heap, &scene.rig, &mut ChaCha8Rng::seed_from_u64(12)).unwrap()
        };
        let found = posterior.infer_series(&SERIES_M.map(of)).unwrap().estimate().unwrap().restitution;
        assert!((found - 0.5).abs() < 0.2, "{found} on a cloth of {cloth_rolling_friction}");
    }
}

#[test]
fn what_no_pour_looks_like_is_doubted_or_refused() {
    let posterior = GrainPosterior::shipped().unwrap();
    assert!(posterior.infer(&[1.0; 16]).unwrap().resemblance.is_doubtful());
    assert!(posterior.infer(&[f64::NAN; 16]).is_err());
    assert!(GrainPosterior::from_bytes(b"nothing").is_err());
    assert_eq!(GrainPosterior::from_bytes(&posterior.to_bytes().unwrap()).unwrap(), posterior);
}

#[test]
fn priors_outside_physics_are_refused() {
    let flat = |bounds: &[[f64; 2]]| check_prior(&Prior::uniform(bounds).unwrap());
    check_prior(&prior().unwrap()).unwrap();
    assert_eq!(flat(&[[0.1, 1.0]]), Err(PriorError::Dimensions { received: 1 }));
    let bouncier = flat(&[[0.1, 1.0], [0.1, 0.5], [0.2, 1.2]]).unwrap_err();
    assert!(bouncier.to_string().contains("restitution is 1.2"), "{bouncier}");
    assert!(matches!(flat(&[[-0.1, 1.0], [0.1, 0.5], [0.2, 0.8]]), Err(PriorError::Outside(_))));
    let unbounded = Marginal::Normal { mean: 0.5, sd: 0.1 };
    let prior = Prior::new(vec![unbounded, unbounded, Marginal::Uniform { low: 0.1, high: 0.9 }]).unwrap();
    assert!(check_prior(&prior).is_err());
}

/// Higher pours make wider rings.
#[test]
fn wider_rings_are_poured_from_higher_up() {
    let heights = RingHeights::shipped().unwrap();
    let of = |outer_m: f64| heights.height_m(Ring { inner_m: 0.3 * outer_m, outer_m }).unwrap().0;
    assert!(of(0.026) < 0.05 && of(0.034) > of(0.026) + 0.01, "{} {}", of(0.026), of(0.034));
    assert!(heights.height_m(Ring { inner_m: f64::NAN, outer_m: 0.03 }).is_err());
}
