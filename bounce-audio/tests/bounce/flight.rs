//! The flight against closed forms, invariants and finite differences.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use approx::assert_relative_eq;
use bounce_audio::flight::{Flight, FlightError, State, drag_per_m};
use num_dual::{Derivative, DualSVec64};
use proptest::prelude::*;

const G: f64 = 9.80665;

fn fly(flight: &Flight<f64>, start: State<f64>, times: &[f64]) -> Vec<State<f64>> {
    let mut out = vec![start; times.len()];
    flight.states(&start, times, &mut out).unwrap();
    out
}

fn thrown() -> State<f64> {
    State { position: [0.1, -0.2, 1.5], velocity: [6.0, 2.0, 5.0] }
}

/// A drop from rest under quadratic drag: v = -vt tanh(g t / vt), z = -vt^2/g ln cosh(g t / vt).
#[test]
fn a_vertical_drop_follows_tanh() {
    for k in [1e-6, 1e-3, 0.03, 1.0] {
        let mut flight = Flight::ballistic(G);
        flight.quadratic_per_m = k;
        let times: Vec<f64> = (0..60).map(|i| f64::from(i) * 0.05).collect();
        let states = fly(&flight, State { position: [0.0; 3], velocity: [0.0; 3] }, &times);
        let terminal = (G / k).sqrt();
        for (t, s) in times.iter().zip(states) {
            let x = G * t / terminal;
            let fallen = terminal * terminal / G * (x + (-2.0 * x).exp().ln_1p() - 2f64.ln());
            assert_relative_eq!(s.velocity[2], -terminal * x.tanh(), epsilon = 1e-9, max_relative = 1e-9);
            // The closed form itself loses digits for a small k.
            assert_relative_eq!(s.position[2], -fallen, epsilon = 1e-9 / k.min(1.0), max_relative = 1e-9);
        }
    }
}

/// On the way up: v = vt tan(c - g t / vt).
#[test]
fn a_throw_upwards_follows_tan() {
    let mut flight = Flight::ballistic(G);
    flight.quadratic_per_m = 0.05;
    let terminal = (G / 0.05_f64).sqrt();
    let times: Vec<f64> = (1..15).map(|i| f64::from(i) * 0.05).collect();
    let v0 = 8.0_f64;
    let states = fly(&flight, State { position: [0.0; 3], velocity: [0.0, 0.0, v0] }, &times);
    for (t, s) in times.iter().zip(states) {
        let angle = (v0 / terminal).atan() - G * t / terminal;
        if angle > 0.0 {
            assert_relative_eq!(s.velocity[2], terminal * angle.tan(), max_relative = 1e-9);
        }
    }
}

/// The closed form of linear drag against the integrator, which a vanishing cubic drag switches on.
#[test]
fn linear_drag_agrees_with_integration() {
    for rate in [0.0, 1e-7, 9.9e-3, 0.011, 0.5, 20.0] {
        let mut closed = Flight::ballistic(G);
        closed.linear_per_s = rate;
        closed.wind_m_s = [1.0, -3.0, 0.0];
        closed.constant_m_s2 = [0.1, 0.2, 0.3];
        let mut open = closed;
        open.cubic_s_per_m2 = 1e-300;
        let times = [0.0, 0.3, 0.3, 1.0, 2.7];
        for (a, b) in fly(&closed, thrown(), &times).iter().zip(fly(&open, thrown(), &times)) {
            for i in 0..3 {
                assert_relative_eq!(a.position[i], b.position[i], epsilon = 1e-9, max_relative = 1e-9);
                assert_relative_eq!(a.velocity[i], b.velocity[i], epsilon = 1e-9, max_relative = 1e-9);
            }
        }
    }
}

#[test]
fn lift_turns_and_does_no_work() {
    let mut flight = Flight::ballistic(0.0);
    flight.lift_per_s = [0.0, 0.0, 2.0];
    let states = fly(&flight, thrown(), &[0.25, 1.0, 3.0]);
    for (s, t) in states.iter().zip([0.25_f64, 1.0, 3.0]) {
        let [x, y, z] = s.velocity;
        assert_relative_eq!(x * x + y * y, 40.0, max_relative = 1e-9);
        assert_relative_eq!(z, 5.0, max_relative = 1e-12);
        // lift x v turns counter-clockwise about lift.
        assert_relative_eq!(x, 6.0 * (2.0 * t).cos() - 2.0 * (2.0 * t).sin(), epsilon = 1e-8);
        assert_relative_eq!(y, 6.0 * (2.0 * t).sin() + 2.0 * (2.0 * t).cos(), epsilon = 1e-8);
    }
}

