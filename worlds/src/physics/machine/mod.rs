//! Machines with joints, a drive and sensors: fixed small steps of Runge-Kutta's method between the times at which something jumps; a
//! joint that comes to rest within a step is found by bisection, and stands until more pulls at it than its friction holds.

mod drive;
mod effects;
mod plant;
#[cfg(test)]
mod tests;

use super::runge_kutta::step;
use drive::Drive;
pub use effects::{Effects, InputEffects, JointEffects, LevelEffects, SensorEffects, Unlisted, What};
pub use plant::{Joint, Plant};

/// What is followed: up to four states of the plant, a joint's yielding spring for each of two joints, the drive's lag, the lags of two
/// sensors.
pub(crate) type State = [f64; STATES];
const STATES: usize = 9;
const SPRINGS: usize = 4;
const LAG: usize = 6;
const SENSOR_LAGS: usize = 7;

/// Steps between two rows, at the least.
const STEPS: f64 = 8.0;
/// Halvings of a step in which a joint comes to rest.
const HALVINGS: usize = 40;

/// One run: where it begins, when it is read, and what it is told.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The plant's states at the time `-lead_s`.
    pub start: [f64; 4],
    /// How long the machine has been moving when the recording begins, s; from rest it is 0.
    pub lead_s: f64,
    /// Number of rows, evenly spaced from t = 0.
    pub rows: usize,
    /// The command at each row; empty where there is no input.
    pub command: Vec<f64>,
}

/// A machine and the runs it makes.
#[derive(Debug, Clone, PartialEq)]
pub struct MachineWorld {
    /// What kind of machine, with its constants.
    pub plant: Plant,
    /// Time between rows, s.
    pub row_s: f64,
    /// Whether commands go straight from row to row, or hold.
    pub linear: bool,
    /// Its runs.
    pub runs: Vec<Run>,
}

/// How a joint with dry friction moves.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    Stands,
    Slides(f64),
}

/// A run under way.
struct Course<'a> {
    world: &'a MachineWorld,
    run: usize,
    effects: &'a Effects,
    drive: Drive<'a>,
    joints: &'static [Joint],
    /// The longest step.
    longest_s: f64,
}

impl MachineWorld {
    /// The readings of one run without noise: a column for each output.
    pub fn readings(&self, run: usize, effects: &Effects) -> Vec<Vec<f64>> {
        let of_run = &self.runs[run];
        let pace = 1.0 + effects.clock_rate;
        // The clock says (1 + rate) t.
        let row_s = self.row_s / pace;
        let course = Course::new(self, run, effects, row_s);
        let outputs = self.plant.outputs();
        // When each output is read: (time, output, row), and when commands jump.
        let mut stops: Vec<(f64, Option<(usize, usize)>)> =
            course.drive.jumps().map(|t| (t, None)).filter(|s| s.0 > -of_run.lead_s).collect();
        for output in 0..outputs.len() {
            let late = effects.outputs[output].delay_s;
            stops.extend((0..of_run.rows).map(|k| (k as f64 * row_s - late, Some((output, k)))));
        }
        stops.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut columns = vec![vec![0.0; of_run.rows]; outputs.len()];
        let mut t = -of_run.lead_s;
        let mut x = course.begin();
        for (until, reading) in stops {
            if until > t {
                course.lead(&mut x, t, until);
                t = until;
            }
            if let Some((output, row)) = reading {
                let sensor = &effects.outputs[output];
                let seen =
                    if sensor.lag_s > 0.0 { x[SENSOR_LAGS + output] } else { self.plant.output(output, &x) };
                columns[output][row] = sensor.read(seen, row as f64 * self.row_s);
            }
        }
        columns
    }
}

