//! Dough rolled by an elastic band, in small steps: a spherocylinder of constant volume whose cross-section is an ellipse, elastic
//! where the band touches it (a line contact after Hertz), flowing above a yield stress with a power of the excess (Herschel and Bulkley).

use std::f64::consts::{FRAC_PI_4, PI};

/// The band: its force at a throw and a depth is `(k0 + k1 (throw - throw0)) depth (1 + k2 depth)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Stiffness at `throw0_m`, N/m.
    pub k0_n_m: f64,
    /// Change of the stiffness with the throw, N/m^2.
    pub k1_n_m2: f64,
    /// Throw at which the stiffness is `k0_n_m`, m.
    pub throw0_m: f64,
    /// Relative rise of the stiffness with the depth, 1/m.
    pub k2_per_m: f64,
}

impl Band {
    /// Force in N at a throw and a depth in m.
    pub fn force_n(&self, [throw_m, depth_m]: [f64; 2]) -> f64 {
        let stiffness = self.k0_n_m + self.k1_n_m2 * (throw_m - self.throw0_m);
        stiffness * depth_m * (1.0 + self.k2_per_m * depth_m)
    }
}

/// Everything that may have changed since the training rolls; all zero is nothing. A response is the strain of a roll over the usual one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effects {
    /// Relative change of every response.
    pub response: f64,
    /// Rate at which the response fades with the time since the dough was made, 1/s.
    pub drying_per_s: f64,
    /// Force below which the band slips and nothing is deformed, N.
    pub slip_n: f64,
    /// Fraction of a strain that is undone before the next roll.
    pub springback: f64,
    /// Fraction of the volume that each roll leaves on the tool.
    pub loss: f64,
    /// Rate at which the response fades with the rolls of a run.
    pub softening_per_roll: f64,
    /// Unlisted: relative change of the response, up at even rolls and down at odd ones.
    pub alternation: f64,
    /// Unlisted: relative change of the response by the throw beyond 80 mm, 1/m.
    pub throw_per_m: f64,
    /// Unlisted: the response falls beyond a length.
    pub long: Long,
    /// Unlisted: a dough that was just worked is harder: relative change for each tenth of strain in the roll before.
    pub worked: f64,
}

/// A response that falls beyond a length, exponentially in the relative length.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Long {
    /// Its fall by relative length; 0 for none.
    pub fall: f64,
    /// The length in m.
    pub from_m: f64,
}

/// Size and shape of a piece of dough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Its volume in m^3.
    pub volume_m3: f64,
    /// Its length in m.
    pub length_m: f64,
    /// Half the logarithm of width over height.
    pub oval: f64,
}

impl Shape {
    /// Mean diameter in m: `V = pi/4 d^2 (l - d/3)`.
    fn diameter_m(&self) -> f64 {
        let l = self.length_m;
        let mut d = (self.volume_m3 / l).sqrt();
        for _ in 0..8 {
            let off = FRAC_PI_4 * d * d * (l - d / 3.0) - self.volume_m3;
            d -= off / (FRAC_PI_4 * d * (2.0 * l - d)).max(1e-12);
            d = d.clamp(1e-4, l);
        }
        d
    }

    /// This dough with a part of the strain, and of the change of the cross-section, that lead to another's shape.
    fn towards(&self, other: &Self, part: f64) -> Self {
        Self {
            length_m: self.length_m.powf(1.0 - part) * other.length_m.powf(part),
            oval: (1.0 - part) * self.oval + part * other.oval,
            ..*self
        }
    }

    /// Length, width and height in m.
    pub fn dimensions_m(&self) -> [f64; 3] {
        let d = self.diameter_m();
        [self.length_m, d * self.oval.exp(), d * (-self.oval).exp()]
    }
}

/// A dough and the rolls that are made of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Size and shape before the first roll.
    pub fresh: Shape,
    /// The response of this dough over that of the others.
    pub softness: f64,
    /// Rolls, in order.
    pub rolls: Vec<PlannedRoll>,
}

/// A roll before it is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedRoll {
    /// Position of throw and depth between the bounds that the dough's width and height give them, in [0, 1].
    pub setting: [f64; 2],
    /// Time since the dough was made, s.
    pub t_s: f64,
    /// The response to this roll over the one that the laws give.
    pub scatter: f64,
}

