//! Many touches as one cloud in the world's frame (section 6.6).

use std::collections::BTreeMap;

use hw_traits::arm::Pose;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// Why a view was not taken in.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ReconstructError {
    /// The side of a cell is none.
    #[error("a cell's side is {0} m; expected a finite number above 0")]
    Cell(f64),
    /// A pose that is none.
    #[error(
        "the pose's quaternion has the norm {norm}, or its position is no number; expected norm 1 to 1e-6"
    )]
    Pose {
        /// Norm of the quaternion.
        norm: f64,
    },
    /// A point that is none, or too far away for the cells.
    #[error("point {index} is no number, or lies beyond two billion cells")]
    Point {
        /// Its index.
        index: usize,
    },
}

/// Points of many views, averaged in cells of one size.
#[derive(Debug, Clone)]
pub struct Merged {
    side_m: f64,
    cells: BTreeMap<[i32; 3], ([f64; 3], u32)>,
}

impl Merged {
    /// Nothing yet; the cells' side in m.
    ///
    /// # Errors
    /// [`ReconstructError::Cell`].
    pub fn new(side_m: f64) -> Result<Self, ReconstructError> {
        if !(side_m > 0.0 && side_m.is_finite()) {
            return Err(ReconstructError::Cell(side_m));
        }
        Ok(Self { side_m, cells: BTreeMap::new() })
    }

    /// Adds points (m) that were seen with the camera at a pose in the world. All or none are added.
    ///
    /// # Errors
    /// [`ReconstructError::Pose`], [`ReconstructError::Point`].
    pub fn add(&mut self, camera_in_world: &Pose, points_m: &[[f64; 3]]) -> Result<(), ReconstructError> {
        let world_from_camera = isometry(camera_in_world)?;
        let place = |(index, p): (usize, &[f64; 3])| {
            let w = world_from_camera.transform_point(&(*p).into());
            let cell = [w.x, w.y, w.z].map(|x| (x / self.side_m).floor());
            let fits = cell.iter().all(|c| c.abs() < f64::from(i32::MAX));
            if fits {
                Ok((cell.map(|c| c as i32), [w.x, w.y, w.z]))
            } else {
                Err(ReconstructError::Point { index })
            }
        };
        let placed: Vec<_> = points_m.iter().enumerate().map(place).collect::<Result<_, _>>()?;
        for (cell, w) in placed {
            let (sum, n) = self.cells.entry(cell).or_insert(([0.0; 3], 0));
            sum.iter_mut().zip(w).for_each(|(s, x)| *s += x);
            *n = n.saturating_add(1);
        }
        Ok(())
    }

    /// Means of the cells that hold at least `least` points, m in the world, in a fixed order.
    pub fn points(&self, least: u32) -> Vec<[f64; 3]> {
        let cells = self.cells.values().filter(|(_, n)| *n >= least.max(1));
        cells.map(|(sum, n)| sum.map(|s| s / f64::from(*n))).collect()
    }
}

/// A pose as a transformation.
fn isometry(pose: &Pose) -> Result<Isometry3<f64>, ReconstructError> {
    let [x, y, z, w] = pose.rotation_xyzw;
    let q = Quaternion::new(w, x, y, z);
    let norm = q.norm();
    if !((norm - 1.0).abs() < 1e-6 && pose.position_m.iter().all(|x| x.is_finite())) {
        return Err(ReconstructError::Pose { norm });
    }
    let at = Vector3::from(pose.position_m);
    Ok(Isometry3::from_parts(Translation3::from(at), UnitQuaternion::from_quaternion(q)))
}
