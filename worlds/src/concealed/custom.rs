//! The domain `custom`: simulators of other people beside recordings of rigs that do more than the simulators know: columns `sim_<channel>` of a pendulum, a tank
//! or a heated plate, all of whose constants are known.

use std::fmt::Write as _;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use super::draw::{self, between, log_between, sign, stated, strength, whole};
use super::key::{Concealed, Hidden, Key, Place};
use super::maker::Maker;
use super::nuisances::{difference, size_of_strength};
use crate::GRAVITY_M_S2;
use crate::noise::Noise;
use crate::physics::runge_kutta::step;

/// Makes worlds of the domain `custom`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Custom;

/// The plant, whose state is a position (or level, or temperature) and its rate of change.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Plant {
    /// A pendulum, by the angular frequency of small swings (rad/s).
    Pendulum { omega_rad_s: f64 },
    /// A tank whose level falls by `h' = -k sqrt(h)`, k in sqrt(m)/s.
    Tank { outlet: f64 },
    /// A heated plate, by the heater's rate (K/s) and that of cooling by the air (1/s); its state is its temperature above the room's.
    Plate { heater_k_s: f64, cooling_per_s: f64 },
}

/// The effect that the simulator lacks.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Effect {
    Nothing,
    /// Friction of a bearing's grease; evaporation at a constant rate; radiation.
    First,
    /// Drag of the air; a filter that clogs with time; a heater that weakens with time.
    Second,
    /// A knock; a second outlet that opens; a window that is opened: from a time on.
    Sudden,
}

/// One recording.
struct World {
    plant: Plant,
    effect: Effect,
    sign: f64,
    at_s: f64,
    starts: Vec<f64>,
    rows: usize,
    rate_hz: f64,
    noise: Noise,
}

/// Steps of the integrator between two rows.
const STEPS: usize = 20;
/// How long a knock lasts, s.
const KNOCK_S: f64 = 0.04;

impl Maker for Custom {
    fn domain(&self) -> &'static str {
        "custom"
    }

    /// A simulator in columns has no list of mechanisms.
    fn kind(&self, hidden: Hidden) -> Hidden {
        if matches!(hidden, Hidden::Nothing | Hidden::Local) { hidden } else { Hidden::Unlisted }
    }

    fn conceal(&self, hidden: Hidden, seed: u64) -> Concealed {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let hidden = self.kind(hidden);
        let world = World::drawn(hidden, &mut rng);
        let mut key = Key::new(hidden);
        let mut size = 0.0;
        if hidden.unlisted() {
            let wanted = strength(&mut rng);
            size = size_of_strength(wanted, [1e-7, 10.0], |size| world.strength(size));
            key.strength = Some(world.strength(size));
            world.describe(&mut key);
        }
        let [header, data] = world.files(size, &mut rng);
        Concealed::table(header, data, key)
    }
}

impl World {
    fn drawn(hidden: Hidden, rng: &mut ChaCha8Rng) -> Self {
        let (plant, duration_s, level, sigma) = match whole(rng, 0, 2) {
            0 => {
                let omega_rad_s = (GRAVITY_M_S2 / between(rng, 0.2, 1.2)).sqrt();
                let duration_s = between(rng, 3.0, 10.0);
                (Plant::Pendulum { omega_rad_s }, duration_s, 0.5, log_between(rng, 5e-4, 5e-3))
            }
            1 => {
                let duration_s = between(rng, 40.0, 120.0);
                // Two thirds of the level are gone in the end.
                let outlet = 0.42 * 0.5 / duration_s;
                (Plant::Tank { outlet }, duration_s, 0.25, log_between(rng, 5e-4, 3e-3))
            }
            _ => {
                let duration_s = between(rng, 200.0, 900.0);
                let cooling_per_s = between(rng, 1.0, 4.0) / duration_s;
                let heater_k_s = cooling_per_s * between(rng, 0.0, 40.0);
                (Plant::Plate { heater_k_s, cooling_per_s }, duration_s, 30.0, log_between(rng, 0.05, 0.4))
            }
        };
        let runs = whole(rng, 2, 6);
        let rows = whole(rng, 60, 250);
        let effects = [Effect::First, Effect::Second, Effect::Sudden];
        Self {
            plant,
            effect: match hidden {
                Hidden::Nothing => Effect::Nothing,
                Hidden::Local => Effect::Sudden,
                _ => effects[whole(rng, 0, 2)],
            },
            sign: sign(rng),
            at_s: duration_s * between(rng, 0.2, 0.7),
            starts: (0..runs).map(|_| level * between(rng, 0.6, 1.4)).collect(),
            rows,
            rate_hz: rows as f64 / duration_s,
            noise: draw::noise(rng, sigma),
        }
    }

