//! A thick liquid that drains down the wall of a container that has been set upright.
//!
//! On its side the liquid lies in the cylinder as a prism, a segment of the circle deep. Set upright, each strip of it is a film on a
//! vertical wall with the flux per width `g h^3 / (3 nu)` (Nusselt 1916; [Matl 2021], eq. 2.6 corrected), which obeys
//! `h_t + g h^2 / nu h_s = 0`: from the upper end, where nothing follows, spreads the fan `h = sqrt(nu s / (g t))` (Jeffreys 1930,
//! doi:10.1017/S0305004100015681), s down from there. What arrives below is a level pool. The torque of the film falls as
//! `-rho g` times its moment about the axis.
//!
//! Where it holds: strips do not drag on each other (a segment much wider than deep; a half-full cylinder's carry twice what a duct
//! of that shape does), and the film has developed: for times above some `3 sqrt(L / g)` whatever the viscosity, as the fan's
//! diffusion time `h^2 / nu` is `s / (g t)`.

use std::f64::consts::PI;

use super::{Bottle, ViscosityError, checked};
use crate::root::root;

/// Strips of the film, by the midpoint rule in the angle: the film's ends, where its depth is none, stay out.
const STRIPS: usize = 48;
/// Steps of the table per factor e in time.
const STEPS_PER_E: f64 = 12.0;
/// The table's ends, logarithms of the time over `nu / (g R)`.
const TABLE: [f64; 2] = [-5.0, 21.0];
/// Shares of a response between which its rise time is counted.
const RISE: [f64; 2] = [0.1, 0.9];

/// Moment of the film about the axis as a function of time, for one fill of one cylinder: planned once, asked often.
#[derive(Debug, Clone, PartialEq)]
pub struct Drain {
    radius_m: f64,
    gravity_m_s2: f64,
    /// Moment over `R^4` at the table's times.
    moments: Vec<f64>,
    first: f64,
}

/// The film in units of the radius: strips with their width, wall and first depth.
struct Film {
    strips: Vec<[f64; 3]>,
    length: f64,
    volume: f64,
}

impl Film {
    fn new(length: f64, volume: f64) -> Self {
        let area = volume / length;
        // The chord at x = c cuts off the segment phi - sin(phi) cos(phi), c = cos(phi).
        let excess = |phi: f64| Ok::<f64, std::convert::Infallible>(phi - phi.sin() * phi.cos() - area);
        let Ok(phi) = root(excess, (0.0, -area), (PI, PI - area), 1e-15);
        let chord = phi.cos();
        let reach = phi.min(0.5 * PI);
        let step = 2.0 * reach / STRIPS as f64;
        let strips = (0..STRIPS)
            .map(|k| {
                let (y, wall) = (-reach + step * (k as f64 + 0.5)).sin_cos();
                // Where the wall bends back over the liquid a strip is as deep as the circle.
                (y, wall, (wall - chord).min(2.0 * wall))
            })
            .map(|(_, wall, depth)| [wall * step, wall, depth])
            .collect();
        Self { strips, length, volume }
    }

    /// Volume and moment of the film above a pool that leaves `left` of the length, where `thin` is `nu / (g t)`.
    fn sums(&self, left: f64, thin: f64) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for [width, wall, depth] in &self.strips {
            let fan = (depth * depth / thin).min(left);
            let volume = 2.0 / 3.0 * (thin * fan).sqrt() * fan + depth * (left - fan);
            let squares = 0.5 * thin * fan * fan + depth * depth * (left - fan);
            sums[0] += width * volume;
            sums[1] += width * (wall * volume - 0.5 * squares);
        }
        sums
    }

    /// Moment at a time, in units of `nu / (g R)`.
    fn moment(&self, time: f64) -> f64 {
        let thin = 1.0 / time;
        let most = self.volume / PI;
        let spare = |level: f64| {
            Ok::<f64, std::convert::Infallible>(
                PI * level + self.sums(self.length - level, thin)[0] - self.volume,
            )
        };
        let Ok(low) = spare(0.0);
        let Ok(high) = spare(most);
        let Ok(level) = root(spare, (0.0, low), (most, high), 1e-13);
        self.sums(self.length - level, thin)[1]
    }
}

