//! Forces between grains, a block of contacts at a time.
//!
//! Pairs that touch are first gathered without a branch. What they need is then laid out number by number, so that the law of
//! contact goes over several contacts in one instruction (as many as the processor has room for), and only then do the forces
//! go to the grains, in the order of the list: the sums are the same on every processor.

use super::{
    contact::{History, Pair, Touch, react, sizes},
    grains::Grains,
    material::Factors,
    neighbours::Neighbours,
    vector::{V3, add, along, dot, scale, sub},
};

/// Contacts in a block.
const BLOCK: usize = 64;

/// A number of each contact.
type Lane = [f64; BLOCK];
/// A vector of each contact.
type Lanes = [Lane; 3];

/// Room for a block of contacts.
#[derive(Debug, Clone)]
struct Block {
    /// Both grains and the pair's place in the list.
    who: [[u32; 3]; BLOCK],
    /// Vector from the second to the first centre, then the unit normal.
    normal: Lanes,
    /// Square of the distance.
    square: Lane,
    /// Sum of the radii, then the overlap.
    overlap: Lane,
    radius: Lane,
    root_mass: Lane,
    root_inertia: Lane,
    velocity: Lanes,
    surface: Lanes,
    rotation: Lanes,
    /// The memory of the contacts.
    shear: Lanes,
    size: Lane,
    couple: Lanes,
    /// What acts.
    force: Lanes,
    turn: Lanes,
    torque: Lanes,
}

#[inline(always)]
fn get(lanes: &Lanes, m: usize) -> V3 {
    [lanes[0][m], lanes[1][m], lanes[2][m]]
}

#[inline(always)]
fn set(lanes: &mut Lanes, m: usize, v: V3) {
    (lanes[0][m], lanes[1][m], lanes[2][m]) = (v[0], v[1], v[2]);
}

/// The forces between grains.
#[derive(Debug, Clone)]
pub(crate) struct Forces {
    block: Box<Block>,
    round: u64,
    arch: pulp::Arch,
}

impl Default for Forces {
    fn default() -> Self {
        let (lane, lanes) = ([0.0; BLOCK], [[0.0; BLOCK]; 3]);
        let block = Block {
            who: [[0; 3]; BLOCK],
            normal: lanes,
            square: lane,
            overlap: lane,
            radius: lane,
            root_mass: lane,
            root_inertia: lane,
            velocity: lanes,
            surface: lanes,
            rotation: lanes,
            shear: lanes,
            size: lane,
            couple: lanes,
            force: lanes,
            turn: lanes,
            torque: lanes,
        };
        // A history that no contact has touched is of round 0.
        Self { block: Box::new(block), round: 1, arch: pulp::Arch::new() }
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
        let sum = Sum { block, neighbours, grains, factors, step, round };
        self.arch.dispatch(sum)
    }
}

/// One round of forces, compiled for each kind of processor.
struct Sum<'a> {
    block: &'a mut Block,
    neighbours: &'a mut Neighbours,
    grains: &'a mut Grains,
    factors: &'a Factors,
    step: f64,
    round: u64,
}

impl pulp::NullaryFnOnce for Sum<'_> {
    type Output = u64;

    #[inline(always)]
    fn call(self) -> u64 {
        let Self { block, neighbours, grains, factors, step, round } = self;
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
            set(&mut block.normal, m, d);
            block.square[m] = square;
            block.overlap[m] = sum;
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
    let count = count.min(BLOCK);
    for m in 0..count {
        let distance = block.square[m].sqrt();
        let inverse = 1.0 / distance;
        block.overlap[m] -= distance;
        block.normal.iter_mut().for_each(|lane| lane[m] *= inverse);
    }
    for m in 0..count {
        lay_out(block, m, neighbours, grains, round);
    }
    for m in 0..count {
        side_by_side(block, m, factors, step);
    }
    for m in 0..count {
        hand_out(block, m, neighbours, grains, round);
    }
}

/// Motions and memory of a contact, number by number.
#[inline(always)]
fn lay_out(block: &mut Block, m: usize, neighbours: &Neighbours, grains: &Grains, round: u64) {
    let [i, j, k] = block.who[m].map(|w| w as usize);
    let (pair, known) = (&neighbours.list.pair[k], &neighbours.list.history[k]);
    let history = if known.round + 1 == round { *known } else { History::default() };
    let half = 0.5 * block.overlap[m];
    let (lever_i, lever_j) = (grains.place[i][3] - half, grains.place[j][3] - half);
    let (a, b) = (&grains.motion[i], &grains.motion[j]);
    block.radius[m] = pair.radius;
    block.root_mass[m] = pair.root_mass;
    block.root_inertia[m] = pair.root_inertia;
    set(&mut block.velocity, m, sub(a.velocity, b.velocity));
    set(&mut block.surface, m, along(scale(a.spin, lever_i), lever_j, b.spin));
    set(&mut block.rotation, m, sub(a.spin, b.spin));
    set(&mut block.shear, m, history.shear);
    block.size[m] = history.size;
    set(&mut block.couple, m, history.couple);
}

/// The law of contact.
#[inline(always)]
fn side_by_side(block: &mut Block, m: usize, factors: &Factors, step: f64) {
    let pair =
        Pair { radius: block.radius[m], root_mass: block.root_mass[m], root_inertia: block.root_inertia[m] };
    let overlap = block.overlap[m];
    let touch = Touch {
        normal: get(&block.normal, m),
        overlap,
        sizes: sizes(factors.hertz, pair.radius, overlap),
        velocity: get(&block.velocity, m),
        surface: get(&block.surface, m),
        rotation: get(&block.rotation, m),
    };
    let mut history =
        History { shear: get(&block.shear, m), size: block.size[m], couple: get(&block.couple, m), round: 0 };
    let r = react(factors, &pair, &touch, &mut history, step);
    set(&mut block.shear, m, history.shear);
    block.size[m] = history.size;
    set(&mut block.couple, m, history.couple);
    set(&mut block.force, m, r.force);
    set(&mut block.turn, m, r.turn);
    set(&mut block.torque, m, r.couple);
}

/// A contact's forces to its grains, its memory to the list.
#[inline(always)]
fn hand_out(block: &Block, m: usize, neighbours: &mut Neighbours, grains: &mut Grains, round: u64) {
    let [i, j, k] = block.who[m].map(|w| w as usize);
    neighbours.list.history[k] =
        History { shear: get(&block.shear, m), size: block.size[m], couple: get(&block.couple, m), round };
    let half = 0.5 * block.overlap[m];
    let (lever_i, lever_j) = (grains.place[i][3] - half, grains.place[j][3] - half);
    let (force, turn, couple) = (get(&block.force, m), get(&block.turn, m), get(&block.torque, m));
    let to = &mut grains.load[i];
    to.force = add(to.force, force);
    to.torque = add(along(to.torque, -lever_i, turn), couple);
    let to = &mut grains.load[j];
    to.force = sub(to.force, force);
    to.torque = sub(along(to.torque, -lever_j, turn), couple);
}
