//! One Lucas-Kanade step of one patch.

use super::pyramid::{Level, Pyramid};

/// Settings and scratch of the step; use one for many patches.
#[derive(Debug, Clone)]
pub struct LucasKanade {
    half: usize,
    iterations: usize,
    template: Vec<f32>,
    slope: Vec<[f32; 2]>,
    now: Vec<f32>,
}

/// Where a patch went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow {
    /// Column and row, in pixels.
    pub at_px: [f64; 2],
    /// Root mean square of what differs between the patches, in grey levels.
    pub residual: f64,
    /// Smaller eigenvalue of the mean structure tensor, in (grey levels / pixel)^2: near zero, the patch has no corner.
    pub corner: f64,
}

impl LucasKanade {
    /// Patches of `2 half_px + 1` pixels each way (half at least 2), at most `iterations` steps a level.
    pub fn new(half_px: usize, iterations: usize) -> Self {
        let half = half_px.max(2);
        let side = 2 * half + 1;
        Self {
            half,
            iterations: iterations.max(1),
            template: vec![0.0; (side + 2) * (side + 2)],
            slope: vec![[0.0; 2]; side * side],
            now: vec![0.0; side * side],
        }
    }

    /// Where the patch of `before` at `from` (column, row) is in `after`, looked for from `guess` on; none where it leaves the
    /// picture, has no corner, or does not settle.
    pub fn follow(
        &mut self,
        before: &Pyramid,
        after: &Pyramid,
        from: [f64; 2],
        guess: [f64; 2],
    ) -> Option<Flow> {
        let levels = before.levels().len().min(after.levels().len());
        let mut by = [guess[0] - from[0], guess[1] - from[1]];
        let mut found = None;
        for k in (0..levels).rev() {
            let scale = f64::from(1u32 << k);
            let at = from.map(|x| (x + 0.5) / scale - 0.5);
            let start = [at[0] + by[0] / scale, at[1] + by[1] / scale];
            let flow = self.level(&before.levels()[k], &after.levels()[k], at, start);
            match flow {
                Some(f) => by = [(f.at_px[0] - at[0]) * scale, (f.at_px[1] - at[1]) * scale],
                // Near the edge coarse levels have no room for the patch; the finest has to.
                None if k > 0 => {}
                None => return None,
            }
            found = flow;
        }
        found
    }

    fn level(&mut self, before: &Level, after: &Level, at: [f64; 2], start: [f64; 2]) -> Option<Flow> {
        let side = 2 * self.half + 1;
        let n = (side * side) as f64;
        if !before.patch(at[0], at[1], self.half + 1, &mut self.template) {
            return None;
        }
        let wide = side + 2;
        let (mut uu, mut uv, mut vv) = (0f32, 0f32, 0f32);
        for row in 0..side {
            for column in 0..side {
                let i = (row + 1) * wide + column + 1;
                let du = 0.5 * (self.template[i + 1] - self.template[i - 1]);
                let dv = 0.5 * (self.template[i + wide] - self.template[i - wide]);
                self.slope[row * side + column] = [du, dv];
                uu += du * du;
                uv += du * dv;
                vv += dv * dv;
            }
        }
        let (uu, uv, vv) = (f64::from(uu), f64::from(uv), f64::from(vv));
        let corner = 0.5 * (uu + vv - ((uu - vv).powi(2) + 4.0 * uv * uv).sqrt()) / n;
        let det = uu * vv - uv * uv;
        if !(corner > 1e-3) {
            return None;
        }
        let mut p = start;
        let mut residual = f64::INFINITY;
        for _ in 0..self.iterations {
            if !after.patch(p[0], p[1], self.half, &mut self.now) {
                return None;
            }
            let (mut bu, mut bv, mut square) = (0f32, 0f32, 0f32);
            for row in 0..side {
                let then = &self.template[(row + 1) * wide + 1..][..side];
                let now = &self.now[row * side..][..side];
                let slope = &self.slope[row * side..][..side];
                for k in 0..side {
                    let d = then[k] - now[k];
                    bu += d * slope[k][0];
                    bv += d * slope[k][1];
                    square += d * d;
                }
            }
            residual = (f64::from(square) / n).sqrt();
            let (bu, bv) = (f64::from(bu), f64::from(bv));
            let by = [(vv * bu - uv * bv) / det, (uu * bv - uv * bu) / det];
            p = [p[0] + by[0], p[1] + by[1]];
            if by[0].hypot(by[1]) < 0.01 {
                break;
            }
        }
        Some(Flow { at_px: p, residual, corner })
    }
}
