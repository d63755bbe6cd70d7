//! Coefficients by the likelihood of the innovations they leave (prediction-error method, Ljung 1999), with the variances of all that is
//! random (noise, remainder, nuisances of the doughs) from the marginal likelihood (MacKay 1992,
//! doi:10.1162/neco.1992.4.3.415; Dempster, Laird and Rubin 1977).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};

use crate::filter::{InitialState, Noise, Relaxation, follow};
use crate::nuisance::{NUISANCES, Nuisance, NuisanceVariances, trends};
use crate::predictor::LearnError;
use crate::process_noise::ProcessNoise;
use crate::roll::Roll;
use crate::sensitivity::{sensitivity, whitened};
use crate::surface::Surface;

/// Rounds of following the doughs, and learning again from where this leads.
const ROUNDS: usize = 8;
/// Updates of the variances in each round.
const UPDATES: usize = 6;
/// Least doughs from which nuisances of each are learned.
const DOUGHS: usize = 3;

/// What was learned.
#[derive(Debug, Clone)]
pub(crate) struct Learned {
    pub(crate) surface: Surface,
    pub(crate) noise: Noise,
    pub(crate) nuisance: NuisanceVariances,
    /// Factor of the precision of all coefficients.
    pub(crate) precision: Cholesky<f64, Dyn>,
}

/// Doughs to learn from, and the estimates so far.
struct Learning<'a> {
    doughs: &'a [Vec<Roll>],
    surface: Surface,
    noise: Noise,
    nuisance: NuisanceVariances,
    /// Variances of the coefficients of each degree of the remainder, by dimension.
    remainder: Vec<Vector3<f64>>,
    /// Nuisance parameters of each dough.
    estimates: Vec<Nuisance>,
    /// Effective number of parameters: those that the prior holds count in part.
    effective_parameters: f64,
    /// Mean square change of a roll, by dimension, m^2.
    change: Vector3<f64>,
}

/// The normal equations of a round: sums over the innovations.
struct Sums {
    square: DMatrix<f64>,
    pull: DVector<f64>,
    doughs: Vec<NuisanceSums>,
}

/// Sums over the innovations of a dough with nuisance parameters.
struct NuisanceSums {
    dough: usize,
    /// Number of its trends.
    trends: usize,
    /// Coefficients with nuisances.
    cross: DMatrix<f64>,
    /// Nuisances with nuisances.
    square: DMatrix<f64>,
    /// Nuisances with the innovations.
    pull: DVector<f64>,
}

/// Prior sigma of a nuisance, as a part of the root mean square change.
const NUISANCE_PART: f64 = 0.01;
/// Prior sigma of the coefficients of each degree, as a part of the same.
const DEGREE_PARTS: [f64; 4] = [0.5, 0.2, 0.02, 0.01];
/// As how many doughs' trends, or terms, a prior variance counts.
const PRIOR_COUNT: f64 = 6.0;

/// Learns from doughs, beginning with a surface and a noise.
pub(crate) fn learn(doughs: &[Vec<Roll>], surface: Surface, noise: Noise) -> Result<Learned, LearnError> {
    let square = |r: &Roll| (Vector3::from(r.next) - Vector3::from(r.state)).map(|d| d * d);
    let rolls = doughs.iter().map(Vec::len).sum::<usize>().max(1) as f64;
    let change = doughs.iter().flatten().map(square).sum::<Vector3<f64>>() / rolls;
    let remainder = DEGREE_PARTS.iter().map(|part| part * part * change).collect();
    let prior = if doughs.len() < DOUGHS { 0.0 } else { NUISANCE_PART.powi(2) };
    let nuisance = NuisanceVariances { trend_m2: Vector3::repeat(prior * change.sum()), softness: prior };
    let estimates = vec![Nuisance::default(); doughs.len()];
    let mut learning = Learning {
        doughs,
        surface,
        noise,
        nuisance,
        remainder,
        estimates,
        effective_parameters: 0.0,
        change,
    };
    let mut precision = None;
    for _ in 0..ROUNDS {
        learning.fit_process_noise();
        let sums = learning.sums();
        let before = learning.surface.flat();
        for _ in 0..UPDATES {
            precision = Some(learning.update(&sums, &before)?);
        }
    }
    let Learning { surface, noise, nuisance, .. } = learning;
    let precision = precision.ok_or_else(Surface::undetermined)?;
    Ok(Learned { surface, noise, nuisance, precision })
}

