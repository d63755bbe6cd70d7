//! The membrane's plane at rest, and the window of a picture that shows it.

use hw_traits::picture::{Intrinsics, Picture};
use nalgebra::{Matrix3, Vector3};
use statrs::statistics::{Data, OrderStatistics as _};

use super::error::{CloudError, check};

/// The membrane's plane at rest: `1/z = a + b u + c v` at column u and row v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    pub(super) inverse_depth: [f64; 3],
    /// Distance of the plane from the lens, m.
    pub distance_m: f64,
}

/// A rectangle of pixels: from (row, column), so many rows and columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// First row.
    pub row: usize,
    /// First column.
    pub column: usize,
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
}

/// Least size of a window, pixels either way.
const LEAST: usize = 40;

impl Window {
    /// The part of a picture that shows a membrane: a box of `length_m` (the gripper's width, along columns) by `breadth_m`
    /// around the optical axis, less a border of `margin_m` all around, on the plane at rest.
    ///
    /// # Errors
    /// [`CloudError::Setting`], [`CloudError::OutOfView`].
    pub fn of_membrane(
        size: (usize, usize),
        intrinsics: &Intrinsics,
        rest: &Rest,
        (length_m, breadth_m): (f64, f64),
        margin_m: f64,
    ) -> Result<Self, CloudError> {
        check(intrinsics)?;
        let half = [0.5 * length_m - margin_m, 0.5 * breadth_m - margin_m];
        for (what, got) in [
            ("half the membrane's length less the margin", half[0]),
            ("half its breadth less the margin", half[1]),
        ] {
            if !(got > 0.0 && got.is_finite()) {
                return Err(CloudError::Setting { what, expected: "a finite number above 0", got });
            }
        }
        let z = rest.distance_m;
        let span = |middle: f64, f: f64, half: f64, end: usize| {
            let low = (middle - f * half / z).ceil().max(0.0);
            let high = (middle + f * half / z).floor().min(end as f64 - 1.0);
            (low as usize, if high < low { 0 } else { (high - low) as usize + 1 })
        };
        let (column, columns) = span(intrinsics.cx, intrinsics.fx, half[0], size.0);
        let (row, rows) = span(intrinsics.cy, intrinsics.fy, half[1], size.1);
        if columns < LEAST || rows < LEAST {
            return Err(CloudError::OutOfView { columns, rows, expected: LEAST });
        }
        Ok(Self { row, column, rows, columns })
    }

    /// All of a picture.
    pub fn whole(picture: &Picture<f32>) -> Self {
        Self { row: 0, column: 0, rows: picture.height(), columns: picture.width() }
    }

    pub(super) fn fits(&self, picture: &Picture<f32>) -> Result<(), CloudError> {
        let inside =
            self.row + self.rows <= picture.height() && self.column + self.columns <= picture.width();
        if inside && self.rows >= LEAST && self.columns >= LEAST {
            return Ok(());
        }
        Err(CloudError::OutOfView { columns: self.columns, rows: self.rows, expected: LEAST })
    }
}

impl Rest {
    /// A plane that looks straight at the lens from a distance (m, positive).
    ///
    /// # Errors
    /// [`CloudError::Setting`].
    pub fn level(distance_m: f64) -> Result<Self, CloudError> {
        if distance_m > 0.0 && distance_m.is_finite() {
            return Ok(Self { inverse_depth: [distance_m.recip(), 0.0, 0.0], distance_m });
        }
        Err(CloudError::Setting {
            what: "the distance",
            expected: "a finite number above 0",
            got: distance_m,
        })
    }

    /// The plane that a picture of the membrane at rest shows in a window; pixels far from it (Tukey's weights) do not count.
    ///
    /// # Errors
    /// [`CloudError`].
    pub fn fit(picture: &Picture<f32>, intrinsics: &Intrinsics, window: &Window) -> Result<Self, CloudError> {
        check(intrinsics)?;
        window.fits(picture)?;
        let rows = || {
            (window.row..window.row + window.rows).flat_map(move |v| {
                (window.column..window.column + window.columns).filter_map(move |u| {
                    let z = f64::from(picture.data()[v * picture.width() + u]);
                    (z > 0.0 && z.is_finite()).then(|| (Vector3::new(1.0, u as f64, v as f64), z.recip()))
                })
            })
        };
        let (seen, total) = (rows().count(), window.rows * window.columns);
        let blind = CloudError::Blind { seen, total };
        if 2 * seen < total || seen == 0 {
            return Err(blind);
        }
        let values: Vec<f64> = rows().map(|r| r.1).collect();
        let mut plane = Vector3::new(Data::new(values).median(), 0.0, 0.0);
        for _ in 0..12 {
            let off: Vec<f64> = rows().map(|(x, y)| (y - plane.dot(&x)).abs()).collect();
            let scale = 1.4826 * Data::new(off).median();
            let cut = 4.685 * scale.max(1e-6 * plane[0].abs());
            let (mut gram, mut right) = (Matrix3::zeros(), Vector3::zeros());
            for (x, y) in rows() {
                let q = (y - plane.dot(&x)) / cut;
                let w = (1.0 - q * q).max(0.0).powi(2);
                gram += w * x * x.transpose();
                right += w * y * x;
            }
            match gram.cholesky() {
                Some(c) => plane = c.solve(&right),
                None => break,
            }
        }
        let [a, b, c] = [plane[0], plane[1], plane[2]];
        let m = Vector3::new(b * intrinsics.fx, c * intrinsics.fy, a + b * intrinsics.cx + c * intrinsics.cy);
        let distance_m = m.norm().recip();
        if distance_m.is_finite() && distance_m > 0.0 {
            return Ok(Self { inverse_depth: [a, b, c], distance_m });
        }
        Err(CloudError::Blind { seen: 0, total })
    }
}
