//! Dough rolled by an elastic band, in small steps: a spherocylinder of constant volume whose cross-section is an ellipse, elastic
//! where the band touches it (a line contact after Hertz), flowing above a yield stress with a power of the excess (Herschel and Bulkley).

use std::f64::consts::{FRAC_PI_4, PI};

/// The band: its force at a throw and a depth is `(k0 + k1 (throw - throw0)) depth (1 + k2 depth)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic {
    /// In N/m.
    pub k0_n_m: f64,
    /// In N/m^2.
    pub k1_n_m2: f64,
    /// In m.
    pub throw0_m: f64,
    /// In 1/m.
    pub k2_per_m: f64,
}

impl Elastic {
    /// Force in N.
    pub fn force_n(&self, [throw_m, depth_m]: [f64; 2]) -> f64 {
        let stiffness = self.k0_n_m + self.k1_n_m2 * (throw_m - self.throw0_m);
        stiffness * depth_m * (1.0 + self.k2_per_m * depth_m)
    }
}

/// Everything that may have changed since the training rolls; all zero is nothing. A response is what a roll does in the end.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effects {
    /// By how much every response is larger.
    pub response: f64,
    /// The response fades with the time since the dough was made, 1/s.
    pub drying_per_s: f64,
    /// Below this force nothing happens, N.
    pub slip_n: f64,
    /// The part of a change that is undone before the next roll.
    pub springback: f64,
    /// The part of the volume that each roll leaves on the tool.
    pub loss: f64,
    /// The response fades with the rolls of a run.
    pub softening_per_roll: f64,
    /// Unlisted: even rolls answer more, odd ones less, by this part.
    pub alternation: f64,
    /// Unlisted: relative change of the response by the throw beyond 80 mm, 1/m.
    pub throw_per_m: f64,
    /// Unlisted: how fast the response falls beyond a length: relative change by relative length, and the length in m.
    pub long: [f64; 2],
    /// Unlisted: a dough that was just worked is harder: relative change for each tenth of strain in the roll before.
    pub worked: f64,
}

/// A piece of dough as it lies there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lying {
    /// Its volume in m^3.
    pub volume_m3: f64,
    /// Its length in m.
    pub length_m: f64,
    /// Half the logarithm of width over height.
    pub oval: f64,
}

impl Lying {
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

    /// This dough, its shape a part of the way to another's: that part of the strain, and of the change of its cross-section.
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

/// One dough and what is done to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Before the first roll.
    pub fresh: Lying,
    /// Its response over that of the others.
    pub soft: f64,
    /// Rolls, in order.
    pub rolls: Vec<Planned>,
}

/// A roll that is to be made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planned {
    /// Where throw and depth lie between the bounds that the dough's width and height give them, in [0, 1].
    pub place: [f64; 2],
    /// Since the dough was made, s.
    pub t_s: f64,
    /// This roll's response over what it should be.
    pub luck: f64,
}

/// A roll that was made, dimensions in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Made {
    /// Before it.
    pub before: [f64; 3],
    /// Throw and depth in m.
    pub action: [f64; 2],
    /// After it.
    pub after: [f64; 3],
    /// What would be after it had nothing changed since the training.
    pub usual: [f64; 3],
    /// Since the dough was made, s.
    pub t_s: f64,
}

/// A table with a band, and doughs from one bowl.
#[derive(Debug, Clone, PartialEq)]
pub struct DoughWorld {
    /// The band.
    pub band: Elastic,
    /// Its breadth in m.
    pub breadth_m: f64,
    /// Modulus of the dough under a short load, Pa.
    pub elastic_pa: f64,
    /// Stress below which it does not flow, Pa.
    pub yield_pa: f64,
    /// Its strain rate at [`EXCESS_PA`] above, 1/s.
    pub rate_per_s: f64,
    /// The power of the excess with which it flows.
    pub exponent: f64,
    /// By how much a cross-section gets oval as the dough gets longer.
    pub flattens: f64,
    /// The doughs.
    pub pieces: Vec<Piece>,
    /// What acts.
    pub effects: Effects,
}

