//! Diameters of a flat round face.

use nalgebra::{DMatrix, DVector};
use statrs::statistics::{Data, OrderStatistics as _};

use super::{ContactError, spread};
use crate::cloud::Cloud;
use crate::measured::MeasuredLength;
use crate::segment::State;

/// Diameters of a flat round face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Diameters {
    /// Along i, from row to row.
    pub i: MeasuredLength,
    /// Along j, along the stretch.
    pub j: MeasuredLength,
    /// Height of the face over the plane at rest, m.
    pub height_m: f64,
}

/// Half the width of the strip along an axis through the middle that a profile is averaged over, of the rough radius.
const STRIP: f64 = 0.35;
/// Part of the rough radius that is surely inside.
const INSIDE: f64 = 0.6;

/// Diameters of a flat face that is pressed into the membrane (figure 6.4).
///
/// The edge is where the free membrane's profile meets the face's height. Smoothed points round it off by the width of the smoothing; so
/// the profile outside is fitted on raw heights, over the first part of the flank, and met with the face's. Around a round contact a
/// membrane falls like the logarithm of the distance: the profile is a parabola in that.
///
/// # Errors
/// [`ContactError`].
pub fn diameters(cloud: &Cloud, states: &[State]) -> Result<Diameters, ContactError> {
    let columns = cloud.columns().max(1);
    let touching: Vec<usize> = (0..states.len()).filter(|&i| states[i] == State::Contact).collect();
    if touching.len() < 30 {
        return Err(ContactError::TooFew { expected: 30, got: touching.len() });
    }
    let n = touching.len() as f64;
    let middle = [
        touching.iter().map(|i| (i % columns) as f64).sum::<f64>() / n,
        touching.iter().map(|i| (i / columns) as f64).sum::<f64>() / n,
    ];
    let rough = (n / std::f64::consts::PI).sqrt();
    let mut core: Vec<f64> = touching
        .iter()
        .filter(|i| {
            ((*i % columns) as f64 - middle[0]).hypot((*i / columns) as f64 - middle[1]) < INSIDE * rough
        })
        .map(|&i| f64::from(cloud.heights[i]))
        .filter(|h| h.is_finite())
        .collect();
    if core.len() < 10 {
        return Err(ContactError::TooFew { expected: 10, got: core.len() });
    }
    let height_m = Data::new(&mut core[..]).median();
    let off: Vec<f64> = core.iter().map(|h| h - height_m).collect();
    let noise = spread(&off).max(1e-6);
    // Metres a pixel on the face.
    let near = touching[touching.len() / 2];
    let pitch = |by: usize, axis: usize| {
        let other = if near + by < cloud.points.len() { near + by } else { near - by };
        f64::from(cloud.points[other][axis] - cloud.points[near][axis]).abs()
    };
    let pitches = [pitch(columns, 1), pitch(1, 0)];
    let face = Edge { cloud, middle, rough, height_m, noise };
    let along = |axis: &'static str, rows: bool, pitch: f64| -> Result<MeasuredLength, ContactError> {
        let (a, b) = (face.find(axis, rows, 1.0)?, face.find(axis, rows, -1.0)?);
        Ok(MeasuredLength { value_m: (a.0 + b.0) * pitch, sigma_m: a.1.hypot(b.1) * pitch })
    };
    Ok(Diameters { i: along("i", true, pitches[0])?, j: along("j", false, pitches[1])?, height_m })
}

struct Edge<'a> {
    cloud: &'a Cloud,
    middle: [f64; 2],
    rough: f64,
    height_m: f64,
    noise: f64,
}

impl Edge<'_> {
    /// Distance of the edge from the middle in pixels, and its standard deviation.
    fn find(&self, axis: &'static str, rows: bool, sign: f64) -> Result<(f64, f64), ContactError> {
        let profile = self.profile(rows, sign);
        let mut edge = self.rough;
        let mut found = (f64::NAN, f64::INFINITY);
        for _ in 0..25 {
            // The first pixels outside hold the uncertainty of the edge.
            let flank: Vec<(f64, f64, f64)> = profile
                .iter()
                .copied()
                .filter(|p| p.0 > edge + 1.5 && p.0 < edge + 1.5 + (2.0 * self.rough).clamp(30.0, 70.0))
                .collect();
            if flank.len() < 8 {
                return Err(ContactError::NoEdge {
                    axis,
                    reason: "too little of the flank is in the window",
                });
            }
            found = self
                .meet(&flank, edge)
                .ok_or(ContactError::NoEdge { axis, reason: "the flank does not fall" })?;
            let next = 0.5 * (edge + found.0);
            if (next - edge).abs() < 1e-3 {
                break;
            }
            edge = next.clamp(0.3 * self.rough, 2.0 * self.rough);
        }
        if !(found.1 < 0.5 * self.rough) {
            return Err(ContactError::NoEdge { axis, reason: "the flank is lost in the noise" });
        }
        Ok(found)
    }

    /// Distance, mean height and number of pixels across a strip.
    fn profile(&self, rows: bool, sign: f64) -> Vec<(f64, f64, f64)> {
        let columns = self.cloud.columns().max(1);
        let height = self.cloud.heights.len() / columns;
        let [u, v] = self.middle;
        let (start, across, end, side) = if rows { (v, u, height, columns) } else { (u, v, columns, height) };
        let half = (STRIP * self.rough).max(2.0);
        let (low, high) = ((across - half).max(0.0) as usize, ((across + half) as usize + 1).min(side));
        let mut profile = Vec::new();
        for k in 0..end {
            let out = sign * (k as f64 - start);
            if out < 0.0 {
                continue;
            }
            let (mut sum, mut n) = (0.0, 0.0);
            for s in low..high {
                let i = if rows { k * columns + s } else { s * columns + k };
                let h = f64::from(self.cloud.heights[i]);
                if h.is_finite() {
                    (sum, n) = (sum + h, n + 1.0);
                }
            }
            if n > 0.0 {
                // The strip crosses a circle: its mean chord is shorter than the diameter by about half^2/6 of the radius.
                profile.push((out + half * half / (6.0 * self.rough), sum / n, n));
            }
        }
        profile.sort_by(|a, b| a.0.total_cmp(&b.0));
        profile
    }

    /// Where a parabola in the logarithm of the distance reaches the face's height, nearest to where the edge was thought.
    fn meet(&self, flank: &[(f64, f64, f64)], edge: f64) -> Option<(f64, f64)> {
        let rows = DMatrix::from_fn(flank.len(), 3, |r, c| {
            (flank[r].0 / edge).ln().powi(c as i32) * flank[r].2.sqrt()
        });
        let values = DVector::from_fn(flank.len(), |r, _| (flank[r].1 - self.height_m) * flank[r].2.sqrt());
        let gram = (rows.transpose() * &rows).try_inverse()?;
        let x = &gram * rows.transpose() * values;
        let (c, b, a) = (x[0], x[1], x[2]);
        // c + b s + a s^2 = 0 with b < 0: the root near zero, in the form that does not cancel.
        if !(b < 0.0) {
            return None;
        }
        let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
        let s = 2.0 * c / (-b + root);
        let slope = (b + 2.0 * a * s).abs().max(1e-12);
        let row = DVector::from_column_slice(&[1.0, s, s * s]);
        let sigma = self.noise * (&gram * &row).dot(&row).max(0.0).sqrt() / slope;
        let found = edge * s.exp();
        found.is_finite().then_some((found, sigma * found))
    }
}
