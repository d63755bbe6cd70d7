//! The free decay of a mode as a sensor reads it, with what real walls, surfaces and sensors add.

/// Effects beyond a linear, viscously damped mode; all zero is off.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effects {
    /// Reading at which the surface sticks to the wall (dry friction of the contact line): each cycle loses four of it.
    pub friction: f64,
    /// Damping that grows with speed, `x'' = ... - c |x'| x'`, in 1/reading (Keulegan 1959, doi:10.1017/S0022112059000404).
    pub quadratic_per_reading: f64,
    /// Relative change of the frequency at the amplitude `largest_amplitude`; it goes with the amplitude squared.
    pub frequency_change: f64,
    /// The amplitude to which `frequency_change` refers, in units of the reading.
    pub largest_amplitude: f64,
}

/// A mode's free decay: `x'' + 2 gamma omega x' + omega^2 x = 0` and the [`Effects`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decay {
    /// Angular frequency without damping, rad/s.
    pub omega_rad_s: f64,
    /// Damping ratio, in [0, 1).
    pub damping_ratio: f64,
    /// What is added.
    pub effects: Effects,
}

/// Why there is no decay.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum DecayError {
    /// The mode does not oscillate, or a parameter is no number.
    #[error("{name} is {got}, expected {expected}")]
    Value {
        /// What it is.
        name: &'static str,
        /// What came.
        got: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// The amplitude grows without end at these parameters.
    #[error("the motion grows without bound (at {t_s} s)")]
    Diverges {
        /// When it was noticed.
        t_s: f64,
    },
}

/// Steps of the integrator per radian of the mode.
const STEPS_PER_RADIAN: f64 = 4.0;
/// Spacings of rows that differ by less, relatively, are the same but for rounding.
const EVEN: f64 = 1e-11;
/// The fifth power of the spring, over the square of the third.
const QUINTIC: f64 = 21.0 / 80.0;

impl Decay {
    /// Readings at the rising times `t_s` (s, from 0 on), from the start `x(0) = a`, `x'(0) = -gamma omega a + omega_d b`: without
    /// effects `exp(-gamma omega t) (a cos(omega_d t) + b sin(omega_d t))`, in closed form; else integrated (with the
    /// turning points of dry friction found), continuously as the effects vanish.
    ///
    /// # Errors
    /// [`DecayError`].
    pub fn read(&self, t_s: &[f64], [a, b]: [f64; 2], out: &mut [f64]) -> Result<(), DecayError> {
        self.check()?;
        let e = &self.effects;
        let linear = e.friction == 0.0
            && e.quadratic_per_reading == 0.0
            && (e.frequency_change == 0.0 || e.largest_amplitude == 0.0);
        let damped = self.omega_rad_s * (1.0 - self.damping_ratio * self.damping_ratio).sqrt();
        let start = [a, -self.damping_ratio * self.omega_rad_s * a + damped * b];
        if linear {
            self.carry(t_s, start, out);
            return Ok(());
        }
        self.integrate(t_s, start, out)
    }

    /// Relative change of the frequency of the motion through the start `[a, b]` (as in [`Self::read`]), viscosity and friction left
    /// out.
    pub fn frequency_shift(&self, [a, b]: [f64; 2]) -> f64 {
        let s = self.stiffening();
        let potential = |u: f64| u + 0.5 * u * u + QUINTIC / 3.0 * u.powi(3);
        // The energy of the start is that of the turning point A, where u = s A^2.
        let energy = potential(s * a * a) + s * b * b;
        let mut u = energy;
        for _ in 0..20 {
            // Above zero everywhere: however soft, this spring always pulls back.
            let slope = 1.0 + u + QUINTIC * u * u;
            u = u - (potential(u) - energy) / slope;
        }
        3.0 / 8.0 * u
    }

    /// The cubic part of the spring, relative to the linear one, in 1/reading^2: the first harmonic of one of relative strength
    /// s A^2 has the frequency 1 + 3/8 s A^2 - 21/256 s^2 A^4 (Nayfeh and Mook 1979, doi:10.1002/9783527617586, section 2.3); a
    /// fifth power of 21/80 s^2 takes the last term away.
    fn stiffening(&self) -> f64 {
        let largest = self.effects.largest_amplitude;
        if largest == 0.0 { 0.0 } else { 8.0 / 3.0 * self.effects.frequency_change / (largest * largest) }
    }

