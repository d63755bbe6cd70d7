//! Machines as people have them, and their equations as a recording states them.

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;

use super::super::draw::{between, log_between, sign, whole};
use crate::GRAVITY_M_S2;
use crate::physics::machine::{MachineWorld, Plant, Run};

/// What a recording says of a machine.
pub(super) struct Statement {
    pub(super) states: &'static [(&'static str, &'static str)],
    pub(super) input: Option<&'static str>,
    /// Name and unit of each constant, and whether its value is known.
    pub(super) constants: &'static [(&'static str, &'static str, bool)],
    /// Whether the states at a run's first row are known to be nought.
    pub(super) from_rest: bool,
}

/// What a recording says of a machine.
pub(super) fn statement(plant: &Plant) -> Statement {
    match plant {
        Plant::Pendulum(_) => Statement {
            states: &[
                ("angle_rad", "rate_rad_s"),
                ("rate_rad_s", "-g_per_l*sin(angle_rad) - damping_per_s*rate_rad_s"),
            ],
            input: None,
            constants: &[("g_per_l", "1/s^2", false), ("damping_per_s", "1/s", false)],
            from_rest: false,
        },
        Plant::Servo(_) => Statement {
            states: &[
                ("angle_rad", "rate_rad_s"),
                ("rate_rad_s", "stiffness_per_s2*(command_rad - angle_rad) - damping_per_s*rate_rad_s"),
            ],
            input: Some("command_rad"),
            constants: &[("stiffness_per_s2", "1/s^2", false), ("damping_per_s", "1/s", false)],
            from_rest: true,
        },
        Plant::Cart(_) => Statement {
            states: &[("cart_m", "cart_m_s"), ("cart_m_s", "gain*motor_v - drag_per_s*cart_m_s")],
            input: Some("motor_v"),
            constants: &[("gain", "m/s^2/V", false), ("drag_per_s", "1/s", false)],
            from_rest: true,
        },
        Plant::Hull(_) => Statement {
            states: &[
                ("roll_rad", "roll_rad_s"),
                ("roll_rad_s", "-restoring_per_s2*roll_rad - damping_per_s*roll_rad_s"),
            ],
            input: None,
            constants: &[("restoring_per_s2", "1/s^2", false), ("damping_per_s", "1/s", false)],
            from_rest: false,
        },
        Plant::Axis(_) => Statement {
            states: &[("angle_rad", "rate_rad_s"), ("rate_rad_s", "(gain*stick_rad_s - rate_rad_s)/lag_s")],
            input: Some("stick_rad_s"),
            constants: &[("gain", "", false), ("lag_s", "s", false)],
            from_rest: true,
        },
        Plant::Tank(_) => Statement {
            states: &[("head_m", "inflow_m3_s*per_area_m2 - outlet*sqrt(max(head_m, 0))")],
            input: Some("inflow_m3_s"),
            constants: &[("per_area_m2", "1/m^2", true), ("outlet", "m^0.5/s", false)],
            from_rest: false,
        },
        Plant::Crane(_) => Statement {
            states: &[
                ("trolley_m", "trolley_m_s"),
                ("trolley_m_s", "gain*motor_v - drag_per_s*trolley_m_s"),
                ("swing_rad", "swing_rad_s"),
                (
                    "swing_rad_s",
                    "-g_per_l*sin(swing_rad) - (gain*motor_v - drag_per_s*trolley_m_s)*cos(swing_rad)/length_m",
                ),
            ],
            input: Some("motor_v"),
            constants: &[
                ("gain", "m/s^2/V", false),
                ("drag_per_s", "1/s", false),
                ("g_per_l", "1/s^2", true),
                ("length_m", "m", true),
            ],
            from_rest: true,
        },
        Plant::Shaft(_) => Statement {
            states: &[
                ("motor_rad", "motor_rad_s"),
                (
                    "motor_rad_s",
                    "gain*drive_v - motor_damping_per_s*motor_rad_s - motor_per_s2*(motor_rad - link_rad)",
                ),
                ("link_rad", "link_rad_s"),
                ("link_rad_s", "link_per_s2*(motor_rad - link_rad) - link_damping_per_s*link_rad_s"),
            ],
            input: Some("drive_v"),
            constants: &[
                ("gain", "rad/s^2/V", false),
                ("motor_damping_per_s", "1/s", false),
                ("motor_per_s2", "1/s^2", false),
                ("link_per_s2", "1/s^2", false),
                ("link_damping_per_s", "1/s", false),
            ],
            from_rest: true,
        },
    }
}

/// The constants of a machine.
pub(super) fn constants(plant: &Plant) -> Vec<f64> {
    match plant {
        Plant::Pendulum(c)
        | Plant::Servo(c)
        | Plant::Cart(c)
        | Plant::Hull(c)
        | Plant::Axis(c)
        | Plant::Tank(c) => c.to_vec(),
        Plant::Crane(c) => c.to_vec(),
        Plant::Shaft(c) => c.to_vec(),
    }
}