impl MachineWorld {
    /// The plant's states at each row of a run where nothing is left out.
    pub fn states(&self, run: usize) -> Vec<[f64; 4]> {
        let of_run = &self.runs[run];
        let effects = Effects::default();
        let course = Course::new(self, run, &effects, self.row_s);
        let mut x = course.begin();
        let mut t = -of_run.lead_s;
        let mut states = Vec::with_capacity(of_run.rows);
        for row in 0..of_run.rows {
            let until = row as f64 * self.row_s;
            course.lead(&mut x, t, until);
            t = until;
            states.push([x[0], x[1], x[2], x[3]]);
        }
        states
    }
}

impl<'a> Course<'a> {
    /// A run whose rows are `row_s` apart.
    fn new(world: &'a MachineWorld, run: usize, effects: &'a Effects, row_s: f64) -> Self {
        let of_run = &world.runs[run];
        let knots = (0..of_run.rows).map(|k| k as f64 * row_s).collect();
        let drive = Drive::new(knots, &of_run.command, world.linear, &effects.input);
        let lags = effects.outputs.iter().map(|sensor| sensor.lag_s).chain([effects.input.lag_s]);
        let shortest_s = lags.filter(|lag| *lag > 0.0).fold(f64::INFINITY, f64::min);
        let longest_s = (world.row_s / STEPS).min(0.5 * shortest_s);
        Self { world, run, effects, drive, joints: world.plant.joints(), longest_s }
    }

    /// The state before the run: springs at rest, lags in their steady state.
    fn begin(&self) -> State {
        let mut x = [0.0; STATES];
        x[..4].copy_from_slice(&self.world.runs[self.run].start);
        x[LAG] = self.drive.value(0, 0.0);
        for output in 0..self.world.plant.outputs().len() {
            x[SENSOR_LAGS + output] = self.world.plant.output(output, &x);
        }
        x
    }

    /// From one time to another, in even steps.
    fn lead(&self, x: &mut State, t: f64, until: f64) {
        let steps = ((until - t) / self.longest_s - 1e-6).ceil().max(1.0);
        let h = (until - t) / steps;
        for k in 0..steps as usize {
            self.advance(x, t + k as f64 * h, h);
        }
    }

