//! Points gathered in square cells: what hangs together, and where it is highest.

use nalgebra::{SMatrix, SVector};

/// Square cells over the points' extent.
pub(super) struct Grid {
    cell_m: f64,
    origin: [f64; 2],
    columns: usize,
    rows: usize,
    counts: Vec<u32>,
}

/// More cells than this along one side would be an extent of many metres: cells grow instead.
const MOST_ALONG: f64 = 2000.0;
/// Cells about the highest one through whose medians a quadric is laid, to each side.
const PATCH: usize = 3;
/// Part of the height above which a cell belongs to the top.
const LEAST_HEIGHT: f64 = 0.85;
/// Cells that a quadric needs.
const LEAST_CELLS: usize = 18;

impl Grid {
    pub(super) fn new(points: &[[f64; 3]], cell_m: f64) -> Self {
        let extent = |k: usize| {
            let values = points.iter().map(|p| p[k]);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
        };
        let ((x0, x1), (y0, y1)) = (extent(0), extent(1));
        if points.is_empty() {
            return Self { cell_m, origin: [0.0; 2], columns: 0, rows: 0, counts: Vec::new() };
        }
        let cell_m = cell_m.max((x1 - x0) / MOST_ALONG).max((y1 - y0) / MOST_ALONG);
        let (columns, rows) = (((x1 - x0) / cell_m) as usize + 1, ((y1 - y0) / cell_m) as usize + 1);
        let mut grid = Self { cell_m, origin: [x0, y0], columns, rows, counts: vec![0; columns * rows] };
        for p in points {
            let at = grid.cell(p);
            grid.counts[at] += 1;
        }
        grid
    }

    fn cell(&self, p: &[f64; 3]) -> usize {
        let at = |k: usize, most: usize| (((p[k] - self.origin[k]) / self.cell_m) as usize).min(most - 1);
        at(1, self.rows) * self.columns + at(0, self.columns)
    }

