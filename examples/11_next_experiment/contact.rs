//! A soft body with something hidden about it, pressed by a ball on an arm with a load cell.

use std::fmt::Write as _;

use hw_traits::arm::{Arm, Pose};
use hw_traits::clock::{Clock, Stamped};
use hw_traits::force_torque::{ForceTorque, Wrench};
use hw_traits::{ErrorKind, ErrorType};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};
use worlds::physics::indentation::{Effects, IndentationWorld, Indenter, Rim, Step};

use super::{Outcome, Rig, on_log_scale};

const BALL_M: f64 = 0.01;
const MODULUS_PA: f64 = 2e4;
/// One sigma of the load cell, N.
const SIGMA_N: f64 = 1e-3;
/// The arm's reach: shallowest and deepest press, fastest and slowest, in s.
const DEPTH_M: [f64; 2] = [1e-4, 4e-3];
const DURATION_S: [f64; 2] = [0.1, 100.0];
const ROWS: usize = 40;
const REPEATS: usize = 3;

/// What may be hidden; the world's effects with that alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hidden {
    id: &'static str,
    effects: Effects,
}

/// A press from the contact or above it (below zero) to a depth in a time, and how long the depth is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Press {
    from_m: f64,
    depth_m: f64,
    duration_s: f64,
    hold_s: f64,
}

/// The rig.
pub(super) struct Contact;

impl Rig for Contact {
    type Hidden = Hidden;
    type Action = Press;
    const NAME: &'static str = "a soft body pressed";
    const COLUMNS: &'static str = "run,delta_m,force_n,t_s,segment";

    fn header() -> String {
        format!(
            "format = 1\ndomain = \"indentation\"\ndata = \"data.csv\"\n\n[rig]\nindenter = {{ shape = \"sphere\", \
             radius_m = {BALL_M} }}\npoisson_ratio = 0.5\n"
        )
    }

    fn draw(rng: &mut ChaCha8Rng) -> Hidden {
        let size = on_log_scale(rng, [0.3, 3.0]);
        let signed = if rng.random::<bool>() { size } else { -size };
        let none = Effects::default();
        let (id, effects) = match rng.random_range(0..10) {
            0 => ("adhesion", Effects { adhesion_j_m2: 0.15 * size, ..none }),
            1 => ("finite-thickness", Effects { thickness_m: 0.02 / size, ..none }),
            2 => ("strain-stiffening", Effects { stiffening: 0.6 * size, ..none }),
            3 => ("membrane-tension", Effects { tension_n_m: 15.0 * size, ..none }),
            4 => {
                ("viscoelasticity", Effects { relaxed_fraction: (0.15 * size).min(0.9), tau_s: 1.0, ..none })
            }
            5 => ("load-cell-compliance", Effects { compliance_m_n: 3e-4 * size, ..none }),
            6 => ("membrane-stretching", Effects { stretching_n_m3: 1e7 * size, ..none }),
            7 => {
                let rim = Rim { depth_m: rng.random_range(3e-4..3e-3), stiffness_n_m: 50.0 * size };
                ("rim-contact", Effects { rim, ..none })
            }
            8 => ("contact-offset", Effects { contact_offset_m: 3e-5 * signed, ..none }),
            _ => ("force-offset", Effects { force_offset_n: 3e-3 * signed, ..none }),
        };
        Hidden { id, effects }
    }

    fn id(hidden: Hidden) -> &'static str {
        hidden.id
    }

    fn first() -> Press {
        Press { from_m: 0.0, depth_m: 1e-3, duration_s: 1.0, hold_s: 0.0 }
    }

    fn random(rng: &mut ChaCha8Rng) -> Press {
        let [above_m, depth_m, duration_s, hold_s] =
            [DEPTH_M, DEPTH_M, DURATION_S, DURATION_S].map(|reach| on_log_scale(rng, reach));
        let mut or_none = |value: f64| if rng.random() { value } else { 0.0 };
        Press { from_m: -or_none(above_m), depth_m, duration_s, hold_s: or_none(hold_s) }
    }

    fn grid() -> Vec<Press> {
        let press = |share: f64, duration_s| Press {
            from_m: 0.0,
            depth_m: share * DEPTH_M[1],
            duration_s,
            hold_s: 0.0,
        };
        [0.25, 0.5, 0.75, 1.0].iter().flat_map(|share| [0.1, 1.0, 10.0].map(|s| press(*share, s))).collect()
    }

    fn proposed(value: &dyn Fn(&str) -> Option<f64>) -> Option<Press> {
        let press = Press {
            from_m: value("from_m").unwrap_or(0.0),
            depth_m: value("delta_m")?,
            duration_s: value("duration_s")?,
            hold_s: value("hold_s").unwrap_or(0.0),
        };
        let within = |v: f64, [least, most]: [f64; 2]| v >= 0.999 * least && v <= 1.001 * most;
        let held = press.hold_s == 0.0 || within(press.hold_s, DURATION_S);
        (within(press.depth_m, DEPTH_M) && within(press.duration_s, DURATION_S) && held).then_some(press)
    }

    fn act(press: Press, hidden: Hidden, label: usize, seed: u64) -> Outcome<String> {
        let mut rows = String::new();
        for repeat in 0..REPEATS {
            let mut ball = Ball::new(hidden.effects, seed.wrapping_add(repeat as u64) ^ 0xba11)?;
            for reading in curve(&mut ball, press)? {
                let Reading { delta_m, force_n, t_s, segment } = reading;
                writeln!(rows, "{label}-{repeat},{delta_m:.7},{force_n:.6},{t_s:.4},{segment}")?;
            }
        }
        Ok(rows)
    }
}

