#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
use super::*;
use crate::friction::DryFriction;
use approx::assert_relative_eq;
use num_dual::DualSVec64;

/// A mass on a spring that rubs, pushed by a constant force: x'' = push - omega^2 x - friction.
struct Rubbing<T> {
    omega: T,
    push: T,
    law: DryFriction<T>,
    contact: [Contact; 1],
}

impl<T: Number> Rubbing<T> {
    fn new(omega: T, push: T, level: T) -> Self {
        let law = DryFriction { level, ..DryFriction::none(T::from(0.1)) };
        Self { omega, push, law, contact: [Contact { velocity: 1 }] }
    }
}

impl<T: Number> Machine<T> for Rubbing<T> {
    fn contacts(&self) -> &[Contact] {
        &self.contact
    }
    fn ceilings(&self) -> &[Ceiling<T>] {
        &[]
    }
    fn smooth(&mut self, _: T, x: &[T], rates: &mut [T]) {
        rates[0] = x[1];
        rates[1] = self.push - self.omega * self.omega * x[0];
    }
    fn direction(&mut self, _: usize, _: T, _: &[T], direction: &mut [T]) {
        direction.copy_from_slice(&[T::from(0.0), T::from(1.0)]);
    }
    fn resistance(&mut self, _: usize, forward: bool, _: T, x: &[T]) -> T {
        self.law.resistance(forward, x[1], T::from(0.0))
    }
}

fn follow<T: Number>(machine: &mut Rubbing<T>, x: &mut [T; 2], until: f64) {
    let mut integrator = Integrator::new(2, 0.02);
    let mut t = T::from(0.0);
    integrator.settle(machine, t, x);
    integrator.advance(machine, &mut t, x, T::from(until)).unwrap();
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
    type D = DualSVec64<4>;
    let at = |p: [f64; 4]| {
        let mut x = [p[3], 0.3];
        follow(&mut Rubbing::new(p[0], p[1], p[2]), &mut x, 4.3);
        x
    };
    for p in [[3.0, 0.2, 0.5, 1.0], [3.0, 0.0, 0.0, 1.0], [5.0, -0.4, 0.1, 0.2], [2.0, 0.3, 1.5, 2.0]] {
        let dual = |k: usize| D::from(p[k]).derivative(k);
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
                let got = x[i].eps.unwrap_generic(nalgebra::Const::<4>, nalgebra::Const::<1>)[k];
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
    fn direction(&mut self, _: usize, _: f64, _: &[f64], _: &mut [f64]) {}
    fn resistance(&mut self, _: usize, _: bool, _: f64, _: &[f64]) -> f64 {
        0.0
    }
}

#[test]
fn a_level_stays_at_its_ceiling_while_more_comes_in_than_leaves() {
    let mut tank = Tank { inflow: 2.0, ceiling: [Ceiling { state: 0, height: 0.5 }] };
    let mut integrator = Integrator::new(1, 0.01);
    let (mut t, mut x) = (0.0, [0.0]);
    integrator.settle(&mut tank, t, &mut x);
    integrator.advance(&mut tank, &mut t, &mut x, 0.9).unwrap();
    assert_eq!(x[0], 0.5);
    // It leaves the brim when 2 (1 - t) = 0.05, t = 0.975.
    integrator.advance(&mut tank, &mut t, &mut x, 1.475).unwrap();
    // From then on x' = -2 s + 0.05 - 0.1 x, s = t - 0.975.
    let (a, s): (f64, f64) = (0.1, 0.5);
    let particular = |s: f64| -2.0 * s / a + 2.0 / (a * a) + 0.05 / a;
    let expected = particular(s) + (0.5 - particular(0.0)) * (-a * s).exp();
    assert_relative_eq!(x[0], expected, epsilon = 1e-9);
}
