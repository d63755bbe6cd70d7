//! The free decay of a mode as a sensor reads it, with what real walls, surfaces and sensors add.

use super::linear::{Propagator, Rows, STEPS_PER_RADIAN, Stretch};

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
    /// Effects beyond the linear mode.
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

/// Where fewer rows than this lie in a step, working out each takes less time than the step does.
const ROWS_A_STEP: f64 = 3.0;

/// The fifth power of the spring, over the square of the third.
pub(super) const QUINTIC: f64 = 21.0 / 80.0;

impl Decay {
    /// Readings at the rising times `t_s` (s, from 0 on), from the start `x(0) = a`, `x'(0) = -gamma omega a + omega_d b`: without
    /// effects `exp(-gamma omega t) (a cos(omega_d t) + b sin(omega_d t))`, in closed form; else integrated (with the
    /// turning points of dry friction found), continuously as the effects vanish.
    ///
    /// # Errors
    /// [`DecayError`].
    pub fn read(&self, t_s: &[f64], [a, b]: [f64; 2], out: &mut [f64]) -> Result<(), DecayError> {
        self.check()?;
        let damped = self.omega_rad_s * (1.0 - self.damping_ratio * self.damping_ratio).sqrt();
        let start = [a, -self.damping_ratio * self.omega_rad_s * a + damped * b];
        if !self.is_linear() {
            return self.integrate(t_s, start, out);
        }
        let steps = self.omega_rad_s * STEPS_PER_RADIAN * t_s.last().unwrap_or(&0.0);
        if (t_s.len() as f64) < ROWS_A_STEP * steps {
            for (y, t) in out.iter_mut().zip(t_s) {
                let (cos, sin) = self.unit(*t);
                *y = a * cos + b * sin;
            }
        } else {
            self.propagate(t_s, start, out);
        }
        Ok(())
    }

    /// Readings of the linear motion at a time, from the starts `[1, 0]` and `[0, 1]`.
    fn unit(&self, t: f64) -> (f64, f64) {
        let (omega, ratio) = (self.omega_rad_s, self.damping_ratio);
        let (sin, cos) = (omega * (1.0 - ratio * ratio).sqrt() * t).sin_cos();
        let fade = (-ratio * omega * t).exp();
        (fade * cos, fade * sin)
    }

    /// The decay without its effects, at the rising times `t_s` (s, from 0 on).
    ///
    /// # Errors
    /// [`DecayError::Value`].
    pub fn linear<'a>(&self, t_s: &'a [f64]) -> Result<LinearDecay<'a>, DecayError> {
        self.check()?;
        let decay = Self { effects: Effects::default(), ..*self };
        let (cos, sin) = t_s.iter().map(|t| decay.unit(*t)).unzip();
        Ok(LinearDecay { decay, t_s, unit: [cos, sin] })
    }

    /// Whether no effect is on, so that readings are proportional to the start.
    pub fn is_linear(&self) -> bool {
        let e = &self.effects;
        let even = e.frequency_change == 0.0 || e.largest_amplitude == 0.0;
        e.friction == 0.0 && e.quadratic_per_reading == 0.0 && even
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
    pub(super) fn stiffening(&self) -> f64 {
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

    /// The linear motion: rows that are close together are read off the step that holds them.
    fn propagate(&self, t_s: &[f64], [mut x, mut v]: [f64; 2], out: &mut [f64]) {
        let (w, ratio) = (self.omega_rad_s, self.damping_ratio);
        let per_step = w * STEPS_PER_RADIAN;
        let step = 1.0 / per_step;
        let over = |ahead: f64| Propagator::new(w, ratio, ahead * step);
        let (whole, mut begin) = (Propagator::new(w, ratio, step), 0.0);
        // Rows that are evenly spaced lie few different numbers of steps apart.
        let mut known = [(0.0, whole); 2];
        let mut rows = Rows::new(w, ratio, out);
        let mut left = t_s;
        while let Some(&t) = left.first() {
            if t - begin >= step {
                // Whole steps, of a number that is not negative.
                let ahead = (((t - begin) / step) as u64 as f64).max(1.0);
                let to_there = if ahead == 1.0 {
                    whole
                } else if let Some((_, known)) = known.iter().find(|(steps, _)| *steps == ahead) {
                    *known
                } else {
                    known = [(ahead, over(ahead)), known[0]];
                    known[0].1
                };
                (x, v) = to_there.apply(x, v);
                begin += ahead * step;
            }
            rows.step(Stretch { h: step, begin: [x, v], departing: None });
            // The row that led here lies in the step, rounding or not.
            let within = left.iter().enumerate().take_while(|(row, t)| *row == 0 || **t - begin < step);
            let taken = rows.rows(within.map(|(_, t)| (t - begin) * per_step));
            left = &left[taken..];
        }
        rows.read();
    }
}

/// A decay without effects at some times: readings from every start, and their derivatives, are sums of two readings.
#[derive(Debug, Clone)]
pub struct LinearDecay<'a> {
    decay: Decay,
    t_s: &'a [f64],
    unit: [Vec<f64>; 2],
}