    fn check(&self) -> Result<(), DecayError> {
        let e = &self.effects;
        let range = |name, got: f64, expected, fine: bool| {
            if fine { Ok(()) } else { Err(DecayError::Value { name, got, expected }) }
        };
        let (omega, ratio) = (self.omega_rad_s, self.damping_ratio);
        range("omega_rad_s", omega, "above 0", omega > 0.0 && omega.is_finite())?;
        range("damping_ratio", ratio, "in [0, 1)", (0.0..1.0).contains(&ratio))?;
        range("friction", e.friction, "0 or more", e.friction >= 0.0 && e.friction.is_finite())?;
        range("frequency_change", e.frequency_change, "a number", e.frequency_change.is_finite())?;
        let quadratic = e.quadratic_per_reading;
        range("quadratic_per_reading", quadratic, "0 or more", quadratic >= 0.0 && quadratic.is_finite())
    }

    /// The linear motion, from row to row; rows that are evenly spaced share their sines.
    fn carry(&self, t_s: &[f64], [mut x, mut v]: [f64; 2], out: &mut [f64]) {
        let mut now = 0.0;
        let (mut span, mut carry) = (0.0, Carry::new(self, 0.0));
        for (reading, &t) in out.iter_mut().zip(t_s) {
            let h = t - now;
            if !(f64::abs(h - span) <= EVEN * h.abs()) {
                (span, carry) = (h, Carry::new(self, h));
            }
            (x, v) = carry.carry(x, v);
            *reading = x;
            now = t;
        }
    }

    /// What the effects add to the acceleration.
    fn push(&self, x: f64, v: f64, stiffening: f64, force: f64) -> f64 {
        let w = self.omega_rad_s;
        let cubic = stiffening * x * x;
        -w * w * x * cubic * (1.0 + QUINTIC * cubic)
            - self.effects.quadratic_per_reading * v.abs() * v
            - force
    }

    fn integrate(&self, t_s: &[f64], start: [f64; 2], out: &mut [f64]) -> Result<(), DecayError> {
        let (w, friction) = (self.omega_rad_s, self.effects.friction);
        let stiffening = self.stiffening();
        let bound = 1e3 * (start[0].abs() + start[1].abs() / w + friction);
        let mut state = Motion { x: start[0], v: start[1], direction: 0.0 };
        state.set_off(w, friction);
        let mut now = 0.0;
        let mut stride = Stride::new(self, 0.0);
        for (reading, &t) in out.iter_mut().zip(t_s) {
            let span = t - now;
            if span > 0.0 && !state.stuck() {
                let steps = (span * w * STEPS_PER_RADIAN).ceil().max(1.0);
                let h = span / steps;
                if (h - stride.h).abs() > EVEN * h {
                    stride = Stride::new(self, h);
                }
                for _ in 0..steps as usize {
                    self.step(&mut state, &stride, stiffening);
                    if state.stuck() {
                        break;
                    }
                }
                now = t;
            }
            if !(state.x.abs() <= bound) {
                return Err(DecayError::Diverges { t_s: t });
            }
            *reading = state.x;
        }
        Ok(())
    }

    /// One step, with the turning points inside it.
    fn step(&self, state: &mut Motion, stride: &Stride, stiffening: f64) {
        let friction = self.effects.friction * self.omega_rad_s * self.omega_rad_s;
        let mut part = *stride;
        for _ in 0..8 {
            let force = friction * state.direction;
            let (x, v) = self.runge_kutta(state, &part, stiffening, force);
            if friction == 0.0 || v * state.direction > 0.0 {
                (state.x, state.v) = (x, v);
                return;
            }
            let turn = self.turning_point(state, part.h, stiffening, force);
            let (x, _) = self.runge_kutta(state, &turn, stiffening, force);
            (state.x, state.v) = (x, 0.0);
            state.set_off(self.omega_rad_s, self.effects.friction);
            let left = part.h - turn.h;
            if state.stuck() || left <= 1e-12 * stride.h {
                return;
            }
            part = Stride::new(self, left);
        }
    }

    /// The stride after which the motion turns, somewhere within `h` (the speed is monotone there): Newton's method
    /// between brackets.
    fn turning_point(&self, state: &Motion, h: f64, stiffening: f64, force: f64) -> Stride {
        let (mut low, mut high) = (0.0, h);
        let mut guess = 0.5 * h;
        for _ in 0..60 {
            let (x, v) = self.runge_kutta(state, &Stride::new(self, guess), stiffening, force);
            if v * state.direction > 0.0 {
                low = guess;
            } else {
                high = guess;
            }
            let w = self.omega_rad_s;
            let pull = -w * w * x - 2.0 * self.damping_ratio * w * v + self.push(x, v, stiffening, force);
            let newton = guess - v / pull;
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            let still = (next - guess).abs() <= 1e-13 * h;
            guess = next;
            if still {
                break;
            }
        }
        Stride::new(self, guess)
    }

