//! The particle filter: against least squares where all is linear, misheard impacts that later ones give away, and what it recovers from.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use bounce_audio::track::{FilterSettings, HearingError, ParticleFilter, Seen, TrackError, Tracker};
use nalgebra::{DMatrix, DVector};

use crate::track::{SPACE, dice, straight};

fn filter(e: f64, log10_kappa: f64) -> ParticleFilter {
    ParticleFilter::new(&[[e, log10_kappa]], SPACE, FilterSettings::default()).unwrap()
}

fn run(tracker: &mut ParticleFilter, impacts: &[Seen], seed: u64) -> [f64; 2] {
    tracker.begin();
    let (mut paddle, mut rng) = ([0.275, 0.1], dice(seed));
    for s in impacts {
        if let Some(goal) = tracker.heard(s, paddle, &mut rng) {
            paddle = [goal.y_m, goal.z_m];
        }
    }
    paddle
}

/// Without scatter or outliers the state is linear in the places: the posterior is that of least squares, with the throw's prior.
#[test]
fn without_chance_it_is_least_squares() {
    let (e, dy) = (0.85, 0.04);
    let (mut seen, _) = straight(e, dy);
    for (s, off) in seen.iter_mut().zip([[4e-3, -6e-3], [-3e-3, 5e-3], [6e-3, 2e-3], [-5e-3, -4e-3]]) {
        s.place_m = [s.place_m[0] + off[0], s.place_m[1] + off[1]];
    }
    let hearing = HearingError { outliers: 1e-9, unheard: 1e-9, spurious: 1e-9, ..HearingError::default() };
    let settings = FilterSettings { particles: 1, hearing, speed_sigma: 1e-4, ..FilterSettings::default() };
    let mut tracker = ParticleFilter::new(&[[e, 12.0]], SPACE, settings).unwrap();
    run(&mut tracker, &seen, 1);
    let (mean, covariance) = tracker.state().unwrap();
    // Unknown: the first place and the velocity after it, along each axis; each flight e as long, its velocity e times the last.
    let n = seen.len();
    let mut rows = DMatrix::zeros(n + 1, 2);
    let (mut reach, mut factor) = (0.0, 1.0);
    for k in 0..n {
        if k > 0 {
            reach += factor * (seen[k].t_s - seen[k - 1].t_s);
            factor *= e;
        }
        rows[(k, 0)] = 1.0 / hearing.sigma_m;
        rows[(k, 1)] = reach / hearing.sigma_m;
    }
    rows[(n, 1)] = 1.0 / settings.throw_sigma_m_s;
    let spread = (rows.transpose() * &rows).try_inverse().unwrap();
    // The last place, and the velocity before it.
    let last = DMatrix::from_row_slice(2, 2, &[1.0, reach, 0.0, factor / e]);
    let expected_spread = &last * &spread * last.transpose();
    for axis in 0..2 {
        let mut b = DVector::from_iterator(
            n + 1,
            seen.iter().map(|s| s.place_m[axis] / hearing.sigma_m).chain([0.0]),
        );
        b[n] = settings.throw_m_s[axis] / settings.throw_sigma_m_s;
        let expected = &last * &spread * rows.transpose() * b;
        for k in 0..2 {
            approx::assert_relative_eq!(mean[axis + 2 * k], expected[k], epsilon = 2e-4);
            for l in 0..2 {
                let (got, want) = (covariance[axis + 2 * k][axis + 2 * l], expected_spread[(k, l)]);
                approx::assert_relative_eq!(got, want, max_relative = 2e-2);
            }
        }
    }
}

