//! A dough followed through its rolls: an extended Kalman filter (Särkkä 2013, doi:10.1017/CBO9781139344203) whose innovations
//! are each measurement less what all earlier ones predict of it.

use nalgebra::{Matrix3, Vector3};

use crate::roll::{Roll, State};

/// Noise of the measured states: variances, m^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Of a measurement before a roll, and after it.
    pub measured: [Vector3<f64>; 2],
    /// Of what a roll does beyond its dynamics.
    pub process: Vector3<f64>,
    /// Of the part by which a roll does more or less than its dynamics say, all dimensions alike; of one, not of m^2.
    pub scatter: f64,
}

/// The state of a dough before its first measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InitialState {
    /// The mean, m.
    pub mean: Vector3<f64>,
    /// The covariance from dough to dough, m^2.
    pub covariance: Matrix3<f64>,
}

impl InitialState {
    /// From the measured first states of several doughs, with the noise that is in them.
    ///
    /// The noise is not taken out: of a few doughs too little variance may be left, and a dough that begins outside of it stays off
    /// through all its rolls. A covariance that is too wide is narrowed by the first measurement. With fewer than four doughs the
    /// spread is as wide as the state itself.
    pub fn of(first: &[State], noise: &Noise) -> Self {
        let n = first.len().max(1) as f64;
        let mean = first.iter().map(|s| Vector3::from(*s)).sum::<Vector3<f64>>() / n;
        if first.len() < 4 {
            return Self { mean, covariance: Matrix3::identity() * mean.norm_squared() };
        }
        let scatter = |s: &State| {
            let d = Vector3::from(*s) - mean;
            d * d.transpose()
        };
        let spread = first.iter().map(scatter).sum::<Matrix3<f64>>() / (n - 1.0);
        // The mean itself is known from so many doughs; readings that are all alike still have noise.
        let covariance = spread * (1.0 + 1.0 / n) + Matrix3::from_diagonal(&noise.measured[0]);
        Self { mean, covariance }
    }

    /// From the first states of doughs that are followed.
    pub(crate) fn of_doughs(doughs: &[Vec<Roll>], noise: &Noise) -> Self {
        let first: Vec<_> = doughs.iter().filter_map(|d| Some(d.first()?.state)).collect();
        Self::of(&first, noise)
    }
}

/// One measurement against its prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Measured less predicted, m.
    pub residual: Vector3<f64>,
    /// Lower factor of its covariance.
    pub factor: Matrix3<f64>,
    /// The Kalman gain: the part of the residual that goes into the estimate.
    pub gain: Matrix3<f64>,
}

impl Innovation {
    /// The gain of another estimate, whose errors have the covariance `cross` with those of the predicted measurement.
    fn gain_of(&self, cross: &Matrix3<f64>) -> Matrix3<f64> {
        // A measurement without a gain in its own state has none in any other.
        if self.gain == Matrix3::zeros() {
            return self.gain;
        }
        let mut gain = cross.transpose();
        let solved = self.factor.solve_lower_triangular_mut(&mut gain)
            && self.factor.tr_solve_lower_triangular_mut(&mut gain);
        if solved { gain.transpose() } else { Matrix3::zeros() }
    }

    /// The residual, whitened: independent components of variance one.
    pub fn whitened(&self) -> Vector3<f64> {
        self.factor.solve_lower_triangular(&self.residual).unwrap_or_default()
    }
}

/// A roll with the estimate before it and the two innovations around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Of the measurement before it.
    pub before: Innovation,
    /// Estimate before it, that measurement included, and its covariance.
    pub state: Vector3<f64>,
    /// See `state`.
    pub covariance: Matrix3<f64>,
    /// The predicted change by the roll, m.
    pub change: Vector3<f64>,
    /// Derivative of the state after it with respect to the state before.
    pub gradient: Matrix3<f64>,
    /// Of the measurement after it.
    pub after: Innovation,
    /// The gain of that measurement in the estimate of the state before (one step of a smoother).
    pub smoother_gain: Matrix3<f64>,
    /// Weights of the state after the roll, and of the one before it, in the state before the next roll.
    pub weights: [f64; 2],
}

