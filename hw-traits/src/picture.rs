//! Pictures as a device hands them over: rows from the top, pixels from the left.

/// A rectangle of pixels; pixel (row, column) is `data[row * width + column]`.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "tape-file", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "tape-file", serde(try_from = "Unchecked<T>"))]
pub struct Picture<T> {
    width: usize,
    data: Vec<T>,
}

/// A picture from a file: its pixels may make no rows.
#[cfg(feature = "tape-file")]
#[derive(serde::Deserialize)]
struct Unchecked<T> {
    width: usize,
    data: Vec<T>,
}

#[cfg(feature = "tape-file")]
impl<T> TryFrom<Unchecked<T>> for Picture<T> {
    type Error = NotRows;

    fn try_from(given: Unchecked<T>) -> Result<Self, NotRows> {
        Self::new(given.width, given.data)
    }
}

/// A number of pixels that does not make whole rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{pixels} pixels do not make rows of {width}")]
pub struct NotRows {
    /// Pixels in a row.
    pub width: usize,
    /// Pixels that came.
    pub pixels: usize,
}

impl<T> Picture<T> {
    /// A picture of rows of `width` pixels (at least 1).
    ///
    /// # Errors
    /// [`NotRows`] where the pixels do not make at least one whole row.
    pub fn new(width: usize, data: Vec<T>) -> Result<Self, NotRows> {
        if width == 0 || data.is_empty() || !data.len().is_multiple_of(width) {
            return Err(NotRows { width, pixels: data.len() });
        }
        Ok(Self { width, data })
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.data.len() / self.width
    }

    /// All pixels, row by row.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// All pixels, row by row, to be changed.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// The pixel at a row and a column; none outside.
    pub fn get(&self, row: usize, column: usize) -> Option<&T> {
        if column < self.width { self.data.get(row * self.width + column) } else { None }
    }
}

/// Pinhole camera: pixel (u, v) looks along ((u - cx)/fx, (v - cy)/fy, 1) in the camera's frame (x right, y down, z out of
/// the lens); pixel centres are whole numbers, (0, 0) is the first pixel of the first row.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "tape-file", derive(serde::Serialize, serde::Deserialize))]
pub struct Intrinsics {
    /// Focal length along columns, in pixels.
    pub fx: f64,
    /// Focal length along rows, in pixels.
    pub fy: f64,
    /// Column of the principal point.
    pub cx: f64,
    /// Row of the principal point.
    pub cy: f64,
}

impl Intrinsics {
    /// The point (m, camera's frame) that pixel (`u` column, `v` row) shows at a depth (m, along the optical axis).
    pub fn point(&self, u: f64, v: f64, depth_m: f64) -> [f64; 3] {
        [(u - self.cx) / self.fx * depth_m, (v - self.cy) / self.fy * depth_m, depth_m]
    }

    /// The pixel (column, row) that shows a point (m, camera's frame); none for a point that is not before the lens.
    pub fn pixel(&self, [x, y, z]: [f64; 3]) -> Option<(f64, f64)> {
        (z > 0.0).then(|| (self.fx * x / z + self.cx, self.fy * y / z + self.cy))
    }
}
