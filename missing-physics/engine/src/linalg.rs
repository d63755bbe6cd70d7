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

/// Dot products of columns with each other.
pub(crate) fn gram(columns: &[Vec<f64>]) -> DMatrix<f64> {
    let n = columns.len();
    let mut gram = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            gram[(i, j)] = dot(&columns[i], &columns[j]);
            gram[(j, i)] = gram[(i, j)];
        }
    }
    gram
}

/// Cholesky factor of a positive semidefinite matrix in place (lower triangle); a pivot below `floor` times its
/// diagonal entry is dropped (its row and column count as zero). Returns which pivots were kept.
pub(crate) fn cholesky(matrix: &mut DMatrix<f64>, floor: f64) -> Vec<bool> {
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
    kept
}

/// A run's nuisance coefficients once the shared ones are known: `nuisance` and the shared columns' `borders` are forward-solved with the nuisance
/// columns' factor.
pub(crate) fn back_substitute(
    factor: &DMatrix<f64>,
    kept: &[bool],
    borders: &[Vec<f64>],
    mut nuisance: Vec<f64>,
    shared: &[f64],
) -> Vec<f64> {
    for (border, x) in borders.iter().zip(shared) {
        nuisance.iter_mut().zip(border).for_each(|(o, b)| *o -= x * b);
    }
    backward(factor, kept, &mut nuisance);
    nuisance
}

/// Cholesky with pivots judged against the columns' sums of squares before elimination.
pub(crate) fn cholesky_against(matrix: &mut DMatrix<f64>, scales: &[f64]) -> Vec<bool> {
    for (i, scale) in scales.iter().enumerate() {
        if matrix[(i, i)] <= 1e-9 * scale {
            for j in 0..scales.len() {
                matrix[(i, j)] = 0.0;
                matrix[(j, i)] = 0.0;
            }
        }
    }
    cholesky(matrix, 1e-9)
}

/// Solves `L x = b` in place; entries of dropped pivots become zero.
pub(crate) fn forward(factor: &DMatrix<f64>, kept: &[bool], b: &mut [f64]) {
    for i in 0..b.len() {
        if !kept[i] {
            b[i] = 0.0;
            continue;
        }
        let mut value = b[i];
        for k in 0..i {
            value -= factor[(i, k)] * b[k];
        }
        b[i] = value / factor[(i, i)];
    }
}

/// Solves `L^T x = b` in place; entries of dropped pivots become zero.
pub(crate) fn backward(factor: &DMatrix<f64>, kept: &[bool], b: &mut [f64]) {
    for i in (0..b.len()).rev() {
        if !kept[i] {
            b[i] = 0.0;
            continue;
        }
        let mut value = b[i];
        for k in i + 1..b.len() {
            if kept[k] {
                value -= factor[(k, i)] * b[k];
            }
        }
        b[i] = value / factor[(i, i)];
    }
}

/// Log determinant over the kept pivots.
pub(crate) fn log_determinant(factor: &DMatrix<f64>, kept: &[bool]) -> f64 {
    (0..kept.len()).filter(|&i| kept[i]).map(|i| 2.0 * factor[(i, i)].ln()).sum()
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

/// Pivots below this share of their diagonal count as not determined.
pub(crate) const RANK_FLOOR: f64 = 1e-11;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dependent_column_is_dropped_and_the_rest_solved() {
        let columns = [[1.0, 2.0, 3.0, 4.0], [2.0, 4.0, 6.0, 8.0], [1.0, 0.0, -1.0, 5.0]];
        let mut gram = DMatrix::from_fn(3, 3, |i, j| dot(&columns[i], &columns[j]));
        let target = [2.0, 2.0, 2.0, 9.0]; // first + third
        let mut b: Vec<f64> = columns.iter().map(|c| dot(c, &target)).collect();
        let kept = cholesky(&mut gram, RANK_FLOOR);
        assert_eq!(kept, vec![true, false, true]);
        forward(&gram, &kept, &mut b);
        backward(&gram, &kept, &mut b);
        approx::assert_relative_eq!(b.as_slice(), [1.0, 0.0, 1.0].as_slice(), epsilon = 1e-12);
    }
}
