//! An indenter pressed into a soft body: the contact as a row of springs (the method of dimensionality reduction, Popov and Hess
//! 2015, doi:10.1007/978-3-642-53876-6), which is exact for bodies of revolution without friction, elastic or viscoelastic.

use super::bisection::bisect;
use super::layer::Layer;
use super::quadrature::{gauss, integral};
use std::f64::consts::PI;
use std::sync::OnceLock;

/// A rigid indenter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Indenter {
    /// A sphere (a paraboloid) of a radius in m.
    Sphere(f64),
    /// A flat-ended cylinder of a radius in m.
    Cylinder(f64),
    /// A cone, by the angle in rad between its flank and the flat surface.
    Cone(f64),
}

/// Everything that may act beside elasticity; all zero is an elastic half-space.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effects {
    /// Depth reading at which contact begins, m.
    pub contact_offset_m: f64,
    /// Force linear in depth, N/m.
    pub tension_n_m: f64,
    /// Force cubic in depth, N/m^3.
    pub stretching_n_m3: f64,
    /// Work of adhesion in J/m^2 (JKR; spheres only).
    pub adhesion_j_m2: f64,
    /// Thickness of the body, bonded to a rigid ground, m; 0 for a half-space (spheres only).
    pub thickness_m: f64,
    /// Fraction of the modulus that relaxes.
    pub relaxed_fraction: f64,
    /// Time constant of the relaxation in s.
    pub tau_s: f64,
    /// A rim that is met at a depth.
    pub rim: Rim,
    /// Compliance of the load cell, which adds to the depth reading, m/N.
    pub compliance_m_n: f64,
    /// Offset of the load cell, N.
    pub force_offset_n: f64,
    /// The force times 1 + this depth/radius (spheres and cylinders).
    pub stiffening: f64,
    /// Unlisted: fraction of the largest depth that stays as a dent.
    pub dent: f64,
    /// Unlisted: a ripple of the drive.
    pub ripple: Ripple,
    /// Unlisted: a membrane that slips.
    pub slip: Slip,
    /// Unlisted: a layer of another stiffness.
    pub layer: Stratum,
    /// Unlisted: another modulus from a run on.
    pub later: Later,
}

/// Depths over which each further metre takes another force.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stratum {
    /// Change of the stiffness, N/m.
    pub stiffness_n_m: f64,
    /// Depth readings between which it is another one, m.
    pub between_m: [f64; 2],
}

/// A modulus that changes between runs.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Later {
    /// By how much it is larger, relative.
    pub stiffer: f64,
    /// The first run that has it, counted from 0.
    pub from_run: usize,
}

/// A rim beside the contact.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rim {
    /// Depth reading at which the rim is met, m.
    pub depth_m: f64,
    /// Its stiffness, N/m.
    pub stiffness_n_m: f64,
}

/// A force that is periodic in the depth reading.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Ripple {
    /// Amplitude in N; 0 for none.
    pub amplitude_n: f64,
    /// Pitch in m.
    pub pitch_m: f64,
}

/// A force that is lost once a depth was reached.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Slip {
    /// Depth reading in m; 0 for none.
    pub depth_m: f64,
    /// The force in N.
    pub force_n: f64,
}

/// Depth and time of a reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Depth reading in m.
    pub delta_m: f64,
    /// Time in s.
    pub t_s: f64,
    /// Whether the indenter goes down or rests; else it goes up.
    pub down: bool,
}

/// Curves of force over depth.
#[derive(Debug, Clone, PartialEq)]
pub struct IndentationWorld {
    /// The indenter.
    pub indenter: Indenter,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
    /// Young's modulus (at once) of each condition, Pa.
    pub moduli_pa: Vec<f64>,
    /// Runs: number of the condition, and readings.
    pub runs: Vec<(usize, Vec<Step>)>,
    /// The effects at work.
    pub effects: Effects,
}

/// A quadrature rule that is exact for the springs of all three indenters.
fn rule() -> &'static [[f64; 2]] {
    static RULE: OnceLock<Vec<[f64; 2]>> = OnceLock::new();
    RULE.get_or_init(|| gauss(4))
}

impl Indenter {
    /// Half-width of the contact of a half-space at a depth.
    fn half_width_m(self, depth_m: f64) -> f64 {
        let depth = depth_m.max(0.0);
        match self {
            Self::Sphere(radius) => (radius * depth).sqrt(),
            Self::Cylinder(radius) => radius,
            Self::Cone(angle) => 2.0 * depth / (PI * angle.tan()),
        }
    }

