//! Tanks with upright walls: the mode's shape across is one function, up it is cosh.

use std::f64::consts::PI;

use nalgebra::DMatrix;

use super::ritz::{Integrals, gauss, lowest};

/// Powers of the radius that the mode's shape is made of.
const POWERS: usize = 10;

/// `int cosh^2` and `int sinh^2` of k (z + h) over the depth, over cosh^2(k h).
fn upward(k: f64, depth: f64) -> [f64; 2] {
    let tanh = (k * depth).tanh();
    let sech_squared = 1.0 - tanh * tanh;
    let [wave, half] = [0.5 * tanh / k, 0.5 * depth * sech_squared];
    [wave + half, wave - half]
}

/// The box, its mode cos(pi x / length).
pub(super) fn rectangular(length: f64, width: f64, depth: f64) -> Integrals {
    let k = PI / length;
    let [even, odd] = upward(k, depth);
    let bottom = 1.0 - (k * depth).tanh().powi(2);
    let tanh = (k * depth).tanh();
    // Over the volume: phi times its slope at the surface. On the walls: the speed along them.
    let volume = 0.5 * length * width * k * tanh;
    let ends = 2.0 * width * k * k * odd;
    let sides = length * k * k * (even + odd);
    let floor = 0.5 * length * width * k * k * bottom;
    Integrals { wave_number: k * tanh, volume, wall: ends + sides + floor }
}

/// The ring (a cylinder where `inner` is 0), its first mode once around: Bessel's equation by Ritz's method in powers of the radius.
pub(super) fn annulus(outer: f64, inner: f64, depth: f64) -> Option<Integrals> {
    // In units of the outer radius; shifted Legendre polynomials times r (times 1 in a ring) keep the matrices well conditioned.
    let low = inner / outer;
    let nodes = gauss(3 * POWERS);
    let shapes = |r: f64| {
        let t = 2.0 * (r - low) / (1.0 - low) - 1.0;
        let scale = 2.0 / (1.0 - low);
        let (mut p, mut d) = ([1.0; POWERS], [0.0; POWERS]);
        p[1] = t;
        d[1] = scale;
        for n in 2..POWERS {
            let m = n as f64;
            p[n] = ((2.0 * m - 1.0) * t * p[n - 1] - (m - 1.0) * p[n - 2]) / m;
            d[n] = d[n - 2] + (2.0 * m - 1.0) * p[n - 1] * scale;
        }
        // The factor r makes the shape regular on the axis.
        let slopes: Vec<f64> = (0..POWERS).map(|n| p[n] + r * d[n]).collect();
        (p.map(|p| r * p), slopes)
    };
    let (mut stiff, mut mass) = (DMatrix::zeros(POWERS, POWERS), DMatrix::zeros(POWERS, POWERS));
    for (t, w) in nodes {
        let r = low + (1.0 - low) * t;
        let (values, slopes) = shapes(r);
        let w = w * (1.0 - low);
        for i in 0..POWERS {
            for j in 0..POWERS {
                stiff[(i, j)] += w * (r * slopes[i] * slopes[j] + values[i] * values[j] / r);
                mass[(i, j)] += w * r * values[i] * values[j];
            }
        }
    }
    let (square, shape) = lowest(&stiff, &mass)?;
    let at = |r: f64| -> f64 { shapes(r).0.iter().zip(&shape).map(|(v, c)| v * c).sum() };
    let k = square.sqrt() / outer;
    let [even, odd] = upward(k, depth);
    let tanh = (k * depth).tanh();
    // cos^2 around gives pi; the shape has unit mass.
    let volume = PI * outer * outer * k * tanh;
    let mut wall = PI * outer * outer * k * k * (1.0 - tanh * tanh);
    for r in [1.0, low] {
        if r > 0.0 {
            let value = at(r);
            wall += PI * r * outer * value * value * (even / (r * outer).powi(2) + k * k * odd);
        }
    }
    Some(Integrals { wave_number: k * tanh, volume, wall })
}
