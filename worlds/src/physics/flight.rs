//! Thrown and dropped balls.

use std::fmt::Write as _;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Uniform};

use crate::GRAVITY_M_S2;
use crate::noise::Noise;

use super::runge_kutta;

/// The measured quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measured {
    /// Height alone.
    Height,
    /// All coordinates.
    Position,
    /// The specific force along z, on board.
    SpecificForce,
}

/// Everything that may act beside gravity; all zero is a vacuum and a true camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effects {
    /// Quadratic drag in 1/m.
    pub quadratic_per_m: f64,
    /// Linear drag in 1/s.
    pub linear_per_s: f64,
    /// Constant acceleration upwards in m/s^2.
    pub lift_m_s2: f64,
    /// `a = magnus x v`, in 1/s.
    pub magnus_per_s: [f64; 3],
    /// Velocity of the air in m/s.
    pub wind_m_s: [f64; 2],
    /// Relative error of the positions' scale.
    pub camera_scale: f64,
    /// Rotation of the readings about x, then y, in rad.
    pub camera_tilt_rad: [f64; 2],
    /// Relative error of the stated times.
    pub clock_rate: f64,
    /// Unlisted: the camera's mast swings.
    pub mast: Mast,
    /// Unlisted: the drag falls above a speed.
    pub drag_crisis: DragCrisis,
    /// Unlisted: a cord that pulls back towards the start, in 1/s^2.
    pub cord_per_s2: f64,
    /// Unlisted: a gust that is added to the wind within a window of the true time.
    pub gust: Gust,
    /// Unlisted: the camera is knocked.
    pub knock: Knock,
    /// Unlisted: each run's ball spins about a level axis of its own, which lifts it by so much, in 1/s.
    pub spins_per_s: f64,
    /// Unlisted: the ball is pushed for a while, or at some heights.
    pub push: Push,
}

/// A force for a while, or within a range of heights, in some of the runs.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Push {
    /// Acceleration, m/s^2.
    pub acceleration_m_s2: [f64; 3],
    /// Beginning and end in s since the start of the run, or lowest and highest place in m.
    pub between: [f64; 2],
    /// Whether it acts between two heights.
    pub at_height: bool,
    /// The first run in which it acts, counted from 0.
    pub from_run: usize,
}

/// A mast that swings with a new phase in each run: x by the amplitude, y by 0.3 and z by 0.1 of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Mast {
    /// Amplitude in m.
    pub amplitude_m: f64,
    /// Frequency in Hz.
    pub frequency_hz: f64,
}

/// A drag that falls above a speed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DragCrisis {
    /// Speed above which the drag falls in m/s; 0 for none.
    pub above_m_s: f64,
    /// The part of the drag that is left.
    pub fraction: f64,
}

/// A knock, after which all heights are read too large.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Knock {
    /// Error of the heights in m; 0 for no knock.
    pub height_m: f64,
    /// Stated time in s.
    pub at_s: f64,
}

/// A wind that blows for a while; it acts through drag.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gust {
    /// Velocity of the air in m/s, added to the wind.
    pub velocity_m_s: [f64; 3],
    /// Beginning and end of the gust, in s since the start of the run.
    pub window_s: [f64; 2],
}

/// How flights are recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlightWorld {
    /// The measured quantity.
    pub measured: Measured,
    /// Number of runs.
    pub runs: usize,
    /// Fewest and most rows of a run.
    pub rows: [usize; 2],
    /// Frames in a second.
    pub frame_hz: f64,
    /// Range of speeds at the start in m/s.
    pub speed_m_s: [f64; 2],
    /// Range of angles above level at the start, in rad.
    pub elevation_rad: [f64; 2],
    /// The effects at work.
    pub effects: Effects,
    /// Noise of every channel.
    pub noise: Noise,
}

/// How a run begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Launch {
    /// Place, m, and velocity, m/s.
    pub(crate) state: [f64; 6],
    /// Number of frames.
    pub(crate) rows: usize,
    /// Phase of the mast, and of an accelerometer's offset, rad.
    pub(crate) phase_rad: f64,
}

/// One recorded run.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnRun {
    /// Label.
    pub label: String,
    /// Stated times.
    pub t_s: Vec<f64>,
    /// Readings, one column a channel.
    pub channels: Vec<Vec<f64>>,
}