    /// Fourth-order Runge-Kutta on what the effects add, the linear motion being exact (Lawson 1967,
    /// doi:10.1137/0704033): with no effect there is no error, whatever the step.
    fn runge_kutta(&self, s: &Motion, stride: &Stride, stiffening: f64, force: f64) -> (f64, f64) {
        let (h, half, whole) = (stride.h, &stride.half, &stride.whole);
        let push = |(x, v): (f64, f64)| self.push(x, v, stiffening, force);
        let k1 = push((s.x, s.v));
        let k2 = push(half.carry(s.x, s.v + 0.5 * h * k1));
        let (x3, v3) = half.carry(s.x, s.v);
        let k3 = push((x3, v3 + 0.5 * h * k2));
        let (x4, v4) = whole.carry(s.x, s.v);
        let (dx, dv) = half.carry(0.0, h * k3);
        let k4 = push((x4 + dx, v4 + dv));
        let (x, v) = whole.carry(s.x, s.v + h / 6.0 * k1);
        let (dx, dv) = half.carry(0.0, h / 3.0 * (k2 + k3));
        (x + dx, v + dv + h / 6.0 * k4)
    }
}

/// The linear motion over a time and over half of it.
#[derive(Debug, Clone, Copy)]
struct Stride {
    h: f64,
    half: Carry,
    whole: Carry,
}

impl Stride {
    fn new(decay: &Decay, h: f64) -> Self {
        Self { h, half: Carry::new(decay, 0.5 * h), whole: Carry::new(decay, h) }
    }
}

/// The linear motion over a time: position and speed after it from those before.
#[derive(Debug, Clone, Copy)]
struct Carry([f64; 4]);

impl Carry {
    fn new(decay: &Decay, h: f64) -> Self {
        let (w, ratio) = (decay.omega_rad_s, decay.damping_ratio);
        let damped = w * (1.0 - ratio * ratio).sqrt();
        let (sin, cos) = (damped * h).sin_cos();
        let (fade, tilt) = ((-ratio * w * h).exp(), ratio * w / damped);
        Self([
            fade * (cos + tilt * sin),
            fade * sin / damped,
            -fade * w * w / damped * sin,
            fade * (cos - tilt * sin),
        ])
    }

    fn carry(&self, x: f64, v: f64) -> (f64, f64) {
        let m = &self.0;
        (m[0] * x + m[1] * v, m[2] * x + m[3] * v)
    }
}

/// Position and speed, and which way dry friction points (0: at rest).
struct Motion {
    x: f64,
    v: f64,
    direction: f64,
}

impl Motion {
    /// The direction of motion from here: that of the speed, or, at a turning point, that of the pull where it beats
    /// friction.
    fn set_off(&mut self, omega: f64, friction: f64) {
        self.direction = if self.v != 0.0 {
            self.v.signum()
        } else if self.x.abs() > friction && omega > 0.0 {
            -self.x.signum()
        } else {
            0.0
        };
    }

