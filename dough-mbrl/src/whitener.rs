//! A whitener of the innovations of several doughs: what was not learned of the dynamics is a mode common to all doughs, and so is a
//! batch that is as a whole a little softer or harder than the one that was learned from.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::nuisance::NUISANCES;

/// Directions along which the innovations of some doughs vary together, and by which part of itself each is to be shortened.
#[derive(Debug, Clone)]
pub struct CommonModeWhitener {
    directions: DMatrix<f64>,
    shortening: DVector<f64>,
}

/// A direction whose common variance is below this part of the innovations' own is left as it is.
const LEAST_VARIANCE: f64 = 1e-3;

impl CommonModeWhitener {
    /// From each dough's sensitivity to what was not learned ([`Dynamics::unlearned`](crate::dynamics::Dynamics::unlearned)), the
    /// doughs' innovations one after the other.
    pub fn new(doughs: &[DMatrix<f64>]) -> Self {
        let rows = doughs.iter().map(DMatrix::nrows).sum();
        let common = doughs.first().map_or(0, |part| part.ncols().saturating_sub(NUISANCES));
        let columns = common + NUISANCES * doughs.len() + 1;
        // Modes common to all doughs, then each dough's nuisances, then the softness of them all: two batches differ as two doughs do.
        let mut modes = DMatrix::zeros(rows, columns);
        let mut first = 0;
        for (at, part) in doughs.iter().enumerate() {
            let n = part.nrows();
            modes.view_mut((first, 0), (n, common)).copy_from(&part.columns(0, common));
            let nuisances = modes.view_mut((first, common + NUISANCES * at), (n, NUISANCES));
            { nuisances }.copy_from(&part.columns(common, NUISANCES));
            modes.view_mut((first, columns - 1), (n, 1)).copy_from(&part.column(common + NUISANCES - 1));
            first += n;
        }
        let eigen = SymmetricEigen::new(modes.tr_mul(&modes));
        let strong: Vec<usize> = (0..columns).filter(|&k| eigen.eigenvalues[k] > LEAST_VARIANCE).collect();
        let mut directions = DMatrix::zeros(rows, strong.len());
        for (column, &k) in strong.iter().enumerate() {
            let direction = &modes * eigen.eigenvectors.column(k) / eigen.eigenvalues[k].sqrt();
            directions.set_column(column, &direction);
        }
        let shortening = strong.iter().map(|&k| 1.0 - 1.0 / (1.0 + eigen.eigenvalues[k]).sqrt());
        Self { directions, shortening: DVector::from_iterator(strong.len(), shortening) }
    }

    /// Independent errors of variance one, each as near to its innovation as can be.
    pub fn whiten(&self, innovations: &DVector<f64>) -> DVector<f64> {
        let along = self.directions.tr_mul(innovations).component_mul(&self.shortening);
        innovations - &self.directions * along
    }
}
