//! What a level cuts out of a mesh, as polynomials of the level's height.

/// An edge of a triangle: where it is across as a function of the height.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    low: [f64; 3],
    slope: [f64; 2],
    high: [f64; 3],
}

impl Edge {
    /// From the lower to the higher end, `[across, across, up]`.
    pub(super) fn new(low: &[f64; 3], high: &[f64; 3]) -> Self {
        let rise = 1.0 / (high[2] - low[2]);
        Self { low: *low, slope: [(high[0] - low[0]) * rise, (high[1] - low[1]) * rise], high: *high }
    }

    /// The line through the edge.
    pub(super) fn at(&self, height: f64) -> [f64; 2] {
        let rise = height - self.low[2];
        [self.low[0] + rise * self.slope[0], self.low[1] + rise * self.slope[1]]
    }

    /// The edge itself: beyond an end, that end.
    pub(super) fn clamped(&self, height: f64) -> [f64; 2] {
        let [share, all] = [height - self.low[2], self.high[2] - self.low[2]];
        let t = (share / all).clamp(0.0, 1.0);
        let along = |k: usize| self.low[k] + t * (self.high[k] - self.low[k]);
        [along(0), along(1)]
    }
}

/// Area of a cut and its two first moments across, as polynomials in `t` from 0 to 1 over a range of heights.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cut {
    pub(super) area: [f64; 3],
    pub(super) moments: [[f64; 4]; 2],
}

impl Cut {
    /// What the segment that runs from one line to another adds, by Green's theorem; each line's ends at `t` = 0 and 1.
    #[inline]
    pub(super) fn between([p, p1]: [[f64; 2]; 2], [q, q1]: [[f64; 2]; 2]) -> Self {
        let (dp, dq) = ([p1[0] - p[0], p1[1] - p[1]], [q1[0] - q[0], q1[1] - q[1]]);
        let cross = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let c = [cross(p, q), cross(p, dq) + cross(dp, q), cross(dp, dq)];
        let moment = |k: usize| {
            let (s, ds) = ((p[k] + q[k]) / 6.0, (dp[k] + dq[k]) / 6.0);
            [c[0] * s, c[0] * ds + c[1] * s, c[1] * ds + c[2] * s, c[2] * ds]
        };
        Self { area: c.map(|c| 0.5 * c), moments: [moment(0), moment(1)] }
    }

    /// Adds another one so many times.
    #[inline]
    pub(super) fn add(&mut self, other: &Self, times: f64) {
        self.area.iter_mut().zip(&other.area).for_each(|(a, b)| *a += times * b);
        for (mine, theirs) in self.moments.iter_mut().zip(&other.moments) {
            mine.iter_mut().zip(theirs).for_each(|(a, b)| *a += times * b);
        }
    }

    /// The cut over a part of the range: `t` becomes `begin + width t`.
    #[inline]
    pub(super) fn part(&self, begin: f64, width: f64) -> Self {
        let [a, b, c] = self.area;
        let w2 = width * width;
        let moment = |m: &[f64; 4]| {
            let first = m[1] + begin * (2.0 * m[2] + begin * 3.0 * m[3]);
            let value = m[0] + begin * (m[1] + begin * (m[2] + begin * m[3]));
            [value, width * first, w2 * (m[2] + 3.0 * begin * m[3]), w2 * width * m[3]]
        };
        Self {
            area: [a + begin * (b + begin * c), width * (b + 2.0 * begin * c), w2 * c],
            moments: [moment(&self.moments[0]), moment(&self.moments[1])],
        }
    }
}
