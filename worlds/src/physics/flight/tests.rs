use super::*;
use approx::assert_abs_diff_eq;

/// A quiet world of the given effects at 30 Hz.
fn quiet(seen: Measured, effects: Effects) -> FlightWorld {
    FlightWorld { frame_hz: 30.0, noise: Noise::white(0.0), effects, ..FlightWorld::thrown(seen) }
}

const START: [f64; 6] = [0.1, -0.2, 1.3, 5.0, -2.0, 6.0];
const ROWS: usize = 45;

/// Times and coordinates of one flight from `START`.
fn flight(effects: Effects) -> (Vec<f64>, Vec<Vec<f64>>) {
    quiet(Measured::Position, effects).fly(START, ROWS, 0.0, STEPS)
}

/// How far a coordinate bends over the first frames, as an acceleration.
fn bend(column: &[f64], at: usize) -> f64 {
    (column[at + 2] - 2.0 * column[at + 1] + column[at]) * 900.0
}

#[test]
fn a_vacuum_gives_parabolas() {
    let world = FlightWorld { noise: Noise::white(0.0), ..FlightWorld::thrown(Measured::Position) };
    for run in world.draw(1).runs {
        for (column, g) in run.channels.iter().zip([0.0, 0.0, GRAVITY_M_S2]) {
            for i in 2..column.len() {
                let bend = column[i] - 2.0 * column[i - 1] + column[i - 2];
                assert_abs_diff_eq!(bend, -g / 3600.0, epsilon = 1e-12);
            }
        }
    }
}

/// A drop from rest under quadratic drag falls vt^2/g ln cosh(g t / vt).
#[test]
fn a_drop_under_quadratic_drag_follows_the_closed_form() {
    let effects = Effects { quadratic_per_m: 0.03, ..Effects::default() };
    let still = FlightWorld {
        speed_m_s: [0.0, 0.0],
        noise: Noise::white(0.0),
        effects,
        ..FlightWorld::dropped(1, [60, 60], 30.0)
    };
    let run = &still.draw(2).runs[0];
    for (t, z) in run.t_s.iter().zip(&run.channels[0]) {
        let fallen = ((GRAVITY_M_S2 * 0.03_f64).sqrt() * t).cosh().ln() / 0.03;
        assert_abs_diff_eq!(run.channels[0][0] - z, fallen, epsilon = 1e-9);
    }
}

/// Halving the step divides the error by 2^4: steps of a frame, so coarse that rounding is far below.
#[test]
fn the_integration_is_of_fourth_order() {
    let effects = Effects { quadratic_per_m: 0.3, ..Effects::default() };
    let world = FlightWorld { frame_hz: 8.0, ..quiet(Measured::Height, effects) };
    let (t, _) = world.fly([0.0; 6], 12, 0.0, 1);
    let error = |steps| {
        let (_, channels) = world.fly([0.0; 6], 12, 0.0, steps);
        let fallen = |t: f64| ((GRAVITY_M_S2 * 0.3_f64).sqrt() * t).cosh().ln() / 0.3;
        t.iter().zip(&channels[0]).map(|(t, z)| (z + fallen(*t)).abs()).fold(0.0, f64::max)
    };
    for steps in [2, 4, 8] {
        let order = (error(steps) / error(2 * steps)).log2();
        assert!((3.7..4.3).contains(&order), "order {order} at {steps} steps");
    }
}

/// v' = -r (v - u) with u = wind - (g - lift)/r along z: the speed decays towards u.
#[test]
fn linear_drag_in_wind_with_lift_follows_the_closed_form() {
    let (r, wind, lift) = (0.4, [1.5, -0.7], 0.3);
    let (t_s, seen) =
        flight(Effects { linear_per_s: r, wind_m_s: wind, lift_m_s2: lift, ..Effects::default() });
    let last = [wind[0], wind[1], (lift - GRAVITY_M_S2) / r];
    for (i, t) in t_s.iter().enumerate() {
        for c in 0..3 {
            let expected = START[c] + last[c] * t - (START[3 + c] - last[c]) * (-r * t).exp_m1() / r;
            assert_abs_diff_eq!(seen[c][i], expected, epsilon = 1e-9);
        }
    }
}

/// Galileo: a flight in a steady wind is a flight in still air, seen from a cart that moves with the wind.
#[test]
fn wind_carries_a_flight_with_it() {
    let wind = [2.0, -1.0];
    let drag = Effects { quadratic_per_m: 0.05, linear_per_s: 0.1, ..Effects::default() };
    let (t_s, seen) = flight(Effects { wind_m_s: wind, ..drag });
    let mut start = START;
    start[3] -= wind[0];
    start[4] -= wind[1];
    let (_, still) = quiet(Measured::Position, drag).fly(start, ROWS, 0.0, STEPS);
    for (i, t) in t_s.iter().enumerate() {
        assert_abs_diff_eq!(seen[0][i], still[0][i] + wind[0] * t, epsilon = 1e-10);
        assert_abs_diff_eq!(seen[1][i], still[1][i] + wind[1] * t, epsilon = 1e-10);
        assert_abs_diff_eq!(seen[2][i], still[2][i], epsilon = 1e-10);
    }
}

