//! Coefficients by the likelihood of the innovations they leave (prediction-error method, Ljung 1999), with the sizes of all that is
//! random (noise, remainder, what each dough does for itself) from the marginal likelihood (MacKay 1992,
//! doi:10.1162/neco.1992.4.3.415; Dempster, Laird and Rubin 1977).

use argmin::core::{CostFunction, Error, Executor};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};

use crate::dynamics::{LearnError, Own, Roll};
use crate::filter::{Beside, Fresh, Noise, follow};
use crate::powell::Powell;
use crate::sensitivity::{COURSES, OWN, PER_ROLL, courses, sensitivity, surprise, white};
use crate::surface::Surface;

/// Rounds of following the doughs, and learning again from where this leads.
const ROUNDS: usize = 8;
/// Updates of the sizes in each round.
const UPDATES: usize = 6;
/// Least doughs from which it can be said what each does for itself.
const DOUGHS: usize = 3;
/// Logarithm of the variance of what a roll does beyond its dynamics, over that of a measurement.
const LOG_PROCESS: [f64; 2] = [-7.0, 4.0];
/// Logarithm of the variance of the part by which a roll does more or less: 0.3 to 30 %.
const LOG_SCATTER: [f64; 2] = [-11.6, -2.4];

/// What was learned.
#[derive(Debug, Clone)]
pub(crate) struct Learned {
    pub(crate) surface: Surface,
    pub(crate) noise: Noise,
    pub(crate) own: Own,
    /// Factor of the precision of all coefficients.
    pub(crate) precision: Cholesky<f64, Dyn>,
}

/// Doughs to learn from, and what is held of them so far.
struct Learning<'a> {
    doughs: &'a [Vec<Roll>],
    surface: Surface,
    noise: Noise,
    own: Own,
    /// Variances of the coefficients of each degree of the remainder, by dimension.
    remainder: Vec<Vector3<f64>>,
    /// What each dough does for itself.
    found: Vec<Found>,
    /// How many numbers were learned, those that the prior holds counted in part.
    learned: f64,
    /// Mean square change of a roll, by dimension, m^2.
    change: Vector3<f64>,
}

/// The innovations of a round and how they answer: sums over the rows.
struct Sums {
    square: DMatrix<f64>,
    pull: DVector<f64>,
    own: Vec<OwnSums>,
}

/// What a dough was found to do for itself.
#[derive(Debug, Clone, Copy, Default)]
struct Found {
    courses: [Vector3<f64>; COURSES],
    softness: f64,
}

/// Sums over the rows of a dough that can do something for itself.
struct OwnSums {
    dough: usize,
    /// Number of its courses.
    courses: usize,
    /// Coefficients with own.
    cross: DMatrix<f64>,
    /// Own with own.
    square: DMatrix<f64>,
    /// Own with the innovations.
    pull: DVector<f64>,
}

/// Before anything is learned, doughs are held to differ in what they do for themselves, and the remainder's terms to be, by these parts
/// of the root mean square change; each counts as so many doughs' courses, or terms.
const OWN_PART: f64 = 0.01;
const PARTS: [f64; 4] = [0.5, 0.2, 0.02, 0.01];
const HELD: f64 = 6.0;

/// Learns from doughs, beginning with a surface and what scatters measurements.
pub(crate) fn learn(doughs: &[Vec<Roll>], surface: Surface, noise: Noise) -> Result<Learned, LearnError> {
    let square = |r: &Roll| (Vector3::from(r.next) - Vector3::from(r.state)).map(|d| d * d);
    let rolls = doughs.iter().map(Vec::len).sum::<usize>().max(1) as f64;
    let change = doughs.iter().flatten().map(square).sum::<Vector3<f64>>() / rolls;
    let remainder = PARTS.iter().map(|part| part * part * change).collect();
    let held = if doughs.len() < DOUGHS { 0.0 } else { OWN_PART.powi(2) };
    let own = Own { courses: Vector3::repeat(held * change.sum()), softness: held };
    let found = vec![Found::default(); doughs.len()];
    let mut learning = Learning { doughs, surface, noise, own, remainder, found, learned: 0.0, change };
    let mut precision = None;
    for _ in 0..ROUNDS {
        learning.size_of_process();
        let sums = learning.sums();
        let before = learning.surface.flat();
        for _ in 0..UPDATES {
            precision = Some(learning.update(&sums, &before)?);
        }
    }
    let Learning { surface, noise, own, .. } = learning;
    let precision = precision.ok_or_else(Surface::undetermined)?;
    Ok(Learned { surface, noise, own, precision })
}

