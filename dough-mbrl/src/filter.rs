//! A dough followed through its rolls: an extended Kalman filter (Särkkä 2013, doi:10.1017/CBO9781139344203) whose innovations
//! say by how much each measurement is off what all earlier ones lead to expect.

use nalgebra::{Matrix3, Vector3};

use crate::dynamics::{Roll, State};

/// What scatters the measured states, variances in m^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Of a measurement before a roll, and after it.
    pub measured: [Vector3<f64>; 2],
    /// Of what a roll does beyond its dynamics.
    pub process: Vector3<f64>,
    /// Of the part by which a roll does more or less than its dynamics say, all dimensions alike; of one, not of m^2.
    pub scatter: f64,
}

/// What is known of a fresh dough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fresh {
    /// Its mean state.
    pub mean: Vector3<f64>,
    /// How doughs differ.
    pub covariance: Matrix3<f64>,
}

impl Fresh {
    /// From the measured first states of several doughs, with the noise that is in them.
    ///
    /// The noise is not taken out: of a few doughs too little may be left, and a dough that begins elsewhere than is held possible stays off
    /// through all its rolls. What is too wide is narrowed by the first measurement. With fewer than four doughs nothing is held to be
    /// known: the spread is as wide as the state itself.
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
}

/// One measurement against what was expected of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Measured less expected.
    pub off: Vector3<f64>,
    /// Lower factor of its covariance.
    pub factor: Matrix3<f64>,
    /// What of it goes into the estimate.
    pub gain: Matrix3<f64>,
}

impl Innovation {
    /// What of it goes into an estimate whose errors go by `cross` with those of the expected measurement.
    fn share(&self, cross: &Matrix3<f64>) -> Matrix3<f64> {
        // A measurement that tells nothing of what it measures tells nothing of anything else.
        if self.gain == Matrix3::zeros() {
            return self.gain;
        }
        let mut share = cross.transpose();
        let solved = self.factor.solve_lower_triangular_mut(&mut share)
            && self.factor.tr_solve_lower_triangular_mut(&mut share);
        if solved { share.transpose() } else { Matrix3::zeros() }
    }

    /// Standardised: independent, of variance one.
    pub fn white(&self) -> Vector3<f64> {
        self.factor.solve_lower_triangular(&self.off).unwrap_or_default()
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
    /// What the roll is to change.
    pub change: Vector3<f64>,
    /// Derivative of the state after it with respect to the state before.
    pub gradient: Matrix3<f64>,
    /// Of the measurement after it.
    pub after: Innovation,
    /// What of that goes into the estimate of the state before.
    pub back: Matrix3<f64>,
    /// What of the state after it, and of the one before it, makes the state before the next roll.
    pub shares: [f64; 2],
}

/// What becomes of a dough beside its dynamics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beside {
    /// The part of each roll's strain that is undone before the next roll.
    pub undone: f64,
    /// What a roll leaves of each dimension; what it takes does not come back.
    pub left: f64,
}

impl Beside {
    /// A dough that keeps all its shape and volume.
    pub const NOTHING: Self = Self { undone: 0.0, left: 1.0 };
}

/// Covariances of the states before and after a roll, and between them.
struct Both {
    before: Matrix3<f64>,
    cross: Matrix3<f64>,
    after: Matrix3<f64>,
}

impl Both {
    /// Covariance of a state made of shares of the one after and the one before, once the one after was measured.
    fn between(&self, measured: &Innovation, back: &Matrix3<f64>, [kept, part]: [f64; 2]) -> Matrix3<f64> {
        let after = self.after - measured.gain * self.after;
        let before = self.before - back * self.cross.transpose();
        let cross = self.cross - back * self.after;
        let p = kept * kept * after + part * part * before + part * kept * (cross + cross.transpose());
        0.5 * (p + p.transpose())
    }
}

/// Follows a dough through its rolls.
///
/// `next(i, x)` is the state after roll `i` from the state `x`, without what a roll takes beside its dynamics.
pub fn follow(
    rolls: &[Roll],
    fresh: &Fresh,
    noise: &Noise,
    Beside { undone, left }: Beside,
    next: impl Fn(usize, &Vector3<f64>) -> Vector3<f64>,
) -> Vec<Step> {
    const STEP_M: f64 = 1e-6;
    let shares = [1.0 - undone, undone * left];
    let next = |i: usize, x: &Vector3<f64>| left * next(i, x);
    let (mut x, mut p) = (fresh.mean, fresh.covariance);
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
        let change = there - left * x;
        let scatter = change * change.transpose() * noise.scatter;
        // The states before and after it, estimated together.
        let mut both = Both { before: p, cross: p * gradient.transpose(), after: Matrix3::zeros() };
        both.after = gradient * both.cross + Matrix3::from_diagonal(&noise.process) + scatter;
        let after = innovation(&Vector3::from(roll.next), &there, &both.after, &noise.measured[1]);
        let back = after.share(&both.cross);
        steps.push(Step { before, state, covariance, change, gradient, after, back, shares });
        (x, p) = updated(&there, &both.after, &after);
        if undone != 0.0 {
            x = shares[0] * x + shares[1] * (state + back * after.off);
            p = both.between(&after, &back, shares);
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
            Innovation { off: measured - x, factor: factor.l(), gain: factor.solve(p).transpose() }
        }
        // A covariance that is no longer one: the measurement tells nothing.
        None => Innovation { off: measured - x, factor: Matrix3::identity(), gain: Matrix3::zeros() },
    }
}

fn updated(x: &Vector3<f64>, p: &Matrix3<f64>, innovation: &Innovation) -> (Vector3<f64>, Matrix3<f64>) {
    let p = p - innovation.gain * p;
    (x + innovation.gain * innovation.off, 0.5 * (p + p.transpose()))
}
