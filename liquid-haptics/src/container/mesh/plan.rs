//! Volume and first moments below a level, for one direction of up, without clipping the mesh.
//!
//! Between two neighbouring vertex heights the area of the level cut is quadratic in the height, its first moments cubic: sums over
//! the segments in which triangles cross the level. The heights are cut into intervals (leaves), a triangle adds its segment to
//! the O(log n) nodes of a binary tree that cover its range, and the nodes' sums are handed down. Every node holds the *values* of
//! its polynomials at four heights, which are bounded by the mesh's size; coefficients would grow without bound where an
//! edge is nearly level.

use nalgebra::{Point3, UnitVector3, Vector3};

use crate::container::{ContainerError, Fill};

/// Values of area and two moments of the cut at four heights, evenly spaced over a node's range.
type Values = [[f64; 4]; 3];
const NOTHING: Values = [[0.0; 4]; 3];

/// One interval between vertex heights: polynomials in `t` from 0 to 1 over it, and what lies below it.
#[derive(Debug, Clone, Copy, Default)]
struct Leaf {
    area: [f64; 3],
    moments: [[f64; 4]; 2],
    /// Volume, moment along up, and moments across, below the interval; about the reference point.
    below: [f64; 4],
}

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
        let mut heights: Vec<f64> = local.iter().map(|p| p[2]).collect();
        heights.sort_by(f64::total_cmp);
        // Heights that differ by rounding alone are one.
        let size =
            heights.last().copied().unwrap_or(0.0).abs().max(heights.first().copied().unwrap_or(0.0).abs());
        heights.dedup_by(|next, kept| *next - *kept <= 4e-16 * size);
        let lowest = local.iter().enumerate().min_by(|a, b| a.1[2].total_cmp(&b.1[2])).map_or(0, |(i, _)| i);
        let mut plan = Self {
            reference,
            up,
            across,
            leaves: vec![Leaf::default(); heights.len().saturating_sub(1)],
            heights,
            whole: [0.0; 4],
            lowest: vertices.get(lowest).copied().unwrap_or_default(),
        };
        let tree = plan.tree(&local, triangles);
        plan.integrate(&tree);
        plan
    }

    /// Adds every triangle to the tree; returns the leaves' values after all sums have been handed down.
    fn tree(&self, local: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<Values> {
        let leaves = self.leaves.len();
        let size = leaves.next_power_of_two().max(1);
        let depth = size.trailing_zeros();
        let mut nodes = vec![NOTHING; 2 * size];
        let rank: Vec<usize> =
            local.iter().map(|p| self.heights.partition_point(|h| *h <= p[2]).saturating_sub(1)).collect();
        let range = |node: usize| {
            let below = depth - node.ilog2();
            let first = (node << below) - size;
            (first.min(leaves), (first + (1 << below)).min(leaves))
        };
        let mut add = |from: usize, to: usize, down: [&[f64; 3]; 2], up: [&[f64; 3]; 2]| {
            let (mut l, mut r) = (from + size, to + size);
            while l < r {
                if l & 1 == 1 {
                    self.add_segment(&mut nodes[l], range(l), down, up);
                    l += 1;
                }
                if r & 1 == 1 {
                    r -= 1;
                    self.add_segment(&mut nodes[r], range(r), down, up);
                }
                (l, r) = (l >> 1, r >> 1);
            }
        };
        for t in triangles {
            let mut order = [0usize, 1, 2];
            order.sort_by_key(|&k| rank[t[k] as usize]);
            // Whether low, middle, high run the way of the triangle.
            let even = (order[1] + 3 - order[0]) % 3 == 1;
            let [low, middle, high] = order.map(|k| t[k] as usize);
            let (a, b, c) = (&local[low], &local[middle], &local[high]);
            let (ra, rb, rc) = (rank[low], rank[middle], rank[high]);
            // The cut runs, seen from above, from the edge that comes down to the edge that goes up.
            let (short, long) = ([a, b], [a, c]);
            let (down, up) = if even { (long, short) } else { (short, long) };
            add(ra, rb, down, up);
            let short = [b, c];
            let (down, up) = if even { (long, short) } else { (short, long) };
            add(rb, rc, down, up);
        }
        for node in 1..size {
            let (first, end) = range(node);
            if first >= end {
                continue;
            }
            let values = nodes[node];
            let (low, span) = (self.heights[first], self.heights[end] - self.heights[first]);
            for child in [2 * node, 2 * node + 1] {
                let (from, to) = range(child);
                if from >= to {
                    continue;
                }
                let begin = (self.heights[from] - low) / span;
                let step = (self.heights[to] - self.heights[from]) / span / 3.0;
                for (mine, theirs) in values.iter().zip(&mut nodes[child]) {
                    let c = cubic(mine);
                    for (k, value) in theirs.iter_mut().enumerate() {
                        let t = begin + k as f64 * step;
                        *value += c[0] + t * (c[1] + t * (c[2] + t * c[3]));
                    }
                }
            }
        }
        nodes[size..size + leaves].to_vec()
    }

    /// Adds the cut's segment between two edges over a range of leaves.
    fn add_segment(
        &self,
        values: &mut Values,
        (first, end): (usize, usize),
        down: [&[f64; 3]; 2],
        up: [&[f64; 3]; 2],
    ) {
        let (low, high) = (self.heights[first], self.heights[end]);
        let [area, first_moment, second_moment] = values;
        let rows = area.iter_mut().zip(first_moment.iter_mut().zip(second_moment));
        for (k, (area, (first, second))) in rows.enumerate() {
            let h = low + (high - low) * (k as f64 / 3.0);
            let at = |[a, b]: [&[f64; 3]; 2]| {
                let t = ((h - a[2]) / (b[2] - a[2])).clamp(0.0, 1.0);
                [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
            };
            let (p, q) = (at(down), at(up));
            let cross = p[0] * q[1] - p[1] * q[0];
            *area += 0.5 * cross;
            *first += cross * (p[0] + q[0]) / 6.0;
            *second += cross * (p[1] + q[1]) / 6.0;
        }
    }

    fn integrate(&mut self, values: &[Values]) {
        let mut below = [0.0; 4];
        for (i, (leaf, values)) in self.leaves.iter_mut().zip(values).enumerate() {
            let [area, first, second] = values.map(|v| cubic(&v));
            leaf.area = [area[0], area[1], area[2]];
            leaf.moments = [first, second];
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

impl Leaf {
    /// Volume and moments below `t` within the interval.
    fn up_to(&self, t: f64, low: f64, span: f64) -> [f64; 4] {
        let t = t.clamp(0.0, 1.0);
        let [a, b, c] = self.area;
        let volume = span * t * (a + t * (b / 2.0 + t * c / 3.0));
        let lifted = span * span * t * t * (a / 2.0 + t * (b / 3.0 + t * c / 4.0));
        let moment = |m: &[f64; 4]| span * t * (m[0] + t * (m[1] / 2.0 + t * (m[2] / 3.0 + t * m[3] / 4.0)));
        [
            self.below[0] + volume,
            self.below[1] + low * volume + lifted,
            self.below[2] + moment(&self.moments[0]),
            self.below[3] + moment(&self.moments[1]),
        ]
    }

    /// The `t` below which lies a volume, given over the interval's span: Newton's method between brackets.
    fn height_of(&self, volume: f64) -> f64 {
        let [a, b, c] = self.area;
        let (mut low, mut high) = (0.0, 1.0);
        let mut t = 0.5;
        for _ in 0..60 {
            let value = t * (a + t * (b / 2.0 + t * c / 3.0)) - volume;
            if value < 0.0 {
                low = t;
            } else {
                high = t;
            }
            let newton = t - value / (a + t * (b + t * c));
            let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
            let still = (next - t).abs() <= 1e-16;
            t = next;
            if still || value == 0.0 {
                break;
            }
        }
        t
    }
}

/// Coefficients of the cubic through four values at 0, 1/3, 2/3 and 1.
fn cubic(v: &[f64; 4]) -> [f64; 4] {
    [
        v[0],
        -5.5 * v[0] + 9.0 * v[1] - 4.5 * v[2] + v[3],
        9.0 * v[0] - 22.5 * v[1] + 18.0 * v[2] - 4.5 * v[3],
        -4.5 * v[0] + 13.5 * v[1] - 13.5 * v[2] + 4.5 * v[3],
    ]
}
