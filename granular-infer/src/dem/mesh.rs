//! Triangle meshes as walls.

use std::collections::BTreeMap;
use std::sync::Arc;

use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;

use super::vector::{V3, dot, sub};

/// Vertices nearer than this share of the mesh's extent are one: STL gives every triangle vertices of its own.
const WELD: f64 = 1e-7;

/// A mesh that grains cannot be poured on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// There is no triangle.
    #[error("the mesh has no triangle with an area")]
    Empty,
    /// A vertex is not a number.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// Its index.
        vertex: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex} of {count}")]
    Index {
        /// Which triangle.
        triangle: usize,
        /// Which vertex.
        vertex: usize,
        /// How many there are.
        count: usize,
    },
    /// The mesh has more or fewer openings than it should: grains would fall out, or not get in.
    #[error(
        "the mesh has {found} openings, expected {expected}; the smallest, {width_m:.2e} m wide, is at {at_m:?} m"
    )]
    Openings {
        /// Openings that were announced.
        expected: usize,
        /// Closed lines of edges that belong to one triangle only.
        found: usize,
        /// Centre of the smallest, m.
        at_m: [f64; 3],
        /// Its largest extent, m.
        width_m: f64,
    },
    /// Bytes that are no STL file.
    #[error("no STL file: {reason}")]
    Stl {
        /// In words.
        reason: String,
    },
}

/// A checked triangle mesh; clones share it.
#[derive(Debug, Clone)]
pub struct Mesh {
    shape: Arc<TriMesh>,
}

impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.shape, &other.shape)
            || (self.shape.vertices() == other.shape.vertices()
                && self.shape.indices() == other.shape.indices())
    }
}

impl Mesh {
    /// A mesh of vertices (m) and triangles with a known number of openings: 0 for a closed body, 1 for a bowl, 2 for a funnel.
    /// Triangles without area are dropped; which way triangles face does not matter.
    ///
    /// # Errors
    /// [`MeshError`].
    pub fn new(
        vertices_m: &[[f64; 3]],
        triangles: &[[usize; 3]],
        openings: usize,
    ) -> Result<Self, MeshError> {
        if let Some(vertex) = vertices_m.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
            return Err(MeshError::NotFinite { vertex });
        }
        let count = vertices_m.len();
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|v| **v >= count) {
                return Err(MeshError::Index { triangle, vertex, count });
            }
        }
        let (vertices, names) = weld(vertices_m);
        let indices: Vec<[u32; 3]> = triangles
            .iter()
            .map(|t| t.map(|v| names[v]))
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect();
        let holes = openings_of(&vertices, &indices);
        if holes.len() != openings {
            let smallest = holes.iter().min_by(|a, b| a.1.total_cmp(&b.1)).copied();
            let (at_m, width_m) = smallest.unwrap_or(([f64::NAN; 3], f64::NAN));
            return Err(MeshError::Openings { expected: openings, found: holes.len(), at_m, width_m });
        }
        let vectors = vertices.iter().map(|v| Vector::new(v[0], v[1], v[2])).collect();
        let shape = TriMesh::new(vectors, indices).map_err(|_| MeshError::Empty)?;
        Ok(Self { shape: Arc::new(shape) })
    }

    /// A mesh from the bytes of an STL file (ASCII or binary), its numbers times `unit_m`.
    ///
    /// # Errors
    /// [`MeshError`].
    pub fn from_stl(bytes: &[u8], unit_m: f64, openings: usize) -> Result<Self, MeshError> {
        let stl = stl_io::read_stl(&mut std::io::Cursor::new(bytes))
            .map_err(|e| MeshError::Stl { reason: e.to_string().replace('\n', " ") })?;
        let vertices: Vec<[f64; 3]> =
            stl.vertices.iter().map(|v| [v[0], v[1], v[2]].map(|c| f64::from(c) * unit_m)).collect();
        let triangles: Vec<[usize; 3]> = stl.faces.iter().map(|f| f.vertices).collect();
        Self::new(&vertices, &triangles, openings)
    }

    /// The surface that a profile of (radius, height) in m makes when it is turned about the vertical, of `segments` (at least 3)
    /// flat pieces around. Its openings are the ends of the profile that are off the axis: a bowl begins at radius 0.
    ///
    /// # Errors
    /// [`MeshError`].
    pub fn turned(profile_m: &[[f64; 2]], segments: usize) -> Result<Self, MeshError> {
        let n = segments.max(3);
        let mut vertices = Vec::with_capacity(n * profile_m.len());
        for [radius, height] in profile_m {
            for k in 0..n {
                let (sine, cosine) = (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
                vertices.push([radius * cosine, radius * sine, *height]);
            }
        }
        let mut triangles = Vec::new();
        for ring in 1..profile_m.len() {
            for k in 0..n {
                let (a, b) = ((ring - 1) * n + k, (ring - 1) * n + (k + 1) % n);
                triangles.push([a, b, b + n]);
                triangles.push([a, b + n, a + n]);
            }
        }
        let open = |end: Option<&[f64; 2]>| usize::from(end.is_some_and(|p| p[0] > 0.0));
        Self::new(&vertices, &triangles, open(profile_m.first()) + open(profile_m.last()))
    }

    /// Distance and unit vector from the nearest point of the mesh, if that is nearer than `most`.
    pub(crate) fn nearest(&self, point: V3, most: f64) -> Option<(f64, V3)> {
        let at = Vector::new(point[0], point[1], point[2]);
        let found = self.shape.project_local_point_with_max_dist(at, false, most)?.point;
        let apart = sub(point, [found.x, found.y, found.z]);
        let distance = dot(apart, apart).sqrt();
        (distance > 0.0).then(|| (distance, apart.map(|c| c / distance)))
    }
}

