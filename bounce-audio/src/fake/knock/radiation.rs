//! What a force between a ball and a table sounds like: pressure at 1 m over force, of the ball that is stopped (acceleration noise: Koss
//! and Alfredson 1973, *J. Sound Vib.* 27, 59), of its own vibrations (Lamb 1882, doi:10.1112/plms/s1-13.1.189 and
//! doi:10.1112/plms/s1-14.1.50), and of the plate's modes, each with its radiation (Maidanik 1962, doi:10.1121/1.1918200).

use rand::{Rng, RngExt};
use rustfft::num_complex::Complex64;
use std::f64::consts::PI;

use super::{Board, Striker};

/// Density of air, kg/m^3, and the speed of sound in it, m/s.
const AIR: [f64; 2] = [1.2, 343.0];
/// Modes above this are left out, Hz.
const HIGHEST_HZ: f64 = 22e3;
/// Orders of the ball's modes.
const ORDERS: std::ops::RangeInclusive<u32> = 2..=6;

/// Pressure of the ball's motion as a whole over the force at a frequency, seen at an angle (its cosine) from the vertical: a rigid
/// sphere that oscillates, less its image in the table.
pub(super) fn motion(ball: &Striker, cosine: f64, hz: f64) -> Complex64 {
    let [rho, c] = AIR;
    let (omega, radius) = (2.0 * PI * hz, 0.5 * ball.diameter_m);
    let ka = omega * radius / c;
    let dipole = Complex64::new(0.0, omega * rho * radius.powi(3) * cosine / (2.0 * c * ball.mass_kg))
        / Complex64::new(1.0 - 0.5 * ka * ka, ka);
    dipole * (1.0 - Complex64::cis(-2.0 * ka * cosine))
}

/// A mode of the ball: frequency (rad/s), loss, and pressure at 1 m over the force's time derivative beyond the resonance.
#[derive(Debug, Clone, Copy)]
pub(super) struct BallMode {
    omega: f64,
    loss: f64,
    gain: f64,
}

/// The modes of a ball that can be heard.
pub(super) fn ball_modes(ball: &Striker) -> Vec<BallMode> {
    let [rho, c] = AIR;
    let radius = 0.5 * ball.diameter_m;
    let nu = ball.poisson;
    ORDERS
        .map(|n| {
            let order = f64::from(n);
            let omega = if ball.wall_m.is_some() {
                // The lower root of the membrane's frequency equation.
                let b = 1.0 + 3.0 * nu + order * (order + 1.0);
                let d = (1.0 - nu * nu) * (order * (order + 1.0) - 2.0);
                let square = 0.5 * (b - (b * b - 4.0 * d).sqrt());
                (square * ball.youngs_pa / (ball.density_kg_m3 * (1.0 - nu * nu))).sqrt() / radius
            } else {
                // Spheroidal modes: 2.64 for the second, about 1.3 more for each order.
                let shear = ball.youngs_pa / (2.0 * (1.0 + nu));
                (2.64 + 1.28 * (order - 2.0)) * (shear / ball.density_kg_m3).sqrt() / radius
            };
            let ka = omega * radius / c;
            // |h_n'(ka)|: its limits for small and large ka, one added to the other.
            let double: f64 = (1..=n).map(|k| 2.0 * f64::from(k) - 1.0).product();
            let steep = (double * (order + 1.0) / ka.powi(n as i32 + 2)).hypot(1.0 / ka);
            let modal = ball.mass_kg / (2.0 * order + 1.0);
            let gain = rho * c * radius / (ka * steep) / modal;
            // What it sends into the air it loses.
            let radiated =
                (rho * radius.powi(3) * 4.0 * PI / (ball.mass_kg * ka * (ka * steep).powi(2))).min(0.2);
            BallMode { omega, loss: ball.loss_factor + radiated, gain }
        })
        .filter(|m| m.omega < 2.0 * PI * HIGHEST_HZ)
        .collect()
}

impl BallMode {
    /// Pressure over force at a frequency (Hz).
    pub(super) fn at(&self, hz: f64) -> Complex64 {
        let w = 2.0 * PI * hz;
        let rest = Complex64::new(self.omega * self.omega - w * w, self.loss * self.omega * w);
        Complex64::new(0.0, w * self.gain) / rest
    }
}

/// Pressure at 1 m after a unit impulse of force on a board, at a rate (Hz): its modes as they ring and fade. What the phases of the
/// modes are at the microphone is drawn.
pub(super) fn board<R: Rng + ?Sized>(board: &Board, rate_hz: f64, samples: usize, rng: &mut R) -> Vec<f64> {
    let [rho, c] = AIR;
    let [a, b] = board.size_m;
    let (area, per_area) = (a * b, board.density_kg_m3 * board.thickness_m);
    let rigidity = board.rigidity();
    let coincidence = c * c / (2.0 * PI) * (per_area / rigidity).sqrt();
    let mut out = vec![0.0; samples];
    let unit = 0.5 * PI * (rigidity / per_area).sqrt();
    let most = |side: f64| (side * (HIGHEST_HZ / unit).sqrt()) as u32 + 1;
    for m in 1..=most(a) {
        for n in 1..=most(b) {
            let (u, v) = (f64::from(m) / a, f64::from(n) / b);
            let hz = unit * (u * u + v * v);
            if hz > HIGHEST_HZ {
                break;
            }
            let shape = (PI * u * board.struck_m[0]).sin() * (PI * v * board.struck_m[1]).sin();
            let radiation = if hz > 1.05 * coincidence {
                (1.0 / (1.0 - coincidence / hz).sqrt()).min(3.0)
            } else {
                (2.0 * (a + b) * c / (PI * PI * area * coincidence) * (hz / coincidence).sqrt()).min(3.0)
            };
            let loss = board.loss_factor + rho * c * radiation / (2.0 * PI * hz * per_area);
            let speed = shape * 4.0 / (per_area * area);
            let gain = 0.5 * speed * rho * c * (radiation * area / (2.0 * PI)).sqrt();
            let phase = 2.0 * PI * rng.random::<f64>();
            let turn = Complex64::from_polar((-PI * loss * hz / rate_hz).exp(), 2.0 * PI * hz / rate_hz);
            let audible = (9.0 / (PI * loss * hz) * rate_hz) as usize;
            let mut z = Complex64::from_polar(gain, phase);
            for p in out.iter_mut().take(audible) {
                *p += z.re;
                z *= turn;
            }
        }
    }
    // The end is faded, so that nothing comes round in a discrete transform.
    let fade = samples / 4;
    let last = samples - fade;
    for (k, p) in out[last..].iter_mut().enumerate() {
        *p *= 0.5 + 0.5 * (PI * k as f64 / fade as f64).cos();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::substance::SUBSTANCES;
    use super::*;

    /// Shells of table tennis ring first near 7 kHz (0.70 of sqrt(E / (rho (1 - nu^2))) / R for a ratio of 0.3: Baker 1961,
    /// doi:10.1121/1.1908562); a steel ball of 2 cm rings beyond hearing.
    #[test]
    fn a_shell_rings_where_it_is_heard_and_steel_does_not() {
        let ball = |k: usize, diameter_m: f64, wall_m: Option<f64>| Striker {
            wall_m,
            ..Striker::of(&SUBSTANCES[k], diameter_m, wall_m, 0.9)
        };
        let shell = ball(7, 0.04, Some(4e-4));
        let first = ball_modes(&shell)[0].omega / (2.0 * PI);
        assert!((6e3..9e3).contains(&first), "{first}");
        assert!(ball_modes(&ball(0, 0.02, None)).is_empty());
    }
}
