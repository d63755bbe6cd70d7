//! Dynamics learned from rolls whose law is known.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use dough_mbrl::dynamics::Dynamics;
use dough_mbrl::filter::{InitialState, Noise, Relaxation, follow};
use dough_mbrl::predictor::LearnError;
use dough_mbrl::roll::Roll;
use dough_mbrl::sensitivity::{PER_ROLL, whitened};
use dough_mbrl::whitener::CommonModeWhitener;
use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const SIGMA: f64 = 4e-4;

fn law(state: [f64; 3], action: [f64; 2], cubic: f64) -> [f64; 3] {
    let [l, w, h] = state;
    let press = action[1] * (1.0 + 5.0 * (action[0] - 0.04));
    let push = 0.3 * press * (h / 0.04) + cubic * press * press * press / (0.03 * 0.03);
    [l + push, w - 0.3 * push, h - 0.4 * push * (w / 0.04)]
}

fn doughs(n: usize, cubic: f64, sigma: f64, rng: &mut ChaCha8Rng) -> Vec<Vec<Roll>> {
    uneven(n, cubic, sigma, [0.0; 2], Relaxation::NONE, rng)
}

/// Doughs that are rolled eight times each; states are measured twice, after a roll and before the next. Each roll, and each dough in all
/// its rolls, does more or less than the law by parts of these sigmas; the last part of each change is undone before the next roll.
fn uneven(
    n: usize,
    cubic: f64,
    sigma: f64,
    [scatter, softness]: [f64; 2],
    Relaxation { springback, loss_factor }: Relaxation,
    rng: &mut ChaCha8Rng,
) -> Vec<Vec<Roll>> {
    let part = |sigma: f64, rng: &mut ChaCha8Rng| -> f64 {
        // What does not scatter draws nothing.
        if sigma == 0.0 { 1.0 } else { 1.0 + sigma * rand_distr::Normal::new(0.0, 1.0).unwrap().sample(rng) }
    };
    let measured = |state: [f64; 3], rng: &mut ChaCha8Rng| {
        state.map(|x| {
            let z: f64 = StandardNormal.sample(rng);
            x + sigma * z
        })
    };
    (0..n)
        .map(|_| {
            let mut state = [
                rng.random_range(0.04..0.046),
                rng.random_range(0.038..0.042),
                rng.random_range(0.038..0.042),
            ];
            let soft = part(softness, rng);
            (0..8)
                .map(|_| {
                    let action = [rng.random_range(0.04..0.12), rng.random_range(0.01..0.04)];
                    let before = measured(state, rng);
                    let next = law(state, action, cubic);
                    let does = soft * part(scatter, rng);
                    let after =
                        std::array::from_fn(|k| loss_factor * (state[k] + does * (next[k] - state[k])));
                    state =
                        std::array::from_fn(|k| after[k] + springback * (loss_factor * state[k] - after[k]));
                    Roll { state: before, action, next: measured(after, rng) }
                })
                .collect()
        })
        .collect()
}

/// Error of the learned change, against the law, over states and actions of other doughs: its root mean square, m.
fn error(dynamics: &Dynamics, cubic: f64, rng: &mut ChaCha8Rng) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for roll in doughs(40, cubic, 0.0, rng).iter().flatten() {
        let next = law(roll.state, roll.action, cubic);
        for (k, p) in dynamics.predict(&roll.state, &roll.action).iter().enumerate() {
            squares += (next[k] - p.mean).powi(2);
            count += 1.0;
        }
    }
    f64::sqrt(squares / count)
}

#[test]
fn the_law_is_learned_and_not_the_noise_of_the_states() {
    is_learned(&[0.05]);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_a_law_of_the_second_degree_is_learned_and_not_the_noise() {
    is_learned(&[0.0]);
}

fn is_learned(cubics: &[f64]) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for &cubic in cubics {
        let training = doughs(60, cubic, SIGMA, &mut rng);
        let dynamics = Dynamics::learn(&training).unwrap();
        let followed = error(&dynamics, cubic, &mut rng);
        // Doughs of one roll each cannot be followed: the regression is on what was measured.
        let apart: Vec<Vec<Roll>> = training.into_iter().flatten().map(|r| vec![r]).collect();
        let naive = error(&Dynamics::learn(&apart).unwrap(), cubic, &mut rng);
        assert!(
            followed < 0.4 * SIGMA && followed < 0.8 * naive,
            "cubic {cubic}: {followed} m, regression on measured states {naive} m"
        );
        for measured in dynamics.noise().measured {
            for variance in measured.iter() {
                assert!((0.8..1.2).contains(&(variance.sqrt() / SIGMA)), "{}", variance.sqrt());
            }
        }
    }
}

