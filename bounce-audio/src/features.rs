//! The features of a drop that its posterior is made from: `X = [t2/t1, d1, d2, alpha]` of the first three impacts ([Matl 2021], appendix B.1).

use crate::drop::Bounce;
use thiserror::Error;

/// Distance below which the logarithm of one is cut, m: less than any microphone tells.
const LEAST_DISTANCE_M: f64 = 1e-5;

/// Why impacts have no features.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum FeatureError {
    /// Fewer impacts than two flights need.
    #[error("{got} impacts, expected at least {expected}")]
    TooFew {
        /// Least number.
        expected: usize,
        /// Number of impacts.
        got: usize,
    },
    /// An impact is not after the one before, or is no number.
    #[error("impact {impact}: {what} is {got}, expected {expected}")]
    Value {
        /// The impact, from 0.
        impact: usize,
        /// Which of its numbers.
        what: &'static str,
        /// What is taken.
        expected: &'static str,
        /// Its value.
        got: f64,
    },
}

/// Features of a drop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Features {
    /// Duration of the second flight over that of the first.
    pub time_ratio: f64,
    /// From the first impact to the second, m, along the table.
    pub d1_m: f64,
    /// From the second impact to the third, m.
    pub d2_m: f64,
    /// Angle by which the ball turned at the second impact, seen from above, in (-pi, pi], left is positive; 0 where it did not move.
    pub alpha_rad: f64,
}

/// Which of the features are looked at ([Matl 2021], figure 4.5).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Observed {
    /// `t2/t1` alone.
    Time,
    /// `d1, d2, alpha` alone.
    Position,
    /// All four.
    Both,
}

/// How distances are put to a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// In metres, as in [Matl 2021].
    Metres,
    /// As natural logarithms (of 10 um at least), with alpha's magnitude as one too: concentrations over four decades move
    /// distances over two, and in metres the small ones are all alike.
    Logarithms,
}

impl Features {
    /// From the first three impacts; heights are not looked at.
    ///
    /// # Errors
    /// [`FeatureError`].
    pub fn of(impacts: &[Bounce]) -> Result<Self, FeatureError> {
        let &[a, b, c, ..] = impacts else {
            return Err(FeatureError::TooFew { expected: 3, got: impacts.len() });
        };
        for (impact, one) in [a, b, c].iter().enumerate() {
            let expected = "a finite number";
            for (what, got) in [("t_s", one.t_s), ("x_m", one.position_m[0]), ("y_m", one.position_m[1])] {
                if !got.is_finite() {
                    return Err(FeatureError::Value { impact, what, expected, got });
                }
            }
        }
        let (t1, t2) = (b.t_s - a.t_s, c.t_s - b.t_s);
        for (impact, t, got) in [(1, t1, b.t_s), (2, t2, c.t_s)] {
            if !(t > 0.0) {
                let expected = "a time after the impact before";
                return Err(FeatureError::Value { impact, what: "t_s", expected, got });
            }
        }
        let hop = |from: &Bounce, to: &Bounce| {
            [to.position_m[0] - from.position_m[0], to.position_m[1] - from.position_m[1]]
        };
        let (p, q) = (hop(&a, &b), hop(&b, &c));
        Ok(Self {
            time_ratio: t2 / t1,
            d1_m: p[0].hypot(p[1]),
            d2_m: q[0].hypot(q[1]),
            alpha_rad: (p[0] * q[1] - p[1] * q[0]).atan2(p[0] * q[0] + p[1] * q[1]),
        })
    }

    /// The numbers that are put to a density.
    pub fn numbers(&self, observed: Observed, scale: Scale) -> Vec<f64> {
        let distance = |d: f64| match scale {
            Scale::Metres => d,
            Scale::Logarithms => d.max(LEAST_DISTANCE_M).ln(),
        };
        let time = self.time_ratio;
        let mut numbers = Vec::with_capacity(5);
        if observed != Observed::Position {
            numbers.push(time);
        }
        if observed != Observed::Time {
            numbers.extend([distance(self.d1_m), distance(self.d2_m), self.alpha_rad]);
            if scale == Scale::Logarithms {
                numbers.push(self.alpha_rad.abs().max(1e-4).ln());
            }
        }
        numbers
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    fn at(t_s: f64, x: f64, y: f64) -> Bounce {
        Bounce { t_s, position_m: [x, y, 0.0] }
    }

    #[test]
    fn a_ball_that_turns_left_has_a_positive_angle() {
        let x = Features::of(&[at(1.0, 0.0, 0.0), at(1.4, 0.3, 0.0), at(1.7, 0.3, 0.1), at(9.0, 9.0, 9.0)]);
        let x = x.unwrap();
        approx::assert_relative_eq!(x.time_ratio, 0.75, max_relative = 1e-12);
        approx::assert_relative_eq!(x.d1_m, 0.3);
        approx::assert_relative_eq!(x.d2_m, 0.1);
        approx::assert_relative_eq!(x.alpha_rad, std::f64::consts::FRAC_PI_2);
        assert_eq!(x.numbers(Observed::Both, Scale::Metres), [x.time_ratio, x.d1_m, x.d2_m, x.alpha_rad]);
        assert_eq!(x.numbers(Observed::Time, Scale::Metres), [x.time_ratio]);
        assert_eq!(x.numbers(Observed::Position, Scale::Logarithms)[0], 0.3f64.ln());
    }

    #[test]
    fn straight_up_and_nonsense() {
        let still = Features::of(&[at(0.0, 0.0, 0.0), at(0.4, 0.0, 0.0), at(0.7, 0.0, 0.0)]).unwrap();
        assert_eq!((still.d1_m, still.d2_m, still.alpha_rad), (0.0, 0.0, 0.0));
        assert!(still.numbers(Observed::Both, Scale::Logarithms).iter().all(|v| v.is_finite()));
        assert_eq!(Features::of(&[at(0.0, 0.0, 0.0)]), Err(FeatureError::TooFew { expected: 3, got: 1 }));
        let back = Features::of(&[at(0.0, 0.0, 0.0), at(0.4, 0.0, 0.0), at(0.4, 0.0, 0.0)]);
        assert!(matches!(back, Err(FeatureError::Value { impact: 2, what: "t_s", .. })), "{back:?}");
        let nan = Features::of(&[at(0.0, 0.0, 0.0), at(0.4, f64::NAN, 0.0), at(0.5, 0.0, 0.0)]);
        assert!(matches!(nan, Err(FeatureError::Value { impact: 1, what: "x_m", .. })), "{nan:?}");
    }
}
