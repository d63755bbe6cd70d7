//! From a depth picture to an organised cloud of the membrane: heights over its plane at rest, smoothed points, normals.

use hw_traits::picture::{Intrinsics, Picture};
use nalgebra::{Matrix3, Vector3};

/// Why a picture gives no cloud.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CloudError {
    /// Intrinsics, lengths or settings that are none.
    #[error("{what} is {got}; expected {expected}")]
    Setting {
        /// Which.
        what: &'static str,
        /// What it has to be.
        expected: &'static str,
        /// What it is.
        got: f64,
    },
    /// The membrane lies outside the picture.
    #[error(
        "the membrane covers {columns} x {rows} pixels of the picture; expected {expected} or more either way"
    )]
    OutOfView {
        /// Columns of it in the picture.
        columns: usize,
        /// Rows of it in the picture.
        rows: usize,
        /// Least number.
        expected: usize,
    },
    /// Too many pixels saw nothing.
    #[error("{seen} of {total} pixels of the membrane are seen; expected half or more")]
    Blind {
        /// Pixels with a depth.
        seen: usize,
        /// Pixels of the membrane.
        total: usize,
    },
}

/// The membrane's plane at rest: `1/z = a + b u + c v` at column u and row v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    inverse_depth: [f64; 3],
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

    fn fits(&self, picture: &Picture<f32>) -> Result<(), CloudError> {
        let inside =
            self.row + self.rows <= picture.height() && self.column + self.columns <= picture.width();
        if inside && self.rows >= LEAST && self.columns >= LEAST {
            return Ok(());
        }
        Err(CloudError::OutOfView { columns: self.columns, rows: self.rows, expected: LEAST })
    }
}

fn check(intrinsics: &Intrinsics) -> Result<(), CloudError> {
    for (what, got) in [("fx", intrinsics.fx), ("fy", intrinsics.fy)] {
        if !(got > 0.0 && got.is_finite()) {
            return Err(CloudError::Setting { what, expected: "a finite number above 0", got });
        }
    }
    Ok(())
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
        if 2 * seen < total {
            return Err(CloudError::Blind { seen, total });
        }
        let mut values: Vec<f64> = rows().map(|r| r.1).collect();
        values.sort_by(f64::total_cmp);
        let mut plane = Vector3::new(values[values.len() / 2], 0.0, 0.0);
        for _ in 0..12 {
            let mut off: Vec<f64> = rows().map(|(x, y)| (y - plane.dot(&x)).abs()).collect();
            let middle = off.len() / 2;
            let scale = 1.4826 * *off.select_nth_unstable_by(middle, f64::total_cmp).1;
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

/// Sums over `half` entries to each side along rows; beyond the end there is nothing.
fn along_rows(from: &[f32], to: &mut [f32], columns: usize, half: usize) {
    for (from, to) in from.chunks_exact(columns).zip(to.chunks_exact_mut(columns)) {
        let mut sum: f32 = from[..half.min(columns)].iter().sum();
        for k in 0..columns {
            if k + half < columns {
                sum += from[k + half];
            }
            to[k] = sum;
            if k >= half {
                sum -= from[k - half];
            }
        }
    }
}

/// Sums over `half` entries to each side along columns, a row at a time.
fn along_columns(from: &[f32], to: &mut [f32], columns: usize, half: usize) {
    let rows = from.len() / columns;
    let line = |r: usize| &from[r * columns..][..columns];
    let (first, rest) = to.split_at_mut(columns);
    first.fill(0.0);
    for r in 0..=half.min(rows - 1) {
        first.iter_mut().zip(line(r)).for_each(|(s, x)| *s += x);
    }
    let mut before: &mut [f32] = first;
    for (r, out) in rest.chunks_exact_mut(columns).enumerate() {
        let r = r + 1;
        match (r + half < rows, r > half) {
            (true, true) => {
                let (add, drop) = (line(r + half), line(r - half - 1));
                for k in 0..columns {
                    out[k] = before[k] + add[k] - drop[k];
                }
            }
            (true, false) => {
                out.iter_mut().zip(before.iter().zip(line(r + half))).for_each(|(o, (b, a))| *o = b + a)
            }
            (false, true) => {
                out.iter_mut().zip(before.iter().zip(line(r - half - 1))).for_each(|(o, (b, d))| *o = b - d)
            }
            (false, false) => out.copy_from_slice(before),
        }
        before = out;
    }
}
