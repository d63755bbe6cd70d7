//! The domain `slosh`: sloshing liquids with concealed effects.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use rand_chacha::ChaCha8Rng;

use super::draw::{self, between, choose, log_between, stated, whole};
use super::key::{Hidden, Key, Place};
use super::nuisances::{Nuisances, difference};
use super::rig::{Choice, Rig};
use crate::noise::Noise;
use crate::physics::slosh::{Effects, Machine, Oscillation, Push, ROOTS, Slip, SloshWorld, Start};

const LISTED: usize = 7;
const UNLISTED: usize = 4;
/// Unlisted effects that act at a place.
const LOCAL: [usize; 3] = [2, 4, 5];

/// A cylinder on its sensor.
pub(crate) struct Bottle {
    world: SloshWorld,
    noise: Noise,
    /// One sigma of a reading.
    sigma: f64,
    /// Whether the sideways force was recorded in place of the torque.
    sideways: bool,
    /// The second mode's and the arm's angular frequency and damping ratio.
    rings: [[f64; 2]; 2],
    /// Sign of the change of the frequency with the amplitude.
    frequency_sign: f64,
    least_tension_n_m: f64,
    lag_s: f64,
    machine: Machine,
    slip_s: f64,
    push: Push,
}

impl Rig for Bottle {
    const DOMAIN: &'static str = "slosh";
    type Effects = Effects;

    fn draw(hidden: Hidden, rng: &mut ChaCha8Rng) -> (Self, Choice) {
        let unlisted = match hidden {
            Hidden::Local => LOCAL[whole(rng, 0, LOCAL.len() - 1)],
            _ => whole(rng, 0, UNLISTED - 1),
        };
        let bottle = Self::drawn(hidden.unlisted() && unlisted == 1, rng);
        (bottle, Choice { listed: choose(rng, LISTED, hidden.listed()), unlisted })
    }

    fn candidates(&self) -> Vec<usize> {
        (0..LISTED).collect()
    }

    /// The changes of the readings that the amplitude, the phase and the viscosity of each run can make.
    fn nuisances(&self) -> Nuisances {
        let (w, rows) = (&self.world, self.world.rows);
        let quarter = std::f64::consts::FRAC_PI_2;
        let thicker = 1.02 * w.viscosity_m2_s;
        let mut nuisances = Nuisances::default();
        for (run, start) in w.starts.iter().enumerate() {
            let of_run = |start: Start, viscosity_m2_s: f64| {
                let alone = SloshWorld { starts: vec![start], viscosity_m2_s, ..w.clone() };
                alone.readings().iter().map(|x| x / self.sigma).collect::<Vec<f64>>()
            };
            let first = of_run(*start, w.viscosity_m2_s);
            let mut turned = *start;
            turned.phases_rad[0] += quarter;
            let thick = difference(&first, &of_run(*start, thicker));
            for part in [first, of_run(turned, w.viscosity_m2_s), thick] {
                let mut column = vec![0.0; rows * w.starts.len()];
                column[run * rows..(run + 1) * rows].copy_from_slice(&part);
                nuisances.add(&column);
            }
        }
        nuisances
    }

    fn response(&self, effects: Effects) -> Vec<f64> {
        let at_work = SloshWorld { effects, ..self.world.clone() };
        let moved = difference(&self.world.readings(), &at_work.readings());
        moved.iter().map(|x| x / self.sigma).collect()
    }

    fn size_bounds(&self, listed: usize) -> [f64; 2] {
        let largest = self.largest();
        match listed {
            0 => [self.least_tension_n_m, 0.08],
            1 => [2e-4, 0.06],
            2 => [3e-4 * largest, 0.05 * largest],
            3 => [2e-4 / largest, 0.3 / largest],
            4 | 5 => [0.02 * self.sigma, 0.4 * largest],
            _ => [0.1 * self.sigma, 1.5 * largest],
        }
    }

    fn apply(&self, e: &mut Effects, listed: usize, size: f64) {
        let ring = |[omega_rad_s, damping_ratio]: [f64; 2]| Oscillation {
            omega_rad_s,
            damping_ratio,
            amplitude: size,
        };
        match listed {
            0 => e.surface_tension_n_m = size,
            1 => e.nonlinear_frequency = self.frequency_sign * size,
            2 => e.friction = size,
            3 => e.quadratic = size,
            4 => e.second_mode = ring(self.rings[0]),
            5 => e.arm = ring(self.rings[1]),
            _ => [e.lag_s, e.lag_start] = [self.lag_s, size],
        }
    }

