//! Liquid that sloshes in an upright cylinder, felt as a torque: oscillators in small steps of a classical Runge-Kutta
//! method, dry friction with its stops found within a step.

use std::f64::consts::{PI, TAU};

use super::bisection::bisect;
use super::runge_kutta::step;
use crate::GRAVITY_M_S2;

/// Roots of the first and second antisymmetric mode of a cylinder (k R).
pub(crate) const ROOTS: [f64; 2] = [1.841_184, 5.331_443];

/// A further damped oscillation in the readings.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Oscillation {
    /// Angular frequency without damping, rad/s.
    pub omega_rad_s: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Amplitude at t = 0, in the reading's unit.
    pub amplitude: f64,
}

/// Everything that may act beside gravity and viscosity; all zero is the linear first mode.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effects {
    /// Surface tension in N/m, the contact line free.
    pub surface_tension_n_m: f64,
    /// Relative change of the frequency at the largest amplitude; it goes with the amplitude squared.
    pub nonlinear_frequency: f64,
    /// Dry friction of the contact line, as the reading below which the surface sticks: `q'' = ... - omega^2 f sign(q')`.
    pub friction: f64,
    /// Quadratic damping in 1/reading: `q'' = ... - c |q'| q'`.
    pub quadratic: f64,
    /// The second antisymmetric mode; its frequency follows from the cylinder.
    pub second_mode: Oscillation,
    /// An arm that rings.
    pub arm: Oscillation,
    /// Time constant of a sensor of first order, s.
    pub lag_s: f64,
    /// Largest error of such a sensor's reading at t = 0, when the rotation has just ended.
    pub lag_start: f64,
    /// Unlisted: a machine near by.
    pub machine: Machine,
    /// Unlisted: fraction of the volume that is lost from run to run.
    pub leak: f64,
    /// Unlisted: the grip slips once.
    pub slip: Slip,
    /// Unlisted: the plane of the wave turns, rad/s.
    pub swirl_rad_s: f64,
    /// Unlisted: the liquid is pushed for a while.
    pub push: Push,
}

/// A push on the first mode, in some of the runs.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Push {
    /// Acceleration of the reading, in its unit over s^2.
    pub size: f64,
    /// Beginning and end, s.
    pub window_s: [f64; 2],
    /// The first run in which it acts, counted from 0.
    pub from_run: usize,
}

/// A machine that shakes the sensor from a time on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Machine {
    /// Amplitude in the reading's unit.
    pub amplitude: f64,
    /// Angular frequency in rad/s.
    pub omega_rad_s: f64,
    /// Time at which the machine starts, s.
    pub from_s: f64,
}

/// A slip of the grip, after which the readings of its run are shifted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Slip {
    /// The shift in the reading's unit.
    pub shift: f64,
    /// The run, counted from 0.
    pub run: usize,
    /// Time of the slip, s.
    pub at_s: f64,
}

/// State of the liquid and its sensor at the start of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Amplitude of the reading.
    pub amplitude: f64,
    /// Phases of the first mode, the second mode, the arm and the swirl.
    pub phases_rad: [f64; 4],
    /// Error of a slow sensor's reading at t = 0 over `lag_start`, in [-1, 1].
    pub lag_error: f64,
}

/// A cylinder that was brought upright.
#[derive(Debug, Clone, PartialEq)]
pub struct SloshWorld {
    /// Radius in m.
    pub radius_m: f64,
    /// Mass of the liquid in kg.
    pub mass_kg: f64,
    /// Its volume in m^3.
    pub volume_m3: f64,
    /// Its kinematic viscosity in m^2/s.
    pub viscosity_m2_s: f64,
    /// The runs.
    pub starts: Vec<Start>,
    /// Rows of a run.
    pub rows: usize,
    /// Readings a second.
    pub rate_hz: f64,
    /// The effects at work.
    pub effects: Effects,
}

/// Displacement and velocity of the first mode, the second, the arm; the sensor's reading.
type State = [f64; 7];

/// The constants of one run.
struct Run<'a> {
    effects: &'a Effects,
    omega: f64,
    damping_ratio: f64,
    second: Oscillation,
    /// Relative change of the frequency with the amplitude squared.
    frequency_rise: f64,
}

impl SloshWorld {
    /// Depth of the liquid in m.
    pub fn depth_m(&self) -> f64 {
        self.volume_m3 / (PI * self.radius_m * self.radius_m)
    }

