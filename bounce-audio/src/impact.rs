//! Impacts on a table: the velocities before and after them, and what restitution and reflection make of one another.

/// Velocity in m/s; z up.
pub type Velocity = [f64; 3];

/// A flight from one impact to the next, as it was heard: where it went and how long it took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hop {
    /// From the one impact to the next, m.
    pub displacement_m: [f64; 3],
    /// Duration of the flight, s, above zero.
    pub duration_s: f64,
}

/// Steps of the integrator over one flight.
const STEPS: usize = 16;
/// Rounds of shooting; each gains about a factor of `k v T`.
const ROUNDS: usize = 14;

impl Hop {
    /// Velocities at launch and just before landing, under gravity (m/s^2) and quadratic drag `a = -k |v| v` (k in 1/m, 0 for
    /// none: closed form).
    ///
    /// With drag the launch is found by shooting; `k |v| T` has to be well below 1, as it is for balls on a table.
    pub fn velocities(&self, gravity_m_s2: f64, drag_per_m: f64) -> (Velocity, Velocity) {
        let t = self.duration_s;
        let mut launch = self.displacement_m.map(|d| d / t);
        launch[2] += 0.5 * gravity_m_s2 * t;
        let mut landing = launch;
        landing[2] -= gravity_m_s2 * t;
        if drag_per_m == 0.0 {
            return (launch, landing);
        }
        for _ in 0..ROUNDS {
            let (reached, velocity) = fly(launch, t, gravity_m_s2, drag_per_m);
            landing = velocity;
            let mut off = 0.0;
            for axis in 0..3 {
                let missed = (self.displacement_m[axis] - reached[axis]) / t;
                launch[axis] += missed;
                off += missed * missed;
            }
            if off < 1e-26 * speed(&launch).powi(2) {
                break;
            }
        }
        (launch, landing)
    }
}

/// Where a ball gets to, and its velocity there (classical Runge-Kutta).
fn fly(launch: Velocity, duration_s: f64, gravity_m_s2: f64, drag_per_m: f64) -> ([f64; 3], Velocity) {
    let pull = |v: &Velocity| {
        let drag = -drag_per_m * speed(v);
        [drag * v[0], drag * v[1], drag * v[2] - gravity_m_s2]
    };
    let along = |v: &Velocity, a: &Velocity, h: f64| [v[0] + h * a[0], v[1] + h * a[1], v[2] + h * a[2]];
    let h = duration_s / STEPS as f64;
    let (mut place, mut v) = ([0.0; 3], launch);
    for _ in 0..STEPS {
        let a1 = pull(&v);
        let v2 = along(&v, &a1, 0.5 * h);
        let a2 = pull(&v2);
        let v3 = along(&v, &a2, 0.5 * h);
        let a3 = pull(&v3);
        let v4 = along(&v, &a3, h);
        let a4 = pull(&v4);
        for i in 0..3 {
            place[i] += h / 6.0 * (v[i] + 2.0 * (v2[i] + v3[i]) + v4[i]);
            v[i] += h / 6.0 * (a1[i] + 2.0 * (a2[i] + a3[i]) + a4[i]);
        }
    }
    (place, v)
}

/// Magnitude of a velocity.
pub fn speed(v: &Velocity) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Speed of a ball that fell from rest through a height (m) with quadratic drag.
pub fn speed_after_drop(height_m: f64, gravity_m_s2: f64, drag_per_m: f64) -> f64 {
    let fall = 2.0 * gravity_m_s2 * height_m;
    let x = 2.0 * drag_per_m * height_m;
    // (1 - exp(-x)) / x, which is 1 without drag.
    let share = if x.abs() < 1e-12 { 1.0 } else { -(-x).exp_m1() / x };
    (fall * share).max(0.0).sqrt()
}

/// How long a ball that leaves the table straight up (m/s) stays in the air, s, and the speed at which it lands, with
/// quadratic drag (1/m). Closed form: it rises like a tangent and falls like a hyperbolic one.
pub fn rebound(launch_m_s: f64, gravity_m_s2: f64, drag_per_m: f64) -> (f64, f64) {
    let x = drag_per_m * launch_m_s * launch_m_s / gravity_m_s2;
    // (atan r + asinh r) / r for r^2 = x.
    let shape = if x < 1e-3 {
        2.0 - x * (0.5 - x * (0.275 - x * (1.0 / 7.0 + 15.0 / 336.0)))
    } else {
        let r = x.sqrt();
        (r.atan() + r.asinh()) / r
    };
    (launch_m_s / gravity_m_s2 * shape, launch_m_s / (1.0 + x).sqrt())
}