/// A roll that was made, dimensions in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roll {
    /// Length, width and height before the roll.
    pub before: [f64; 3],
    /// Throw and depth in m.
    pub action: [f64; 2],
    /// Length, width and height after the roll.
    pub after: [f64; 3],
    /// Length, width and height after the roll had nothing changed since the training.
    pub unchanged: [f64; 3],
    /// Time since the dough was made, s.
    pub t_s: f64,
}

/// A table with a band, and doughs from one bowl.
#[derive(Debug, Clone, PartialEq)]
pub struct DoughWorld {
    /// The band.
    pub band: Band,
    /// Breadth of the band in m.
    pub breadth_m: f64,
    /// Modulus of the dough under a short load, Pa.
    pub elastic_pa: f64,
    /// Stress below which the dough does not flow, Pa.
    pub yield_pa: f64,
    /// Strain rate at [`EXCESS_PA`] above the yield stress, 1/s.
    pub rate_per_s: f64,
    /// Exponent of the strain rate in the excess of stress.
    pub exponent: f64,
    /// Rise of `oval` with the logarithm of the length.
    pub flattening: f64,
    /// The doughs.
    pub pieces: Vec<Piece>,
    /// The effects at work.
    pub effects: Effects,
}

/// Excess of stress at which a strain rate is stated, Pa.
pub const EXCESS_PA: f64 = 3e3;
/// Travel of the band over a dough, there and back, in m, and its speed in m/s.
const TRAVEL_M: f64 = 0.2;
const SPEED_M_S: f64 = 0.1;
const STEPS: usize = 24;
/// Throws of the gripper, and the smallest depth, m.
const THROWS_M: [f64; 2] = [0.02, 0.12];
const LEAST_DEPTH_M: f64 = 5e-3;

impl DoughWorld {
    /// All rolls of all doughs.
    pub fn rolled(&self) -> Vec<Vec<Roll>> {
        self.pieces.iter().map(|p| self.roll_all(p)).collect()
    }

    fn roll_all(&self, piece: &Piece) -> Vec<Roll> {
        let mut lying = piece.fresh;
        let mut strain_before = 0.0;
        let mut made = Vec::with_capacity(piece.rolls.len());
        for (step, roll) in piece.rolls.iter().enumerate() {
            let action = within(&lying.dimensions_m(), roll.setting);
            let unchanged = self.flow(&lying, action, piece.softness * roll.scatter);
            let response = self.response(step, roll.t_s, action, lying.length_m, strain_before);
            let mut after = lying.towards(&unchanged, response);
            strain_before = (after.length_m / lying.length_m).ln();
            // Each dimension of what is left is smaller alike; what springs back is its strain, and not what was lost.
            let mut unstrained = lying;
            for dough in [&mut after, &mut unstrained] {
                dough.volume_m3 *= 1.0 - self.effects.loss;
                dough.length_m *= (1.0 - self.effects.loss).cbrt();
            }
            made.push(Roll {
                before: lying.dimensions_m(),
                action,
                after: after.dimensions_m(),
                unchanged: unchanged.dimensions_m(),
                t_s: roll.t_s,
            });
            lying = after.towards(&unstrained, self.effects.springback);
        }
        made
    }

    /// The response over the one without effects.
    fn response(&self, step: usize, t_s: f64, action: [f64; 2], length_m: f64, strain_before: f64) -> f64 {
        let e = &self.effects;
        if self.band.force_n(action) < e.slip_n {
            return 0.0;
        }
        let faded = (-e.drying_per_s * t_s - e.softening_per_roll * step as f64).exp();
        let even = if step % 2 == 1 { 1.0 } else { -1.0 };
        let Long { fall, from_m } = e.long;
        let beyond = if fall == 0.0 { 0.0 } else { fall * (length_m / from_m - 1.0).max(0.0) };
        let worked = 1.0 / (1.0 + e.worked * strain_before / 0.1);
        let law = (1.0 + e.alternation * even) * (1.0 + e.throw_per_m * (action[0] - 0.08)) * (-beyond).exp();
        (1.0 + e.response) * faded * worked * law
    }