/// Excess of stress at which a strain rate is stated, Pa.
pub const EXCESS_PA: f64 = 3e3;
/// There and back at constant speed: m, m/s.
const TRAVEL_M: f64 = 0.2;
const SPEED_M_S: f64 = 0.1;
const STEPS: usize = 24;
/// Throws of the gripper, and the smallest depth, m.
const THROWS_M: [f64; 2] = [0.02, 0.12];
const LEAST_DEPTH_M: f64 = 5e-3;

impl DoughWorld {
    /// All rolls of all doughs.
    pub fn rolled(&self) -> Vec<Vec<Made>> {
        self.pieces.iter().map(|p| self.roll_all(p)).collect()
    }

    fn roll_all(&self, piece: &Piece) -> Vec<Made> {
        let mut lying = piece.fresh;
        let mut strain_before = 0.0;
        let mut made = Vec::with_capacity(piece.rolls.len());
        for (step, roll) in piece.rolls.iter().enumerate() {
            let action = within(&lying.dimensions_m(), roll.place);
            let usual = self.flow(&lying, action, piece.soft * roll.luck);
            let response = self.response(step, roll.t_s, action, lying.length_m, strain_before);
            let mut after = lying.towards(&usual, response);
            strain_before = (after.length_m / lying.length_m).ln();
            // Each dimension of what is left is smaller alike; what springs back is its strain, and not what was lost.
            let mut unstrained = lying;
            for dough in [&mut after, &mut unstrained] {
                dough.volume_m3 *= 1.0 - self.effects.loss;
                dough.length_m *= (1.0 - self.effects.loss).cbrt();
            }
            made.push(Made {
                before: lying.dimensions_m(),
                action,
                after: after.dimensions_m(),
                usual: usual.dimensions_m(),
                t_s: roll.t_s,
            });
            lying = after.towards(&unstrained, self.effects.springback);
        }
        made
    }

    /// The response over the usual one.
    fn response(&self, step: usize, t_s: f64, action: [f64; 2], length_m: f64, strain_before: f64) -> f64 {
        let e = &self.effects;
        if self.band.force_n(action) < e.slip_n {
            return 0.0;
        }
        let faded = (-e.drying_per_s * t_s - e.softening_per_roll * step as f64).exp();
        let even = if step % 2 == 1 { 1.0 } else { -1.0 };
        let [fall, from_m] = e.long;
        let beyond = if fall == 0.0 { 0.0 } else { fall * (length_m / from_m - 1.0).max(0.0) };
        let worked = 1.0 / (1.0 + e.worked * strain_before / 0.1);
        let law = (1.0 + e.alternation * even) * (1.0 + e.throw_per_m * (action[0] - 0.08)) * (-beyond).exp();
        (1.0 + e.response) * faded * worked * law
    }

    /// What a roll makes of a dough that flows so much faster than others.
    fn flow(&self, lying: &Lying, action: [f64; 2], soft: f64) -> Lying {
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
            let strain = soft * along * touched / length * rate * (TRAVEL_M / SPEED_M_S / STEPS as f64);
            now.oval += (self.flattens - 0.2 * now.oval) * strain;
            now.length_m *= strain.exp();
        }
        now
    }
}

