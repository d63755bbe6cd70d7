//! Where the baseline misses: for each channel the interval of a variable without which the baseline would hold.

use nalgebra::DMatrix;

use crate::diagnosis::Location;
use crate::fit::{Fit, NoiseState, whitened_columns};
use crate::linalg::{RANK_FLOOR, backward, cholesky, dot, forward};
use crate::model::PredictError;
use crate::problem::{Problem, Selection};

/// Intervals have their ends at these quantiles of a variable.
const BINS: usize = 24;

/// A later variable has to hold so much more of the misfit than an earlier one.
const EARLIER: f64 = 1.2;

/// Rows of one run, whitened as white noise, with the bin of each along one variable (`usize::MAX`: another channel).
struct Normals {
    /// `[bin]` Gram matrices of (own, shared, residual) over the channel's rows.
    binned: Vec<DMatrix<f64>>,
    /// The other channels' rows.
    others: DMatrix<f64>,
}

/// The best interval so far: what it is worth, its gain, the variable, the bins and their edges.
type Best = (f64, f64, Option<usize>, (usize, usize), Vec<f64>);

/// Finds the places where the baseline misses, largest share first.
pub(crate) fn locate(
    problem: &Problem<'_>,
    selection: &Selection,
    baseline: &Fit,
    sigma: &[f64],
) -> Result<Vec<Location>, PredictError> {
    let noise = NoiseState { shape: vec![0; sigma.len()], sigma: sigma.to_vec() };
    let columns: Vec<Vec<Vec<f64>>> = (0..problem.rows.len())
        .map(|r| whitened_columns(problem, selection, &noise, r, &baseline.shared, &baseline.own[r]))
        .collect::<Result<_, _>>()?;
    let (n_own, n_shared) = (selection.own.len(), selection.shared.len());
    let width = n_own + n_shared + 1;
    let mut found: Vec<(f64, Location)> = Vec::new();
    for (channel, quantity) in problem.recording.channels.iter().enumerate() {
        let mut best: Option<Best> = None;
        for variable in variables(problem) {
            let edges = edges(problem, channel, variable);
            if edges.len() < 3 {
                continue;
            }
            let normals = normals(problem, &columns, channel, variable, &edges, width);
            let rows: Vec<f64> = (0..edges.len() - 1)
                .map(|b| {
                    let inside = |r: usize, i: usize| bin(value(problem, variable, r, i), &edges) == b;
                    (0..problem.rows.len())
                        .map(|r| {
                            problem.rows[r].valid[channel].iter().filter(|&&i| inside(r, i)).count() as f64
                        })
                        .sum()
                })
                .collect();
            let whole = outside(&normals, (0, 0), n_own, n_shared).0;
            let mut here: Option<Best> = None;
            for from in 0..rows.len() {
                for to in from + 1..=rows.len() {
                    let dropped: f64 = rows[from..to].iter().sum();
                    if dropped < 1.0 {
                        continue;
                    }
                    let gain = whole - outside(&normals, (from, to), n_own, n_shared).0 - dropped;
                    // A row belongs to the interval if it misses by more than noise does twice over.
                    let worth = gain - dropped;
                    if here.as_ref().is_none_or(|b| worth > b.0 * 1.02 + 1e-9) {
                        here = Some((worth, gain, variable, (from, to), edges.clone()));
                    }
                }
            }
            // An earlier variable is the more natural one to name.
            if let Some(here) = here
                && best.as_ref().is_none_or(|b| here.0 > EARLIER * b.0 + 1e-9)
            {
                best = Some(here);
            }
        }
        let Some((_, gain, variable, (from, to), edges)) = best else { continue };
        if gain <= 0.0 {
            continue;
        }
        let normals = normals(problem, &columns, channel, variable, &edges, width);
        let (_, coefficients) = outside(&normals, (from, to), n_own, n_shared);
        let mut residuals: Vec<(usize, f64)> = Vec::new();
        for (r, x) in coefficients.iter().enumerate() {
            let start: usize = (0..channel).map(|c| problem.rows[r].valid[c].len()).sum();
            for (k, &i) in problem.rows[r].valid[channel].iter().enumerate() {
                let b = bin(value(problem, variable, r, i), &edges);
                if b >= from && b < to {
                    let fitted: f64 = x.iter().zip(&columns[r]).map(|(x, c)| x * c[start + k]).sum();
                    residuals.push((r, (columns[r][width - 1][start + k] - fitted) * sigma[channel]));
                }
            }
        }
        let squares = |r: Option<usize>| -> (f64, f64) {
            residuals
                .iter()
                .filter(|(run, _)| r.is_none_or(|r| r == *run))
                .fold((0.0, 0.0), |(s, n), (_, v)| (s + (v / sigma[channel]).powi(2), n + 1.0))
        };
        // A run shows the misfit where its rows exceed the noise at 1 in 1,000.
        let runs = (0..problem.rows.len())
            .filter(|&r| {
                let (sum, n) = squares(Some(r));
                n > 0.0 && sum > n + 3.1 * (2.0 * n).sqrt() + 3.0
            })
            .map(|r| problem.recording.runs[r].label.clone())
            .collect();
        let mean = residuals.iter().map(|(_, v)| v).sum::<f64>() / residuals.len().max(1) as f64;
        let largest =
            residuals.iter().map(|(_, v)| *v).fold(0.0, |a: f64, v| if v.abs() > a.abs() { v } else { a });
        found.push((
            gain,
            Location {
                channel: quantity.name.clone(),
                variable: Some(variable_name(problem, variable)),
                from: edges.get(from).copied(),
                to: edges.get(to).copied(),
                runs,
                share: 0.0,
                mean_residual: mean,
                largest_residual: largest,
                z: gain.sqrt(),
            },
        ));
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

/// The variables along which an interval may lie: the inputs, or the number of the row.
fn variables(problem: &Problem<'_>) -> Vec<Option<usize>> {
    if problem.recording.variables.is_empty() {
        return vec![None];
    }
    let first = problem.recording.noise_along;
    let others = (0..problem.recording.variables.len()).filter(|v| Some(*v) != first);
    first.into_iter().chain(others).map(Some).collect()
}

fn variable_name(problem: &Problem<'_>, variable: Option<usize>) -> String {
    variable.map_or_else(|| "row".into(), |v| problem.recording.variables[v].name.clone())
}

fn value(problem: &Problem<'_>, variable: Option<usize>, run: usize, row: usize) -> f64 {
    variable.map_or(row as f64, |v| problem.recording.runs[run].inputs[v][row])
}

/// Edges of at most [`BINS`] bins with as many rows each.
fn edges(problem: &Problem<'_>, channel: usize, variable: Option<usize>) -> Vec<f64> {
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

fn bin(value: f64, edges: &[f64]) -> usize {
    edges.partition_point(|e| *e <= value).clamp(1, edges.len() - 1) - 1
}

fn normals(
    problem: &Problem<'_>,
    columns: &[Vec<Vec<f64>>],
    channel: usize,
    variable: Option<usize>,
    edges: &[f64],
    width: usize,
) -> Vec<Normals> {
    columns
        .iter()
        .enumerate()
        .map(|(r, columns)| {
            let mut binned = vec![DMatrix::zeros(width, width); edges.len() - 1];
            let mut others = DMatrix::zeros(width, width);
            let mut k = 0;
            for c in 0..problem.channels() {
                for &i in &problem.rows[r].valid[c] {
                    let target = if c == channel {
                        &mut binned[bin(value(problem, variable, r, i), edges)]
                    } else {
                        &mut others
                    };
                    for a in 0..width {
                        for b in 0..=a {
                            target[(a, b)] += columns[a][k] * columns[b][k];
                        }
                    }
                    k += 1;
                }
            }
            Normals { binned, others }
        })
        .collect()
}

/// Fits the linearised baseline to the rows outside the bins `from..to`: sum of squares there, and each run's coefficients.
fn outside(
    normals: &[Normals],
    (from, to): (usize, usize),
    n_own: usize,
    n_shared: usize,
) -> (f64, Vec<Vec<f64>>) {
    let mut information = DMatrix::zeros(n_shared, n_shared);
    let mut right = vec![0.0; n_shared];
    let mut total = 0.0;
    let mut parts = Vec::with_capacity(normals.len());
    let last = n_own + n_shared;
    for run in normals {
        let mut gram = run.others.clone();
        for (b, g) in run.binned.iter().enumerate() {
            if b < from || b >= to {
                gram += g;
            }
        }
        total += gram[(last, last)];
        let mut factor = gram.view((0, 0), (n_own, n_own)).into_owned();
        let kept = cholesky(&mut factor, RANK_FLOOR);
        let border = |j: usize| {
            let mut column: Vec<f64> = (0..n_own).map(|i| gram[(j, i)]).collect();
            forward(&factor, &kept, &mut column);
            column
        };
        let borders: Vec<Vec<f64>> = (n_own..last).map(border).collect();
        let reduced = border(last);
        total -= dot(&reduced, &reduced);
        for i in 0..n_shared {
            for j in 0..=i {
                information[(i, j)] += gram[(n_own + i, n_own + j)] - dot(&borders[i], &borders[j]);
            }
            right[i] += gram[(last, n_own + i)] - dot(&borders[i], &reduced);
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
        .map(|(factor, kept, borders, mut reduced)| {
            for (border, x) in borders.iter().zip(&right) {
                reduced.iter_mut().zip(border).for_each(|(r, b)| *r -= x * b);
            }
            backward(&factor, &kept, &mut reduced);
            reduced.extend_from_slice(&right);
            reduced
        })
        .collect();
    (total.max(0.0), coefficients)
}
