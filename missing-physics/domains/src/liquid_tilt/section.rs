//! A container cut along its tilt, and the part of it below a level.

use liquid_haptics::container::mesh::MeshContainer;

use super::setup::Vessel;

/// A closed line in the container's frame, x and z, m.
pub(super) type Outline = Vec<[f64; 2]>;

/// An edge of a triangle, by its vertices.
type Edge = (u32, u32);

/// The inside of a wall of some thickness (m), cut in the plane in which the container is tilted.
pub(super) fn section(vessel: &Vessel, wall_m: f64) -> Vec<Outline> {
    match vessel {
        Vessel::Cylinder { radius_m, length_m } => {
            let (r, low, high) = (radius_m - wall_m, wall_m, length_m - wall_m);
            vec![vec![[-r, low], [r, low], [r, high], [-r, high]]]
        }
        Vessel::Mesh(mesh) if wall_m > 0.0 => mesh.with_wall(wall_m).map(|m| cut(&m)).unwrap_or_default(),
        Vessel::Mesh(mesh) => cut(mesh),
    }
}

/// The lines along which a mesh meets the plane in its middle.
fn cut(mesh: &MeshContainer) -> Vec<Outline> {
    /// Off the middle by a part of the width, where no vertex is likely to lie.
    const ASIDE: f64 = 1.7e-6;
    let (low, high) = mesh.bounds();
    let middle = 0.5 * (low.y + high.y) + ASIDE * (high.y - low.y);
    // Each triangle that is cut leads from one of its edges to another, all in one sense.
    let mut next: Vec<(Edge, Edge, [f64; 2])> = Vec::new();
    for &[a, b, c] in mesh.triangles() {
        let at = |i: u32| mesh.vertices()[i as usize];
        let crossing = |(i, j): Edge| {
            let (p, q) = (at(i), at(j));
            let share = (middle - p.y) / (q.y - p.y);
            [p.x + share * (q.x - p.x), p.z + share * (q.z - p.z)]
        };
        let above = |i: u32| at(i).y > middle;
        let edges = [(a, b), (b, c), (c, a)];
        let enters = edges.into_iter().find(|&(i, j)| !above(i) && above(j));
        let leaves = edges.into_iter().find(|&(i, j)| above(i) && !above(j));
        if let (Some(enters), Some((i, j))) = (enters, leaves) {
            next.push((enters, (j, i), crossing(enters)));
        }
    }
    let mut outlines = Vec::new();
    while let Some((from, mut to, place)) = next.pop() {
        let mut outline = vec![place];
        while to != from {
            let Some(at) = next.iter().position(|(enters, ..)| *enters == to) else { break };
            let (_, leads, place) = next.swap_remove(at);
            outline.push(place);
            to = leads;
        }
        outlines.push(outline);
    }
    outlines
}

/// The part of an outline below a height along `up` (both m, in its frame), and the ends of the surface there.
pub(super) fn below(outline: &Outline, up: [f64; 2], height_m: f64) -> (Outline, Outline) {
    let depth = |p: &[f64; 2]| height_m - (up[0] * p[0] + up[1] * p[1]);
    let (mut wet, mut surface) = (Vec::new(), Vec::new());
    for (i, p) in outline.iter().enumerate() {
        let q = &outline[(i + 1) % outline.len()];
        let (here, there) = (depth(p), depth(q));
        if here >= 0.0 {
            wet.push(*p);
        }
        if (here >= 0.0) != (there >= 0.0) {
            let share = here / (here - there);
            let crossing = [0, 1].map(|k| p[k] + share * (q[k] - p[k]));
            wet.push(crossing);
            surface.push(crossing);
        }
    }
    let along = |p: &[f64; 2]| up[1] * p[0] - up[0] * p[1];
    surface.sort_by(|a, b| along(a).total_cmp(&along(b)));
    // From one end to the other, a gap between two cavities broken by what is no number.
    let ends = surface.chunks_exact(2).flat_map(|pair| [pair[0], pair[1], [f64::NAN; 2]]);
    (wet, ends.collect())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use nalgebra::Point3;

    use super::*;

    fn area(outline: &Outline) -> f64 {
        let turned = (0..outline.len()).map(|i| {
            let ([a, b], [c, d]) = (outline[i], outline[(i + 1) % outline.len()]);
            0.5 * (a * d - b * c)
        });
        turned.sum::<f64>().abs()
    }

    /// A box as a mesh: cut it is a rectangle, on its side and half full it is half wet, its surface as wide as it is tall.
    #[test]
    fn a_box_on_its_side_is_half_wet() {
        let corner = |k: u32| {
            let bit = |b: u32| f64::from(k >> b & 1);
            Point3::new(0.2 * bit(0) - 0.1, 0.2 * bit(1) - 0.1, 0.4 * bit(2))
        };
        let quads: [[u32; 4]; 6] =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mesh = MeshContainer::new((0..8).map(corner).collect(), triangles).unwrap();
        let outlines = section(&Vessel::Mesh(std::sync::Arc::new(mesh)), 0.0);
        assert_eq!(outlines.len(), 1, "{outlines:?}");
        assert!((area(&outlines[0]) - 0.08).abs() < 1e-9, "{outlines:?}");
        let (wet, surface) = below(&outlines[0], [-1.0, 0.0], 0.0);
        assert!((area(&wet) - 0.04).abs() < 1e-9, "{wet:?}");
        assert!(((surface[1][1] - surface[0][1]).abs() - 0.4).abs() < 1e-9, "{surface:?}");
    }
}
