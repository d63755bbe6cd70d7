//! Undeformed, deformed, in contact.
//!
//! A membrane under tensions `T_j` and `T_i` carries the load `T_j k_j + T_i k_i` per area, and none where nothing touches:
//! beside the contact it curves one way along a radius and the other way across. So contact is where `k_j + r k_i` (r the ratio
//! of the tensions) is above its noise. The rule of [Matl 2021], convex along either axis, calls part of the free membrane contact (a
//! cone's flank is convex around the cone); it is there by name. A flat face carries its load on its rim alone: points above the plane of
//! the curved points, inside the curved region, are in contact too.

use nalgebra::{Matrix3, Vector3};

use crate::cloud::Cloud;
use crate::curvature::Curvature;

/// State of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum State {
    /// Nothing is known: a hole, or the border.
    #[default]
    Unseen,
    /// As at rest.
    Undeformed,
    /// Moved, but touched by nothing.
    Deformed,
    /// Touched.
    Contact,
}

/// When a curvature counts as contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// `k_j + r k_i` above the threshold, r being the tension across over that along the stretch. [`Segmenter::tension_ratio`] finds it;
    /// the default, which is larger than most membranes', leaves out more of the flank, and finds balls and faces as well or better.
    Load {
        /// r, above 0.
        ratio: f32,
    },
    /// `k_i` or `k_j` above the threshold: section 6.3.
    EitherAxis,
}

impl Rule {
    fn signal(self, i: f32, j: f32) -> f32 {
        match self {
            Self::Load { ratio } => j + ratio * i,
            Self::EitherAxis => i.max(j),
        }
    }
}

/// How a cloud is segmented.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentSettings {
    /// What counts as contact.
    pub rule: Rule,
    /// Least curvature, 1/m.
    pub curvature_per_m: f32,
    /// A pixel is deformed from this height on, m.
    pub height_m: f32,
    /// A patch of contact has at least this many pixels.
    pub least_px: usize,
}

impl Default for SegmentSettings {
    fn default() -> Self {
        Self { rule: Rule::Load { ratio: 0.6 }, curvature_per_m: 18.0, height_m: 0.8e-3, least_px: 60 }
    }
}

/// Segments clouds; room is used again.
#[derive(Debug, Clone, Default)]
pub struct Segmenter {
    /// One state a pixel of the cloud's window.
    pub states: Vec<State>,
    curvature: Curvature,
    signals: Vec<f32>,
    stack: Vec<usize>,
    patch: Vec<usize>,
    seen: Vec<bool>,
}

impl Segmenter {
    /// Segments a cloud.
    pub fn segment(&mut self, cloud: &Cloud, settings: &SegmentSettings) -> &[State] {
        self.curvature.fill(cloud);
        self.states.clear();
        let signals = self.curvature.i.iter().zip(&self.curvature.j);
        self.states.extend(cloud.smooth.iter().zip(signals).map(|(&h, (&i, &j))| {
            let curved = settings.rule.signal(i, j) > settings.curvature_per_m;
            if h.is_nan() {
                State::Unseen
            } else if !(h > settings.height_m) {
                State::Undeformed
            } else if curved {
                State::Contact
            } else {
                State::Deformed
            }
        }));
        self.keep_largest(cloud, settings);
        self.trim(settings);
        let filled = self.fill_faces(cloud);
        let all = self.states.iter().filter(|s| **s == State::Contact).count();
        if filled as f64 > FLAT * all as f64 {
            self.trim_face(cloud, all);
        }
        &self.states
    }

    /// Curvatures of the last cloud.
    pub fn curvature(&self) -> &Curvature {
        &self.curvature
    }

