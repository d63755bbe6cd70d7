//! One curve: what a contact point leaves of it once modulus and baseline are eliminated.

use super::settings::{Baseline, Fit, LayerBelow};
use crate::indenter::Indenter;

/// A sample in the curve's own units: indentation over its span from the middle, force over its largest from the mean.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) u: f64,
    pub(super) force: f64,
    /// One over the square of the known relative sigma.
    pub(super) known: f64,
    /// The weight in use, one over the noise's variance and outliers down.
    pub(super) weight: f64,
}

/// A curve made ready.
#[derive(Debug, Clone, Default)]
pub(super) struct Ready {
    pub(super) samples: Vec<Sample>,
    /// Indentation in m at u = 0, and the span in m that u is in units of.
    pub(super) middle_m: f64,
    pub(super) span_m: f64,
    /// Force in N at zero in own units, and the unit.
    pub(super) mean_n: f64,
    pub(super) unit_n: f64,
    /// Indentation (own units) beyond which samples are left out.
    pub(super) cut: f64,
    sums: Sums,
}

/// Sums over the used samples that do not depend on the contact point; baseline columns 1 and u - centre.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    weight: f64,
    centre: f64,
    spread: f64,
    force: f64,
    moment: f64,
    square: f64,
}

/// The contact's column `phi` and its slope, orthogonal to the baseline, at a contact point.
///
/// Misfit of a stiffness k: `rest - 2 k b + k^2 a`; its derivative with respect to the contact point `2 k (d - k c)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Projected {
    /// phi phi.
    pub(super) a: f64,
    /// phi force.
    pub(super) b: f64,
    /// phi phi'.
    pub(super) c: f64,
    /// phi' force.
    pub(super) d: f64,
    /// phi' phi'.
    pub(super) e: f64,
    /// Misfit without contact.
    pub(super) rest: f64,
}

impl Projected {
    /// The stiffness that fits best, zero or more.
    pub(super) fn stiffness(&self) -> f64 {
        if self.a > 0.0 { (self.b / self.a).max(0.0) } else { 0.0 }
    }

    pub(super) fn misfit(&self, stiffness: f64) -> f64 {
        self.rest - stiffness * (2.0 * self.b - stiffness * self.a)
    }

    /// Curvature (half the second derivative) of the misfit over stiffness, the contact point following.
    pub(super) fn curvature(&self) -> f64 {
        if self.e > 0.0 { (self.a - self.c * self.c / self.e).max(0.0) } else { self.a }
    }
}

/// The contact's column in units of the span.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape<'a> {
    fit: &'a Fit,
    exponent: f64,
    span_m: f64,
}

impl<'a> Shape<'a> {
    pub(super) fn new(fit: &'a Fit, span_m: f64) -> Self {
        Self { fit, exponent: fit.indenter.exponent(), span_m }
    }

    /// phi and its slope at x spans from the contact point, zero before it.
    #[inline]
    pub(super) fn at(&self, x: f64) -> (f64, f64) {
        if !(x > 0.0) {
            return (0.0, 0.0);
        }
        let (phi, slope) = match self.fit.indenter {
            Indenter::Sphere { .. } => {
                let root = x.sqrt();
                (x * root, 1.5 * root)
            }
            Indenter::Cylinder { .. } => (x, 1.0),
            Indenter::Cone { .. } => (x * x, 2.0 * x),
        };
        let Some(LayerBelow { layer, inverse_thickness_per_m }) = &self.fit.layer else {
            return (phi, slope);
        };
        let chi = self.fit.indenter.reach_m(x * self.span_m) * inverse_thickness_per_m;
        let (factor, log_slope) = layer.factor(chi);
        let more = log_slope * self.fit.indenter.reach_exponent() / self.exponent;
        (phi * factor, slope * factor * (1.0 + more))
    }

    /// Young's modulus in Pa of a stiffness in force units of `unit_n`.
    pub(super) fn modulus_pa(&self, stiffness: f64, unit_n: f64) -> f64 {
        let nu = self.fit.poisson_ratio;
        let per_pa = self.fit.indenter.factor() * self.span_m.powf(self.exponent) / (1.0 - nu * nu);
        stiffness * unit_n / per_pa
    }
}

impl Ready {
    /// Sums anew after the weights or the cut have changed.
    pub(super) fn renew(&mut self, baseline: Baseline) {
        let mut s = Sums::default();
        for p in self.used() {
            s.weight += p.weight;
            s.centre += p.weight * p.u;
            s.force += p.weight * p.force;
        }
        if s.weight > 0.0 {
            s.centre /= s.weight;
        }
        let mean = if baseline == Baseline::Zero || !(s.weight > 0.0) { 0.0 } else { s.force / s.weight };
        for p in self.used() {
            let u = p.u - s.centre;
            s.spread += p.weight * u * u;
            s.moment += p.weight * u * (p.force - mean);
            s.square += p.weight * (p.force - mean) * (p.force - mean);
        }
        self.sums = s;
    }

