//! The integrator against a plain reference, where steps are few, short or impossible.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use approx::assert_relative_eq;
use bounce_audio::flight::{Flight, FlightError, State};
use num_dual::{Derivative, DualNum, DualSVec64};

const G: f64 = 9.80665;
type Dual = DualSVec64<1>;

/// The classical Runge-Kutta method in `steps` equal steps, for plain and dual numbers alike.
fn reference<T>(flight: &Flight<T>, start: &State<T>, end_s: f64, steps: u32) -> [T; 6]
where
    T: DualNum<Primitive = f64, Real = f64> + Copy,
{
    let (p, v) = (start.position, start.velocity);
    let mut y = [p[0], p[1], p[2], v[0], v[1], v[2]];
    let rate = |y: &[T; 6]| {
        let state = State { position: [y[0], y[1], y[2]], velocity: [y[3], y[4], y[5]] };
        let a = flight.acceleration(&state, &p);
        [y[3], y[4], y[5], a[0], a[1], a[2]]
    };
    let moved = |y: &[T; 6], k: &[T; 6], h: f64| {
        let mut next = *y;
        for (n, k) in next.iter_mut().zip(k) {
            *n += *k * h;
        }
        next
    };
    let h = end_s / f64::from(steps);
    for _ in 0..steps {
        let first = rate(&y);
        let second = rate(&moved(&y, &first, 0.5 * h));
        let third = rate(&moved(&y, &second, 0.5 * h));
        let fourth = rate(&moved(&y, &third, h));
        for (y, ((a, b), (c, d))) in
            y.iter_mut().zip(first.iter().zip(&second).zip(third.iter().zip(&fourth)))
        {
            *y += (*a + *b * 2.0 + *c * 2.0 + *d) * (h / 6.0);
        }
    }
    y
}

fn thrown(velocity: [f64; 3]) -> State<f64> {
    State { position: [0.1, -0.2, 1.5], velocity }
}

/// Everything at once, over one long interval and over many short ones.
#[test]
fn positions_and_velocities_hold_nine_digits() {
    let cases = [
        (0.02, [0.0; 3], 0.0, [6.0, 2.0, 5.0]),
        (0.5, [0.0; 3], 0.0, [0.0, 0.0, 9.0]),
        (0.005, [1.0, -2.0, 3.0], 1e-3, [30.0, 2.0, 15.0]),
        (2.0, [0.3, 0.0, 0.0], 0.0, [40.0, 0.0, 10.0]),
    ];
    for (quadratic, lift, cubic, velocity) in cases {
        let mut flight: Flight<f64> = Flight::ballistic(G);
        (flight.quadratic_per_m, flight.lift_per_s, flight.cubic_s_per_m2) = (quadratic, lift, cubic);
        flight.wind_m_s = [2.0, -1.0, 0.0];
        let start = thrown(velocity);
        let expected = reference(&flight, &start, 3.0, 50_000);
        let size = |v: &[f64]| v.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        for rows in [1_u32, 100] {
            let times: Vec<f64> = (1..=rows).map(|i| 3.0 * f64::from(i) / f64::from(rows)).collect();
            let mut out = vec![start; times.len()];
            flight.states(&start, &times, &mut out).unwrap();
            let last = out[times.len() - 1];
            for i in 0..3 {
                let far = 1e-9 * size(&expected[..3]);
                assert_relative_eq!(last.position[i], expected[i], epsilon = far, max_relative = 0.0);
                let fast = 1e-9 * size(&expected[3..]);
                assert_relative_eq!(last.velocity[i], expected[3 + i], epsilon = fast, max_relative = 0.0);
            }
        }
    }
}

