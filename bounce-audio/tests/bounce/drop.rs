//! Drops: the distribution of directions, the law of impacts, and that threads change nothing.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use bounce_audio::drop::{
    Ball, Bounce, DropError, DropModel, Grip, Moving, Release, Scatter, Table, Vector, drops,
};
use bounce_audio::flight::{Flight, State};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const G: f64 = 9.80665;

fn dice(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

fn dot(a: &Vector, b: &Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Directions follow the density: Kolmogorov and Smirnov's distance of 1 - cos from `1 - F = (e^(-kappa c) - e^(-2 kappa)) / (1 - e^(-2 kappa))`.
#[test]
fn directions_scatter_as_they_should() {
    let mean = [0.6, 0.0, -0.8];
    for kappa in [0.0, 1e-9, 0.1, 1.0, 10.0, 1e3, 1e5, 1e12] {
        let scatter = Scatter::new(kappa).unwrap();
        let (n, mut rng) = (20_000, dice(1));
        let mut off = Vec::with_capacity(n);
        let mut sides = [0.0; 2];
        for _ in 0..n {
            let x = scatter.draw(&mean, &mut rng);
            approx::assert_relative_eq!(dot(&x, &x), 1.0, epsilon = 1e-12);
            off.push(0.5 * x.iter().zip(&mean).map(|(x, m)| (x - m).powi(2)).sum::<f64>());
            sides[0] += x[1].signum() / n as f64;
            sides[1] += dot(&x, &[0.8, 0.0, 0.6]).signum() / n as f64;
        }
        off.sort_by(f64::total_cmp);
        let cdf =
            |c: f64| if kappa < 1e-6 { 0.5 * c } else { (-kappa * c).exp_m1() / (-2.0 * kappa).exp_m1() };
        let far = off.iter().enumerate().map(|(i, c)| (cdf(*c) - (i as f64 + 0.5) / n as f64).abs());
        let far = far.fold(0.0, f64::max);
        // 1.95 / sqrt(n): a chance of 1e-3.
        assert!(far < 1.95 / (n as f64).sqrt(), "kappa {kappa}: {far}");
        assert!(sides.iter().all(|s| s.abs() < 4.0 / (n as f64).sqrt()), "kappa {kappa}: {sides:?}");
    }
}

/// The density integrates to one over the sphere, by Simpson's rule in the tail's own variable.
#[test]
fn the_density_is_one() {
    let mean = [0.0, 0.0, 1.0];
    for kappa in [0.0, 1e-13, 1e-6, 0.3, 30.0, 1e5] {
        let scatter = Scatter::new(kappa).unwrap();
        let (n, reach) = (20_000, f64::min(2.0, 40.0 / f64::max(kappa, 1e-9)));
        let at = |c: f64| {
            let sin = (c * (2.0 - c)).sqrt();
            scatter.ln_density(&mean, &[sin, 0.0, 1.0 - c]).exp()
        };
        let weight = |i: i32| if i == 0 || i == n { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
        let h = reach / f64::from(n);
        let sum: f64 = (0..=n).map(|i| weight(i) * at(h * f64::from(i))).sum();
        approx::assert_relative_eq!(2.0 * std::f64::consts::PI * sum * h / 3.0, 1.0, max_relative = 1e-8);
        assert_eq!(scatter.ln_peak(), scatter.ln_density(&mean, &mean));
    }
}

#[test]
fn without_scatter_flights_shorten_by_e() {
    let e = 0.8;
    let model = DropModel::new(Ball::new(e, f64::INFINITY).unwrap(), Table::LEVEL, G).unwrap();
    let start = Moving {
        t_s: 0.0,
        position_m: [0.1, -0.2, 0.26],
        velocity_m_s: [0.3, 0.1, 0.0],
        spin_rad_s: [50.0, -80.0, 10.0],
    };
    let mut out = [Bounce::default(); 6];
    assert_eq!(model.run(&start, &mut dice(1), &mut out), Ok(6));
    let fall = (2.0 * 0.26 / G).sqrt();
    approx::assert_relative_eq!(out[0].t_s, fall, max_relative = 1e-14);
    approx::assert_relative_eq!(out[0].position_m[0], 0.1 + 0.3 * fall, max_relative = 1e-14);
    for (k, pair) in out.windows(2).enumerate() {
        let shorter = e.powi(k as i32 + 1);
        approx::assert_relative_eq!(pair[1].t_s - pair[0].t_s, 2.0 * fall * shorter, max_relative = 1e-12);
        // B.12: each flight goes e^2 as far.
        let far = pair[1].position_m[0] - pair[0].position_m[0];
        approx::assert_relative_eq!(far, 0.3 * 2.0 * fall * shorter * shorter, max_relative = 1e-11);
    }
}

/// On a tilted table, against another integrator with the plane looked for by bisection.
#[test]
fn a_tilted_table_against_small_steps() {
    let table = Table::tilted(10.72f64.to_radians(), 0.7).unwrap();
    let ball =
        Ball { slope_s_m: 0.05, grip: Grip::Whole { lost: 0.2 }, ..Ball::new(0.85, f64::INFINITY).unwrap() };
    let model = DropModel::new(ball, table, G).unwrap();
    let start = Release { velocity_sigma_m_s: 0.3, ..Release::at(0.3) }.draw(&mut dice(4));
    let mut out = [Bounce::default(); 4];
    assert_eq!(model.run(&start, &mut dice(1), &mut out), Ok(4));

    let n = *table.normal();
    approx::assert_relative_eq!(n[2], 10.72f64.to_radians().cos(), max_relative = 1e-14);
    assert!(n[0] > 0.0 && (n[1] / n[0] - 0.7f64.tan()).abs() < 1e-12, "it falls towards 0.7 rad");
    let flight = Flight::<f64>::ballistic(G);
    let (mut t, mut state) = (0.0, State { position: start.position_m, velocity: start.velocity_m_s });
    for bounce in &out {
        let at = |s: f64| {
            let mut states = [state; 1];
            flight.states(&state, &[s], &mut states).unwrap();
            states[0]
        };
        let mut high = 1e-4;
        while dot(&n, &at(high).position) > 0.0 {
            high += 1e-4;
        }
        let mut low = high - 1e-4;
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if dot(&n, &at(middle).position) > 0.0 { low = middle } else { high = middle }
        }
        let landed = at(low);
        t += low;
        approx::assert_relative_eq!(bounce.t_s, t, max_relative = 1e-9);
        approx::assert_relative_eq!(bounce.position_m[..], landed.position[..], epsilon = 1e-9);
        let (v, across) = (landed.velocity, dot(&n, &landed.velocity));
        let e = 0.85 - 0.05 * (dot(&v, &v).sqrt() - 1.0);
        let along: Vector = std::array::from_fn(|i| v[i] - across * n[i]);
        state.position = landed.position;
        state.velocity = std::array::from_fn(|i| e * (0.8 * along[i] - across * n[i]));
    }
}

fn rough(friction: f64, recoil: f64, inertia: f64) -> Ball {
    let grip = Grip::Rough { friction, recoil, radius_m: 0.02, inertia };
    Ball { grip, ..Ball::new(0.9, f64::INFINITY).unwrap() }
}

proptest! {
    /// Energy is never made, angular momentum about the point of contact is kept, and the slip ends as it should.
    #[test]
    fn a_rough_ball_keeps_its_angular_momentum(
        v in prop::array::uniform3(-3.0..3.0f64), spin in prop::array::uniform3(-200.0..200.0f64),
        friction in 0.0..1.5f64, recoil in -1.0..1.0f64, inertia in 0.3..0.7f64, tilt in 0.0..0.6f64,
    ) {
        let ball = rough(friction, recoil, inertia);
        let normal = *Table::tilted(tilt, 1.0).unwrap().normal();
        // It has to come down on the table.
        let across = dot(&v, &normal);
        let v: Vector = std::array::from_fn(|i| v[i] - (across + across.abs() + 0.1) * normal[i]);
        let before = Moving { t_s: 0.0, position_m: [0.0; 3], velocity_m_s: v, spin_rad_s: spin };
        let (after, turned) = ball.unperturbed(&normal, &before);
        let inertia_m2 = inertia * 0.02 * 0.02;
        let energy = |v: &Vector, w: &Vector| 0.5 * dot(v, v) + 0.5 * inertia_m2 * dot(w, w);
        prop_assert!(energy(&after, &turned) <= energy(&v, &spin) * (1.0 + 1e-12));
        let arm = normal.map(|n| 0.02 * n);
        let about = |v: &Vector, w: &Vector| {
            let orbit = cross(&arm, v);
            let sum: Vector = std::array::from_fn(|i| orbit[i] + inertia_m2 * w[i]);
            sum
        };
        for (a, b) in about(&v, &spin).iter().zip(&about(&after, &turned)) {
            prop_assert!((a - b).abs() < 1e-12, "{a} and {b}");
        }
        let slip = |v: &Vector, w: &Vector| {
            let t = cross(w, &arm.map(|a| -a));
            let across = dot(v, &normal);
            let sum: Vector = std::array::from_fn(|i| v[i] - across * normal[i] + t[i]);
            sum
        };
        let (first, last) = (slip(&v, &spin), slip(&after, &turned));
        let most = 1.9 * friction * dot(&v, &normal).abs() * (1.0 + 1.0 / inertia);
        let gripped = (1.0 + recoil) * dot(&first, &first).sqrt() < most;
        if gripped {
            for (a, b) in first.iter().zip(&last) {
                prop_assert!((b + recoil * a).abs() < 1e-9, "slip {a} became {b}");
            }
        }
        prop_assert!((dot(&after, &normal) + 0.9 * dot(&v, &normal)).abs() < 1e-9);
    }

    #[test]
    fn every_drop_is_finite_and_on_the_table(
        e in 0.0..1.0f64, log10_kappa in -3.0..12.0f64, tilt in 0.0..0.5f64, slope in -0.2..0.2f64, seed in 0u64..1000,
    ) {
        let table = Table::tilted(tilt, 0.3).unwrap();
        let ball = Ball { slope_s_m: slope, ..Ball::new(e, 10f64.powf(log10_kappa)).unwrap() };
        let model = DropModel::new(ball, table, G).unwrap();
        let mut rng = dice(seed);
        let mut out = [Bounce::default(); 12];
        let count = model.run(&Release::at(0.26).draw(&mut rng), &mut rng, &mut out).unwrap();
        for pair in out[..count].windows(2) {
            prop_assert!(pair[1].t_s > pair[0].t_s);
        }
        for bounce in &out[..count] {
            prop_assert!(table.height_m(&bounce.position_m).abs() < 1e-9 && bounce.t_s.is_finite());
        }
    }
}

/// A shell without spin that rolls on keeps 3/5 of its speed along the table, a solid ball 5/7 (Garwin 1969, doi:10.1119/1.1975420).
#[test]
fn balls_that_roll_on_keep_what_they_should() {
    for (inertia, keeps) in [(2.0 / 3.0, 0.6), (0.4, 5.0 / 7.0)] {
        let before =
            Moving { t_s: 0.0, position_m: [0.0; 3], velocity_m_s: [0.5, 0.0, -2.0], spin_rad_s: [0.0; 3] };
        let (after, spin) = rough(10.0, 0.0, inertia).unperturbed(&[0.0, 0.0, 1.0], &before);
        approx::assert_relative_eq!(after[0], 0.5 * keeps, max_relative = 1e-12);
        approx::assert_relative_eq!(spin[1], after[0] / 0.02, max_relative = 1e-12);
        // With little friction it slides: mu (1 + e) v_n is lost.
        let (after, _) = rough(0.02, 0.0, inertia).unperturbed(&[0.0, 0.0, 1.0], &before);
        approx::assert_relative_eq!(after[0], 0.5 - 0.02 * 1.9 * 2.0, max_relative = 1e-12);
    }
}

#[test]
fn threads_change_nothing() {
    let model = DropModel::new(Ball::new(0.8, 300.0).unwrap(), Table::LEVEL, G).unwrap();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| drops::<4>(&model, &Release::at(0.26), 3_000, 7)).unwrap()
    };
    let one = on(1);
    assert_eq!(one, on(3));
    assert_ne!(one[0], one[1], "each drop has its own chance");
    // The first of many are the many's first.
    assert_eq!(drops::<4>(&model, &Release::at(0.26), 10, 7).unwrap(), one[..10]);
}