    /// The ratio of the tensions that the last cloud's free membrane shows, and its standard deviation; none where too little of it is
    /// curved.
    ///
    /// Where nothing touches, `k_j + r k_i` is zero: r is the line through the origin nearest to the pairs of curvatures of the deformed
    /// pixels (both have the same noise: total least squares). Smoothing ties neighbours together, so the standard deviation is that of
    /// leaving out each of eight sectors about the contact in turn.
    pub fn tension_ratio(&self, cloud: &Cloud) -> Option<(f64, f64)> {
        let columns = cloud.columns().max(1);
        let at = |k: usize| ((k % columns) as f64, (k / columns) as f64);
        let touching = || (0..self.states.len()).filter(|k| self.states[*k] == State::Contact);
        let n = touching().count() as f64;
        let sum = touching().map(at).fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
        let middle = (sum.0 / n, sum.1 / n);
        let reach = (n / std::f64::consts::PI).sqrt();
        // Beside the contact the smoothing takes in some of it; far away there is noise alone.
        let near = [reach + 2.0 * cloud.step as f64, 2.2 * reach + 2.0 * cloud.step as f64];
        let mut sectors = [[0.0; 3]; 8];
        for k in (0..self.states.len()).filter(|k| self.states[*k] == State::Deformed) {
            let (i, j) = (f64::from(self.curvature.i[k]), f64::from(self.curvature.j[k]));
            let (u, v) = (at(k).0 - middle.0, at(k).1 - middle.1);
            if !(i + j).is_finite() || !(near[0]..near[1]).contains(&u.hypot(v)) {
                continue;
            }
            let sector = ((v.atan2(u) / std::f64::consts::TAU + 0.5) * 8.0) as usize % 8;
            for (s, x) in sectors[sector].iter_mut().zip([i * i, i * j, j * j]) {
                *s += x;
            }
        }
        let total = |left_out: usize| {
            let others = sectors.iter().enumerate().filter(|(k, _)| *k != left_out).map(|(_, s)| s);
            slope(others.fold([0.0; 3], |t, s| [t[0] + s[0], t[1] + s[1], t[2] + s[2]]))
        };
        let ratio = total(8)?;
        let parts: Option<Vec<f64>> = (0..8).map(total).collect();
        let parts = parts?;
        let mean = parts.iter().sum::<f64>() / 8.0;
        let sigma = (parts.iter().map(|p| (p - mean).powi(2)).sum::<f64>() * 7.0 / 8.0).sqrt();
        (sigma < 0.5 * ratio).then_some((ratio, sigma))
    }

    /// Smoothing widens a contact; where the signal is half of the contact's median, its edge was.
    fn trim(&mut self, settings: &SegmentSettings) {
        let at = |k: usize| settings.rule.signal(self.curvature.i[k], self.curvature.j[k]);
        self.signals.clear();
        self.signals.extend((0..self.states.len()).filter(|k| self.states[*k] == State::Contact).map(at));
        if self.signals.is_empty() {
            return;
        }
        let middle = self.signals.len() / 2;
        let half = 0.5 * *self.signals.select_nth_unstable_by(middle, f32::total_cmp).1;
        for (state, (i, j)) in self.states.iter_mut().zip(self.curvature.i.iter().zip(&self.curvature.j)) {
            if *state == State::Contact && settings.rule.signal(*i, *j) < half {
                *state = State::Deformed;
            }
        }
    }

    /// Of the patches of contact the largest, and those at least a quarter of it; the rest is noise.
    fn keep_largest(&mut self, cloud: &Cloud, settings: &SegmentSettings) {
        let columns = cloud.columns().max(1);
        let rows = self.states.len() / columns;
        self.seen.clear();
        self.seen.resize(self.states.len(), false);
        let mut largest = 0;
        // First pass finds the largest, second one drops the small.
        for pass in 0..2 {
            self.seen.fill(false);
            let least = if pass == 0 { 0 } else { settings.least_px.max(largest / 4) };
            for start in 0..self.states.len() {
                if self.seen[start] || self.states[start] != State::Contact {
                    continue;
                }
                self.flood(start, columns, rows);
                largest = largest.max(self.patch.len());
                if self.patch.len() < least {
                    self.patch.iter().for_each(|&i| self.states[i] = State::Deformed);
                }
            }
        }
    }

    fn flood(&mut self, start: usize, columns: usize, rows: usize) {
        self.patch.clear();
        self.stack.clear();
        self.stack.push(start);
        self.seen[start] = true;
        while let Some(i) = self.stack.pop() {
            self.patch.push(i);
            let (row, column) = (i / columns, i % columns);
            let beside = [
                (row > 0).then(|| i - columns),
                (row + 1 < rows).then(|| i + columns),
                (column > 0).then(|| i - 1),
                (column + 1 < columns).then(|| i + 1),
            ];
            for k in beside.into_iter().flatten() {
                if !self.seen[k] && self.states[k] == State::Contact {
                    self.seen[k] = true;
                    self.stack.push(k);
                }
            }
        }
    }

