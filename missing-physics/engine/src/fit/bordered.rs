//! Normal equations of many runs, bordered: each run has nuisance parameters of its own, all runs share the others.
//!
//! A run's nuisance parameters are eliminated by the Cholesky factor of their block; what is left of its equations (the Schur
//! complement) is added up over the runs into the information and the gradient of the shared parameters. Once these are solved for,
//! each run's nuisance parameters follow by back substitution (Golub and Van Loan 2013, Matrix Computations, section 4.3.4: bordered
//! systems).

use nalgebra::DMatrix;

use crate::linalg::{SemiCholesky, dot, rank};

/// One run's nuisance parameters eliminated from its normal equations.
pub(crate) struct Eliminated {
    factor: SemiCholesky,
    /// The nuisance block by every other column, forward-solved.
    pub(crate) borders: Vec<Vec<f64>>,
}

/// How well a run determines its free nuisance parameters, in their order.
#[derive(Debug, Clone)]
pub(crate) struct NuisanceErrors {
    /// Standard errors for given shared parameters; infinite where the run does not determine one.
    pub(crate) error: Vec<f64>,
    /// How each moves with each free shared parameter: `[nuisance][shared]`.
    pub(crate) slope: Vec<Vec<f64>>,
}

impl Eliminated {
    /// From the nuisance parameters' block and the columns beside it (each as long as the block is wide); pivots below `floor` times
    /// their diagonal entry are dropped.
    pub(crate) fn new(block: DMatrix<f64>, floor: f64, beside: impl Iterator<Item = Vec<f64>>) -> Self {
        let factor = SemiCholesky::new(block, floor);
        let borders = beside
            .map(|mut column| {
                factor.forward(&mut column);
                column
            })
            .collect();
        Self { factor, borders }
    }

    /// From a run's normal equations (the lower triangle of: nuisance, shared, residual); parameters that are `held` do not move, and
    /// the others' diagonal is larger by the part `damping`.
    fn holding(normal: &DMatrix<f64>, held: &[bool], damping: f64) -> Self {
        let n = held.len();
        let mut block = normal.view((0, 0), (n, n)).into_owned();
        for (i, held) in held.iter().enumerate() {
            block[(i, i)] *= 1.0 + damping;
            if *held {
                block.row_mut(i).fill(0.0);
                block.column_mut(i).fill(0.0);
            }
        }
        let beside = |j: usize| -> Vec<f64> {
            held.iter().enumerate().map(|(i, held)| if *held { 0.0 } else { normal[(j, i)] }).collect()
        };
        Self::new(block, rank::FIT, (n..normal.nrows()).map(beside))
    }

    /// Solves with the factor of the nuisance block, in place.
    pub(crate) fn forward(&self, column: &mut [f64]) {
        self.factor.forward(column);
    }

    /// Eliminates the nuisance parameters from one more column: its part by them is forward-solved, its part by the shared ones
    /// becomes what is left.
    pub(crate) fn eliminate(&self, nuisance: &mut [f64], shared: &mut [f64]) {
        self.factor.forward(nuisance);
        shared.iter_mut().zip(&self.borders).for_each(|(s, border)| *s -= dot(border, nuisance));
    }

    /// By how much the nuisance parameters alone lower the sum of squares of the last column.
    pub(crate) fn explained(&self) -> f64 {
        self.borders.last().map_or(0.0, |residual| dot(residual, residual))
    }

    /// Log determinant of the nuisance block, over the kept pivots.
    pub(crate) fn log_determinant(&self) -> f64 {
        self.factor.log_determinant()
    }

    /// How many nuisance parameters the run determines.
    pub(crate) fn rank(&self) -> usize {
        self.factor.rank()
    }

    /// The nuisance parameters for given shared ones.
    pub(crate) fn back_substitute(&self, shared: &[f64]) -> Vec<f64> {
        let mut nuisance = self.borders[shared.len()].clone();
        for (border, x) in self.borders.iter().zip(shared) {
            nuisance.iter_mut().zip(border).for_each(|(n, b)| *n -= x * b);
        }
        self.factor.backward(&mut nuisance);
        nuisance
    }

