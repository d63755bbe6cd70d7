//! Machines of which a fit easily settles on another motion than the one that was recorded.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::f64::consts::TAU;
use std::fmt::Write as _;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};

use super::simulated::{answer, assert_named, follow};

/// Of each run: two frequencies of the torque in Hz, its amplitude in N m, two phases in rad, and the angle from which the joint is let go.
const RUNS: [[[f64; 6]; 4]; 2] = [
    [
        [0.28, 0.81, 2.63, 0.55, 3.60, 0.23],
        [0.44, 1.07, 2.89, 1.83, 2.97, 0.29],
        [0.27, 1.03, 1.75, 3.13, 5.17, 0.36],
        [0.24, 1.24, 1.31, 1.26, 2.77, 0.30],
    ],
    [
        [0.48, 0.96, 2.95, 0.49, 3.64, -0.12],
        [0.30, 0.64, 2.51, 3.98, 5.14, 0.38],
        [0.33, 1.20, 1.74, 1.18, 1.56, 0.06],
        [0.35, 0.95, 1.28, 4.75, 3.54, 0.45],
    ],
];
/// Dry friction in parts of the inertia, rad/s^2.
const FRICTION: f64 = 0.35 / 0.12;
const STEP_S: f64 = 0.01;
const SUBSTEPS: usize = 400;

/// Rows of a joint with dry friction: small steps, in each of which friction takes away speed until there is none (Moreau's time stepping).
fn rows(runs: &[[f64; 6]]) -> String {
    let noise = Normal::new(0.0, 2e-3).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut text = String::from("run,t_s,angle_rad,torque_nm\n");
    for (run, &[slow, fast, amplitude, first, second, angle]) in runs.iter().enumerate() {
        let (mut q, mut w) = (angle, 0.0_f64);
        let dt = STEP_S / SUBSTEPS as f64;
        for i in 0..600 {
            let t = STEP_S * i as f64;
            let torque = amplitude * ((TAU * slow * t + first).sin() + 0.6 * (TAU * fast * t + second).sin());
            let reading = q + noise.sample(&mut rng);
            writeln!(text, "{run},{t:.3},{reading:.6},{torque:.5}").unwrap();
            for _ in 0..SUBSTEPS {
                let before = w;
                let free = w + dt * (torque / 0.12 - 30.0 * q.sin() - 1.2 * w);
                w = free.signum() * (free.abs() - dt * FRICTION).max(0.0);
                q += 0.5 * dt * (before + w);
            }
        }
    }
    text
}

const PENDULUM: &str = r#"
[model]
states = { angle_rad = "rate_rad_s", rate_rad_s = "torque_nm/inertia_kg_m2 - weight_per_s2*sin(angle_rad) - damping_per_s*rate_rad_s" }
outputs = { angle_rad = "angle_rad" }
inputs = { torque_nm = "hold" }
[[parameter]]
name = "inertia_kg_m2"
unit = "kg m^2"
start = 0.1
lower = 0.01
upper = 1.0
[[parameter]]
name = "weight_per_s2"
unit = "1/s^2"
start = 28.0
lower = 1.0
upper = 100.0
[[parameter]]
name = "damping_per_s"
unit = "1/s"
start = 1.0
lower = 0.0
upper = 20.0
[[joint]]
name = "arm"
position = "angle_rad"
velocity = "rate_rad_s"
drive = "torque_nm"
turns = true
"#;

/// Of joints that are driven hard enough to turn over, a fit of whole runs settles on motions that turn over once more or once less.
#[test]
fn dry_friction_is_found_in_pendulums_that_turn_over() {
    for runs in &RUNS {
        assert_named(&answer(PENDULUM, &rows(runs)), &[("coulomb-friction", FRICTION)]);
    }
}

const CAR: &str = r#"
[model]
states = { way_m = "speed_m_s", speed_m_s = "-damping_per_s*speed_m_s" }
outputs = { wheel_m_s = "speed_m_s" }
[start]
way_m = 0.0
[[parameter]]
name = "damping_per_s"
unit = "1/s"
start = 0.05
[[joint]]
name = "car"
position = "way_m"
velocity = "speed_m_s"
"#;