    /// Cells beside one, itself included.
    fn around(&self, at: usize, reach: usize) -> impl Iterator<Item = usize> + '_ {
        let (row, column) = (at / self.columns, at % self.columns);
        let rows = row.saturating_sub(reach)..(row + reach + 1).min(self.rows);
        let columns = column.saturating_sub(reach)..(column + reach + 1).min(self.columns);
        rows.flat_map(move |r| columns.clone().map(move |c| r * self.columns + c))
    }

    /// The points of the connected cells that hold most of them. Cells with far fewer points than usual (flying points) join
    /// nothing.
    pub(super) fn largest(&self, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut filled: Vec<u32> = self.counts.iter().copied().filter(|c| *c > 0).collect();
        if filled.is_empty() {
            return Vec::new();
        }
        let middle = filled.len() / 2;
        // A lone point is a flying one, save where cells are as small as the distance of the points.
        let usual = *filled.select_nth_unstable(middle).1;
        let least = (usual / 3 + 1).min(3);
        let mut label = vec![0_u32; self.counts.len()];
        let (mut stack, mut best, mut labels) = (Vec::new(), (0_u64, 0_u32), 0);
        for seed in 0..self.counts.len() {
            if self.counts[seed] < least || label[seed] != 0 {
                continue;
            }
            labels += 1;
            let mut total = 0;
            label[seed] = labels;
            stack.push(seed);
            while let Some(at) = stack.pop() {
                total += u64::from(self.counts[at]);
                for beside in self.around(at, 1) {
                    if self.counts[beside] >= least && label[beside] == 0 {
                        label[beside] = labels;
                        stack.push(beside);
                    }
                }
            }
            if total > best.0 {
                best = (total, labels);
            }
        }
        points.iter().filter(|p| label[self.cell(p)] == best.1).copied().collect()
    }

    /// Height and place of the top; sorts the points by their cells. None where no cell holds enough points.
    pub(super) fn top(&self, points: &mut [[f64; 3]]) -> Option<(f64, [f64; 2])> {
        points.sort_unstable_by_key(|p| self.cell(p));
        let mut medians = vec![f64::NAN; self.counts.len()];
        for cell in points.chunk_by_mut(|a, b| self.cell(a) == self.cell(b)) {
            let (at, middle) = (self.cell(&cell[0]), cell.len() / 2);
            medians[at] = cell.select_nth_unstable_by(middle, |a, b| a[2].total_cmp(&b[2])).1[2];
        }
        // The median over a cell and those beside it is not moved by a few bad cells.
        let mut near = Vec::with_capacity(9);
        let mut smooth = |at: usize| {
            near.clear();
            near.extend(self.around(at, 1).map(|k| medians[k]).filter(|m| m.is_finite()));
            let middle = near.len() / 2;
            if near.len() < 6 { f64::NAN } else { *near.select_nth_unstable_by(middle, f64::total_cmp).1 }
        };
        let smoothed: Vec<f64> = (0..medians.len()).map(&mut smooth).collect();
        let finite = smoothed.iter().enumerate().filter(|(_, m)| m.is_finite());
        let (at, &level) = finite.max_by(|a, b| a.1.total_cmp(b.1))?;
        // A cell that stands out from all beside it is no dough.
        for (median, smooth) in medians.iter_mut().zip(&smoothed) {
            if !((*median - smooth).abs() < 0.2 * level) {
                *median = f64::NAN;
            }
        }
        Some(self.summit(&medians, at, level))
    }

    /// The highest point of the quadric through the medians about a cell; the cell itself where there is no such quadric.
    fn summit(&self, medians: &[f64], at_cell: usize, level: f64) -> (f64, [f64; 2]) {
        let place = |k: usize| [(k % self.columns) as f64, (k / self.columns) as f64];
        let [c, r] = place(at_cell);
        let reach = PATCH as f64 + 0.5;
        let row = |u: f64, v: f64| SVector::<f64, 6>::new(1.0, u, v, u * u, u * v, v * v);
        let (mut a, mut b) = (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros());
        let mut cells = 0;
        for k in self.around(at_cell, PATCH) {
            let [x, y] = place(k);
            let (u, v) = ((x - c) / reach, (y - r) / reach);
            // Steep flanks are no part of the top: an ellipse is a parabola only near it.
            if medians[k] > LEAST_HEIGHT * level {
                a += row(u, v) * row(u, v).transpose();
                b += row(u, v) * medians[k];
                cells += 1;
            }
        }
        let metres = |u: f64, v: f64| {
            [
                self.origin[0] + (c + 0.5 + u * reach) * self.cell_m,
                self.origin[1] + (r + 0.5 + v * reach) * self.cell_m,
            ]
        };
        let Some(k) = a.cholesky().map(|f| f.solve(&b)).filter(|_| cells >= LEAST_CELLS) else {
            return (level, metres(0.0, 0.0));
        };
        let at = |u: f64, v: f64| row(u, v).dot(&k);
        // The vertex of a quadric may be a saddle or far off; the best place of a cell that was seen is neither.
        let seen = self.around(at_cell, PATCH).filter(|k| medians[*k] > LEAST_HEIGHT * level);
        let third = 1.0 / (3.0 * reach);
        let places = seen.flat_map(|k| {
            let [x, y] = place(k);
            let (u, v) = ((x - c) / reach, (y - r) / reach);
            [-third, 0.0, third].into_iter().flat_map(move |a| [-third, 0.0, third].map(|b| (u + a, v + b)))
        });
        let inner = places.filter(|(u, v)| u.abs() < 0.5 && v.abs() < 0.5);
        let (u, v) =
            inner.fold((0.0, 0.0), |best, p| if at(p.0, p.1) > at(best.0, best.1) { p } else { best });
        let top = at(u, v);
        // A quadric over a few cells at an end of the dough may rise out of it.
        if (top - level).abs() < 0.05 * level { (top, metres(u, v)) } else { (level, metres(0.0, 0.0)) }
    }
}
