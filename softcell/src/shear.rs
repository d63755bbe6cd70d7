//! Shear, indentation and torsion told apart.
//!
//! [Matl 2021] calls a motion shear where the displacements' directions spread less than a hand-set threshold (section 5.5). Here
//! all three are fitted at once, `d_i = w(r_i) [t + a (r_i - c)] + w(r_i)^3 b J (r_i - c) + e_i`, where t is shear, a indentation
//! (outward), b torsion (J turns by a right angle). The weight `w = (1 + (|r - c|/s)^4)^(-1/4)` is flat over the contact at c and
//! fades like 1/r, as what is pushed does far away; what is twisted fades like 1/r^3. A part is there
//! where leaving it out makes the misfit worse than chance would: an F test with c and s fitted anew, the three
//! at a common level (Holm's procedure), and where it makes up a share of the motion that the bump, which is no membrane's true
//! shape, could not feign. Nothing moved where the displacements are within the markers' noise (chi-squared).

use nalgebra::{Matrix4, Vector4};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// Why a motion cannot be judged.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MotionError {
    /// Too few markers.
    #[error("{got} markers; expected {expected} or more")]
    TooFew {
        /// Least number.
        expected: usize,
        /// Markers that came.
        got: usize,
    },
    /// A place or a displacement is no number.
    #[error("marker {marker} has a place or a displacement that is no number")]
    NotFinite {
        /// Its index.
        marker: usize,
    },
    /// The markers lie on a line or a point: turning and spreading cannot be told apart.
    #[error("the markers lie within {spread_px:.2e} pixels of a line")]
    OnALine {
        /// Smaller standard deviation of their places, in pixels.
        spread_px: f64,
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

/// A marker's home and its way from there, both (column, row) in pixels (or both in another unit).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moved {
    /// Where it was.
    pub home: [f64; 2],
    /// How far it went.
    pub by: [f64; 2],
}

/// How a motion is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionSettings {
    /// Standard deviation of one displacement along one axis, as still pictures show it, in pixels.
    pub sigma: f64,
    /// Chance of seeing a part that is not there.
    pub level: f64,
    /// Least share of the motion's square that a part has to make up.
    pub share: f64,
}

impl MotionSettings {
    /// Noise as given, one false alarm in a thousand, parts from 4 % of the motion's square on.
    pub fn new(sigma: f64) -> Self {
        Self { sigma, level: 1e-3, share: 0.04 }
    }
}

/// One part of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// How likely chance is to improve the fit as much as this part does.
    pub p_value: f64,
    /// What it makes up of the motion's square.
    pub share: f64,
    /// Whether it is there.
    pub present: bool,
}

/// A motion taken apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Whether anything moved.
    pub moved: bool,
    /// How likely noise alone is to look like this.
    pub p_value: f64,
    /// Displacement of the contact, (column, row), in pixels: mean of the fit over the markers within the reach.
    pub shear: [f64; 2],
    /// Part of it.
    pub shear_part: Part,
    /// Spreading of the contact, relative: above 0 outward.
    pub indentation: f64,
    /// Part of it.
    pub indentation_part: Part,
    /// Turning of the contact in rad, from columns to rows (clockwise in a picture whose rows go down).
    pub torsion_rad: f64,
    /// Part of it.
    pub torsion_part: Part,
    /// Centre of the contact, in pixels.
    pub centre: [f64; 2],
    /// How far from it the motion fades, s, in pixels; infinite where it does not.
    pub reach: f64,
    /// Mean displacement of all markers, in pixels.
    pub mean: [f64; 2],
    /// Root mean square of what is left over, in pixels.
    pub residual: f64,
}

/// Least number of markers: twice as many numbers as the model has.
const LEAST: usize = 7;
/// Rows of the fit that belong to shear (two), indentation and torsion.
const PARTS: [&[usize]; 3] = [&[0, 1], &[2], &[3]];