impl Learning<'_> {
    fn fresh(&self, noise: &Noise) -> Fresh {
        let first: Vec<_> = self.doughs.iter().filter_map(|d| Some(d.first()?.state)).collect();
        Fresh::of(&first, noise)
    }

    fn sums(&self) -> Sums {
        let fresh = self.fresh(&self.noise);
        let n = 3 * self.surface.terms_of_each();
        let mut sums = Sums { square: DMatrix::zeros(n, n), pull: DVector::zeros(n), own: Vec::new() };
        for (at, dough) in self.doughs.iter().enumerate() {
            let next = |i: usize, x: &Vector3<f64>| x + self.surface.change(x, &dough[i].action);
            let steps = follow(dough, &fresh, &self.noise, Beside::NOTHING, next);
            let terms = |i: usize| self.surface.slopes(&steps[i].state, &dough[i].action);
            let all = sensitivity(&steps, terms, |_| 1.0, n / 3);
            let (off, shared, own) = (white(&steps), all.columns(0, n), all.columns(n, OWN));
            sums.square += shared.tr_mul(&shared);
            sums.pull += shared.tr_mul(&off);
            let courses = courses(dough.len()).len();
            if courses > 0 && self.doughs.len() >= DOUGHS {
                sums.own.push(OwnSums {
                    dough: at,
                    courses,
                    cross: shared.tr_mul(&own),
                    square: own.tr_mul(&own),
                    pull: own.tr_mul(&off),
                });
            }
        }
        sums
    }

    /// Coefficients at the sizes as they are, then the sizes at these coefficients.
    fn update(&mut self, sums: &Sums, before: &DVector<f64>) -> Result<Cholesky<f64, Dyn>, LearnError> {
        let sigma = DMatrix::from_diagonal(&DVector::from_fn(OWN, |k, _| self.own.of(k).sqrt()));
        let shrinks: Vec<DMatrix<f64>> = sums
            .own
            .iter()
            .map(|own| {
                let inner = DMatrix::identity(OWN, OWN) + &sigma * &own.square * &sigma;
                inner.cholesky().map_or_else(|| DMatrix::zeros(OWN, OWN), |c| &sigma * c.inverse() * &sigma)
            })
            .collect();
        let (mut normal, mut pull) = (sums.square.clone(), sums.pull.clone());
        for (own, shrink) in sums.own.iter().zip(&shrinks) {
            let part = &own.cross * shrink;
            normal -= &part * own.cross.transpose();
            pull -= part * &own.pull;
        }
        let target = &normal * before - pull;
        let p = self.surface.terms_of_each();
        let least = 1e-11 * normal.diagonal().amax();
        for k in 0..normal.nrows() {
            normal[(k, k)] += least;
        }
        let degrees = self.surface.degrees();
        for (range, variances) in degrees.iter().zip(&self.remainder) {
            for k in 0..3 {
                for j in range.clone() {
                    normal[(k * p + j, k * p + j)] += 1.0 / variances[k];
                }
            }
        }
        let precision = normal.cholesky().ok_or_else(Surface::undetermined)?;
        let found = precision.solve(&target);
        if found.iter().any(|v| !v.is_finite()) {
            return Err(Surface::undetermined());
        }
        self.surface.set(&found);
        let covariance = precision.inverse();
        self.size_of_remainder(&degrees, &found, &covariance);
        self.size_of_own(sums, &shrinks, &(&found - before), &covariance);
        Ok(precision)
    }

    fn size_of_remainder(
        &mut self,
        degrees: &[std::ops::Range<usize>],
        found: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) {
        let p = self.surface.terms_of_each();
        self.learned = degrees.first().map_or(0.0, |first| 3.0 * first.start as f64);
        for ((range, variances), part) in degrees.iter().zip(&mut self.remainder).zip(PARTS) {
            for k in 0..3 {
                let (mut square, mut told) = (0.0, 0.0);
                for j in range.clone() {
                    let at = k * p + j;
                    square += found[at] * found[at];
                    told += 1.0 - covariance[(at, at)] / variances[k];
                }
                self.learned += told.max(0.0);
                let held = HELD * part * part * self.change[k];
                variances[k] = (square + held) / (told.max(0.0) + HELD);
            }
        }
    }

    fn size_of_own(
        &mut self,
        sums: &Sums,
        shrinks: &[DMatrix<f64>],
        moved: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) {
        let (mut sum, mut count, mut soft) = (Vector3::<f64>::zeros(), 0.0, 0.0);
        for (own, shrink) in sums.own.iter().zip(shrinks) {
            let part = &own.cross * shrink;
            let mean = -shrink * (&own.pull + own.cross.tr_mul(moved));
            let spread = shrink + part.tr_mul(&(covariance * &part));
            let square = |at: usize| mean[at] * mean[at] + spread[(at, at)];
            let told = |at: usize| (1.0 - spread[(at, at)] / self.own.of(at).max(f64::MIN_POSITIVE)).max(0.0);
            let found = &mut self.found[own.dough];
            for c in 0..own.courses {
                for k in 0..3 {
                    let at = 3 * c + k;
                    found.courses[c][k] = mean[at];
                    sum[k] += square(at);
                    self.learned += told(at);
                }
                count += 1.0;
            }
            found.softness = mean[OWN - 1];
            soft += square(OWN - 1);
            self.learned += told(OWN - 1);
        }
        if count > 0.0 {
            let held = HELD * OWN_PART.powi(2);
            self.own.courses = sum.map(|s| (s + held * self.change.sum()) / (count + HELD));
            self.own.softness = (soft + held) / (sums.own.len() as f64 + HELD);
        }
    }

    /// The variance of what a roll does beyond its dynamics, by the likelihood of the innovations.
    fn size_of_process(&mut self) {
        let problem = Process { learning: self, least: self.noise.measured[1] };
        let now = self.noise.process.zip_map(&self.noise.measured[1], |q, r| (q / r).max(1e-9).ln());
        let [low, high]: [Vec<f64>; 2] = [0, 1].map(|at| {
            let three = std::iter::repeat_n(LOG_PROCESS[at], 3);
            three.chain([LOG_SCATTER[at]]).collect()
        });
        let now = now.iter().copied().chain([self.noise.scatter.ln()]);
        let start: Vec<f64> = now.zip(low.iter().zip(&high)).map(|(v, (l, h))| v.clamp(*l, *h)).collect();
        let Ok(powell) = Powell::new(low, high, 1e-4) else { return };
        let found = Executor::new(problem, powell.with_lines(8, 0.02))
            .configure(|s| s.param(start).max_iters(1))
            .timer(false)
            .ctrlc(false)
            .run();
        let best = found.ok().and_then(|mut r| r.state.take_best_param());
        if let Some(log) = best {
            self.noise.process = Vector3::from_fn(|k, _| log[k].exp() * self.noise.measured[1][k]);
            self.noise.scatter = log[3].exp();
        }
    }
}

