//! Where the baseline misses: for each channel the interval of a variable without which the baseline would hold.

use nalgebra::DMatrix;

use crate::diagnosis::Location;
use crate::fit::gauss_newton::{Fit, NoiseState, whitened_columns};
use crate::linalg::{RANK_FLOOR, back_substitute, backward, cholesky, dot, forward};
use crate::locate::departure::{self, Departure, Left};
use crate::model::PredictError;
use crate::problem::{Problem, Selection};

/// Intervals have their ends at these quantiles of a variable.
const BINS: usize = 24;

/// A later variable has to hold so much more of the misfit than an earlier one.
const EARLIER: f64 = 1.2;

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
struct Scan {
    variable: Option<usize>,
    edges: Vec<f64>,
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
struct Interval {
    worth: f64,
    gain: f64,
    bins: (usize, usize),
}

impl Scan {
    fn new(
        problem: &Problem<'_>,
        columns: &[Vec<Vec<f64>>],
        (n_nuisance, n_shared): (usize, usize),
        channel: usize,
        variable: Option<usize>,
    ) -> Option<Self> {
        let edges = edges(problem, channel, variable);
        if edges.len() < 3 {
            return None;
        }
        let normals = normals(problem, columns, channel, variable, &edges);
        let mut rows = vec![0.0; edges.len() - 1];
        for (r, run) in problem.rows.iter().enumerate() {
            for &i in &run.valid[channel] {
                rows[bin(value(problem, variable, r, i), &edges)] += 1.0;
            }
        }
        let mut scan = Self { variable, edges, normals, rows, n_nuisance, n_shared, whole: 0.0 };
        scan.whole = scan.outside((0, 0)).0;
        Some(scan)
    }

    /// The interval that is worth most.
    fn best(&self) -> Option<Interval> {
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
        let missed = self.whole - self.outside(bins).0;
        let freed = Interval { worth: variance_gain(dropped, missed) - price, gain: missed - dropped, bins };
        let gain = self.whole - self.departing(bins);
        let smooth = Interval { worth: gain - SMOOTH as f64 * price, gain: gain - SMOOTH as f64, bins };
        Some(if smooth.worth > freed.worth { smooth } else { freed })
    }

    /// Fits the linearised baseline to the rows outside the bins: sum of squares there, and each run's coefficients.
    fn outside(&self, (from, to): (usize, usize)) -> (f64, Vec<Vec<f64>>) {
        let gram = |run: &Normals| {
            let others = run.others.clone();
            run.binned[..from].iter().chain(&run.binned[to..]).fold(others, |sum, g| sum + g)
        };
        solve(self.normals.iter().map(gram), self.n_nuisance, self.n_shared)
    }

    /// Fits the linearised baseline and a smooth departure inside the bins to all rows: sum of squares.
    fn departing(&self, (from, to): (usize, usize)) -> f64 {
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
        solve(self.normals.iter().map(gram), self.n_nuisance, self.n_shared + SMOOTH).0
    }
}

/// Finds the places where the baseline misses, largest share first.
pub(crate) fn locate(
    problem: &Problem<'_>,
    selection: &Selection,
    baseline: &Fit,
    sigma: &[f64],
) -> Result<Vec<Location>, PredictError> {
    let noise = NoiseState { shape: vec![0; sigma.len()], sigma: sigma.to_vec() };
    let columns: Vec<Vec<Vec<f64>>> = (0..problem.rows.len())
        .map(|r| whitened_columns(problem, selection, &noise, r, &baseline.shared, &baseline.nuisance[r]))
        .collect::<Result<_, _>>()?;
    let sizes = (selection.nuisance.len(), selection.shared.len());
    let mut found: Vec<(f64, Location)> = Vec::new();
    let mut worth = 0.0;
    for channel in 0..problem.channels() {
        let mut best: Option<(Scan, Interval)> = None;
        for variable in variables(problem) {
            let Some(scan) = Scan::new(problem, &columns, sizes, channel, variable) else { continue };
            // An earlier variable is the more natural one to name.
            if let Some(here) = scan.best()
                && best.as_ref().is_none_or(|(_, b)| here.worth > EARLIER * b.worth + 1e-9)
            {
                best = Some((scan, here));
            }
        }
        if let Some((scan, Interval { gain, bins, worth: here })) = best.filter(|(_, b)| b.gain > 0.0) {
            let (Scan { variable, edges, .. }, (_, coefficients)) = (&scan, scan.outside(bins));
            let scanned = Scanned { variable: *variable, edges, bins, coefficients: &coefficients };
            found.push((gain, place(problem, &columns, sigma, channel, &scanned, gain)));
            worth += here;
        }
    }
    let left = Left { columns: &columns, sizes, shared: &baseline.shared, sigma };
    // One departure of the law is more natural than one of each channel by itself.
    if let Some(departure) = departure::best(problem, &left, EARLIER)?
        && worth <= EARLIER * departure.worth
    {
        let Departure { variable, edges, bins, gains, baseline, .. } = departure;
        let scanned = Scanned { variable, edges: &edges, bins, coefficients: &baseline };
        let gaining = gains.into_iter().enumerate().filter(|(_, gain)| *gain > 0.0);
        found = gaining.map(|(c, gain)| (gain, place(problem, &columns, sigma, c, &scanned, gain))).collect();
    }
    let total: f64 = found.iter().map(|(gain, _)| gain).sum();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    // With some 300 intervals a variable and a few variables, noise alone reaches a gain of about 20.
    let largest = found.first().map_or(0.0, |f| f.0);
    Ok(found
        .into_iter()
        .filter(|(gain, _)| *gain >= 25.0 || *gain == largest)
        .map(|(gain, mut location)| {
            location.share = gain / total;
            location
        })
        .collect())
}

/// Bins along a variable, and the coefficients of each run's columns at which the baseline is right outside.
struct Scanned<'a> {
    variable: Option<usize>,
    edges: &'a [f64],
    bins: (usize, usize),
    coefficients: &'a [Vec<f64>],
}