/// The band at least as long as the dough is wide, and pressed no deeper than it is high.
fn within(dimensions_m: &[f64; 3], place: [f64; 2]) -> [f64; 2] {
    let shortest = dimensions_m[1].clamp(THROWS_M[0], THROWS_M[1]);
    let deepest = dimensions_m[2].max(LEAST_DEPTH_M);
    // As a gripper is told: to a tenth of a millimetre.
    let told = |low: f64, high: f64, u: f64| ((low + u * (high - low)) * 1e4).round() * 1e-4;
    [told(shortest, THROWS_M[1], place[0]), told(LEAST_DEPTH_M, deepest, place[1])]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world(effects: Effects) -> DoughWorld {
        let fresh = Lying { volume_m3: 4e-5, length_m: 0.044, oval: 0.01 };
        let roll = |i: u32| Planned {
            place: [0.5 + 0.4 * f64::from(i).sin(), 0.4 + 0.3 * f64::from(3 * i).cos()],
            t_s: 7.0 * f64::from(i),
            luck: 1.0,
        };
        DoughWorld {
            band: Elastic { k0_n_m: 60.0, k1_n_m2: 900.0, throw0_m: 0.04, k2_per_m: 8.0 },
            breadth_m: 0.04,
            elastic_pa: 3e4,
            yield_pa: 400.0,
            rate_per_s: 0.1,
            exponent: 2.0,
            flattens: 0.12,
            pieces: vec![Piece { fresh, soft: 1.0, rolls: (0..40).map(roll).collect() }],
            effects,
        }
    }

    fn lengths(effects: Effects) -> Vec<f64> {
        world(effects).rolled()[0].iter().map(|m| m.after[0]).collect()
    }

    /// A ball has the volume of a ball, a long roll nearly that of a cylinder.
    #[test]
    fn a_shape_has_its_volume() {
        let ball = Lying { volume_m3: PI / 6.0 * 0.04f64.powi(3), length_m: 0.04, oval: 0.0 };
        ball.dimensions_m().iter().for_each(|d| approx::assert_relative_eq!(*d, 0.04, max_relative = 1e-3));
        let long = Lying { volume_m3: 1e-4, length_m: 0.2, oval: 0.1 };
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
            assert_eq!(pair[0].after, pair[0].usual);
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
        let plain = lengths(Effects::default());
        let none = Effects::default();
        assert!(lengths(Effects { response: 0.3, ..none })[39] > plain[39] * 1.03);
        for m in &world(Effects { response: -0.5, ..none }).rolled()[0] {
            let strain = |to: &[f64; 3]| (to[0] / m.before[0]).ln();
            approx::assert_relative_eq!(strain(&m.after), 0.5 * strain(&m.usual), max_relative = 1e-9);
        }
        assert!(lengths(Effects { drying_per_s: 2e-3, ..none })[39] < plain[39] * 0.99);
        assert!(lengths(Effects { softening_per_roll: 0.02, ..none })[39] < plain[39] * 0.99);
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
            approx::assert_relative_eq!(volume(&m.after) / volume(&m.usual), 0.98, max_relative = 1e-9);
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
        let strain = |m: &Made, to: &[f64; 3]| (to[0] / m.before[0]).ln();
        let parts = |effects| -> Vec<f64> {
            world(effects).rolled()[0].iter().map(|m| strain(m, &m.after) / strain(m, &m.usual)).collect()
        };
        for (i, part) in parts(Effects { alternation: 0.2, ..none }).iter().enumerate() {
            let expected = if i % 2 == 1 { 1.2 } else { 0.8 };
            approx::assert_relative_eq!(*part, expected, max_relative = 0.02);
        }
        let effects = Effects { long: [0.8, 0.07], ..none };
        for m in &world(effects).rolled()[0] {
            let part = strain(m, &m.after) / strain(m, &m.usual);
            assert_eq!(part < 0.999, m.before[0] > 0.0702, "{part} at {}", m.before[0]);
        }
        let worked = parts(Effects { worked: 0.5, ..none });
        assert!((worked[0] - 1.0).abs() < 1e-12 && worked[1..].iter().all(|p| *p < 0.999));
        for m in &world(Effects { throw_per_m: 5.0, ..none }).rolled()[0] {
            let part = strain(m, &m.after) / strain(m, &m.usual);
            assert!((part > 1.0) == (m.action[0] > 0.08), "{part} at {}", m.action[0]);
        }
    }
}
