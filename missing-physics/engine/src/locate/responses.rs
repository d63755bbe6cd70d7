//! What a component of an unknown does in each bin of a variable, as sums by which any interval in any runs is judged at once.

use nalgebra::DMatrix;

use crate::fit::optimum::Fit;
use crate::locate::bins::{Along, Bins};
use crate::locate::projection::{Projection, dot};
use crate::locate::unknowns::Unknown;
use crate::model::PredictError;
use crate::problem::Problem;

/// Powers of a variable that a size may be made of.
const POWERS: usize = 2;

/// How the size goes along the variable within the interval: even, or rising from zero at its beginning or end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    Even,
    FromBegin,
    FromEnd,
}

impl Form {
    pub(crate) const ALL: [Self; 3] = [Self::Even, Self::FromBegin, Self::FromEnd];

    /// How much of each power it has.
    fn weights(self, bins: &Bins, (from, to): (usize, usize)) -> [f64; POWERS] {
        match self {
            Self::Even => [1.0, 0.0],
            Self::FromBegin => [-bins.edge(from), 1.0],
            Self::FromEnd => [-bins.edge(to), 1.0],
        }
    }
}

/// An effect over some runs: its product with the residual, its square beside nuisance parameters, and along shared ones.
#[derive(Debug, Clone, Default)]
pub(crate) struct Effect {
    pub(crate) product: f64,
    square: f64,
    along_shared: Vec<f64>,
}

impl Effect {
    /// Adds (or, with -1, takes away) that of other runs.
    pub(crate) fn add(&mut self, other: &Self, sign: f64) {
        self.product += sign * other.product;
        self.square += sign * other.square;
        if self.along_shared.is_empty() {
            self.along_shared.resize(other.along_shared.len(), 0.0);
        }
        self.along_shared.iter_mut().zip(&other.along_shared).for_each(|(a, b)| *a += sign * b);
    }

    /// The square beside all parameters; zero where hardly anything is left beside them.
    fn beside(&self) -> f64 {
        let beside = self.square - dot(&self.along_shared, &self.along_shared);
        if beside > 1e-6 * self.square { beside } else { 0.0 }
    }

    /// By how much the sum of squares falls.
    pub(crate) fn gain(&self) -> f64 {
        let beside = self.beside();
        if beside > 0.0 { self.product * self.product / beside } else { 0.0 }
    }

    /// The size that fits best, and its standard error.
    pub(crate) fn size(&self) -> [f64; 2] {
        let beside = self.beside();
        [self.product / beside, beside.sqrt().recip()]
    }
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

/// How much a component has at each row of each run: along the variable as a power, within some bins and runs.
fn amounts(along: &Along, bins: &Bins, power: usize, within: impl Fn(usize, usize) -> bool) -> Vec<Vec<f64>> {
    let of_row = |run: usize, x: f64| {
        if within(run, bins.of(x)) { bins.along(x).powi(power as i32) } else { 0.0 }
    };
    along.values.iter().enumerate().map(|(r, v)| v.iter().map(|x| of_row(r, *x)).collect()).collect()
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

impl Asked<'_> {
    /// The effect of a form in an interval and some runs, by run, and its mean size there.
    pub(crate) fn column(
        &self,
        interval: (usize, usize),
        form: Form,
        runs: &[bool],
    ) -> Result<(Vec<Vec<f64>>, f64), PredictError> {
        let weights = form.weights(self.bins, interval);
        let within = |run: usize, bin: usize| runs[run] && bin >= interval.0 && bin < interval.1;
        let [mut all, linear] = [0, 1].map(|power| amounts(self.along, self.bins, power, within));
        for (run, linear) in all.iter_mut().zip(&linear) {
            run.iter_mut().zip(linear).for_each(|(even, linear)| {
                *even = weights[0] * *even + weights[1] * linear;
            });
        }
        let active = all.iter().flatten().filter(|v| **v != 0.0);
        let (sum, n) = active.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        let moved = self.unknown.response(self.problem, self.fit, self.sigma, self.component, &all)?;
        Ok((moved, if n > 0.0 { sum / n } else { 0.0 }))
    }
}

impl Responses {
    pub(crate) fn new(asked: &Asked<'_>, projection: &Projection) -> Result<Self, PredictError> {
        let Asked { problem, fit, sigma, unknown, component, along, bins } = *asked;
        let edges = bins.len() + 1;
        let runs = problem.rows.len();
        let mut columns: Vec<Vec<Vec<f64>>> = vec![Vec::with_capacity(POWERS * edges); runs];
        for power in 0..POWERS {
            let mut sums: Vec<Vec<f64>> = projection.residual.iter().map(|r| vec![0.0; r.len()]).collect();
            for bin in 0..=bins.len() {
                columns.iter_mut().zip(&sums).for_each(|(all, sum)| all.push(sum.clone()));
                if bin == bins.len() {
                    break;
                }
                let only = amounts(along, bins, power, |_, b| b == bin);
                let moved = unknown.response(problem, fit, sigma, component, &only)?;
                for (run, (sum, mut moved)) in sums.iter_mut().zip(moved).enumerate() {
                    projection.beside_nuisance(run, &mut moved);
                    sum.iter_mut().zip(moved).for_each(|(s, m)| *s += m);
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
        let weights = form.weights(bins, (from, to));
        let edges = self.bins + 1;
        let mut parts = Vec::with_capacity(2 * POWERS);
        for (power, weight) in weights.into_iter().enumerate().filter(|(_, w)| *w != 0.0) {
            parts.push((power * edges + to, weight));
            parts.push((power * edges + from, -weight));
        }
        let of_run = |run: &OfRun| {
            let sum = |column: &[f64]| parts.iter().map(|(k, w)| w * column[*k]).sum::<f64>();
            let square = parts
                .iter()
                .map(|(k, w)| w * parts.iter().map(|(l, v)| v * run.squares[(*k, *l)]).sum::<f64>());
            Effect {
                product: sum(&run.products),
                square: square.sum::<f64>().max(0.0),
                along_shared: run.along_shared.iter().map(|d| sum(d)).collect(),
            }
        };
        self.runs.iter().map(of_run).collect()
    }
}
