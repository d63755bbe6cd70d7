//! The decay with its effects, integrated: Runge-Kutta about the exact linear motion, stopped at the turning points of dry friction.

use super::decay::{Decay, DecayError, QUINTIC};
use super::linear::{Propagator, Rows, STEPS_PER_RADIAN, Stretch};

impl Decay {
    /// What the effects add to the acceleration.
    fn push(&self, x: f64, v: f64, stiffening: f64, force: f64) -> f64 {
        let w = self.omega_rad_s;
        let cubic = stiffening * x * x;
        -w * w * x * cubic * (1.0 + QUINTIC * cubic)
            - self.effects.quadratic_per_reading * v.abs() * v
            - force
    }

    /// Readings with the effects, from position and speed at time 0, as [`Decay::read`]. Steps have a length of their own, whatever the
    /// rows are; each row is read off the step that holds it.
    pub(super) fn integrate(&self, t_s: &[f64], start: [f64; 2], out: &mut [f64]) -> Result<(), DecayError> {
        let (w, friction) = (self.omega_rad_s, self.effects.friction);
        let bound = 1e3 * (start[0].abs() + start[1].abs() / w + friction);
        let mut state = Motion { x: start[0], v: start[1], direction: 0.0 };
        state.set_off(w, friction);
        let whole = Stride::new(self, 1.0 / (w * STEPS_PER_RADIAN));
        let (mut begin, mut step) = (0.0, self.step(&state, &whole));
        // How the position moves within a step is worked out where a row lies in it, which is in few where rows are far apart.
        let mut taken = false;
        let mut rows = Rows::new(w, self.damping_ratio, out);
        let checked = |rows: &mut Rows<'_>| {
            rows.read();
            rows.beyond(bound).map_or(Ok(()), |row| Err(DecayError::Diverges { t_s: t_s[row] }))
        };
        for &t in t_s {
            while !state.stuck() && t >= begin + step.h {
                begin += step.h;
                state = step.end;
                // A wave that has grown beyond all bounds is not followed to the next row.
                if !(state.x.abs() <= bound) {
                    checked(&mut rows)?;
                    return Err(DecayError::Diverges { t_s: t });
                }
                step = self.step(&state, &whole);
                taken = false;
            }
            if state.stuck() {
                rows.known(state.x);
            } else {
                if !taken {
                    rows.step(self.motion(&state, &step, &whole));
                    taken = true;
                }
                rows.rows(std::iter::once((t - begin) / step.h));
            }
        }
        checked(&mut rows)
    }

    /// What dry friction adds to the acceleration, against the direction of the motion.
    fn force(&self, state: &Motion) -> f64 {
        self.effects.friction * self.omega_rad_s * self.omega_rad_s * state.direction
    }

    /// The step from a state, which ends at the turning point where dry friction has one.
    fn step(&self, begin: &Motion, whole: &Stride) -> Step {
        let (stiffening, force) = (self.stiffening(), self.force(begin));
        let advance = |stride: &Stride| self.runge_kutta(begin, stride, stiffening, force);
        let (x, v) = advance(whole);
        if self.effects.friction == 0.0 || v * begin.direction > 0.0 || begin.stuck() {
            return Step { h: whole.h, turn: None, end: Motion { x, v, ..*begin } };
        }
        if begin.v == 0.0 {
            // Hardly pulled beyond friction, and not moved by it.
            return Step { h: 0.0, turn: None, end: Motion { direction: 0.0, ..*begin } };
        }
        let turn = self.turning_point(begin, whole.h, stiffening, force);
        let mut end = Motion { x: advance(&turn).0, v: 0.0, ..*begin };
        end.set_off(self.omega_rad_s, self.effects.friction);
        Step { h: turn.h, turn: Some(turn), end }
    }

    /// The positions within a step, from what the effects add to the acceleration at both ends.
    fn motion(&self, begin: &Motion, step: &Step, whole: &Stride) -> Stretch {
        let (stiffening, force) = (self.stiffening(), self.force(begin));
        let push = |at: &Motion| self.push(at.x, at.v, stiffening, force);
        let [first, last] = [push(begin), push(&step.end)];
        let stride = step.turn.as_ref().unwrap_or(whole);
        let (w, ratio, h) = (self.omega_rad_s, self.damping_ratio, stride.h);
        let (x, v) = stride.whole.apply(begin.x, begin.v);
        let (x, v) = (step.end.x - x, step.end.v - v);
        let acceleration = last - w * w * x - 2.0 * ratio * w * v;
        let departing = Some((first * h * h, [x, v * h, acceleration * h * h]));
        Stretch { h, begin: [begin.x, begin.v], departing }
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
        if stiffening == 0.0 && self.effects.quadratic_per_reading == 0.0 {
            // The same sums where friction, which is constant, is all there is.
            let k = -force;
            let (x, v) = whole.apply(s.x, s.v + h / 6.0 * k);
            let (dx, dv) = half.apply(0.0, h / 3.0 * (k + k));
            return (x + dx, v + dv + h / 6.0 * k);
        }
        let push = |(x, v): (f64, f64)| self.push(x, v, stiffening, force);
        let k1 = push((s.x, s.v));
        let k2 = push(half.apply(s.x, s.v + 0.5 * h * k1));
        let (x3, v3) = half.apply(s.x, s.v);
        let k3 = push((x3, v3 + 0.5 * h * k2));
        let (x4, v4) = whole.apply(s.x, s.v);
        let (dx, dv) = half.apply(0.0, h * k3);
        let k4 = push((x4 + dx, v4 + dv));
        let (x, v) = whole.apply(s.x, s.v + h / 6.0 * k1);
        let (dx, dv) = half.apply(0.0, h / 3.0 * (k2 + k3));
        (x + dx, v + dv + h / 6.0 * k4)
    }
}

/// The linear motion over a time and over half of it.
#[derive(Debug, Clone, Copy)]
struct Stride {
    h: f64,
    half: Propagator,
    whole: Propagator,
}

impl Stride {
    fn new(decay: &Decay, h: f64) -> Self {
        let over = |h: f64| Propagator::new(decay.omega_rad_s, decay.damping_ratio, h);
        Self { h, half: over(0.5 * h), whole: over(h) }
    }
}

/// A step: how long it is, its stride where it ends at a turning point, and where it ends.
struct Step {
    h: f64,
    turn: Option<Stride>,
    end: Motion,
}

/// Position and speed, and which way dry friction points (0: at rest).
#[derive(Debug, Clone, Copy)]
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