/// What is left of a car that rolls out while one of two causes is missing looks like correlated noise. Beside such noise each row at which
/// the car may come to rest is a minimum.
#[test]
fn dry_friction_is_found_beside_drag_in_cars_that_roll_out() {
    let noise = Normal::new(0.0, 0.02).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut data = String::from("run,t_s,wheel_m_s\n");
    for (run, begins) in [19.2, 15.5, 11.9, 15.6].into_iter().enumerate() {
        let mut speed = [begins];
        for i in 0..160 {
            let reading = speed[0] + noise.sample(&mut rng);
            writeln!(data, "{run},{:.2},{reading:.5}", 0.25 * f64::from(i)).unwrap();
            follow(&mut speed, 0.25, 20, |[v]| [-0.12 - 0.02 * v - 0.004 * v * v]);
            speed[0] = speed[0].max(0.0);
        }
    }
    assert_named(&answer(CAR, &data), &[("coulomb-friction", 0.12), ("quadratic-damping", 0.004)]);
}

const SERVO: &str = r#"
[model]
states = { arm_rad = "rate_rad_s", rate_rad_s = "stiffness_per_s2*(command_rad - arm_rad) - damping_per_s*rate_rad_s" }
outputs = { encoder_rad = "arm_rad" }
inputs = { command_rad = "linear" }
[[parameter]]
name = "stiffness_per_s2"
unit = "1/s^2"
start = 120.0
[[parameter]]
name = "damping_per_s"
unit = "1/s"
start = 12.0
[[joint]]
name = "arm"
position = "arm_rad"
velocity = "rate_rad_s"
drive = "command_rad"
"#;

/// In short windows a stop looks like a spring that is negative, with which every motion runs away.
#[test]
fn a_stop_is_found_though_short_windows_say_that_the_motion_runs_away() {
    let noise = Normal::new(0.0, 1e-3).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut data = String::from("run,t_s,command_rad,encoder_rad\n");
    for run in 0..2 {
        let goal = |t: f64| {
            0.8 * (TAU * (0.2 + 0.08 * f64::from(run)) * t).sin()
                + 0.3 * (TAU * 0.9 * t + f64::from(run)).sin()
        };
        let mut x = [goal(0.0), 0.0];
        for i in 0..800 {
            let [t, next] = [i, i + 1].map(|i| 0.01 * f64::from(i));
            let reading = x[0] + noise.sample(&mut rng);
            writeln!(data, "{run},{t:.2},{:.6},{reading:.6}", goal(t)).unwrap();
            for part in 0..20 {
                let goal = goal(t) + (goal(next) - goal(t)) * (f64::from(part) + 0.5) / 20.0;
                let stop = |angle: f64| 3000.0 * (angle - 0.7).max(0.0);
                follow(&mut x, 5e-4, 1, |[q, w]| [*w, 150.0 * (goal - q) - 14.0 * w - stop(*q)]);
            }
        }
    }
    assert_named(&answer(SERVO, &data), &[("end-stop", 0.7)]);
}

const MARKER: &str = r#"
[model]
states = { angle_rad = "rate_rad_s", rate_rad_s = "-g_per_l*sin(angle_rad) - damping_per_s*rate_rad_s" }
outputs = { marker_x_m = "0.41*sin(angle_rad)" }
[[parameter]]
name = "g_per_l"
unit = "1/s^2"
start = 22.0
[[parameter]]
name = "damping_per_s"
unit = "1/s"
start = 0.1
[[joint]]
name = "pivot"
position = "angle_rad"
velocity = "rate_rad_s"
turns = true
"#;

/// A camera sees a marker's place and not the angle: a state that no column shows as it stands is found from what the columns depend on.
#[test]
fn a_swing_is_followed_by_a_function_of_its_angle() {
    for (drag, named) in [(0.0, vec![]), (0.03, vec![("quadratic-damping", 0.03)])] {
        let noise = Normal::new(0.0, 2e-3).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut data = String::from("run,t_s,marker_x_m\n");
        let mut x = [0.9_f64, 0.0];
        for i in 0..2000 {
            let reading = 0.41 * x[0].sin() + noise.sample(&mut rng);
            writeln!(data, "1,{:.2},{reading:.5}", 0.02 * f64::from(i)).unwrap();
            follow(&mut x, 0.02, 4, |[q, w]| [*w, -24.0 * q.sin() - 0.06 * w - drag * w.abs() * w]);
        }
        let answer = answer(MARKER, &data);
        assert_eq!(answer["verdict"], if named.is_empty() { "adequate" } else { "explained" });
        assert_named(&answer, &named);
    }
}

