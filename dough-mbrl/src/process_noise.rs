//! The noise of what rolls do beyond their dynamics, by the likelihood of the innovations.

use argmin::core::{CostFunction, Error, Executor};
use nalgebra::Vector3;

use crate::filter::{InitialState, Noise, Relaxation, follow};
use crate::nuisance::{Nuisance, trends};
use crate::powell::Powell;
use crate::roll::Roll;
use crate::sensitivity::{PER_ROLL, negative_log_likelihood};
use crate::surface::Surface;

/// Bounds of the logarithm of the process noise over the variance of a measurement.
const LOG_PROCESS: [f64; 2] = [-7.0, 4.0];
/// Bounds of the logarithm of the variance of the part by which a roll does more or less: 0.3 to 30 %.
const LOG_SCATTER: [f64; 2] = [-11.6, -2.4];

/// Twice the negative log likelihood over the logarithms of the process noise (in units of the measurements' variance) and of the scatter.
pub(crate) struct ProcessNoise<'a> {
    pub(crate) doughs: &'a [Vec<Roll>],
    pub(crate) surface: &'a Surface,
    /// The noise so far.
    pub(crate) noise: &'a Noise,
    /// Nuisance parameters of each dough.
    pub(crate) nuisances: &'a [Nuisance],
    /// Effective number of parameters that were learned from these innovations.
    pub(crate) effective_parameters: f64,
}

impl ProcessNoise<'_> {
    /// The most likely noise; none where the search fails.
    pub(crate) fn fit(&self) -> Option<Noise> {
        let now = self.noise.process.zip_map(&self.noise.measured[1], |q, r| (q / r).max(1e-9).ln());
        let [low, high]: [Vec<f64>; 2] = [0, 1].map(|at| {
            let three = std::iter::repeat_n(LOG_PROCESS[at], 3);
            three.chain([LOG_SCATTER[at]]).collect()
        });
        let now = now.iter().copied().chain([self.noise.scatter.ln()]);
        let start: Vec<f64> = now.zip(low.iter().zip(&high)).map(|(v, (l, h))| v.clamp(*l, *h)).collect();
        let powell = Powell::new(low, high, 1e-4).ok()?;
        let found = Executor::new(self, powell.with_lines(8, 0.02))
            .configure(|s| s.param(start).max_iters(1))
            .timer(false)
            .ctrlc(false)
            .run();
        let best = found.ok().and_then(|mut r| r.state.take_best_param());
        best.map(|log| self.noise_at(&log))
    }

    fn noise_at(&self, log: &[f64]) -> Noise {
        let process = Vector3::from_fn(|k, _| log[k].exp() * self.noise.measured[1][k]);
        Noise { process, scatter: log[3].exp(), ..*self.noise }
    }
}

impl CostFunction for &ProcessNoise<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, log: &Vec<f64>) -> Result<f64, Error> {
        let noise = self.noise_at(log);
        let initial = InitialState::of_doughs(self.doughs, &noise);
        let (mut log_determinant, mut sum_of_squares) = (0.0, 0.0);
        for (dough, nuisance) in self.doughs.iter().zip(self.nuisances) {
            let trends = trends(dough.len());
            let next = |i: usize, x: &Vector3<f64>| {
                let trend: Vector3<f64> =
                    nuisance.trends.iter().zip(&trends).map(|(amplitude, t)| amplitude * t[i]).sum();
                x + (1.0 + nuisance.softness) * self.surface.change(x, &dough[i].action) + trend
            };
            let part = negative_log_likelihood(&follow(dough, &initial, &noise, Relaxation::NONE, next));
            log_determinant += part.log_determinant;
            sum_of_squares += part.sum_of_squares;
        }
        // The parameters that were learned from these innovations have made them smaller.
        let rows = PER_ROLL as f64 * self.doughs.iter().map(Vec::len).sum::<usize>() as f64;
        Ok(log_determinant + sum_of_squares * rows / (rows - self.effective_parameters).max(1.0))
    }
}