    /// Step of the reading, zero where there is none: forces often repeat, and lie on a lattice.
    pub(super) fn step(&self, room: &mut Vec<f64>) -> f64 {
        let repeats = self.samples.windows(2).filter(|p| p[0].force == p[1].force).count();
        if repeats * 20 < self.samples.len() {
            return 0.0;
        }
        room.clear();
        room.extend(self.samples.iter().map(|p| p.force));
        room.sort_unstable_by(f64::total_cmp);
        let gaps = || room.windows(2).map(|p| p[1] - p[0]).filter(|g| *g > 1e-9);
        let step = gaps().fold(f64::INFINITY, f64::min);
        let (mut off, mut count) = (0.0, 0.0);
        for gap in gaps() {
            off += (gap / step - (gap / step).round()).abs();
            count += 1.0;
        }
        // Gaps that are on no lattice are off by a quarter on average.
        if count > 1.0 && off < 0.02 * count { step } else { 0.0 }
    }

    /// Raises the forces ahead of a contact point.
    pub(super) fn lift(&mut self, at: f64, by: f64) {
        for p in self.samples.iter_mut().filter(|p| p.u <= at) {
            p.force += by;
        }
    }

    pub(super) fn used(&self) -> impl Iterator<Item = &Sample> {
        let cut = self.cut;
        self.samples.iter().filter(move |p| p.u <= cut)
    }

    /// Misfit of a straight line.
    pub(super) fn rest_of_line(&self) -> f64 {
        let s = &self.sums;
        s.square - if s.spread > 0.0 { s.moment * s.moment / s.spread } else { 0.0 }
    }

    /// Every `stride`-th sample at a contact point; the misfit is then only good for comparing contact points.
    pub(super) fn project(&self, fit: &Fit, at: f64, stride: usize) -> Projected {
        let shape = Shape::new(fit, self.span_m);
        let (mut one, mut u1, mut phi2, mut force1) = (0.0, 0.0, 0.0, 0.0);
        let (mut slope1, mut slope_u, mut cross, mut slope_f, mut slope2) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let s = &self.sums;
        for p in self.samples.iter().step_by(stride) {
            if p.u > self.cut || p.u <= at {
                continue;
            }
            let (phi, slope) = shape.at(p.u - at);
            let u = p.u - s.centre;
            let (wp, ws) = (p.weight * phi, p.weight * slope);
            one += wp;
            u1 += wp * u;
            phi2 += wp * phi;
            force1 += wp * p.force;
            slope1 += ws;
            slope_u += ws * u;
            cross += ws * phi;
            slope_f += ws * p.force;
            slope2 += ws * slope;
        }
        let scale = stride as f64;
        let (weight, spread) = self.over(fit, scale);
        let (f1, fu) = (s.force / scale, s.moment / scale);
        Projected {
            a: scale * phi2 - weight * one * one - spread * u1 * u1,
            b: scale * force1 - weight * one * f1 - spread * u1 * fu,
            c: scale * cross - weight * one * slope1 - spread * u1 * slope_u,
            d: scale * slope_f - weight * slope1 * f1 - spread * slope_u * fu,
            e: scale * slope2 - weight * slope1 * slope1 - spread * slope_u * slope_u,
            rest: if fit.baseline == Baseline::Tilt { self.rest_of_line() } else { s.square },
        }
    }

    /// The misfit of the best stiffness at a contact point, by every `stride`-th sample: what [`Ready::project`] gives, without slopes.
    pub(super) fn least_misfit(&self, fit: &Fit, at: f64, stride: usize) -> f64 {
        let shape = Shape::new(fit, self.span_m);
        let (mut one, mut u1, mut phi2, mut force1) = (0.0, 0.0, 0.0, 0.0);
        let s = &self.sums;
        for p in self.samples.iter().step_by(stride) {
            if p.u > self.cut || p.u <= at {
                continue;
            }
            let phi = shape.at(p.u - at).0;
            let weighted = p.weight * phi;
            one += weighted;
            u1 += weighted * (p.u - s.centre);
            phi2 += weighted * phi;
            force1 += weighted * p.force;
        }
        let scale = stride as f64;
        let (weight, spread) = self.over(fit, scale);
        let a = scale * phi2 - weight * one * one - spread * u1 * u1;
        let b = scale * force1 - weight * one * s.force / scale - spread * u1 * s.moment / scale;
        let stiffness = if a > 0.0 { (b / a).max(0.0) } else { 0.0 };
        -stiffness * (2.0 * b - stiffness * a)
    }

    /// By what sums of every `scale`-th sample with the baseline's columns are divided: zero for a column that the baseline has not.
    fn over(&self, fit: &Fit, scale: f64) -> (f64, f64) {
        let over = |has: bool, y: f64| if has && y > 0.0 { scale * scale / y } else { 0.0 };
        let s = &self.sums;
        (over(fit.baseline != Baseline::Zero, s.weight), over(fit.baseline == Baseline::Tilt, s.spread))
    }

    /// Baseline at the middle of the sums and its slope, in own units, at a contact point and a stiffness.
    pub(super) fn baseline(&self, fit: &Fit, at: f64, stiffness: f64) -> (f64, f64) {
        let shape = Shape::new(fit, self.span_m);
        let s = &self.sums;
        let (mut one, mut u1) = (0.0, 0.0);
        for p in self.used() {
            let phi = p.weight * shape.at(p.u - at).0;
            one += phi;
            u1 += phi * (p.u - s.centre);
        }
        let level = match fit.baseline {
            Baseline::Zero => 0.0,
            _ if s.weight > 0.0 => (s.force - stiffness * one) / s.weight,
            _ => 0.0,
        };
        let slope = match fit.baseline {
            Baseline::Tilt if s.spread > 0.0 => (s.moment - stiffness * u1) / s.spread,
            _ => 0.0,
        };
        (level - slope * s.centre, slope)
    }
}
