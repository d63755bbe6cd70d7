//! Tanks of any profile: the mode as a sum of harmonic polynomials, by Ritz's method over the boundary alone.
//!
//! Among potentials that are harmonic inside, the first mode makes `int |grad phi|^2 dV / int_surface phi^2 dS` stationary; the volume
//! integral is one of `phi d phi / dn` over the boundary.

use std::f64::consts::PI;

use nalgebra::DMatrix;

use super::ritz::{Integrals, gauss, lowest};

/// Harmonic polynomials that the mode is made of.
const TERMS: usize = 9;
/// Nodes along wall and surface.
const NODES: usize = 60;

/// Value, and slopes outward and upward, of each polynomial in a half plane.
type Terms = [[f64; 3]; TERMS];

/// A plane figure that is turned about the axis (weight pi r) or is the same all along a canal (weight 2, for both halves).
struct Figure<'a> {
    wall: &'a dyn Fn(f64) -> [f64; 2],
    terms: &'a dyn Fn(f64, f64) -> Terms,
    weight: &'a dyn Fn(f64) -> f64,
}

impl Figure<'_> {
    /// The wall goes from the surface's rim (0) to the axis (1), heights from the surface.
    fn solve(&self, around: &dyn Fn(f64, f64) -> f64) -> Option<Integrals> {
        let rim = (self.wall)(0.0)[0];
        let nodes = gauss(NODES);
        let (mut stiff, mut mass) = (DMatrix::zeros(TERMS, TERMS), DMatrix::zeros(TERMS, TERMS));
        let mut add = |x: f64, z: f64, normal: [f64; 2], w: f64, surface: bool| {
            let terms = (self.terms)(x / rim, z / rim);
            for i in 0..TERMS {
                for j in 0..TERMS {
                    let slope = (terms[j][1] * normal[0] + terms[j][2] * normal[1]) / rim;
                    stiff[(i, j)] += w * terms[i][0] * slope;
                    if surface {
                        mass[(i, j)] += w * terms[i][0] * terms[j][0];
                    }
                }
            }
        };
        for &(t, w) in &nodes {
            let x = rim * t;
            add(x, 0.0, [0.0, 1.0], rim * w * (self.weight)(x), true);
            let ([x, z], [dx, dz]) = self.along(t);
            // The outward normal, times the length of the step.
            add(x, z, [-dz, dx], w * (self.weight)(x), false);
        }
        let symmetric = 0.5 * (&stiff + stiff.transpose());
        let (wave_number, shape) = lowest(&symmetric, &mass)?;
        let mut wall = 0.0;
        for &(t, w) in &nodes {
            let ([x, z], [dx, dz]) = self.along(t);
            let [value, across, up] = self.sum(&shape, x / rim, z / rim);
            let length = dx.hypot(dz);
            let tangent = (across * dx + up * dz) / (rim * length.max(f64::MIN_POSITIVE));
            wall += w * length * (self.weight)(x) * (tangent * tangent + around(x, value));
        }
        // The surface's integral is 1, so that the volume's is the wave number.
        Some(Integrals { wave_number, volume: wave_number, wall })
    }

    fn sum(&self, shape: &[f64], x: f64, z: f64) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for (c, term) in shape.iter().zip((self.terms)(x, z)) {
            for (sum, value) in sums.iter_mut().zip(term) {
                *sum += c * value;
            }
        }
        sums
    }

    /// A point of the wall and its step by the parameter.
    fn along(&self, t: f64) -> ([f64; 2], [f64; 2]) {
        const H: f64 = 1e-6;
        let (a, b) = ((self.wall)(t - H), (self.wall)(t + H));
        ((self.wall)(t), [(b[0] - a[0]) / (2.0 * H), (b[1] - a[1]) / (2.0 * H)])
    }
}

/// The first mode, once around the axis, of a body of revolution under a level surface.
pub(super) fn axisymmetric(wall: &dyn Fn(f64) -> [f64; 2]) -> Option<Integrals> {
    // rho^n P_n^1 with the factor r written out: phi = r q(r, z) cos(angle); by the recursion of solid harmonics.
    let terms = |r: f64, z: f64| {
        let square = r * r + z * z;
        let mut out = [[0.0; 3]; TERMS];
        // q and its slopes by r and z, for n = 1, 2, ...
        let (mut before, mut here) = ([0.0; 3], [1.0, 0.0, 0.0]);
        for (k, term) in out.iter_mut().enumerate() {
            *term = [r * here[0], here[0] + r * here[1], r * here[2]];
            let n = k as f64 + 1.0;
            let (a, b) = ((2.0 * n + 1.0) / n, (n + 1.0) / n);
            let next = [
                a * z * here[0] - b * square * before[0],
                a * z * here[1] - b * (2.0 * r * before[0] + square * before[1]),
                a * (here[0] + z * here[2]) - b * (2.0 * z * before[0] + square * before[2]),
            ];
            (before, here) = (here, next);
        }
        out
    };
    // Around the axis the speed is the value over the radius; cos^2 and sin^2 both give pi.
    let around = |r: f64, value: f64| if r > 0.0 { (value / r).powi(2) } else { 0.0 };
    let figure = Figure { wall, terms: &terms, weight: &|r| PI * r };
    figure.solve(&around)
}

/// The first mode across a canal of a length, with its two end walls.
pub(super) fn canal(wall: &dyn Fn(f64) -> [f64; 2], length: f64) -> Option<Integrals> {
    // Im((z + i x)^n): odd across.
    let terms = |x: f64, z: f64| {
        let mut out = [[0.0; 3]; TERMS];
        let (mut re, mut im) = (1.0, 0.0);
        for (k, term) in out.iter_mut().enumerate() {
            let n = k as f64 + 1.0;
            // The power before is the slope.
            let (dx, dz) = (n * re, n * im);
            (re, im) = (re * z - im * x, im * z + re * x);
            *term = [im, dx, dz];
        }
        out
    };
    let figure = Figure { wall, terms: &terms, weight: &|_| 2.0 };
    let sums = figure.solve(&|_, _| 0.0)?;
    // Each end has the gradient of the whole section: as much as a unit of length of the volume.
    Some(Integrals { wall: sums.wall + 2.0 * sums.volume / length, ..sums })
}