    /// The profile that the springs see: Abel's transform of the indenter's slope.
    fn profile_m(self, x: f64) -> f64 {
        match self {
            Self::Sphere(radius) => x * x / radius,
            Self::Cylinder(_) => 0.0,
            Self::Cone(angle) => 0.5 * PI * angle.tan() * x,
        }
    }

    /// Radius over which a depth counts as large.
    fn radius_m(self) -> Option<f64> {
        match self {
            Self::Sphere(radius) | Self::Cylinder(radius) => Some(radius),
            Self::Cone(_) => None,
        }
    }

    /// Force of an elastic half-space of a plane-strain modulus.
    pub fn force_n(self, plane_pa: f64, depth_m: f64) -> f64 {
        if depth_m <= 0.0 {
            return 0.0;
        }
        let spring = |x: f64| depth_m - self.profile_m(x);
        2.0 * plane_pa * integral(rule(), [0.0, self.half_width_m(depth_m)], spring)
    }
}

/// Force of an adhesive sphere (Johnson, Kendall and Roberts): the contact's edge is stretched by `sqrt(2 pi a w/E*)`, and its radius
/// is the larger of the two at which that can be; `None` beyond the depth at which the sphere tears off.
pub fn jkr_force_n(radius_m: f64, plane_pa: f64, work_j_m2: f64, depth_m: f64) -> Option<f64> {
    let edge = |a: f64| (2.0 * PI * a * work_j_m2 / plane_pa).sqrt();
    let depth_of = |a: f64| a * a / radius_m - edge(a);
    let least = (radius_m * radius_m * 2.0 * PI * work_j_m2 / (16.0 * plane_pa)).cbrt();
    if depth_of(least) > depth_m {
        return None;
    }
    let (low, mut high) = (least, least + (radius_m * depth_m.abs()).sqrt());
    while depth_of(high) < depth_m {
        high *= 2.0;
    }
    let [_, high] = bisect([low, high], 60, |a| depth_of(a) < depth_m);
    Some(2.0 * plane_pa * (depth_m * high - high.powi(3) / (3.0 * radius_m)))
}

impl IndentationWorld {
    /// Forces of all runs without noise, run after run, N.
    pub fn readings(&self) -> Vec<f64> {
        let layer = (self.effects.thickness_m > 0.0).then(|| Layer::new(self.poisson_ratio));
        let later = self.effects.later;
        let of_run = |(number, (condition, steps)): (usize, &(usize, Vec<Step>))| {
            let stiffer = if number >= later.from_run { later.stiffer } else { 0.0 };
            self.run(self.moduli_pa[*condition] * (1.0 + stiffer), steps, layer.as_ref())
        };
        self.runs.iter().enumerate().flat_map(of_run).collect()
    }

    fn run(&self, modulus_pa: f64, steps: &[Step], layer: Option<&Layer>) -> Vec<f64> {
        let e = &self.effects;
        let plane = modulus_pa / (1.0 - self.poisson_ratio * self.poisson_ratio);
        let mut depths: Vec<f64> = steps.iter().map(|s| s.delta_m).collect();
        let mut forces = self.forces(plane, steps, &depths, layer);
        if e.compliance_m_n > 0.0 {
            // The load cell gives way by a small part of the depth: the fixed point is soon found.
            for _ in 0..60 {
                for ((depth, step), force) in depths.iter_mut().zip(steps).zip(&forces) {
                    *depth = step.delta_m - e.compliance_m_n * force;
                }
                forces = self.forces(plane, steps, &depths, layer);
            }
        }
        let Ripple { amplitude_n, pitch_m } = e.ripple;
        let deepest = steps.iter().map(|s| s.delta_m).fold(0.0, f64::max);
        let mut slipped = false;
        for (force, step) in forces.iter_mut().zip(steps) {
            slipped |= e.slip.depth_m > 0.0 && step.delta_m >= e.slip.depth_m;
            *force += e.force_offset_n - if slipped { e.slip.force_n } else { 0.0 };
            let [top, bottom] = e.layer.between_m;
            *force += e.layer.stiffness_n_m * (step.delta_m.min(bottom) - top).max(0.0);
            if amplitude_n != 0.0 {
                *force += amplitude_n * (2.0 * PI * step.delta_m / pitch_m).sin();
            }
        }
        if e.dent > 0.0 {
            let top = forces.iter().copied().fold(0.0, f64::max);
            let power = if matches!(self.indenter, Indenter::Cone(_)) { 2.0 } else { 1.5 };
            for (force, step) in forces.iter_mut().zip(steps).filter(|(_, s)| !s.down) {
                let left = ((step.delta_m / deepest - e.dent) / (1.0 - e.dent)).max(0.0);
                *force = top * left.powf(power);
            }
        }
        forces
    }

