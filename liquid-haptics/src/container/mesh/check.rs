//! Is a mesh the surface of a cavity?

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};

use super::MeshError;

/// Checks a mesh and returns its volume.
pub(super) fn check(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Result<f64, MeshError> {
    if triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    if let Some(vertex) = vertices.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        return Err(MeshError::NotFinite { vertex });
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&i| i as usize >= vertices.len()) {
            return Err(MeshError::Index { triangle, vertex, vertices: vertices.len() });
        }
    }
    closed(vertices, triangles)?;
    let volume_m3 = volume(vertices, triangles);
    if !(volume_m3 > 0.0) {
        return Err(MeshError::Inverted { volume_m3 });
    }
    apart(vertices, triangles)?;
    Ok(volume_m3)
}

/// Signed volume, about the middle of the vertices.
fn volume(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> f64 {
    let middle = vertices.iter().map(|p| p.coords).sum::<Vector3<f64>>() / vertices.len() as f64;
    triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| vertices[i as usize].coords - middle);
            a.dot(&b.cross(&c)) / 6.0
        })
        .sum()
}

fn closed(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    let mut uses: HashMap<(u32, u32), usize> = HashMap::with_capacity(3 * triangles.len());
    for t in triangles {
        for k in 0..3 {
            *uses.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
        }
    }
    // In the order of the triangles, so that the same mesh gives the same complaint.
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            let count = |edge| uses.get(&edge).copied().unwrap_or(0);
            let (there, back) = (count((a, b)), count((b, a)));
            if there != 1 || back != 1 || a == b {
                let point = |i: u32| vertices[i as usize].coords.into();
                return Err(MeshError::Open { from: point(a), to: point(b), uses: there, back });
            }
        }
    }
    Ok(())
}

/// No edge of one triangle passes through another; triangles that touch are fine.
fn apart(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    let corners = |i: usize| triangles[i].map(|v| vertices[v as usize]);
    let boxes: Vec<Aabb> = (0..triangles.len())
        .map(|i| {
            let [a, b, c] = corners(i);
            let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
            let vector = |p: Point3<f64>| parry3d_f64::math::Vector::new(p.x, p.y, p.z);
            Aabb::new(vector(low), vector(high))
        })
        .collect();
    let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    for first in 0..triangles.len() {
        for second in tree.intersect_aabb(&boxes[first]).map(|i| i as usize).filter(|&i| i != first) {
            let target = corners(second);
            for k in 0..3 {
                let (from, to) = (triangles[first][k], triangles[first][(k + 1) % 3]);
                if triangles[second].contains(&from) || triangles[second].contains(&to) {
                    continue;
                }
                if let Some(at) = crossing(vertices[from as usize], vertices[to as usize], target) {
                    return Err(MeshError::SelfIntersecting { first, second, at });
                }
            }
        }
    }
    Ok(())
}

/// Where a segment passes through the inside of a triangle (Segura and Feito 2001: signs of tetrahedra).
fn crossing(p: Point3<f64>, q: Point3<f64>, [a, b, c]: [Point3<f64>; 3]) -> Option<[f64; 3]> {
    let volume = |a: Point3<f64>, b: Point3<f64>, c: Point3<f64>, d: Point3<f64>| {
        let (x, y, z) = (b - a, c - a, d - a);
        let value = x.dot(&y.cross(&z));
        // What rounding may make of four points in a plane.
        let scale = x.norm() * y.norm() * z.norm();
        if value.abs() <= 1e-12 * scale { 0.0 } else { value }
    };
    let (above, below) = (volume(a, b, c, p), volume(a, b, c, q));
    if above * below >= 0.0 {
        return None;
    }
    let sides = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
    if sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0) {
        let share = above / (above - below);
        Some((p + (q - p) * share).coords.into())
    } else {
        None
    }
}