/// Which impacts were misheard, against all combinations weighed one by one: for each, the density of the places under a Gaussian prior of
/// the first place and the velocity.
#[test]
fn what_was_misheard_is_as_probable_as_all_combinations_say() {
    let e = 0.9;
    let (mut seen, _) = straight(e, 0.05);
    seen[0].place_m[1] += 0.12;
    let hearing = HearingError { unheard: 1e-9, spurious: 1e-9, ..HearingError::default() };
    let settings =
        FilterSettings { particles: 2_000, hearing, speed_sigma: 1e-4, ..FilterSettings::default() };
    for count in 2..=seen.len() {
        let mut tracker = ParticleFilter::new(&[[e, 12.0]], SPACE, settings).unwrap();
        run(&mut tracker, &seen[..count], 1);
        let (mut total, mut shares) = (0.0, vec![0.0; count]);
        for wrong in 0..1u32 << count {
            let mut weight = 1.0;
            let sigma =
                |k: usize| if wrong >> k & 1 == 1 { hearing.outlier_sigma_m } else { hearing.sigma_m };
            for k in 0..count {
                weight *= if wrong >> k & 1 == 1 { hearing.outliers } else { 1.0 - hearing.outliers };
            }
            for axis in 0..2 {
                // Places after the first, less their means, are the first one's error and the velocity's, and their own.
                let n = count - 1;
                let (mut rows, mut noise, mut off) =
                    (DMatrix::zeros(n, 2), DMatrix::zeros(n, n), DVector::zeros(n));
                let (mut reach, mut factor) = (0.0, 1.0);
                for k in 0..n {
                    reach += factor * (seen[k + 1].t_s - seen[k].t_s);
                    factor *= e;
                    rows[(k, 0)] = sigma(0);
                    rows[(k, 1)] = reach * settings.throw_sigma_m_s;
                    noise[(k, k)] = sigma(k + 1).powi(2);
                    let mean = seen[0].place_m[axis] + reach * settings.throw_m_s[axis];
                    off[k] = seen[k + 1].place_m[axis] - mean;
                }
                let covariance = &rows * rows.transpose() + noise;
                let inverse = covariance.clone().try_inverse().unwrap();
                weight *= (-0.5 * off.dot(&(&inverse * &off))).exp() / covariance.determinant().sqrt();
            }
            total += weight;
            for (k, share) in shares.iter_mut().enumerate() {
                *share += if wrong >> k & 1 == 1 { weight } else { 0.0 };
            }
        }
        for (k, share) in shares.iter().enumerate() {
            let got = tracker.misheard(k as u32).unwrap();
            assert!(
                (got - share / total).abs() < 5e-3,
                "{count} impacts, impact {k}: {got}, {}",
                share / total
            );
        }
    }
}

#[test]
fn a_ball_without_chance_is_met() {
    let (seen, [_, at @ ..]) = straight(0.85, 0.06);
    let mut tracker = filter(0.85, 4.0);
    let paddle = run(&mut tracker, &seen, 2);
    let off = (paddle[0] - at[0]).hypot(paddle[1] - at[1]);
    assert!(off < 0.07, "{off} m off");
    for k in 0..seen.len() as u32 {
        assert!(tracker.misheard(k).unwrap() < 0.2, "impact {k}");
    }
    assert_eq!(tracker.misheard(seen.len() as u32), None);
}

/// Whichever impact is misheard, the first two included, later ones give it away, and the paddle is where the ball comes.
#[test]
fn a_misheard_impact_is_given_up_when_later_ones_contradict_it() {
    let (seen, [_, at @ ..]) = straight(0.9, 0.05);
    assert!(seen.len() >= 4);
    for wrong in 0..2 {
        for off in [[0.0, 0.12], [0.1, -0.08], [-0.1, 0.1]] {
            let mut heard = seen.clone();
            heard[wrong].place_m = [heard[wrong].place_m[0] + off[0], heard[wrong].place_m[1] + off[1]];
            let mut tracker = filter(0.9, 3.8);
            let paddle = run(&mut tracker, &heard[..wrong + 1], 3);
            let first = tracker.misheard(wrong as u32).unwrap();
            assert!(wrong > 0 || (0.05..0.3).contains(&first), "{first} before anything contradicts");
            assert!(paddle.iter().all(|p| p.is_finite()));
            let paddle = run(&mut tracker, &heard, 3);
            let far = (paddle[0] - at[0]).hypot(paddle[1] - at[1]);
            let shares: Vec<f64> = (0..heard.len() as u32).map(|k| tracker.misheard(k).unwrap()).collect();
            assert!(shares[wrong] > 0.9, "impact {wrong}, {off:?}: {shares:?}");
            assert!(far < 0.07, "impact {wrong}, {off:?}: {far} m off");
        }
    }
}

/// What is no impact does not move the ball, and an impact that was not heard leaves no gap.
#[test]
fn sounds_too_many_and_too_few() {
    let (seen, [_, at @ ..]) = straight(0.85, 0.03);
    let near = |p: [f64; 2]| (p[0] - at[0]).hypot(p[1] - at[1]);
    let mut tracker = filter(0.85, 3.8);
    let mut more = seen.clone();
    more.insert(3, Seen { t_s: seen[2].t_s + 0.06, place_m: [0.1, 0.5] });
    assert!(near(run(&mut tracker, &more, 4)) < 0.07);
    assert!(tracker.misheard(3).unwrap() > 0.9);
    for missing in 1..seen.len() - 1 {
        let mut fewer = seen.clone();
        fewer.remove(missing);
        let off = near(run(&mut tracker, &fewer, 5));
        assert!(off < 0.07, "without impact {missing} {off} m off");
    }
}

