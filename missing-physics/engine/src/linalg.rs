//! Small dense helpers for normal equations.

use nalgebra::{DMatrix, SymmetricEigen};

/// Dot product.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four partial sums, so that the loop vectorises and the order of additions is fixed.
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let tail: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a4.zip(b4) {
        for i in 0..4 {
            sums[i] += x[i] * y[i];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + tail
}

/// [`dot`] of one column with four others, which takes it from memory once.
fn dot_four(a: &[f64], others: [&[f64]; 4]) -> [f64; 4] {
    let n = a.len();
    let others = others.map(|b| &b[..n]);
    let mut sums = [[0.0; 4]; 4];
    let whole = n - n % 4;
    for k in (0..whole).step_by(4) {
        for (sums, b) in sums.iter_mut().zip(&others) {
            for i in 0..4 {
                sums[i] += a[k + i] * b[k + i];
            }
        }
    }
    let mut dots = [0.0; 4];
    for ((dot, s), b) in dots.iter_mut().zip(&sums).zip(&others) {
        let tail: f64 = a[whole..].iter().zip(&b[whole..]).map(|(x, y)| x * y).sum();
        *dot = (s[0] + s[1]) + (s[2] + s[3]) + tail;
    }
    dots
}

/// [`dot`] of a column with each of some others.
pub(crate) fn dots(a: &[f64], others: &[&[f64]]) -> Vec<f64> {
    dots_of_each(&[a], others).pop().unwrap_or_default()
}

/// The same of each of several columns, one list for each: the others are taken from memory once for all of them.
pub(crate) fn dots_of_each(columns: &[&[f64]], others: &[&[f64]]) -> Vec<Vec<f64>> {
    let mut dots: Vec<Vec<f64>> = columns.iter().map(|_| Vec::with_capacity(others.len())).collect();
    let fours = others.chunks_exact(4);
    let rest = fours.remainder();
    for four in fours {
        for (dots, a) in dots.iter_mut().zip(columns) {
            dots.extend(dot_four(a, [four[0], four[1], four[2], four[3]]));
        }
    }
    for (dots, a) in dots.iter_mut().zip(columns) {
        dots.extend(rest.iter().map(|b| dot(a, b)));
    }
    dots
}

/// Dot products of columns with each other; those that are zero all through cost nothing.
pub(crate) fn gram<C: AsRef<[f64]>>(columns: &[C]) -> DMatrix<f64> {
    let columns: Vec<&[f64]> = columns.iter().map(AsRef::as_ref).collect();
    let n = columns.len();
    let mut gram = DMatrix::zeros(n, n);
    let full: Vec<usize> = (0..n).filter(|&i| columns[i].iter().any(|v| *v != 0.0)).collect();
    for (k, &i) in full.iter().enumerate() {
        let before = &full[..=k];
        let others: Vec<&[f64]> = before.iter().map(|&j| columns[j]).collect();
        for (&j, dot) in before.iter().zip(dots(columns[i], &others)) {
            (gram[(i, j)], gram[(j, i)]) = (dot, dot);
        }
    }
    gram
}

/// Legendre polynomials of degrees 0 to `degree` at values of x in [-1, 1], one column after the other.
pub(crate) fn legendre(x: &[f64], degree: usize) -> Vec<Vec<f64>> {
    let mut columns = vec![vec![1.0; x.len()], x.to_vec()];
    for d in 1..degree {
        let n = d as f64;
        let next =
            |((x, now), before): ((&f64, &f64), &f64)| ((2.0 * n + 1.0) * x * now - n * before) / (n + 1.0);
        columns.push(x.iter().zip(&columns[d]).zip(&columns[d - 1]).map(next).collect());
    }
    columns.truncate(degree + 1);
    columns
}

/// Cholesky factor of a positive semidefinite matrix; directions that the matrix does not determine are left out.
#[derive(Debug, Clone)]
pub(crate) struct SemiCholesky {
    /// Lower triangle; the row and the column of a dropped pivot are those of the unit matrix.
    factor: DMatrix<f64>,
    kept: Vec<bool>,
}

impl SemiCholesky {
    /// Factors the lower triangle of `matrix`; a pivot below `floor` times its diagonal entry is dropped (its row and column count as
    /// zero).
    pub(crate) fn new(mut matrix: DMatrix<f64>, floor: f64) -> Self {
        let n = matrix.nrows();
        let mut kept = vec![false; n];
        for j in 0..n {
            let diagonal = matrix[(j, j)];
            let mut pivot = diagonal;
            for k in 0..j {
                pivot -= matrix[(j, k)] * matrix[(j, k)];
            }
            kept[j] = pivot > floor * diagonal && pivot > 0.0 && pivot.is_finite();
            if kept[j] {
                let root = pivot.sqrt();
                matrix[(j, j)] = root;
                for i in j + 1..n {
                    let mut value = matrix[(i, j)];
                    for k in 0..j {
                        value -= matrix[(i, k)] * matrix[(j, k)];
                    }
                    matrix[(i, j)] = value / root;
                }
            } else {
                matrix[(j, j)] = 1.0;
                for i in j + 1..n {
                    matrix[(i, j)] = 0.0;
                }
                for k in 0..j {
                    matrix[(j, k)] = 0.0;
                }
            }
            for i in 0..j {
                matrix[(i, j)] = 0.0;
            }
        }
        Self { factor: matrix, kept }
    }

    /// Factors what an elimination left of a matrix: columns of which less than a share [`rank::CHANNEL`] of their sum of squares before it
    /// (`squares`) is left are dropped.
    pub(crate) fn against(mut matrix: DMatrix<f64>, squares: &[f64]) -> Self {
        for (i, square) in squares.iter().enumerate() {
            if matrix[(i, i)] <= rank::CHANNEL * square {
                matrix.row_mut(i).fill(0.0);
                matrix.column_mut(i).fill(0.0);
            }
        }
        Self::new(matrix, rank::CHANNEL)
    }

    /// Solves `L x = b` in place; entries of dropped pivots become zero.
    pub(crate) fn forward(&self, b: &mut [f64]) {
        for i in 0..b.len() {
            if !self.kept[i] {
                b[i] = 0.0;
                continue;
            }
            let mut value = b[i];
            for (k, x) in b[..i].iter().enumerate() {
                value -= self.factor[(i, k)] * x;
            }
            b[i] = value / self.factor[(i, i)];
        }
    }

    /// Solves `L^T x = b` in place; entries of dropped pivots become zero.
    pub(crate) fn backward(&self, b: &mut [f64]) {
        for i in (0..b.len()).rev() {
            if !self.kept[i] {
                b[i] = 0.0;
                continue;
            }
            let mut value = b[i];
            for (k, x) in b.iter().enumerate().skip(i + 1) {
                if self.kept[k] {
                    value -= self.factor[(k, i)] * x;
                }
            }
            b[i] = value / self.factor[(i, i)];
        }
    }

    /// Solves `L L^T x = b` in place.
    pub(crate) fn solve(&self, b: &mut [f64]) {
        self.forward(b);
        self.backward(b);
    }

    /// Log determinant over the kept pivots.
    pub(crate) fn log_determinant(&self) -> f64 {
        (0..self.size()).filter(|&i| self.kept[i]).map(|i| 2.0 * self.factor[(i, i)].ln()).sum()
    }

    /// Rows of the matrix.
    pub(crate) fn size(&self) -> usize {
        self.kept.len()
    }

    /// Number of kept pivots.
    pub(crate) fn rank(&self) -> usize {
        self.kept.iter().filter(|kept| **kept).count()
    }

    /// Whether a pivot was kept.
    pub(crate) fn keeps(&self, i: usize) -> bool {
        self.kept[i]
    }
}

/// Inverse of a symmetric matrix that may be of low rank, whatever the units of its rows: directions that it does not tell are
/// left out.
pub(crate) fn inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    /// Relative to rows of unit length.
    const LEAST: f64 = 1e-12;
    let n = matrix.nrows();
    if n == 0 {
        return DMatrix::zeros(0, 0);
    }
    let scale: Vec<f64> =
        (0..n).map(|i| matrix[(i, i)].sqrt()).map(|d| if d > 0.0 { 1.0 / d } else { 0.0 }).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let eigen = SymmetricEigen::new(scaled);
    let weights = eigen.eigenvalues.map(|v| if v > LEAST { 1.0 / v } else { 0.0 });
    let inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&weights) * eigen.eigenvectors.transpose();
    DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j])
}

