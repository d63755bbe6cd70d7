//! Three modes of an upright cylinder with what a real surface adds: each damped by the boundary layers of its own potential flow, summed
//! numerically, with a surface that may be dirty, a contact line that sticks, surface tension, and waves that soften as they grow.

use super::slosh::Slosh;

/// Steps of the integrator, s, at most.
const STEP_S: f64 = 5e-4;
/// A wave breaks where the first mode's mass has moved this share of the radius.
const BREAKS: f64 = 0.5;
/// Points of the sums over wall, bottom and surface.
const POINTS: usize = 200;
const MODES: usize = 3;

/// What a real surface adds to the slosh of [`super::FakeWrist`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Surface tension, N/m.
    pub tension_n_m: f64,
    /// How much of the surface is covered by a film that does not slide, 0 (clean) to 1 (all of it): it damps as a wall does.
    pub dirt: f64,
    /// The displacement of the swinging mass at which the contact line sticks, over the radius.
    pub sticking: f64,
    /// Relative drop of the squared frequency where the swinging mass has moved half a radius.
    pub softening: f64,
}

/// One mode: the oscillator that stands for it.
#[derive(Debug, Clone, Copy)]
struct Mode {
    omega: f64,
    fade: f64,
    mass_kg: f64,
    state: [f64; 2],
}

/// What swings: one oscillator by the published law, or three modes.
#[derive(Debug, Clone)]
pub(super) enum Swinging {
    One(Slosh),
    Three(Modes),
}

impl Swinging {
    /// Goes on by a time (s) in which the container is moved with a horizontal acceleration (m/s^2).
    pub(super) fn advance(&mut self, duration_s: f64, acceleration_m_s2: f64) {
        match self {
            Self::One(slosh) => slosh.advance(duration_s, acceleration_m_s2),
            Self::Three(modes) => modes.advance(duration_s, acceleration_m_s2),
        }
    }

    /// Moment of the displaced masses, kg m, and the force with which they push the container, N.
    pub(super) fn felt(&self) -> [f64; 2] {
        match self {
            Self::One(slosh) => {
                let [displacement, push] = slosh.felt();
                [slosh.mass_kg * displacement, push]
            }
            Self::Three(modes) => modes.felt(),
        }
    }
}

/// Antisymmetric modes with one surface.
#[derive(Debug, Clone)]
pub(super) struct Modes {
    modes: [Mode; MODES],
    sticking_m: f64,
    /// Relative drop of the squared frequency per square metre of displacement.
    softening_m2: f64,
    limit_m: f64,
}

impl Modes {
    /// The modes of a cylinder of a radius and a level (m) with a mass (kg) of a density (kg/m^3) and kinematic viscosity (m^2/s).
    pub(super) fn new(
        [radius, level]: [f64; 2],
        [mass, density]: [f64; 2],
        viscosity: f64,
        gravity: f64,
        surface: &Surface,
    ) -> Self {
        let mode = |n: usize| {
            let root = turning_point(n);
            let k = root / radius;
            let depth = (root * level / radius).min(300.0);
            if !(depth > 0.0 && density > 0.0) {
                return Mode { omega: 1.0, fade: 1.0, mass_kg: 0.0, state: [0.0; 2] };
            }
            let inviscid = ((gravity * k + surface.tension_n_m / density * k.powi(3)) * depth.tanh()).sqrt();
            let layers = layers(root, depth, surface.dirt) / radius * (viscosity / (8.0 * inviscid)).sqrt();
            // A boundary layer lends the wave its mass: the frequency drops by as much as the damping ratio.
            let omega = inviscid * (1.0 - layers.min(0.5));
            let bulk = 2.0 * viscosity * k * k;
            let share = 2.0 * depth.tanh() / (depth * (root * root - 1.0));
            Mode { omega, fade: layers * inviscid + bulk, mass_kg: mass * share, state: [0.0; 2] }
        };
        Self {
            modes: std::array::from_fn(mode),
            sticking_m: surface.sticking * radius,
            softening_m2: surface.softening / (BREAKS * radius).powi(2),
            limit_m: BREAKS * radius,
        }
    }

    fn spring(&self, mode: &Mode) -> f64 {
        let [x, _] = mode.state;
        let soft = (self.softening_m2 * x * x).min(0.5);
        mode.omega * mode.omega * (1.0 - soft)
    }

    fn advance(&mut self, duration_s: f64, acceleration_m_s2: f64) {
        if !(duration_s > 0.0) {
            return;
        }
        let steps = (duration_s / STEP_S).ceil().max(1.0);
        let h = duration_s / steps;
        for _ in 0..steps as usize {
            for n in 0..MODES {
                let mode = self.modes[n];
                if mode.mass_kg == 0.0 {
                    continue;
                }
                // Half a step of drift, the whole kick with fading and sticking, half a step of drift.
                let [x, v] = mode.state;
                let x = x + 0.5 * h * v;
                let here = Mode { state: [x, v], ..mode };
                let kicked = v - h * (self.spring(&here) * x + acceleration_m_s2);
                let faded = kicked * (-2.0 * mode.fade * h).exp();
                let stuck = h * mode.omega * mode.omega * self.sticking_m;
                let v = if n == 0 { faded.signum() * (faded.abs() - stuck).max(0.0) } else { faded };
                let x = x + 0.5 * h * v;
                let broken = x.abs() > self.limit_m;
                self.modes[n].state = if broken { [self.limit_m.copysign(x), 0.0] } else { [x, v] };
            }
        }
    }