    /// The dough after a roll without effects, for one whose response is this many times that of the others.
    fn flow(&self, lying: &Shape, action: [f64; 2], softness: f64) -> Shape {
        let mut now = *lying;
        // The band follows the dough down.
        let force = self.band.force_n(action);
        for _ in 0..STEPS {
            let [length, width, height] = now.dimensions_m();
            let touched = length.min(self.breadth_m);
            let line_n_m = force / touched;
            let curvature_m = width * width / (2.0 * height);
            let half = (4.0 * line_n_m * curvature_m / (PI * self.elastic_pa)).sqrt().min(0.5 * width);
            let pressure = line_n_m / (2.0 * half + 1e-9);
            // Some of a dough yields before the rest.
            let excess = pressure - self.yield_pa;
            let excess = 0.5 * (excess + excess.hypot(0.2 * self.yield_pa));
            // What is squeezed flows along the dough as the way is short.
            let along = 2.0 * half / (2.0 * half + self.breadth_m);
            let rate = self.rate_per_s * (excess / EXCESS_PA).powf(self.exponent);
            let strain = softness * along * touched / length * rate * (TRAVEL_M / SPEED_M_S / STEPS as f64);
            now.oval += (self.flattening - 0.2 * now.oval) * strain;
            now.length_m *= strain.exp();
        }
        now
    }
}