/// Takes a motion apart.
///
/// # Errors
/// [`MotionError`].
pub fn motion(markers: &[Moved], settings: &MotionSettings) -> Result<Motion, MotionError> {
    check(markers, settings)?;
    let n = markers.len();
    let square: f64 = markers.iter().map(|m| m.by[0].powi(2) + m.by[1].powi(2)).sum();
    let p_value = upper_chi(square / settings.sigma.powi(2), 2 * n);
    let frame = Frame::of(markers)?;
    let full = frame.search(markers, &[true; 4], None);
    let freedom = (2 * n - 7) as f64;
    let variance = (full.misfit / freedom).max(settings.sigma.powi(2));
    let mut parts = [Part { p_value: 1.0, share: 0.0, present: false }; 3];
    for (part, rows) in parts.iter_mut().zip(PARTS) {
        let mut with = [true; 4];
        rows.iter().for_each(|&r| with[r] = false);
        let without = frame.search(markers, &with, Some(&full));
        let f = (without.misfit - full.misfit).max(0.0) / (rows.len() as f64 * variance);
        part.p_value = upper_f(f, rows.len() as f64, freedom);
        part.share = (full.energy(markers, rows) / square.max(f64::MIN_POSITIVE)).min(1.0);
    }
    let moved = p_value < settings.level;
    holm(&mut parts, settings, moved);
    let mean = |k: usize| markers.iter().map(|m| m.by[k]).sum::<f64>() / n as f64;
    let [shear_part, indentation_part, torsion_part] = parts;
    let x = full.over_contact(markers);
    Ok(Motion {
        moved,
        p_value,
        shear: [x[0], x[1]],
        shear_part,
        indentation: x[2],
        indentation_part,
        torsion_rad: x[3],
        torsion_part,
        centre: full.centre,
        reach: full.reach,
        mean: [mean(0), mean(1)],
        residual: (full.misfit / (2 * n) as f64).sqrt(),
    })
}

fn check(markers: &[Moved], settings: &MotionSettings) -> Result<(), MotionError> {
    let got = markers.len();
    if got < LEAST {
        return Err(MotionError::TooFew { expected: LEAST, got });
    }
    let finite = |m: &Moved| m.home.iter().chain(&m.by).all(|x| x.is_finite());
    if let Some(marker) = markers.iter().position(|m| !finite(m)) {
        return Err(MotionError::NotFinite { marker });
    }
    let setting = |what, expected, got, holds| {
        if holds { Ok(()) } else { Err(MotionError::Setting { what, expected, got }) }
    };
    let MotionSettings { sigma, level, share } = *settings;
    setting("the noise", "a finite number above 0", sigma, sigma > 0.0 && sigma.is_finite())?;
    setting("the level", "above 0 and below 1", level, level > 0.0 && level < 1.0)?;
    setting("the share", "0 to 1", share, (0.0..=1.0).contains(&share))
}

/// Holm's step-down over the three parts: the smallest p-value against a third of the level, and so on until one fails.
fn holm(parts: &mut [Part; 3], settings: &MotionSettings, moved: bool) {
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| parts[a].p_value.total_cmp(&parts[b].p_value));
    for (k, &i) in order.iter().enumerate() {
        if !(moved && parts[i].p_value < settings.level / (3 - k) as f64) {
            break;
        }
        parts[i].present = parts[i].share >= settings.share;
    }
}

fn upper_chi(value: f64, freedom: usize) -> f64 {
    ChiSquared::new(freedom as f64).map_or(1.0, |d| d.sf(value))
}

fn upper_f(value: f64, over: f64, under: f64) -> f64 {
    FisherSnedecor::new(over, under).map_or(1.0, |d| d.sf(value))
}

/// Where the markers lie: what the centre and the reach are looked for on.
struct Frame {
    middle: [f64; 2],
    extent: f64,
}

/// A fitted model.
#[derive(Debug, Clone, Copy)]
struct Fitted {
    centre: [f64; 2],
    reach: f64,
    linear: Vector4<f64>,
    misfit: f64,
}

impl Frame {
    fn of(markers: &[Moved]) -> Result<Self, MotionError> {
        let n = markers.len() as f64;
        let mean = |k: usize| markers.iter().map(|m| m.home[k]).sum::<f64>() / n;
        let middle = [mean(0), mean(1)];
        let second = |a: usize, b: usize| {
            markers.iter().map(|m| (m.home[a] - middle[a]) * (m.home[b] - middle[b])).sum::<f64>() / n
        };
        let (uu, uv, vv) = (second(0, 0), second(0, 1), second(1, 1));
        let root = ((uu - vv).powi(2) + 4.0 * uv * uv).sqrt();
        let (large, small) = (0.5 * (uu + vv + root), 0.5 * (uu + vv - root));
        if !(small > 1e-6 * large) {
            return Err(MotionError::OnALine { spread_px: small.max(0.0).sqrt() });
        }
        Ok(Self { middle, extent: (2.0 * large).sqrt() })
    }

    /// Best centre and reach on a lattice, then by a pattern that shrinks; or from another fit's on.
    fn search(&self, markers: &[Moved], with: &[bool; 4], from: Option<&Fitted>) -> Fitted {
        let at = |u: f64, v: f64, s: f64| {
            let centre = [self.middle[0] + u * self.extent, self.middle[1] + v * self.extent];
            Fitted::at(markers, with, centre, s * self.extent, self.extent)
        };
        // Without a fade-out the centre only shifts t against a and b.
        let mut best = at(0.0, 0.0, f64::INFINITY);
        if let Some(f) = from {
            best = best.or(Fitted::at(markers, with, f.centre, f.reach, self.extent));
        }
        for u in -2..=2 {
            for v in -2..=2 {
                for s in [0.3, 0.6, 1.2] {
                    best = best.or(at(0.4 * f64::from(u), 0.4 * f64::from(v), s));
                }
            }
        }
        if best.reach.is_finite() {
            best = self.refine(markers, with, best);
        }
        best
    }