    /// Rates of change of position and speed.
    fn rates(&self, &[x, v]: &[f64; 2], t: f64, size: f64) -> [f64; 2] {
        use Effect::{First, Nothing, Second, Sudden};
        let after = if t >= self.at_s { 1.0 } else { 0.0 };
        match self.plant {
            Plant::Pendulum { omega_rad_s } => {
                let knock = self.sign * (-0.5 * ((t - self.at_s) / KNOCK_S).powi(2)).exp() / KNOCK_S;
                let push = size
                    * match self.effect {
                        Nothing => 0.0,
                        First => -2.0 * v,
                        Second => -v.abs() * v,
                        Sudden => knock,
                    };
                [v, -omega_rad_s * omega_rad_s * x.sin() + push]
            }
            Plant::Tank { outlet } => {
                let level = x.max(0.0);
                let lost = match self.effect {
                    Nothing => 0.0,
                    First => level.min(1e-3) / 1e-3,
                    Second => -0.1 * t * outlet * level.sqrt(),
                    Sudden => after * level.sqrt(),
                };
                [-outlet * level.sqrt() - size * lost, 0.0]
            }
            Plant::Plate { heater_k_s, cooling_per_s } => {
                let lost = match self.effect {
                    Nothing => 0.0,
                    First => cooling_per_s * 0.1 * x.abs() * x,
                    Second => heater_k_s * 0.1 * t * cooling_per_s + 1e-3 * t * cooling_per_s,
                    Sudden => after * cooling_per_s * x,
                };
                [heater_k_s - cooling_per_s * x - size * lost, 0.0]
            }
        }
    }

    /// The readings of one run without noise.
    fn run(&self, start: f64, size: f64) -> Vec<f64> {
        let h = 1.0 / (self.rate_hz * STEPS as f64);
        let mut state = [start, 0.0];
        let mut readings = Vec::with_capacity(self.rows);
        for row in 0..self.rows {
            readings.push(state[0]);
            for part in 0..STEPS {
                let t = (row * STEPS + part) as f64 * h;
                state = step(&state, t, h, |x, t| self.rates(x, t, size));
            }
        }
        readings
    }

    /// Size of an effect's response, in sigmas.
    fn strength(&self, size: f64) -> f64 {
        let sigma = draw::sigma(&self.noise);
        let squares = self.starts.iter().flat_map(|s| difference(&self.run(*s, 0.0), &self.run(*s, size)));
        squares.map(|d| (d / sigma).powi(2)).sum::<f64>().sqrt()
    }

    fn describe(&self, key: &mut Key) {
        let what = match (self.plant, self.effect) {
            (_, Effect::Nothing) => return,
            (Plant::Pendulum { .. }, Effect::First) => "grease in the bearing",
            (Plant::Pendulum { .. }, Effect::Second) => "drag of the air",
            (Plant::Pendulum { .. }, Effect::Sudden) => "a knock",
            (Plant::Tank { .. }, Effect::First) => "evaporation",
            (Plant::Tank { .. }, Effect::Second) => "an outlet that clogs",
            (Plant::Tank { .. }, Effect::Sudden) => "a second outlet that opens",
            (Plant::Plate { .. }, Effect::First) => "cooling that grows with the temperature",
            (Plant::Plate { .. }, Effect::Second) => "a heater that weakens",
            (Plant::Plate { .. }, Effect::Sudden) => "a draught from a window that is opened",
        };
        key.unlisted = Some(what.into());
        if self.effect == Effect::Sudden {
            let to = self.rows as f64 / self.rate_hz;
            key.place = Some(Place::new("t_s", self.at_s, to));
        }
    }