    /// Angular frequency of the mode of a root, for a depth: `omega^2 = (g k + sigma k^3/rho) tanh(k h)`.
    pub fn omega_rad_s(&self, root: f64, depth_m: f64) -> f64 {
        let k = root / self.radius_m;
        let density = self.mass_kg / self.volume_m3;
        let pull = GRAVITY_M_S2 * k + self.effects.surface_tension_n_m * k.powi(3) / density;
        (pull * (k * depth_m).tanh()).sqrt()
    }

    /// Damping ratio of the first mode [Matl 2021, eq. 2.4].
    #[allow(clippy::approx_constant, reason = "a fitted coefficient, as printed")]
    fn damping_ratio(&self, depth_m: f64) -> f64 {
        let deep = depth_m / self.radius_m;
        let wall = 0.318 / (1.84 * deep).sinh() * (1.0 + (1.0 - deep) / (1.84 * deep).cosh());
        0.79 * (self.viscosity_m2_s / (self.radius_m.powf(1.5) * GRAVITY_M_S2.sqrt())).sqrt() * (1.0 + wall)
    }

    /// The readings of all runs without noise, run after run.
    pub fn readings(&self) -> Vec<f64> {
        (0..self.starts.len()).flat_map(|run| self.run(run)).collect()
    }

    /// The readings of one run without noise.
    pub fn run(&self, number: usize) -> Vec<f64> {
        let e = &self.effects;
        let start = &self.starts[number];
        let depth = self.depth_m() * (1.0 - e.leak * number as f64);
        let largest = self.starts.iter().map(|s| s.amplitude).fold(0.0, f64::max);
        let run = Run {
            effects: e,
            omega: self.omega_rad_s(ROOTS[0], depth),
            damping_ratio: self.damping_ratio(depth),
            second: Oscillation { omega_rad_s: self.omega_rad_s(ROOTS[1], depth), ..e.second_mode },
            frequency_rise: e.nonlinear_frequency / (largest * largest),
        };
        let begin = |size: f64, omega: f64, phase: f64| [size * phase.cos(), -omega * size * phase.sin()];
        let [first, second, arm, plane] = start.phases_rad;
        let [q, v] = begin(start.amplitude, run.omega, first);
        let [q2, v2] = begin(run.second.amplitude, run.second.omega_rad_s, second);
        let [q3, v3] = begin(e.arm.amplitude, e.arm.omega_rad_s, arm);
        let mut state = [q, v, q2, v2, q3, v3, q + q2 + q3 + start.lag_error * e.lag_start];
        // 0.05 rad of the fastest oscillation a step: the phase is then true to 1e-8 of itself.
        let fastest =
            run.omega.max(run.second.omega_rad_s).max(e.arm.omega_rad_s).max(1.0 / e.lag_s.max(1e-2));
        let steps = (fastest / self.rate_hz / 0.05).ceil();
        let step_s = 1.0 / self.rate_hz / steps;
        let mut readings = Vec::with_capacity(self.rows);
        for row in 0..self.rows {
            let t = row as f64 / self.rate_hz;
            let turned = (e.swirl_rad_s * t + plane).cos();
            let reading = if e.lag_s > 0.0 { state[6] } else { state[0] + state[2] + state[4] };
            let reading = if e.swirl_rad_s > 0.0 { reading * turned } else { reading };
            readings.push(reading + self.unlisted_reading(number, t));
            for step in 0..steps as usize {
                let middle = t + (step as f64 + 0.5) * step_s;
                let [begin, end] = e.push.window_s;
                if number >= e.push.from_run && middle > begin && middle < end {
                    state[1] += e.push.size * step_s;
                }
                state = run.advance(state, step_s);
            }
        }
        readings
    }

    /// What unlisted effects add to a reading.
    fn unlisted_reading(&self, number: usize, t: f64) -> f64 {
        let e = &self.effects;
        let Machine { amplitude, omega_rad_s, from_s } = e.machine;
        let machine = if t >= from_s { amplitude * (omega_rad_s * (t - from_s)).sin() } else { 0.0 };
        machine + if number == e.slip.run && t >= e.slip.at_s { e.slip.shift } else { 0.0 }
    }
}

