//! What is reported of a wave that a lagging sensor reads.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
use missing_physics::model::Scope;

use super::super::setup::GLASS;
use super::*;

/// A first-order lag shows a wave of omega at 1 / sqrt(1 + (omega tau)^2) of its height, and the reading at which it sticks likewise.
#[test]
fn friction_and_eddies_are_those_of_the_wave_and_not_of_a_reading_that_lags() {
    let cylinder = UprightCylinder::new(0.035, 0.05, 9.81).unwrap();
    let (spec, p) = build(&GLASS, &cylinder, 1e-3, 1e-6);
    let mut shared = spec.starts(Scope::Shared);
    (shared[p.friction.slot], shared[p.quadratic.slot]) = (2e-5, 30.0);
    let said = |shared: &[f64], id: &str| {
        let mechanism = spec.mechanisms.iter().find(|m| m.id == id).unwrap();
        let [derived] = mechanism.derived.as_slice() else { unreachable!("one quantity") };
        assert_eq!(derived.name, spec.parameters[mechanism.parameters[0]].name);
        (derived.value)(shared)
    };
    assert_eq!(said(&shared, "contact-line-friction"), 2e-5);
    assert_eq!(said(&shared, "quadratic-damping"), 30.0);
    shared[p.lag.slot] = 3f64.sqrt() / cylinder.angular_frequency_rad_s(0, 0.0);
    approx::assert_relative_eq!(said(&shared, "contact-line-friction"), 4e-5, max_relative = 1e-12);
    approx::assert_relative_eq!(said(&shared, "quadratic-damping"), 15.0, max_relative = 1e-12);
}
