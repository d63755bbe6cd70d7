//! A picture at halves of its size.

use hw_traits::picture::Picture;

/// A picture and its halvings; room is used again from picture to picture.
#[derive(Debug, Clone, Default)]
pub struct Pyramid {
    levels: Vec<Level>,
}

/// One level: grey values, row by row.
#[derive(Debug, Clone, Default)]
pub(super) struct Level {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) grey: Vec<f32>,
}

/// A level is at least this many pixels either way.
const LEAST: usize = 24;

impl Pyramid {
    /// Takes a picture in, with at most `levels` sizes (at least 1).
    pub fn fill(&mut self, picture: &Picture<u8>, levels: usize) {
        self.levels.resize_with(levels.max(1), Level::default);
        let first = &mut self.levels[0];
        (first.width, first.height) = (picture.width(), picture.height());
        first.grey.clear();
        first.grey.extend(picture.data().iter().map(|&p| f32::from(p)));
        for k in 1..self.levels.len() {
            let (finer, coarser) = self.levels.split_at_mut(k);
            let finer = &finer[k - 1];
            if finer.width < 2 * LEAST || finer.height < 2 * LEAST {
                self.levels.truncate(k);
                break;
            }
            coarser[0].halve(finer);
        }
    }

    /// Levels, the finest first.
    pub(super) fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Columns and rows of the finest level.
    pub(super) fn size(&self) -> (usize, usize) {
        self.levels.first().map_or((0, 0), |l| (l.width, l.height))
    }
}

impl Level {
    /// Means of two by two pixels: pixel u of this level lies at 2 u + 1/2 of the finer one.
    fn halve(&mut self, finer: &Self) {
        (self.width, self.height) = (finer.width / 2, finer.height / 2);
        self.grey.clear();
        for row in 0..self.height {
            let above = &finer.grey[2 * row * finer.width..][..2 * self.width];
            let below = &finer.grey[(2 * row + 1) * finer.width..][..2 * self.width];
            let pairs = above.chunks_exact(2).zip(below.chunks_exact(2));
            self.grey.extend(pairs.map(|(a, b)| 0.25 * (a[0] + a[1] + b[0] + b[1])));
        }
    }

    /// Bilinear samples on a lattice of whole pixels with its middle at (u, v), `half` to each side; false where it reaches
    /// beyond the picture.
    pub(super) fn patch(&self, u: f64, v: f64, half: usize, out: &mut [f32]) -> bool {
        let (left, top) = (u - half as f64, v - half as f64);
        let side = 2 * half + 1;
        let inside = |low: f64, end: usize| low >= 0.0 && low + (side as f64) < end as f64;
        if !(inside(left, self.width) && inside(top, self.height)) {
            return false;
        }
        let (u0, v0) = (left as usize, top as usize);
        let (du, dv) = ((left - u0 as f64) as f32, (top - v0 as f64) as f32);
        let w = [(1.0 - du) * (1.0 - dv), du * (1.0 - dv), (1.0 - du) * dv, du * dv];
        for (row, out) in out.chunks_exact_mut(side).take(side).enumerate() {
            let a = &self.grey[(v0 + row) * self.width + u0..][..side + 1];
            let b = &self.grey[(v0 + row + 1) * self.width + u0..][..side + 1];
            for (k, o) in out.iter_mut().enumerate() {
                *o = w[0] * a[k] + w[1] * a[k + 1] + w[2] * b[k] + w[3] * b[k + 1];
            }
        }
        true
    }
}