/// A recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// Names of the channels.
    pub names: &'static [&'static str],
    /// The runs.
    pub runs: Vec<DrawnRun>,
}

/// Steps of the integration in each frame.
const STEPS: usize = 40;

impl FlightWorld {
    /// Five throws, filmed at 60 Hz for about a second.
    pub fn thrown(measured: Measured) -> Self {
        Self {
            measured,
            runs: 5,
            rows: [40, 70],
            frame_hz: 60.0,
            speed_m_s: [4.0, 9.0],
            elevation_rad: [0.5, 1.3],
            effects: Effects::default(),
            noise: Noise::white(0.001),
        }
    }

    /// Drops from rest, the ball let go just before the first frame.
    pub fn dropped(runs: usize, rows: [usize; 2], frame_hz: f64) -> Self {
        Self {
            runs,
            rows,
            frame_hz,
            speed_m_s: [0.0, 0.3],
            elevation_rad: [-1.6, -1.5],
            ..Self::thrown(Measured::Height)
        }
    }

    /// Draws a recording; the same seed gives the same bits.
    pub fn draw(&self, seed: u64) -> Drawn {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let launches = self.launches(&mut rng);
        let names: &[&str] = match self.measured {
            Measured::Height => &["z_m"],
            Measured::Position => &["x_m", "y_m", "z_m"],
            Measured::SpecificForce => &["accel_z_m_s2"],
        };
        let of_run = |(r, (t_s, mut channels)): (usize, (Vec<f64>, Vec<Vec<f64>>))| {
            for column in &mut channels {
                self.noise.apply(column, &mut rng);
            }
            DrawnRun { label: format!("{}", r + 1), t_s, channels }
        };
        let runs = self.flights(&launches).into_iter().enumerate().map(of_run).collect();
        Drawn { names, runs }
    }

    /// How each run begins.
    pub(crate) fn launches(&self, rng: &mut ChaCha8Rng) -> Vec<Launch> {
        let mut between =
            |[low, high]: [f64; 2]| Uniform::new_inclusive(low, high.max(low)).map_or(low, |u| u.sample(rng));
        let of_run = |_| {
            let speed = between(self.speed_m_s);
            let (sin, cos) = between(self.elevation_rad).sin_cos();
            let (east, north) = between([-0.6, 0.6]).sin_cos();
            let [x, y, z] = [between([-0.1, 0.1]), between([-0.1, 0.1]), between([1.0, 1.6])];
            let [u, v, w] = [speed * cos * north, speed * cos * east, speed * sin];
            let rows = between([self.rows[0] as f64, self.rows[1] as f64]).round() as usize;
            Launch { state: [x, y, z, u, v, w], rows, phase_rad: between([0.0, std::f64::consts::TAU]) }
        };
        (0..self.runs).map(of_run).collect()
    }

    /// Times and readings without noise of each run.
    pub(crate) fn flights(&self, launches: &[Launch]) -> Vec<(Vec<f64>, Vec<Vec<f64>>)> {
        let of_run = |(r, launch): (usize, &Launch)| {
            let mut world = *self;
            if r < world.effects.push.from_run {
                world.effects.push = Push::default();
            }
            let (north, east) = launch.phase_rad.sin_cos();
            world.effects.magnus_per_s[0] += self.effects.spins_per_s * east;
            world.effects.magnus_per_s[1] += self.effects.spins_per_s * north;
            world.fly(launch.state, launch.rows, launch.phase_rad, STEPS)
        };
        launches.iter().enumerate().map(of_run).collect()
    }