    /// Forces on the indenter along true depths.
    fn forces(&self, plane: f64, steps: &[Step], depths: &[f64], layer: Option<&Layer>) -> Vec<f64> {
        let e = &self.effects;
        let inside: Vec<f64> = depths.iter().map(|d| d - e.contact_offset_m).collect();
        let relaxes = e.relaxed_fraction > 0.0;
        let mut bare = if relaxes {
            self.relaxing(plane, steps, &inside)
        } else {
            inside.iter().map(|d| self.indenter.force_n(plane, *d)).collect()
        };
        let mut touched = false;
        for (i, force) in bare.iter_mut().enumerate() {
            let depth = inside[i].max(0.0);
            touched |= inside[i] >= 0.0;
            if let (Some(layer), Indenter::Sphere(radius)) = (layer, self.indenter) {
                *force *= layer.factor((radius * depth).sqrt() / e.thickness_m);
            }
            if let Some(radius) = self.indenter.radius_m() {
                *force *= 1.0 + e.stiffening * depth / radius;
            }
            if let (true, Indenter::Sphere(radius)) = (e.adhesion_j_m2 > 0.0 && touched, self.indenter) {
                let sticky = jkr_force_n(radius, plane, e.adhesion_j_m2, inside[i]);
                touched = sticky.is_some();
                *force += sticky.map_or(0.0, |f| f - self.indenter.force_n(plane, depth));
            }
            *force += e.tension_n_m * depth
                + e.stretching_n_m3 * depth.powi(3)
                + e.rim.stiffness_n_m * (depths[i] - e.rim.depth_m).max(0.0);
        }
        bare
    }

