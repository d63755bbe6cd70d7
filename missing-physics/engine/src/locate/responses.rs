//! What a component of an unknown does in each bin of a variable, as sums by which any interval in any runs is judged at once.

use nalgebra::DMatrix;

use crate::fit::optimum::Fit;
use crate::locate::bins::{Along, Bins};
use crate::locate::projection::{Projection, dot};
use crate::locate::unknowns::Unknown;
use crate::model::PredictError;
use crate::problem::Problem;

/// Powers of a variable that a size may be made of.
const POWERS: usize = 3;

/// A square that is less than this part of the terms it is the sum of is none.
const ROUNDING: f64 = 1e-10;

/// How the size goes along the variable within the interval: even, or from zero at its beginning or end, straight or bent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    Even,
    Straight(Edge),
    Bent(Edge),
}

/// An edge of an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Edge {
    Begin,
    End,
}

impl Form {
    pub(crate) const ALL: [Self; 5] = [
        Self::Even,
        Self::Straight(Edge::Begin),
        Self::Straight(Edge::End),
        Self::Bent(Edge::Begin),
        Self::Bent(Edge::End),
    ];

    /// How many sizes it is made of.
    pub(crate) fn sizes(self) -> usize {
        if matches!(self, Self::Bent(_)) { 2 } else { 1 }
    }

    /// How much each of its sizes has of each power.
    fn weights(self, bins: &Bins, (from, to): (usize, usize)) -> [[f64; POWERS]; 2] {
        let (Self::Straight(edge) | Self::Bent(edge)) = self else { return [[1.0, 0.0, 0.0], [0.0; POWERS]] };
        let zero = bins.edge(if edge == Edge::Begin { from } else { to });
        let bend = if self.sizes() > 1 { [zero * zero, -2.0 * zero, 1.0] } else { [0.0; POWERS] };
        [[-zero, 1.0, 0.0], bend]
    }
}

/// An effect over some runs, of up to two sizes: their products with the residual, their squares and cross product beside nuisance
/// parameters, and what they have along shared ones.
#[derive(Debug, Clone, Default)]
pub(crate) struct Effect {
    product: [f64; 2],
    square: [f64; 2],
    cross: f64,
    along_shared: Vec<[f64; 2]>,
}

impl Effect {
    /// Adds that of other runs.
    pub(crate) fn add(&mut self, other: &Self) {
        self.along_shared.resize(other.along_shared.len(), [0.0; 2]);
        for k in 0..2 {
            self.product[k] += other.product[k];
            self.square[k] += other.square[k];
            self.along_shared.iter_mut().zip(&other.along_shared).for_each(|(a, b)| a[k] += b[k]);
        }
        self.cross += other.cross;
    }

    /// The product of two sizes beside all parameters.
    fn beside(&self, product: f64, (a, b): (usize, usize)) -> f64 {
        product - self.along_shared.iter().map(|along| along[a] * along[b]).sum::<f64>()
    }

    /// The first size's square beside all parameters; zero where hardly anything is left beside them.
    fn first(&self) -> f64 {
        determined(self.beside(self.square[0], (0, 0)), self.square[0])
    }

    /// How much of the first size the second has, and its square beside that; `None` where that is not determined.
    fn second(&self, first: f64) -> Option<(f64, f64)> {
        let part = self.beside(self.cross, (0, 1)) / first;
        let second = self.beside(self.square[1], (1, 1)) - part * part * first;
        let second = determined(second, self.square[1]);
        (second > 0.0).then_some((part, second))
    }

    /// By how much the sum of squares falls.
    pub(crate) fn gain(&self) -> f64 {
        let first = self.first();
        if first <= 0.0 {
            return 0.0;
        }
        let gain = self.product[0] * self.product[0] / first;
        let Some((part, second)) = self.second(first) else { return gain };
        gain + (self.product[1] - part * self.product[0]).powi(2) / second
    }

    /// Both sizes that fit best together; the second is zero where it is not determined.
    fn sizes(&self) -> [f64; 2] {
        let first = self.first();
        let Some((part, second)) = self.second(first) else { return [self.size(), 0.0] };
        let bent = (self.product[1] - part * self.product[0]) / second;
        [self.product[0] / first - part * bent, bent]
    }