#[test]
fn dual_numbers_agree_with_differences() {
    type D = DualSVec64<4>;
    let run = |k: f64, w: f64, l: f64, vx: f64| -> State<f64> {
        let mut flight = Flight::ballistic(G);
        (flight.quadratic_per_m, flight.wind_m_s[0], flight.lift_per_s[1]) = (k, w, l);
        let mut start = thrown();
        start.velocity[0] = vx;
        fly(&flight, start, &[1.2])[0]
    };
    let var = |value: f64, i: usize| {
        let mut e = nalgebra::SVector::<f64, 4>::zeros();
        e[i] = 1.0;
        D::new(value, Derivative::some(e))
    };
    let mut flight: Flight<D> = Flight::ballistic(G);
    (flight.quadratic_per_m, flight.wind_m_s[0], flight.lift_per_s[1]) =
        (var(0.02, 0), var(1.0, 1), var(0.3, 2));
    let s = thrown();
    let mut start = State { position: s.position.map(D::from), velocity: s.velocity.map(D::from) };
    start.velocity[0] = var(6.0, 3);
    let mut out = [start];
    flight.states(&start, &[1.2], &mut out).unwrap();
    let at = [0.02, 1.0, 0.3, 6.0];
    for j in 0..4 {
        let shifted = |d: f64| {
            let mut x = at;
            x[j] += d;
            run(x[0], x[1], x[2], x[3])
        };
        let h = 1e-4;
        for i in 0..3 {
            let difference = (shifted(h).position[i] - shifted(-h).position[i]) / (2.0 * h);
            let exact = out[0].position[i].eps.0.map_or(0.0, |e| e[j]);
            assert_relative_eq!(exact, difference, epsilon = 1e-5, max_relative = 1e-5);
        }
    }
}

#[test]
fn nonsense_is_an_error() {
    let mut out = [thrown(); 2];
    let flight = Flight::ballistic(G);
    let short = flight.states(&thrown(), &[0.1], &mut out);
    assert_eq!(short, Err(FlightError::Length { expected: 1, got: 2 }));
    let falling = flight.states(&thrown(), &[0.2, 0.1], &mut out);
    assert_eq!(falling, Err(FlightError::Times { index: 1, value: 0.1 }));
    let mut pushing = flight;
    pushing.quadratic_per_m = -0.1;
    assert!(matches!(pushing.states(&thrown(), &[0.1, 0.2], &mut out), Err(FlightError::Negative { .. })));
    let mut lost = flight;
    lost.wind_m_s[1] = f64::NAN;
    assert!(matches!(lost.states(&thrown(), &[0.1, 0.2], &mut out), Err(FlightError::NotFinite { .. })));
    let mut rocket = flight;
    rocket.cubic_s_per_m2 = -5.0;
    assert!(matches!(rocket.states(&thrown(), &[0.1, 20.0], &mut out), Err(FlightError::TooStiff { .. })));
    assert_eq!(flight.states(&thrown(), &[], &mut []), Ok(()));
}

#[test]
fn a_tennis_ball_has_a_drag_of_0_018_per_metre() {
    // 0.5 * 1.2 * 0.5 * pi/4 * 0.066^2 / 0.057
    assert_relative_eq!(drag_per_m(0.5, 0.066, 0.057, 1.2), 0.018_006, epsilon = 5e-7);
}

proptest! {
    /// In a frame that moves with the wind there is no wind.
    #[test]
    fn wind_is_a_change_of_frame(k in 0.0..0.2, r in 0.0..1.0, wx in -10.0..10.0, wy in -10.0..10.0) {
        let mut windy = Flight::ballistic(G);
        (windy.quadratic_per_m, windy.linear_per_s, windy.wind_m_s) = (k, r, [wx, wy, 0.0]);
        let still = Flight { wind_m_s: [0.0; 3], ..windy };
        let mut moving = thrown();
        moving.velocity[0] -= wx;
        moving.velocity[1] -= wy;
        let (a, b) = (fly(&windy, thrown(), &[1.5])[0], fly(&still, moving, &[1.5])[0]);
        assert_relative_eq!(a.position[0], b.position[0] + 1.5 * wx, epsilon = 1e-7);
        assert_relative_eq!(a.position[1], b.position[1] + 1.5 * wy, epsilon = 1e-7);
        assert_relative_eq!(a.position[2], b.position[2], epsilon = 1e-7);
    }

    /// Drag in still air takes energy, never gives it.
    #[test]
    fn drag_takes_energy(k in 0.0..0.5, r in 0.0..3.0) {
        let mut flight = Flight::ballistic(G);
        (flight.quadratic_per_m, flight.linear_per_s) = (k, r);
        let energy = |s: &State<f64>| G * s.position[2] + 0.5 * s.velocity.iter().map(|v| v * v).sum::<f64>();
        let states = fly(&flight, thrown(), &[0.1, 0.4, 1.0, 2.0]);
        for pair in states.windows(2) {
            prop_assert!(energy(&pair[1]) <= energy(&pair[0]) + 1e-8);
        }
    }
}
