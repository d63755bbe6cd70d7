//! Errors of several doughs, taken apart: what was not learned of the dynamics ties them over all doughs, and so does a batch that is as
//! a whole a little softer or harder than the one that was learned from.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::sensitivity::OWN;

/// Directions in which the innovations of some doughs are tied, and by how much each is to be shortened.
#[derive(Debug, Clone)]
pub struct Tie {
    directions: DMatrix<f64>,
    shorter: DVector<f64>,
}

/// Below this part of its own variance nothing is said to be tied.
const LEAST: f64 = 1e-3;

impl Tie {
    /// From each dough's answers ([`Dynamics::unlearned`](crate::dynamics::Dynamics::unlearned)), the doughs' innovations one after the
    /// other.
    pub fn new(doughs: &[DMatrix<f64>]) -> Self {
        let rows = doughs.iter().map(DMatrix::nrows).sum();
        let common = doughs.first().map_or(0, |part| part.ncols().saturating_sub(OWN));
        let columns = common + OWN * doughs.len() + 1;
        // What is common to all doughs, then each one's own, then how soft they all are: two batches differ as two doughs do.
        let mut all = DMatrix::zeros(rows, columns);
        let mut first = 0;
        for (at, part) in doughs.iter().enumerate() {
            let n = part.nrows();
            all.view_mut((first, 0), (n, common)).copy_from(&part.columns(0, common));
            let own = all.view_mut((first, common + OWN * at), (n, OWN));
            { own }.copy_from(&part.columns(common, OWN));
            all.view_mut((first, columns - 1), (n, 1)).copy_from(&part.column(common + OWN - 1));
            first += n;
        }
        let eigen = SymmetricEigen::new(all.tr_mul(&all));
        let strong: Vec<usize> = (0..columns).filter(|&k| eigen.eigenvalues[k] > LEAST).collect();
        let mut directions = DMatrix::zeros(rows, strong.len());
        for (column, &k) in strong.iter().enumerate() {
            let direction = &all * eigen.eigenvectors.column(k) / eigen.eigenvalues[k].sqrt();
            directions.set_column(column, &direction);
        }
        let shorter = strong.iter().map(|&k| 1.0 - 1.0 / (1.0 + eigen.eigenvalues[k]).sqrt());
        Self { directions, shorter: DVector::from_iterator(strong.len(), shorter) }
    }

    /// Errors that are independent, of variance one, each as near to what it was as can be.
    pub fn untie(&self, errors: &DVector<f64>) -> DVector<f64> {
        let along = self.directions.tr_mul(errors).component_mul(&self.shorter);
        errors - &self.directions * along
    }
}
