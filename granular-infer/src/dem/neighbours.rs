//! Pairs of grains that may touch, each with the memory of its contact.

use super::{
    cells::Cells,
    contact::{History, Pair},
    grains::Grains,
    vector::{V3, dot, sub},
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
    pub(crate) list: List,
    before: List,
    found: Vec<[u32; 2]>,
    /// Places cell by cell, each with the radius and margin.
    sorted: Vec<[f64; 4]>,
}

/// Rows of neighbours, one after another.
#[derive(Debug, Clone)]
pub(crate) struct List {
    start: Vec<u32>,
    pub(crate) other: Vec<u32>,
    pub(crate) pair: Vec<Pair>,
    pub(crate) history: Vec<History>,
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

    pub(crate) fn row(&self, grain: usize) -> std::ops::Range<usize> {
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
            sorted: Vec::with_capacity(n),
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
        self.sorted.clear();
        self.sorted.extend(cells.entries().iter().map(|&j| {
            let [x, y, z, radius] = grains.place[j as usize];
            [x, y, z, radius + self.margin[j as usize]]
        }));
        for (sorted, &i) in cells.entries().iter().enumerate() {
            let [x, y, z, extent] = self.sorted[sorted];
            let margin = self.margin[i as usize];
            let reach = extent + self.largest + margin;
            let range = |c: f64| cells.along(c - reach)..=cells.along(c + reach);
            let (low, high) = range(x).into_inner();
            for cz in range(z) {
                for cy in range(y) {
                    for run in cells.runs(low, high, cy, cz) {
                        for (&j, p) in cells.entries()[run.clone()].iter().zip(&self.sorted[run]) {
                            let d = sub([x, y, z], [p[0], p[1], p[2]]);
                            let cut = extent + p[3];
                            // Distance first: it says no most of the time, which is guessed well.
                            if dot(d, d) < cut * cut {
                                let other = self.margin[j as usize];
                                let apart = grains.body[i as usize] != grains.body[j as usize];
                                if apart && (other < margin || (other == margin && j > i)) {
                                    self.found.push([i.min(j), i.max(j)]);
                                }
                            }
                        }
                    }
                }
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Sizes, speeds and places of all kinds, on both sides of the origin and of the grid's seam.
    fn crowd(n: usize) -> Grains {
        let wave = |i: usize, k: f64| (k * (i as f64 + 1.0)).sin();
        let radii: Vec<f64> = (0..n).map(|i| 2e-3 * (1.0 + 0.5 * wave(i, 7.1))).collect();
        let places: Vec<V3> = (0..n).map(|i| [3.3, 5.7, 9.1].map(|k| 0.02 * wave(i, k))).collect();
        let mut grains = Grains::new(&radii, &places, 1000.0, 1e-5);
        for (i, m) in grains.motion.iter_mut().enumerate() {
            m.velocity = [wave(i, 2.3).powi(9) * 5.0, 0.0, 0.0];
        }
        grains
    }

    /// The list is what looking at all pairs gives, and histories stay with their pairs.
    #[test]
    fn the_list_has_every_pair() {
        let n = 400;
        let mut grains = crowd(n);
        let mut list = Neighbours::new(&grains);
        for round in 1..4_u64 {
            list.rebuild(&grains, 1e-5);
            for i in 0..n {
                let near: Vec<u32> = (i + 1..n)
                    .filter(|&j| {
                        let (a, b) = (grains.place[i], grains.place[j]);
                        let d = sub([a[0], a[1], a[2]], [b[0], b[1], b[2]]);
                        let cut = a[3] + b[3] + list.margin[i] + list.margin[j];
                        dot(d, d) < cut * cut
                    })
                    .map(|j| j as u32)
                    .collect();
                let row = list.list.row(i);
                assert_eq!(list.list.other[row.clone()], near, "grain {i}");
                for k in row {
                    let name = (i * n) as u64 + u64::from(list.list.other[k]);
                    let known = list.list.history[k].round;
                    assert!(known == 0 || known == name, "a history changed its pair");
                    list.list.history[k].round = name;
                }
            }
            assert!(list.len() > n, "too few pairs to tell");
            grains.place.iter_mut().for_each(|p| p[0] += 1e-3 * (round as f64) * p[1].signum());
        }
    }
}
