//! A ball that is dropped on a tilted table and is to bounce into a cup: how often it does ([Matl 2021], section 4.4, figure 4.6).
//!
//! The ball is in the cup when its centre comes down through the rim's circle, the ball's radius within it. What it does on the rim or
//! against the cup's side is left out: a ball that touches either has missed.

use crate::drop::{Ball, DropError, DropModel, Moving, Release, Table, Vector, each, value};
use rand::Rng;

/// Impacts on the table that are followed.
const MOST: usize = 12;

/// A cup that stands upright.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cup {
    /// Where its middle is seen from above, m.
    pub centre_m: [f64; 2],
    /// Height of its rim, m.
    pub rim_z_m: f64,
    /// Radius of its opening, m.
    pub radius_m: f64,
}

/// A tilted table and a cup; the origin is the table's middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scene {
    model: DropModel,
    half_m: f64,
    cup: Cup,
    ball_radius_m: f64,
    downhill: Vector,
    across: Vector,
}

impl Scene {
    /// A square table with half its edge (m), a ball of a radius (m) on it, and a cup.
    ///
    /// # Errors
    /// [`DropError::Value`] for sizes that are not above zero, or a ball that is too large for the cup.
    pub fn new(model: DropModel, half_m: f64, cup: Cup, ball_radius_m: f64) -> Result<Self, DropError> {
        for (what, v) in [("half_m", half_m), ("ball_radius_m", ball_radius_m)] {
            value(what, v, "a finite number above 0", v > 0.0 && v.is_finite())?;
        }
        let opening = cup.radius_m;
        value(
            "the cup's radius",
            opening,
            "more than the ball's",
            opening > ball_radius_m && opening.is_finite(),
        )?;
        let coordinates = [cup.centre_m[0], cup.centre_m[1], cup.rim_z_m];
        for v in coordinates {
            value("the cup's place", v, "a finite number", v.is_finite())?;
        }
        let n = *model.table().normal();
        let steep = n[0].hypot(n[1]);
        let [ahead, side] = if steep > 0.0 { [n[0] / steep, n[1] / steep] } else { [1.0, 0.0] };
        let downhill = [n[2] * ahead, n[2] * side, -steep];
        Ok(Self { model, half_m, cup, ball_radius_m, downhill, across: [-side, ahead, 0.0] })
    }

    /// The scene of [Matl 2021], section 4.4: a table of 0.55 m that falls by 10.72 degrees towards x, a cup 8.6 inches from its lower edge, which is on the
    /// floor. The cup's own size is not given there: 12 cm high, 9 cm wide.
    ///
    /// # Errors
    /// [`DropError::Value`] for a ball out of range.
    pub fn thesis(ball: Ball, ball_radius_m: f64) -> Result<Self, DropError> {
        let (tilt, half) = (10.72f64.to_radians(), 0.275);
        let model = DropModel::new(ball, Table::tilted(tilt, 0.0)?, 9.80665)?;
        let (edge, floor) = (half * tilt.cos(), -half * tilt.sin());
        let cup = Cup { centre_m: [edge + 8.6 * 0.0254, 0.0], rim_z_m: floor + 0.12, radius_m: 0.045 };
        Self::new(model, half, cup, ball_radius_m)
    }

    /// Ball, table and gravity.
    pub fn model(&self) -> &DropModel {
        &self.model
    }

    /// The cup.
    pub fn cup(&self) -> &Cup {
        &self.cup
    }

    /// Whether a ball that is let go so falls into the cup.
    pub fn falls_in<R: Rng + ?Sized>(&self, start: &Moving, rng: &mut R) -> bool {
        let mut ball = *start;
        for _ in 0..MOST {
            let Ok(landed) = self.model.landing(&ball) else { return false };
            if let Some(inside) = self.through_rim(&ball, landed.t_s - ball.t_s) {
                return inside;
            }
            if !self.is_on_table(&landed.position_m) {
                return false;
            }
            ball = self.model.bounce(&landed, rng);
        }
        false
    }

    /// Whether the ball comes down through the rim within the cup, if it comes down to the rim beside the table before it would land.
    fn through_rim(&self, ball: &Moving, lands_s: f64) -> Option<bool> {
        let normal = self.model.table().normal();
        let lifted: Vector = std::array::from_fn(|i| ball.position_m[i] + self.ball_radius_m * normal[i]);
        let (g, up, above) = (self.model.gravity_m_s2(), ball.velocity_m_s[2], lifted[2] - self.cup.rim_z_m);
        let square = up * up + 2.0 * g * above;
        let t = (up + square.max(0.0).sqrt()) / g;
        if !(square >= 0.0 && t > 0.0 && t < lands_s) {
            return None;
        }
        let at = [0, 1].map(|i| lifted[i] + ball.velocity_m_s[i] * t);
        let off = (at[0] - self.cup.centre_m[0]).hypot(at[1] - self.cup.centre_m[1]);
        // Over the table the rim's height means nothing.
        if self.is_on_table(&[at[0], at[1], self.cup.rim_z_m]) && off > self.cup.radius_m {
            return None;
        }
        Some(off <= self.cup.radius_m - self.ball_radius_m)
    }

    /// Whether a place is above or on the table, along its normal.
    fn is_on_table(&self, place_m: &Vector) -> bool {
        let along = |unit: &Vector| (0..3).map(|i| unit[i] * place_m[i]).sum::<f64>();
        along(&self.downhill).abs() <= self.half_m && along(&self.across).abs() <= self.half_m
    }

    /// How many of `count` balls fall in, each with its own chance. Same seed, same number, on any number of threads.
    pub fn successes(&self, release: &Release, count: usize, seed: u64) -> usize {
        each(count, seed, |_, rng| usize::from(self.falls_in(&release.draw(rng), rng))).into_iter().sum()
    }

    /// The share of `count` balls that falls in, for each of many releases: the map of [Matl 2021], figure 4.6.
    pub fn map(&self, releases: &[Release], count: usize, seed: u64) -> Vec<f64> {
        let one = |i: usize, rng: &mut _| {
            releases.get(i / count.max(1)).is_some_and(|release| self.falls_in(&release.draw(rng), rng))
        };
        let fell = each(releases.len() * count, seed, one);
        fell.chunks(count.max(1)).map(|c| c.iter().filter(|f| **f).count() as f64 / c.len() as f64).collect()
    }
}