impl Run<'_> {
    /// The rates of change; `motion` is the sign of the first mode's velocity, 0 where its surface sticks.
    fn rates(&self, x: &State, motion: f64) -> State {
        let [q, v, q2, v2, q3, v3, y] = *x;
        let (e, arm, second) = (self.effects, &self.effects.arm, &self.second);
        let ring = |r: &Oscillation, q: f64, v: f64| {
            -2.0 * r.damping_ratio * r.omega_rad_s * v - r.omega_rad_s * r.omega_rad_s * q
        };
        // Time runs faster or slower with the energy: the shape stays a sine.
        let pace = 1.0 + self.frequency_rise * (q * q + (v / self.omega).powi(2));
        let spring = self.omega * self.omega * (pace * q + e.friction * motion);
        let pull = -spring - (2.0 * self.damping_ratio * self.omega + e.quadratic * v.abs()) * v;
        let sticks = e.friction > 0.0 && motion == 0.0;
        let [dq, dv] = if sticks { [0.0; 2] } else { [pace * v, pull] };
        let follow = if e.lag_s > 0.0 { (q + q2 + q3 - y) / e.lag_s } else { 0.0 };
        [dq, dv, v2, ring(second, q2, v2), v3, ring(arm, q3, v3), follow]
    }

    fn runge_kutta(&self, x: &State, h: f64, motion: f64) -> State {
        step(x, 0.0, h, |x, _| self.rates(x, motion))
    }

    /// One step, split where the friction turns round.
    fn advance(&self, mut x: State, mut h: f64) -> State {
        let friction = self.effects.friction;
        if friction == 0.0 {
            return self.runge_kutta(&x, h, 0.0);
        }
        loop {
            let sticks = x[1] == 0.0 && x[0].abs() <= friction;
            let motion = match (sticks, x[1] == 0.0) {
                (true, _) => 0.0,
                (false, true) => -x[0].signum(),
                (false, false) => x[1].signum(),
            };
            let end = self.runge_kutta(&x, h, motion);
            if sticks || end[1] * motion >= 0.0 {
                return end;
            }
            let moves = |h: f64| self.runge_kutta(&x, h, motion)[1] * motion > 0.0;
            let [_, late] = bisect([0.0, h], 40, moves);
            x = self.runge_kutta(&x, late, motion);
            x[1] = 0.0;
            h -= late;
        }
    }
}

