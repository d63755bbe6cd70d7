//! From a grey picture to regions: blur, Otsu's threshold, opening, connected components (section 5.2).
//!
//! All four are imageproc's; this module adds what an answer needs to be trusted: is there anything bright at all?

use ::image::{GrayImage, Luma};
use hw_traits::picture::Picture;
use imageproc::contrast::{ThresholdType, otsu_level, threshold_mut};
use imageproc::distance_transform::Norm;
use imageproc::filter::gaussian_blur_f32;
use imageproc::morphology::open_mut;
use imageproc::region_labelling::{Connectivity, connected_components};

/// Why a picture has no regions.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ImageError {
    /// A picture that is too small or too large to be worked on.
    #[error("a picture of {width} x {height} pixels; expected 16 to 16384 either way")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// Bright and dark are too close: dark, saturated, out of focus, or the light is off.
    #[error("bright and dark parts differ by {got:.1} grey levels; expected {expected} or more")]
    NoContrast {
        /// Least difference of the means of the two classes.
        expected: f64,
        /// The difference.
        got: f64,
    },
    /// A setting out of range.
    #[error("{what} is {got}; expected {expected}")]
    Setting {
        /// Which.
        what: &'static str,
        /// What it has to be.
        expected: &'static str,
        /// What it is.
        got: f64,
    },
}

/// How a picture is taken apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImageSettings {
    /// Standard deviation of the blur in pixels, above 0 and up to 10.
    pub blur_px: f64,
    /// Radius of the square that opening removes, in pixels; 0 leaves it out.
    pub opening_px: u8,
    /// Least difference between the mean grey of the two classes, 0 to 255.
    pub contrast: f64,
}

impl Default for ImageSettings {
    fn default() -> Self {
        Self { blur_px: 1.0, opening_px: 1, contrast: 20.0 }
    }
}

/// A picture taken apart: pixel (row, column) belongs to region `labels[row * width + column]`, 0 being the dark rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Regions {
    /// Columns.
    pub width: usize,
    /// One label a pixel.
    pub labels: Vec<u32>,
    /// Number of regions; labels run from 1 to it.
    pub count: usize,
    /// Otsu's threshold: brighter pixels are bright.
    pub threshold: u8,
    /// Mean grey of the dark class.
    pub dark: f64,
    /// Mean grey of the bright class.
    pub bright: f64,
}

/// Bright regions of a picture, connected over edges and corners.
///
/// # Errors
/// [`ImageError`].
pub fn regions(picture: &Picture<u8>, settings: &ImageSettings) -> Result<Regions, ImageError> {
    let (width, height) = (picture.width(), picture.height());
    let fits = |n: usize| (16..=16384).contains(&n);
    let size = ImageError::Size { width, height };
    if !(fits(width) && fits(height)) {
        return Err(size);
    }
    if !(settings.blur_px > 0.0 && settings.blur_px <= 10.0) {
        let expected = "above 0 and up to 10 pixels";
        return Err(ImageError::Setting { what: "the blur", expected, got: settings.blur_px });
    }
    if !(0.0..=255.0).contains(&settings.contrast) {
        let expected = "0 to 255 grey levels";
        return Err(ImageError::Setting { what: "the contrast", expected, got: settings.contrast });
    }
    let grey = GrayImage::from_raw(width as u32, height as u32, picture.data().to_vec()).ok_or(size)?;
    let mut grey = gaussian_blur_f32(&grey, settings.blur_px as f32);
    let threshold = otsu_level(&grey);
    let (dark, bright) = class_means(grey.as_raw(), threshold);
    if !(bright - dark >= settings.contrast) {
        return Err(ImageError::NoContrast { expected: settings.contrast, got: bright - dark });
    }
    threshold_mut(&mut grey, threshold, ThresholdType::Binary);
    if settings.opening_px > 0 {
        open_mut(&mut grey, Norm::LInf, settings.opening_px);
    }
    let labels = connected_components(&grey, Connectivity::Eight, Luma([0])).into_raw();
    let count = labels.iter().copied().max().unwrap_or(0) as usize;
    Ok(Regions { width, labels, count, threshold, dark, bright })
}

/// Mean grey up to a threshold and above it; equal where one class is empty.
fn class_means(pixels: &[u8], threshold: u8) -> (f64, f64) {
    let mut sums = [(0u64, 0u64); 2];
    for &p in pixels {
        let class = &mut sums[usize::from(p > threshold)];
        *class = (class.0 + u64::from(p), class.1 + 1);
    }
    let mean = |(sum, n): (u64, u64)| if n == 0 { f64::NAN } else { sum as f64 / n as f64 };
    let (dark, bright) = (mean(sums[0]), mean(sums[1]));
    if dark.is_nan() || bright.is_nan() { (0.0, 0.0) } else { (dark, bright) }
}
