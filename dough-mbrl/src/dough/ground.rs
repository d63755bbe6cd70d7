//! The ground: the level plane on which most points lie.

use nalgebra::{Matrix3, Vector3};
use statrs::statistics::{Data, OrderStatistics as _};

use super::error::DoughError;

/// A plane z = a + b x + c y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    coefficients: Vector3<f64>,
    /// Middle of the points, from which x and y count.
    middle: [f64; 2],
    /// Robust sigma of its points about it, m.
    pub scatter_m: f64,
}

/// Points whose level is looked at first, at most.
const SAMPLE: usize = 4000;
/// Share of the points that have to lie on the plane.
const LEAST_SHARE: f64 = 0.15;
/// A plane is sought with points this close to it at first, m; a table that is tilted stays within it after a few rounds.
const FIRST_BAND_M: f64 = 0.01;
const ROUNDS: usize = 6;

impl Plane {
    /// Level at a place, m.
    pub fn level(&self, [x, y]: [f64; 2]) -> f64 {
        let k = &self.coefficients;
        k[0] + k[1] * (x - self.middle[0]) + k[2] * (y - self.middle[1])
    }

    /// By how much a point stands above it, along z, m.
    pub fn above(&self, p: &[f64; 3]) -> f64 {
        p[2] - self.level([p[0], p[1]])
    }
}

/// Finds the ground in a cloud: the densest level, then a plane by least squares on ever fewer, closer points.
pub(super) fn find(cloud: &[[f64; 3]]) -> Result<Plane, DoughError> {
    let finite = || cloud.iter().filter(|p| p.iter().all(|v| v.is_finite()));
    let count = finite().count();
    if count == 0 {
        return Err(DoughError::Empty { points: cloud.len() });
    }
    let sample: Vec<[f64; 3]> = finite().step_by(count.div_ceil(SAMPLE)).copied().collect();
    let n = sample.len();
    let sum = |k: usize| sample.iter().map(|p| p[k]).sum::<f64>() / n as f64;
    let middle = [sum(0), sum(1)];
    let mut levels: Vec<f64> = sample.iter().map(|p| p[2]).collect();
    levels.sort_unstable_by(f64::total_cmp);
    // The window of levels that holds most points.
    let (mut first, mut most, mut level) = (0, 0, levels[0]);
    for last in 0..n {
        while levels[last] - levels[first] > FIRST_BAND_M {
            first += 1;
        }
        if last - first >= most {
            (most, level) = (last - first, levels[(first + last) / 2]);
        }
    }
    let mut plane = Plane { coefficients: Vector3::new(level, 0.0, 0.0), middle, scatter_m: 0.0 };
    let mut band = FIRST_BAND_M;
    let mut off: Vec<f64> = Vec::with_capacity(n);
    for _ in 0..ROUNDS {
        let (mut a, mut b) = (Matrix3::zeros(), Vector3::zeros());
        for p in sample.iter().filter(|p| plane.above(p).abs() <= band) {
            let row = Vector3::new(1.0, p[0] - middle[0], p[1] - middle[1]);
            a += row * row.transpose();
            b += row * p[2];
        }
        if let Some(found) = a.cholesky().map(|c| c.solve(&b)).filter(|k| k.iter().all(|v| v.is_finite())) {
            plane.coefficients = found;
        }
        off.clear();
        off.extend(sample.iter().map(|p| plane.above(p).abs()).filter(|v| *v <= band));
        plane.scatter_m = 1.4826 * Data::new(&mut off[..]).median();
        band = (4.0 * plane.scatter_m).clamp(5e-4, FIRST_BAND_M);
    }
    let share = off.len() as f64 / n as f64;
    let steep = plane.coefficients[1].hypot(plane.coefficients[2]) > 0.2;
    if !(share >= LEAST_SHARE) || steep {
        return Err(DoughError::NoGround { share: if steep { 0.0 } else { share }, least: LEAST_SHARE });
    }
    Ok(plane)
}
