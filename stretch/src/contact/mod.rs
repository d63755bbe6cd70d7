//! What touches: a ball's radius, a face's plane, a flat face's diameters along both axes.

mod diameters;

pub use diameters::{Diameters, diameters};

use nalgebra::{Matrix4, SMatrix, SVector, Vector3, Vector4};
use statrs::statistics::{Data, OrderStatistics as _};

use crate::cloud::Cloud;
use crate::segment::State;

/// Why there is no geometry.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ContactError {
    /// Too few points touch.
    #[error("{got} points in contact; expected {expected} or more")]
    TooFew {
        /// Least number.
        expected: usize,
        /// Points in contact.
        got: usize,
    },
    /// A point that is no number.
    #[error("point {index} is no number")]
    NotFinite {
        /// Its index.
        index: usize,
    },
    /// The points do not bend enough to tell a radius.
    #[error("a radius of {radius_m:.3} +- {sigma_m:.3} m: the points are as good as flat")]
    Flat {
        /// Best radius.
        radius_m: f64,
        /// Its standard deviation.
        sigma_m: f64,
    },
    /// The face's edge is not seen in a direction: too shallow, or outside the window.
    #[error("no edge of the face along {axis}: {reason}")]
    NoEdge {
        /// `i` or `j`.
        axis: &'static str,
        /// Why.
        reason: &'static str,
    },
}

/// Tukey's biweight is 95 % efficient with this cut, in standard deviations.
const TUKEY: f64 = 4.685;

/// A ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Centre, in the points' frame, m.
    pub centre_m: [f64; 3],
    /// Radius, m.
    pub radius_m: f64,
    /// Standard deviation of the radius, m, from the points' scatter, neighbours taken for independent.
    pub radius_sigma_m: f64,
    /// Robust standard deviation of the points about it, m.
    pub scatter_m: f64,
}

/// Fits a ball: algebraic start, then Gauss-Newton on distances with Tukey's weights.
///
/// # Errors
/// [`ContactError::TooFew`], [`ContactError::NotFinite`], [`ContactError::Flat`] (the radius is known to less than a third).
pub fn ball(points: &[[f64; 3]]) -> Result<Ball, ContactError> {
    let all = finite(points, 8)?;
    let n = all.len() as f64;
    let middle = all.iter().sum::<Vector3<f64>>() / n;
    let scale = (all.iter().map(|p| (p - middle).norm_squared()).sum::<f64>() / n).sqrt().max(1e-12);
    let scaled: Vec<Vector3<f64>> = all.iter().map(|p| (p - middle) / scale).collect();
    let (mut gram, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for p in &scaled {
        let x = Vector4::new(2.0 * p[0], 2.0 * p[1], 2.0 * p[2], 1.0);
        gram += x * x.transpose();
        right += x * p.norm_squared();
    }
    let flat = ContactError::Flat { radius_m: f64::INFINITY, sigma_m: f64::INFINITY };
    let x = gram.lu().solve(&right).ok_or(flat)?;
    let mut centre = Vector3::new(x[0], x[1], x[2]);
    let mut radius = (x[3] + centre.norm_squared()).max(1e-12).sqrt();
    let mut result = (f64::INFINITY, f64::INFINITY);
    for _ in 0..30 {
        let rows: Vec<(f64, Vector4<f64>)> = scaled
            .iter()
            .map(|p| {
                let (d, size) = (p - centre, (p - centre).norm());
                let d = d / size.max(1e-12);
                (size - radius, Vector4::new(d[0], d[1], d[2], 1.0))
            })
            .collect();
        let Some(Robust { step, sigma, scatter }) = robust_step(&rows, &[0.0; 4], &[0.0; 4]) else {
            return Err(flat);
        };
        centre += step.fixed_rows::<3>(0);
        radius += step[3];
        result = (scatter, sigma[3]);
        if !(radius.is_finite() && radius.abs() < 1e6) {
            return Err(flat);
        }
        if step.norm() < 1e-10 * radius.abs().max(1.0) {
            break;
        }
    }
    let (radius_m, sigma_m) = (radius * scale, result.1 * scale);
    // A cap thirty times flatter than wide is within any camera's noise.
    if !(radius_m > 3.0 * sigma_m && radius < 30.0) {
        return Err(ContactError::Flat { radius_m, sigma_m });
    }
    let centre = centre * scale + middle;
    Ok(Ball { centre_m: centre.into(), radius_m, radius_sigma_m: sigma_m, scatter_m: result.0 * scale })
}

/// A step of Gauss-Newton, the standard deviations that it leaves, and the robust one of the residuals.
struct Robust<const N: usize> {
    step: SVector<f64, N>,
    sigma: SVector<f64, N>,
    scatter: f64,
}

/// One step of Gauss-Newton; argmin's has neither weights that follow the residuals' scatter nor a prior.
///
/// Takes residuals (measured less predicted) and the slopes of the predictions, with Tukey's weights; `known` is the precision
/// with which each parameter is known before, and `off` how far it is below that.
fn robust_step<const N: usize>(
    rows: &[(f64, SVector<f64, N>)],
    known: &[f64; N],
    off: &[f64; N],
) -> Option<Robust<N>> {
    let residuals: Vec<f64> = rows.iter().map(|r| r.0).collect();
    let scatter = spread(&residuals);
    let cut = TUKEY * scatter.max(1e-9);
    let (mut gram, mut right) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
    let (mut weight, mut square) = (0.0, 0.0);
    for (r, slope) in rows {
        let w = (1.0 - (r / cut).powi(2)).max(0.0).powi(2);
        gram += w * slope * slope.transpose();
        right += w * *r * slope;
        weight += w;
        square += w * r * r;
    }
    let variance = square / (weight - N as f64).max(1.0);
    for k in 0..N {
        gram[(k, k)] += known[k] * variance;
        right[k] += known[k] * variance * off[k];
    }
    let inverse = gram.try_inverse()?;
    let sigma = inverse.diagonal().map(|v| (v * variance).max(0.0).sqrt());
    Some(Robust { step: inverse * right, sigma, scatter })
}

/// A face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// A point on it, m: the points' mean.
    pub middle_m: [f64; 3],
    /// Unit normal, its third component not positive (towards a camera that looks along z).
    pub normal: [f64; 3],
    /// Robust standard deviation of the points about it, m.
    pub scatter_m: f64,
}

