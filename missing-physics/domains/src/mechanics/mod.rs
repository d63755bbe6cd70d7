//! What acts on joints, inputs and outputs of any machine, whoever integrates its motion: which parameters each mechanism has, what it is in words,
//! and where fits of it begin.

mod clock;
mod input;
mod joint;
mod output;
mod starts;

use std::f64::consts::{PI, TAU};

use missing_physics::model::{Mechanism, ParameterRef};

pub(crate) use clock::Clock;
pub(crate) use input::inputs;
pub(crate) use joint::joints;
pub(crate) use output::outputs;
pub(crate) use starts::{input_starts, joint_starts, output_starts};

/// What a parameter is of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum JointEffect {
    Coulomb,
    Asymmetry,
    StribeckLevel,
    StribeckSpeed,
    /// The power of the speed, less one.
    Damping(usize),
    LoadFraction,
    /// The power of the position, less one.
    Stiffness(usize),
    Constant,
    CogAmplitude,
    CogPhase,
    CogPeriods,
    Gap,
    StopPosition,
    StopStiffness,
    Inertia,
    YieldStiffness,
    Yield,
}

/// What a parameter is of an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum InputEffect {
    Gain,
    Offset,
    Delay,
    Lag,
    Upper,
    Lower,
    DeadZone,
}

/// What a parameter is of an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OutputEffect {
    Gain,
    Offset,
    Drift,
    Delay,
    Lag,
    Upper,
    Lower,
}

/// A joint that is slow has this part of its typical speed.
const SLOW: f64 = 0.25;
/// The largest number of periods a turn that is looked for.
const MOST_PERIODS: f64 = 60.0;
/// A spring is wound up by so many turns at the most: those that a motor makes before its gear.
const TURNS_OF_A_SPRING: f64 = 20.0;

/// Sizes of a joint's motion: what effects and their bounds are measured by.
#[derive(Debug, Clone, Default)]
pub(crate) struct JointSizes {
    /// Root mean square of the force, in the unit of forces.
    pub(crate) force: f64,
    /// Root mean square of the speed.
    pub(crate) speed: f64,
    /// Largest modulus of the position.
    pub(crate) reach: f64,
    /// Smallest and largest position.
    pub(crate) range: [f64; 2],
    /// Time between rows, s.
    pub(crate) step_s: f64,
    /// It rotates, so that effects periodic in the angle make sense.
    pub(crate) turns: bool,
    pub(crate) units: JointUnits,
}

/// Units of a joint.
#[derive(Debug, Clone, Default)]
pub(crate) struct JointUnits {
    pub(crate) position: String,
    pub(crate) speed: String,
    pub(crate) force: String,
    /// Of a force by the speed, by its square and by its cube.
    pub(crate) damping: [String; 3],
    /// Of a force by the position, by its square and by its cube.
    pub(crate) stiffness: [String; 3],
}

impl JointSizes {
    /// The smallest and the largest displacement at which a spring is seen to yield; none where the one is near the other. The one is a part
    /// of what passes between rows: below it is dry friction. The other is near the reach, and a radian of a joint that turns: no bearing is
    /// wound up so far before it slides.
    pub(crate) fn yields(&self) -> Option<[f64; 2]> {
        let least = (SLOW * self.speed * self.step_s).clamp(1e-4 * self.reach, 0.03 * self.reach);
        let most = (2.0 * self.reach).min(if self.turns { 1.0 } else { f64::INFINITY });
        (least <= 0.5 * most).then_some([least, most])
    }

    /// The largest number of periods a turn that rows can show: of two rows a period where the joint is slow. None where they show none.
    pub(crate) fn periods(&self) -> Option<f64> {
        let most = (PI / (SLOW * self.speed * self.step_s)).min(MOST_PERIODS).floor();
        (self.turns && most >= 1.0).then_some(most)
    }

    /// Whether the joint turns so often that no spring can hold it.
    pub(crate) fn unheld(&self) -> bool {
        self.units.position == "rad" && self.range[1] - self.range[0] > TURNS_OF_A_SPRING * TAU
    }
}

/// Which mechanisms make sense for a joint.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct JointHas {
    /// The force of its drive is known.
    pub(crate) drive: bool,
    /// It follows the command of a position, so that there can be play between the two.
    pub(crate) follows: bool,
    /// Where a spring that yields can be followed: the smallest and the largest displacement at which it does.
    pub(crate) yields: Option<[f64; 2]>,
    /// All accelerations can be made smaller by one factor.
    pub(crate) inertia: bool,
}

/// Takes mechanisms down: of one joint, one input or one output.
pub(crate) trait Declares<E> {
    /// Whether a mechanism is to be tried.
    fn wants(&self, kind: &str) -> bool;

    /// A shared parameter: what it is, its name, unit, where it is off, its bounds and its scale.
    fn parameter(
        &mut self,
        effect: E,
        name: &str,
        unit: &str,
        off: f64,
        bounds: [f64; 2],
        scale: f64,
    ) -> ParameterRef;

    /// A mechanism with its parameters; its name, what it is, its equation and its source; what it is easily confused with.
    fn mechanism(
        &mut self,
        kind: &str,
        parameters: &[ParameterRef],
        text: [&str; 4],
        confused: &[&str],
    ) -> &mut Mechanism;
}

/// Non-negative numbers.
const POSITIVE: [f64; 2] = [0.0, f64::INFINITY];
const ARMSTRONG: &str =
    "Armstrong-Helouvry, Dupont and Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7";
const TEXTBOOK: &str = "textbook mechanics";
/// Source of what drives and sensors do.
pub(crate) const CONTROL: &str = "Astrom and Murray, Feedback Systems, 2nd ed. 2021";