/// The columns that a channel determines: those whose sum of squares in it (`here`) is not small beside the largest over
/// all channels (`largest`).
pub(crate) fn determined(here: &[f64], largest: &[f64]) -> Vec<usize> {
    (0..here.len()).filter(|&k| here[k] > 0.0 && here[k] >= 0.01 * largest[k]).collect()
}

/// What share of its diagonal entry must be left of a pivot so that it counts as determined.
pub(crate) mod rank {
    /// Normal equations of a fit, all channels together.
    pub(crate) const FIT: f64 = 1e-11;
    /// Normal equations of one channel, or columns beside which others stand that may span them.
    pub(crate) const CHANNEL: f64 = 1e-9;
    /// Whether a shared parameter is determined at all, the others being free.
    pub(crate) const DETERMINED: f64 = 1e-13;
    /// Covariance matrices of values that have errors.
    pub(crate) const COVARIANCE: f64 = 1e-12;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dependent_column_is_dropped_and_the_rest_solved() {
        let columns = [[1.0, 2.0, 3.0, 4.0], [2.0, 4.0, 6.0, 8.0], [1.0, 0.0, -1.0, 5.0]];
        let gram = DMatrix::from_fn(3, 3, |i, j| dot(&columns[i], &columns[j]));
        let target = [2.0, 2.0, 2.0, 9.0]; // first + third
        let mut b: Vec<f64> = columns.iter().map(|c| dot(c, &target)).collect();
        let factor = SemiCholesky::new(gram, rank::FIT);
        assert_eq!((factor.kept.as_slice(), factor.rank()), ([true, false, true].as_slice(), 2));
        factor.solve(&mut b);
        approx::assert_relative_eq!(b.as_slice(), [1.0, 0.0, 1.0].as_slice(), epsilon = 1e-12);
    }

    /// Whatever is taken from memory together, each product is the same to the last digit.
    #[test]
    fn dot_products_of_many_are_those_of_each() {
        let column = |k: usize| -> Vec<f64> { (0..23).map(|i| ((k * 7 + i) as f64).sin()).collect() };
        let all: Vec<Vec<f64>> = (0..10).map(column).collect();
        let all: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
        let of_each = dots_of_each(&all[..3], &all[3..]);
        for (a, dots) in all.iter().zip(&of_each) {
            assert_eq!(*dots, all[3..].iter().map(|b| dot(a, b)).collect::<Vec<f64>>());
        }
        assert!(of_each.len() == 3 && dots(all[0], &[]).is_empty());
    }
}