    fn refine(&self, markers: &[Moved], with: &[bool; 4], mut best: Fitted) -> Fitted {
        let mut step = 0.2;
        while step > 2e-3 {
            let before = best.misfit;
            for (du, dv, ds) in [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)] {
                for sign in [-1.0, 1.0] {
                    let by = sign * step * self.extent;
                    let centre = [best.centre[0] + du * by, best.centre[1] + dv * by];
                    let near =
                        (centre[0] - self.middle[0]).hypot(centre[1] - self.middle[1]) <= 1.5 * self.extent;
                    let reach =
                        (best.reach * (sign * step * ds).exp()).clamp(0.15 * self.extent, 8.0 * self.extent);
                    if near {
                        best = best.or(Fitted::at(markers, with, centre, reach, self.extent));
                    }
                }
            }
            if !(best.misfit < before * (1.0 - 1e-6)) {
                step *= 0.5;
            }
        }
        best
    }
}

impl Fitted {
    /// Least squares with the centre and the reach held; the equations are kept in one scale by a length of the markers' extent.
    fn at(markers: &[Moved], with: &[bool; 4], centre: [f64; 2], reach: f64, scale: f64) -> Self {
        let mut gram = Matrix4::zeros();
        let mut right = Vector4::zeros();
        let mut square = 0.0;
        for m in markers {
            let [along, across] = basis(m.home, centre, reach);
            for (row, d) in [(along, m.by[0]), (across, m.by[1])] {
                let row = Vector4::new(row[0], row[1], row[2] / scale, row[3] / scale);
                gram += row * row.transpose();
                right += row * d;
                square += d * d;
            }
        }
        let trace = gram.trace();
        for k in 0..4 {
            if !with[k] {
                gram.fill_row(k, 0.0);
                gram.fill_column(k, 0.0);
                right[k] = 0.0;
            }
            // A part that was left out is zero.
            gram[(k, k)] += 1e-12 * trace + f64::MIN_POSITIVE;
        }
        let solved = gram.cholesky().map_or_else(Vector4::zeros, |c| c.solve(&right));
        let misfit = (square - solved.dot(&right)).max(0.0);
        let linear = Vector4::new(solved[0], solved[1], solved[2] / scale, solved[3] / scale);
        Self { centre, reach, linear, misfit }
    }

    fn or(self, other: Self) -> Self {
        if other.misfit < self.misfit { other } else { self }
    }

    /// The parts as they are on average over the markers within the reach.
    fn over_contact(&self, markers: &[Moved]) -> Vector4<f64> {
        let (mut n, mut sums) = (0.0, [0.0; 2]);
        for m in markers {
            let (x, y) = (m.home[0] - self.centre[0], m.home[1] - self.centre[1]);
            if x.hypot(y) <= self.reach {
                let w = weight(x, y, self.reach);
                (n, sums) = (n + 1.0, [sums[0] + w, sums[1] + w.powi(3)]);
            }
        }
        // No marker so near: the middle's values.
        let [w, turn] = if n > 0.0 { sums.map(|s| s / n) } else { [1.0; 2] };
        self.linear.component_mul(&Vector4::new(w, w, w, turn))
    }

    /// Square of what some rows of the fit move, over all markers.
    fn energy(&self, markers: &[Moved], rows: &[usize]) -> f64 {
        let of = |m: &Moved| {
            let part = |b: Vector4<f64>| rows.iter().map(|&r| b[r] * self.linear[r]).sum::<f64>().powi(2);
            let [along, across] = basis(m.home, self.centre, self.reach);
            part(along) + part(across)
        };
        markers.iter().map(of).sum()
    }
}

/// What t, a and b move along columns and along rows at a place.
fn basis(home: [f64; 2], centre: [f64; 2], reach: f64) -> [Vector4<f64>; 2] {
    let (x, y) = (home[0] - centre[0], home[1] - centre[1]);
    let w = weight(x, y, reach);
    let turn = w * w * w;
    [Vector4::new(w, 0.0, w * x, -turn * y), Vector4::new(0.0, w, w * y, turn * x)]
}

fn weight(x: f64, y: f64, reach: f64) -> f64 {
    let square = (x * x + y * y) / (reach * reach);
    (1.0 + square * square).sqrt().sqrt().recip()
}