    /// Forces of a standard linear solid: each spring remembers, and none of them pulls.
    fn relaxing(&self, plane: f64, steps: &[Step], inside: &[f64]) -> Vec<f64> {
        const SPRINGS: usize = 300;
        let Effects { relaxed_fraction: relaxed, tau_s, .. } = self.effects;
        let deepest = inside.iter().copied().fold(0.0, f64::max);
        let width = self.indenter.half_width_m(deepest) / SPRINGS as f64;
        let mut forces = vec![0.0; steps.len()];
        for spring in 0..SPRINGS {
            let profile = self.indenter.profile_m((spring as f64 + 0.5) * width);
            let (mut arm, mut torn) = (0.0, false);
            let (mut before, mut then) = (inside[0] - profile, steps[0].t_s);
            for ((force, step), depth) in forces.iter_mut().zip(steps).zip(inside) {
                let now = depth - profile;
                let mut lasted = step.t_s - then;
                if now > 0.0 && before <= 0.0 {
                    // Touched on the way: at the first reading, or part of the time ago.
                    lasted *= if now > before { now / (now - before) } else { 0.0 };
                    (arm, before, torn) = (0.0, 0.0, false);
                }
                if now > 0.0 && !torn {
                    let keep = (-lasted / tau_s).exp();
                    let gain = if lasted > 0.0 { tau_s * (1.0 - keep) / lasted } else { 1.0 };
                    arm = arm * keep + gain * (now - before);
                    let pressed = (1.0 - relaxed) * now + relaxed * arm;
                    torn = pressed < 0.0;
                    *force += 2.0 * plane * width * pressed.max(0.0);
                }
                (before, then) = (now, step.t_s);
            }
        }
        forces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world(indenter: Indenter, effects: Effects) -> IndentationWorld {
        let down =
            (0..=40).map(|i| Step { delta_m: 1e-4 * f64::from(i), t_s: 0.1 * f64::from(i), down: true });
        let rest = (1..=100).map(|i| Step { delta_m: 4e-3, t_s: 4.0 + 0.1 * f64::from(i), down: true });
        let up = (1..=40).map(|i| Step {
            delta_m: 4e-3 - 1e-4 * f64::from(i),
            t_s: 14.0 + 0.1 * f64::from(i),
            down: false,
        });
        let runs = vec![(0, down.chain(rest).chain(up).collect())];
        IndentationWorld { indenter, poisson_ratio: 0.5, moduli_pa: vec![2e4], runs, effects }
    }

    /// Hertz for nu = 0.5: 16/9 E sqrt(R) d^1.5; the cylinder 8/3 E R d; the cone 8/(3 pi) E d^2 / tan.
    #[test]
    fn elastic_forces_are_those_of_the_books() {
        let d = 3e-3;
        let plane = 2e4 / 0.75;
        let sphere = Indenter::Sphere(0.01).force_n(plane, d);
        approx::assert_relative_eq!(sphere, 16.0 / 9.0 * 2e4 * 0.1 * d.powf(1.5), max_relative = 1e-12);
        let cylinder = Indenter::Cylinder(0.01).force_n(plane, d);
        approx::assert_relative_eq!(cylinder, 8.0 / 3.0 * 2e4 * 0.01 * d, max_relative = 1e-12);
        let cone = Indenter::Cone(0.5).force_n(plane, d);
        approx::assert_relative_eq!(
            cone,
            8.0 / (3.0 * PI) * 2e4 * d * d / 0.5f64.tan(),
            max_relative = 1e-12
        );
        assert!(Indenter::Sphere(0.01).force_n(plane, -1e-3).abs() < f64::MIN_POSITIVE);
    }

    /// JKR: -4/3 pi w R where the depth is 0, -3/2 pi w R at most, -5/6 pi w R where it tears at a held depth.
    #[test]
    fn a_sticky_sphere_pulls_as_jkr_says() {
        let (radius, plane, work) = (0.01, 3e4, 0.2);
        let unit = PI * work * radius;
        approx::assert_relative_eq!(
            jkr_force_n(radius, plane, work, 0.0).unwrap() / unit,
            -4.0 / 3.0,
            max_relative = 1e-9
        );
        let torn = -0.75 * (PI * PI * work * work * radius / (plane * plane)).cbrt();
        assert!(jkr_force_n(radius, plane, work, torn * 1.0001).is_none());
        let last = jkr_force_n(radius, plane, work, torn * 0.999_999_9).unwrap();
        approx::assert_relative_eq!(last / unit, -5.0 / 6.0, max_relative = 2e-3);
        let least = (0..20_000)
            .filter_map(|i| jkr_force_n(radius, plane, work, torn * f64::from(i) / 20_000.0))
            .fold(0.0, f64::min);
        approx::assert_relative_eq!(least / unit, -1.5, max_relative = 1e-6);
    }

    /// In rest the force falls to the relaxed part with the time constant of relaxation; loading is Boltzmann's integral of Hertz.
    #[test]
    fn a_relaxing_body_follows_boltzmann() {
        let (r, tau) = (0.3, 1.5);
        let w =
            world(Indenter::Sphere(0.01), Effects { relaxed_fraction: r, tau_s: tau, ..Effects::default() });
        let forces = w.readings();
        let hertz = |t: f64| 16.0 / 9.0 * 2e4 * 0.1 * (1e-3 * t.min(4.0)).powf(1.5);
        for row in [10, 40, 45, 80, 140] {
            let t = w.runs[0].1[row].t_s;
            // F(0) (1 - r + r e^-t/tau) + int G(t - s) dF: by parts, with 20,000 steps.
            let n = 20_000;
            let mut sum = 0.0;
            for k in 0..n {
                let [early, late] = [k, k + 1].map(|k| t * f64::from(k) / f64::from(n));
                sum +=
                    (1.0 - r + r * (-(t - 0.5 * (early + late)) / tau).exp()) * (hertz(late) - hertz(early));
            }
            approx::assert_relative_eq!(forces[row], sum, max_relative = 2e-4);
        }
        assert!(forces[150] < hertz(3.0) * (1.0 - r));
    }

    #[test]
    fn the_other_terms_are_what_they_say() {
        let baseline = world(Indenter::Sphere(0.01), Effects::default()).readings();
        let with = |e: Effects| world(Indenter::Sphere(0.01), e).readings()[40] - baseline[40];
        let none = Effects::default();
        approx::assert_relative_eq!(with(Effects { tension_n_m: 5.0, ..none }), 0.02, max_relative = 1e-9);
        approx::assert_relative_eq!(
            with(Effects { stretching_n_m3: 1e6, ..none }),
            0.064,
            max_relative = 1e-9
        );
        let rim = Rim { depth_m: 3e-3, stiffness_n_m: 40.0 };
        approx::assert_relative_eq!(with(Effects { rim, ..none }), 0.04, max_relative = 1e-9);
        approx::assert_relative_eq!(
            with(Effects { stiffening: 0.5, ..none }),
            0.2 * baseline[40],
            max_relative = 1e-9
        );
        let compliant = baseline[40] + with(Effects { compliance_m_n: 1e-4, ..none });
        let there = Indenter::Sphere(0.01).force_n(2e4 / 0.75, 4e-3 - 1e-4 * compliant);
        approx::assert_relative_eq!(compliant, there, max_relative = 1e-9);
        assert!(with(Effects { contact_offset_m: 2e-4, ..none }) < 0.0);
        assert!(with(Effects { thickness_m: 0.03, ..none }) > 0.2 * baseline[40]);
    }
}
