//! The devices of the rig.

use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::DepthCamera;
use hw_traits::clock::{Clock, Stamped};
use hw_traits::gripper::Gripper;
use hw_traits::picture::{Intrinsics, Picture};
use hw_traits::{ErrorKind, ErrorType};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::grains::{FakeGrains, Kind};
use crate::campaign::Grains;
use crate::dem::DemError;
use crate::scene::Scene;
use crate::view::View;

/// Time between two pictures, s.
const FRAME: f64 = 1.0 / 30.0;
/// Fastest that the arm moves, m/s.
const FASTEST: f64 = 0.5;
/// The arm's reach: outlet heights and distance from the camera's axis, m.
const HEIGHTS: [f64; 2] = [0.008, 0.35];
const SIDEWAYS: f64 = 0.25;

/// What a device of the rig refuses.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FakeError {
    /// A command that no such device can follow.
    #[error("{what} is {value}, expected {low} to {high}")]
    OutOfRange {
        /// What was asked for.
        what: &'static str,
        /// How much of it.
        value: f64,
        /// The lowest that is possible.
        low: f64,
        /// The highest.
        high: f64,
    },
    /// A pose that cannot be reached in time.
    #[error("{distance_m} m in {deadline_s} s is faster than {FASTEST} m/s")]
    Late {
        /// How far it is.
        distance_m: f64,
        /// The time there is.
        deadline_s: f64,
    },
    /// The grains' simulation.
    #[error(transparent)]
    Grains(#[from] DemError),
}

impl hw_traits::Error for FakeError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::OutOfRange { .. } => ErrorKind::OutOfRange,
            Self::Late { .. } => ErrorKind::Timeout,
            Self::Grains(_) => ErrorKind::Other,
        }
    }
}

/// A funnel that an [`Arm`] carries (the tool's origin is the middle of the outlet, the base is where the camera's axis meets the
/// cloth), a gate that a [`Gripper`] opens, a [`DepthCamera`] that looks straight down, and a [`Clock`]. The funnel is never in the
/// picture.
#[derive(Debug, Clone)]
pub struct FakeRig {
    grains: FakeGrains,
    view: View,
    rng: ChaCha8Rng,
    time_s: f64,
    tool_m: [f64; 3],
    target: Option<([f64; 3], f64)>,
    gate_m: f64,
}

fn within(what: &'static str, value: f64, low: f64, high: f64) -> Result<(), FakeError> {
    let inside = value >= low && value <= high;
    if inside { Ok(()) } else { Err(FakeError::OutOfRange { what, value, low, high }) }
}

impl FakeRig {
    /// A rig with an empty funnel 12 cm above the cloth.
    pub fn new(scene: Scene, kind: Kind, view: View, seed: u64) -> Self {
        Self {
            grains: FakeGrains::new(scene, kind, seed),
            view,
            rng: ChaCha8Rng::seed_from_u64(seed ^ 0x5eed),
            time_s: 0.0,
            tool_m: [0.0, 0.0, 0.12],
            target: None,
            gate_m: 0.0,
        }
    }

    /// A person closes the gate and fills the funnel, where it is.
    ///
    /// # Errors
    /// [`FakeError::Grains`] for a kind of grain outside physics.
    pub fn refill(&mut self) -> Result<(), FakeError> {
        self.gate_m = 0.0;
        Ok(self.grains.fill(self.tool_m)?)
    }

    /// How grains are seen.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Where all grains are: what no sensor knows.
    pub fn truth(&self) -> Grains {
        self.grains.grains()
    }

    /// Lets time pass while the arm follows its command.
    fn pass(&mut self, duration_s: f64) -> Result<(), FakeError> {
        let mut left = duration_s;
        while left > 0.0 {
            let Some((to, speed)) = self.target else {
                self.grains.pass(left, [0.0; 3])?;
                break;
            };
            let way: [f64; 3] = std::array::from_fn(|k| to[k] - self.tool_m[k]);
            let distance = way.iter().map(|w| w * w).sum::<f64>().sqrt();
            let span = left.min(distance / speed);
            if span < left {
                self.target = None;
            }
            if distance > 0.0 {
                let velocity = way.map(|w| w / distance * speed);
                self.grains.pass(span, velocity)?;
                self.tool_m = std::array::from_fn(|k| self.tool_m[k] + span * velocity[k]);
            }
            left -= span;
        }
        self.time_s += duration_s;
        Ok(())
    }
}

impl ErrorType for FakeRig {
    type Error = FakeError;
}