    fn stuck(&self) -> bool {
        self.direction == 0.0 && self.v == 0.0
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    const MODE: Decay = Decay {
        omega_rad_s: 20.0,
        damping_ratio: 0.01,
        effects: Effects {
            friction: 0.0,
            quadratic_per_reading: 0.0,
            frequency_change: 0.0,
            largest_amplitude: 1.0,
        },
    };

    fn read(decay: Decay, times: &[f64], start: [f64; 2]) -> Vec<f64> {
        let mut out = vec![0.0; times.len()];
        decay.read(times, start, &mut out).unwrap();
        out
    }

    fn times(n: usize, step: f64) -> Vec<f64> {
        (0..n).map(|i| i as f64 * step).collect()
    }

    #[test]
    fn the_linear_motion_is_the_formula_at_any_spacing() {
        for power in [1.0, 1.7] {
            let t: Vec<f64> = times(2000, 0.01).into_iter().map(|t| 0.3 + t.powf(power)).collect();
            let x = read(MODE, &t, [0.7, -0.4]);
            let damped = 20.0 * (1.0 - 1e-4f64).sqrt();
            for (x, t) in x.iter().zip(&t) {
                let exact = (-0.2 * t).exp() * (0.7 * (damped * t).cos() - 0.4 * (damped * t).sin());
                approx::assert_relative_eq!(*x, exact, epsilon = 1e-11);
            }
        }
    }

    /// The integrator with effects of vanishing size is the closed form: there is no jump where an effect is switched on.
    #[test]
    fn the_integrator_agrees_with_the_closed_form() {
        let t = times(400, 0.02);
        let exact = read(MODE, &t, [0.7, -0.4]);
        let tiny = Effects { quadratic_per_reading: 1e-14, ..MODE.effects };
        let integrated = read(Decay { effects: tiny, ..MODE }, &t, [0.7, -0.4]);
        for (a, b) in exact.iter().zip(&integrated) {
            approx::assert_relative_eq!(a, b, epsilon = 1e-11);
        }
    }

    /// Without viscosity, dry friction takes four of it per cycle, in a straight line, and then holds the surface.
    #[test]
    fn dry_friction_takes_four_of_it_per_cycle_and_stops() {
        let decay = Decay { damping_ratio: 0.0, effects: Effects { friction: 0.02, ..MODE.effects }, ..MODE };
        let cycle = std::f64::consts::TAU / 20.0;
        let tops: Vec<f64> = read(decay, &times(20, cycle), [1.0, 0.0]);
        for (n, top) in tops.iter().take(12).enumerate() {
            approx::assert_relative_eq!(*top, 1.0 - 0.08 * n as f64, epsilon = 1e-5);
        }
        let last = &read(decay, &times(600, 0.02), [1.0, 0.0])[500..];
        assert!(last.iter().all(|x| x == &last[0] && x.abs() <= 0.02));
    }

    /// Averaged over a cycle, quadratic damping takes 8/3 c A^2 (Krylov and Bogoliubov 1943).
    #[test]
    fn quadratic_damping_takes_its_share() {
        let c = 1e-3;
        let decay = Decay {
            damping_ratio: 0.0,
            effects: Effects { quadratic_per_reading: c, ..MODE.effects },
            ..MODE
        };
        let cycle = std::f64::consts::TAU / 20.0;
        let tops = read(decay, &times(50, cycle), [1.0, 0.0]);
        let expected = 1.0 / (1.0 + 8.0 / 3.0 * c * 49.0);
        approx::assert_relative_eq!(tops[49], expected, max_relative = 1e-4);
    }

    /// Angular frequency of a motion without damping, by its zero crossings.
    fn frequency(decay: Decay, start: [f64; 2]) -> f64 {
        let x = read(decay, &times(40_000, 2.5e-4), start);
        let crossings: Vec<f64> = x
            .windows(2)
            .enumerate()
            .filter(|(_, w)| w[0] > 0.0 && w[1] <= 0.0)
            .map(|(i, w)| (i as f64 + w[0] / (w[0] - w[1])) * 2.5e-4)
            .collect();
        let last = crossings.len() - 1;
        std::f64::consts::TAU * last as f64 / (crossings[last] - crossings[0])
    }

    /// Zero crossings come sooner by the stated share.
    #[test]
    fn the_frequency_changes_by_the_stated_share() {
        let decay =
            Decay { damping_ratio: 0.0, effects: Effects { frequency_change: 0.01, ..MODE.effects }, ..MODE };
        approx::assert_relative_eq!(frequency(decay, [1.0, 0.0]), 20.2, max_relative = 2e-4);
    }

    /// From any phase, for a wave that is slower or faster when it is high.
    #[test]
    fn the_shift_of_a_start_is_that_of_its_motion() {
        for frequency_change in [-0.06, -0.02, 0.03] {
            let effects = Effects { frequency_change, ..MODE.effects };
            let decay = Decay { damping_ratio: 0.0, effects, ..MODE };
            for start in [[1.0, 0.0], [0.0, 0.95], [0.6, -0.7]] {
                let found = frequency(decay, start) / 20.0 - 1.0;
                approx::assert_relative_eq!(decay.frequency_shift(start), found, max_relative = 3e-3);
            }
        }
    }

    #[test]
    fn what_cannot_be_is_an_error() {
        let mut out = [0.0; 2];
        let bad = [
            Decay { omega_rad_s: 0.0, ..MODE },
            Decay { damping_ratio: 1.0, ..MODE },
            Decay { damping_ratio: f64::NAN, ..MODE },
            Decay { effects: Effects { friction: -1.0, ..MODE.effects }, ..MODE },
        ];
        for decay in bad {
            assert!(matches!(decay.read(&[0.0, 1.0], [1.0, 0.0], &mut out), Err(DecayError::Value { .. })));
        }
        // A spring so stiff that the steps are too long for it.
        let stiff = Decay { effects: Effects { frequency_change: 50.0, ..MODE.effects }, ..MODE };
        assert!(matches!(stiff.read(&[0.0, 5.0], [3.0, 0.0], &mut out), Err(DecayError::Diverges { .. })));
    }
}
