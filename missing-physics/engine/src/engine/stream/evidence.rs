//! The e-value of a change, from small Gram matrices: a mixture over when it began, what it is and how large it is.
//!
//! Under the null hypothesis whitened rows are `y = X b + s e` with `e` standard normal; a change from run `j` on adds `Z g` to
//! the rows of that run and all later ones. With the right-invariant prior `1/s` on `b` and `s`, and `g ~ N(0, s^2 t^2 S)`, the
//! ratio of the densities of the rows after the reference given the reference (each a multivariate Student's) is
//!
//! `B = |I + t^2 S Z'MZ|^(-1/2) (R1 / R0)^(-n/2)`,
//!
//! with `M` the projection off `X`, `R` the sums of squares left, and `n` rows less the rank of `X`. Its mean under the null
//! hypothesis is 1 whatever `b` and `s` are, run after run: it is the likelihood ratio of what no shift and no scale changes
//! (Perez-Ortiz, Lardy, de Heide and Grunwald 2024, doi:10.1214/24-AOS2394). A mixture of such ratios with weights that sum to one
//! is an e-process, and stays below `1/alpha` for ever with a probability of at least `1 - alpha` (Ville's inequality; Ramdas,
//! Grunwald, Vovk and Shafer 2023, doi:10.1214/23-STS894).

use nalgebra::DMatrix;

use crate::linalg::{SemiCholesky, rank};

/// Sizes of a change that are mixed, in standard errors of one run.
const SIZES: [f64; 5] = [0.5, 1.0, 2.0, 4.0, 8.0];
/// Half of the weight of when a change begins falls by this share with each run, the other half as `1 / (k (k + 1))`: together
/// they sum to one over all runs that may ever come.
const HAZARD: f64 = 0.01;

/// A run as the e-value sees it.
#[derive(Debug, Clone)]
pub(super) struct RunGram {
    /// Products of the columns, the run's own parameters eliminated: shared parameters, directions, the residual.
    pub(super) gram: DMatrix<f64>,
    /// Rows less the run's own parameters.
    pub(super) freedom: f64,
}

/// A way in which things may change: columns among the directions.
#[derive(Debug, Clone)]
pub(super) struct Direction {
    pub(super) columns: Vec<usize>,
}

/// What is known of a change.
#[derive(Debug, Clone)]
pub(super) struct Change {
    /// How probable each run after the reference is as the first one, given that something has changed.
    pub(super) onset: Vec<f64>,
    /// How probable each direction is.
    pub(super) direction: Vec<f64>,
    /// Change of each column of each direction from the most probable run on, and its standard error.
    pub(super) sizes: Vec<Vec<(f64, f64)>>,
}

/// The e-process over runs.
#[derive(Debug, Clone)]
pub(super) struct Evidence {
    shared: usize,
    directions: Vec<Direction>,
    /// For each direction the inverse of `S`: its columns' Gram matrix in a run of the reference.
    units: Vec<DMatrix<f64>>,
    /// Sums over all runs, and sums of what came before each run after the reference.
    total: RunGram,
    before: Vec<DMatrix<f64>>,
}

/// Log of the weight of a change that begins at the `k`-th run after the reference, from 1.
fn log_weight(k: usize) -> f64 {
    let k = k as f64;
    (0.5 * HAZARD * (1.0 - HAZARD).powf(k - 1.0) + 0.5 / (k * (k + 1.0))).ln()
}

fn log_sum(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = values.clone().fold(f64::NEG_INFINITY, f64::max);
    if largest == f64::NEG_INFINITY {
        return largest;
    }
    largest + values.map(|v| (v - largest).exp()).sum::<f64>().ln()
}

