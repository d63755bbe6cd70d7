//! Pairs of grains that may touch, each with the memory of its contact.

use super::{
    cells::Cells,
    contact::{History, Pair, Touch, react},
    grains::Grains,
    material::Factors,
    vector::{V3, add, along, dot, scale, sub},
};

/// Margin of a grain at rest over the largest radius.
const MARGIN: f64 = 0.04;
/// Largest margin over the largest radius.
const MOST_MARGIN: f64 = 2.0;
/// Steps that a grain's margin lasts at its speed.
const HORIZON: f64 = 40.0;

/// What the simulation has done so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Counters {
    /// Steps.
    pub steps: u64,
    /// Times that the pairs were listed anew.
    pub rebuilds: u64,
    /// Pairs looked at.
    pub pairs: u64,
    /// Pairs that touched.
    pub contacts: u64,
}

/// The list of pairs: for each grain its neighbours of a higher index, sorted.
#[derive(Debug, Clone)]
pub(crate) struct Neighbours {
    cells: Cells,
    largest: f64,
    /// Where each grain was when the list was made, and how far it may go from there.
    reference: Vec<V3>,
    pub(crate) margin: Vec<f64>,
    list: List,
    before: List,
    found: Vec<[u32; 2]>,
}

#[derive(Debug, Clone)]
struct List {
    start: Vec<u32>,
    other: Vec<u32>,
    pair: Vec<Pair>,
    history: Vec<History>,
}

impl List {
    fn new(grains: usize) -> Self {
        let most = 12 * grains;
        Self {
            start: vec![0; grains + 1],
            other: Vec::with_capacity(most),
            pair: Vec::with_capacity(most),
            history: Vec::with_capacity(most),
        }
    }

    fn row(&self, grain: usize) -> std::ops::Range<usize> {
        self.start[grain] as usize..self.start[grain + 1] as usize
    }
}

impl Neighbours {
    pub(crate) fn new(grains: &Grains) -> Self {
        let largest = grains.place.iter().fold(0.0, |a: f64, p| a.max(p[3]));
        let n = grains.len();
        Self {
            cells: Cells::new(n, 2.0 * (1.0 + MARGIN) * largest),
            largest,
            reference: vec![[0.0; 3]; n],
            margin: vec![0.0; n],
            list: List::new(n),
            before: List::new(n),
            found: Vec::with_capacity(12 * n),
        }
    }

    /// Whether a grain has left its margin.
    #[inline(always)]
    pub(crate) fn left(&self, grain: usize, at: &[f64; 4]) -> bool {
        let moved = sub([at[0], at[1], at[2]], self.reference[grain]);
        let margin = self.margin[grain];
        dot(moved, moved) > margin * margin
    }

    /// Lists all pairs that may touch before one of their grains leaves its margin.
    ///
    /// A grain's margin grows with its speed, so that the fast and sparse do not make the slow and dense look far.
    pub(crate) fn rebuild(&mut self, grains: &Grains, step: f64) {
        let n = grains.len();
        for i in 0..n {
            let [x, y, z, _] = grains.place[i];
            let v = grains.motion[i].velocity;
            self.reference[i] = [x, y, z];
            self.margin[i] =
                (MARGIN * self.largest + HORIZON * step * dot(v, v).sqrt()).min(MOST_MARGIN * self.largest);
        }
        self.cells.sort(&grains.place);
        self.find(grains);

        std::mem::swap(&mut self.list, &mut self.before);
        let (list, before) = (&mut self.list, &self.before);
        // Count, then fill from behind: afterwards start[i] is where row i begins.
        list.start.fill(0);
        for pair in &self.found {
            list.start[pair[0] as usize] += 1;
        }
        let mut sum = 0;
        for s in &mut list.start {
            sum += *s;
            *s = sum;
        }
        list.other.clear();
        list.other.resize(self.found.len(), 0);
        for &[low, high] in &self.found {
            let s = &mut list.start[low as usize];
            *s -= 1;
            list.other[*s as usize] = high;
        }
        list.pair.clear();
        list.history.clear();
        for i in 0..n {
            let row = list.row(i);
            list.other[row.clone()].sort_unstable();
            let mut old = before.row(i);
            for &j in &list.other[row] {
                while old.start < old.end && before.other[old.start] < j {
                    old.start += 1;
                }
                let known = old.start < old.end && before.other[old.start] == j;
                if known {
                    list.pair.push(before.pair[old.start]);
                    list.history.push(before.history[old.start]);
                } else {
                    let k = j as usize;
                    let radius = [grains.place[i][3], grains.place[k][3]];
                    list.pair.push(Pair::of(radius, [grains.mass[i], grains.mass[k]]));
                    list.history.push(History::default());
                }
            }
        }
    }