/// Throw and depth at a position between the bounds: a band at least as long as the dough is wide, pressed no deeper than it is high.
fn within(dimensions_m: &[f64; 3], setting: [f64; 2]) -> [f64; 2] {
    let shortest = dimensions_m[1].clamp(THROWS_M[0], THROWS_M[1]);
    let deepest = dimensions_m[2].max(LEAST_DEPTH_M);
    // A gripper's command is given to a tenth of a millimetre.
    let command = |low: f64, high: f64, u: f64| ((low + u * (high - low)) * 1e4).round() * 1e-4;
    [command(shortest, THROWS_M[1], setting[0]), command(LEAST_DEPTH_M, deepest, setting[1])]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world(effects: Effects) -> DoughWorld {
        let fresh = Shape { volume_m3: 4e-5, length_m: 0.044, oval: 0.01 };
        let roll = |i: u32| PlannedRoll {
            setting: [0.5 + 0.4 * f64::from(i).sin(), 0.4 + 0.3 * f64::from(3 * i).cos()],
            t_s: 7.0 * f64::from(i),
            scatter: 1.0,
        };
        DoughWorld {
            band: Band { k0_n_m: 60.0, k1_n_m2: 900.0, throw0_m: 0.04, k2_per_m: 8.0 },
            breadth_m: 0.04,
            elastic_pa: 3e4,
            yield_pa: 400.0,
            rate_per_s: 0.1,
            exponent: 2.0,
            flattening: 0.12,
            pieces: vec![Piece { fresh, softness: 1.0, rolls: (0..40).map(roll).collect() }],
            effects,
        }
    }

    fn lengths(effects: Effects) -> Vec<f64> {
        world(effects).rolled()[0].iter().map(|m| m.after[0]).collect()
    }

    /// A ball has the volume of a ball, a long roll nearly that of a cylinder.
    #[test]
    fn a_shape_has_its_volume() {
        let ball = Shape { volume_m3: PI / 6.0 * 0.04f64.powi(3), length_m: 0.04, oval: 0.0 };
        ball.dimensions_m().iter().for_each(|d| approx::assert_relative_eq!(*d, 0.04, max_relative = 1e-3));
        let long = Shape { volume_m3: 1e-4, length_m: 0.2, oval: 0.1 };
        let [l, w, h] = long.dimensions_m();
        let d = (w * h).sqrt();
        approx::assert_relative_eq!(FRAC_PI_4 * d * d * (l - d / 3.0), 1e-4, max_relative = 1e-9);
        approx::assert_relative_eq!(w / h, 0.2f64.exp(), max_relative = 1e-12);
    }

    /// From a ball of 4 cm to some three times its length in forty rolls, each longer, thinner and lower.
    #[test]
    fn a_ball_becomes_a_roll() {
        let made = &world(Effects::default()).rolled()[0];
        let end = made[39].after[0];
        assert!((0.09..0.2).contains(&end), "{end}");
        for pair in made.windows(2) {
            assert_eq!(pair[0].after, pair[1].before);
            assert_eq!(pair[0].after, pair[0].unchanged);
            assert!(pair[1].after[0] > pair[0].after[0] && pair[1].after[2] < pair[0].after[2]);
        }
        assert!(made[0].after[0] - made[0].before[0] < 0.02);
    }

    #[test]
    fn deeper_and_wider_rolls_do_more() {
        let w = world(Effects::default());
        let fresh = w.pieces[0].fresh;
        let length = |action| w.flow(&fresh, action, 1.0).length_m;
        assert!(length([0.08, 0.02]) > length([0.08, 0.01]) && length([0.1, 0.02]) > length([0.08, 0.02]));
        // Half the response twice over is the response.
        let half = w.flow(&fresh, [0.08, 0.02], 0.5);
        approx::assert_relative_eq!(
            w.flow(&half, [0.08, 0.02], 0.5).length_m,
            length([0.08, 0.02]),
            max_relative = 1e-4
        );
    }

    #[test]
    fn every_effect_does_what_it_says() {
        let baseline = lengths(Effects::default());
        let none = Effects::default();
        assert!(lengths(Effects { response: 0.3, ..none })[39] > baseline[39] * 1.03);
        for m in &world(Effects { response: -0.5, ..none }).rolled()[0] {
            let strain = |to: &[f64; 3]| (to[0] / m.before[0]).ln();
            approx::assert_relative_eq!(strain(&m.after), 0.5 * strain(&m.unchanged), max_relative = 1e-9);
        }
        assert!(lengths(Effects { drying_per_s: 2e-3, ..none })[39] < baseline[39] * 0.99);
        assert!(lengths(Effects { softening_per_roll: 0.02, ..none })[39] < baseline[39] * 0.99);
        let stuck = world(Effects { slip_n: 1e3, ..none }).rolled();
        assert!(stuck[0].iter().all(|m| m.after == m.before));
        let springs = &world(Effects { springback: 0.25, ..none }).rolled()[0];
        for pair in springs.windows(2) {
            let [x0, x1, x2] = [pair[0].before[0], pair[0].after[0], pair[1].before[0]];
            approx::assert_relative_eq!((x1 / x2).ln(), 0.25 * (x1 / x0).ln(), max_relative = 1e-9);
        }
        let volume = |m: &[f64; 3]| m.iter().product::<f64>();
        let sticks = &world(Effects { loss: 0.02, ..none }).rolled()[0];
        for m in sticks {
            approx::assert_relative_eq!(volume(&m.after) / volume(&m.unchanged), 0.98, max_relative = 1e-9);
        }
        // What is lost without a strain does not spring back.
        let idle = Effects { loss: 0.02, slip_n: 1e3, springback: 0.4, ..none };
        for pair in world(idle).rolled()[0].windows(2) {
            for k in 0..3 {
                approx::assert_relative_eq!(pair[1].before[k], pair[0].after[k], max_relative = 1e-9);
            }
        }
    }

    /// What is on nobody's list acts where and when it is said to.
    #[test]
    fn unlisted_effects_act_where_they_should() {
        let none = Effects::default();
        let strain = |m: &Roll, to: &[f64; 3]| (to[0] / m.before[0]).ln();
        let parts = |effects| -> Vec<f64> {
            world(effects).rolled()[0].iter().map(|m| strain(m, &m.after) / strain(m, &m.unchanged)).collect()
        };
        for (i, part) in parts(Effects { alternation: 0.2, ..none }).iter().enumerate() {
            let expected = if i % 2 == 1 { 1.2 } else { 0.8 };
            approx::assert_relative_eq!(*part, expected, max_relative = 0.02);
        }
        let effects = Effects { long: Long { fall: 0.8, from_m: 0.07 }, ..none };
        for m in &world(effects).rolled()[0] {
            let part = strain(m, &m.after) / strain(m, &m.unchanged);
            assert_eq!(part < 0.999, m.before[0] > 0.0702, "{part} at {}", m.before[0]);
        }
        let worked = parts(Effects { worked: 0.5, ..none });
        assert!((worked[0] - 1.0).abs() < 1e-12 && worked[1..].iter().all(|p| *p < 0.999));
        for m in &world(Effects { throw_per_m: 5.0, ..none }).rolled()[0] {
            let part = strain(m, &m.after) / strain(m, &m.unchanged);
            assert!((part > 1.0) == (m.action[0] > 0.08), "{part} at {}", m.action[0]);
        }
    }
}