/// Vertices without doubles, and the new index of each old one.
fn weld(vertices: &[V3]) -> (Vec<V3>, Vec<u32>) {
    let largest = vertices.iter().flatten().fold(0.0, |a: f64, c| a.max(c.abs()));
    let step = (WELD * largest).max(f64::MIN_POSITIVE);
    let mut known = BTreeMap::new();
    let mut out = Vec::new();
    let names = vertices
        .iter()
        .map(|v| {
            *known.entry(v.map(|c| (c / step).round() as i64)).or_insert_with(|| {
                out.push(*v);
                (out.len() - 1) as u32
            })
        })
        .collect();
    (out, names)
}

/// Centre and largest extent of each closed line of edges that belong to one triangle only; lines that meet in a vertex count
/// one by one, with the extent of all.
fn openings_of(vertices: &[V3], triangles: &[[u32; 3]]) -> Vec<(V3, f64)> {
    let mut edges: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    for &[a, b, c] in triangles {
        for [i, j] in [[a, b], [b, c], [c, a]] {
            *edges.entry([i.min(j), i.max(j)]).or_default() += 1;
        }
    }
    let mut beside: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for ([i, j], _) in edges.into_iter().filter(|e| e.1 == 1) {
        beside.entry(i).or_default().push(j);
        beside.entry(j).or_default().push(i);
    }
    let mut holes = Vec::new();
    while let Some((&first, _)) = beside.first_key_value() {
        let (mut line, mut ends) = (Vec::new(), 0);
        let mut next = vec![first];
        while let Some(v) = next.pop() {
            if let Some(others) = beside.remove(&v) {
                line.push(vertices[v as usize]);
                ends += others.len();
                next.extend(others);
            }
        }
        // Edges less vertices, and one: how many loops there are in the line.
        let loops = (ends / 2 + 1).saturating_sub(line.len());
        let range = |axis: usize| {
            line.iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |r, v| [r[0].min(v[axis]), r[1].max(v[axis])])
        };
        let ranges = [range(0), range(1), range(2)];
        let width = ranges.iter().fold(0.0, |a: f64, r| a.max(r[1] - r[0]));
        holes.extend(std::iter::repeat_n((ranges.map(|r| 0.5 * (r[0] + r[1])), width), loops));
    }
    holes
}
