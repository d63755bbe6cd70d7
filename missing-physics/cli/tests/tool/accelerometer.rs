//! Machines whose acceleration is measured: forces that the equations lack act on it as well.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::fmt::Write as _;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};

use super::simulated::{answer, assert_named, follow};

const SLIDE: &str = r#"
[model]
states = { slide_m = "speed_m_s", speed_m_s = "-stiffness_per_s2*slide_m - damping_per_s*speed_m_s" }
outputs = { laser_m = "slide_m", inertial_m_s2 = "-stiffness_per_s2*slide_m - damping_per_s*speed_m_s" }
[start]
speed_m_s = 0.0
[[parameter]]
name = "stiffness_per_s2"
unit = "1/s^2"
start = 50.0
[[parameter]]
name = "damping_per_s"
unit = "1/s"
start = 0.5
[[joint]]
name = "slide"
position = "slide_m"
velocity = "speed_m_s"
"#;

/// The column is the acceleration by its expression, which says nothing of the drag: the sensor feels it.
#[test]
fn an_accelerometer_feels_a_force_that_the_equations_lack() {
    let (laser, inertial) = (Normal::new(0.0, 5e-4).unwrap(), Normal::new(0.0, 0.05).unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for drag in [0.0, 0.4] {
        let acceleration = |[x, v]: &[f64; 2]| -60.0 * x - 0.4 * v - drag * v.abs() * v;
        let mut data = String::from("run,t_s,laser_m,inertial_m_s2\n");
        for (run, begins) in [0.28, 0.15, 0.21].into_iter().enumerate() {
            let mut x = [begins, 0.0];
            for i in 0..600 {
                let read = [x[0] + laser.sample(&mut rng), acceleration(&x) + inertial.sample(&mut rng)];
                writeln!(data, "{run},{:.2},{:.6},{:.4}", 0.01 * f64::from(i), read[0], read[1]).unwrap();
                follow(&mut x, 0.01, 4, |x| [x[1], acceleration(x)]);
            }
        }
        let answer = answer(SLIDE, &data);
        let verdict = if drag == 0.0 { "adequate" } else { "explained" };
        assert_eq!(answer["verdict"], verdict, "{}", answer["leftover"]);
        assert_named(&answer, if drag == 0.0 { &[] } else { &[("quadratic-damping", 0.4)] });
    }
}

const BOB: &str = r#"
[model]
states = { angle_rad = "rate_rad_s", rate_rad_s = "-9.81/length_m*sin(angle_rad) - damping_per_s*rate_rad_s" }
outputs = { encoder_rad = "angle_rad", along_m_s2 = "length_m*der(rate_rad_s) + 9.81*sin(angle_rad)" }
[start]
rate_rad_s = 0.0
[[parameter]]
name = "length_m"
unit = "m"
start = 0.5
[[parameter]]
name = "damping_per_s"
unit = "1/s"
start = 0.05
[[joint]]
name = "pivot"
position = "angle_rad"
velocity = "rate_rad_s"
turns = true
"#;

/// What an accelerometer in a bob reads along its path is what holds it back, and nothing else: dry friction, until it rests.
#[test]
fn an_accelerometer_feels_what_holds_a_bob_back() {
    let (encoder, inertial) = (Normal::new(0.0, 1e-3).unwrap(), Normal::new(0.0, 0.05).unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut data = String::from("run,t_s,encoder_rad,along_m_s2\n");
    for (run, begins) in [1.1, -0.8].into_iter().enumerate() {
        let mut x = [begins, 0.0_f64];
        for i in 0..800 {
            let pull = -9.81 / 0.6 * x[0].sin() - 0.04 * x[1];
            let rubs = if x[1] == 0.0 { pull.clamp(-0.5, 0.5) } else { 0.5 * x[1].signum() };
            let along = 0.6 * (pull - rubs) + 9.81 * x[0].sin();
            let read = [x[0] + encoder.sample(&mut rng), along + inertial.sample(&mut rng)];
            writeln!(data, "{run},{:.2},{:.6},{:.4}", 0.02 * f64::from(i), read[0], read[1]).unwrap();
            // Small steps, in each of which friction takes away speed until there is none (Moreau's time stepping).
            for _ in 0..400 {
                let (before, h) = (x[1], 5e-5);
                let free = before + h * (-9.81 / 0.6 * x[0].sin() - 0.04 * before);
                x[1] = free.signum() * (free.abs() - 0.5 * h).max(0.0);
                x[0] += 0.5 * h * (before + x[1]);
            }
        }
    }
    assert_named(&answer(BOB, &data), &[("coulomb-friction", 0.5)]);
}
