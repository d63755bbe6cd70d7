//! A cavity of any shape, as a closed triangle mesh (feature `mesh`, on by default).
//!
//! Several cavities and concave ones are fine. The liquid is where the cavity is below one level: air that would be trapped under
//! a ledge, and liquid that could not flow from one part of the cavity to another, are not modelled.

mod check;
mod cut;
mod error;
mod leaf;
mod plan;
mod planned;
mod read;
mod sums;

pub use error::MeshError;
pub use plan::MeshPlan;
pub use planned::PlannedMesh;

use nalgebra::{Isometry3, Matrix3, Point3, UnitVector3, Vector3};

use super::{Container, ContainerError, Fill};

/// A closed, outward-oriented triangle mesh, the surface of a cavity.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshContainer {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    capacity_m3: f64,
}

impl MeshContainer {
    /// A mesh from its vertices (m, container's frame) and triangles (indices, counter-clockwise from outside).
    ///
    /// # Errors
    /// [`MeshError`]: no triangles, an index without a vertex, a coordinate that is no number, an edge that is not shared by two
    /// triangles in opposite directions, a surface that is inside out, or one that crosses itself. Each says where.
    pub fn new(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        let capacity_m3 = check::check(&vertices, &triangles)?;
        Ok(Self { vertices, triangles, capacity_m3 })
    }

    /// A mesh from the bytes of an STL file (binary or ASCII), one unit of which is `unit_m` metres, moved into the container's
    /// frame.
    ///
    /// # Errors
    /// As [`MeshContainer::new`], and [`MeshError::Parse`].
    pub fn from_stl(
        bytes: &[u8],
        unit_m: f64,
        container_from_mesh: &Isometry3<f64>,
    ) -> Result<Self, MeshError> {
        let (vertices, triangles) = read::stl(bytes)?;
        Self::placed(vertices, triangles, unit_m, container_from_mesh)
    }

    /// A mesh from the bytes of an OBJ file; all its objects together.
    ///
    /// # Errors
    /// As [`MeshContainer::from_stl`].
    pub fn from_obj(
        bytes: &[u8],
        unit_m: f64,
        container_from_mesh: &Isometry3<f64>,
    ) -> Result<Self, MeshError> {
        let (vertices, triangles) = read::obj(bytes)?;
        Self::placed(vertices, triangles, unit_m, container_from_mesh)
    }

    fn placed(
        vertices: Vec<Point3<f64>>,
        triangles: Vec<[u32; 3]>,
        unit_m: f64,
        container_from_mesh: &Isometry3<f64>,
    ) -> Result<Self, MeshError> {
        if !(unit_m > 0.0 && unit_m.is_finite()) {
            return Err(MeshError::Unit { got: unit_m });
        }
        let place = |p: Point3<f64>| container_from_mesh * Point3::from(p.coords * unit_m);
        Self::new(vertices.into_iter().map(place).collect(), triangles)
    }

    /// The vertices, m.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// The triangles, as indices of vertices.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The smallest and the largest coordinate along each axis, m.
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        let first = self.vertices.first().copied().unwrap_or_default();
        self.vertices.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)))
    }

    /// Centre of mass of a shell of even thickness on this surface, m.
    pub fn shell_center(&self) -> Point3<f64> {
        let (mut sum, mut area) = (Vector3::zeros(), 0.0);
        for [a, b, c] in self.corners() {
            let size = (b - a).cross(&(c - a)).norm();
            sum += (a.coords + b.coords + c.coords) / 3.0 * size;
            area += size;
        }
        Point3::from(sum / area)
    }

    fn corners(&self) -> impl Iterator<Item = [Point3<f64>; 3]> + '_ {
        self.triangles.iter().map(|t| t.map(|i| self.vertices[i as usize]))
    }

    /// The cavity inside walls of `wall_m` metres, where this mesh is their outer surface: every face moves inwards by the
    /// thickness.
    ///
    /// Exact where three faces meet (convex or not); where more do, each vertex moves to the point nearest to all moved
    /// faces in the sense of least squares.
    ///
    /// # Errors
    /// [`MeshError::Wall`] where the thickness is no number or turns the surface inside out; else as [`MeshContainer::new`].
    pub fn with_wall(&self, wall_m: f64) -> Result<Self, MeshError> {
        if !(wall_m >= 0.0 && wall_m.is_finite()) {
            return Err(MeshError::Wall { wall_m });
        }
        if wall_m == 0.0 {
            return Ok(self.clone());
        }
        let mut faces: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); self.vertices.len()];
        for (corners, triangle) in self.corners().zip(&self.triangles) {
            let [a, b, c] = corners;
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { continue };
            for &i in triangle {
                let list = &mut faces[i as usize];
                // Triangles of one flat face count once.
                if !list.iter().any(|n| n.dot(&normal) > 1.0 - 1e-9) {
                    list.push(normal);
                }
            }
        }
        let moved = |(vertex, normals): (&Point3<f64>, &Vec<Vector3<f64>>)| {
            let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for n in normals {
                matrix += n * n.transpose();
                right -= n * wall_m;
            }
            // Along directions that no face fixes the vertex stays.
            let inverse = matrix
                .pseudo_inverse(1e-7 * normals.len().max(1) as f64)
                .unwrap_or_else(|_| Matrix3::zeros());
            vertex + inverse * right
        };
        let vertices: Vec<Point3<f64>> = self.vertices.iter().zip(&faces).map(moved).collect();
        let inner = Self::new(vertices, self.triangles.clone()).map_err(|error| match error {
            MeshError::Inverted { .. } => MeshError::Wall { wall_m },
            other => other,
        })?;
        // A box that is moved through itself comes out right way round: no face may have turned over.
        let turned = self.corners().zip(inner.corners()).any(|(before, after)| {
            let normal = |[a, b, c]: [Point3<f64>; 3]| (b - a).cross(&(c - a));
            normal(before).dot(&normal(after)) < 0.0
        });
        if turned { Err(MeshError::Wall { wall_m }) } else { Ok(inner) }
    }

    /// All that is needed to answer questions at one tilt quickly; `up` is world's up in the container's frame.
    pub fn plan(&self, up: &UnitVector3<f64>) -> MeshPlan {
        MeshPlan::new(&self.vertices, &self.triangles, up)
    }
}

/// Builds a [`MeshPlan`] for every question; with several at one tilt, keep the plan, or use a [`PlannedMesh`].
impl Container for MeshContainer {
    fn capacity_m3(&self) -> f64 {
        self.capacity_m3
    }

    fn fill(&self, up: &UnitVector3<f64>, volume_m3: f64) -> Result<Fill, ContainerError> {
        self.plan(up).fill(volume_m3)
    }

    fn volume_below(&self, up: &UnitVector3<f64>, height_m: f64) -> Result<f64, ContainerError> {
        self.plan(up).volume_below(height_m)
    }
}