/// Minus twice the logarithm of the likelihood, by the logarithms of the process over the measurements' variance, and of the scatter.
struct Process<'a, 'b> {
    learning: &'a Learning<'b>,
    least: Vector3<f64>,
}

impl CostFunction for Process<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, log: &Vec<f64>) -> Result<f64, Error> {
        let Learning { doughs, surface, noise, .. } = self.learning;
        let process = Vector3::from_fn(|k, _| log[k].exp() * self.least[k]);
        let noise = Noise { process, scatter: log[3].exp(), ..*noise };
        let fresh = self.learning.fresh(&noise);
        let (mut spread, mut square) = (0.0, 0.0);
        for (dough, own) in doughs.iter().zip(&self.learning.found) {
            let courses = courses(dough.len());
            let next = |i: usize, x: &Vector3<f64>| {
                let level: Vector3<f64> = own.courses.iter().zip(&courses).map(|(own, c)| own * c[i]).sum();
                x + (1.0 + own.softness) * surface.change(x, &dough[i].action) + level
            };
            let of = surprise(&follow(dough, &fresh, &noise, Beside::NOTHING, next));
            spread += of.spread;
            square += of.square;
        }
        // What was learned from these innovations has made them smaller.
        let rows = PER_ROLL as f64 * doughs.iter().map(Vec::len).sum::<usize>() as f64;
        Ok(spread + square * rows / (rows - self.learning.learned).max(1.0))
    }
}
