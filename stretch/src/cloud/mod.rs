//! From a depth picture to an organised cloud of the membrane: heights over its plane at rest, smoothed points, normals.

mod error;
mod rest;
mod sums;

use hw_traits::picture::{Intrinsics, Picture};

pub use self::error::CloudError;
use self::error::check;
pub use self::rest::{Rest, Window};
use self::sums::{along_columns, along_rows};

/// How a cloud is cleaned and smoothed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudSettings {
    /// A pixel is flying if it is further than this (m, along the plane's normal) from most of its four neighbours.
    pub jump_m: f64,
    /// Half the side of the square that heights are averaged over (twice), pixels, 1 to 50.
    pub half_px: usize,
    /// Pixels to each side that slopes and curvatures are taken over, 1 to 50.
    pub step_px: usize,
}

impl Default for CloudSettings {
    fn default() -> Self {
        Self { jump_m: 4e-3, half_px: 4, step_px: 7 }
    }
}

/// The membrane in a window, one entry a pixel, row by row. Room is used again from picture to picture.
#[derive(Debug, Clone, Default)]
pub struct Cloud {
    pub(crate) window: Option<Window>,
    geometry: Option<(Intrinsics, Rest)>,
    pub(crate) step: usize,
    /// Half the side of the squares that were averaged over, pixels.
    pub(crate) half: usize,
    /// Height over the plane at rest towards the lens, m; NaN where nothing or something flying was seen.
    pub heights: Vec<f32>,
    /// Averaged height, m; NaN where less than a quarter of the square was seen.
    pub smooth: Vec<f32>,
    /// Averaged points in the camera's frame, m.
    pub points: Vec<[f32; 3]>,
    /// Unit normals towards the lens; NaN at the border and next to holes.
    pub normals: Vec<[f32; 3]>,
    raw: Vec<f32>,
    sums: [Vec<f32>; 2],
    rows: [Vec<f32>; 2],
}

impl Cloud {
    /// Columns of the window; 0 before the first picture.
    pub fn columns(&self) -> usize {
        self.window.map_or(0, |w| w.columns)
    }

    /// The point that an entry shows, not averaged, m, in the camera's frame; none where nothing was seen.
    pub fn raw_point(&self, index: usize) -> Option<[f64; 3]> {
        let (window, (intrinsics, rest)) = (self.window?, self.geometry?);
        let height = f64::from(*self.heights.get(index)?);
        let (u, v) =
            ((window.column + index % window.columns) as f64, (window.row + index / window.columns) as f64);
        let [a, b, c] = rest.inverse_depth;
        let z = (1.0 - height / rest.distance_m) / (a + b * u + c * v);
        z.is_finite().then(|| intrinsics.point(u, v, z))
    }

    /// Takes a picture in.
    ///
    /// # Errors
    /// [`CloudError`].
    pub fn fill(
        &mut self,
        picture: &Picture<f32>,
        intrinsics: &Intrinsics,
        rest: &Rest,
        window: Window,
        settings: &CloudSettings,
    ) -> Result<(), CloudError> {
        check(intrinsics)?;
        window.fits(picture)?;
        for (what, got) in [("half_px", settings.half_px), ("step_px", settings.step_px)] {
            if !(1..=50).contains(&got) {
                return Err(CloudError::Setting { what, expected: "1 to 50 pixels", got: got as f64 });
            }
        }
        if !(settings.jump_m > 0.0) {
            return Err(CloudError::Setting { what: "jump_m", expected: "above 0", got: settings.jump_m });
        }
        self.window = Some(window);
        self.geometry = Some((*intrinsics, *rest));
        self.step = settings.step_px;
        self.half = settings.half_px;
        self.lift(picture, rest, window);
        self.clean(window, settings.jump_m as f32);
        let (seen, total) =
            (self.heights.iter().filter(|h| !h.is_nan()).count(), window.rows * window.columns);
        if 2 * seen < total {
            return Err(CloudError::Blind { seen, total });
        }
        self.average(window, settings.half_px);
        self.place(intrinsics, rest, window);
        self.turn(window, settings.step_px);
        Ok(())
    }

    /// Heights over the plane at rest.
    fn lift(&mut self, picture: &Picture<f32>, rest: &Rest, window: Window) {
        let [a, b, c] = rest.inverse_depth.map(|x| x as f32);
        let d = rest.distance_m as f32;
        self.raw.clear();
        for v in window.row..window.row + window.rows {
            let depths = &picture.data()[v * picture.width() + window.column..][..window.columns];
            let start = a + c * v as f32 + b * window.column as f32;
            self.raw.extend(depths.iter().enumerate().map(|(k, &z)| {
                let h = d * (1.0 - z * (start + b * k as f32));
                if z > 0.0 && z.is_finite() { h } else { f32::NAN }
            }));
        }
    }

