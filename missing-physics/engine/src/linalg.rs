//! Small dense helpers for normal equations.

use nalgebra::{DMatrix, SymmetricEigen};
use pulp::bytemuck::cast_slice;
use pulp::{Arch, Simd, WithSimd};
use std::array::from_fn;

/// Dot product.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    struct Dot<'a>(&'a [f64], &'a [f64]);
    impl WithSimd for Dot<'_> {
        type Output = f64;
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> f64 {
            tile(simd, [self.0], [self.1])[0][0]
        }
    }
    Arch::new().dispatch(Dot(a, b))
}

/// Dot products of a few columns of one length with a few others, by the vector instructions of the processor: each number that is taken
/// from memory serves several products. Each of them adds in the same order however many there are.
#[inline(always)]
fn tile<S: Simd, const A: usize, const B: usize>(
    simd: S,
    columns: [&[f64]; A],
    others: [&[f64]; B],
) -> [[f64; B]; A] {
    let (columns, others) = (columns.map(S::as_simd_f64s), others.map(S::as_simd_f64s));
    let length = columns.iter().chain(&others).map(|c| c.0.len()).min().unwrap_or(0);
    let (a, b) = (columns.map(|c| &c.0[..length]), others.map(|c| &c.0[..length]));
    let mut sums = [[simd.splat_f64s(0.0); B]; A];
    for k in 0..length {
        for (sums, a) in sums.iter_mut().zip(&a) {
            for (sum, b) in sums.iter_mut().zip(&b) {
                *sum = simd.add_f64s(*sum, simd.mul_f64s(a[k], b[k]));
            }
        }
    }
    let whole = |sum: S::f64s| -> f64 {
        let lanes: &[f64] = cast_slice(std::slice::from_ref(&sum));
        lanes.chunks(2).map(|pair| pair.iter().sum::<f64>()).sum()
    };
    let tail = |i: usize, j: usize| columns[i].1.iter().zip(others[j].1).map(|(x, y)| x * y).sum::<f64>();
    from_fn(|i| from_fn(|j| whole(sums[i][j]) + tail(i, j)))
}

/// [`dot`] of each of several columns with each of some others, one list for each column.
pub(crate) fn dots_of_each(columns: &[&[f64]], others: &[&[f64]]) -> Vec<Vec<f64>> {
    let mut dots: Vec<Vec<f64>> = columns.iter().map(|_| vec![0.0; others.len()]).collect();
    Arch::new().dispatch(DotsOfEach { columns, others, dots: &mut dots });
    dots
}

/// Dot products of many columns with many others.
struct DotsOfEach<'a> {
    columns: &'a [&'a [f64]],
    others: &'a [&'a [f64]],
    dots: &'a mut [Vec<f64>],
}

impl WithSimd for DotsOfEach<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { columns, others, dots } = self;
        for (j, others) in others.chunks(4).enumerate() {
            for (columns, dots) in columns.chunks(2).zip(dots.chunks_mut(2)) {
                match (columns, others) {
                    (&[a, b], &[c, d, e, f]) => {
                        let [of_a, of_b] = tile(simd, [a, b], [c, d, e, f]);
                        dots[0][4 * j..][..4].copy_from_slice(&of_a);
                        dots[1][4 * j..][..4].copy_from_slice(&of_b);
                    }
                    (&[a], &[c, d, e, f]) => {
                        dots[0][4 * j..][..4].copy_from_slice(&tile(simd, [a], [c, d, e, f])[0]);
                    }
                    _ => {
                        for (dots, a) in dots.iter_mut().zip(columns) {
                            for (dot, b) in dots[4 * j..].iter_mut().zip(others) {
                                *dot = tile(simd, [*a], [*b])[0][0];
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Dot products of columns with each other; those that are zero all through cost nothing.
pub(crate) fn gram<C: AsRef<[f64]>>(columns: &[C]) -> DMatrix<f64> {
    let columns: Vec<&[f64]> = columns.iter().map(AsRef::as_ref).collect();
    let n = columns.len();
    let mut gram = DMatrix::zeros(n, n);
    let full: Vec<usize> = (0..n).filter(|&i| columns[i].iter().any(|v| *v != 0.0)).collect();
    let acting: Vec<&[f64]> = full.iter().map(|&i| columns[i]).collect();
    // Two rows of the lower triangle at a time.
    for first in (0..full.len()).step_by(2) {
        let end = (first + 2).min(full.len());
        for (&i, dots) in full[first..end].iter().zip(dots_of_each(&acting[first..end], &acting[..end])) {
            for (&j, dot) in full.iter().zip(dots) {
                (gram[(i, j)], gram[(j, i)]) = (dot, dot);
            }
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
        assert!(of_each.len() == 3 && dots_of_each(&all[..1], &[])[0].is_empty());
    }
}
