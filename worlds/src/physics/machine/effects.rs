//! What a simulation of a machine leaves out.

/// What acts on a joint; forces in units of the velocity's derivative. Off at 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointEffects {
    /// Dry friction.
    pub coulomb: f64,
    /// Dry friction forward less backward.
    pub asymmetry: f64,
    /// Dry friction that fades with the speed: level, and the speed at which a part of 1/e is left.
    pub stribeck: [f64; 2],
    /// Dry friction as a part of the driving force.
    pub load_fraction: f64,
    /// `-c v`, `-c |v| v`, `-c v^3`.
    pub damping: [f64; 3],
    /// `-k x`, `-k x^2`, `-k x^3`.
    pub stiffness: [f64; 3],
    /// A constant force.
    pub constant: f64,
    /// Amplitude, phase (rad) and periods a turn.
    pub cogging: [f64; 3],
    /// Position and stiffness of a stop above the joint's range.
    pub stop: Option<[f64; 2]>,
    /// All accelerations are smaller by 1 plus this.
    pub inertia: f64,
    /// Stiffness and yield of a spring that yields.
    pub hysteresis: [f64; 2],
}

impl JointEffects {
    /// Whether any dry friction acts.
    pub(super) fn dry(&self) -> bool {
        [self.coulomb, self.asymmetry, self.stribeck[0], self.load_fraction].iter().any(|level| *level != 0.0)
    }

    /// Dry friction in a direction of motion (1 forward, -1 backward), at a velocity, under a driving force.
    pub(super) fn friction(&self, sign: f64, v: f64, load: f64) -> f64 {
        let mut level = self.coulomb + 0.5 * sign * self.asymmetry + self.load_fraction * load.abs();
        if self.stribeck[0] > 0.0 {
            level += self.stribeck[0] * (-(v / self.stribeck[1]).powi(2)).exp();
        }
        level.max(0.0)
    }

    /// All other forces, at a position with a velocity and a deflection of the yielding spring.
    pub(super) fn force(&self, x: f64, v: f64, deflection: f64) -> f64 {
        let [c1, c2, c3] = self.damping;
        let [k1, k2, k3] = self.stiffness;
        let [amplitude, phase, periods] = self.cogging;
        let stop = self.stop.map_or(0.0, |[at, stiffness]| stiffness * (x - at).max(0.0));
        self.constant + amplitude * (periods * x + phase).sin()
            - v * (c1 + c2 * v.abs() + c3 * v * v)
            - x * (k1 + k2 * x + k3 * x * x)
            - stop
            - self.hysteresis[0] * deflection
    }

    /// How fast the yielding spring deflects.
    pub(super) fn spring_rate(&self, v: f64, z: f64) -> f64 {
        let [stiffness, yields] = self.hysteresis;
        if stiffness == 0.0 { 0.0 } else { v - (v.abs() * z + v * z.abs()) / (2.0 * yields) }
    }
}

/// What a drive does to its command, in this order. Off at 0, bounds where there are none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InputEffects {
    /// The largest command that is passed on.
    pub upper: Option<f64>,
    /// The smallest.
    pub lower: Option<f64>,
    /// Half of the range of commands that do nothing, taken off all others.
    pub dead_zone: f64,
    /// Departure of the gain from 1.
    pub gain: f64,
    /// Added to the command.
    pub offset: f64,
    /// Play between the command and what follows it, from end to end.
    pub gap: f64,
    /// Delay, s.
    pub delay_s: f64,
    /// Time constant of a first-order lag, s.
    pub lag_s: f64,
}

impl InputEffects {
    /// What becomes of a command before play, delay and lag.
    pub(super) fn passed(&self, command: f64) -> f64 {
        let within =
            command.min(self.upper.unwrap_or(f64::INFINITY)).max(self.lower.unwrap_or(-f64::INFINITY));
        let live = (within.abs() - self.dead_zone).max(0.0).copysign(within);
        live * (1.0 + self.gain) + self.offset
    }
}

/// Errors of a sensor. Off at 0, bounds where there are none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensorEffects {
    /// Departure of the gain from 1.
    pub gain: f64,
    /// Added to the reading.
    pub offset: f64,
    /// Added for each second since the run's start.
    pub drift_per_s: f64,
    /// Delay, s.
    pub delay_s: f64,
    /// Time constant of a first-order lag, s.
    pub lag_s: f64,
    /// The largest reading.
    pub upper: Option<f64>,
    /// The smallest reading.
    pub lower: Option<f64>,
}

impl SensorEffects {
    /// The reading of a quantity (late already) at a time since the run's start.
    pub(super) fn read(&self, quantity: f64, t: f64) -> f64 {
        let value = quantity * (1.0 + self.gain) + self.offset + self.drift_per_s * t;
        value.min(self.upper.unwrap_or(f64::INFINITY)).max(self.lower.unwrap_or(-f64::INFINITY))
    }
}

/// What else happens to an amount. Off at 0, where there is no height.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LevelEffects {
    /// What comes above it is lost.
    pub overflow: Option<f64>,
    /// The level falls in proportion to its height.
    pub leak_per_s: f64,
}

/// What is on no list: of size nought it is off.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Unlisted {
    /// What it is.
    pub what: What,
    /// Its largest force (for [`What::Change`] the rate, 1/s).
    pub size: f64,
    /// The run in which or from which on, from 0.
    pub run: usize,
    /// A time, a position, or an angular frequency: where it acts.
    pub at: f64,
    /// Over which range of it.
    pub width: f64,
}

/// Kinds of what is on no list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum What {
    /// A push at a time, in one run.
    #[default]
    Push,
    /// A bump in a range of positions.
    Patch,
    /// A force that comes and goes with the time since the run's start.
    Hum,
    /// More resistance from a run on.
    Change,
}

impl Unlisted {
    /// The force in a run, at a time, at a position, with a velocity.
    pub(super) fn force(&self, run: usize, t: f64, x: f64, v: f64) -> f64 {
        if self.size == 0.0 {
            return 0.0;
        }
        let bump = |away: f64| (-0.5 * (away / self.width).powi(2)).exp();
        self.size
            * match self.what {
                What::Push if run == self.run => bump(t - self.at),
                What::Patch => bump(x - self.at),
                What::Hum => (self.at * t).sin(),
                What::Change if run >= self.run => -v,
                What::Push | What::Change => 0.0,
            }
    }
}

/// Everything that may act in a machine beside its equations.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effects {
    /// By joint.
    pub joints: [JointEffects; 2],
    /// On the input.
    pub input: InputEffects,
    /// By output.
    pub outputs: [SensorEffects; 2],
    /// On the level.
    pub level: LevelEffects,
    /// By how much the recording's clock is fast.
    pub clock_rate: f64,
    /// What is on no list.
    pub unlisted: Unlisted,
}
