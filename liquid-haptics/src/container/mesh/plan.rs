//! Volume and first moments below a level, for one direction of up, without clipping the mesh.
//!
//! Between two neighbouring vertex heights the area of the level cut is quadratic in the height, its first moments cubic: sums over
//! the segments in which triangles cross the level (`cut`). The heights are cut into intervals (leaves), and blocks of them. Where
//! a triangle begins and ends within a block its segment's polynomial is added and taken away again, to be summed along the block;
//! the blocks that it crosses get it by the O(log n) nodes of a binary tree that cover them, whose sums are handed down.
//!
//! A polynomial far outside its triangle's range is as large as the triangle is level, and what is taken away again leaves the
//! rounding of that. A triangle whose segment would run far out of the mesh within the block is added to each of its leaves.

use nalgebra::{Point3, UnitVector3, Vector3};

use super::cut::Edge;
use super::leaf::Leaf;
use super::sums::Sums;
use crate::container::{ContainerError, Fill};

/// A segment may run out of the mesh by this many times its size within a block.
const FAR: f64 = 8.0;

/// A mesh seen along one direction: answers in O(log n), after O(n log n).
#[derive(Debug, Clone)]
pub struct MeshPlan {
    reference: Point3<f64>,
    up: Vector3<f64>,
    across: [Vector3<f64>; 2],
    /// Distinct vertex heights above the reference, rising.
    heights: Vec<f64>,
    leaves: Vec<Leaf>,
    /// Everything.
    whole: [f64; 4],
    lowest: Point3<f64>,
}

impl MeshPlan {
    pub(super) fn new(vertices: &[Point3<f64>], triangles: &[[u32; 3]], up: &UnitVector3<f64>) -> Self {
        let count = vertices.len().max(1) as f64;
        let reference = Point3::from(vertices.iter().map(|p| p.coords).sum::<Vector3<f64>>() / count);
        let up = up.into_inner();
        // The axis that up leans on least gives the first direction across.
        let helper = Vector3::ith(up.iamin(), 1.0);
        let first = up.cross(&helper).normalize();
        let across = [first, up.cross(&first)];
        let local: Vec<[f64; 3]> = vertices
            .iter()
            .map(|p| {
                let r = p - reference;
                [r.dot(&across[0]), r.dot(&across[1]), r.dot(&up)]
            })
            .collect();
        let mut order: Vec<(f64, u32)> = (0..).zip(&local).map(|(i, p)| (p[2], i)).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let lowest = order.first().map_or(0, |(_, i)| *i as usize);
        let ends = [order.first(), order.last()].map(|end| end.map_or(0.0, |(h, _)| h.abs()));
        // Heights that differ by rounding alone are one.
        let same = 4e-16 * ends[0].max(ends[1]);
        let (mut heights, mut rank) = (Vec::<f64>::with_capacity(order.len()), vec![0; local.len()]);
        for (height, vertex) in order {
            if heights.last().is_none_or(|kept| height - kept > same) {
                heights.push(height);
            }
            rank[vertex as usize] = heights.len() - 1;
        }
        let mut plan = Self {
            reference,
            up,
            across,
            leaves: vec![Leaf::default(); heights.len().saturating_sub(1)],
            heights,
            whole: [0.0; 4],
            lowest: vertices.get(lowest).copied().unwrap_or_default(),
        };
        plan.cut(&local, &rank, triangles);
        plan.integrate();
        plan
    }

    /// Sums the triangles' segments in every leaf.
    fn cut(&mut self, local: &[[f64; 3]], rank: &[usize], triangles: &[[u32; 3]]) {
        let far = FAR * local.iter().flat_map(|p| &p[..2]).fold(0.0f64, |most, x| most.max(x.abs()));
        let mut sums = Sums::new(&self.heights, &mut self.leaves, far);
        for t in triangles {
            let mut order = [0usize, 1, 2];
            order.sort_unstable_by_key(|&k| rank[t[k] as usize]);
            // Whether low, middle, high run the way of the triangle.
            let even = (order[1] + 3 - order[0]) % 3 == 1;
            let [low, middle, high] = order.map(|k| t[k] as usize);
            let (a, b, c) = (&local[low], &local[middle], &local[high]);
            // The cut runs, seen from above, from the edge that comes down to the edge that goes up.
            let long = Edge::new(a, c);
            for (short, from, to) in
                [(Edge::new(a, b), rank[low], rank[middle]), (Edge::new(b, c), rank[middle], rank[high])]
            {
                if from < to {
                    let (down, up) = if even { (&long, &short) } else { (&short, &long) };
                    sums.add(from, to, down, up);
                }
            }
        }
        sums.settle();
    }

    fn integrate(&mut self) {
        let mut below = [0.0; 4];
        for (i, leaf) in self.leaves.iter_mut().enumerate() {
            leaf.below = below;
            let span = self.heights[i + 1] - self.heights[i];
            below = leaf.up_to(1.0, self.heights[i], span);
        }
        self.whole = below;
    }

    /// Volume of the cavity, m^3.
    pub fn capacity_m3(&self) -> f64 {
        self.whole[0]
    }

    /// Volume below a height along up from the frame's origin, m^3.
    ///
    /// # Errors
    /// [`ContainerError::Dimension`] where the height is no number.
    pub fn volume_below(&self, height_m: f64) -> Result<f64, ContainerError> {
        if height_m.is_nan() {
            return Err(ContainerError::Dimension { name: "height_m", got: height_m, expected: "a number" });
        }
        let height = height_m - self.reference.coords.dot(&self.up);
        let above = self.heights.partition_point(|h| *h <= height);
        if above == 0 {
            return Ok(0.0);
        }
        let Some(leaf) = self.leaves.get(above - 1) else { return Ok(self.whole[0]) };
        let (low, span) = (self.heights[above - 1], self.heights[above] - self.heights[above - 1]);
        Ok(leaf.up_to((height - low) / span, low, span)[0].clamp(0.0, self.whole[0]))
    }

    /// Where a volume (m^3) of liquid lies.
    ///
    /// # Errors
    /// [`ContainerError::Volume`] where it does not fit.
    pub fn fill(&self, volume_m3: f64) -> Result<Fill, ContainerError> {
        let capacity_m3 = self.whole[0];
        if !(volume_m3 >= 0.0 && volume_m3 <= capacity_m3 * (1.0 + 1e-12)) {
            return Err(ContainerError::Volume { got_m3: volume_m3, capacity_m3 });
        }
        let origin = self.reference.coords.dot(&self.up);
        let empty = Fill {
            volume_m3,
            surface_height_m: self.heights.first().copied().unwrap_or(0.0) + origin,
            center_of_mass: self.lowest.coords,
        };
        let at = self.leaves.partition_point(|leaf| leaf.below[0] < volume_m3);
        let Some(leaf) = at.checked_sub(1).and_then(|i| self.leaves.get(i)) else { return Ok(empty) };
        let (low, span) = (self.heights[at - 1], self.heights[at] - self.heights[at - 1]);
        let t = leaf.height_of((volume_m3 - leaf.below[0]) / span);
        let [volume, along, first, second] = leaf.up_to(t, low, span);
        if !(volume > 0.0) {
            return Ok(empty);
        }
        let center = (self.up * along + self.across[0] * first + self.across[1] * second) / volume;
        Ok(Fill {
            volume_m3,
            surface_height_m: low + t * span + origin,
            center_of_mass: self.reference.coords + center,
        })
    }
}