#[test]
fn nonsense_is_an_error() {
    let off = |r: Result<Ball, DropError>| matches!(r, Err(DropError::Value { .. }));
    assert!(off(Ball::new(1.1, 10.0)) && off(Ball::new(-0.1, 10.0)) && off(Ball::new(f64::NAN, 10.0)));
    assert!(off(Ball::new(0.8, -1.0)) && off(Ball::new(0.8, f64::NAN)));
    let ball = Ball::new(0.8, 10.0).unwrap();
    for g in [0.0, -9.8, f64::NAN, f64::INFINITY] {
        assert!(DropModel::new(ball, Table::LEVEL, g).is_err(), "{g}");
    }
    assert!(Table::tilted(1.6, 0.0).is_err() && Table::tilted(f64::NAN, 0.0).is_err());
    for grip in [
        Grip::Whole { lost: 1.5 },
        Grip::Rough { friction: -0.1, recoil: 0.0, radius_m: 0.02, inertia: 0.4 },
        Grip::Rough { friction: 0.1, recoil: 2.0, radius_m: 0.02, inertia: 0.4 },
        Grip::Rough { friction: 0.1, recoil: 0.0, radius_m: 0.0, inertia: 0.4 },
    ] {
        assert!(DropModel::new(Ball { grip, ..ball }, Table::LEVEL, G).is_err(), "{grip:?}");
    }
    let model = DropModel::new(ball, Table::LEVEL, G).unwrap();
    assert_eq!(drops::<4>(&model, &Release::at(-0.1), 5, 1), Err(DropError::Below { below_m: 0.1 }));
    // A ball that does not bounce has one impact.
    let dead = DropModel::new(Ball::new(0.0, 10.0).unwrap(), Table::LEVEL, G).unwrap();
    assert!(drops::<4>(&dead, &Release::at(0.26), 5, 1).unwrap().iter().all(|t| t.bounces().len() == 1));
}
