//! Refits of the linearised baseline.

use nalgebra::DMatrix;

use crate::fit::bordered::BorderedNormal;

/// Least squares over runs from the lower triangles of their Gram matrices: columns of each run's nuisance parameters, `n_shared` of all
/// runs, the residual. Sum of squares that is left, and each run's coefficients. A shared column that the others span has none.
pub(crate) fn least_squares(
    grams: impl Iterator<Item = DMatrix<f64>>,
    n_shared: usize,
) -> (f64, Vec<Vec<f64>>) {
    let mut bordered = BorderedNormal::new(n_shared);
    grams.for_each(|gram| bordered.add(&gram));
    let (shared, left) = bordered.solve(&bordered.factor_of_independent());
    (left, bordered.coefficients(&shared))
}