    fn describe(&self, e: &Effects, listed: usize, key: &mut Key) {
        let ring = |r: &Oscillation, omega: f64| {
            let amplitude = if self.sideways { "amplitude_n" } else { "amplitude_nm" };
            [("omega_rad_s", omega), ("damping_ratio", r.damping_ratio), (amplitude, r.amplitude)]
        };
        match listed {
            0 => key.add("surface-tension", &[("surface_tension_n_m", e.surface_tension_n_m)]),
            1 => key.add("nonlinear-frequency", &[("coefficient", e.nonlinear_frequency)]),
            2 => {
                let name = if self.sideways { "friction_n" } else { "friction_nm" };
                key.add("contact-line-friction", &[(name, e.friction)]);
            }
            3 => {
                let name = if self.sideways { "coefficient_per_n" } else { "coefficient_per_nm" };
                key.add("quadratic-damping", &[(name, e.quadratic)]);
            }
            4 => {
                // Where there is surface tension it moves the second mode as well.
                let at_work = SloshWorld { effects: *e, ..self.world.clone() };
                let omega = at_work.omega_rad_s(ROOTS[1], at_work.depth_m());
                key.add("second-mode", &ring(&e.second_mode, omega));
            }
            5 => key.add("arm-compliance", &ring(&e.arm, e.arm.omega_rad_s)),
            _ => key.add("sensor-lag", &[("tau_s", e.lag_s)]),
        }
    }

    fn unlisted_size_bounds(&self, which: usize) -> [f64; 2] {
        match which {
            0 | 2 => [0.02 * self.sigma, 0.5 * self.largest()],
            1 => [1e-3, 0.08],
            4 | 5 => [0.02 * self.sigma, 300.0 * self.largest()],
            _ => [0.02, 1.0],
        }
    }

    fn unlisted(&self, beside: Effects, which: usize, sign: f64, size: f64) -> Effects {
        match which {
            0 => Effects { machine: Machine { amplitude: size, ..self.machine }, ..beside },
            1 => Effects { leak: size, ..beside },
            2 => {
                let run = self.world.starts.len() / 2;
                Effects { slip: Slip { shift: sign * size, run, at_s: self.slip_s }, ..beside }
            }
            4 => Effects { push: Push { size: sign * size, from_run: 0, ..self.push }, ..beside },
            5 => Effects { push: Push { size: sign * size, ..self.push }, ..beside },
            _ => Effects { swirl_rad_s: size, ..beside },
        }
    }

    fn describe_unlisted(&self, which: usize, key: &mut Key) {
        let end = self.world.rows as f64 / self.world.rate_hz;
        let from = |from: f64| Some(Place::new("t_s", from, end));
        let pushed = Place::new("t_s", self.push.window_s[0], self.push.window_s[1]);
        let runs = self.world.starts.len();
        let (what, place) = match which {
            0 => ("a machine near by that starts", from(self.machine.from_s)),
            1 => ("a leak: less liquid from run to run", None),
            2 => {
                let run = (runs / 2 + 1).to_string();
                ("a grip that slips once, in one run", from(self.slip_s).map(|place| place.in_runs([run])))
            }
            4 => ("a push on the liquid", Some(pushed)),
            5 => {
                let later = (self.push.from_run..runs).map(|run| (run + 1).to_string());
                ("a push on the liquid, from one run on", Some(pushed.in_runs(later)))
            }
            _ => ("a wave whose plane turns", None),
        };
        key.unlisted = Some(what.into());
        key.place = place;
    }

    fn files(self, effects: Effects, rng: &mut ChaCha8Rng) -> [String; 2] {
        let w = SloshWorld { effects, ..self.world };
        let channel = if self.sideways { "fx_n" } else { "tau_z_nm" };
        let mut header = String::from("format = 1\ndomain = \"slosh\"\ndata = \"data.csv\"\n");
        if whole(rng, 0, 2) > 0 {
            let _ = write!(header, "\n[noise]\n{channel} = {:.3e}\n", stated(rng, &self.noise));
        }
        let length = between(rng, 3.5, 6.0) * w.radius_m;
        let length = if whole(rng, 0, 3) > 0 { format!(", length_m = {length:.3}") } else { String::new() };
        let _ = write!(
            header,
            "\n[rig]\ncontainer = {{ shape = \"cylinder\", radius_m = {}{length} }}\nliquid_mass_kg = {}\nvolume_m3 = {}\n",
            w.radius_m, w.mass_kg, w.volume_m3
        );
        if whole(rng, 0, 1) == 1 {
            header.push_str("temperature_k = 294\n");
        }
        let mut data = format!("run,t_s,{channel}\n");
        for run in 0..w.starts.len() {
            let mut readings = w.run(run);
            self.noise.apply(&mut readings, rng);
            for (row, value) in readings.iter().enumerate() {
                let _ = writeln!(data, "{},{:.4},{value:.7}", run + 1, row as f64 / w.rate_hz);
            }
        }
        [header, data]
    }
}