/// The machine with one of its constants changed by a factor.
pub(super) fn with_constant(mut plant: Plant, which: usize, factor: f64) -> Plant {
    match &mut plant {
        Plant::Pendulum(c)
        | Plant::Servo(c)
        | Plant::Cart(c)
        | Plant::Hull(c)
        | Plant::Axis(c)
        | Plant::Tank(c) => c[which] *= factor,
        Plant::Crane(c) => c[which] *= factor,
        Plant::Shaft(c) => c[which] *= factor,
    }
    plant
}

/// Draws a machine and its runs.
pub(super) fn draw(which: usize, rng: &mut ChaCha8Rng) -> MachineWorld {
    let runs = whole(rng, 2, 5);
    let rows = whole(rng, 150, 400);
    let round = |x: f64| (x * 1e4).round() / 1e4;
    let (plant, row_s) = match which {
        0 => (Plant::Pendulum([between(rng, 12.0, 50.0), between(rng, 0.02, 0.2)]), 0.02),
        1 => {
            let omega = between(rng, 8.0, 18.0);
            (Plant::Servo([omega * omega, omega * between(rng, 0.6, 1.8)]), 0.01)
        }
        2 => (Plant::Cart([between(rng, 0.5, 2.0), between(rng, 1.0, 4.0)]), 0.02),
        3 => {
            let omega = TAU / between(rng, 4.0, 9.0);
            (Plant::Hull([omega * omega, omega * between(rng, 0.02, 0.1)]), 0.2)
        }
        4 => (Plant::Axis([between(rng, 0.7, 1.3), between(rng, 0.05, 0.15)]), 0.01),
        5 => (Plant::Tank([round(between(rng, 60.0, 120.0)), between(rng, 0.03, 0.08)]), 0.1),
        6 => {
            let length = round(between(rng, 0.3, 1.0));
            let g_per_l = round(GRAVITY_M_S2 / length);
            (Plant::Crane([between(rng, 0.5, 2.0), between(rng, 1.0, 4.0), g_per_l, length]), 0.02)
        }
        _ => {
            let link = between(rng, 150.0, 600.0);
            let motor = link * between(rng, 0.3, 1.0);
            let gain = between(rng, 20.0, 60.0);
            (Plant::Shaft([gain, between(rng, 4.0, 10.0), motor, link, between(rng, 0.5, 2.0)]), 0.01)
        }
    };
    let linear = whole(rng, 0, 1) == 1;
    let from_rest = statement(&plant).from_rest;
    let runs = (0..runs).map(|_| {
        let rows = (rows as f64 * between(rng, 0.6, 1.2)) as usize;
        let start = match plant {
            Plant::Pendulum(_) => [sign(rng) * between(rng, 0.3, 1.1), 0.0, 0.0, 0.0],
            Plant::Hull(_) => [sign(rng) * between(rng, 0.15, 0.5), 0.0, 0.0, 0.0],
            Plant::Tank(_) => [between(rng, 0.15, 0.4), 0.0, 0.0, 0.0],
            _ => [0.0; 4],
        };
        let lead_s =
            if from_rest || plant.level().is_some() { 0.0 } else { row_s * between(rng, 14.0, 30.0) };
        let command = match plant {
            Plant::Pendulum(_) | Plant::Hull(_) => Vec::new(),
            Plant::Tank(_) => command(rows, row_s * 400.0, 1.0, 1.0, row_s, rng)
                .into_iter()
                // So much as flows out at a third of a metre, at the most.
                .map(|u| ((2e-4 + 4e-4 * (0.5 + 0.5 * u)) * 1e7).round() / 1e7)
                .collect(),
            _ => command(rows, row_s * 200.0, 0.0, between(rng, 0.4, 1.5), row_s, rng),
        };
        Run { start, lead_s, rows, command }
    });
    MachineWorld { plant, row_s, linear, runs: runs.collect() }
}

/// A command in the range from -size to size: steps, a sum of sines, or ramps up and down; nought at first from rest.
fn command(rows: usize, slow_s: f64, first: f64, size: f64, row_s: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let still = if first == 0.0 { rows / 20 } else { 0 };
    let kind = whole(rng, 0, 2);
    let mut level = 0.0;
    let mut next = still;
    let waves: [[f64; 3]; 3] =
        std::array::from_fn(|_| [between(rng, 0.2, 1.0), TAU / log_between(rng, 0.1 * slow_s, slow_s), 0.0]);
    let total: f64 = waves.iter().map(|w| w[0]).sum();
    let period_s = slow_s * between(rng, 0.2, 0.8);
    (0..rows)
        .map(|row| {
            let t = (row.max(still) - still) as f64 * row_s;
            let u = match kind {
                0 => {
                    if row >= next {
                        level = between(rng, -1.0, 1.0);
                        next = row + (slow_s * between(rng, 0.05, 0.3) / row_s) as usize;
                    }
                    level
                }
                1 => waves.iter().map(|[a, omega, phase]| a / total * (omega * t + phase).sin()).sum(),
                _ => {
                    let turn = (t / period_s).fract();
                    if turn < 0.25 {
                        4.0 * turn
                    } else if turn < 0.75 {
                        2.0 - 4.0 * turn
                    } else {
                        4.0 * turn - 4.0
                    }
                }
            };
            if row < still { 0.0 } else { (u * size * 1e4).round() / 1e4 }
        })
        .collect()
}
