//! Where the markers are, to a fraction of a pixel.
//!
//! A region of the thresholded picture says which pixels belong to a marker; its centre is the mean of the raw picture's
//! brightness above the dark class over those pixels and their border. The threshold alone would round each edge to whole
//! pixels. A region much larger than the others and longer than wide is several markers that touch: it is taken apart into as
//! many as its area makes, and they are flagged.

use hw_traits::picture::Picture;
use nalgebra::{Matrix2, SymmetricEigen};
use statrs::statistics::{Data, OrderStatistics as _};

use crate::image::{ImageError, ImageSettings, Regions, regions};

/// Why there are no markers.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MarkerError {
    /// The picture cannot be taken apart.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// No region has a marker's size.
    #[error("{regions} bright regions, none of {least} to {most} pixels")]
    NoMarkers {
        /// Regions found.
        regions: usize,
        /// Smallest area in pixels.
        least: usize,
        /// Largest area in pixels.
        most: usize,
    },
}

/// What counts as a marker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarkerSettings {
    /// How the picture is taken apart.
    pub image: ImageSettings,
    /// Smallest area of a region, pixels.
    pub least_area_px: usize,
    /// Largest area of a region, pixels.
    pub most_area_px: usize,
    /// A region whose area is above this many typical ones (the median) is looked at as several markers.
    pub merged: f64,
}

impl Default for MarkerSettings {
    fn default() -> Self {
        Self { image: ImageSettings::default(), least_area_px: 12, most_area_px: 4000, merged: 1.6 }
    }
}

/// A marker in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marker {
    /// Column and row of its centre, in pixels; pixel centres are whole numbers.
    pub at_px: [f64; 2],
    /// Area of its region, in pixels (its part, where it was merged).
    pub area_px: f64,
    /// Whether it shares its region with others: its centre is then rough.
    pub merged: bool,
}

/// The markers of a picture, in the order of their first pixels.
///
/// # Errors
/// [`MarkerError`].
pub fn find(picture: &Picture<u8>, settings: &MarkerSettings) -> Result<Vec<Marker>, MarkerError> {
    let regions = regions(picture, &settings.image)?;
    let members = members(&regions);
    let (least, most) = (settings.least_area_px, settings.most_area_px);
    let sized: Vec<&Vec<usize>> = members.iter().filter(|m| (least..=most).contains(&m.len())).collect();
    if sized.is_empty() {
        return Err(MarkerError::NoMarkers { regions: regions.count, least, most });
    }
    let areas: Vec<f64> = sized.iter().map(|m| m.len() as f64).collect();
    let typical = Data::new(areas).median();
    let mut found = Vec::with_capacity(sized.len());
    for pixels in sized {
        let parts = parts(pixels, regions.width, typical, settings.merged);
        if parts > 1 {
            found.extend(take_apart(pixels, regions.width, parts));
        } else {
            let at_px = centroid(picture, &regions, pixels);
            found.push(Marker { at_px, area_px: pixels.len() as f64, merged: false });
        }
    }
    Ok(found)
}

/// Pixel indices of each region.
fn members(regions: &Regions) -> Vec<Vec<usize>> {
    let mut members = vec![Vec::new(); regions.count];
    for (i, &label) in regions.labels.iter().enumerate() {
        if let Some(list) = (label as usize).checked_sub(1).and_then(|k| members.get_mut(k)) {
            list.push(i);
        }
    }
    members
}

/// Mean of the brightness above the dark class, over a region and the dark pixels next to it.
fn centroid(picture: &Picture<u8>, regions: &Regions, pixels: &[usize]) -> [f64; 2] {
    let (width, height) = (regions.width, regions.labels.len() / regions.width);
    let label = regions.labels[pixels[0]];
    let columns = || pixels.iter().map(|i| i % width);
    let (left, right) = (columns().min().unwrap_or(0), columns().max().unwrap_or(0));
    let (top, bottom) = (pixels[0] / width, pixels[pixels.len() - 1] / width);
    let (mut sum, mut u, mut v) = (0.0, 0.0, 0.0);
    for row in top.saturating_sub(2)..(bottom + 3).min(height) {
        for column in left.saturating_sub(2)..(right + 3).min(width) {
            let i = row * width + column;
            if regions.labels[i] != label && regions.labels[i] != 0 {
                continue;
            }
            let w = (f64::from(picture.data()[i]) - regions.dark).max(0.0);
            sum += w;
            u += w * column as f64;
            v += w * row as f64;
        }
    }
    // A region's pixels are brighter than the threshold, hence than the dark class's mean.
    [u / sum, v / sum]
}

/// Mean and covariance of a region's pixels.
fn moments(pixels: &[usize], width: usize) -> ([f64; 2], Matrix2<f64>) {
    let n = pixels.len() as f64;
    let at = |i: &usize| [(i % width) as f64, (i / width) as f64];
    let mut mean = [0.0; 2];
    for p in pixels.iter().map(at) {
        mean = [mean[0] + p[0] / n, mean[1] + p[1] / n];
    }
    let mut spread = Matrix2::zeros();
    for p in pixels.iter().map(at) {
        let d = nalgebra::Vector2::new(p[0] - mean[0], p[1] - mean[1]);
        spread += d * d.transpose() / n;
    }
    (mean, spread)
}

/// How many markers a region is: one, unless it is large for one and long, or very large.
fn parts(pixels: &[usize], width: usize, typical: f64, merged: f64) -> usize {
    let ratio = pixels.len() as f64 / typical;
    if !(ratio > merged) {
        return 1;
    }
    let axes = SymmetricEigen::new(moments(pixels, width).1).eigenvalues;
    let (long, short) = (axes.max(), axes.min().max(1e-9));
    if long / short > 1.8 || ratio > 2.5 { (ratio.round() as usize).clamp(2, 16) } else { 1 }
}

/// k-means from starts along the region's long axis.
fn take_apart(pixels: &[usize], width: usize, parts: usize) -> Vec<Marker> {
    let (mean, spread) = moments(pixels, width);
    let eigen = SymmetricEigen::new(spread);
    let axis = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let half = 3f64.sqrt() * eigen.eigenvalues.max().sqrt();
    let mut centres: Vec<[f64; 2]> = (0..parts)
        .map(|k| half * ((2 * k + 1) as f64 / parts as f64 - 1.0))
        .map(|s| [mean[0] + s * axis[0], mean[1] + s * axis[1]])
        .collect();
    let mut areas = vec![0.0; parts];
    for _ in 0..20 {
        let mut sums = vec![[0.0; 3]; parts];
        for i in pixels {
            let p = [(i % width) as f64, (i / width) as f64];
            let to = |c: &[f64; 2]| (c[0] - p[0]).powi(2) + (c[1] - p[1]).powi(2);
            let nearest =
                (0..parts).min_by(|&a, &b| to(&centres[a]).total_cmp(&to(&centres[b]))).unwrap_or(0);
            let s = &mut sums[nearest];
            *s = [s[0] + p[0], s[1] + p[1], s[2] + 1.0];
        }
        for ((c, s), area) in centres.iter_mut().zip(&sums).zip(&mut areas) {
            if s[2] > 0.0 {
                *c = [s[0] / s[2], s[1] / s[2]];
            }
            *area = s[2];
        }
    }
    centres.into_iter().zip(areas).map(|(at_px, area_px)| Marker { at_px, area_px, merged: true }).collect()
}