impl Drain {
    /// A plan for a bottle.
    pub fn new(bottle: &Bottle) -> Self {
        let radius = bottle.radius_m;
        let film = Film::new(bottle.length_m / radius, bottle.volume_m3 / radius.powi(3));
        let steps = ((TABLE[1] - TABLE[0]) * STEPS_PER_E).ceil() as usize;
        let at = |k: usize| film.moment((TABLE[0] + k as f64 / STEPS_PER_E).exp());
        Self {
            radius_m: radius,
            gravity_m_s2: bottle.gravity_m_s2,
            moments: (0..=steps).map(at).collect(),
            first: film.sums(film.length, f64::MIN_POSITIVE)[1].max(film.moment(1e-9)),
        }
    }

    /// Plans of one cylinder times factors, summed: a plan between volumes.
    pub(crate) fn mixed(plans: [&Self; 4], factors: [f64; 4]) -> Self {
        let sum = |of: &dyn Fn(&Self) -> f64| plans.iter().zip(factors).map(|(p, f)| f * of(p)).sum();
        let moments = (0..plans[0].moments.len()).map(|k| sum(&|p: &Self| p.moments[k])).collect();
        Self { moments, first: sum(&|p: &Self| p.first), ..*plans[0] }
    }

    /// Moment of the film's volume about the cylinder's axis (m^4) a time (s) after gravity began to pull along the wall.
    pub fn moment_m4(&self, kinematic_viscosity_m2_s: f64, t_s: f64) -> f64 {
        let unit = self.radius_m.powi(4);
        let time = t_s * self.gravity_m_s2 * self.radius_m / kinematic_viscosity_m2_s;
        if !(time > 0.0) {
            return self.first * unit;
        }
        let place = (time.ln() - TABLE[0]) * STEPS_PER_E;
        let last = self.moments.len() - 1;
        if place <= 0.0 {
            return self.moments[0] * unit;
        }
        if place >= last as f64 {
            // Far out the fan holds everywhere: its volume goes with the root of time.
            return self.moments[last] * unit * (-0.5 * (place - last as f64) / STEPS_PER_E).exp();
        }
        let k = (place as usize).min(last - 1);
        let at = |i: isize| self.moments[(k as isize + i).clamp(0, last as isize) as usize];
        // Catmull and Rom's cubic, smooth across the table's points.
        let (a, b, c, d, u) = (at(-1), at(0), at(1), at(2), place - k as f64);
        let cubic =
            b + 0.5 * u * (c - a + u * (2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)));
        cubic * unit
    }
}

/// Time (s) in which a response goes from 10 % to 90 % of its way from the first reading to the last; the first passages of a
/// straight line between readings.
///
/// # Errors
/// [`ViscosityError::Reading`], [`ViscosityError::Lengths`], [`ViscosityError::TooFew`], [`ViscosityError::NoFit`] where the reading
/// does not change.
pub fn rise_time_s(t_s: &[f64], reading: &[f64]) -> Result<f64, ViscosityError> {
    checked(t_s, reading, 2)?;
    let (first, last) = (reading[0], reading[reading.len() - 1]);
    let passage = |share: f64| {
        let level = |y: f64| (y - first) / (last - first) - share;
        (1..reading.len()).find(|&i| level(reading[i]) >= 0.0).map(|i| {
            let (before, after) = (level(reading[i - 1]), level(reading[i]));
            t_s[i - 1] + (t_s[i] - t_s[i - 1]) * (-before / (after - before)).clamp(0.0, 1.0)
        })
    };
    match RISE.map(passage) {
        [Some(low), Some(high)] if last != first => Ok(high - low),
        _ => Err(ViscosityError::NoFit { what: "rise" }),
    }
}

