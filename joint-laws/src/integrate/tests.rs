#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
use super::*;
use crate::Dual;
use crate::friction::DryFriction;
use approx::assert_relative_eq;

/// A mass on a spring that rubs, pushed by a constant force: x'' = push - omega^2 x - friction.
struct Rubbing<T> {
    omega: T,
    push: T,
    law: DryFriction<T>,
    contact: [Contact; 1],
    evaluations: usize,
}

impl<T: Number> Rubbing<T> {
    fn new(omega: T, push: T, level: T) -> Self {
        let law = DryFriction { level, ..DryFriction::none(T::from(0.1)) };
        Self { omega, push, law, contact: [Contact { velocity: 1 }], evaluations: 0 }
    }
}

impl<T: Number> Machine<T> for Rubbing<T> {
    fn contacts(&self) -> &[Contact] {
        &self.contact
    }
    fn ceilings(&self) -> &[Ceiling<T>] {
        &[]
    }
    fn reads_rates(&self) -> bool {
        true
    }
    fn smooth(&mut self, _: f64, x: &[T], rates: &mut [T]) {
        self.evaluations += 1;
        rates[0] = x[1];
        rates[1] = self.push - self.omega * self.omega * x[0];
    }
    fn push(&mut self, _: usize, force: T, _: f64, _: &[T], rates: &mut [T]) {
        rates[1] += force;
    }
    fn resistance(&mut self, _: usize, forward: bool, _: f64, x: &[T]) -> T {
        self.law.resistance(forward, x[1], T::from(0.0))
    }
}

fn follow_by<T: Number>(method: Method, step_s: f64, machine: &mut Rubbing<T>, x: &mut [T; 2], until: f64) {
    let mut integrator = Integrator::new(method, 2, step_s);
    let mut t = 0.0;
    integrator.settle(machine, t, x);
    integrator.advance(machine, &mut t, x, until, &[], &[], |_, _, _| ()).unwrap();
}

fn follow<T: Number>(machine: &mut Rubbing<T>, x: &mut [T; 2], until: f64) {
    follow_by(Method::Kutta, 0.02, machine, x, until);
}

/// Each half swing is a cosine about a centre moved by friction; the amplitude falls by twice level / omega^2, and the mass stays
/// where the spring no longer overcomes the friction.
#[test]
fn dry_friction_takes_the_same_from_every_half_swing() {
    let (omega, level) = (3.0, 0.8);
    let loss = 2.0 * level / (omega * omega);
    let mut machine = Rubbing::new(omega, 0.0, level);
    let half = std::f64::consts::PI / omega;
    let mut x = [1.0, 0.0];
    follow(&mut machine, &mut x, 2.5 * half);
    // Two half swings down to 1 - 2 loss, then half of the third, about -loss / 2... a quarter swing from the turning point.
    let turning = 1.0 - 2.0 * loss;
    assert_relative_eq!(x[0], loss / 2.0, epsilon = 1e-6);
    assert_relative_eq!(x[1], -(turning - loss / 2.0) * omega, epsilon = 1e-6);
    let mut x = [1.0, 0.0];
    follow(&mut machine, &mut x, 30.0 * half);
    // |x| falls by the loss until the spring cannot overcome the friction: |x| <= loss / 2.
    let mut rest: f64 = 1.0;
    while rest > loss / 2.0 {
        rest -= loss;
    }
    assert_relative_eq!(x[0].abs(), rest.abs(), epsilon = 1e-6);
    assert_eq!(x[1], 0.0);
}

#[test]
fn a_force_below_the_friction_moves_nothing() {
    let mut x = [0.0, 0.0];
    follow(&mut Rubbing::new(2.0, 0.79, 0.8), &mut x, 5.0);
    assert_eq!(x, [0.0, 0.0]);
    follow(&mut Rubbing::new(2.0, 0.81, 0.8), &mut x, 5.0);
    assert!(x[0] > 0.0);
}

/// Derivatives with respect to frequency, push, friction and start, across turning points, against differences.
#[test]
fn derivatives_are_exact_across_events() {
    type D = Dual<4>;
    let at = |p: [f64; 4]| {
        let mut x = [p[3], 0.3];
        follow(&mut Rubbing::new(p[0], p[1], p[2]), &mut x, 4.3);
        x
    };
    for p in [[3.0, 0.2, 0.5, 1.0], [3.0, 0.0, 0.0, 1.0], [5.0, -0.4, 0.1, 0.2], [2.0, 0.3, 1.5, 2.0]] {
        let dual = |k: usize| D::parameter(p[k], k);
        let mut x = [dual(3), D::from(0.3)];
        follow(&mut Rubbing::new(dual(0), dual(1), dual(2)), &mut x, 4.3);
        for k in 0..4 {
            let h = 1e-6;
            let (mut up, mut down) = (p, p);
            up[k] += h;
            let width = if k == 2 && p[2] == 0.0 { h } else { 2.0 * h };
            down[k] -= width - h;
            let (up, down) = (at(up), at(down));
            for i in 0..2 {
                let expected = (up[i] - down[i]) / width;
                let got = x[i].eps[k];
                assert_relative_eq!(got, expected, epsilon = 2e-4, max_relative = 2e-4);
            }
        }
    }
}

