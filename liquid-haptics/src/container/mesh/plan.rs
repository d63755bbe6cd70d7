//! Volume and first moments below a level, for one direction of up, without clipping the mesh.
//!
//! Between two neighbouring vertex heights the area of the level cut is quadratic in the height, its first moments cubic: sums over
//! the segments in which triangles cross the level ([`Cut`]). The heights are cut into intervals (leaves), and blocks of them. Where
//! a triangle begins and ends within a block its segment's polynomial is added and taken away again, to be summed along the block;
//! the blocks that it crosses get it by the O(log n) nodes of a binary tree that cover them, whose sums are handed down.
//!
//! A polynomial far outside its triangle's range is as large as the triangle is level, and what is taken away again leaves the
//! rounding of that. A triangle whose segment would run far out of the mesh within the block is added to each of its leaves.

use nalgebra::{Point3, UnitVector3, Vector3};

use super::cut::{Cut, Edge};
use crate::container::{ContainerError, Fill};

/// Leaves of a block.
const BLOCK: usize = 256;
/// A segment may run out of the mesh by this many times its size within a block.
const FAR: f64 = 8.0;

/// One interval between vertex heights: polynomials in `t` from 0 to 1 over it, and what lies below it.
#[derive(Debug, Clone, Copy, Default)]
struct Leaf {
    cut: Cut,
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

/// The leaves' cuts in the making.
struct Sums<'a> {
    heights: &'a [f64],
    leaves: &'a mut [Leaf],
    /// What begins and, with the other sign, ends with each leaf, over the leaf's block.
    steps: Vec<Cut>,
    /// Cuts of whole blocks, a binary tree.
    tree: Vec<Cut>,
    blocks: usize,
    far: f64,
}

impl<'a> Sums<'a> {
    fn new(heights: &'a [f64], leaves: &'a mut [Leaf], far: f64) -> Self {
        let count = leaves.len().div_ceil(BLOCK);
        let blocks = count.next_power_of_two();
        let steps = vec![Cut::default(); leaves.len()];
        Self { heights, leaves, steps, tree: vec![Cut::default(); 2 * blocks], blocks, far }
    }

    /// Adds the segment between two edges to the leaves from `from` to before `to`.
    fn add(&mut self, from: usize, to: usize, down: &Edge, up: &Edge) {
        let (first, last) = (from / BLOCK, (to - 1) / BLOCK);
        // Blocks that are crossed whole.
        let (mut l, mut r) = (first + 1, last);
        if first == last {
            self.within(from, to, down, up);
        } else {
            self.within(from, (first + 1) * BLOCK, down, up);
            self.within(last * BLOCK, to, down, up);
        }
        l += self.blocks;
        r += self.blocks;
        while l < r {
            if l & 1 == 1 {
                self.cross(l, down, up);
                l += 1;
            }
            if r & 1 == 1 {
                r -= 1;
                self.cross(r, down, up);
            }
            (l, r) = (l >> 1, r >> 1);
        }
    }

    /// Within one block.
    fn within(&mut self, from: usize, to: usize, down: &Edge, up: &Edge) {
        let start = from - from % BLOCK;
        let end = (start + BLOCK).min(self.leaves.len());
        let at = |leaf: usize| self.heights[leaf];
        let ends = [down, up].map(|edge| [edge.at(at(start)), edge.at(at(end))]);
        let reach = ends.iter().flatten().flatten().fold(0.0f64, |most, x| most.max(x.abs()));
        if reach <= self.far {
            let cut = Cut::between(ends[0], ends[1]);
            self.steps[from].add(&cut, 1.0);
            if to < end {
                self.steps[to].add(&cut, -1.0);
            }
            return;
        }
        for leaf in from..to {
            let ends = [down, up].map(|edge| [edge.clamped(at(leaf)), edge.clamped(at(leaf + 1))]);
            self.leaves[leaf].cut.add(&Cut::between(ends[0], ends[1]), 1.0);
        }
    }

    /// The blocks below a node of the tree, as leaves.
    fn range(&self, node: usize) -> (usize, usize) {
        let below = self.blocks.trailing_zeros() - node.ilog2();
        let first = (node << below) - self.blocks;
        let end = first + (1 << below);
        ((first * BLOCK).min(self.leaves.len()), (end * BLOCK).min(self.leaves.len()))
    }

    fn cross(&mut self, node: usize, down: &Edge, up: &Edge) {
        let (from, to) = self.range(node);
        let (low, high) = (self.heights[from], self.heights[to]);
        let ends = [down, up].map(|edge| [edge.clamped(low), edge.clamped(high)]);
        self.tree[node].add(&Cut::between(ends[0], ends[1]), 1.0);
    }

    /// Hands the sums down to the leaves.
    fn settle(&mut self) {
        let place = |outer: (usize, usize), inner: (usize, usize)| {
            let span = self.heights[outer.1] - self.heights[outer.0];
            let begin = (self.heights[inner.0] - self.heights[outer.0]) / span;
            (begin, (self.heights[inner.1] - self.heights[inner.0]) / span)
        };
        for node in 1..self.blocks {
            let outer = self.range(node);
            for child in [2 * node, 2 * node + 1] {
                let inner = self.range(child);
                if inner.0 < inner.1 {
                    let (begin, width) = place(outer, inner);
                    let part = self.tree[node].part(begin, width);
                    self.tree[child].add(&part, 1.0);
                }
            }
        }
        for block in 0..self.leaves.len().div_ceil(BLOCK) {
            let outer = self.range(self.blocks + block);
            let mut here = self.tree[self.blocks + block];
            for leaf in outer.0..outer.1 {
                here.add(&self.steps[leaf], 1.0);
                let (begin, width) = place(outer, (leaf, leaf + 1));
                self.leaves[leaf].cut.add(&here.part(begin, width), 1.0);
            }
        }
    }
}

impl Leaf {
    /// Volume and moments below `t` within the interval.
    fn up_to(&self, t: f64, low: f64, span: f64) -> [f64; 4] {
        let t = t.clamp(0.0, 1.0);
        let [a, b, c] = self.cut.area;
        let volume = span * t * (a + t * (b / 2.0 + t * c / 3.0));
        let lifted = span * span * t * t * (a / 2.0 + t * (b / 3.0 + t * c / 4.0));
        let moment = |m: &[f64; 4]| span * t * (m[0] + t * (m[1] / 2.0 + t * (m[2] / 3.0 + t * m[3] / 4.0)));
        [
            self.below[0] + volume,
            self.below[1] + low * volume + lifted,
            self.below[2] + moment(&self.cut.moments[0]),
            self.below[3] + moment(&self.cut.moments[1]),
        ]
    }

    /// The `t` below which lies a volume, given over the interval's span: Newton's method between brackets.
    fn height_of(&self, volume: f64) -> f64 {
        let [a, b, c] = self.cut.area;
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
