//! What the statistics of a picture are a sum of.

use crate::campaign::{Conditions, Ranges};
use crate::dem::Coefficients;
use crate::statistics::{STATISTICS, Symmetry};

/// Blur variance (px^2) at which half of its effect is there.
const HALF_BLUR: f64 = 1.0;
/// Work of adhesion (J/m2) likewise.
const HALF_ADHESION: f64 = 0.05;
/// Rolling damping likewise.
const HALF_DAMPING: f64 = 0.1;
/// Friction, rolling friction, restitution, height.
const BASE: usize = 4;
const EFFECTS: usize = 8;
/// Highest degree in the four: alone, beside an effect, and of what turns with the tilt.
const ALONE: usize = 5;
const BESIDE: usize = 2;
const TURNING: usize = 3;

/// Values of the terms, and the degree of each.
#[derive(Debug, Clone, Default)]
pub(super) struct Terms {
    pub(super) values: Vec<f64>,
    pub(super) degrees: Vec<u8>,
}

impl Terms {
    fn add(&mut self, value: f64, degree: usize) {
        self.values.push(value);
        self.degrees.push(degree as u8);
    }

    /// All of `others` times a factor, their degrees raised.
    fn add_times(&mut self, others: &Terms, factor: f64, raised: usize) {
        for (value, degree) in others.values.iter().zip(&others.degrees) {
            self.add(factor * value, raised + usize::from(*degree));
        }
    }
}

/// Conditions on the scale of their ranges.
pub(super) struct Scaled {
    /// Friction, rolling friction, restitution and height, -1 to 1.
    base: [f64; BASE],
    /// Effects, about 0 to 1 (or -1 to 1): adhesion, ground, variance of sizes, square of the tilt, drag, blur, length, damping of
    /// rolling.
    effects: [f64; EFFECTS],
    tilt: [f64; 2],
    /// s^2 / (1 + s^2), s the slope over the rolling friction.
    rolling: f64,
}

impl Scaled {
    pub(super) fn new(ranges: &Ranges, c: &Conditions, blur_px2: f64) -> Self {
        let line = |[a, b]: [f64; 2], v: f64| 2.0 * (v - a) / (b - a) - 1.0;
        let log = |[a, b]: [f64; 2], v: f64| line([a.ln(), b.ln()], v.max(1e-9).ln());
        let tilt = c.tilt_rad.map(|t| t / ranges.tilt_rad);
        let w = c.work_of_adhesion_j_m2;
        let slope = c.tilt_rad[0].hypot(c.tilt_rad[1]);
        let damped = |eta: f64| eta / (eta + HALF_DAMPING);
        Self {
            base: [
                log(ranges.sliding_friction, c.sliding_friction),
                log(ranges.rolling_friction, c.rolling_friction),
                line(ranges.restitution, c.restitution),
                log(ranges.height_m, c.height_m),
            ],
            effects: [
                w / (w + HALF_ADHESION),
                c.ground_ratio.max(1e-9).ln() / ranges.ground_ratio.ln(),
                (c.size_variation / ranges.size_variation).powi(2),
                tilt[0] * tilt[0] + tilt[1] * tilt[1],
                c.drag_per_m / ranges.drag_per_m,
                blur_px2 / (blur_px2 + HALF_BLUR),
                (c.aspect_ratio - 1.0) / (ranges.aspect_ratio - 1.0),
                damped(c.rolling_damping) - damped(Coefficients::ROLLING_DAMPING),
            ],
            tilt,
            rolling: slope * slope / (slope * slope + c.rolling_friction.powi(2)).max(1e-12),
        }
    }

    /// Products of Legendre polynomials of the four, up to a degree in all.
    fn products(&self, most: usize) -> Terms {
        // sqrt(2 n + 1) P_n: of mean square one over the range.
        let tables: [[f64; ALONE + 1]; BASE] = self.base.map(|x| {
            let square = x * x;
            [
                1.0,
                3f64.sqrt() * x,
                5f64.sqrt() * (1.5 * square - 0.5),
                7f64.sqrt() * x * (2.5 * square - 1.5),
                3.0 * (square * (4.375 * square - 3.75) + 0.375),
                11f64.sqrt() * x * (square * (7.875 * square - 8.75) + 1.875),
            ]
        });
        let mut terms = Terms::default();
        for i in 0..=most {
            for j in 0..=most - i {
                for k in 0..=most - i - j {
                    for l in 0..=most - i - j - k {
                        let value = tables[0][i] * tables[1][j] * tables[2][k] * tables[3][l];
                        terms.add(value, i + j + k + l);
                    }
                }
            }
        }
        terms
    }

    /// Products of the four; effects, their powers and products, beside products of the four.
    pub(super) fn scalar(&self) -> Terms {
        let mut terms = self.products(ALONE);
        let [beside, line] = [BESIDE, 1].map(|degree| self.products(degree));
        for (at, e) in self.effects.iter().enumerate() {
            terms.add_times(&beside, *e, 1);
            terms.add_times(&line, e * e, 2);
            terms.add(e * e * e, 3);
            for other in &self.effects[at + 1..] {
                terms.add(e * other, 2);
            }
        }
        terms
    }

    /// The terms of a statistic.
    pub(super) fn of(&self, statistic: usize) -> Terms {
        let [x, y] = self.tilt;
        let kind = STATISTICS[statistic].1;
        let first = if kind == Symmetry::Second { STATISTICS[statistic - 1].1 } else { kind };
        match (first, kind) {
            (Symmetry::Vector, Symmetry::Second) => self.turning(y),
            (Symmetry::Vector, _) => self.turning(x),
            (Symmetry::Tensor, Symmetry::Second) => self.turning(2.0 * x * y),
            (Symmetry::Tensor, _) => self.turning(x * x - y * y),
            _ => self.scalar(),
        }
    }

    /// What turns with the scene as `part` does.
    fn turning(&self, part: f64) -> Terms {
        let mut terms = Terms::default();
        terms.add_times(&self.products(TURNING), part, 0);
        // The square of the tilt is among the effects.
        for (at, e) in self.effects.iter().enumerate() {
            if at != 3 {
                terms.add(part * e, 1);
            }
        }
        let line = self.products(1);
        terms.add_times(&line, part * self.effects[3], 1);
        // Grains that lie alone roll away where the slope exceeds their rolling friction.
        terms.add_times(&line, part * self.rolling, 0);
        terms
    }

    /// What the log variance depends on.
    pub(super) fn spread(&self) -> Vec<f64> {
        let mut row = vec![1.0];
        row.extend(self.base);
        row.extend(self.base.map(|b| b * b));
        row.extend(self.effects);
        row.extend(self.effects.map(|e| e * e));
        for (i, b) in self.base.iter().enumerate() {
            row.extend(self.base[i + 1..].iter().map(|other| b * other));
            row.extend(self.effects.map(|e| b * e));
        }
        row
    }
}