/// An interval as a place: what the rows in it miss where the baseline is fitted to the others.
fn place(
    problem: &Problem<'_>,
    columns: &[Vec<Vec<f64>>],
    sigma: &[f64],
    channel: usize,
    scanned: &Scanned<'_>,
    gain: f64,
) -> Location {
    let &Scanned { variable, edges, bins: (from, to), coefficients } = scanned;
    let mut residuals: Vec<(usize, f64)> = Vec::new();
    for (r, x) in coefficients.iter().enumerate() {
        let start: usize = (0..channel).map(|c| problem.rows[r].valid[c].len()).sum();
        for (k, &i) in problem.rows[r].valid[channel].iter().enumerate() {
            let b = bin(value(problem, variable, r, i), edges);
            if b >= from && b < to {
                let fitted: f64 = x.iter().zip(&columns[r]).map(|(x, c)| x * c[start + k]).sum();
                let measured = columns[r].last().map_or(0.0, |c| c[start + k]);
                residuals.push((r, (measured - fitted) * sigma[channel]));
            }
        }
    }
    let squares = |r: usize| -> (f64, f64) {
        residuals
            .iter()
            .filter(|(run, _)| r == *run)
            .fold((0.0, 0.0), |(s, n), (_, v)| (s + (v / sigma[channel]).powi(2), n + 1.0))
    };
    // A run shows the misfit where its rows exceed the noise at 1 in 1,000.
    let runs = (0..problem.rows.len())
        .filter(|&r| {
            let (sum, n) = squares(r);
            n > 0.0 && sum > n + 3.1 * (2.0 * n).sqrt() + 3.0
        })
        .map(|r| problem.recording.runs[r].label.clone())
        .collect();
    let mean = residuals.iter().map(|(_, v)| v).sum::<f64>() / residuals.len().max(1) as f64;
    let largest =
        residuals.iter().map(|(_, v)| *v).fold(0.0, |a: f64, v| if v.abs() > a.abs() { v } else { a });
    Location {
        channel: problem.recording.channels[channel].name.clone(),
        variable: Some(variable_name(problem, variable)),
        from: edges.get(from).copied(),
        to: edges.get(to).copied(),
        runs,
        share: 0.0,
        mean_residual: mean,
        largest_residual: largest,
        z: gain.sqrt(),
    }
}

/// The variables along which an interval may lie: the inputs, in the order of the recording, or the number of the row.
pub(crate) fn variables(problem: &Problem<'_>) -> Vec<Option<usize>> {
    if problem.recording.variables.is_empty() {
        return vec![None];
    }
    (0..problem.recording.variables.len()).map(Some).collect()
}

fn variable_name(problem: &Problem<'_>, variable: Option<usize>) -> String {
    variable.map_or_else(|| "row".into(), |v| problem.recording.variables[v].name.clone())
}