/// With L along y, vx + g/L and vz turn into one another: a cycloid.
#[test]
fn magnus_lift_draws_a_cycloid() {
    let l = 0.8;
    let (t_s, seen) = flight(Effects { magnus_per_s: [0.0, l, 0.0], ..Effects::default() });
    let (u, w) = (START[3] + GRAVITY_M_S2 / l, START[5]);
    for (i, t) in t_s.iter().enumerate() {
        let (sin, cos) = (l * t).sin_cos();
        let x = START[0] - GRAVITY_M_S2 / l * t + (u * sin + w * (1.0 - cos)) / l;
        let z = START[2] + (w * sin - u * (1.0 - cos)) / l;
        assert_abs_diff_eq!(seen[0][i], x, epsilon = 1e-9);
        assert_abs_diff_eq!(seen[1][i], START[1] + START[4] * t, epsilon = 1e-9);
        assert_abs_diff_eq!(seen[2][i], z, epsilon = 1e-9);
    }
}

/// v' . L = g . L whatever L: along L a flight is a parabola. And L x v at the start has each sign right.
#[test]
fn magnus_lift_is_across_both_vectors() {
    let l = [0.03, -0.05, 0.04];
    let (t_s, seen) = flight(Effects { magnus_per_s: l, ..Effects::default() });
    let along = |v: [f64; 3]| v[0] * l[0] + v[1] * l[1] + v[2] * l[2];
    for (i, t) in t_s.iter().enumerate() {
        let expected = along([START[0], START[1], START[2]]) + along([START[3], START[4], START[5]]) * t
            - 0.5 * GRAVITY_M_S2 * l[2] * t * t;
        assert_abs_diff_eq!(along([seen[0][i], seen[1][i], seen[2][i]]), expected, epsilon = 1e-10);
    }
    // The middle of the three rows is 1/30 s after the start.
    let [u, v, w] = [START[3], START[4], START[5] - GRAVITY_M_S2 / 30.0];
    let cross = [l[1] * w - l[2] * v, l[2] * u - l[0] * w, l[0] * v - l[1] * u - GRAVITY_M_S2];
    for c in 0..3 {
        assert_abs_diff_eq!(bend(&seen[c], 0), cross[c], epsilon = 0.002);
    }
}

#[test]
fn a_cord_swings_about_its_rest() {
    let c = 3.0_f64;
    let (t_s, seen) = flight(Effects { cord_per_s2: c, ..Effects::default() });
    let omega = c.sqrt();
    for (i, t) in t_s.iter().enumerate() {
        let (sin, cos) = (omega * t).sin_cos();
        assert_abs_diff_eq!(seen[0][i], START[0] + START[3] / omega * sin, epsilon = 1e-9);
        let z = START[2] + START[5] / omega * sin - GRAVITY_M_S2 / c * (1.0 - cos);
        assert_abs_diff_eq!(seen[2][i], z, epsilon = 1e-9);
    }
}

#[test]
fn the_drag_crisis_acts_above_its_speed_only() {
    let drag = Effects { quadratic_per_m: 0.05, ..Effects::default() };
    let crisis = |above_m_s| DragCrisis { above_m_s, fraction: 0.4 };
    let (_, full) = flight(drag);
    let (_, never) = flight(Effects { drag_crisis: crisis(1e3), ..drag });
    let (_, always) = flight(Effects { drag_crisis: crisis(1e-9), ..drag });
    let (_, small) = flight(Effects { quadratic_per_m: 0.4 * 0.05, ..Effects::default() });
    assert_eq!(full, never);
    assert_eq!(always, small);
    // From rest the two are one until the speed is reached, and part after it.
    let world = |effects| quiet(Measured::Height, effects).fly([0.0; 6], ROWS, 0.0, STEPS).1.remove(0);
    let (full, some) = (world(drag), world(Effects { drag_crisis: crisis(5.2), ..drag }));
    let parted = full.iter().zip(&some).position(|(a, b)| a != b);
    // 5.2 m/s is reached at vt/g atanh(5.2/vt) = 0.557 s, between rows 16 and 17.
    assert_eq!(parted, Some(17), "{full:?} {some:?}");
}