impl Bottle {
    fn drawn(leaks: bool, rng: &mut ChaCha8Rng) -> Self {
        let sideways = whole(rng, 0, 3) == 0;
        // A force is the torque over the arm it acts with, 5 to 15 cm.
        let sigma = if sideways { log_between(rng, 2e-3, 1e-2) } else { log_between(rng, 1.5e-4, 5e-4) };
        let noise = draw::noise(rng, sigma);
        let radius_m = between(rng, 0.03, 0.055);
        // A leak is seen by the bottom, so the liquid must not be deep.
        let depth = radius_m * if leaks { between(rng, 0.4, 0.7) } else { log_between(rng, 0.6, 2.8) };
        let volume_m3 = std::f64::consts::PI * radius_m * radius_m * depth;
        let largest = sigma * log_between(rng, 10.0, 60.0);
        let runs = if leaks { whole(rng, 3, 6) } else { whole(rng, 2, 6) };
        let starts = (0..runs)
            .map(|_| Start {
                amplitude: largest * between(rng, 0.5, 1.0),
                phases_rad: std::array::from_fn(|_| between(rng, 0.0, TAU)),
                lag_error: between(rng, -1.0, 1.0),
            })
            .collect();
        let rate_hz = [50.0, 100.0, 125.0][whole(rng, 0, 2)];
        let duration_s = between(rng, 5.0, 10.0);
        let world = SloshWorld {
            radius_m,
            mass_kg: volume_m3 * between(rng, 780.0, 1300.0),
            volume_m3,
            viscosity_m2_s: log_between(rng, 8e-7, 3e-5),
            starts,
            rows: (duration_s * rate_hz) as usize,
            rate_hz,
            effects: Effects::default(),
        };
        let mode = |root: f64| world.omega_rad_s(root, world.depth_m());
        // The arm's frequency is far from those of the first three modes.
        let modes = [mode(ROOTS[0]), mode(ROOTS[1]), mode(8.536)];
        let arm = loop {
            let omega = log_between(rng, 28.0, 110.0);
            if modes.iter().all(|m| (omega / m - 1.0).abs() > 0.12) {
                break omega;
            }
        };
        let rings = [[modes[1], log_between(rng, 0.004, 0.03)], [arm, log_between(rng, 0.003, 0.03)]];
        let frequency_sign = if depth < 0.5 * radius_m { 1.0 } else { -1.0 };
        let machine = Machine {
            amplitude: 0.0,
            omega_rad_s: modes[0] * between(rng, 1.15, 1.8),
            from_s: duration_s * between(rng, 0.2, 0.6),
        };
        let slip_s = duration_s * between(rng, 0.2, 0.8);
        let begin = duration_s * between(rng, 0.15, 0.6);
        let window_s = [begin, begin + duration_s * between(rng, 0.08, 0.2)];
        let from_run = whole(rng, 1, world.starts.len() - 1);
        let push = Push { size: 0.0, window_s, from_run };
        Self {
            sigma: draw::sigma(&noise),
            noise,
            least_tension_n_m: log_between(rng, 0.015, 0.05),
            lag_s: log_between(rng, 0.015, 0.15),
            world,
            sideways,
            rings,
            frequency_sign,
            machine,
            slip_s,
            push,
        }
    }

    fn largest(&self) -> f64 {
        self.world.starts.iter().map(|s| s.amplitude).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;
    use crate::concealed::rig::tests::every_effect_shows;

    #[test]
    fn every_effect_changes_the_readings_by_more_than_a_baseline_takes() {
        for seed in 0..3 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let bottle = Bottle::drawn(true, &mut rng);
            every_effect_shows(&bottle, UNLISTED, 1.3, [3.0, 5.0]);
        }
    }

    /// Another amplitude, phase and viscosity are nothing new.
    #[test]
    fn nuisances_are_taken_whole() {
        let bottle = Bottle::drawn(false, &mut ChaCha8Rng::seed_from_u64(5));
        let mut other = bottle.world.clone();
        other.starts[0].phases_rad[0] += 0.7;
        other.starts[1].amplitude *= 1.2;
        other.viscosity_m2_s *= 1.01;
        let moved = difference(&bottle.world.readings(), &other.readings());
        let moved: Vec<f64> = moved.iter().map(|x| x / bottle.sigma).collect();
        let whole = moved.iter().map(|x| x * x).sum::<f64>().sqrt();
        let left = bottle.nuisances().residual_norm(&moved);
        assert!(whole > 30.0 && left < 0.01 * whole, "{left} of {whole}");
    }
}