/// A tank that is filled faster than it drains stays at its brim, and leaves it when the inflow stops.
struct Tank {
    inflow: f64,
    ceiling: [Ceiling<f64>; 1],
}

impl Machine<f64> for Tank {
    fn contacts(&self) -> &[Contact] {
        &[]
    }
    fn ceilings(&self) -> &[Ceiling<f64>] {
        &self.ceiling
    }
    fn smooth(&mut self, t: f64, x: &[f64], rates: &mut [f64]) {
        rates[0] = self.inflow * (1.0 - t) - 0.1 * x[0];
    }
    fn push(&mut self, _: usize, _: f64, _: f64, _: &[f64], _: &mut [f64]) {}
    fn resistance(&mut self, _: usize, _: bool, _: f64, _: &[f64]) -> f64 {
        0.0
    }
}

#[test]
fn a_level_stays_at_its_ceiling_while_more_comes_in_than_leaves() {
    let mut tank = Tank { inflow: 2.0, ceiling: [Ceiling { state: 0, height: 0.5 }] };
    let mut integrator = Integrator::new(Method::Kutta, 1, 0.01);
    let (mut t, mut x) = (0.0, [0.0]);
    integrator.settle(&mut tank, t, &mut x);
    integrator.advance(&mut tank, &mut t, &mut x, 0.9, &[], &[], |_, _, _| ()).unwrap();
    assert_eq!(x[0], 0.5);
    // It leaves the brim when 2 (1 - t) = 0.05, t = 0.975.
    integrator.advance(&mut tank, &mut t, &mut x, 1.475, &[], &[], |_, _, _| ()).unwrap();
    // From then on x' = -2 s + 0.05 - 0.1 x, s = t - 0.975.
    let (a, s): (f64, f64) = (0.1, 0.5);
    let particular = |s: f64| -2.0 * s / a + 2.0 / (a * a) + 0.05 / a;
    let expected = particular(s) + (0.5 - particular(0.0)) * (-a * s).exp();
    assert_relative_eq!(x[0], expected, epsilon = 1e-9);
}

/// Long steps read at many times give what short steps give, with and without friction, readings that come a moment later differ by the
/// rates, and so do the rates: friction is among them.
#[test]
fn readings_within_long_steps_are_those_of_short_ones() {
    for level in [0.0, 0.3] {
        let mut integrator = Integrator::new(Method::DormandPrince, 2, 0.05);
        let mut machine = Rubbing::new(Dual::<1>::from(3.0), Dual::from(0.2), Dual::from(level));
        let reads: Vec<Reading> =
            (0..40).map(|k| Reading { t_s: 0.1 * f64::from(k), row: k as usize, shift: 0 }).collect();
        let (mut t, mut x) = (0.0, [Dual::from(1.0), Dual::from(0.0)]);
        integrator.settle(&mut machine, t, &mut x);
        let mut read = vec![[Dual::from(0.0); 3]; reads.len()];
        let later = [Dual::parameter(0.0, 0)];
        integrator
            .advance(&mut machine, &mut t, &mut x, 4.0, &reads, &later, |_, r, at| {
                read[r.row] = [at.x[0], at.x[1], at.rates[1]];
            })
            .unwrap();
        for (reading, got) in reads.iter().zip(&read).skip(1) {
            let mut x = [1.0, 0.0];
            follow_by(Method::Kutta, 1e-3, &mut Rubbing::new(3.0, 0.2, level), &mut x, reading.t_s);
            for i in 0..2 {
                assert_relative_eq!(got[i].re, x[i], epsilon = 1e-5);
            }
            assert_relative_eq!(got[0].eps[0], x[1], epsilon = 2e-4);
            let acceleration = 0.2 - 9.0 * x[0] - level * x[1].signum();
            assert_relative_eq!(got[2].re, acceleration, epsilon = 1e-4);
            assert_relative_eq!(got[2].eps[0], -9.0 * x[1], epsilon = 2e-3);
        }
    }
}

/// Friction that fades with the speed within milliseconds: controlled steps give what steps as fine as the finest of them give, at a fifth
/// of the evaluations or less.
#[test]
fn controlled_steps_are_short_only_where_a_law_changes() {
    let (coarse_s, finest_s) = (0.1, 0.5e-3);
    let follow = |controlled: bool| {
        let mut machine = Rubbing::new(3.0, 0.0, 0.2);
        (machine.law.stribeck_level, machine.law.stribeck_speed) = (0.4, 0.01);
        let mut integrator = if controlled {
            Integrator::new(Method::DormandPrince, 2, coarse_s).controlled(finest_s, vec![1e-6; 2])
        } else {
            Integrator::new(Method::DormandPrince, 2, finest_s)
        };
        let (mut t, mut x) = (0.0, [1.0, 0.0]);
        integrator.settle(&mut machine, t, &mut x);
        integrator.advance(&mut machine, &mut t, &mut x, 2.9, &[], &[], |_, _, _| ()).unwrap();
        (x, machine.evaluations)
    };
    let (fine, of_fine) = follow(false);
    let (found, of_found) = follow(true);
    assert_relative_eq!(found[0], fine[0], epsilon = 1e-5);
    assert_relative_eq!(found[1], fine[1], epsilon = 1e-5);
    assert!(5 * of_found < of_fine, "{of_found} of {of_fine}");
}