    /// One step of `h` from the time `t`, through all rests within it.
    fn advance(&self, x: &mut State, t: f64, h: f64) {
        let segment = self.drive.segment(t + 0.5 * h);
        let (mut t, mut left) = (t, h);
        for _ in 0..50 {
            let modes = self.modes(x, t, segment);
            let trial = self.along(x, t, left, segment, modes);
            let Some(joint) = self.reversed(&trial, modes) else {
                *x = trial;
                break;
            };
            let (mut low, mut high, mut at, mut which) = (0.0, left, trial, joint);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                let there = self.along(x, t, middle, segment, modes);
                match self.reversed(&there, modes) {
                    None => low = middle,
                    Some(joint) => (high, at, which) = (middle, there, joint),
                }
            }
            *x = at;
            x[self.joints[which].velocity] = 0.0;
            t += high;
            left -= high;
            if left <= 0.0 {
                break;
            }
        }
        if let (Some(level), Some(height)) = (self.world.plant.level(), self.effects.level.overflow) {
            x[level] = x[level].min(height);
        }
    }

    fn along(&self, x: &State, t: f64, h: f64, segment: usize, modes: [Mode; 2]) -> State {
        let mut there = step(x, t, h, |x, t| self.rates(x, t, segment, modes));
        for (joint, mode) in self.joints.iter().zip(modes) {
            if mode == Mode::Stands {
                there[joint.velocity] = 0.0;
            }
        }
        there
    }

    /// The joint that has turned round.
    fn reversed(&self, x: &State, modes: [Mode; 2]) -> Option<usize> {
        self.joints.iter().zip(modes).position(|(joint, mode)| match mode {
            Mode::Stands => false,
            Mode::Slides(sign) => self.effects.joints[joint.number].dry() && x[joint.velocity] * sign < 0.0,
        })
    }

    /// How each joint moves from here on: one at rest stands where friction holds it.
    fn modes(&self, x: &State, t: f64, segment: usize) -> [Mode; 2] {
        let mut modes = [Mode::Slides(1.0); 2];
        for joint in self.joints.iter().filter(|j| self.effects.joints[j.number].dry()) {
            let v = x[joint.velocity];
            modes[joint.number] = if v == 0.0 {
                let free = self.smooth(x, t, segment);
                let pull = free[joint.velocity];
                let holds = self.friction(joint, x, t, segment, pull.signum());
                if pull.abs() <= holds { Mode::Stands } else { Mode::Slides(pull.signum()) }
            } else {
                Mode::Slides(v.signum())
            };
        }
        modes
    }

    /// Dry friction of a joint that moves in a direction, divided by its inertia as all forces are.
    fn friction(&self, joint: &Joint, x: &State, t: f64, segment: usize, sign: f64) -> f64 {
        let e = &self.effects.joints[joint.number];
        let mut load = 0.0;
        if e.load_fraction > 0.0 {
            let plant = &self.world.plant;
            let u = self.command(x, t, segment);
            let idle = if plant.follows() { x[joint.position] } else { 0.0 };
            load = plant.rates(x, u)[joint.velocity] - plant.rates(x, idle)[joint.velocity];
        }
        e.friction(sign, x[joint.velocity], load) / (1.0 + e.inertia)
    }

    /// What acts: the drive's lag in the state, or the command at once.
    fn command(&self, x: &State, t: f64, segment: usize) -> f64 {
        if self.effects.input.lag_s > 0.0 { x[LAG] } else { self.drive.value(segment, t) }
    }

    fn rates(&self, x: &State, t: f64, segment: usize, modes: [Mode; 2]) -> State {
        let mut rates = self.smooth(x, t, segment);
        for joint in self.joints.iter().filter(|j| self.effects.joints[j.number].dry()) {
            let force = match modes[joint.number] {
                Mode::Stands => -rates[joint.velocity],
                Mode::Slides(sign) => -sign * self.friction(joint, x, t, segment, sign),
            };
            let direction = self.world.plant.direction(joint.number, x);
            for (rate, d) in rates.iter_mut().zip(direction) {
                *rate += d * force;
            }
        }
        rates
    }

    /// Rates of change without dry friction.
    fn smooth(&self, x: &State, t: f64, segment: usize) -> State {
        let plant = &self.world.plant;
        let e = self.effects;
        let u = self.command(x, t, segment);
        let mut rates = [0.0; STATES];
        rates[..4].copy_from_slice(&plant.rates(x, u));
        for joint in self.joints {
            let own = &e.joints[joint.number];
            let (position, v, z) = (x[joint.position], x[joint.velocity], x[SPRINGS + joint.number]);
            let mut force = own.force(position, v, z);
            if joint.number == 0 {
                force += e.unlisted.force(self.run, t, position, v);
            }
            let direction = plant.direction(joint.number, x);
            for (rate, d) in rates.iter_mut().zip(direction) {
                *rate += d * force;
            }
            rates[SPRINGS + joint.number] = own.spring_rate(v, z);
            rates[joint.velocity] /= 1.0 + own.inertia;
        }
        if let Some(level) = plant.level() {
            rates[level] -= e.level.leak_per_s * x[level];
            rates[level] += e.unlisted.force(self.run, t, x[level], x[level]);
            if e.level.overflow.is_some_and(|height| x[level] >= height && rates[level] > 0.0) {
                rates[level] = 0.0;
            }
        }
        if e.input.lag_s > 0.0 {
            rates[LAG] = (self.drive.value(segment, t) - x[LAG]) / e.input.lag_s;
        }
        for output in 0..plant.outputs().len() {
            let lag_s = e.outputs[output].lag_s;
            if lag_s > 0.0 {
                rates[SENSOR_LAGS + output] = (plant.output(output, x) - x[SENSOR_LAGS + output]) / lag_s;
            }
        }
        rates
    }
}
