//! Where a law departs whose rows are not alone: the interval of a variable in which a smooth departure of each row's own law, carried
//! through the model, explains most.

use nalgebra::DMatrix;

use crate::locate::bins::{bin, edges, value, variables};
use crate::locate::least_squares::least_squares;
use crate::model::{CoupledRows, PredictError};
use crate::problem::Problem;

/// Powers of a variable that a departure may be made of.
const POWERS: usize = 2;

/// For each coefficient of a departure, how much of each power it has.
type Shape = Vec<[f64; POWERS]>;

/// The interval that is worth most.
pub(crate) struct Departure {
    pub(crate) variable: Option<usize>,
    /// Edges of the bins, and which of these it begins and ends with.
    pub(crate) edges: Vec<f64>,
    pub(crate) bins: (usize, usize),
    /// By how much the sum of squares falls, less what coefficients cost.
    pub(crate) worth: f64,
    /// By how much that of each channel falls.
    pub(crate) gains: Vec<f64>,
    /// Each run's coefficients of the baseline's columns where nothing departs.
    pub(crate) baseline: Vec<Vec<f64>>,
}

/// What the baseline leaves: by run, whitened columns of its nuisance and shared parameters and the residual, all as if noise were white.
pub(crate) struct Left<'a> {
    pub(crate) columns: &'a [Vec<Vec<f64>>],
    /// How many of them are of nuisance parameters, and how many shared.
    pub(crate) sizes: (usize, usize),
    pub(crate) shared: &'a [f64],
    pub(crate) sigma: &'a [f64],
}

/// The best interval over all variables, an earlier one unless a later one is worth `earlier` times as much; `None` of a model whose
/// rows are alone.
pub(crate) fn best(
    problem: &Problem<'_>,
    left: &Left<'_>,
    earlier: f64,
) -> Result<Option<Departure>, PredictError> {
    let Some(coupled) = problem.model.extensions().coupled_rows else { return Ok(None) };
    let mut best: Option<(Scan<'_>, Interval)> = None;
    for variable in variables(problem) {
        let Some(scan) = Scan::new(problem, coupled, left, variable)? else { continue };
        if let Some(here) = scan.best()
            && best.as_ref().is_none_or(|(_, b)| here.worth > earlier * b.worth + 1e-9)
        {
            best = Some((scan, here));
        }
    }
    Ok(best.map(|(scan, Interval { bins, shape, worth })| {
        let baseline = scan.solve((0, 0), &[]).1;
        let gains = scan.gains(problem, bins, &shape, &baseline);
        Departure { variable: scan.variable, edges: scan.edges, bins, worth, gains, baseline }
    }))
}

/// Bins, what departs in them, and what that is worth.
struct Interval {
    bins: (usize, usize),
    shape: Shape,
    worth: f64,
}

/// What departures along one variable do.
struct Scan<'a> {
    variable: Option<usize>,
    left: &'a Left<'a>,
    edges: Vec<f64>,
    bins: usize,
    /// By run, one column for each bin and power, as long as the residual.
    departing: Vec<Vec<Vec<f64>>>,
    /// By run: Gram matrix of nuisance and shared columns, those of the departures, and the residual.
    grams: Vec<DMatrix<f64>>,
    /// Sum of squares that the baseline leaves.
    whole: f64,
    rows: f64,
}

impl<'a> Scan<'a> {
    fn new(
        problem: &Problem<'_>,
        coupled: &dyn CoupledRows,
        left: &'a Left<'a>,
        variable: Option<usize>,
    ) -> Result<Option<Self>, PredictError> {
        let edges = edges(problem, 0, variable);
        if edges.len() < 3 {
            return Ok(None);
        }
        let bins = edges.len() - 1;
        let mut departing = vec![Vec::new(); problem.rows.len()];
        for column in 0..bins * POWERS {
            let moved = moved(problem, coupled, left, variable, &edges, column)?;
            departing.iter_mut().zip(moved).for_each(|(run, column)| run.push(column));
        }
        let gram = |(known, departing): (&Vec<Vec<f64>>, &Vec<Vec<f64>>)| {
            let (fixed, residual) = known.split_at(known.len() - 1);
            let all: Vec<&Vec<f64>> = fixed.iter().chain(departing).chain(residual).collect();
            let matrix = DMatrix::from_fn(all[0].len(), all.len(), |i, j| all[j][i]);
            matrix.tr_mul(&matrix)
        };
        let grams: Vec<_> = left.columns.iter().zip(&departing).map(gram).collect();
        let rows = left.columns.iter().map(|run| run[0].len() as f64).sum();
        let mut scan = Self { variable, left, edges, bins, departing, grams, whole: 0.0, rows };
        scan.whole = scan.solve((0, 0), &[]).0;
        Ok(Some(scan))
    }