/// What happens to a dough beside its dynamics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relaxation {
    /// The part of each roll's strain that springs back before the next roll.
    pub springback: f64,
    /// The factor on each dimension by the dough that a roll takes away, which does not come back; 1: nothing is lost.
    pub loss_factor: f64,
}

impl Relaxation {
    /// A dough that keeps all its shape and volume.
    pub const NONE: Self = Self { springback: 0.0, loss_factor: 1.0 };
}

/// Covariances of the states before and after a roll, and between them.
struct Both {
    before: Matrix3<f64>,
    cross: Matrix3<f64>,
    after: Matrix3<f64>,
}

impl Both {
    /// Covariance of the weighted sum of the state after and the one before, once the one after was measured.
    fn weighted(
        &self,
        measured: &Innovation,
        smoother_gain: &Matrix3<f64>,
        [a, b]: [f64; 2],
    ) -> Matrix3<f64> {
        let after = self.after - measured.gain * self.after;
        let before = self.before - smoother_gain * self.cross.transpose();
        let cross = self.cross - smoother_gain * self.after;
        let p = a * a * after + b * b * before + b * a * (cross + cross.transpose());
        0.5 * (p + p.transpose())
    }
}

/// Follows a dough through its rolls.
///
/// `next(i, x)` is the state after roll `i` from the state `x`, before the loss.
pub fn follow(
    rolls: &[Roll],
    initial: &InitialState,
    noise: &Noise,
    Relaxation { springback, loss_factor }: Relaxation,
    next: impl Fn(usize, &Vector3<f64>) -> Vector3<f64>,
) -> Vec<Step> {
    const STEP_M: f64 = 1e-6;
    let weights = [1.0 - springback, springback * loss_factor];
    let next = |i: usize, x: &Vector3<f64>| loss_factor * next(i, x);
    let (mut x, mut p) = (initial.mean, initial.covariance);
    let mut steps = Vec::with_capacity(rolls.len());
    for (i, roll) in rolls.iter().enumerate() {
        let before = innovation(&Vector3::from(roll.state), &x, &p, &noise.measured[0]);
        (x, p) = updated(&x, &p, &before);
        let (state, covariance) = (x, p);
        let there = next(i, &x);
        let mut gradient = Matrix3::zeros();
        for k in 0..3 {
            let mut moved = x;
            moved[k] += STEP_M;
            gradient.set_column(k, &((next(i, &moved) - there) / STEP_M));
        }
        let change = there - loss_factor * x;
        let scatter = change * change.transpose() * noise.scatter;
        // The states before and after it, estimated together.
        let mut both = Both { before: p, cross: p * gradient.transpose(), after: Matrix3::zeros() };
        both.after = gradient * both.cross + Matrix3::from_diagonal(&noise.process) + scatter;
        let after = innovation(&Vector3::from(roll.next), &there, &both.after, &noise.measured[1]);
        let smoother_gain = after.gain_of(&both.cross);
        steps.push(Step { before, state, covariance, change, gradient, after, smoother_gain, weights });
        (x, p) = updated(&there, &both.after, &after);
        if springback != 0.0 {
            x = weights[0] * x + weights[1] * (state + smoother_gain * after.residual);
            p = both.weighted(&after, &smoother_gain, weights);
        }
    }
    steps
}

fn innovation(
    measured: &Vector3<f64>,
    x: &Vector3<f64>,
    p: &Matrix3<f64>,
    noise: &Vector3<f64>,
) -> Innovation {
    let covariance = p + Matrix3::from_diagonal(noise);
    match covariance.cholesky() {
        Some(factor) => {
            Innovation { residual: measured - x, factor: factor.l(), gain: factor.solve(p).transpose() }
        }
        // A covariance that is not positive definite: the measurement has no gain.
        None => Innovation { residual: measured - x, factor: Matrix3::identity(), gain: Matrix3::zeros() },
    }
}

fn updated(x: &Vector3<f64>, p: &Matrix3<f64>, innovation: &Innovation) -> (Vector3<f64>, Matrix3<f64>) {
    let p = p - innovation.gain * p;
    (x + innovation.gain * innovation.residual, 0.5 * (p + p.transpose()))
}
