//! The hand on an arm over a table with an object.

use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::DepthCamera;
use hw_traits::clock::Stamped;
use hw_traits::gripper::Gripper;
use hw_traits::picture::{Intrinsics, NotRows, Picture};
use hw_traits::{Error, ErrorKind, ErrorType};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::camera::DepthEye;
use super::membrane::{Membrane, Sheet};
use super::object::Shape;

/// What the rig refuses.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FakeError {
    /// A width, speed, pose or deadline out of range.
    #[error("{what} is {got}: out of range")]
    OutOfRange {
        /// Which.
        what: &'static str,
        /// What it is.
        got: f64,
    },
    /// The camera has no pixels.
    #[error(transparent)]
    Picture(#[from] NotRows),
}

impl Error for FakeError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::OutOfRange { .. } => ErrorKind::OutOfRange,
            Self::Picture(_) => ErrorKind::Other,
        }
    }
}

/// How an object gives way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filling {
    /// Not at all.
    Rigid,
    /// Its top sinks by the force over a stiffness, N/m.
    Springy(f64),
    /// Dough, where the shape is a [`super::Lump`]: moved over under more than the first force (N) it becomes rounder, pressed with
    /// more than the second flatter, until its breadth bears it.
    Dough(f64, f64),
}

/// Hand, arm and object. The tool's frame is the membrane's: its origin in the middle, z up, towards the camera. Commands are carried
/// out at once.
#[derive(Debug, Clone)]
pub struct Rig {
    /// The sheet.
    pub sheet: Sheet,
    /// The camera, looking down on the sheet.
    pub eye: DepthEye,
    /// The object's shape.
    pub shape: Shape,
    /// Place of the object's highest point in the base frame, m.
    pub top_m: [f64; 3],
    /// How it gives way.
    pub filling: Filling,
    /// Force on the object, N: what a force sensor under it would read.
    pub force_n: f64,
    tool: Pose,
    width_m: f64,
    t_s: f64,
    rng: ChaCha8Rng,
    /// The last answer and what it answered.
    solved: Option<(Question, Membrane)>,
}

/// What the membrane depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Question {
    sheet: Sheet,
    shape: Shape,
    filling: Filling,
    place_m: [f64; 3],
    width_m: f64,
}

impl Rig {
    /// A hand 50 mm above an object at the origin.
    pub fn new(shape: Shape, filling: Filling, seed: u64) -> Self {
        let sheet = Sheet::matl_2021();
        Self {
            sheet,
            eye: DepthEye::sr305(),
            shape,
            top_m: [0.0; 3],
            filling,
            force_n: 0.0,
            tool: Pose { position_m: [0.0, 0.0, 0.05], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] },
            width_m: sheet.length_m,
            t_s: 0.0,
            rng: ChaCha8Rng::seed_from_u64(seed),
            solved: None,
        }
    }

    /// The membrane as it is now, pressed onto the object.
    pub fn membrane(&mut self) -> Membrane {
        let at = self.tool.position_m;
        let place_m = [self.top_m[0] - at[0], self.top_m[1] - at[1], self.top_m[2] - at[2]];
        let question = Question {
            sheet: self.sheet,
            shape: self.shape,
            filling: self.filling,
            place_m,
            width_m: self.width_m,
        };
        if let Some((_, membrane)) = self.solved.as_ref().filter(|(q, _)| *q == question) {
            return membrane.clone();
        }
        let membrane = self.solve(place_m);
        self.solved = Some((question, membrane.clone()));
        membrane
    }

    /// What the membrane does to dough while the hand moves sideways by a way (m).
    fn knead(&mut self, way_m: f64) {
        let (Filling::Dough(rolls_n, flattens_n), Shape::Lump(start)) = (self.filling, self.shape) else {
            return;
        };
        self.membrane();
        let mut lump = start.rolled(way_m, self.force_n / rolls_n);
        // Flatter until the breadth bears the force; the top is where the table lets it be.
        for _ in 0..100 {
            self.top_m[2] += lump.height_m() - self.lump_height_m();
            self.shape = Shape::Lump(lump);
            self.membrane();
            if self.force_n <= flattens_n * (lump.half_m() / start.half_m()).powi(2) {
                break;
            }
            lump = lump.pressed();
        }
    }

    fn lump_height_m(&self) -> f64 {
        if let Shape::Lump(lump) = self.shape { lump.height_m() } else { 0.0 }
    }

    fn solve(&mut self, [x, y, wanted]: [f64; 3]) -> Membrane {
        let place = [x, y];
        let mut membrane = Membrane::new(self.sheet, self.width_m - self.sheet.length_m);
        self.force_n = 0.0;
        if wanted <= 0.0 {
            return membrane;
        }
        membrane.press(&self.shape, place, wanted);
        if let Filling::Springy(stiffness) = self.filling {
            // Sunk so far that the spring holds what the membrane pushes: bisection, the push falls as the top sinks.
            let (mut low, mut high) = (0.0, wanted);
            for _ in 0..10 {
                let sunk = 0.5 * (low + high);
                membrane.press(&self.shape, place, wanted - sunk);
                if membrane.force_n > stiffness * sunk { low = sunk } else { high = sunk }
            }
        }
        self.force_n = membrane.force_n;
        membrane
    }
}