    fn best(&self) -> Option<Interval> {
        let intervals = (0..self.bins).flat_map(|from| (from + 1..=self.bins).map(move |to| (from, to)));
        let shapes = intervals.flat_map(|bins| self.shapes(bins).into_iter().map(move |shape| (bins, shape)));
        let judged = shapes.map(|(bins, shape)| {
            let price = shape.len() as f64 * self.rows.ln();
            let worth = self.whole - self.solve(bins, &shape).0 - price;
            Interval { bins, shape, worth }
        });
        judged.max_by(|a, b| a.worth.total_cmp(&b.worth))
    }

    /// A departure that is even all through the interval, one from zero at either of its ends, and a straight line.
    fn shapes(&self, (from, to): (usize, usize)) -> [Shape; 4] {
        let rising = |edge: usize| [-along(self.edges[edge], &self.edges), 1.0];
        let even = [1.0, 0.0];
        [vec![even], vec![rising(from)], vec![rising(to)], vec![even, [0.0, 1.0]]]
    }

    /// Fits the linearised baseline and a departure inside the bins: sum of squares that is left, coefficients of each run.
    fn solve(&self, (from, to): (usize, usize), shape: &[[f64; POWERS]]) -> (f64, Vec<Vec<f64>>) {
        let (n_nuisance, n_shared) = self.left.sizes;
        let known = n_nuisance + n_shared;
        let last = known + self.bins * POWERS;
        let mut gather = DMatrix::zeros(last + 1, known + shape.len() + 1);
        gather.view_mut((0, 0), (known, known)).fill_with_identity();
        gather[(last, known + shape.len())] = 1.0;
        for (column, weights) in shape.iter().enumerate() {
            for bin in from..to {
                for (power, weight) in weights.iter().enumerate() {
                    gather[(known + bin * POWERS + power, known + column)] = *weight;
                }
            }
        }
        let gathered = self.grams.iter().map(|gram| gather.tr_mul(&(gram * &gather)));
        least_squares(gathered, n_shared + shape.len())
    }

    /// By how much each channel's sum of squares falls.
    fn gains(
        &self,
        problem: &Problem<'_>,
        bins: (usize, usize),
        shape: &[[f64; POWERS]],
        without: &[Vec<f64>],
    ) -> Vec<f64> {
        let known = self.left.sizes.0 + self.left.sizes.1;
        let with = self.solve(bins, shape).1;
        let mut gains = vec![0.0; problem.channels()];
        for (r, run) in problem.rows.iter().enumerate() {
            let (columns, departing) = (&self.left.columns[r], &self.departing[r]);
            let fitted = |x: &[f64], row: usize| -> f64 { (0..known).map(|k| x[k] * columns[k][row]).sum() };
            let departs = |row: usize| -> f64 {
                let of_power = |power: usize| -> f64 {
                    (bins.0..bins.1).map(|b| departing[b * POWERS + power][row]).sum()
                };
                let powers: [f64; POWERS] = std::array::from_fn(of_power);
                let of_weights =
                    |weights: &[f64; POWERS]| -> f64 { weights.iter().zip(powers).map(|(w, p)| w * p).sum() };
                shape.iter().zip(&with[r][known..]).map(|(weights, x)| x * of_weights(weights)).sum()
            };
            let channels =
                run.valid.iter().enumerate().flat_map(|(channel, valid)| valid.iter().map(move |_| channel));
            for (row, channel) in channels.enumerate() {
                let measured = columns[known][row];
                let before = measured - fitted(&without[r], row);
                let after = measured - fitted(&with[r], row) - departs(row);
                gains[channel] += before * before - after * after;
            }
        }
        gains
    }
}

/// A variable's value within its edges, from -1 to 1.
fn along(x: f64, edges: &[f64]) -> f64 {
    let (low, high) = (edges[0], edges[edges.len() - 1]);
    2.0 * (x - low) / (high - low) - 1.0
}

/// What a departure does to the readings, by run: along the variable as a power, in one bin. Columns count powers, then bins.
fn moved(
    problem: &Problem<'_>,
    coupled: &dyn CoupledRows,
    left: &Left<'_>,
    variable: Option<usize>,
    edges: &[f64],
    column: usize,
) -> Result<Vec<Vec<f64>>, PredictError> {
    let (in_bin, power) = (column / POWERS, (column % POWERS) as i32);
    let runs = &problem.recording.runs;
    let amount = |run: usize, row: usize| {
        let x = value(problem, variable, run, row);
        let within = bin(x, edges) == in_bin;
        if within { along(x, edges).powi(power) } else { 0.0 }
    };
    let amounts: Vec<Vec<f64>> =
        (0..runs.len()).map(|run| (0..runs[run].len()).map(|row| amount(run, row)).collect()).collect();
    let moved = coupled.perturbation_response(runs, left.shared, &amounts)?;
    let white = |(run, moved): (usize, Vec<f64>)| {
        let channel = |channel: usize| {
            let picked = problem.pick(run, channel, &moved);
            picked.into_iter().map(move |v| v / left.sigma[channel])
        };
        (0..problem.channels()).flat_map(channel).collect()
    };
    Ok(moved.into_iter().enumerate().map(white).collect())
}