/// The dynamic viscosity (Pa s) from the rise time (s) of a drain as [Matl 2021] prints it, eq. 2.6 and appendix A.3.
///
/// The formula is off in its dimensions and its constant (the result is in `Pa s` times a length of 1 m); it stands here so that the numbers
/// of [Matl 2021] can be reproduced. Use [`super::ViscosityFit`].
pub fn thesis_drain_viscosity(bottle: &Bottle, rise_time_s: f64) -> f64 {
    let (radius, volume) = (bottle.radius_m, bottle.volume_m3);
    let area = volume / bottle.length_m;
    let share = (area / (radius * radius)).clamp(0.0, PI);
    let excess = |phi: f64| Ok::<f64, std::convert::Infallible>(phi - phi.sin() * phi.cos() - share);
    let Ok(phi) = root(excess, (0.0, -share), (PI, PI - share), 1e-15);
    let depth = radius * (1.0 - phi.cos());
    let level = volume / (PI * radius * radius);
    let density = bottle.mass_kg / volume;
    let moved = bottle.mass_kg * (volume - area * level) / volume;
    density * bottle.gravity_m_s2 * depth.powi(3) * rise_time_s * area / (2.0 * moved)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    fn bottle(share: f64) -> Bottle {
        let volume = share * PI * 0.034f64.powi(2) * 0.17;
        Bottle {
            radius_m: 0.034,
            length_m: 0.17,
            volume_m3: volume,
            mass_kg: 1400.0 * volume,
            gravity_m_s2: 9.81,
        }
    }

    /// To begin with the moment is that of the prism on its side: two thirds of the half chord, cubed, times the length. In the end
    /// it is that of the fan above a pool that holds nearly everything.
    #[test]
    fn the_film_begins_as_the_prism_and_ends_as_the_fan() {
        for share in [0.05, 0.3, 0.5, 0.7] {
            let bottle = bottle(share);
            let drain = Drain::new(&bottle);
            let area = bottle.volume_m3 / bottle.length_m;
            let (mut low, mut high) = (0.0, PI);
            for _ in 0..60 {
                let phi = 0.5 * (low + high);
                if (phi - phi.sin() * phi.cos()) * 0.034f64.powi(2) < area { low = phi } else { high = phi }
            }
            let by_hand = 2.0 / 3.0 * (0.034 * f64::sin(low)).powi(3) * 0.17;
            approx::assert_relative_eq!(drain.moment_m4(1e-2, 0.0), by_hand, max_relative = 2e-3);
            let reach = low.min(0.5 * PI);
            let wall = 0.034f64.powi(2) * (reach + f64::sin(reach) * f64::cos(reach));
            let left = 0.17 - bottle.level_m();
            let fan = wall * 2.0 / 3.0 * left * (1e-3 * left / (9.81 * 1e4)).sqrt();
            approx::assert_relative_eq!(drain.moment_m4(1e-3, 1e4), fan, max_relative = 0.01);
        }
    }

    /// Time and viscosity count as their ratio alone, and the moment falls all the way.
    #[test]
    fn the_moment_falls() {
        let drain = Drain::new(&bottle(0.4));
        let mut before = f64::INFINITY;
        for k in 0..400 {
            let t = 1e-4 * f64::exp(0.05 * f64::from(k));
            let here = drain.moment_m4(3e-3, t);
            assert!(here <= before * (1.0 + 1e-9) && here > 0.0);
            approx::assert_relative_eq!(here, drain.moment_m4(3e-2, 10.0 * t), max_relative = 1e-9);
            before = here;
        }
    }

    #[test]
    fn a_ramp_takes_eight_tenths_of_its_time() {
        let t: Vec<f64> = (0..101).map(f64::from).collect();
        let ramp: Vec<f64> = t.iter().map(|t| 5.0 - t).collect();
        approx::assert_relative_eq!(rise_time_s(&t, &ramp).unwrap(), 80.0, max_relative = 1e-12);
        assert!(rise_time_s(&t, &vec![1.0; 101]).is_err());
    }
}