    fn files(&self, size: f64, rng: &mut ChaCha8Rng) -> [String; 2] {
        let (channel, unit) = match self.plant {
            Plant::Pendulum { .. } => ("angle_rad", "rad"),
            Plant::Tank { .. } => ("level_m", "m"),
            Plant::Plate { .. } => ("warmer_k", "K"),
        };
        let mut header = format!(
            "format = 1\ndomain = \"custom\"\ndata = \"data.csv\"\n\n[[input]]\nname = \"t_s\"\nunit = \"s\"\n\n[[channel]]\nname = \"{channel}\"\nunit = \"{unit}\"\n"
        );
        if whole(rng, 0, 2) > 0 {
            let _ = write!(header, "\n[noise]\n{channel} = {:.3e}\n", stated(rng, &self.noise));
        }
        let mut data = format!("run,t_s,{channel},sim_{channel}\n");
        for (run, &start) in self.starts.iter().enumerate() {
            let simulated = self.run(start, 0.0);
            let mut readings = self.run(start, size);
            self.noise.apply(&mut readings, rng);
            for (row, (value, simulated)) in readings.iter().zip(&simulated).enumerate() {
                let t = row as f64 / self.rate_hz;
                let _ = writeln!(data, "{},{t:.4},{value:.7},{simulated:.7}", run + 1);
            }
        }
        [header, data]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world(plant: Plant, effect: Effect) -> World {
        World {
            plant,
            effect,
            sign: 1.0,
            at_s: 2.0,
            starts: vec![0.25],
            rows: 101,
            rate_hz: 20.0,
            noise: Noise::white(1e-3),
        }
    }

    /// Torricelli: the root of the level falls in a straight line.
    #[test]
    fn a_tank_drains_as_torricelli_says() {
        let level = world(Plant::Tank { outlet: 0.05 }, Effect::Nothing).run(0.25, 0.0);
        for (row, h) in level.iter().enumerate() {
            let t = row as f64 / 20.0;
            approx::assert_relative_eq!(h.sqrt(), 0.5 - 0.025 * t, epsilon = 1e-10);
        }
    }

    /// Newton's law of cooling, and a swing of little amplitude that grease slows.
    #[test]
    fn plates_cool_and_pendulums_fade() {
        let plate = Plant::Plate { heater_k_s: 0.5, cooling_per_s: 0.2 };
        for (row, x) in world(plate, Effect::Nothing).run(30.0, 0.0).iter().enumerate() {
            let t = row as f64 / 20.0;
            approx::assert_relative_eq!(*x, 2.5 + 27.5 * (-0.2 * t).exp(), epsilon = 1e-7);
        }
        let swing = world(Plant::Pendulum { omega_rad_s: 4.0 }, Effect::First).run(1e-3, 0.3);
        for (row, x) in swing.iter().enumerate() {
            let (t, damped) = (row as f64 / 20.0, (16.0f64 - 0.09).sqrt());
            let shape = (damped * t).cos() + 0.3 / damped * (damped * t).sin();
            approx::assert_abs_diff_eq!(*x, 1e-3 * (-0.3 * t).exp() * shape, epsilon = 1e-8);
        }
    }

    /// Nothing is hidden before a sudden effect begins, but something after it, and more of it is seen.
    #[test]
    fn what_is_sudden_begins_in_time() {
        for plant in [Plant::Tank { outlet: 0.02 }, Plant::Plate { heater_k_s: 0.5, cooling_per_s: 0.2 }] {
            let w = world(plant, Effect::Sudden);
            let moved = difference(&w.run(0.25, 0.0), &w.run(0.25, 0.02));
            assert!(moved[..40].iter().all(|d| *d == 0.0));
            assert!(moved[60].abs() > 1e-5, "{plant:?}");
            assert!(w.strength(0.02) > 1.5 * w.strength(0.01));
        }
    }
}