const BELT: &str = r#"
[model]
states = { motor_rad = "motor_rad_s", motor_rad_s = "gain_per_s2*drive - rub_per_s*motor_rad_s - belt_per_s2*(motor_rad - load_rad)", load_rad = "load_rad_s", load_rad_s = "load_per_s2*(motor_rad - load_rad) - air_per_s*load_rad_s" }
outputs = { encoder_rad = "motor_rad", scale_rad = "load_rad" }
inputs = { drive = "hold" }
[start]
motor_rad = 0.0
motor_rad_s = 0.0
load_rad = 0.0
load_rad_s = 0.0
[[parameter]]
name = "gain_per_s2"
unit = "1/s^2"
start = 10.0
[[parameter]]
name = "rub_per_s"
unit = "1/s"
start = 1.0
[[parameter]]
name = "belt_per_s2"
unit = "1/s^2"
start = 70.0
[[parameter]]
name = "load_per_s2"
unit = "1/s^2"
start = 110.0
[[parameter]]
name = "air_per_s"
unit = "1/s"
start = 0.5
[[joint]]
name = "motor"
position = "motor_rad"
velocity = "motor_rad_s"
drive = "drive"
[[joint]]
name = "load"
position = "load_rad"
velocity = "load_rad_s"
"#;

/// A motor and a load on a belt, both of which rub: beside the one alone a few steps of a fit promise more of other mechanisms than of the
/// second. A larger set, of which one member then does nothing, brings the two together.
#[test]
fn two_joints_that_rub_are_found_by_a_larger_set() {
    let noise = Normal::new(0.0, 1e-3).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    let mut data = String::from("run,t_s,drive,encoder_rad,scale_rad\n");
    for run in 0..3 {
        let mut x = [0.0_f64; 4];
        let mut drive = 0.0;
        for i in 0..500 {
            if i % 50 == 0 {
                drive = rng.random_range(-8.0..8.0);
            }
            let [encoder, scale] = [x[0], x[2]].map(|angle| angle + noise.sample(&mut rng));
            writeln!(data, "{run},{:.2},{drive:.6},{encoder:.6},{scale:.6}", 0.01 * f64::from(i)).unwrap();
            for _ in 0..4000 {
                let h = 0.01 / 4000.0;
                let [q, v, p, w] = x;
                let stretched = q - p;
                let free = [
                    v + h * (12.0 * drive - 1.5 * v - 80.0 * stretched),
                    w + h * (120.0 * stretched - 0.8 * w),
                ];
                let rubs = |speed: f64, level: f64| speed.signum() * (speed.abs() - h * level).max(0.0);
                let [v, w] = [rubs(free[0], 5.0), rubs(free[1], 4.0)];
                x = [q + 0.5 * h * (x[1] + v), v, p + 0.5 * h * (x[3] + w), w];
            }
        }
    }
    assert_named(&answer(BELT, &data), &[("coulomb-friction@motor", 5.0), ("coulomb-friction@load", 4.0)]);
}