    /// Collects the pairs; each is found from the grain with the wider margin.
    fn find(&mut self, grains: &Grains) {
        self.found.clear();
        let cells = &self.cells;
        for i in 0..grains.len() {
            let [x, y, z, radius] = grains.place[i];
            let margin = self.margin[i];
            let reach = radius + self.largest + 2.0 * margin;
            let range = |c: f64| cells.along(c - reach)..=cells.along(c + reach);
            for cz in range(z) {
                for cy in range(y) {
                    for cx in range(x) {
                        for &j in cells.members(cells.index([cx, cy, cz])) {
                            let k = j as usize;
                            let other = self.margin[k];
                            if other > margin || (other == margin && k <= i) {
                                continue;
                            }
                            let p = grains.place[k];
                            let d = sub([x, y, z], [p[0], p[1], p[2]]);
                            let cut = radius + p[3] + margin + other;
                            if dot(d, d) < cut * cut {
                                let i = i as u32;
                                self.found.push([i.min(j), i.max(j)]);
                            }
                        }
                    }
                }
            }
        }
    }

    /// Adds the forces between grains; returns how many pairs touch.
    pub(crate) fn react(&mut self, grains: &mut Grains, factors: &Factors, step: f64) -> u64 {
        if factors.hertz {
            self.react_as(grains, &Factors { hertz: true, ..*factors }, step)
        } else {
            self.react_as(grains, &Factors { hertz: false, ..*factors }, step)
        }
    }

    #[inline(always)]
    fn react_as(&mut self, grains: &mut Grains, factors: &Factors, step: f64) -> u64 {
        let mut touching = 0;
        let n = grains.len();
        let (place, motion, load) = (&grains.place[..n], &grains.motion[..n], &mut grains.load[..n]);
        for i in 0..n {
            let row = self.list.row(i);
            let [x, y, z, radius] = place[i];
            let own = motion[i];
            let (mut force, mut torque) = ([0.0; 3], [0.0; 3]);
            let others = &self.list.other[row.clone()];
            let pairs = &self.list.pair[row.clone()];
            let histories = &mut self.list.history[row];
            for ((&j, pair), history) in others.iter().zip(pairs).zip(histories) {
                let j = j as usize;
                let p = place[j];
                let d = sub([x, y, z], [p[0], p[1], p[2]]);
                let square = dot(d, d);
                let sum = radius + p[3];
                if square >= sum * sum {
                    history.size = 0.0;
                    continue;
                }
                if history.size == 0.0 {
                    *history = History::default();
                }
                touching += 1;
                let distance = square.sqrt();
                let overlap = sum - distance;
                let (lever, lever_j) = (radius - 0.5 * overlap, p[3] - 0.5 * overlap);
                let other = &motion[j];
                let touch = Touch {
                    normal: scale(d, 1.0 / distance),
                    overlap,
                    velocity: sub(own.velocity, other.velocity),
                    surface: along(scale(own.spin, lever), lever_j, other.spin),
                    rotation: sub(own.spin, other.spin),
                };
                let r = react(factors, pair, &touch, history, step);
                force = add(force, r.force);
                torque = add(along(torque, -lever, r.turn), r.couple);
                let to = &mut load[j];
                to.force = sub(to.force, r.force);
                to.torque = sub(along(to.torque, -lever_j, r.turn), r.couple);
            }
            let to = &mut load[i];
            to.force = add(to.force, force);
            to.torque = add(to.torque, torque);
        }
        touching
    }

    /// How many pairs are listed.
    pub(crate) fn len(&self) -> usize {
        self.list.other.len()
    }

    /// Calls back with pair, history and overlap in m of each contact.
    pub(crate) fn contacts(&self, grains: &Grains, mut each: impl FnMut(&Pair, &History, f64)) {
        for i in 0..grains.len() {
            let a = grains.place[i];
            for k in self.list.row(i) {
                let b = grains.place[self.list.other[k] as usize];
                let d = sub([a[0], a[1], a[2]], [b[0], b[1], b[2]]);
                let overlap = a[3] + b[3] - dot(d, d).sqrt();
                if overlap > 0.0 {
                    each(&self.list.pair[k], &self.list.history[k], overlap);
                }
            }
        }
    }
}