    /// One flight as the camera would see it without noise, integrated in `steps` steps a frame.
    fn fly(&self, start: [f64; 6], rows: usize, phase: f64, steps: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
        let e = &self.effects;
        let origin = [start[0], start[1], start[2]];
        let force = |y: &[f64; 6], gust: [f64; 3]| -> [f64; 3] {
            let air = [y[3] - e.wind_m_s[0] - gust[0], y[4] - e.wind_m_s[1] - gust[1], y[5] - gust[2]];
            let speed = (air[0].powi(2) + air[1].powi(2) + air[2].powi(2)).sqrt();
            let DragCrisis { above_m_s, fraction } = e.drag_crisis;
            let fraction = if above_m_s > 0.0 && speed > above_m_s { fraction } else { 1.0 };
            let drag = fraction * e.quadratic_per_m * speed + e.linear_per_s;
            let [lx, ly, lz] = e.magnus_per_s;
            [
                ly * y[5] - lz * y[4] - drag * air[0] - e.cord_per_s2 * (y[0] - origin[0]),
                lz * y[3] - lx * y[5] - drag * air[1] - e.cord_per_s2 * (y[1] - origin[1]),
                lx * y[4] - ly * y[3] - drag * air[2] - e.cord_per_s2 * (y[2] - origin[2]) + e.lift_m_s2
                    - GRAVITY_M_S2,
            ]
        };
        let rates = |y: &[f64; 6], gust: [f64; 3], push: [f64; 3]| {
            let f = force(y, gust);
            [y[3], y[4], y[5], f[0] + push[0], f[1] + push[1], f[2] + push[2]]
        };
        // The clock states (1 + rate) times the true time: frames are that much closer together.
        let frame = 1.0 / self.frame_hz;
        let h = frame / (1.0 + e.clock_rate) / steps as f64;
        // Constant within a step, whose middle decides: a method of high order wants no jump inside a step.
        let gust_in = |step: usize| {
            let middle = (step as f64 + 0.5) * h;
            let [begin, end] = e.gust.window_s;
            if middle > begin && middle < end { e.gust.velocity_m_s } else { [0.0; 3] }
        };
        let mut y = start;
        let mut t_s = Vec::with_capacity(rows);
        let mut channels =
            vec![Vec::with_capacity(rows); if self.measured == Measured::Position { 3 } else { 1 }];
        for i in 0..rows {
            let t = i as f64 * frame;
            t_s.push(t);
            let swing = e.mast.amplitude_m * (std::f64::consts::TAU * e.mast.frequency_hz * t + phase).sin();
            let mut seen = self.read(&y, swing);
            if e.knock.height_m != 0.0 && t >= e.knock.at_s {
                seen[2] += e.knock.height_m;
            }
            match self.measured {
                Measured::Height => channels[0].push(seen[2]),
                Measured::Position => channels.iter_mut().zip(seen).for_each(|(c, v)| c.push(v)),
                // Specific force with an offset that every run has of its own.
                Measured::SpecificForce => {
                    channels[0].push(force(&y, gust_in(i * steps))[2] + GRAVITY_M_S2 + 0.05 * phase.cos())
                }
            }
            for step in i * steps..(i + 1) * steps {
                let gust = gust_in(step);
                let at = if e.push.at_height { y[2] } else { (step as f64 + 0.5) * h };
                let [begin, end] = e.push.between;
                let push = if at > begin && at < end { e.push.acceleration_m_s2 } else { [0.0; 3] };
                y = runge_kutta::step(&y, 0.0, h, |y, _| rates(y, gust, push));
            }
        }
        (t_s, channels)
    }

    /// The camera's reading of a position.
    fn read(&self, y: &[f64; 6], swing: f64) -> [f64; 3] {
        let e = &self.effects;
        let [about_x, about_y] = e.camera_tilt_rad;
        let turned =
            [y[0], y[1] * about_x.cos() - y[2] * about_x.sin(), y[1] * about_x.sin() + y[2] * about_x.cos()];
        let turned = [
            turned[0] * about_y.cos() + turned[2] * about_y.sin(),
            turned[1],
            turned[2] * about_y.cos() - turned[0] * about_y.sin(),
        ];
        let scale = 1.0 + e.camera_scale;
        [scale * turned[0] + swing, scale * turned[1] + 0.3 * swing, scale * turned[2] + 0.1 * swing]
    }
}

impl Drawn {
    /// The table of the recording's format.
    pub fn csv(&self, decimals: usize) -> String {
        let mut text = format!("run,t_s,{}\n", self.names.join(","));
        for run in &self.runs {
            for (i, t) in run.t_s.iter().enumerate() {
                let cells: Vec<String> =
                    run.channels.iter().map(|c| format!("{:.decimals$}", c[i])).collect();
                // Writing to a string cannot fail.
                let _ = writeln!(text, "{},{t:.5},{}", run.label, cells.join(","));
            }
        }
        text
    }
}

#[cfg(test)]
mod tests;