#[test]
fn what_was_not_learned_is_said() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let dynamics = Dynamics::learn(&doughs(10, 0.0, SIGMA, &mut rng)).unwrap();
    let sigma = |state: [f64; 3], action: [f64; 2]| dynamics.predict(&state, &action)[0].sigma;
    // Far from all training a prediction is worth less.
    assert!(sigma([0.14, 0.036, 0.034], [0.08, 0.05]) > 3.0 * sigma([0.06, 0.036, 0.034], [0.08, 0.02]));
}

#[test]
fn too_few_rolls_and_rolls_that_are_all_alike_are_errors() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let few = doughs(5, 0.0, SIGMA, &mut rng);
    assert!(matches!(
        Dynamics::learn(&few),
        Err(LearnError::TooFew { rolls: 40, coefficients: 21, least: 42 })
    ));
    let alike = vec![vec![few[0][0]; 100]];
    assert!(matches!(Dynamics::learn(&alike), Err(LearnError::Undetermined { degree: 2 })));
}

/// Learned from forty doughs, and asked of twelve others: what is left of their innovations, once it has been taken apart by what
/// was not learned, is as large as it is said to be, and no dough is off as a whole.
#[test]
#[ignore = "long: .ci/run --long"]
fn long_doughs_that_were_not_learned_from_are_off_by_as_much_as_is_said() {
    let (mut square, mut count, mut levels, mut doughs_seen) = (0.0, 0.0, 0.0, 0.0);
    for seed in 10..13 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let dynamics = Dynamics::learn(&doughs(40, 0.05, SIGMA, &mut rng)).unwrap();
        let others = doughs(12, 0.05, SIGMA, &mut rng);
        let first: Vec<[f64; 3]> = others.iter().map(|d| d[0].state).collect();
        let initial = InitialState::of(&first, dynamics.noise());
        let follow_one = |dough: &Vec<Roll>| {
            follow(dough, &initial, dynamics.noise(), Relaxation::NONE, |i, x| {
                x + dynamics.change(x, &dough[i].action)
            })
        };
        let steps: Vec<_> = others.iter().map(follow_one).collect();
        let answers: Vec<_> =
            others.iter().zip(&steps).map(|(d, s)| dynamics.unlearned(s, d, |_| 1.0)).collect();
        let off: Vec<f64> =
            steps.iter().flat_map(|s| whitened(s).iter().copied().collect::<Vec<_>>()).collect();
        let apart = CommonModeWhitener::new(&answers).whiten(&DVector::from_vec(off));
        square += apart.norm_squared();
        count += apart.len() as f64;
        for dough in apart.as_slice().chunks(8 * PER_ROLL) {
            for k in 0..3 {
                let sum: f64 = dough.iter().skip(k).step_by(PER_ROLL).sum();
                levels += sum * sum / 8.0;
                doughs_seen += 1.0;
            }
        }
    }
    assert!((0.9..1.1).contains(&(square / count)), "{}", square / count);
    // Here no dough does anything for itself, and some is held possible: half of what is allowed for, measured.
    assert!((0.35..1.2).contains(&(levels / doughs_seen)), "{}", levels / doughs_seen);
}

