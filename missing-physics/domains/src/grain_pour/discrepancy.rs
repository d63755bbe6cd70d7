//! By how much pictures of other grains, or of another simulator, may differ from the emulator beyond what chance does.

use granular_infer::statistics::{COUNT, STATISTICS, Symmetry};
use nalgebra::{DMatrix, Vector2};

/// By how much the grains of nature, or of another simulator, and the emulator's own error move the mean of a statistic, in sigmas from
/// pour to pour; and of what few strays decide. The test `another_simulator` prints how far heaps of LIGGGHTS lie from the emulator.
const DISCREPANCY: f64 = 0.3;
const STRAY_DISCREPANCY: f64 = 0.9;
/// By how much they move the centroid and the ground's slope along a tilt, in sigmas from pour to pour.
const TILT_DISCREPANCY: f64 = 0.7;

/// Covariance of the discrepancies, in sigmas from pour to pour.
pub(super) fn discrepancy(mean: &[f64; COUNT], sigma: &[f64; COUNT]) -> DMatrix<f64> {
    let mut covariance = DMatrix::zeros(COUNT, COUNT);
    for (k, (name, symmetry)) in STATISTICS.iter().enumerate() {
        let part = match (name.as_str(), symmetry) {
            ("stray_height", _) => STRAY_DISCREPANCY,
            (_, Symmetry::Vector) => TILT_DISCREPANCY,
            _ => DISCREPANCY,
        };
        match symmetry {
            Symmetry::Scalar => covariance[(k, k)] = part * part,
            // What vanishes by symmetry does so in every code: a pair is moved by too much or too little along where it is moved.
            Symmetry::Vector | Symmetry::Tensor => {
                let moved = Vector2::new(mean[k] / sigma[k], mean[k + 1] / sigma[k + 1]);
                let along = moved * (part / (1.0 + moved.norm_squared()).sqrt());
                covariance.fixed_view_mut::<2, 2>(k, k).copy_from(&(along * along.transpose()));
            }
            Symmetry::Second => {}
        }
    }
    covariance
}