#[test]
fn a_decision_allocates_nothing() {
    let (seen, _) = straight(0.85, 0.03);
    let mut tracker = filter(0.85, 3.8);
    let mut rng = dice(1);
    let counted = allocation_counter::measure(|| {
        tracker.begin();
        for s in &seen {
            tracker.heard(s, [0.275, 0.1], &mut rng);
        }
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let (seen, _) = straight(0.85, 0.03);
    let balls: Vec<[f64; 2]> =
        (0..50).map(|k| [0.84 + 4e-4 * f64::from(k), 3.0 + 0.01 * f64::from(k)]).collect();
    let go = |seed| {
        let mut tracker = ParticleFilter::new(&balls, SPACE, FilterSettings::default()).unwrap();
        let mut rng = dice(seed);
        let goals: Vec<_> = seen.iter().map(|s| tracker.heard(s, [0.1, 0.1], &mut rng)).collect();
        (goals, tracker.state())
    };
    assert_eq!(go(7), go(7));
    assert_ne!(go(7), go(8));
}

#[test]
fn it_recovers_from_what_cannot_be() {
    let (seen, [_, at @ ..]) = straight(0.85, 0.03);
    let mut tracker = filter(0.85, 3.8);
    let mut rng = dice(9);
    assert_eq!(tracker.state(), None);
    assert_eq!(tracker.misheard(0), None);
    // No numbers are no sound.
    for bad in [f64::NAN, f64::INFINITY] {
        assert_eq!(tracker.heard(&Seen { t_s: bad, place_m: [0.1, 0.1] }, [0.2, 0.1], &mut rng), None);
        assert_eq!(tracker.heard(&Seen { t_s: 0.0, place_m: [0.1, bad] }, [0.2, 0.1], &mut rng), None);
    }
    assert_eq!(tracker.state(), None);
    // A throw that broke off long ago, then another one without a call between them.
    tracker.heard(&Seen { t_s: -9.0, place_m: [0.5, 0.5] }, [0.2, 0.1], &mut rng);
    let mut paddle = [0.275, 0.1];
    for s in &seen {
        if let Some(goal) = tracker.heard(s, paddle, &mut rng) {
            paddle = [goal.y_m, goal.z_m];
        }
    }
    let off = (paddle[0] - at[0]).hypot(paddle[1] - at[1]);
    assert!(off < 0.07, "{off} m off");
    // A sound before the last one is none; hundreds of sounds are no harm.
    tracker.heard(&Seen { t_s: 0.0, place_m: [0.1, 0.1] }, paddle, &mut rng);
    for k in 0..300 {
        let t_s = 10.0 + 0.011 * f64::from(k);
        tracker.heard(&Seen { t_s, place_m: [1e6, -1e6] }, paddle, &mut rng);
    }
    let (mean, _) = tracker.state().unwrap();
    assert!(mean.iter().all(|v| v.is_finite()), "{mean:?}");
}

#[test]
fn what_is_out_of_range_is_refused() {
    let none = ParticleFilter::new(&[], SPACE, FilterSettings::default());
    assert_eq!(none.err(), Some(TrackError::NoBall { expected: 1, got: 0 }));
    for ball in [[0.0, 3.0], [1.1, 3.0], [f64::NAN, 3.0], [0.8, f64::NAN], [0.8, 400.0]] {
        assert!(ParticleFilter::new(&[ball], SPACE, FilterSettings::default()).is_err(), "{ball:?}");
    }
    let good = FilterSettings::default();
    let hearing = good.hearing;
    for bad in [
        FilterSettings { particles: 0, ..good },
        FilterSettings { ahead: 0, ..good },
        FilterSettings { touch_m: f64::NAN, ..good },
        FilterSettings { energy_price_s_m2: -1.0, ..good },
        FilterSettings { hearing: HearingError { outliers: 0.0, ..hearing }, ..good },
        FilterSettings { hearing: HearingError { sigma_m: f64::INFINITY, ..hearing }, ..good },
    ] {
        assert!(ParticleFilter::new(&[[0.8, 3.0]], SPACE, bad).is_err(), "{bad:?}");
    }
    // One particle is few, but no failure.
    let one = FilterSettings { particles: 1, ..good };
    let (seen, _) = straight(0.85, 0.03);
    let mut tracker = ParticleFilter::new(&[[0.85, 3.0]], SPACE, one).unwrap();
    assert!(run(&mut tracker, &seen, 1).iter().all(|v| v.is_finite()));
}