    /// How well the run determines its nuisance parameters; the first `n_shared` columns beside them are of shared parameters.
    pub(crate) fn errors(&self, n_shared: usize) -> NuisanceErrors {
        let n = self.factor.size();
        let error = (0..n)
            .map(|i| {
                let mut unit = vec![0.0; n];
                unit[i] = 1.0;
                self.factor.forward(&mut unit);
                if self.factor.keeps(i) { dot(&unit, &unit).sqrt() } else { f64::INFINITY }
            })
            .collect();
        let mut slope = vec![vec![0.0; n_shared]; n];
        for (j, border) in self.borders.iter().take(n_shared).enumerate() {
            let mut column = border.clone();
            self.factor.backward(&mut column);
            slope.iter_mut().zip(column).for_each(|(row, value)| row[j] = -value);
        }
        NuisanceErrors { error, slope }
    }
}

/// The shared parameters' part of the normal equations of all runs, each run's nuisance parameters eliminated.
pub(crate) struct BorderedNormal {
    /// Information of the shared parameters; its lower triangle counts.
    information: DMatrix<f64>,
    gradient: Vec<f64>,
    /// Sums of squares of the shared columns before elimination.
    squares: Vec<f64>,
    /// Sum of squares that the nuisance parameters alone leave.
    left: f64,
    runs: Vec<Eliminated>,
}

impl BorderedNormal {
    /// Without runs, and without prior information of the shared parameters.
    pub(crate) fn new(n_shared: usize) -> Self {
        Self::with_prior(DMatrix::zeros(n_shared, n_shared))
    }

    /// Without runs; `information` is what is known of the shared parameters before.
    pub(crate) fn with_prior(information: DMatrix<f64>) -> Self {
        let zeros = vec![0.0; information.nrows()];
        Self { information, gradient: zeros.clone(), squares: zeros, left: 0.0, runs: Vec::new() }
    }

    /// Adds a run by the lower triangle of its normal equations: nuisance parameters, shared ones, the residual last.
    pub(crate) fn add(&mut self, normal: &DMatrix<f64>) {
        let n_nuisance = normal.nrows() - self.gradient.len() - 1;
        self.add_holding(normal, &vec![false; n_nuisance], 0.0);
    }

    /// Adds a run of which some nuisance parameters are held where they are, and the others' diagonal is larger by a part.
    pub(crate) fn add_holding(&mut self, normal: &DMatrix<f64>, held: &[bool], damping: f64) {
        let (n, shared) = (held.len(), self.gradient.len());
        let last = n + shared;
        let run = Eliminated::holding(normal, held, damping);
        self.left += normal[(last, last)];
        self.left -= run.explained();
        // Of many shared columns few act in a run where many are of single runs.
        let acting: Vec<usize> = (0..shared).filter(|i| normal[(n + i, n + i)] != 0.0).collect();
        for (k, &i) in acting.iter().enumerate() {
            for &j in &acting[..=k] {
                self.information[(i, j)] += normal[(n + i, n + j)] - dot(&run.borders[i], &run.borders[j]);
            }
            self.squares[i] += normal[(n + i, n + i)];
            self.gradient[i] += normal[(last, n + i)] - dot(&run.borders[i], &run.borders[shared]);
        }
        self.runs.push(run);
    }

    /// The runs in the order in which they were added.
    pub(crate) fn runs(&self) -> &[Eliminated] {
        &self.runs
    }

    /// The gradient of the shared parameters.
    pub(crate) fn gradient(&self) -> &[f64] {
        &self.gradient
    }

    /// The information of the shared parameters, a symmetric matrix.
    pub(crate) fn information(&self) -> DMatrix<f64> {
        let mut information = self.information.clone();
        information.fill_upper_triangle_with_lower_triangle();
        information
    }

    /// The factor of the information.
    pub(crate) fn factor(&self) -> SemiCholesky {
        SemiCholesky::new(self.information.clone(), rank::FIT)
    }

    /// The factor of the information without the columns that the others span already, judged by the columns' sums of squares before
    /// elimination.
    pub(crate) fn factor_of_independent(&self) -> SemiCholesky {
        SemiCholesky::against(self.information.clone(), &self.squares)
    }

