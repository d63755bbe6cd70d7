//! Forces between grains, a block of contacts at a time.
//!
//! Pairs that touch are first gathered without a branch, then their roots and quotients are taken side by side, and only then
//! do the springs follow: a root's delay is no longer on the way of every contact.

use super::{
    contact::{History, Touch, react, sizes},
    grains::Grains,
    material::Factors,
    neighbours::Neighbours,
    vector::{V3, add, along, dot, scale, sub},
};

/// Contacts in a block.
const BLOCK: usize = 128;

/// Room for a block of contacts.
#[derive(Debug, Clone)]
struct Block {
    /// Both grains and the pair's place in the list.
    who: [[u32; 3]; BLOCK],
    /// Vector from the second to the first centre.
    apart: [V3; BLOCK],
    /// Its square, then its length.
    distance: [f64; BLOCK],
    /// Sum of the radii, then the overlap.
    overlap: [f64; BLOCK],
    /// Reduced radius, then s.
    size: [f64; BLOCK],
    root: [f64; BLOCK],
    inverse: [f64; BLOCK],
}

/// The forces between grains.
#[derive(Debug, Clone)]
pub(crate) struct Forces {
    block: Box<Block>,
    round: u64,
}

impl Default for Forces {
    fn default() -> Self {
        let zero = [0.0; BLOCK];
        let block = Block {
            who: [[0; 3]; BLOCK],
            apart: [[0.0; 3]; BLOCK],
            distance: zero,
            overlap: zero,
            size: zero,
            root: zero,
            inverse: zero,
        };
        // A history that no contact has touched is of round 0.
        Self { block: Box::new(block), round: 1 }
    }
}

impl Forces {
    /// Adds the forces between grains; returns how many pairs touch.
    pub(crate) fn react(
        &mut self,
        neighbours: &mut Neighbours,
        grains: &mut Grains,
        factors: &Factors,
        step: f64,
    ) -> u64 {
        self.round += 1;
        let (block, round) = (&mut *self.block, self.round);
        // Two copies of the loop, each without the question which law it is.
        if factors.hertz {
            gather(block, neighbours, grains, &Factors { hertz: true, ..*factors }, step, round)
        } else {
            gather(block, neighbours, grains, &Factors { hertz: false, ..*factors }, step, round)
        }
    }
}

#[inline(always)]
fn gather(
    block: &mut Block,
    neighbours: &mut Neighbours,
    grains: &mut Grains,
    factors: &Factors,
    step: f64,
    round: u64,
) -> u64 {
    let mut touching = 0;
    let mut m = 0;
    for i in 0..grains.len() {
        let row = neighbours.list.row(i);
        let [x, y, z, radius] = grains.place[i];
        for k in row {
            let j = neighbours.list.other[k];
            let p = grains.place[j as usize];
            let d = sub([x, y, z], [p[0], p[1], p[2]]);
            let (square, sum) = (dot(d, d), radius + p[3]);
            block.who[m] = [i as u32, j, k as u32];
            block.apart[m] = d;
            block.distance[m] = square;
            block.overlap[m] = sum;
            block.size[m] = neighbours.list.pair[k].radius;
            m += usize::from(square < sum * sum);
            if m == BLOCK {
                act(block, m, neighbours, grains, factors, step, round);
                touching += m as u64;
                m = 0;
            }
        }
    }
    act(block, m, neighbours, grains, factors, step, round);
    touching + m as u64
}

/// The forces of the first `count` contacts of a block.
#[inline(always)]
fn act(
    block: &mut Block,
    count: usize,
    neighbours: &mut Neighbours,
    grains: &mut Grains,
    factors: &Factors,
    step: f64,
    round: u64,
) {
    for m in 0..count.min(BLOCK) {
        let distance = block.distance[m].sqrt();
        let overlap = block.overlap[m] - distance;
        block.distance[m] = distance;
        block.inverse[m] = 1.0 / distance;
        block.overlap[m] = overlap;
        (block.size[m], block.root[m]) = sizes(factors.hertz, block.size[m], overlap);
    }
    let list = &mut neighbours.list;
    for m in 0..count.min(BLOCK) {
        let [i, j, k] = block.who[m].map(|w| w as usize);
        let history = &mut list.history[k];
        if history.round + 1 != round {
            *history = History::default();
        }
        history.round = round;
        let overlap = block.overlap[m];
        let (lever_i, lever_j) = (grains.place[i][3] - 0.5 * overlap, grains.place[j][3] - 0.5 * overlap);
        let (a, b) = (&grains.motion[i], &grains.motion[j]);
        let touch = Touch {
            normal: scale(block.apart[m], block.inverse[m]),
            overlap,
            sizes: (block.size[m], block.root[m]),
            velocity: sub(a.velocity, b.velocity),
            surface: along(scale(a.spin, lever_i), lever_j, b.spin),
            rotation: sub(a.spin, b.spin),
        };
        let r = react(factors, &list.pair[k], &touch, history, step);
        let to = &mut grains.load[i];
        to.force = add(to.force, r.force);
        to.torque = add(along(to.torque, -lever_i, r.turn), r.couple);
        let to = &mut grains.load[j];
        to.force = sub(to.force, r.force);
        to.torque = sub(along(to.torque, -lever_j, r.turn), r.couple);
    }
}
