//! Dough as a camera sees it: a cloud of points to length, width, height and highest point ([Matl 2021], section 7.4).

mod error;
mod grid;
mod ground;
pub mod rectangle;

use hw_traits::arm::Pose;
use hw_traits::picture::{Intrinsics, Picture};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

pub use self::error::DoughError;
use self::grid::Grid;
pub use self::ground::Plane;
use crate::roll::State;

/// A dough, in the frame of its cloud (z up).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Longer side of the rectangle of least area around it, m.
    pub length_m: f64,
    /// Shorter side, m.
    pub width_m: f64,
    /// Highest point above the ground, m.
    pub height_m: f64,
    /// x and y of the highest point, m.
    pub highest_m: [f64; 2],
    /// Level of the ground below it, m.
    pub ground_m: f64,
    /// Direction of the longer side, from the x axis, in (-pi/2, pi/2] rad.
    pub yaw_rad: f64,
    /// Middle of the rectangle, m.
    pub centre_m: [f64; 2],
    /// Points that show it.
    pub points: usize,
}

impl Shape {
    /// Length, width and height: what dynamics are learned of.
    pub fn state(&self) -> State {
        [self.length_m, self.width_m, self.height_m]
    }
}

impl Shape {
    /// Corners of the box around it, m.
    fn corners(&self) -> [[f64; 3]; 8] {
        let (s, c) = self.yaw_rad.sin_cos();
        let [x, y] = self.centre_m;
        std::array::from_fn(|k| {
            let side = |bit: usize| if (k >> bit) & 1 == 0 { -0.5 } else { 0.5 };
            let (a, b) = (side(0) * self.length_m, side(1) * self.width_m);
            let z = self.ground_m + (side(2) + 0.5) * self.height_m;
            [x + c * a - s * b, y + s * a + c * b, z]
        })
    }
}

/// What is known before of the workspace; the cloud's frame has its z axis up to about 5 degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// No dough is taller, m: whatever stands higher is the tool.
    pub tallest_m: f64,
    /// Points must be this far above the ground to be dough, m; and beyond three sigma of the ground's scatter.
    pub clearance_m: f64,
    /// Cells in which points are gathered, m: above the distance of neighbouring points, far below the dough's size.
    pub cell_m: f64,
    /// Points needed to speak of a dough.
    pub least_points: usize,
}

impl Default for View {
    /// 100 mm, 2 mm, 3 mm, 50 points.
    fn default() -> Self {
        Self { tallest_m: 0.1, clearance_m: 2e-3, cell_m: 3e-3, least_points: 50 }
    }
}

/// Pixels at the edge of a picture in which a dough is held to go on beyond it.
const EDGE_PX: f64 = 3.0;

impl View {
    /// The dough in a cloud (m, z up).
    ///
    /// Points that are no numbers are left out. The ground is the plane on which most points lie; dough is the largest connected
    /// thing on it, so that a tool that hangs above it, or stands elsewhere, and single flying points are left out. The height is
    /// that of a quadric through the medians of small cells around the highest one.
    ///
    /// # Errors
    /// [`DoughError`].
    pub fn find(&self, cloud: &[[f64; 3]]) -> Result<Shape, DoughError> {
        for (name, value) in
            [("tallest_m", self.tallest_m), ("clearance_m", self.clearance_m), ("cell_m", self.cell_m)]
        {
            if !(value > 0.0 && value.is_finite()) {
                return Err(DoughError::View { name, value });
            }
        }
        let plane = ground::find(cloud)?;
        let clearance = self.clearance_m.max(3.0 * plane.scatter_m);
        let mut raised: Vec<[f64; 3]> = Vec::with_capacity(cloud.len() / 4);
        raised.extend(cloud.iter().filter_map(|p| {
            let above = plane.above(p);
            (above > clearance && above < self.tallest_m).then_some([p[0], p[1], above])
        }));
        let grid = Grid::new(&raised, self.cell_m);
        let mut dough = grid.largest(&raised);
        if dough.len() < self.least_points.max(3) {
            return Err(DoughError::NoDough { points: dough.len(), least: self.least_points.max(3) });
        }
        let points = dough.len();
        let too_thin = DoughError::NoDough { points, least: self.least_points.max(3) };
        let (height_m, highest_m) = Grid::new(&dough, self.cell_m).top(&mut dough).ok_or(too_thin.clone())?;
        let mut flat: Vec<[f64; 2]> = dough.iter().map(|p| [p[0], p[1]]).collect();
        let rectangle = rectangle::around(&rectangle::hull(&mut flat)).ok_or(too_thin)?;
        Ok(Shape {
            length_m: rectangle.length_m,
            width_m: rectangle.width_m,
            height_m,
            highest_m,
            ground_m: plane.level(highest_m),
            yaw_rad: rectangle.yaw_rad,
            centre_m: rectangle.centre_m,
            points,
        })
    }

    /// The dough in a depth picture, in the world's frame.
    ///
    /// # Errors
    /// [`DoughError`].
    pub fn find_in_picture(
        &self,
        depth_m: &Picture<f32>,
        intrinsics: &Intrinsics,
        camera_in_world: &Pose,
    ) -> Result<Shape, DoughError> {
        let shape = self.find(&cloud(depth_m, intrinsics, camera_in_world)?)?;
        let world_from_camera = isometry(camera_in_world)?;
        let (width, height) = (depth_m.width() as f64, depth_m.height() as f64);
        for corner in shape.corners() {
            let seen = world_from_camera.inverse_transform_point(&corner.into());
            let inside = |v: f64, size: f64| v >= EDGE_PX && v <= size - 1.0 - EDGE_PX;
            match intrinsics.pixel(seen.coords.into()) {
                Some((u, v)) if !(inside(u, width) && inside(v, height)) => {
                    return Err(DoughError::CutOff { column: u, row: v });
                }
                _ => {}
            }
        }
        Ok(shape)
    }
}

/// The points of a depth picture in the world's frame, holes left out.
///
/// # Errors
/// [`DoughError::Pose`].
pub fn cloud(
    depth_m: &Picture<f32>,
    intrinsics: &Intrinsics,
    camera_in_world: &Pose,
) -> Result<Vec<[f64; 3]>, DoughError> {
    let world_from_camera = isometry(camera_in_world)?;
    let at = world_from_camera.translation.vector;
    let rotation = world_from_camera.rotation.to_rotation_matrix();
    let width = depth_m.width();
    let mut cloud = Vec::with_capacity(depth_m.data().len());
    for (v, row) in depth_m.data().chunks_exact(width).enumerate() {
        cloud.extend(row.iter().enumerate().filter(|(_, d)| d.is_finite() && **d > 0.0).map(|(u, d)| {
            let point = Vector3::from(intrinsics.point(u as f64, v as f64, f64::from(*d)));
            <[f64; 3]>::from(rotation * point + at)
        }));
    }
    Ok(cloud)
}

fn isometry(pose: &Pose) -> Result<Isometry3<f64>, DoughError> {
    let [x, y, z, w] = pose.rotation_xyzw;
    let q = Quaternion::new(w, x, y, z);
    let at = Vector3::from(pose.position_m);
    if !((q.norm() - 1.0).abs() < 1e-6 && at.iter().all(|v| v.is_finite())) {
        return Err(DoughError::Pose { size: q.norm() });
    }
    Ok(Isometry3::from_parts(Translation3::from(at), UnitQuaternion::new_normalize(q)))
}