/// How unevenly rolls do what they do, and how doughs differ, is learned from sixty doughs.
#[test]
fn scatter_of_rolls_is_no_softness_of_doughs() {
    are_told_apart([0.1, 0.0]);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_softness_of_doughs_is_no_scatter_of_rolls() {
    are_told_apart([0.0, 0.1]);
}

fn are_told_apart([scatter, softness]: [f64; 2]) {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let dynamics =
        Dynamics::learn(&uneven(60, 0.0, SIGMA, [scatter, softness], Relaxation::NONE, &mut rng)).unwrap();
    for (name, found, is) in [
        ("scatter", dynamics.noise().scatter.sqrt(), scatter),
        ("softness", dynamics.nuisance().softness.sqrt(), softness),
    ] {
        let held = if is > 0.0 { (0.7 * is)..(1.3 * is) } else { 0.0..0.04 };
        assert!(held.contains(&found), "{name}: {found} of {is}");
    }
}

/// A filter that knows the law, the noise and how much springs back and is lost leaves innovations that are white.
#[test]
fn innovations_are_white() {
    for (springback, loss_factor) in [(0.0, 1.0), (0.4, 1.0), (0.4, 0.98)] {
        let relaxation = Relaxation { springback, loss_factor };
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let doughs = uneven(200, 0.0, SIGMA, [0.0, 0.0], relaxation, &mut rng);
        let variance = nalgebra::Vector3::repeat(SIGMA * SIGMA);
        let noise = Noise { measured: [variance; 2], process: nalgebra::Vector3::zeros(), scatter: 0.0 };
        let first: Vec<[f64; 3]> = doughs.iter().map(|d| d[0].state).collect();
        let initial = InitialState::of(&first, &noise);
        let (mut squares, mut correlated, mut count) = (0.0, 0.0, 0.0);
        for dough in &doughs {
            let next = |i: usize, x: &nalgebra::Vector3<f64>| law((*x).into(), dough[i].action, 0.0).into();
            for pair in follow(dough, &initial, &noise, relaxation, next).windows(2) {
                let [after, before] = [pair[0].after.whitened(), pair[1].before.whitened()];
                squares += after.norm_squared() + before.norm_squared();
                correlated += after.dot(&before);
                count += 3.0;
            }
        }
        // 8,400 innovations: 4 standard errors of their variance and of a correlation.
        let mean = squares / (2.0 * count);
        assert!((mean - 1.0f64).abs() < 4.0 * f64::sqrt(1.0 / count), "{relaxation:?}: {mean}");
        assert!(
            (correlated / count).abs() < 4.0 / f64::sqrt(count),
            "{relaxation:?}: {}",
            correlated / count
        );
    }
}

/// Learned from balls whose diameters differ by a hundredth, a roll of half as much dough keeps its volume too, as nearly as is said.
#[test]
fn what_is_smaller_than_all_that_was_learned_from_keeps_its_volume() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let part = |[throw, depth]: [f64; 2], long: f64| 30.0 * throw * depth / long;
    let rolled = |[l, w, h]: [f64; 3], action| {
        let grown = 1.0 + part(action, 2.0 * l / (w + h));
        [l * grown, w / grown.sqrt(), h / grown.sqrt()]
    };
    let noisy = |state: [f64; 3], rng: &mut ChaCha8Rng| {
        state.map(|x| {
            let z: f64 = StandardNormal.sample(rng);
            x + SIGMA * z
        })
    };
    let training: Vec<Vec<Roll>> = (0..20)
        .map(|_| {
            let z: f64 = StandardNormal.sample(&mut rng);
            let mut state = [0.044, 0.042, 0.041].map(|x| x * (1.0 + 0.01 * z));
            (0..15)
                .map(|_| {
                    let action = [rng.random_range(0.04..0.12), rng.random_range(0.01..0.04)];
                    let before = noisy(state, &mut rng);
                    state = rolled(state, action);
                    Roll { state: before, action, next: noisy(state, &mut rng) }
                })
                .collect()
        })
        .collect();
    let dynamics = Dynamics::learn(&training).unwrap();
    let (smaller, action) = ([0.8 * 0.065, 0.8 * 0.0344, 0.8 * 0.0336], [0.08, 0.02]);
    let predicted = dynamics.predict(&smaller, &action);
    let next = predicted.map(|p| p.mean);
    let kept = (next.iter().product::<f64>() / smaller.iter().product::<f64>()).ln();
    // What is not known of the volume, the camera's noise left out.
    let not_learned = |k: usize| predicted[k].sigma.powi(2) - dynamics.noise().measured[1][k];
    let said = (0..3).map(|k| not_learned(k) / next[k].powi(2)).sum::<f64>().sqrt();
    assert!(kept.abs() < 2.0 * said && said < 0.02, "{kept} +- {said}");
}