pub(crate) fn value(problem: &Problem<'_>, variable: Option<usize>, run: usize, row: usize) -> f64 {
    variable.map_or(row as f64, |v| problem.recording.runs[run].inputs[v][row])
}

/// Edges of at most [`BINS`] bins with as many rows each.
pub(crate) fn edges(problem: &Problem<'_>, channel: usize, variable: Option<usize>) -> Vec<f64> {
    let mut values: Vec<f64> = (0..problem.rows.len())
        .flat_map(|r| problem.rows[r].valid[channel].iter().map(move |&i| (r, i)))
        .map(|(r, i)| value(problem, variable, r, i))
        .collect();
    values.sort_by(f64::total_cmp);
    if values.is_empty() {
        return values;
    }
    let last = values.len() - 1;
    let mut edges: Vec<f64> = (0..=BINS).map(|k| values[k * last / BINS]).collect();
    edges.dedup();
    edges
}

pub(crate) fn bin(value: f64, edges: &[f64]) -> usize {
    edges.partition_point(|e| *e <= value).clamp(1, edges.len() - 1) - 1
}

/// Columns of a run: nuisance, shared, the departure's powers of the variable, the residual.
fn normals(
    problem: &Problem<'_>,
    columns: &[Vec<Vec<f64>>],
    channel: usize,
    variable: Option<usize>,
    edges: &[f64],
) -> Vec<Normals> {
    let (low, high) = (edges[0], edges[edges.len() - 1]);
    let of_run = |(r, columns): (usize, &Vec<Vec<f64>>)| {
        let width = columns.len() + SMOOTH;
        let mut binned = vec![DMatrix::zeros(width, width); edges.len() - 1];
        let mut others = DMatrix::zeros(width, width);
        let mut row = vec![0.0; width];
        let mut k = 0;
        for c in 0..problem.channels() {
            for &i in &problem.rows[r].valid[c] {
                let x = value(problem, variable, r, i);
                let u = 2.0 * (x - low) / (high - low) - 1.0;
                let known = columns.len() - 1;
                for (a, column) in row.iter_mut().zip(&columns[..known]) {
                    *a = column[k];
                }
                for (power, a) in row[known..known + SMOOTH].iter_mut().enumerate() {
                    *a = if c == channel { u.powi(power as i32) } else { 0.0 };
                }
                row[width - 1] = columns[known][k];
                let target = if c == channel { &mut binned[bin(x, edges)] } else { &mut others };
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

/// Least squares over runs from the lower triangles of their Gram matrices: `n_nuisance` columns of each run's nuisance parameters, `n_free` of all, the
/// residual last. Sum of squares that is left, and each run's coefficients.
pub(crate) fn solve(
    grams: impl Iterator<Item = DMatrix<f64>>,
    n_nuisance: usize,
    n_free: usize,
) -> (f64, Vec<Vec<f64>>) {
    let mut information = DMatrix::zeros(n_free, n_free);
    let mut right = vec![0.0; n_free];
    let mut total = 0.0;
    let mut parts = Vec::new();
    for gram in grams {
        let last = gram.ncols() - 1;
        total += gram[(last, last)];
        let mut factor = gram.view((0, 0), (n_nuisance, n_nuisance)).into_owned();
        let kept = cholesky(&mut factor, RANK_FLOOR);
        let border = |j: usize| {
            let mut column: Vec<f64> = (0..n_nuisance).map(|i| gram[(j, i)]).collect();
            forward(&factor, &kept, &mut column);
            column
        };
        let borders: Vec<Vec<f64>> = (n_nuisance..n_nuisance + n_free).map(border).collect();
        let reduced = border(last);
        total -= dot(&reduced, &reduced);
        for i in 0..n_free {
            for j in 0..=i {
                information[(i, j)] += gram[(n_nuisance + i, n_nuisance + j)] - dot(&borders[i], &borders[j]);
            }
            right[i] += gram[(last, n_nuisance + i)] - dot(&borders[i], &reduced);
        }
        parts.push((factor, kept, borders, reduced));
    }
    let gradient = right.clone();
    let kept = cholesky(&mut information, RANK_FLOOR);
    forward(&information, &kept, &mut right);
    backward(&information, &kept, &mut right);
    total -= dot(&gradient, &right);
    let coefficients = parts
        .into_iter()
        .map(|(factor, kept, borders, reduced)| {
            let mut all = back_substitute(&factor, &kept, &borders, reduced, &right);
            all.extend_from_slice(&right);
            all
        })
        .collect();
    (total.max(0.0), coefficients)
}