/// One row of a curve.
struct Reading {
    delta_m: f64,
    force_n: f64,
    t_s: f64,
    segment: &'static str,
}

/// Presses and reads, on any arm that carries a load cell: down in steps, and held.
fn curve<R>(rig: &mut R, press: Press) -> Outcome<Vec<Reading>>
where
    R: Arm + ForceTorque + Clock,
{
    let as_text = |e: R::Error| format!("{e:?}");
    let mut readings = Vec::new();
    let zero = rig.now_s().map_err(as_text)?;
    rig.move_to(at(press.from_m), 1.0).map_err(as_text)?;
    let holds = if press.hold_s > 0.0 { ROWS } else { 0 };
    for row in 0..ROWS + holds {
        if row > 0 {
            let share = (row.min(ROWS - 1)) as f64 / (ROWS - 1) as f64;
            let lasts =
                if row < ROWS { press.duration_s / (ROWS - 1) as f64 } else { press.hold_s / ROWS as f64 };
            let depth_m = press.from_m + share * (press.depth_m - press.from_m);
            rig.move_to(at(depth_m), lasts).map_err(as_text)?;
            rig.sleep_s(lasts).map_err(as_text)?;
        }
        let pose = rig.pose().map_err(as_text)?;
        let wrench = rig.read().map_err(as_text)?;
        readings.push(Reading {
            delta_m: -pose.value.position_m[2],
            force_n: wrench.value.force_n[2],
            t_s: wrench.t_s - zero,
            segment: if row < ROWS { "load" } else { "hold" },
        });
    }
    Ok(readings)
}

/// The ball at a depth, upright.
fn at(depth_m: f64) -> Pose {
    Pose { position_m: [0.0, 0.0, -depth_m], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] }
}

/// A simulated arm with a ball over a soft body.
struct Ball {
    world: IndentationWorld,
    steps: Vec<Step>,
    now_s: f64,
    depth_m: f64,
    noise: Normal<f64>,
    rng: ChaCha8Rng,
}

impl Ball {
    fn new(effects: Effects, seed: u64) -> Outcome<Self> {
        let world = IndentationWorld {
            indenter: Indenter::Sphere(BALL_M),
            poisson_ratio: 0.5,
            moduli_pa: vec![MODULUS_PA],
            runs: Vec::new(),
            effects,
        };
        let (steps, rng) = (Vec::new(), ChaCha8Rng::seed_from_u64(seed));
        Ok(Self { world, steps, now_s: 0.0, depth_m: 0.0, noise: Normal::new(0.0, SIGMA_N)?, rng })
    }
}

impl ErrorType for Ball {
    type Error = ErrorKind;
}

impl Clock for Ball {
    fn now_s(&mut self) -> Result<f64, ErrorKind> {
        Ok(self.now_s)
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), ErrorKind> {
        self.now_s += duration_s.max(0.0);
        Ok(())
    }
}

impl Arm for Ball {
    /// The arm is where it was told to be as soon as somebody has waited.
    fn move_to(&mut self, tool_in_base: Pose, deadline_s: f64) -> Result<(), ErrorKind> {
        let depth_m = -tool_in_base.position_m[2];
        if !(depth_m <= 1.001 * DEPTH_M[1] && deadline_s > 0.0) {
            return Err(ErrorKind::OutOfRange);
        }
        self.depth_m = depth_m;
        Ok(())
    }

    fn pose(&mut self) -> Result<Stamped<Pose>, ErrorKind> {
        Ok(Stamped { t_s: self.now_s, value: at(self.depth_m) })
    }

    fn settled(&mut self) -> Result<bool, ErrorKind> {
        Ok(true)
    }
}

impl ForceTorque for Ball {
    /// What the body has been through decides what it does now.
    fn read(&mut self) -> Result<Stamped<Wrench>, ErrorKind> {
        self.steps.push(Step { delta_m: self.depth_m, t_s: self.now_s, down: true });
        self.world.runs = vec![(0, self.steps.clone())];
        let force_n = self.world.readings().last().copied().ok_or(ErrorKind::Other)?;
        let read_n = force_n + self.noise.sample(&mut self.rng);
        let value = Wrench { force_n: [0.0, 0.0, read_n], torque_nm: [0.0; 3] };
        Ok(Stamped { t_s: self.now_s, value })
    }

    fn tare(&mut self, _readings: usize) -> Result<(), ErrorKind> {
        Err(ErrorKind::Other)
    }
}