    /// Least squares: the shared parameters, and the sum of squares that all parameters leave.
    pub(crate) fn solve(&self, factor: &SemiCholesky) -> (Vec<f64>, f64) {
        let mut shared = self.gradient.clone();
        factor.solve(&mut shared);
        let left = self.left - dot(&self.gradient, &shared);
        (shared, left.max(0.0))
    }

    /// Each run's coefficients for given shared parameters: its nuisance parameters, then the shared ones.
    pub(crate) fn coefficients(&self, shared: &[f64]) -> Vec<Vec<f64>> {
        self.runs.iter().map(|run| [&run.back_substitute(shared)[..], shared].concat()).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::linalg::gram;

    /// Least squares over several runs.
    struct World {
        nuisance: usize,
        shared: usize,
        /// By run: nuisance and shared columns, and the residual.
        runs: Vec<Vec<Vec<f64>>>,
    }

    impl World {
        /// Runs of `rows` rows. With `deficient` a nuisance column of each run depends on another or vanishes, and so does a shared
        /// one of all runs.
        fn draw(seed: u64, [runs, rows, nuisance, shared]: [usize; 4], deficient: bool) -> Self {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut column =
                |scale: f64| -> Vec<f64> { (0..rows).map(|_| scale * rng.random_range(-1.0..1.0)).collect() };
            let run = |r: usize| {
                let mut columns: Vec<Vec<f64>> =
                    (0..nuisance + shared + 1).map(|k| column(10f64.powi(k as i32 % 3 - 1))).collect();
                if deficient && nuisance > 1 {
                    columns[nuisance - 1] =
                        columns[0].iter().map(|v| if r == 0 { 3.0 * v } else { 0.0 }).collect();
                }
                if deficient && shared > 1 {
                    columns[nuisance + shared - 1] = columns[nuisance].iter().map(|v| -2.0 * v).collect();
                }
                columns
            };
            Self { nuisance, shared, runs: (0..runs).map(run).collect() }
        }

        fn bordered(&self) -> BorderedNormal {
            let mut bordered = BorderedNormal::new(self.shared);
            self.runs.iter().for_each(|columns| bordered.add(&gram(columns)));
            bordered
        }

        /// All columns of all runs in one matrix, and the residual.
        fn dense(&self) -> (DMatrix<f64>, DVector<f64>) {
            let rows = self.runs[0][0].len();
            let width = self.nuisance * self.runs.len() + self.shared;
            let mut matrix = DMatrix::zeros(rows * self.runs.len(), width);
            let mut residual = DVector::zeros(matrix.nrows());
            for (r, columns) in self.runs.iter().enumerate() {
                for (k, column) in columns.iter().enumerate() {
                    for (row, value) in column.iter().enumerate() {
                        let row = r * rows + row;
                        match k.checked_sub(self.nuisance) {
                            None => matrix[(row, r * self.nuisance + k)] = *value,
                            Some(s) if s < self.shared => {
                                matrix[(row, self.nuisance * self.runs.len() + s)] = *value;
                            }
                            Some(_) => residual[row] = *value,
                        }
                    }
                }
            }
            (matrix, residual)
        }

        /// The bordered solution as one vector of the dense system.
        fn stacked(&self, bordered: &BorderedNormal, shared: &[f64]) -> DVector<f64> {
            let nuisance =
                bordered.coefficients(shared).into_iter().flat_map(|x| x[..self.nuisance].to_vec());
            DVector::from_vec(nuisance.chain(shared.iter().copied()).collect())
        }
    }

    /// The sum of squares that the bordered solution leaves is the least there is, by a singular value decomposition of the dense
    /// system; and the solution leaves it indeed.
    #[test]
    fn the_bordered_solution_is_the_dense_one() {
        let sizes = [[1, 9, 0, 2], [1, 12, 3, 0], [2, 10, 1, 1], [3, 12, 3, 4], [5, 15, 4, 3], [8, 9, 2, 5]];
        for (seed, size) in sizes.into_iter().enumerate() {
            for deficient in [false, true] {
                let world = World::draw(seed as u64, size, deficient);
                let (matrix, residual) = world.dense();
                let best = matrix.clone().svd(true, true).solve(&residual, 1e-9).unwrap();
                let least = (&residual - &matrix * &best).norm_squared();
                let bordered = world.bordered();
                let (shared, left) = bordered.solve(&bordered.factor());
                approx::assert_relative_eq!(left, least, max_relative = 1e-9);
                let found = world.stacked(&bordered, &shared);
                let leaves = (&residual - &matrix * &found).norm_squared();
                approx::assert_relative_eq!(leaves, least, max_relative = 1e-9);
                if !deficient {
                    approx::assert_relative_eq!(found, best, max_relative = 1e-8, epsilon = 1e-9);
                }
                let (_, left) = bordered.solve(&bordered.factor_of_independent());
                approx::assert_relative_eq!(left, least, max_relative = 1e-9);
            }
        }
    }

    /// Information and errors are those of the inverse of the dense normal equations.
    #[test]
    fn errors_are_those_of_the_dense_inverse() {
        let size @ [runs, _, nuisance, shared] = [4, 14, 3, 2];
        let world = World::draw(7, size, false);
        let (matrix, _) = world.dense();
        let normal = matrix.tr_mul(&matrix);
        let inverse = normal.clone().try_inverse().unwrap();
        let bordered = world.bordered();
        let of_shared = inverse.view((nuisance * runs, nuisance * runs), (shared, shared)).into_owned();
        let information = of_shared.try_inverse().unwrap();
        approx::assert_relative_eq!(bordered.information(), information, max_relative = 1e-9);
        for (r, run) in bordered.runs().iter().enumerate() {
            let block = normal.view((r * nuisance, r * nuisance), (nuisance, nuisance)).into_owned();
            let beside = normal.view((r * nuisance, runs * nuisance), (nuisance, shared)).into_owned();
            let given = block.clone().try_inverse().unwrap();
            let slope = -(&given * beside);
            let errors = run.errors(shared);
            assert_eq!(run.rank(), nuisance);
            approx::assert_relative_eq!(run.log_determinant(), block.determinant().ln(), max_relative = 1e-9);
            for i in 0..nuisance {
                approx::assert_relative_eq!(errors.error[i], given[(i, i)].sqrt(), max_relative = 1e-9);
                for j in 0..shared {
                    approx::assert_relative_eq!(errors.slope[i][j], slope[(i, j)], max_relative = 1e-9);
                }
            }
        }
    }

    /// A parameter that is held does not move, whatever the others do; it leaves what a fit without its column leaves.
    #[test]
    fn a_held_parameter_stays() {
        let size = [3, 12, 3, 2];
        let world = World::draw(11, size, false);
        let mut bordered = BorderedNormal::new(world.shared);
        let held = [false, true, false];
        world.runs.iter().for_each(|columns| bordered.add_holding(&gram(columns), &held, 0.0));
        let (shared, left) = bordered.solve(&bordered.factor());
        assert!(bordered.coefficients(&shared).iter().all(|run| run[1] == 0.0 && run[0] != 0.0));
        assert!(bordered.runs().iter().all(|run| run.rank() == 2 && run.errors(2).error[1].is_infinite()));
        let mut without = World { nuisance: 2, ..world };
        without.runs.iter_mut().for_each(|columns| drop(columns.remove(1)));
        let fewer = without.bordered();
        let (expected, least) = fewer.solve(&fewer.factor());
        approx::assert_relative_eq!(shared.as_slice(), expected.as_slice(), max_relative = 1e-9);
        approx::assert_relative_eq!(left, least, max_relative = 1e-9);
    }

    /// What is known before counts as much as rows that say it.
    #[test]
    fn prior_information_counts_as_rows_do() {
        let size = [2, 10, 2, 2];
        let (first, second) = (World::draw(3, size, false), World::draw(4, size, false));
        let mut both = first.bordered();
        second.runs.iter().for_each(|columns| both.add(&gram(columns)));
        let mut after = BorderedNormal::with_prior(first.bordered().information());
        second.runs.iter().for_each(|columns| after.add(&gram(columns)));
        approx::assert_relative_eq!(after.information(), both.information(), max_relative = 1e-12);
    }
}
