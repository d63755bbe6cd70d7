//! The leaves' cuts, summed over triangles by blocks and a tree of them.

use super::cut::{Cut, Edge};
use super::leaf::Leaf;

/// Leaves of a block.
const BLOCK: usize = 256;

/// The leaves' cuts in the making.
pub(super) struct Sums<'a> {
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
    pub(super) fn new(heights: &'a [f64], leaves: &'a mut [Leaf], far: f64) -> Self {
        let count = leaves.len().div_ceil(BLOCK);
        let blocks = count.next_power_of_two();
        let steps = vec![Cut::default(); leaves.len()];
        Self { heights, leaves, steps, tree: vec![Cut::default(); 2 * blocks], blocks, far }
    }

    /// Adds the segment between two edges to the leaves from `from` to before `to`.
    pub(super) fn add(&mut self, from: usize, to: usize, down: &Edge, up: &Edge) {
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
    pub(super) fn settle(&mut self) {
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