impl Evidence {
    /// Begins with the runs of the reference. Columns of a direction that the reference's runs do not tell from its others are left out,
    /// and directions without any column with them.
    pub(super) fn new(reference: &[RunGram], shared: usize, directions: &[Direction]) -> (Self, Vec<usize>) {
        let size = reference.first().map_or(shared + 1, |run| run.gram.nrows());
        let mut total = RunGram { gram: DMatrix::zeros(size, size), freedom: 0.0 };
        for run in reference {
            total.gram += &run.gram;
            total.freedom += run.freedom;
        }
        let runs = reference.len().max(1) as f64;
        let (mut kept, mut of, mut units) = (Vec::new(), Vec::new(), Vec::new());
        for (number, direction) in directions.iter().enumerate() {
            let place = |c: &usize| shared + c;
            let pick = |columns: &[usize]| {
                DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
                    total.gram[(place(&columns[i]), place(&columns[j]))] / runs
                })
            };
            let factor = SemiCholesky::new(pick(&direction.columns), rank::DETERMINED);
            let columns: Vec<usize> = direction
                .columns
                .iter()
                .enumerate()
                .filter(|(i, _)| factor.keeps(*i))
                .map(|(_, c)| *c)
                .collect();
            if !columns.is_empty() {
                units.push(pick(&columns));
                kept.push(Direction { columns });
                of.push(number);
            }
        }
        (Self { shared, directions: kept, units, total, before: Vec::new() }, of)
    }

    /// Takes a run.
    pub(super) fn add(&mut self, run: &RunGram) {
        self.before.push(self.total.gram.clone());
        self.total.gram += &run.gram;
        self.total.freedom += run.freedom;
    }

    /// Log of the ratio for a change in a direction from the `k`-th run after the reference on (from 0), for each of [`SIZES`], and of the
    /// most probable size the change of each column.
    fn ratios(&self, k: usize, d: usize, base: &Base) -> ([f64; SIZES.len()], Vec<(f64, f64)>) {
        let (p, columns, total) = (self.shared, &self.directions[d].columns, &self.total.gram);
        let last = total.nrows() - 1;
        let since = |i: usize, j: usize| total[(i, j)] - self.before[k][(i, j)];
        let q = columns.len();
        let cross: Vec<Vec<f64>> =
            columns.iter().map(|c| (0..p).map(|i| since(i, p + c)).collect()).collect();
        let solved_cross: Vec<Vec<f64>> = cross
            .iter()
            .map(|column| {
                let mut column = column.clone();
                base.factor.solve(&mut column);
                column
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
        let inner = DMatrix::from_fn(q, q, |i, j| {
            since(p + columns[i], p + columns[j]) - dot(&cross[i], &solved_cross[j])
        });
        let along: Vec<f64> =
            (0..q).map(|i| since(p + columns[i], last) - dot(&cross[i], &base.solved)).collect();
        let mut logs = [f64::NEG_INFINITY; SIZES.len()];
        let (mut best, mut sizes) = (f64::NEG_INFINITY, vec![(0.0, f64::INFINITY); q]);
        for (log, size) in logs.iter_mut().zip(SIZES) {
            let prior = &self.units[d] / (size * size);
            let factor = SemiCholesky::new(&inner + &prior, rank::DETERMINED);
            let prior_factor = SemiCholesky::new(prior, rank::DETERMINED);
            if factor.rank() < q || prior_factor.rank() < q {
                continue;
            }
            let mut change = along.clone();
            factor.solve(&mut change);
            let left = (base.left - dot(&along, &change)).max(f64::MIN_POSITIVE);
            *log = 0.5 * (prior_factor.log_determinant() - factor.log_determinant())
                - 0.5 * base.freedom * (left / base.left).ln();
            if *log > best {
                best = *log;
                let variance = left / base.freedom;
                sizes = (0..q)
                    .map(|i| {
                        let mut unit = vec![0.0; q];
                        unit[i] = 1.0;
                        factor.solve(&mut unit);
                        (change[i], (variance * unit[i]).max(0.0).sqrt())
                    })
                    .collect();
            }
        }
        (logs, sizes)
    }

    /// Log of the e-value after the runs so far, and what is known of a change.
    pub(super) fn weigh(&self) -> (f64, Option<Change>) {
        let (p, last) = (self.shared, self.total.gram.nrows() - 1);
        let factor = SemiCholesky::new(self.total.gram.view((0, 0), (p, p)).into_owned(), rank::DETERMINED);
        let products: Vec<f64> = (0..p).map(|i| self.total.gram[(i, last)]).collect();
        let mut solved = products.clone();
        factor.solve(&mut solved);
        let explained: f64 = products.iter().zip(&solved).map(|(a, b)| a * b).sum();
        let left = self.total.gram[(last, last)] - explained;
        let freedom = self.total.freedom - factor.rank() as f64;
        let (runs, count) = (self.before.len(), self.directions.len());
        if !(left > 0.0 && freedom >= 1.0) || runs == 0 || count == 0 {
            return (0.0, None);
        }
        let base = Base { factor, solved, left, freedom };
        let equal = -((count * SIZES.len()) as f64).ln();
        let mut logs = vec![vec![f64::NEG_INFINITY; count]; runs];
        let mut sizes = vec![Vec::new(); runs];
        for k in 0..runs {
            for (d, log) in logs[k].iter_mut().enumerate() {
                let (ratios, changes) = self.ratios(k, d, &base);
                *log = log_weight(k + 1) + equal + log_sum(ratios.iter().copied());
                sizes[k].push(changes);
            }
        }
        let changed = log_sum(logs.iter().flatten().copied());
        // A change that is still to come leaves the runs so far as they are.
        let begun: f64 = (1..=runs).map(|k| log_weight(k).exp()).sum();
        let e_value = log_sum([changed, (1.0 - begun).max(0.0).ln()].into_iter());
        let share = |v: f64| (v - changed).exp();
        let onset: Vec<f64> = logs.iter().map(|of_run| share(log_sum(of_run.iter().copied()))).collect();
        let direction = (0..count).map(|d| share(log_sum(logs.iter().map(|of_run| of_run[d])))).collect();
        let first = (0..runs).max_by(|a, b| onset[*a].total_cmp(&onset[*b])).unwrap_or(0);
        let sizes = std::mem::take(&mut sizes[first]);
        (e_value, Some(Change { onset, direction, sizes }))
    }
}

/// The null hypothesis fitted to all runs.
struct Base {
    factor: SemiCholesky,
    /// The shared parameters.
    solved: Vec<f64>,
    left: f64,
    freedom: f64,
}