    fn felt(&self) -> [f64; 2] {
        let mut felt = [0.0; 2];
        for mode in &self.modes {
            let [x, v] = mode.state;
            felt[0] += mode.mass_kg * x;
            felt[1] += mode.mass_kg * (self.spring(mode) * x + 2.0 * mode.fade * v);
        }
        felt
    }
}

/// The Bessel function J1 and its derivative, by their power series.
fn bessel(x: f64) -> [f64; 2] {
    let (mut sums, mut term) = ([0.0; 2], 0.5);
    for n in 0..40 {
        let n = f64::from(n);
        sums[0] += term * x;
        sums[1] += term * (2.0 * n + 1.0);
        term *= -0.25 * x * x / ((n + 1.0) * (n + 2.0));
    }
    sums
}

/// Where J1 turns for the n-th time, by bisection.
fn turning_point(n: usize) -> f64 {
    let bracket = [[1.0, 3.0], [4.5, 6.0], [7.5, 9.5]][n];
    let [mut low, mut high] = bracket;
    let rises = bessel(low)[1] > 0.0;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (bessel(middle)[1] > 0.0) == rises { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Damping ratio of a mode's boundary layers over `sqrt(viscosity / (8 omega)) / radius`: the tangential speed squared over wall, bottom and the
/// dirty part of the surface, over the flow's energy (Landau and Lifshitz, Fluid Mechanics, section 24), all of the flow
/// `J1(k r) cos(theta) cosh(k z)` and in units of the radius; `depth` is k times the level.
fn layers(root: f64, depth: f64, dirt: f64) -> f64 {
    let step = 1.0 / POINTS as f64;
    let points = || (0..POINTS).map(|i| (i as f64 + 0.5) * step);
    let at_wall = bessel(root)[0].powi(2);
    // Relative to the surface's cosh^2, so that nothing overflows.
    let level = depth / root;
    let scale = depth.cosh();
    let wall: f64 = points()
        .map(|u| ((u * depth).cosh() / scale, (u * depth).sinh() / scale))
        .map(|(cosh, sinh)| at_wall * (cosh * cosh + root * root * sinh * sinh) * level * step)
        .sum();
    let flat: f64 = points()
        .map(|r| (r, bessel(root * r)))
        .map(|(r, [value, slope])| ((root * slope).powi(2) + (value / r).powi(2)) * r * step)
        .sum();
    let squares: f64 = points().map(|r| bessel(root * r)[0].powi(2) * r * step).sum();
    let slip = wall + flat * (1.0 / (scale * scale) + dirt);
    slip / (squares * root * depth.tanh())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sums are the integrals, which have a closed form where the surface is clean or all dirty; deep, the damping ratio is
    /// `0.557 sqrt(viscosity / sqrt(gravity radius^3))` (Case and Parkinson 1957, doi:10.1017/S0022112057000051).
    #[test]
    fn boundary_layers_are_those_of_the_closed_form() {
        let root = turning_point(0);
        approx::assert_relative_eq!(root, 1.841_183_781, max_relative = 1e-8);
        for depth in [0.3f64, 1.0, 4.0] {
            for dirt in [0.0, 1.0] {
                let (twice, flat) = (0.25 * (2.0 * depth).sinh(), 0.5 * (root * root - 1.0));
                let wall = (twice + 0.5 * depth) / root + root * (twice - 0.5 * depth);
                let slip = wall + flat * (1.0 + dirt * depth.cosh().powi(2));
                let energy = 0.5 * (1.0 - 1.0 / (root * root)) * root * depth.sinh() * depth.cosh();
                approx::assert_relative_eq!(layers(root, depth, dirt), slip / energy, max_relative = 1e-4);
            }
        }
        let deep = layers(root, 8.0, 0.0) / (8.0 * root.sqrt()).sqrt();
        approx::assert_relative_eq!(deep, 0.5575, max_relative = 2e-3);
    }

    /// Sticking takes four of it a cycle, and holds what is left.
    #[test]
    fn a_contact_line_that_sticks_ends_the_swing() {
        let surface = Surface { tension_n_m: 0.0, dirt: 0.0, sticking: 0.01, softening: 0.0 };
        let mut modes = Modes::new([0.04, 0.1], [0.5, 1000.0], 0.0, 9.81, &surface);
        modes.modes[0].state = [0.008, 0.0];
        let cycle = std::f64::consts::TAU / modes.modes[0].omega;
        modes.advance(2.0 * cycle, 0.0);
        approx::assert_relative_eq!(modes.modes[0].state[0], 0.008 - 8.0 * 4e-4, max_relative = 0.01);
        modes.advance(5.0 * cycle, 0.0);
        let rests = modes.modes[0].state;
        modes.advance(1.0, 0.0);
        assert!(modes.modes[0].state == rests && rests[0].abs() <= 4e-4);
    }
}