impl Learning<'_> {
    /// Process noise and scatter of the most likely innovations.
    fn fit_process_noise(&mut self) {
        let Self { doughs, surface, noise, estimates, effective_parameters, .. } = self;
        let likelihood = ProcessNoise {
            doughs,
            surface,
            noise,
            nuisances: estimates,
            effective_parameters: *effective_parameters,
        };
        if let Some(found) = likelihood.fit() {
            self.noise = found;
        }
    }

    fn sums(&self) -> Sums {
        let initial = InitialState::of_doughs(self.doughs, &self.noise);
        let n = 3 * self.surface.terms_of_each();
        let mut sums = Sums { square: DMatrix::zeros(n, n), pull: DVector::zeros(n), doughs: Vec::new() };
        for (at, dough) in self.doughs.iter().enumerate() {
            let next = |i: usize, x: &Vector3<f64>| x + self.surface.change(x, &dough[i].action);
            let steps = follow(dough, &initial, &self.noise, Relaxation::NONE, next);
            let terms = |i: usize| self.surface.slopes(&steps[i].state, &dough[i].action);
            let all = sensitivity(&steps, terms, |_| 1.0, n / 3);
            let (off, shared, nuisance) = (whitened(&steps), all.columns(0, n), all.columns(n, NUISANCES));
            sums.square += shared.tr_mul(&shared);
            sums.pull += shared.tr_mul(&off);
            let trends = trends(dough.len()).len();
            if trends > 0 && self.doughs.len() >= DOUGHS {
                sums.doughs.push(NuisanceSums {
                    dough: at,
                    trends,
                    cross: shared.tr_mul(&nuisance),
                    square: nuisance.tr_mul(&nuisance),
                    pull: nuisance.tr_mul(&off),
                });
            }
        }
        sums
    }

    /// Coefficients at the present variances, then the variances at these coefficients.
    fn update(&mut self, sums: &Sums, before: &DVector<f64>) -> Result<Cholesky<f64, Dyn>, LearnError> {
        let covariances = self.nuisance_covariances(sums);
        let (mut normal, mut pull) = (sums.square.clone(), sums.pull.clone());
        for (dough, covariance) in sums.doughs.iter().zip(&covariances) {
            let part = &dough.cross * covariance;
            normal -= &part * dough.cross.transpose();
            pull -= part * &dough.pull;
        }
        let target = &normal * before - pull;
        self.add_prior(&mut normal);
        let precision = normal.cholesky().ok_or_else(Surface::undetermined)?;
        let coefficients = precision.solve(&target);
        if coefficients.iter().any(|v| !v.is_finite()) {
            return Err(Surface::undetermined());
        }
        self.surface.set(&coefficients);
        let covariance = precision.inverse();
        self.update_remainder(&coefficients, &covariance);
        self.update_nuisances(sums, &covariances, &(&coefficients - before), &covariance);
        Ok(precision)
    }

    /// Covariance of each dough's nuisances, the coefficients given.
    fn nuisance_covariances(&self, sums: &Sums) -> Vec<DMatrix<f64>> {
        let n = NUISANCES;
        let sigma = DMatrix::from_diagonal(&DVector::from_fn(n, |k, _| self.nuisance.of(k).sqrt()));
        let covariance = |dough: &NuisanceSums| {
            let inner = DMatrix::identity(n, n) + &sigma * &dough.square * &sigma;
            inner.cholesky().map_or_else(|| DMatrix::zeros(n, n), |c| &sigma * c.inverse() * &sigma)
        };
        sums.doughs.iter().map(covariance).collect()
    }

    /// Adds the prior's precision of each coefficient, and a little against rounding.
    fn add_prior(&self, normal: &mut DMatrix<f64>) {
        let p = self.surface.terms_of_each();
        let least = 1e-11 * normal.diagonal().amax();
        for k in 0..normal.nrows() {
            normal[(k, k)] += least;
        }
        for (range, variances) in self.surface.degrees().iter().zip(&self.remainder) {
            for k in 0..3 {
                for j in range.clone() {
                    normal[(k * p + j, k * p + j)] += 1.0 / variances[k];
                }
            }
        }
    }

    /// Prior variances of each degree's coefficients.
    fn update_remainder(&mut self, coefficients: &DVector<f64>, covariance: &DMatrix<f64>) {
        let degrees = self.surface.degrees();
        let p = self.surface.terms_of_each();
        self.effective_parameters = degrees.first().map_or(0.0, |first| 3.0 * first.start as f64);
        for ((range, variances), part) in degrees.iter().zip(&mut self.remainder).zip(DEGREE_PARTS) {
            for k in 0..3 {
                let (mut square, mut effective) = (0.0, 0.0);
                for j in range.clone() {
                    let at = k * p + j;
                    square += coefficients[at] * coefficients[at];
                    effective += 1.0 - covariance[(at, at)] / variances[k];
                }
                self.effective_parameters += effective.max(0.0);
                let prior = PRIOR_COUNT * part * part * self.change[k];
                variances[k] = (square + prior) / (effective.max(0.0) + PRIOR_COUNT);
            }
        }
    }

    /// Nuisances of each dough, and their variances; the coefficients have `moved` since the sums were made.
    fn update_nuisances(
        &mut self,
        sums: &Sums,
        covariances: &[DMatrix<f64>],
        moved: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) {
        const SOFTNESS: usize = NUISANCES - 1;
        let (mut sum, mut count, mut soft) = (Vector3::<f64>::zeros(), 0.0, 0.0);
        for (dough, given) in sums.doughs.iter().zip(covariances) {
            let part = &dough.cross * given;
            let mean = -given * (&dough.pull + dough.cross.tr_mul(moved));
            let spread = given + part.tr_mul(&(covariance * &part));
            let square = |at: usize| mean[at] * mean[at] + spread[(at, at)];
            let prior = |at: usize| self.nuisance.of(at).max(f64::MIN_POSITIVE);
            let effective = |at: usize| (1.0 - spread[(at, at)] / prior(at)).max(0.0);
            let estimate = &mut self.estimates[dough.dough];
            for c in 0..dough.trends {
                for k in 0..3 {
                    let at = 3 * c + k;
                    estimate.trends[c][k] = mean[at];
                    sum[k] += square(at);
                    self.effective_parameters += effective(at);
                }
                count += 1.0;
            }
            estimate.softness = mean[SOFTNESS];
            soft += square(SOFTNESS);
            self.effective_parameters += effective(SOFTNESS);
        }
        if count > 0.0 {
            let prior = PRIOR_COUNT * NUISANCE_PART.powi(2);
            self.nuisance.trend_m2 = sum.map(|s| (s + prior * self.change.sum()) / (count + PRIOR_COUNT));
            self.nuisance.softness = (soft + prior) / (sums.doughs.len() as f64 + PRIOR_COUNT);
        }
    }
}