/// Under linear drag a gust of speed w, on for a time T, leaves behind a speed of w (1 - exp(-r T)).
#[test]
fn a_gust_acts_within_its_window() {
    let drag = Effects { linear_per_s: 0.5, ..Effects::default() };
    let gust = Gust { velocity_m_s: [4.0, 0.0, -2.0], window_s: [0.4, 0.7] };
    let (t_s, calm) = flight(drag);
    let (_, blown) = flight(Effects { gust, ..drag });
    for c in 0..3 {
        let pushed = gust.velocity_m_s[c];
        for (i, t) in t_s.iter().enumerate() {
            let on = (t - 0.4).clamp(0.0, 0.3);
            let after = (t - 0.7).max(0.0);
            // Carried along while it blows, then coasting on what it left.
            let while_on = pushed * (on + (-0.5 * on).exp_m1() / 0.5);
            let left = -pushed * (-0.5 * on).exp_m1();
            let expected = while_on - left * (-0.5 * after).exp_m1() / 0.5;
            assert_abs_diff_eq!(blown[c][i] - calm[c][i], expected, epsilon = 1e-9);
        }
    }
}

/// The signs of the recordings' convention, as in their practice flights: a camera turned by (a, b) about (x, y) sees
/// gravity lean by +g a along y and by -g b along x.
#[test]
fn a_tilted_camera_sees_gravity_lean() {
    let (a, b) = (0.02, -0.03);
    let (_, seen) = flight(Effects { camera_tilt_rad: [a, b], ..Effects::default() });
    let expected =
        [-GRAVITY_M_S2 * a.cos() * b.sin(), GRAVITY_M_S2 * a.sin(), -GRAVITY_M_S2 * a.cos() * b.cos()];
    for at in [0, 20, 40] {
        for c in 0..3 {
            assert_abs_diff_eq!(bend(&seen[c], at), expected[c], epsilon = 1e-9);
        }
    }
    // A rotation keeps lengths.
    let length = |seen: &[Vec<f64>], i: usize| (0..3).map(|c| seen[c][i].powi(2)).sum::<f64>();
    let (_, upright) = flight(Effects::default());
    assert_abs_diff_eq!(length(&seen, 30), length(&upright, 30), epsilon = 1e-10);
}

/// A scale s reads (1 + s) g; a clock that states (1 + r) times the time sees g / (1 + r)^2.
#[test]
fn scale_and_clock_change_the_gravity_that_is_seen() {
    let (_, seen) = flight(Effects { camera_scale: 0.02, ..Effects::default() });
    assert_abs_diff_eq!(bend(&seen[2], 7), -GRAVITY_M_S2 * 1.02, epsilon = 1e-9);
    assert_abs_diff_eq!(seen[0][0], START[0] * 1.02, epsilon = 1e-15);
    let (t_s, seen) = flight(Effects { clock_rate: 0.02, ..Effects::default() });
    assert_abs_diff_eq!(bend(&seen[2], 7), -GRAVITY_M_S2 / (1.02 * 1.02), epsilon = 1e-9);
    assert_abs_diff_eq!(t_s[30], 1.0, epsilon = 1e-12);
}

#[test]
fn mast_and_knock_are_added_to_what_is_seen() {
    let (t_s, still) = flight(Effects::default());
    let mast = Mast { amplitude_m: 0.01, frequency_hz: 3.0 };
    let world = quiet(Measured::Position, Effects { mast, ..Effects::default() });
    let (_, seen) = world.fly(START, ROWS, 0.7, STEPS);
    let knock = Knock { height_m: 0.05, at_s: 0.65 };
    let (_, knocked) = flight(Effects { knock, ..Effects::default() });
    for (i, t) in t_s.iter().enumerate() {
        let swing = 0.01 * (std::f64::consts::TAU * 3.0 * t + 0.7).sin();
        for (c, share) in [1.0, 0.3, 0.1].into_iter().enumerate() {
            assert_abs_diff_eq!(seen[c][i] - still[c][i], share * swing, epsilon = 1e-12);
        }
        let step = if *t >= 0.65 { 0.05 } else { 0.0 };
        assert_abs_diff_eq!(knocked[2][i] - still[2][i], step, epsilon = 1e-12);
    }
}

/// An accelerometer in free fall reads its own offset; under linear drag what the drag exerts besides.
#[test]
fn on_board_only_what_is_not_gravity_is_felt() {
    let free = quiet(Measured::SpecificForce, Effects::default()).fly(START, ROWS, 1.0, STEPS).1.remove(0);
    assert!(free.iter().all(|a| (a - free[0]).abs() < 1e-12));
    let r = 0.5;
    let effects = Effects { linear_per_s: r, ..Effects::default() };
    let (t_s, felt) = quiet(Measured::SpecificForce, effects).fly(START, ROWS, 1.0, STEPS);
    for (t, a) in t_s.iter().zip(&felt[0]) {
        let speed = (START[5] + GRAVITY_M_S2 / r) * (-r * t).exp() - GRAVITY_M_S2 / r;
        assert_abs_diff_eq!(a - free[0], -r * speed, epsilon = 1e-9);
    }
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let world = FlightWorld::thrown(Measured::Position);
    assert_eq!(world.draw(5), world.draw(5));
    assert_ne!(world.draw(5), world.draw(6));
}