    /// Drops pixels that stand alone: fewer than two of the four neighbours are near.
    fn clean(&mut self, window: Window, jump: f32) {
        let (rows, columns) = (window.rows, window.columns);
        self.heights.clear();
        self.heights.extend_from_slice(&self.raw);
        // Comparisons with NaN are false, so holes are near nobody.
        for row in 1..rows - 1 {
            let above = &self.raw[(row - 1) * columns..][..columns];
            let here = &self.raw[row * columns..][..columns];
            let below = &self.raw[(row + 1) * columns..][..columns];
            let out = &mut self.heights[row * columns..][..columns];
            for k in 1..columns - 1 {
                let h = here[k];
                let near = u8::from((here[k - 1] - h).abs() < jump)
                    + u8::from((here[k + 1] - h).abs() < jump)
                    + u8::from((above[k] - h).abs() < jump)
                    + u8::from((below[k] - h).abs() < jump);
                out[k] = if near < 2 { f32::NAN } else { h };
            }
        }
    }

    /// Two averages over squares, holes left out.
    fn average(&mut self, window: Window, half: usize) {
        let n = window.rows * window.columns;
        for s in self.sums.iter_mut().chain(&mut self.rows) {
            s.resize(n, 0.0);
        }
        let [values, weights] = &mut self.sums;
        for ((v, w), h) in values.iter_mut().zip(weights.iter_mut()).zip(&self.heights) {
            (*v, *w) = if h.is_nan() { (0.0, 0.0) } else { (*h, 1.0) };
        }
        let [scratch, _] = &mut self.rows;
        for array in [values, weights] {
            for _ in 0..2 {
                along_rows(array, scratch, window.columns, half);
                along_columns(scratch, array, window.columns, half);
            }
        }
        let side = (2 * half + 1) as f32;
        let least = 0.25 * side.powi(4);
        let [values, weights] = &self.sums;
        self.smooth.clear();
        self.smooth
            .extend(values.iter().zip(weights).map(|(v, w)| if *w >= least { v / w } else { f32::NAN }));
        // At the border the squares are cut off: there less is enough.
        let edge = 2 * half;
        for (i, s) in self.smooth.iter_mut().enumerate() {
            let (row, column) = (i / window.columns, i % window.columns);
            let inner =
                row >= edge && column >= edge && row + edge < window.rows && column + edge < window.columns;
            if !inner && weights[i] >= 0.25 * least {
                *s = values[i] / weights[i];
            }
        }
    }

    /// Averaged points in the camera's frame.
    fn place(&mut self, intrinsics: &Intrinsics, rest: &Rest, window: Window) {
        let [a, b, c] = rest.inverse_depth.map(|x| x as f32);
        let over = (1.0 / rest.distance_m) as f32;
        let (fx, fy) = ((1.0 / intrinsics.fx) as f32, (1.0 / intrinsics.fy) as f32);
        let (cx, cy) = (intrinsics.cx as f32, intrinsics.cy as f32);
        self.points.clear();
        for row in 0..window.rows {
            let v = (window.row + row) as f32;
            let line = &self.smooth[row * window.columns..][..window.columns];
            self.points.extend(line.iter().enumerate().map(|(k, h)| {
                let u = (window.column + k) as f32;
                let z = (1.0 - h * over) / (a + b * u + c * v);
                [(u - cx) * fx * z, (v - cy) * fy * z, z]
            }));
        }
    }

    /// Normals from differences of points a step to each side.
    fn turn(&mut self, window: Window, step: usize) {
        let columns = window.columns;
        self.normals.clear();
        self.normals.resize(self.points.len(), [f32::NAN; 3]);
        for row in step..window.rows.saturating_sub(step) {
            let line = |r: usize| &self.points[r * columns..][..columns];
            let (above, here, below) = (line(row - step), line(row), line(row + step));
            let out = &mut self.normals[row * columns..][..columns];
            for k in step..columns.saturating_sub(step) {
                let (p, q) = (here[k + step], here[k - step]);
                let (r, s) = (below[k], above[k]);
                let u = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
                let v = [r[0] - s[0], r[1] - s[1], r[2] - s[2]];
                // v x u looks back at the lens.
                let n = [v[1] * u[2] - v[2] * u[1], v[2] * u[0] - v[0] * u[2], v[0] * u[1] - v[1] * u[0]];
                let over = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt().recip();
                out[k] = [n[0] * over, n[1] * over, n[2] * over];
            }
        }
    }
}
