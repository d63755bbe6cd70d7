//! Local maxima of a mixture.

use nalgebra::{DMatrix, DVector};

use crate::component::Component;
use crate::mixture::{Mixture, Mode};

impl Mixture {
    /// Local maxima, highest first, by fixed-point ascent from every component's mean (Carreira-Perpinan 2000,
    /// doi:10.1109/34.888716).
    pub fn modes(&self) -> Vec<Mode> {
        let precisions: Vec<DMatrix<f64>> = self.components.iter().map(Component::precision).collect();
        let mut modes: Vec<(Mode, DMatrix<f64>)> = Vec::new();
        for c in &self.components {
            let (at, curvature) = self.ascend(c.mean.clone(), &precisions);
            let ln_density = self.ln_density_unchecked(at.as_slice());
            // Nearer than a hundredth of the local width: the same.
            let same = modes.iter_mut().find(|(m, p)| {
                let away = &at - DVector::from_column_slice(&m.at);
                (away.transpose() * p * &away)[0] < 1e-4
            });
            let mode = Mode { at: at.as_slice().to_vec(), ln_density };
            match same {
                Some(found) if found.0.ln_density < ln_density => *found = (mode, curvature),
                Some(_) => {}
                None => modes.push((mode, curvature)),
            }
        }
        modes.sort_by(|a, b| b.0.ln_density.total_cmp(&a.0.ln_density));
        modes.into_iter().map(|m| m.0).collect()
    }

    fn ascend(&self, mut at: DVector<f64>, precisions: &[DMatrix<f64>]) -> (DVector<f64>, DMatrix<f64>) {
        let d = self.dim();
        let mut total = DMatrix::zeros(d, d);
        for _ in 0..500 {
            let ln = self.ln_density_unchecked(at.as_slice());
            total.fill(0.0);
            let mut right = DVector::zeros(d);
            for (c, precision) in self.components.iter().zip(precisions) {
                let share = (c.ln_weight + c.ln_density(at.as_slice()) - ln).exp();
                if share > 1e-12 {
                    total += precision * share;
                    right += precision * &c.mean * share;
                }
            }
            let Some(factor) = total.clone().cholesky() else { break };
            let next = factor.solve(&right);
            let step = &next - &at;
            at = next;
            if (step.transpose() * &total * &step)[0] < 1e-16 {
                break;
            }
        }
        (at, total)
    }
}