impl ErrorType for Rig {
    type Error = FakeError;
}

impl DepthCamera for Rig {
    fn intrinsics(&self) -> Intrinsics {
        self.eye.intrinsics
    }

    fn depth_m(&mut self) -> Result<Stamped<Picture<f32>>, FakeError> {
        self.t_s += 1.0 / 30.0;
        let membrane = self.membrane();
        Ok(Stamped { t_s: self.t_s, value: self.eye.picture(&membrane, &mut self.rng)? })
    }
}

impl Gripper for Rig {
    fn limits_m(&self) -> (f64, f64) {
        (self.sheet.length_m, self.sheet.length_m + 0.08)
    }

    fn open_to(&mut self, width_m: f64, speed_m_s: f64) -> Result<(), FakeError> {
        let (low, high) = self.limits_m();
        if !(width_m >= low - 1e-9 && width_m <= high + 1e-9) {
            return Err(FakeError::OutOfRange { what: "the width", got: width_m });
        }
        if !(speed_m_s > 0.0) {
            return Err(FakeError::OutOfRange { what: "the speed", got: speed_m_s });
        }
        self.width_m = width_m.clamp(low, high);
        Ok(())
    }

    fn width_m(&mut self) -> Result<Stamped<f64>, FakeError> {
        Ok(Stamped { t_s: self.t_s, value: self.width_m })
    }

    fn settled(&mut self) -> Result<bool, FakeError> {
        Ok(true)
    }
}

impl Arm for Rig {
    fn move_to(&mut self, tool_in_base: Pose, deadline_s: f64) -> Result<(), FakeError> {
        let far =
            tool_in_base.position_m.iter().fold(0.0, |a: f64, x| if x.abs() <= a { a } else { x.abs() });
        if !(far <= 1.0) {
            return Err(FakeError::OutOfRange { what: "the pose's distance", got: far });
        }
        // The hand stays level: the camera looks straight down.
        let level = tool_in_base.rotation_xyzw[3].abs();
        if !((level - 1.0).abs() < 1e-6) {
            return Err(FakeError::OutOfRange { what: "the pose's rotation", got: level });
        }
        if !(deadline_s > 0.0) {
            return Err(FakeError::OutOfRange { what: "the deadline", got: deadline_s });
        }
        let before = std::mem::replace(&mut self.tool, tool_in_base).position_m;
        let [x, y, _] = tool_in_base.position_m;
        self.knead((x - before[0]).hypot(y - before[1]));
        Ok(())
    }

    fn pose(&mut self) -> Result<Stamped<Pose>, FakeError> {
        Ok(Stamped { t_s: self.t_s, value: self.tool })
    }

    fn settled(&mut self) -> Result<bool, FakeError> {
        Ok(true)
    }
}