impl LinearDecay<'_> {
    /// Readings from the starts `[1, 0]` and `[0, 1]` of [`Decay::read`].
    pub fn unit(&self) -> &[Vec<f64>; 2] {
        &self.unit
    }

    /// Readings from the start `[a, b]`, one a time.
    pub fn read(&self, [a, b]: [f64; 2], out: &mut [f64]) {
        let [cos, sin] = &self.unit;
        for ((out, cos), sin) in out.iter_mut().zip(cos).zip(sin) {
            *out = a * cos + b * sin;
        }
    }

    /// Derivatives of the readings from the start `[a, b]`, where the angular frequency changes by `omega_rad_s` and the damping ratio
    /// by `damping_ratio` for each unit of what they are derived by.
    pub fn derivative(&self, [a, b]: [f64; 2], [omega_rad_s, damping_ratio]: [f64; 2], out: &mut [f64]) {
        let (omega, ratio) = (self.decay.omega_rad_s, self.decay.damping_ratio);
        let root = (1.0 - ratio * ratio).sqrt();
        let fade = -(ratio * omega_rad_s + omega * damping_ratio);
        let turn = root * omega_rad_s - omega * ratio / root * damping_ratio;
        let [cos, sin] = &self.unit;
        for (((out, t), cos), sin) in out.iter_mut().zip(self.t_s).zip(cos).zip(sin) {
            *out = t * ((fade * a + turn * b) * cos + (fade * b - turn * a) * sin);
        }
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
    /// Derivatives of the linear decay in closed form are those of its readings.
    #[test]
    fn derivatives_of_the_linear_decay_agree_with_differences() {
        let t: Vec<f64> = (0..200).map(|i| 0.03 * f64::from(i)).collect();
        let (decay, start) = (Decay { effects: Effects::default(), ..MODE }, [0.7, -0.4]);
        let linear = decay.linear(&t).unwrap();
        let mut out = vec![0.0; t.len()];
        linear.read(start, &mut out);
        for (a, b) in out.iter().zip(read(decay, &t, start)) {
            approx::assert_abs_diff_eq!(*a, b, epsilon = 1e-12);
        }
        for [omega, ratio] in [[1.0, 0.0], [0.0, 1.0], [0.3, -0.2]] {
            linear.derivative(start, [omega, ratio], &mut out);
            let at = |h: f64| {
                let omega_rad_s = decay.omega_rad_s + h * omega;
                read(
                    Decay { omega_rad_s, damping_ratio: decay.damping_ratio + h * ratio, ..decay },
                    &t,
                    start,
                )
            };
            let [high, low] = [1e-5, -1e-5].map(at);
            for (row, exact) in out.iter().enumerate() {
                approx::assert_relative_eq!(
                    *exact,
                    (high[row] - low[row]) / 2e-5,
                    max_relative = 1e-5,
                    epsilon = 1e-5
                );
            }
        }
    }

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
