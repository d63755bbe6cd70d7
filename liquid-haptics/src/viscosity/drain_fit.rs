//! The viscosity whose drain fits the torque best.

use nalgebra::{DMatrix, DVector};

use super::drain::Drain;
use super::least_squares::{Fit, covariance, least_squares};
use super::{Bottle, normal_quantile};

/// Kinematic viscosities that the search for a drain starts from, m^2/s.
const DRAIN_STARTS: [f64; 9] = [1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0];

/// A drain fitted to readings: logarithm of the viscosity, and offset; the scale is the liquid's weight.
pub(super) struct DrainFit {
    pub(super) fit: Fit,
    /// Standard error of the viscosity's logarithm.
    ln_error: f64,
    /// How far the torque falls over the readings, N m, and the standard error of that fall.
    pub(super) fall: f64,
    pub(super) fall_error: f64,
}

impl DrainFit {
    /// Fits readings (N m) at times (s) after gravity has pulled along the wall for `head_start_s`; `mass_error_share` is the standard
    /// error of the liquid's mass over that mass.
    pub(super) fn new(
        bottle: &Bottle,
        head_start_s: f64,
        mass_error_share: f64,
        t_s: &[f64],
        reading: &[f64],
    ) -> Option<Self> {
        let plan = Drain::new(bottle);
        let scale = -bottle.density_kg_m3() * bottle.gravity_m_s2;
        let t: Vec<f64> = t_s.iter().map(|t| t + head_start_s).collect();
        let best = Self::search(&plan, scale, &t, reading, &DRAIN_STARTS)?;
        let at = |fit: &Fit, t: f64| scale * plan.moment_m4(fit.params[0].exp(), t);
        let fall = (at(&best, t[0]) - at(&best, t[t.len() - 1])).abs();
        let noise = covariance(&best)?[(0, 0)].max(0.0);
        // An error of the weight, propagated by fitting with another weight.
        let share = mass_error_share;
        let mut by_weight = 0.0;
        if share > 0.0 {
            let start = [best.params[0].exp()];
            let heavier = Self::search(&plan, scale * (1.0 + share), &t, reading, &start)?;
            let lighter = Self::search(&plan, scale * (1.0 - share), &t, reading, &start)?;
            by_weight = 0.5 * (heavier.params[0] - lighter.params[0]);
        }
        // The fall is what the readings' own noise leaves of an amplitude that is free.
        let shape = |i: usize| (at(&best, t[i]) - at(&best, t[t.len() - 1])) / fall.max(f64::MIN_POSITIVE);
        let free = Fit {
            params: DVector::from_vec(vec![fall, 0.0]),
            residuals: best.residuals.clone(),
            jacobian: DMatrix::from_fn(t.len(), 2, |i, j| if j == 0 { shape(i) } else { 1.0 }),
        };
        let fall_error = covariance(&free)?[(0, 0)].max(0.0).sqrt();
        Some(Self { fit: best, ln_error: (noise + by_weight * by_weight).sqrt(), fall, fall_error })
    }

    fn search(plan: &Drain, scale: f64, t: &[f64], reading: &[f64], starts: &[f64]) -> Option<Fit> {
        let model = |p: &DVector<f64>, values: &mut DVector<f64>, jacobian: &mut DMatrix<f64>| {
            const HALF_STEP: f64 = 1e-4;
            let at = |shift: f64, t: f64| scale * plan.moment_m4((p[0] + shift).exp(), t);
            for (i, t) in t.iter().enumerate() {
                values[i] = p[1] + at(0.0, *t);
                jacobian[(i, 0)] = (at(HALF_STEP, *t) - at(-HALF_STEP, *t)) / (2.0 * HALF_STEP);
                jacobian[(i, 1)] = 1.0;
            }
        };
        let last = reading[reading.len() - 1];
        let fits = starts.iter().filter_map(|viscosity| {
            let offset = last - scale * plan.moment_m4(*viscosity, t[t.len() - 1]);
            least_squares(reading, DVector::from_vec(vec![viscosity.ln(), offset]), model)
        });
        fits.min_by(|a, b| a.squares().total_cmp(&b.squares()))
    }

    /// Kinematic viscosity, m^2/s.
    pub(super) fn viscosity(&self) -> f64 {
        self.fit.params[0].exp()
    }

    /// The 95 % interval of the kinematic viscosity, m^2/s.
    pub(super) fn interval(&self) -> [f64; 2] {
        let reach = (normal_quantile() * self.ln_error).exp();
        [self.viscosity() / reach, self.viscosity() * reach]
    }
}
