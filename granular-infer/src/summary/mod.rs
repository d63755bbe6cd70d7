//! The 16 summary statistics of one depth picture ([Matl 2021], section 3.4).
//!
//! `[max(z), mean(z), sd(z), max(r), mean(r), sd(x), sd(y), sd(r), IQR(x), IQR(y), IQR(r), KURT(r), dCor(r, z), df, b, A]` of the
//! points at which grains are seen: x, y along the ground from the points' centroid, `r = sqrt(x^2 + y^2)`, z above the ground.
//! Lengths are in m. Standard deviations divide by n; quantiles are interpolated linearly (numpy's default); the kurtosis is
//! the fourth central moment over the variance squared, less 3 (scipy's default: 0 for a Gaussian).

mod chi;
mod distance;

pub use chi::{Bound, ChiFit, fit_chi};
pub use distance::distance_correlation;

use crate::order::quantile;
use crate::seeing::HeightMap;

/// Number of statistics.
pub const COUNT: usize = 16;

/// Their names, in the order of [Matl 2021].
pub const NAMES: [&str; COUNT] = [
    "max_z_m",
    "mean_z_m",
    "sd_z_m",
    "max_r_m",
    "mean_r_m",
    "sd_x_m",
    "sd_y_m",
    "sd_r_m",
    "iqr_x_m",
    "iqr_y_m",
    "iqr_r_m",
    "kurtosis_r",
    "dcor_r_z",
    "chi_df",
    "chi_shift_m",
    "chi_scale_m",
];

/// Fewest points that statistics are taken of.
const LEAST: usize = 20;

/// Points of which there are no statistics.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SummaryError {
    /// Too few points show grains.
    #[error("{received} points show grains, expected at least {least}: is the mask right?")]
    TooFew {
        /// Points that came.
        received: usize,
        /// Fewest allowed.
        least: usize,
    },
    /// All points lie in one place, or on one circle about their centroid.
    #[error("all points are {radius_m} m from their centroid: this is no heap and no ring")]
    NoSpread {
        /// Their distance.
        radius_m: f64,
    },
    /// A coordinate is not a number.
    #[error("point {point} is not finite")]
    NotFinite {
        /// Its index.
        point: usize,
    },
    /// A mask has another number of pixels than the picture.
    #[error("a mask of {received} pixels for a picture of {expected}")]
    Mask {
        /// Pixels of the mask.
        received: usize,
        /// Pixels of the picture.
        expected: usize,
    },
    /// Blocks of no pixels.
    #[error("blocks of {received} pixels a side, expected 1 to the picture's {most}")]
    Block {
        /// What was asked for.
        received: usize,
        /// Shorter side of the picture.
        most: usize,
    },
}

/// Which pixels show grains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mask<'a> {
    /// Blocks whose mean height is above this many m, and above four sigma of its noise.
    Higher(f64),
    /// Blocks of which half of the pixels are marked: from a colour picture of grains on dark cloth.
    Marked(&'a [bool]),
}

/// Points at which grains are seen: x, y and height above the ground in m.
///
/// The picture is down-sampled by the mean over square blocks of `block` pixels a side; missing pixels do not count, and a block
/// that lacks half of its pixels gives no point.
///
/// # Errors
/// [`SummaryError::Mask`], [`SummaryError::Block`].
pub fn points(map: &HeightMap, block: usize, mask: Mask<'_>) -> Result<Vec<[f64; 3]>, SummaryError> {
    let [width, height] = map.size_px;
    if block == 0 || block > width.min(height) {
        return Err(SummaryError::Block { received: block, most: width.min(height) });
    }
    if let Mask::Marked(marked) = mask
        && marked.len() != map.heights_m.len()
    {
        return Err(SummaryError::Mask { received: marked.len(), expected: map.heights_m.len() });
    }
    let mut points = Vec::new();
    for top in (0..=height - block).step_by(block) {
        for left in (0..=width - block).step_by(block) {
            let (mut sum, mut seen, mut marks) = ([0.0; 3], 0_usize, 0_usize);
            for row in top..top + block {
                for i in row * width + left..row * width + left + block {
                    marks += usize::from(matches!(mask, Mask::Marked(m) if m[i]));
                    let z = map.heights_m[i];
                    if z.is_finite() {
                        let [x, y] = map.places_m[i];
                        sum = [sum[0] + x, sum[1] + y, sum[2] + z];
                        seen += 1;
                    }
                }
            }
            if 2 * seen < block * block || seen == 0 {
                continue;
            }
            let mean = sum.map(|s| s / seen as f64);
            let shows = match mask {
                Mask::Higher(least) => mean[2] > least.max(4.0 * map.noise_m / (seen as f64).sqrt()),
                Mask::Marked(_) => 2 * marks >= block * block,
            };
            if shows {
                points.push(mean);
            }
        }
    }
    Ok(points)
}

/// Statistics of points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// In the order of [`NAMES`].
    pub values: [f64; COUNT],
    /// The chi distribution's fit, of which the last three are part.
    pub chi: ChiFit,
}

/// The 16 statistics of the points of a picture (m).
///
/// # Errors
/// [`SummaryError::TooFew`] below 20 points, [`SummaryError::NotFinite`], [`SummaryError::NoSpread`].
pub fn summary(points: &[[f64; 3]]) -> Result<Summary, SummaryError> {
    let n = points.len();
    if n < LEAST {
        return Err(SummaryError::TooFew { received: n, least: LEAST });
    }
    if let Some(point) = points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        return Err(SummaryError::NotFinite { point });
    }
    let column = |axis: usize| -> Vec<f64> {
        let mean = points.iter().map(|p| p[axis]).sum::<f64>() / n as f64;
        points.iter().map(|p| p[axis] - mean).collect()
    };
    let (x, y) = (column(0), column(1));
    let z: Vec<f64> = points.iter().map(|p| p[2]).collect();
    let r: Vec<f64> = x.iter().zip(&y).map(|(x, y)| x.hypot(*y)).collect();
    let (mean_r, sd_r, kurtosis) = moments(&r);
    let (mean_z, sd_z, _) = moments(&z);
    let chi = fit_chi(&r)?;
    let max = |v: &[f64]| v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let dcor = distance_correlation(&r, &z);
    let values = [
        max(&z),
        mean_z,
        sd_z,
        max(&r),
        mean_r,
        moments(&x).1,
        moments(&y).1,
        sd_r,
        interquartile_range(&x),
        interquartile_range(&y),
        interquartile_range(&r),
        kurtosis,
        dcor,
        chi.degrees,
        chi.shift,
        chi.scale,
    ];
    Ok(Summary { values, chi })
}

/// Mean, standard deviation (over n) and excess kurtosis.
fn moments(values: &[f64]) -> (f64, f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let power = |k: i32| values.iter().map(|v| (v - mean).powi(k)).sum::<f64>() / n;
    let variance = power(2);
    (mean, variance.sqrt(), power(4) / (variance * variance) - 3.0)
}

/// Third less first quartile.
fn interquartile_range(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    quantile(&mut values, 0.75) - quantile(&mut values, 0.25)
}
