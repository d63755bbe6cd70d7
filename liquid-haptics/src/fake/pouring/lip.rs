//! The lip of a container: a bead that breaks and rests, a weir strip by strip, threads and drops.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Strips across the lip.
const STRIPS: usize = 24;
/// How long the contact line's wander remembers, s.
const WANDER_S: f64 = 2.0;
/// Time in which a thin liquid's stream comes off the lip, s.
const THIN_S: f64 = 0.04;

/// What a lip is like.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    pub(super) radius: f64,
    pub(super) hold: f64,
    pub(super) rest: f64,
    pub(super) wander: f64,
    /// Share of the ideal weir's flow.
    pub(super) discharge: f64,
    /// What stays on the lip, and what a drop takes with it, m^3.
    pub(super) hanging: f64,
    pub(super) drop: f64,
    /// Radius of a thread that thins, m.
    pub(super) thread: f64,
    pub(super) viscosity: f64,
    /// Dynamic viscosity over surface tension, s/m.
    pub(super) slowness: f64,
    pub(super) gravity: f64,
}

/// A lip and what hangs from it.
#[derive(Debug, Clone)]
pub(super) struct Lip {
    shape: Shape,
    broken: bool,
    falling: bool,
    wander: f64,
    hung: f64,
}

impl Lip {
    pub(super) fn new(shape: Shape) -> Self {
        Self { shape, broken: false, falling: false, wander: 0.0, hung: 0.0 }
    }

    /// Volume that has passed the lip and hangs from it, m^3.
    pub(super) fn hung(&self) -> f64 {
        self.hung
    }

    /// Volume flow (m^3/s) over the lip with the surface `above` (m) its lowest point, at a tilt of that sine.
    pub(super) fn flow(&mut self, h: f64, above: f64, sin: f64, rng: &mut ChaCha8Rng) -> f64 {
        let shape = self.shape;
        let keep = (-h / WANDER_S).exp();
        let draw: f64 = StandardNormal.sample(rng);
        self.wander = keep * self.wander + shape.wander * (1.0 - keep * keep).sqrt() * draw;
        let rest = shape.rest + self.wander;
        if above > shape.hold + self.wander {
            self.broken = true;
        } else if above < rest {
            self.broken = false;
        }
        if !self.broken || sin <= 0.0 {
            return 0.0;
        }
        let head = above - rest;
        // As wide as the lip is where the surface cuts it.
        let reach = (head / sin).min(shape.radius);
        let half = (reach * (2.0 * shape.radius - reach)).sqrt();
        let step = 2.0 * half / STRIPS as f64;
        let strip = |k: usize| {
            let across = (k as f64 + 0.5) * step - half;
            let rise = shape.radius - (shape.radius * shape.radius - across * across).max(0.0).sqrt();
            let depth = (head - rise * sin).max(0.0);
            let critical = shape.discharge * (8.0 / 27.0 * shape.gravity).sqrt() * depth * depth.sqrt();
            let shear = shape.gravity * depth.powi(3) / (3.0 * shape.viscosity);
            if critical > 0.0 { step / (1.0 / critical + 1.0 / shear) } else { 0.0 }
        };
        (0..STRIPS).map(strip).sum()
    }

    /// Takes what has passed the lip (m^3) in a step (s), and gives what comes off it, m^3.
    pub(super) fn release(&mut self, h: f64, passed: f64) -> f64 {
        let shape = self.shape;
        self.hung += passed;
        if self.hung > shape.hanging + shape.drop {
            self.falling = true;
        } else if self.hung <= shape.hanging * 1.02 {
            self.falling = false;
        }
        if !self.falling {
            return 0.0;
        }
        let lasts = THIN_S + 3.0 * shape.thread * shape.slowness;
        let fallen = (self.hung - shape.hanging).max(0.0) * (1.0 - (-h / lasts).exp());
        self.hung -= fallen;
        fallen
    }
}
