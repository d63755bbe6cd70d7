//! Along one variable, the interval without which the baseline would hold for a channel.

use nalgebra::DMatrix;

use crate::locate::bins::{Along, Bins};
use crate::locate::intervals::{STAYS, goes_on};
use crate::locate::least_squares::least_squares;
use crate::problem::Problem;

/// An interval may hold a smooth departure of so many coefficients (a parabola along the variable).
const SMOOTH: usize = 3;

/// What `rows` gain by a variance of their own, at which they miss by `missed`, a sum of squares: twice the log likelihood ratio.
fn variance_gain(rows: f64, missed: f64) -> f64 {
    missed - rows - rows * (missed / rows).max(1.0).ln()
}

/// What one run's rows of a channel say, whitened as white noise: Gram matrices of nuisance and shared columns, of the departure's, and of
/// the residual.
struct Normals {
    /// By bin along the variable.
    binned: Vec<DMatrix<f64>>,
    /// The other channels' rows.
    others: DMatrix<f64>,
    /// All rows, where nothing departs.
    whole: DMatrix<f64>,
}

/// A channel along one variable.
pub(crate) struct Scan {
    pub(crate) bins: Bins,
    /// By run.
    normals: Vec<Normals>,
    /// Rows in each bin.
    rows: Vec<f64>,
    n_nuisance: usize,
    n_shared: usize,
    /// Sum of squares that the baseline leaves of all rows.
    whole: f64,
}

/// An interval of bins: what it is worth, and by how much the misfit falls without it.
#[derive(Clone, Copy)]
pub(crate) struct Interval {
    pub(crate) worth: f64,
    pub(crate) gain: f64,
    pub(crate) bins: (usize, usize),
}

impl Scan {
    pub(crate) fn new(
        problem: &Problem<'_>,
        columns: &[Vec<Vec<f64>>],
        (n_nuisance, n_shared): (usize, usize),
        channel: usize,
        along: &Along,
    ) -> Option<Self> {
        let bins = Bins::new(problem, channel..channel + 1, along)?;
        let normals = normals(problem, columns, channel, along, &bins);
        let mut rows = vec![0.0; bins.len()];
        for (r, run) in problem.rows.iter().enumerate() {
            for &i in &run.valid[channel] {
                rows[bins.of(along.values[r][i])] += 1.0;
            }
        }
        let mut scan = Self { bins, normals, rows, n_nuisance, n_shared, whole: 0.0 };
        scan.whole = scan.outside((0, 0)).0;
        Some(scan)
    }

    /// The interval that is worth most.
    pub(crate) fn best(&self) -> Option<Interval> {
        let mut best: Option<Interval> = None;
        for from in 0..self.rows.len() {
            for to in from + 1..=self.rows.len() {
                if let Some(here) = self.judge((from, to))
                    && best.is_none_or(|b| here.worth > b.worth)
                {
                    best = Some(here);
                }
            }
        }
        best
    }

    /// An interval holds the misfit if the baseline is right without its rows, which then have a variance of their own, or right up to
    /// a smooth departure there. The variance and the departure's coefficients pay as in Schwarz's criterion.
    fn judge(&self, bins: (usize, usize)) -> Option<Interval> {
        let dropped: f64 = self.rows[bins.0..bins.1].iter().sum();
        if dropped < 1.0 {
            return None;
        }
        let price = self.rows.iter().sum::<f64>().ln();
        let bins_in_all = self.rows.len() as f64;
        // Any of the intervals could have been it.
        let scanned = 2.0 * (0.5 * bins_in_all * (bins_in_all + 1.0)).ln();
        let scanned = if goes_on(bins, self.rows.len()) { scanned - STAYS } else { scanned };
        let missed = self.whole - self.outside(bins).0;
        let freed = Interval {
            worth: variance_gain(dropped, missed) - price - scanned,
            gain: missed - dropped,
            bins,
        };
        let gain = self.whole - self.with_departure(bins);
        let smooth =
            Interval { worth: gain - SMOOTH as f64 * price - scanned, gain: gain - SMOOTH as f64, bins };
        Some(if smooth.worth > freed.worth { smooth } else { freed })
    }

    /// Fits the linearised baseline to the rows outside the bins: sum of squares there, and each run's coefficients.
    pub(crate) fn outside(&self, (from, to): (usize, usize)) -> (f64, Vec<Vec<f64>>) {
        let gram = |run: &Normals| {
            let others = run.others.clone();
            let gram = run.binned[..from].iter().chain(&run.binned[to..]).fold(others, |sum, g| sum + g);
            let departure = self.n_nuisance + self.n_shared;
            gram.remove_rows(departure, SMOOTH).remove_columns(departure, SMOOTH)
        };
        least_squares(self.normals.iter().map(gram), self.n_shared)
    }

    /// Fits the linearised baseline and a smooth departure inside the bins to all rows: sum of squares.
    fn with_departure(&self, (from, to): (usize, usize)) -> f64 {
        let first = self.n_nuisance + self.n_shared;
        let last = first + SMOOTH;
        let gram = |run: &Normals| {
            let mut gram = run.whole.clone();
            for g in &run.binned[from..to] {
                for ((row, column), size) in [((first, 0), (SMOOTH, last)), ((last, first), (1, SMOOTH))] {
                    let mut block = gram.view_mut((row, column), size);
                    block += g.view((row, column), size);
                }
            }
            gram
        };
        least_squares(self.normals.iter().map(gram), self.n_shared + SMOOTH).0
    }
}

/// Columns of a run: nuisance, shared, the departure's powers of the variable, the residual.
fn normals(
    problem: &Problem<'_>,
    columns: &[Vec<Vec<f64>>],
    channel: usize,
    along: &Along,
    bins: &Bins,
) -> Vec<Normals> {
    let of_run = |(r, columns): (usize, &Vec<Vec<f64>>)| {
        let width = columns.len() + SMOOTH;
        let mut binned = vec![DMatrix::zeros(width, width); bins.len()];
        let mut others = DMatrix::zeros(width, width);
        let mut row = vec![0.0; width];
        let known = columns.len() - 1;
        let mut k = 0;
        for c in 0..problem.channels() {
            for &i in &problem.rows[r].valid[c] {
                let x = along.values[r][i];
                let u = bins.along(along.expected[r][i]);
                for (a, column) in row.iter_mut().zip(&columns[..known]) {
                    *a = column[k];
                }
                for (power, a) in row[known..known + SMOOTH].iter_mut().enumerate() {
                    *a = if c == channel { u.powi(power as i32) } else { 0.0 };
                }
                row[width - 1] = columns[known][k];
                let target = if c == channel { &mut binned[bins.of(x)] } else { &mut others };
                for a in 0..width {
                    for b in 0..=a {
                        target[(a, b)] += row[a] * row[b];
                    }
                }
                k += 1;
            }
        }
        let mut whole = binned.iter().fold(others.clone(), |sum, g| sum + g);
        let known = columns.len() - 1;
        whole.rows_mut(known, SMOOTH).fill(0.0);
        whole.columns_mut(known, SMOOTH).fill(0.0);
        Normals { binned, others, whole }
    };
    columns.iter().enumerate().map(of_run).collect()
}