impl Clock for FakeRig {
    fn now_s(&mut self) -> Result<f64, Self::Error> {
        Ok(self.time_s)
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), Self::Error> {
        if duration_s > 0.0 { self.pass(duration_s) } else { Ok(()) }
    }
}

impl Arm for FakeRig {
    fn move_to(&mut self, tool_in_base: Pose, deadline_s: f64) -> Result<(), Self::Error> {
        let [x, y, z] = tool_in_base.position_m;
        within("height of the outlet in m", z, HEIGHTS[0], HEIGHTS[1])?;
        within("distance from the camera's axis in m", x.hypot(y), 0.0, SIDEWAYS)?;
        let [i, j, k, w] = tool_in_base.rotation_xyzw;
        // A funnel stays upright; which way it is turned about its axis does not matter.
        within("tilt of the funnel", i.hypot(j), 0.0, 1e-6)?;
        within("length of the quaternion", i.hypot(j).hypot(k).hypot(w), 1.0 - 1e-6, 1.0 + 1e-6)?;
        within("deadline in s", deadline_s, f64::MIN_POSITIVE, f64::MAX)?;
        let way: [f64; 3] = std::array::from_fn(|a| tool_in_base.position_m[a] - self.tool_m[a]);
        let distance_m = way.iter().map(|w| w * w).sum::<f64>().sqrt();
        if distance_m > FASTEST * deadline_s {
            return Err(FakeError::Late { distance_m, deadline_s });
        }
        self.target = (distance_m > 0.0).then_some((tool_in_base.position_m, distance_m / deadline_s));
        Ok(())
    }

    fn pose(&mut self) -> Result<Stamped<Pose>, Self::Error> {
        let value = Pose { position_m: self.tool_m, rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
        Ok(Stamped { t_s: self.time_s, value })
    }

    fn settled(&mut self) -> Result<bool, Self::Error> {
        Ok(self.target.is_none())
    }
}

impl Gripper for FakeRig {
    fn limits_m(&self) -> (f64, f64) {
        (0.0, 2.0 * self.grains.scene().rig.outlet_radius_m)
    }

    fn open_to(&mut self, width_m: f64, speed_m_s: f64) -> Result<(), Self::Error> {
        let (low, high) = self.limits_m();
        within("opening of the gate in m", width_m, low, high)?;
        within("speed of the gate in m/s", speed_m_s, f64::MIN_POSITIVE, f64::MAX)?;
        self.gate_m = width_m;
        // A slide: it lets go once it is open by half, and cannot be closed against the flow.
        if width_m >= 0.5 * high {
            self.grains.open()?;
        }
        Ok(())
    }

    fn width_m(&mut self) -> Result<Stamped<f64>, Self::Error> {
        Ok(Stamped { t_s: self.time_s, value: self.gate_m })
    }

    fn settled(&mut self) -> Result<bool, Self::Error> {
        Ok(true)
    }
}

impl DepthCamera for FakeRig {
    fn intrinsics(&self) -> Intrinsics {
        let camera = &self.view.camera;
        Intrinsics {
            fx: camera.focal_px[0],
            fy: camera.focal_px[1],
            cx: camera.centre_px[0],
            cy: camera.centre_px[1],
        }
    }

    fn depth_m(&mut self) -> Result<Stamped<Picture<f32>>, Self::Error> {
        self.pass(FRAME)?;
        let camera = &self.view.camera;
        let mut grains = self.grains.grains();
        // Those that are still in the funnel are hidden by it.
        let hidden: Vec<bool> = grains.positions_m.iter().map(|p| p[2] > self.tool_m[2]).collect();
        let mut keep = hidden.iter().map(|h| !h);
        grains.positions_m.retain(|_| keep.next().unwrap_or(true));
        let mut keep = hidden.iter().map(|h| !h);
        grains.radii_m.retain(|_| keep.next().unwrap_or(true));
        let counts = camera.expose(&camera.render(&grains), &self.view.flaws, &mut self.rng);
        let depth = |c: &u16| if *c == 0 { f32::NAN } else { (f64::from(*c) * camera.depth_unit_m) as f32 };
        let (width, pixels) = (camera.size_px[0], counts.len());
        let value = Picture::new(width, counts.iter().map(depth).collect()).map_err(|_| {
            FakeError::OutOfRange { what: "pixels", value: pixels as f64, low: 1.0, high: f64::MAX }
        })?;
        Ok(Stamped { t_s: self.time_s, value })
    }
}