impl Start {
    /// A wave of an amplitude and nothing else, with its phase.
    pub fn wave(amplitude: f64, phase_rad: f64) -> Self {
        Self { amplitude, phases_rad: [phase_rad.rem_euclid(TAU), 0.0, 0.0, 0.0], lag_error: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world(effects: Effects) -> SloshWorld {
        SloshWorld {
            radius_m: 0.04,
            mass_kg: 0.4,
            volume_m3: 4e-4,
            viscosity_m2_s: 1e-6,
            starts: vec![Start::wave(0.01, 0.3)],
            rows: 1001,
            rate_hz: 100.0,
            effects,
        }
    }

    /// The closed form of a damped oscillator, with the numbers of a textbook's cylinder: omega^2 = g k tanh(k h).
    #[test]
    fn the_first_mode_is_a_damped_cosine() {
        let w = world(Effects::default());
        let k: f64 = ROOTS[0] / 0.04;
        let omega = (GRAVITY_M_S2 * k * (k * 4e-4 / (PI * 0.0016)).tanh()).sqrt();
        approx::assert_relative_eq!(w.omega_rad_s(ROOTS[0], w.depth_m()), omega, max_relative = 1e-12);
        let ratio = w.damping_ratio(w.depth_m());
        // Deep water: 0.79 sqrt(1e-6/(0.008 * 3.1316)) = 0.00499, and 1.6 % more for the bottom.
        assert!((ratio / 0.00499 - 1.0).abs() < 0.03, "{ratio}");
        let damped = omega * (1.0 - ratio * ratio).sqrt();
        let [q, v] = [0.01 * 0.3f64.cos(), -omega * 0.01 * 0.3f64.sin()];
        for (row, value) in w.run(0).iter().enumerate() {
            let t = row as f64 / 100.0;
            let shape = q * (damped * t).cos() + (v + ratio * omega * q) / damped * (damped * t).sin();
            approx::assert_abs_diff_eq!(*value, (-ratio * omega * t).exp() * shape, epsilon = 1e-8);
        }
    }

    fn peaks(x: &[f64]) -> Vec<(f64, f64)> {
        (1..x.len() - 1)
            .filter(|&i| x[i] > x[i - 1] && x[i] >= x[i + 1] && x[i] > 0.0)
            .map(|i| {
                let (slope, bend) = (0.5 * (x[i + 1] - x[i - 1]), x[i + 1] - 2.0 * x[i] + x[i - 1]);
                (i as f64 - slope / bend, x[i] - 0.5 * slope * slope / bend)
            })
            .collect()
    }

    /// Without viscosity a cycle loses four of the friction's reading, in a straight line, and the surface stays where it stops.
    #[test]
    fn friction_takes_four_of_itself_a_cycle_and_stops() {
        let w = SloshWorld { viscosity_m2_s: 0.0, ..world(Effects { friction: 2e-4, ..Effects::default() }) };
        let readings = SloshWorld { rate_hz: 400.0, rows: 4001, ..w }.run(0);
        let peaks = peaks(&readings);
        for pair in peaks.windows(2).take(8) {
            approx::assert_abs_diff_eq!(pair[0].1 - pair[1].1, 8e-4, epsilon = 2e-6);
        }
        let last = &readings[readings.len() - 50..];
        assert!(last.iter().all(|x| *x == last[0] && x.abs() <= 2e-4), "{:?}", last[0]);
    }

    /// The frequency departs by the coefficient at the largest amplitude, by a quarter of it at half of that.
    #[test]
    fn the_frequency_changes_with_the_amplitude_squared() {
        let mut w = SloshWorld {
            viscosity_m2_s: 0.0,
            starts: vec![Start::wave(0.01, 0.0), Start::wave(0.005, 0.0)],
            rate_hz: 400.0,
            rows: 4001,
            ..world(Effects::default())
        };
        let rate = |w: &SloshWorld, run: usize| {
            let p = peaks(&w.run(run));
            (p.len() - 1) as f64 / (p[p.len() - 1].0 - p[0].0)
        };
        let linear = rate(&w, 0);
        w.effects.nonlinear_frequency = -0.02;
        approx::assert_abs_diff_eq!(rate(&w, 0) / linear - 1.0, -0.02, epsilon = 1e-5);
        approx::assert_abs_diff_eq!(rate(&w, 1) / linear - 1.0, -0.005, epsilon = 1e-5);
    }

    /// Quadratic damping alone: da/dt = -4/(3 pi) c omega a^2, so 1/a grows in a straight line.
    #[test]
    fn quadratic_damping_falls_as_one_over_time() {
        let w = SloshWorld { viscosity_m2_s: 0.0, ..world(Effects { quadratic: 3.0, ..Effects::default() }) };
        let omega = w.omega_rad_s(ROOTS[0], w.depth_m());
        let peaks = peaks(&SloshWorld { rate_hz: 400.0, rows: 4001, ..w }.run(0));
        let (first, last) = (peaks[0], peaks[peaks.len() - 1]);
        let grown = (1.0 / last.1 - 1.0 / first.1) / ((last.0 - first.0) / 400.0);
        approx::assert_relative_eq!(grown, 4.0 / (3.0 * PI) * 3.0 * omega, max_relative = 0.01);
    }

    /// A slow sensor turns back a sine by the angle whose tangent is omega tau, once its start is forgotten.
    #[test]
    fn a_slow_sensor_lags() {
        let w = SloshWorld { viscosity_m2_s: 0.0, ..world(Effects::default()) };
        let quick = w.run(0);
        let lag_s = 0.05;
        let slow = SloshWorld { effects: Effects { lag_s, ..Effects::default() }, ..w.clone() }.run(0);
        let turn = w.omega_rad_s(ROOTS[0], w.depth_m()) * lag_s;
        let size = |x: &[f64]| x.iter().map(|v| v * v).sum::<f64>().sqrt();
        let [from, to] = [100, 900];
        let product: f64 = (from..to).map(|i| quick[i] * slow[i]).sum();
        let (a, b) = (size(&quick[from..to]), size(&slow[from..to]));
        approx::assert_relative_eq!(b / a, 1.0 / turn.hypot(1.0), max_relative = 0.01);
        approx::assert_abs_diff_eq!(product / (a * b), 1.0 / turn.hypot(1.0), epsilon = 0.01);
    }
}