    /// The largest size of a form within an interval of bins, where it fits best; not a number where that is not determined.
    pub(crate) fn largest(&self, form: Form, bins: &Bins, (from, to): (usize, usize)) -> f64 {
        let [one, other] = self.sizes();
        let (Form::Straight(edge) | Form::Bent(edge)) = form else { return one.abs() };
        let width = (bins.edge(to) - bins.edge(from)) * if edge == Edge::Begin { 1.0 } else { -1.0 };
        // At the far end, and where the parabola turns.
        let turns = (-0.5 * one / other).clamp(width.min(0.0), width.max(0.0));
        let at = |x: f64| (one * x + other * x * x).abs();
        if other == 0.0 { at(width) } else { at(width).max(at(turns)) }
    }

    /// The first size that fits best; not a number where it is not determined.
    pub(crate) fn size(&self) -> f64 {
        self.product[0] / self.first()
    }
}

/// A square beside others that hardly anything is left of is zero.
fn determined(beside: f64, square: f64) -> f64 {
    if beside > 1e-6 * square { beside } else { 0.0 }
}

/// Sums of one run: of the columns that all bins before an edge give, power by power.
struct OfRun {
    squares: DMatrix<f64>,
    products: Vec<f64>,
    /// `[direction][column]`.
    along_shared: Vec<Vec<f64>>,
}

/// What a component does.
pub(crate) struct Responses {
    bins: usize,
    runs: Vec<OfRun>,
}

/// How much a component has at each row of each run: a function of the variable (from -1 to 1), within some bins and runs.
fn amounts(
    along: &Along,
    bins: &Bins,
    size: impl Fn(f64) -> f64,
    within: impl Fn(usize, usize) -> bool,
) -> Vec<Vec<f64>> {
    let of_row = |run: usize, (x, expected): (&f64, &f64)| {
        if within(run, bins.of(*x)) { size(bins.along(*expected)) } else { 0.0 }
    };
    let of_run = |(run, (values, expected)): (usize, (&Vec<f64>, &Vec<f64>))| {
        values.iter().zip(expected).map(|row| of_row(run, row)).collect()
    };
    along.values.iter().zip(&along.expected).enumerate().map(of_run).collect()
}

/// What is asked of: a component of an unknown, along a variable.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    pub(crate) problem: &'a Problem<'a>,
    pub(crate) fit: &'a Fit,
    pub(crate) sigma: &'a [f64],
    pub(crate) unknown: &'a Unknown<'a>,
    pub(crate) component: usize,
    pub(crate) along: &'a Along,
    pub(crate) bins: &'a Bins,
}

/// What a size of a form does.
pub(crate) struct Column {
    /// By run.
    pub(crate) moved: Vec<Vec<f64>>,
    /// Its mean over the rows at which it acts.
    pub(crate) mean: f64,
}

impl Asked<'_> {
    /// What each size of a form does in an interval and some runs.
    pub(crate) fn columns(
        &self,
        interval: (usize, usize),
        form: Form,
        runs: &[bool],
    ) -> Result<Vec<Column>, PredictError> {
        let within = |run: usize, bin: usize| runs[run] && bin >= interval.0 && bin < interval.1;
        let rows = amounts(self.along, self.bins, |_| 1.0, within).into_iter().flatten().sum::<f64>();
        let of_size = |weights: &[f64; POWERS]| {
            let size = |x: f64| weights.iter().rev().fold(0.0, |sum, weight| sum * x + weight);
            let all = amounts(self.along, self.bins, size, within);
            let sum: f64 = all.iter().flatten().sum();
            let moved = self.unknown.response(self.problem, self.fit, self.sigma, self.component, all)?;
            Ok(Column { moved, mean: sum / rows.max(1.0) })
        };
        form.weights(self.bins, interval)[..form.sizes()].iter().map(of_size).collect()
    }

    /// What a unit at some rows does, `acts[run][row]`.
    pub(crate) fn at_rows(&self, acts: &[Vec<bool>]) -> Result<Column, PredictError> {
        let amounts = acts.iter().map(|run| run.iter().map(|&acts| f64::from(u8::from(acts))).collect());
        let moved =
            self.unknown.response(self.problem, self.fit, self.sigma, self.component, amounts.collect())?;
        Ok(Column { moved, mean: 1.0 })
    }
}