const TWO_LINKS: &str = r#"
[model]
outputs = { encoder1_rad = "shoulder_rad", encoder2_rad = "elbow_rad" }
inputs = { torque1_n_m = "hold", torque2_n_m = "hold" }
[model.states]
shoulder_rad = "rate1_rad_s"
elbow_rad = "rate2_rad_s"
rate1_rad_s = "(a2*(torque1_n_m - d1*rate1_rad_s + a3*sin(elbow_rad)*(2*rate1_rad_s*rate2_rad_s + rate2_rad_s^2)) - (a2 + a3*cos(elbow_rad))*(torque2_n_m - d2*rate2_rad_s - a3*sin(elbow_rad)*rate1_rad_s^2))/((a1 + 2*a3*cos(elbow_rad))*a2 - (a2 + a3*cos(elbow_rad))^2)"
rate2_rad_s = "((a1 + 2*a3*cos(elbow_rad))*(torque2_n_m - d2*rate2_rad_s - a3*sin(elbow_rad)*rate1_rad_s^2) - (a2 + a3*cos(elbow_rad))*(torque1_n_m - d1*rate1_rad_s + a3*sin(elbow_rad)*(2*rate1_rad_s*rate2_rad_s + rate2_rad_s^2)))/((a1 + 2*a3*cos(elbow_rad))*a2 - (a2 + a3*cos(elbow_rad))^2)"
[start]
shoulder_rad = 0.2
elbow_rad = 0.5
rate1_rad_s = 0.0
rate2_rad_s = 0.0
[[parameter]]
name = "a1"
unit = "kg m^2"
start = 0.13
[[parameter]]
name = "a2"
unit = "kg m^2"
start = 0.03
[[parameter]]
name = "a3"
unit = "kg m^2"
start = 0.04
[[parameter]]
name = "d1"
unit = "N m s"
start = 0.1
[[parameter]]
name = "d2"
unit = "N m s"
start = 0.04
[[joint]]
name = "shoulder"
position = "shoulder_rad"
velocity = "rate1_rad_s"
drive = "torque1_n_m"
turns = true
[[joint]]
name = "elbow"
position = "elbow_rad"
velocity = "rate2_rad_s"
drive = "torque2_n_m"
turns = true
"#;

/// Dry friction of an arm's shoulder is a torque: what it decelerates hangs on how far the arm is stretched, as it does of the motor's torque.
#[test]
fn friction_of_an_arm_is_a_torque() {
    let noise = Normal::new(0.0, 1e-3).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let mut data = String::from("run,t_s,torque1_n_m,torque2_n_m,encoder1_rad,encoder2_rad\n");
    for run in 0..3 {
        let [mut q, mut w]: [[f64; 2]; 2] = [[0.2, 0.5], [0.0; 2]];
        let mut torques = [0.0; 2];
        for i in 0..300 {
            if i % 30 == 0 {
                torques = [rng.random_range(-1.2..1.2), rng.random_range(-0.3..0.3)];
            }
            let [one, two] = q.map(|angle| angle + noise.sample(&mut rng));
            let [of_one, of_two] = torques;
            writeln!(data, "{run},{:.2},{of_one:.6},{of_two:.6},{one:.6},{two:.6}", 0.01 * f64::from(i))
                .unwrap();
            for _ in 0..2000 {
                let h = 0.01 / 2000.0;
                let (sine, cosine) = q[1].sin_cos();
                let (m11, m12, m22) = (0.12 + 0.08 * cosine, 0.03 + 0.04 * cosine, 0.03);
                let free = [
                    of_one - 0.1 * w[0] + 0.04 * sine * (2.0 * w[0] * w[1] + w[1] * w[1]),
                    of_two - 0.05 * w[1] - 0.04 * sine * w[0] * w[0],
                ];
                let determinant = m11 * m22 - m12 * m12;
                // The torque that stops the shoulder within the step, as far as friction has it.
                let freely = w[0] + h * (m22 * free[0] - m12 * free[1]) / determinant;
                let stops = -freely * determinant / (h * m22);
                let rubs = stops.clamp(-0.15, 0.15);
                let on = [free[0] + rubs, free[1]];
                w[0] += h * (m22 * on[0] - m12 * on[1]) / determinant;
                w[1] += h * (m11 * on[1] - m12 * on[0]) / determinant;
                q = [q[0] + h * w[0], q[1] + h * w[1]];
            }
        }
    }
    let answer = answer(TWO_LINKS, &data);
    assert_eq!(answer["verdict"], "explained", "{}", answer["chosen"]);
    // Stretched out, the shoulder feels a unit of torque as so much.
    let stretched = 0.03 / (0.2 * 0.03 - 0.07 * 0.07);
    assert_named(&answer, &[("coulomb-friction@shoulder", 0.15 * stretched)]);
}