/// A mass under a constant pull that bounces on a stop: its law changes at the stop's position.
struct Stopped<T> {
    pull: T,
    stiffness: T,
    edge: [Edge<T>; 1],
    beyond: bool,
}

impl<T: Number> Machine<T> for Stopped<T> {
    fn contacts(&self) -> &[Contact] {
        &[]
    }
    fn ceilings(&self) -> &[Ceiling<T>] {
        &[]
    }
    fn edges(&self) -> &[Edge<T>] {
        &self.edge
    }
    fn cross(&mut self, _: usize, beyond: bool) {
        self.beyond = beyond;
    }
    fn smooth(&mut self, _: f64, x: &[T], rates: &mut [T]) {
        rates[0] = x[1];
        rates[1] = -self.pull;
        if self.beyond {
            rates[1] -= self.stiffness * (x[0] - self.edge[0].at);
        }
    }
    fn push(&mut self, _: usize, _: T, _: f64, _: &[T], _: &mut [T]) {}
    fn resistance(&mut self, _: usize, _: bool, _: f64, _: &[T]) -> T {
        T::from(0.0)
    }
}

/// Thrown at the stop with a velocity `v`, the mass is with it for half a period and comes back as fast; where it is then depends on the
/// stop's position twice, on its stiffness through that time.
#[test]
fn a_law_that_changes_its_form_is_followed_across_the_edge() {
    let (v, at, k, until) = (2.0, 0.5, 400.0_f64, 1.0);
    let mut machine = Stopped {
        pull: Dual::from(0.0),
        stiffness: Dual::parameter(k, 0),
        edge: [Edge { state: 0, at: Dual::<2>::parameter(at, 1) }],
        beyond: false,
    };
    let mut integrator = Integrator::new(Method::DormandPrince, 2, 0.005);
    let (mut t, mut x) = (0.0, [Dual::from(0.0), Dual::from(v)]);
    integrator.settle(&mut machine, t, &mut x);
    integrator.advance(&mut machine, &mut t, &mut x, until, &[], &[], |_, _, _| ()).unwrap();
    let half = std::f64::consts::PI / k.sqrt();
    assert_relative_eq!(x[0].re, at - v * (until - at / v - half), epsilon = 1e-6);
    assert_relative_eq!(x[1].re, -v, epsilon = 1e-6);
    assert_relative_eq!(x[0].eps[0], -v * 0.5 * half / k, max_relative = 1e-4);
    assert_relative_eq!(x[0].eps[1], 2.0, epsilon = 1e-5);
}

/// Thrown so that it turns back just behind the stop, within one long step, the mass is pushed back all the same; where it turns back
/// before the stop, nothing happens.
#[test]
fn a_stop_that_is_left_within_the_step_that_reaches_it_is_felt() {
    let (v, pull, k) = (2.0, 8.0, 400.0);
    let follow = |method: Method, step_s: f64, at: f64| {
        let mut machine = Stopped { pull, stiffness: k, edge: [Edge { state: 0, at }], beyond: false };
        let mut integrator = Integrator::new(method, 2, step_s);
        let (mut t, mut x) = (0.0, [0.0, v]);
        integrator.settle(&mut machine, t, &mut x);
        // It would turn back at 0.25 s; one step of the longer ones holds that.
        integrator.advance(&mut machine, &mut t, &mut x, 0.4, &[], &[], |_, _, _| ()).unwrap();
        x
    };
    let free = [v * 0.4 - 0.5 * pull * 0.16, v - pull * 0.4];
    for method in [Method::Heun, Method::Kutta, Method::DormandPrince] {
        let behind = 0.5 * v * v / pull - 4e-3;
        let (fine, found) = (follow(method, 1e-4, behind), follow(method, 0.1, behind));
        assert!(fine[1] < free[1] - 0.05, "the stop is passed by: {fine:?}");
        // A third of a period of the spring is one step.
        assert_relative_eq!(found[0], fine[0], epsilon = 2e-3);
        assert_relative_eq!(found[1], fine[1], epsilon = 2e-2);
        let before = follow(method, 0.1, 0.5 * v * v / pull + 1e-3);
        assert_relative_eq!(before[0], free[0], epsilon = 1e-9);
        assert_relative_eq!(before[1], free[1], epsilon = 1e-9);
    }
}
