//! How a rig rolls a dough ([Matl 2021], section 7.4).

use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::DepthCamera;
use hw_traits::clock::Clock;
use hw_traits::gripper::Gripper;
use hw_traits::{Error, ErrorKind};

use crate::dough::{DoughError, Shape, View};
use crate::roll::Action;

/// A roll of five dimensions: the band is lowered at a place, moved back and forth along x, and lifted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Length of the band: the gripper's throw, m.
    pub throw_m: f64,
    /// Distance of the roll, m: half of it to either side.
    pub distance_m: f64,
    /// Where the band begins and ends, m; z is the level of the fingers.
    pub position_m: [f64; 3],
}

/// To which side a roll goes first; drawn anew each time, for symmetry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Along x.
    Plus,
    /// Against x.
    Minus,
}

impl Side {
    /// Either with the same chance.
    pub fn draw(rng: &mut impl rand::Rng) -> Self {
        if rng.next_u32() & 1 == 0 { Self::Plus } else { Self::Minus }
    }
}

impl Motion {
    /// The roll of two dimensions (throw, depth): it begins at the highest point, and goes as far as the band is long.
    pub fn constrained(shape: &Shape, [throw_m, depth_m]: Action) -> Self {
        let [x, y] = shape.highest_m;
        let z = shape.ground_m + (shape.height_m - depth_m).max(0.0);
        Self { throw_m, distance_m: throw_m, position_m: [x, y, z] }
    }

    /// The positions in their order: begin, one side, the other, begin.
    pub fn positions_m(&self, side: Side) -> [[f64; 3]; 4] {
        let [x, y, z] = self.position_m;
        let half = match side {
            Side::Plus => 0.5 * self.distance_m,
            Side::Minus => -0.5 * self.distance_m,
        };
        [[x, y, z], [x + half, y, z], [x - half, y, z], [x, y, z]]
    }
}

/// How a rig moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Handling {
    /// The tool's rotation in the base frame, a unit quaternion x, y, z, w: fingers down, apart along x.
    pub rotation_xyzw: [f64; 4],
    /// Speed of a roll, m/s; all rolls have the same.
    pub roll_m_s: f64,
    /// Speed through the air and of the fingers, m/s.
    pub free_m_s: f64,
    /// How far above the ground the tool is free, m.
    pub clear_m: f64,
    /// Where the tool waits while the camera looks, m.
    pub rest_m: [f64; 3],
    /// The longest time to wait beyond a move's own, s.
    pub patience_s: f64,
}

impl Default for Handling {
    /// Fingers down, 0.1 and 0.3 m/s, 0.12 m of clearance, at rest at (0.25, 0, 0.2).
    fn default() -> Self {
        Self {
            rotation_xyzw: [1.0, 0.0, 0.0, 0.0],
            roll_m_s: 0.1,
            free_m_s: 0.3,
            clear_m: 0.12,
            rest_m: [0.25, 0.0, 0.2],
            patience_s: 5.0,
        }
    }
}

/// Where a rig failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RigError {
    /// The device did.
    #[error("while {doing}: {kind}")]
    Device {
        /// What was being done.
        doing: &'static str,
        /// What went wrong.
        kind: ErrorKind,
    },
    /// The picture shows no dough.
    #[error(transparent)]
    Dough(#[from] DoughError),
}

/// A device's error as one of the rig's.
pub(crate) fn device<E: Error>(doing: &'static str) -> impl Fn(E) -> RigError {
    move |e| RigError::Device { doing, kind: e.kind() }
}

impl Handling {
    /// Moves the tool straight to a place and waits until it stands.
    ///
    /// # Errors
    /// [`RigError::Device`]; of the kind `Timeout` where it is not there within the patience.
    pub fn go<R: Arm + Clock>(&self, rig: &mut R, to_m: [f64; 3], speed_m_s: f64) -> Result<(), RigError> {
        let doing = "moving the arm";
        let from = rig.pose().map_err(device(doing))?.value.position_m;
        let far = (0..3).map(|k| (to_m[k] - from[k]).powi(2)).sum::<f64>().sqrt();
        let takes_s = (far / speed_m_s).max(0.02);
        let pose = Pose { position_m: to_m, rotation_xyzw: self.rotation_xyzw };
        rig.move_to(pose, takes_s).map_err(device(doing))?;
        self.wait(rig, doing, takes_s, |rig| Arm::settled(rig).map_err(device(doing)))
    }

    /// Opens the fingers to a throw and waits until they stand.
    ///
    /// # Errors
    /// As [`Self::go`].
    pub fn stretch<R: Gripper + Clock>(&self, rig: &mut R, throw_m: f64) -> Result<(), RigError> {
        let doing = "opening the gripper";
        let from = rig.width_m().map_err(device(doing))?.value;
        rig.open_to(throw_m, self.free_m_s).map_err(device(doing))?;
        let takes_s = (throw_m - from).abs() / self.free_m_s;
        self.wait(rig, doing, takes_s, |rig| Gripper::settled(rig).map_err(device(doing)))
    }

    fn wait<R: Clock>(
        &self,
        rig: &mut R,
        doing: &'static str,
        takes_s: f64,
        settled: impl Fn(&mut R) -> Result<bool, RigError>,
    ) -> Result<(), RigError> {
        let begin = rig.now_s().map_err(device(doing))?;
        rig.sleep_s(takes_s).map_err(device(doing))?;
        while !settled(rig)? {
            if rig.now_s().map_err(device(doing))? - begin > takes_s + self.patience_s {
                return Err(RigError::Device { doing, kind: ErrorKind::Timeout });
            }
            rig.sleep_s(0.01).map_err(device(doing))?;
        }
        Ok(())
    }

    /// Goes above a place, carries out positions at the speed of a roll, lifts the tool and goes to rest.
    ///
    /// # Errors
    /// As [`Self::go`]; the tool then stands where it failed.
    pub fn touch<R: Arm + Clock>(
        &self,
        rig: &mut R,
        ground_m: f64,
        positions_m: &[[f64; 3]],
    ) -> Result<(), RigError> {
        let (Some(first), Some(last)) = (positions_m.first(), positions_m.last()) else { return Ok(()) };
        let above = |p: &[f64; 3]| [p[0], p[1], ground_m + self.clear_m];
        self.go(rig, above(first), self.free_m_s)?;
        for &position in positions_m {
            self.go(rig, position, self.roll_m_s)?;
        }
        self.go(rig, above(last), self.free_m_s)?;
        self.go(rig, self.rest_m, self.free_m_s)
    }

    /// Rolls: stretches the band, lowers it, moves back and forth, lifts it, and goes to rest.
    ///
    /// # Errors
    /// As [`Self::go`].
    pub fn roll<R: Arm + Gripper + Clock>(
        &self,
        rig: &mut R,
        ground_m: f64,
        motion: &Motion,
        side: Side,
    ) -> Result<(), RigError> {
        self.stretch(rig, motion.throw_m)?;
        self.touch(rig, ground_m, &motion.positions_m(side))
    }
}

/// Looks at the dough: one picture.
///
/// # Errors
/// [`RigError`].
pub fn look<R: DepthCamera>(rig: &mut R, view: &View, camera_in_world: &Pose) -> Result<Shape, RigError> {
    let intrinsics = rig.intrinsics();
    let picture = rig.depth_m().map_err(device("taking a picture"))?.value;
    Ok(view.find_in_picture(&picture, &intrinsics, camera_in_world)?)
}
