//! The contact of a rigid body with an elastic layer, solved once for each Poisson's ratio.
//!
//! A pressure whose Hankel transform is `P(k) = int_0^a phi(t) cos(k t) dt` lowers the surface by
//! `w(r) = 2/E* int_0^inf L(k H) P(k) J0(k r) dk`; L is 1 on a half-space. With `m = 1 - L`, Abel's inversion leaves
//!
//! `phi(t) - (2/pi) int_0^a phi(s) int_0^inf m(k H) cos(k t) cos(k s) dk ds = E*/pi d/dt int_0^t r (delta - f(r)) / sqrt(t^2 - r^2) dr`
//!
//! and `F = 2 pi int_0^a phi dt`. Where the body has no edge, `phi(a) = 0` fixes the depth. (Sneddon 1965, and Dhaliwal and Rau
//! 1970 for layers.)

use nalgebra::{SMatrix, SVector};

use super::Base;
use crate::{indenter::Indenter, quadrature::gauss_legendre};

/// Points along the contact radius, and along the wave number.
const POINTS: usize = 20;
const WAVES: usize = 64;
/// m is below 1e-12 beyond this.
const LAST_WAVE: f64 = 20.0;

/// The layer's response L over that of a half-space, at `x = k H`.
fn response(x: f64, poisson_ratio: f64, base: Base) -> f64 {
    let e = (-2.0 * x).exp();
    match base {
        Base::Free => {
            // (cosh 2x - 1)/(sinh 2x + 2x)
            (-(-2.0 * x).exp_m1()).powi(2) / (-(-4.0 * x).exp_m1() + 4.0 * x * e)
        }
        Base::Bonded => {
            // (2 kappa sinh 2x - 4x)/(2 kappa cosh 2x + 1 + kappa^2 + 4x^2), kappa = 3 - 4 nu
            let kappa = 3.0 - 4.0 * poisson_ratio;
            (-kappa * (-4.0 * x).exp_m1() - 4.0 * x * e)
                / (kappa * (1.0 + e * e) + (1.0 + kappa * kappa + 4.0 * x * x) * e)
        }
    }
}

/// The kernel's parts that do not depend on the contact radius.
pub(super) struct Solver {
    nodes: [f64; POINTS],
    weights: [f64; POINTS],
    waves: [f64; WAVES],
    /// 2/pi m times the weight of each wave.
    missing: [f64; WAVES],
}

/// What a body of a contact radius does, in units of the layer's thickness.
pub(super) struct Pressed {
    /// The ratio that [`Indenter::reach_m`] over the thickness is.
    pub(super) chi: f64,
    /// Force over that on a half-space at the same indentation.
    pub(super) factor: f64,
}

impl Solver {
    pub(super) fn new(poisson_ratio: f64, base: Base) -> Self {
        let (nodes, weights) = gauss_legendre::<POINTS>();
        let (mut waves, mut missing) = gauss_legendre::<WAVES>();
        for (x, m) in waves.iter_mut().zip(&mut missing) {
            *x *= LAST_WAVE;
            *m *= LAST_WAVE * std::f64::consts::FRAC_2_PI * (1.0 - response(*x, poisson_ratio, base));
        }
        Self { nodes, weights, waves, missing }
    }

    /// The body whose contact radius is `radius` thicknesses; none if the equation has no solution.
    pub(super) fn at(&self, indenter: &Indenter, radius: f64) -> Option<Pressed> {
        let mut cosines = [[0.0; WAVES]; POINTS];
        for (row, t) in cosines.iter_mut().zip(&self.nodes) {
            for (c, x) in row.iter_mut().zip(&self.waves) {
                *c = (x * t * radius).cos();
            }
        }
        let edge = self.waves.map(|x| (x * radius).cos());
        let kernel = |a: &[f64; WAVES], b: &[f64; WAVES]| -> f64 {
            self.missing.iter().zip(a).zip(b).map(|((m, a), b)| m * a * b).sum()
        };
        let matrix = SMatrix::<f64, POINTS, POINTS>::from_fn(|i, j| {
            f64::from(u8::from(i == j)) - kernel(&cosines[i], &cosines[j]) * self.weights[j] * radius
        });
        let factors = matrix.lu();
        // phi for the right-hand side t^power: its value at the edge and its integral.
        let solve = |power: i32| -> Option<(f64, f64)> {
            let right = SVector::<f64, POINTS>::from_fn(|i, _| (self.nodes[i] * radius).powi(power));
            let phi = factors.solve(&right)?;
            let (mut at_edge, mut sum) = (radius.powi(power), 0.0);
            for ((phi, w), c) in phi.iter().zip(&self.weights).zip(&cosines) {
                at_edge += kernel(&edge, c) * w * radius * phi;
                sum += w * radius * phi;
            }
            Some((at_edge, sum))
        };
        // h(t) = delta - slope t^power; force 2 E* (delta sum_0 - slope sum_power), edge value zero.
        let (edge_0, sum_0) = solve(0)?;
        let (power, slope) = match indenter {
            Indenter::Cylinder { .. } => return Some(Pressed { chi: radius, factor: sum_0 / radius }),
            Indenter::Sphere { .. } => (2, 1.0),
            Indenter::Cone { .. } => (1, std::f64::consts::FRAC_PI_2),
        };
        let (edge_n, sum_n) = solve(power)?;
        let depth = slope * edge_n / edge_0;
        let force = 2.0 * (depth * sum_0 - slope * sum_n);
        Some(match indenter {
            Indenter::Cone { .. } => {
                Pressed { chi: depth, factor: force / (std::f64::consts::FRAC_2_PI * depth * depth) }
            }
            _ => Pressed { chi: depth.sqrt(), factor: force / (4.0 / 3.0 * depth * depth.sqrt()) },
        })
    }
}