/// The plane nearest to points.
///
/// # Errors
/// [`ContactError::TooFew`], [`ContactError::NotFinite`].
pub fn face(points: &[[f64; 3]]) -> Result<Face, ContactError> {
    let all = finite(points, 4)?;
    let middle = all.iter().sum::<Vector3<f64>>() / all.len() as f64;
    let spread_of =
        all.iter().map(|p| (p - middle) * (p - middle).transpose()).sum::<nalgebra::Matrix3<f64>>();
    let eigen = spread_of.symmetric_eigen();
    let least = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let normal = if least[2] > 0.0 { -least } else { least };
    let off: Vec<f64> = all.iter().map(|p| (p - middle).dot(&normal)).collect();
    Ok(Face { middle_m: middle.into(), normal: normal.into(), scatter_m: spread(&off) })
}

fn finite(points: &[[f64; 3]], expected: usize) -> Result<Vec<Vector3<f64>>, ContactError> {
    if points.len() < expected {
        return Err(ContactError::TooFew { expected, got: points.len() });
    }
    if let Some(index) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        return Err(ContactError::NotFinite { index });
    }
    Ok(points.iter().map(|p| Vector3::from(*p)).collect())
}

/// Robust standard deviation of residuals, from the median of their absolute values; NaN of nothing.
fn spread(off: &[f64]) -> f64 {
    let off: Vec<f64> = off.iter().map(|x| x.abs()).collect();
    1.4826 * Data::new(off).median()
}

/// Points of a cloud that touch, m, in the camera's frame; not averaged, which would round off what they show.
pub fn points(cloud: &Cloud, states: &[State]) -> Vec<[f64; 3]> {
    let touching = states.iter().enumerate().filter(|(_, s)| **s == State::Contact);
    touching.filter_map(|(i, _)| cloud.raw_point(i)).collect()
}

/// The ball that touches, fitted with the flank beside it.
///
/// A contact's edge is blurred by the smoothing that found it, and the flank that is let in flattens a small ball. So the edge is
/// fitted too: within a distance a of the axis, heights are the ball's; beyond it the free membrane goes on with the ball's slope
/// and falls like the logarithm of the distance, `h(rho) = h(a) + a h'(a) ln(rho / a)`.
///
/// # Errors
/// [`ContactError`]; [`ContactError::Flat`] where so little of the ball shows that its edge, and with it the radius, stays open.
pub fn cap(cloud: &Cloud, states: &[State]) -> Result<Ball, ContactError> {
    let touching = points(cloud, states);
    let whole = ball(&touching)?;
    let axis = [whole.centre_m[0], whole.centre_m[1]];
    let from_axis = |p: &[f64; 3]| (p[0] - axis[0]).hypot(p[1] - axis[1]);
    let mut distances: Vec<f64> = touching.iter().map(from_axis).collect();
    let outer = distances.len() * 9 / 10;
    let rough = *distances.select_nth_unstable_by(outer, f64::total_cmp).1;
    let all = (0..states.len()).filter_map(|i| cloud.raw_point(i));
    let near: Vec<[f64; 3]> = all.filter(|p| from_axis(p) < FLANK * rough).collect();
    match Cap::start(&whole, rough).fit(&near, rough) {
        Some(found) if found.radius_m > 3.0 * found.radius_sigma_m => Ok(found),
        Some(open) => Err(ContactError::Flat { radius_m: open.radius_m, sigma_m: open.radius_sigma_m }),
        // Far around the ball the points in contact are enough.
        None if rough > WRAPPED * whole.radius_m => Ok(whole),
        None => Err(ContactError::Flat { radius_m: whole.radius_m, sigma_m: f64::INFINITY }),
    }
}