/// The derivative with respect to the drag, off or on. Off, the flight itself is a parabola, of which any step is exact;
/// in a vertical flight drag has a kink at the top, which costs digits of the derivative.
#[test]
fn the_derivative_by_the_drag_holds_however_few_the_times() {
    for (velocity, kink) in [([6.0, 2.0, 5.0], false), ([0.0, 0.0, 9.0], true), ([0.0; 3], false)] {
        for drag in [0.0, 1e-6, 1e-3, 0.02, 0.5] {
            let mut flight: Flight<Dual> = Flight::ballistic(G);
            flight.quadratic_per_m = Dual::new(drag, Derivative::some(nalgebra::SVector::from([1.0])));
            let plain = thrown(velocity);
            let start =
                State { position: plain.position.map(Dual::from), velocity: plain.velocity.map(Dual::from) };
            let slope = |v: &Dual| v.eps.0.map_or(0.0, |e| e[0]);
            let expected = reference(&flight, &start, 2.7, 40_000);
            let size = expected[..3].iter().fold(0.0, |m: f64, v| m.max(slope(v).abs()));
            let tolerance = if kink { 1e-6 } else { 1e-9 } * size;
            for rows in [1_u32, 4, 10, 100] {
                let times: Vec<f64> = (1..=rows).map(|i| 2.7 * f64::from(i) / f64::from(rows)).collect();
                let mut out = vec![start; times.len()];
                flight.states(&start, &times, &mut out).unwrap();
                for (value, expected) in out[times.len() - 1].position.iter().zip(&expected) {
                    let (value, expected) = (slope(value), slope(expected));
                    assert_relative_eq!(value, expected, epsilon = tolerance, max_relative = 0.0);
                }
            }
        }
    }
}

/// A time just after another makes one step short, not the flight impossible.
#[test]
fn times_that_nearly_coincide_change_nothing() {
    let mut flight: Flight<f64> = Flight::ballistic(G);
    flight.quadratic_per_m = 0.02;
    let start = thrown([6.0, 2.0, 5.0]);
    let mut alone = [start; 2];
    flight.states(&start, &[0.3, 1.0], &mut alone).unwrap();
    for gap in [0.0, 1e-16, 1e-15, 1e-13, 1e-9, 1e-6] {
        let mut out = [start; 4];
        flight.states(&start, &[gap, 0.3, 0.3 + gap, 1.0], &mut out).unwrap();
        for i in 0..3 {
            assert_relative_eq!(out[3].position[i], alone[1].position[i], max_relative = 1e-10);
        }
    }
}

/// The speed that drag settles at: sqrt(g / k).
#[test]
fn a_long_fall_ends_at_terminal_speed() {
    for k in [0.01, 0.3, 5.0] {
        let mut flight: Flight<f64> = Flight::ballistic(G);
        flight.quadratic_per_m = k;
        let start = thrown([3.0, 0.0, 0.0]);
        let mut out = [start];
        flight.states(&start, &[60.0], &mut out).unwrap();
        assert_relative_eq!(out[0].velocity[2], -(G / k).sqrt(), max_relative = 1e-9);
        assert!(out[0].velocity[0].abs() < 1e-6);
    }
}

/// Whatever the numbers, a flight that cannot be followed is an error and never a NaN.
#[test]
fn no_state_is_ever_other_than_finite() {
    let sizes = [0.0, 1e-300, 1e-12, 1.0, 1e6, 1e12, 1e154, 1e300];
    let (mut followed, mut refused) = (0, 0);
    for speed in sizes {
        for drag in sizes {
            for linear in [0.0, 1e-12, 1e12, 1e300] {
                let mut flight: Flight<f64> = Flight::ballistic(G);
                (flight.quadratic_per_m, flight.linear_per_s) = (drag, linear);
                let start = thrown([speed, -speed, 1.0]);
                let mut out = [start; 2];
                match flight.states(&start, &[0.0, 1e3], &mut out) {
                    Ok(()) => {
                        followed += 1;
                        let values = out[1].position.iter().chain(&out[1].velocity);
                        assert!(
                            values.into_iter().all(|v| v.is_finite()),
                            "{speed} {drag} {linear}: {out:?}"
                        );
                    }
                    Err(FlightError::TooStiff { .. } | FlightError::Overflow { .. }) => refused += 1,
                    Err(other) => panic!("{speed} {drag} {linear}: {other}"),
                }
            }
        }
    }
    assert!(followed > 0 && refused > 0, "{followed} flights, {refused} refusals");
}
