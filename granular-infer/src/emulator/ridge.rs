//! Weighted ridge regression whose strength is chosen by what is left out.

use faer::linalg::solvers::Solve;
use faer::{ColRef, MatRef, Side};
use nalgebra::{DMatrix, DVector};

/// Parts that are left out in turn.
const FOLDS: usize = 10;
/// How much dearer a coefficient is than one of a degree less.
const DEARER: f64 = 2.0;
/// Strengths that are tried, in samples.
const STRENGTHS: [f64; 7] = [1e-3, 1e-2, 0.1, 0.3, 1.0, 3.0, 10.0];

/// A design: a row for each value, the degree of each column, and which row belongs to which group that is left out together.
#[derive(Debug, Clone)]
pub(super) struct Design {
    pub(super) rows: DMatrix<f64>,
    pub(super) degrees: Vec<u8>,
    pub(super) groups: Vec<usize>,
}

/// Coefficients, and how far each value lies from what is foretold without its part.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub(super) coefficients: DVector<f64>,
    pub(super) left_out: Vec<f64>,
}

impl Design {
    /// Coefficients of values with weights (one each on average), at the strength that foretells best what is left out.
    pub(super) fn fit(&self, values: &DVector<f64>, weights: &DVector<f64>) -> Fitted {
        let parts: Vec<(Vec<usize>, DMatrix<f64>, Normal)> = (0..FOLDS)
            .map(|fold| {
                let of_fold: Vec<usize> =
                    (0..values.len()).filter(|i| self.groups[*i] % FOLDS == fold).collect();
                let rows = self.rows.select_rows(&of_fold);
                let normal =
                    Normal::new(&rows, &values.select_rows(&of_fold), &weights.select_rows(&of_fold));
                (of_fold, rows, normal)
            })
            .collect();
        let mut normal = Normal::nothing(self.degrees.len());
        parts.iter().for_each(|(_, _, part)| normal.add(part));
        let left_out = |strength: f64| {
            let mut left = vec![0.0; values.len()];
            for (of_fold, rows, part) in &parts {
                let foretold = rows * normal.less(part).solve(&self.degrees, strength);
                for (&i, foretold) in of_fold.iter().zip(&foretold) {
                    left[i] = values[i] - foretold;
                }
            }
            left
        };
        let cost = |left: &[f64]| left.iter().zip(weights.iter()).map(|(l, w)| w * l * l).sum::<f64>();
        let mut best = (f64::INFINITY, STRENGTHS[0], Vec::new());
        for strength in STRENGTHS {
            let left = left_out(strength);
            let cost = cost(&left);
            if cost < best.0 || best.2.is_empty() {
                best = (cost, strength, left);
            }
        }
        Fitted { coefficients: normal.solve(&self.degrees, best.1), left_out: best.2 }
    }
}

/// Normal equations.
struct Normal {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

impl Normal {
    fn nothing(width: usize) -> Self {
        Self { matrix: DMatrix::zeros(width, width), right: DVector::zeros(width) }
    }

    fn new(rows: &DMatrix<f64>, values: &DVector<f64>, weights: &DVector<f64>) -> Self {
        let mut weighted = rows.transpose();
        for (mut column, weight) in weighted.column_iter_mut().zip(weights) {
            column *= *weight;
        }
        Self { matrix: &weighted * rows, right: weighted * values }
    }

    fn add(&mut self, part: &Self) {
        self.matrix += &part.matrix;
        self.right += &part.right;
    }

    fn less(&self, part: &Self) -> Self {
        Self { matrix: &self.matrix - &part.matrix, right: &self.right - &part.right }
    }

    /// Ridge; the level is free.
    fn solve(&self, degrees: &[u8], strength: f64) -> DVector<f64> {
        let mut matrix = self.matrix.clone();
        for (k, degree) in degrees.iter().enumerate() {
            matrix[(k, k)] +=
                strength * if *degree == 0 { 1e-3 } else { DEARER.powi(i32::from(*degree) - 1) };
        }
        let n = degrees.len();
        let factor = MatRef::from_column_major_slice(matrix.as_slice(), n, n).llt(Side::Lower);
        factor.map_or_else(
            |_| DVector::zeros(n),
            |c| DVector::from_iterator(n, c.solve(ColRef::from_slice(self.right.as_slice())).iter().copied()),
        )
    }
}