/// Contact's radius over the ball's from which on the edge need not be told from the flank.
const WRAPPED: f64 = 0.7;
/// How far the flank is looked at, of the contact's rough radius: near the edge a membrane of any tensions and frame is alike.
const FLANK: f64 = 1.2;

/// A ball in a membrane: axis, the top's distance from the lens, radius, edge; m.
#[derive(Debug, Clone, Copy)]
struct Cap(SVector<f64, 7>);

impl Cap {
    fn start(ball: &Ball, rough: f64) -> Self {
        let [x, y, z] = ball.centre_m;
        let edge = (0.7 * rough).min(0.7 * ball.radius_m);
        Self([x, y, z - ball.radius_m, ball.radius_m, edge, 0.0, 0.0].into())
    }

    /// Distance of the membrane from the lens at a place, and its derivatives.
    fn distance(&self, x: f64, y: f64) -> (f64, SVector<f64, 7>) {
        let [x0, y0, top, radius, edge, even, odd] = self.0.into();
        let (dx, dy) = (x - x0, y - y0);
        let rho = dx.hypot(dy).max(1e-9);
        let held = rho.min(edge);
        let w = (radius * radius - held * held).sqrt();
        let beyond = (rho / held).ln();
        let (bend, turn) = (edge * edge / w, (dx * dx - dy * dy) / (rho * rho));
        let curve = even + odd * turn;
        let fall = beyond + curve * beyond * beyond;
        let z = top + radius - w + bend * fall;
        let by_rho = (held * held / w) * (1.0 + 2.0 * curve * beyond) / rho;
        let cubed = edge * edge / (w * w * w);
        let by_radius = 1.0 - radius / w - cubed * radius * fall;
        let by_edge = if rho > edge {
            edge / w + (2.0 + edge * edge / (w * w)) * edge / w * fall
                - bend * (1.0 + 2.0 * curve * beyond) / edge
        } else {
            0.0
        };
        let flank = bend * beyond * beyond;
        let slopes = [-by_rho * dx / rho, -by_rho * dy / rho, 1.0, by_radius, by_edge, flank, flank * turn];
        (z, slopes.into())
    }

    /// Precision and mean of what is known before: the edge lies about where the contact seems to end, and a flank of any tensions
    /// bends little. A cap that is too small to tell its edge then says so in the radius's standard deviation.
    fn prior(rough: f64) -> [(f64, f64); 7] {
        let free = (0.0, 0.0);
        let edge = ((0.3 * rough).powi(-2), 0.7 * rough);
        [free, free, free, free, edge, (1.0, 0.0), (1.0, 0.0)]
    }

    /// Gauss-Newton with Tukey's weights; none where it does not settle within the contact.
    fn fit(mut self, near: &[[f64; 3]], rough: f64) -> Option<Ball> {
        let prior = Self::prior(rough);
        for round in 0..60 {
            let rows: Vec<(f64, SVector<f64, 7>)> = near
                .iter()
                .map(|p| {
                    let (z, slope) = self.distance(p[0], p[1]);
                    (p[2] - z, slope)
                })
                .collect();
            let known = prior.map(|(precision, _)| precision);
            let off = std::array::from_fn(|k| prior[k].1 - self.0[k]);
            let Robust { step, sigma, scatter } = robust_step(&rows, &known, &off)?;
            // Radius and edge by a quarter at most, so that the edge stays inside the ball; later by half a step, since weights may swing.
            let half = if round < 20 { 1.0 } else { 0.5 };
            let part = [3, 4].iter().map(|k| 0.25 * self.0[*k] / step[*k].abs()).fold(half, f64::min);
            self.0 += part * step;
            let [x, y, top, radius_m, edge, ..] = <[f64; 7]>::from(self.0);
            if !(radius_m.is_finite() && radius_m > 0.0 && edge > 0.05 * radius_m && edge < 0.97 * radius_m) {
                return None;
            }
            if (0..5).all(|k| step[k].abs() < 1e-3 * sigma[k]) {
                let (radius_sigma_m, scatter_m) = (sigma[3], scatter);
                return Some(Ball { centre_m: [x, y, top + radius_m], radius_m, radius_sigma_m, scatter_m });
            }
        }
        None
    }
}