/// The direction and relative speed that reflection on a table gives a ball, before restitution: the mirror image of its
/// velocity, a part `friction` of it along the table lost.
///
/// The table has the slopes `slope` (dz/dx, dz/dy).
pub fn reflected(before: &Velocity, slope: [f64; 2], friction: f64) -> Velocity {
    let length = (1.0 + slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
    let normal = [-slope[0] / length, -slope[1] / length, 1.0 / length];
    let across: f64 = before.iter().zip(&normal).map(|(v, n)| v * n).sum();
    let mut after = [0.0; 3];
    for i in 0..3 {
        let along = before[i] - across * normal[i];
        after[i] = (1.0 - friction) * along - across * normal[i];
    }
    after
}

/// The part along the table of a velocity's unit vector: where it heads, seen from above. Zero for a ball at rest.
pub fn heading(velocity: &Velocity) -> [f64; 2] {
    let size = speed(velocity);
    if size == 0.0 { [0.0; 2] } else { [velocity[0] / size, velocity[1] / size] }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;
    use crate::flight::{Flight, State};

    #[test]
    fn a_hop_without_drag_is_a_parabola() {
        let hop = Hop { displacement_m: [0.1, -0.02, 0.01], duration_s: 0.4 };
        let (launch, landing) = hop.velocities(10.0, 0.0);
        approx::assert_relative_eq!(launch[2], 2.0 + 0.025, max_relative = 1e-14);
        approx::assert_relative_eq!(landing[2], -2.0 + 0.025, max_relative = 1e-14);
        approx::assert_relative_eq!(launch[0] + landing[1], 0.2, max_relative = 1e-14);
    }

    /// The integrator of `flight`, on its own grid, comes to the same place.
    #[test]
    fn a_hop_with_drag_lands_where_it_was_heard() {
        for drag in [1e-3, 0.05, 0.15] {
            let hop = Hop { displacement_m: [0.2, 0.1, -0.01], duration_s: 0.45 };
            let (launch, landing) = hop.velocities(9.81, drag);
            let mut flight = Flight::<f64>::ballistic(9.81);
            flight.quadratic_per_m = drag;
            let start = State { position: [0.0; 3], velocity: launch };
            let mut states = [start; 2];
            flight.states(&start, &[0.0, 0.45], &mut states).unwrap();
            approx::assert_relative_eq!(states[1].position[..], hop.displacement_m[..], epsilon = 1e-7);
            approx::assert_relative_eq!(states[1].velocity[..], landing[..], epsilon = 1e-6);
        }
    }

    #[test]
    fn a_level_table_mirrors_and_a_tilted_one_turns_by_twice_its_angle() {
        assert_eq!(reflected(&[1.0, 2.0, -3.0], [0.0; 2], 0.0), [1.0, 2.0, 3.0]);
        assert_eq!(reflected(&[1.0, 2.0, -3.0], [0.0; 2], 0.25), [0.75, 1.5, 3.0]);
        let tilted = reflected(&[0.0, 0.0, -1.0], [0.0, -0.1f64.tan()], 0.0);
        approx::assert_relative_eq!(heading(&tilted)[1].abs(), 0.2f64.sin(), max_relative = 1e-12);
        assert!(tilted[1] > 0.0, "downhill");
        assert_eq!(heading(&[0.0; 3]), [0.0; 2]);
    }

    #[test]
    fn a_rebound_is_a_hop_straight_up() {
        for (launch, drag) in
            [(2.0, 0.0), (2.0, 1e-6), (3.0, 1.05e-3), (3.0, 1.1e-3), (2.5, 0.15), (1.0, 0.4)]
        {
            let (duration_s, lands) = rebound(launch, 9.81, drag);
            let (up, down) = Hop { displacement_m: [0.0; 3], duration_s }.velocities(9.81, drag);
            // Drag has a kink at the top of a flight straight up, which costs the integrator two digits.
            approx::assert_relative_eq!(up[2], launch, max_relative = 1e-6);
            approx::assert_relative_eq!(-down[2], lands, max_relative = 1e-6);
        }
    }

    #[test]
    fn drag_slows_a_fall() {
        approx::assert_relative_eq!(speed_after_drop(0.5, 10.0, 0.0), 10f64.sqrt(), max_relative = 1e-15);
        let slow = speed_after_drop(0.5, 10.0, 0.1);
        approx::assert_relative_eq!(slow * slow, 100.0 * (1.0 - (-0.1f64).exp()), max_relative = 1e-12);
    }
}