impl Responses {
    pub(crate) fn new(asked: &Asked<'_>, projection: &Projection) -> Result<Self, PredictError> {
        let Asked { problem, fit, sigma, unknown, component, along, bins } = *asked;
        let edges = bins.len() + 1;
        let runs = problem.rows.len();
        let mut columns: Vec<Vec<Vec<f64>>> = vec![Vec::with_capacity(POWERS * edges); runs];
        let placed = |(values, expected): (&Vec<f64>, &Vec<f64>)| {
            values.iter().zip(expected).map(|(x, e)| (bins.of(*x), bins.along(*e))).collect()
        };
        let rows: Vec<Vec<(usize, f64)>> = along.values.iter().zip(&along.expected).map(placed).collect();
        let only = |power: usize, bin: usize| -> Vec<Vec<f64>> {
            let size = |&(b, x): &(usize, f64)| if b == bin { x.powi(power as i32) } else { 0.0 };
            rows.iter().map(|run| run.iter().map(size).collect()).collect()
        };
        let all_bins: Vec<Vec<Vec<f64>>> = (0..POWERS)
            .flat_map(|power| (0..bins.len()).map(move |bin| (power, bin)))
            .map(|(power, bin)| only(power, bin))
            .collect();
        let mut by_bin = unknown.responses(problem, fit, sigma, component, &all_bins)?.into_iter();
        drop(all_bins);
        for _ in 0..POWERS {
            let mut sums: Vec<Vec<f64>> = projection.residual.iter().map(|r| vec![0.0; r.len()]).collect();
            columns.iter_mut().zip(&sums).for_each(|(all, sum)| all.push(sum.clone()));
            for moved in by_bin.by_ref().take(bins.len()) {
                for (run, (sum, mut moved)) in sums.iter_mut().zip(moved).enumerate() {
                    projection.beside_nuisance(run, &mut moved);
                    sum.iter_mut().zip(moved).for_each(|(s, m)| *s += m);
                    columns[run].push(sum.clone());
                }
            }
        }
        let of_run = |(run, columns): (usize, Vec<Vec<f64>>)| {
            let rows = projection.residual[run].len();
            let matrix = DMatrix::from_fn(rows, columns.len(), |i, j| columns[j][i]);
            let products = columns.iter().map(|c| dot(c, &projection.residual[run])).collect();
            let by_column: Vec<Vec<f64>> = columns.iter().map(|c| projection.along_shared(run, c)).collect();
            let shared = by_column.first().map_or(0, Vec::len);
            let along_shared = (0..shared).map(|d| by_column.iter().map(|c| c[d]).collect()).collect();
            OfRun { squares: matrix.tr_mul(&matrix), products, along_shared }
        };
        Ok(Self { bins: bins.len(), runs: columns.into_iter().enumerate().map(of_run).collect() })
    }

    /// The effect of a form in an interval of bins, in each run.
    pub(crate) fn by_run(&self, bins: &Bins, (from, to): (usize, usize), form: Form) -> Vec<Effect> {
        let edges = self.bins + 1;
        let parts = form.weights(bins, (from, to)).map(|weights| -> Vec<(usize, f64)> {
            let powers = weights.into_iter().enumerate().filter(|(_, w)| *w != 0.0);
            powers.flat_map(|(p, w)| [(p * edges + to, w), (p * edges + from, -w)]).collect()
        });
        let of_run = |run: &OfRun| {
            let sum = |k: usize, column: &[f64]| parts[k].iter().map(|(at, w)| w * column[*at]).sum::<f64>();
            let square = |a: usize, b: usize| {
                let terms = parts[a]
                    .iter()
                    .flat_map(|(k, w)| parts[b].iter().map(move |(l, v)| w * v * run.squares[(*k, *l)]));
                let (sum, size) = terms.fold((0.0, 0.0), |(sum, size), t| (sum + t, size + t.abs()));
                if sum.abs() > ROUNDING * size { sum } else { 0.0 }
            };
            let squares = [square(0, 0), square(1, 1)];
            let is_there = |k: usize| squares[k] > 0.0;
            let all = |column: &[f64]| [0, 1].map(|k| if is_there(k) { sum(k, column) } else { 0.0 });
            Effect {
                product: all(&run.products),
                square: squares.map(|square| square.max(0.0)),
                cross: if is_there(0) && is_there(1) { square(0, 1) } else { 0.0 },
                along_shared: run.along_shared.iter().map(|direction| all(direction)).collect(),
            }
        };
        self.runs.iter().map(of_run).collect()
    }
}