    /// Points above the curved points' plane, within their rows and columns, are in contact.
    fn fill_faces(&mut self, cloud: &Cloud) -> usize {
        let columns = cloud.columns().max(1);
        let curved = || self.states.iter().enumerate().filter(|(_, s)| **s == State::Contact).map(|(i, _)| i);
        let at = |i: usize| ((i % columns) as f64, (i / columns) as f64);
        let n = curved().count();
        if n < 3 {
            return 0;
        }
        let (mut gram, mut right) = (Matrix3::zeros(), Vector3::zeros());
        let mut reach = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        for i in curved() {
            let (u, v) = at(i);
            let x = Vector3::new(1.0, u, v);
            gram += x * x.transpose();
            right += x * f64::from(cloud.smooth[i]);
            reach = [reach[0].min(u), reach[1].max(u), reach[2].min(v), reach[3].max(v)];
        }
        let Some(plane) = gram.cholesky().map(|c| c.solve(&right)) else { return 0 };
        let mut filled = 0;
        for (i, state) in self.states.iter_mut().enumerate() {
            let (u, v) = at(i);
            let within = u >= reach[0] && u <= reach[1] && v >= reach[2] && v <= reach[3];
            if *state == State::Deformed
                && within
                && f64::from(cloud.smooth[i]) > plane.dot(&Vector3::new(1.0, u, v))
            {
                *state = State::Contact;
                filled += 1;
            }
        }
        filled
    }

    /// Where a flat face ends: its rim was widened by the smoothing.
    ///
    /// Across an edge from a face to a flank of slope s, heights averaged by a triangle of half-width w are `s w / 6` below the face at the edge, and
    /// their slope there is `s / 2`, whatever s is. So what lies deeper below the face than `w / 3` times its slope is outside.
    fn trim_face(&mut self, cloud: &Cloud, all: usize) {
        let (columns, step) = (cloud.columns().max(1), cloud.step.max(1));
        let at = |i: usize| ((i % columns) as f64, (i / columns) as f64);
        let touching: Vec<usize> =
            (0..self.states.len()).filter(|k| self.states[*k] == State::Contact).collect();
        let sum = touching.iter().map(|k| at(*k)).fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
        let middle = (sum.0 / all as f64, sum.1 / all as f64);
        let core = 0.5 * (all as f64 / std::f64::consts::PI).sqrt();
        let (mut gram, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for &k in &touching {
            let (u, v) = (at(k).0 - middle.0, at(k).1 - middle.1);
            if u.hypot(v) < core {
                let x = Vector3::new(1.0, u, v);
                gram += x * x.transpose();
                right += x * f64::from(cloud.smooth[k]);
            }
        }
        let Some(plane) = gram.cholesky().map(|c| c.solve(&right)) else { return };
        let third = (2 * cloud.half + 1) as f64 / 3.0;
        let smooth = |k: usize| f64::from(cloud.smooth[k]);
        for k in touching {
            let (column, row) = (k % columns, k / columns);
            let inner = column >= step && column + step < columns;
            if !(inner && row >= step && (row + step + 1) * columns <= self.states.len()) {
                continue;
            }
            let (u, v) = (at(k).0 - middle.0, at(k).1 - middle.1);
            let below = plane.dot(&Vector3::new(1.0, u, v)) - smooth(k);
            let slope = |by: usize| (smooth(k + by) - smooth(k - by)) / (2 * step) as f64;
            let slope = (slope(step) - plane[1]).hypot(slope(step * columns) - plane[2]);
            if below > BELOW_M && below > third * slope {
                self.states[k] = State::Deformed;
            }
        }
    }
}

/// Part of a contact that is not curved from which on it is a flat face.
const FLAT: f64 = 0.2;
/// What is less below a face is on it, m: three standard deviations of an averaged height.
const BELOW_M: f64 = 1.2e-4;

/// r of `k_j + r k_i = 0` from the sums of `k_i^2`, `k_i k_j`, `k_j^2`: the direction along which the pairs scatter least is `(r, 1)`.
fn slope([ii, ij, jj]: [f64; 3]) -> Option<f64> {
    let half = 0.5 * (ii - jj);
    // The eigenvector of the smaller eigenvalue of [[ii, ij], [ij, jj]].
    let ratio = -ij / (half + half.hypot(ij));
    (ratio > 0.0 && ratio.is_finite()).then_some(ratio)
}
