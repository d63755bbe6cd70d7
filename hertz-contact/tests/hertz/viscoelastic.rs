//! Relaxing contacts against closed forms, dense quadrature and each other.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use approx::assert_relative_eq;
use hertz_contact::indenter::Indenter;
use hertz_contact::law::{Elastic, Law};
use hertz_contact::viscoelastic::{
    Contact, HistoryError, LinearSolid, PowerLawSolid, Relaxation, Scratch, forces_by_quadrature,
};
use num_dual::{Derivative, DualSVec64};
use proptest::prelude::*;

const SPHERE: Elastic<f64> =
    Elastic { indenter: Indenter::Sphere { radius_m: 0.01 }, modulus_pa: 1e4, poisson_ratio: 0.5 };
const CONE: Elastic<f64> = Elastic { indenter: Indenter::Cone { angle_rad: 0.3 }, ..SPHERE };
const PUNCH: Elastic<f64> = Elastic { indenter: Indenter::Cylinder { radius_m: 0.01 }, ..SPHERE };
const SOLID: LinearSolid<f64> = LinearSolid { relaxed_fraction: 0.6, tau_s: 0.7 };
const POWER: PowerLawSolid = PowerLawSolid { exponent: 0.25, onset_s: 1e-3 };

fn fast(
    solid: &LinearSolid<f64>,
    law: &Elastic<f64>,
    contact: Contact,
    times: &[f64],
    depths: &[f64],
) -> Vec<f64> {
    let mut out = vec![0.0; times.len()];
    solid.forces(law, contact, times, depths, &mut Scratch::new(), &mut out).unwrap();
    out
}

fn slow<R: Relaxation<f64>>(
    relaxation: &R,
    law: &Elastic<f64>,
    contact: Contact,
    times: &[f64],
    depths: &[f64],
) -> Vec<f64> {
    let mut out = vec![0.0; times.len()];
    forces_by_quadrature(relaxation, law, contact, times, depths, &mut out).unwrap();
    out
}

/// Simpson's rule over [0, 1].
fn simpson(f: impl Fn(f64) -> f64) -> f64 {
    let n = 2000;
    let sum: f64 = (0..=n)
        .map(|i| {
            let weight = if i == 0 || i == n { 1.0 } else { 2.0 + 2.0 * f64::from(i % 2) };
            weight * f(f64::from(i) / f64::from(n))
        })
        .sum();
    sum / (3.0 * f64::from(n))
}

/// `int_0^t1 psi(t - s) d f(v s)` for `f = c d^n`, with s = t1 u^2 (3 - 2 u), which is smooth at touch and dense at the end.
fn ramp<R: Relaxation<f64>>(relaxation: &R, law: &Elastic<f64>, v: f64, t1: f64, t: f64) -> f64 {
    simpson(|u| {
        let s = t1 * u * u * (3.0 - 2.0 * u);
        relaxation.remaining((t - s).max(0.0))
            * law.derivative(v * s.max(1e-300))
            * v
            * 6.0
            * t1
            * u
            * (1.0 - u)
    })
}

/// Up at v until `top`, then down at the same speed; the contact's end after Ting by bisection in plain integrals.
fn triangle<R: Relaxation<f64>>(relaxation: &R, law: &Elastic<f64>, v: f64, top: f64, t: f64) -> f64 {
    if t <= top {
        return ramp(relaxation, law, v, t, t);
    }
    // int_{t1}^{top} psi(t - s) ds = int_top^t psi(t - s) ds
    let back = (t - top) * simpson(|u| relaxation.remaining((t - top) * u));
    let forth = |t1: f64| (top - t1) * simpson(|u| relaxation.remaining(t - t1 - (top - t1) * u));
    if forth(0.0) < back {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, top);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if forth(middle) > back { low = middle } else { high = middle }
    }
    ramp(relaxation, law, v, low, t)
}

fn grid(end: f64, n: u32) -> Vec<f64> {
    (0..=n).map(|i| end * f64::from(i) / f64::from(n)).collect()
}

#[test]
fn a_step_relaxes_by_the_exponential() {
    let times = [0.0, 0.0, 0.1, 0.7, 3.0, 50.0];
    for law in [SPHERE, CONE, PUNCH] {
        for start in [0.0, 1e-3] {
            let depths = [start, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3];
            let fast = fast(&SOLID, &law, Contact::Shrinks, &times, &depths);
            let slow = slow(&SOLID, &law, Contact::Shrinks, &times, &depths);
            for i in 1..6 {
                let expected = law.force(1e-3) * (0.4 + 0.6 * (-times[i] / 0.7).exp());
                assert_relative_eq!(fast[i], expected, max_relative = 1e-12);
                assert_relative_eq!(slow[i], expected, max_relative = 1e-12);
            }
        }
    }
    // And by the power law: half of it is left at (1 + t/t_0)^(-1/4) = 1/2.
    let times = [0.0, 15e-3];
    let force = slow(&POWER, &SPHERE, Contact::Shrinks, &times, &[1e-3; 2]);
    assert_relative_eq!(force[1], 0.5 * SPHERE.force(1e-3), max_relative = 1e-12);
}

/// Ramps in closed form: `c v ((1 - g) t + g tau (1 - e))` under a punch, twice that integrated under a cone.
#[test]
fn linear_ramps() {
    let (v, g, tau) = (2e-3, 0.6, 0.7);
    let times = grid(2.0, 37);
    let depths: Vec<f64> = times.iter().map(|t| v * t).collect();
    let punch = fast(&SOLID, &PUNCH, Contact::Fixed, &times, &depths);
    let cone = fast(&SOLID, &CONE, Contact::Shrinks, &times, &depths);
    for (i, t) in times.iter().enumerate() {
        let e = 1.0 - (-t / tau).exp();
        let once = (1.0 - g) * t + g * tau * e;
        let twice = (1.0 - g) * t * t / 2.0 + g * tau * (t - tau * e);
        assert_relative_eq!(punch[i], PUNCH.force(1.0) * v * once, max_relative = 1e-12);
        assert_relative_eq!(cone[i], 2.0 * CONE.force(1.0) * v * v * twice, max_relative = 1e-11);
    }
}

/// A sphere's ramp by dense quadrature; only the curvature of delta^(3/2) at first touch is left.
#[test]
fn a_sphere_is_pressed_in() {
    let v = 2e-3;
    for (n, tolerance) in [(50, 2e-4), (1000, 3e-6)] {
        let times = grid(2.0, n);
        let depths: Vec<f64> = times.iter().map(|t| v * t).collect();
        let linear = fast(&SOLID, &SPHERE, Contact::Shrinks, &times, &depths);
        let power = slow(&POWER, &SPHERE, Contact::Shrinks, &times, &depths);
        for i in [n as usize / 2, n as usize] {
            assert_relative_eq!(
                linear[i],
                ramp(&SOLID, &SPHERE, v, times[i], times[i]),
                max_relative = tolerance
            );
            assert_relative_eq!(
                power[i],
                ramp(&POWER, &SPHERE, v, times[i], times[i]),
                max_relative = tolerance
            );
        }
    }
}

#[test]
fn unloading_after_ting() {
    let (v, top) = (2e-3, 1.0);
    let times = grid(2.0, 600);
    let depths: Vec<f64> = times.iter().map(|t| v * (top - (t - top).abs())).collect();
    for law in [SPHERE, CONE] {
        let linear = fast(&SOLID, &law, Contact::Shrinks, &times, &depths);
        let power = slow(&POWER, &law, Contact::Shrinks, &times, &depths);
        let size = law.force(v * top);
        let mut lost = 0;
        for i in [150, 299, 301, 305, 340, 400, 450, 500, 520, 560, 600] {
            let t = times[i];
            let expected = triangle(&SOLID, &law, v, top, t);
            assert_relative_eq!(linear[i], expected, epsilon = 3e-5 * size);
            assert_relative_eq!(power[i], triangle(&POWER, &law, v, top, t), epsilon = 3e-5 * size);
            lost += usize::from(expected == 0.0);
        }
        // The indenter leaves the dent before it is back.
        assert!(lost >= 2, "{lost}");
    }
}

/// The same sums in one pass and by brute force, over loading, hold and unloading.
#[test]
fn fast_and_slow_agree() {
    let mut times = grid(5.0, 250);
    times.remove(77);
    for start in [-5e-4, 0.0, 3e-4] {
        for (g, tau) in [(0.0, 1.0), (0.3, 0.01), (0.6, 0.7), (0.95, 30.0), (1.0, 0.5)] {
            let solid = LinearSolid { relaxed_fraction: g, tau_s: tau };
            let depths: Vec<f64> = times
                .iter()
                .map(|t| if *t < 1.5 { start + 1e-3 * t } else { start + 1.5e-3 - 8e-4 * (t - 3.2).max(0.0) })
                .collect();
            for (law, contact) in
                [(SPHERE, Contact::Shrinks), (CONE, Contact::Shrinks), (PUNCH, Contact::Fixed)]
            {
                let a = fast(&solid, &law, contact, &times, &depths);
                let b = slow(&solid, &law, contact, &times, &depths);
                for (a, b) in a.iter().zip(&b) {
                    assert_relative_eq!(a, b, epsilon = 1e-9 * law.force(1.5e-3), max_relative = 1e-8);
                }
            }
        }
    }
}

/// Nothing relaxes, has relaxed, or will ever: the elastic law, on the way back too.
#[test]
fn elastic_limits() {
    let times = grid(3.0, 90);
    let depths: Vec<f64> = times.iter().map(|t| 1e-3 * (1.5 - (t - 1.5).abs()) - 1e-4).collect();
    for (g, tau, factor) in [(0.0, 0.3, 1.0), (0.5, 1e12, 1.0), (0.5, 1e-12, 0.5), (0.5, 1e-300, 0.5)] {
        let solid = LinearSolid { relaxed_fraction: g, tau_s: tau };
        let forces = fast(&solid, &SPHERE, Contact::Shrinks, &times, &depths);
        for (f, d) in forces.iter().zip(&depths) {
            let expected = factor * SPHERE.force(*d);
            assert_relative_eq!(*f, expected, max_relative = 1e-7, epsilon = 1e-9 * SPHERE.force(1e-3));
        }
    }
}

/// A hold that trembles by a micrometre is still a hold.
#[test]
fn a_trembling_hold() {
    let times = grid(4.0, 800);
    let smooth: Vec<f64> = times.iter().map(|t| 1e-3 * t.min(1.0)).collect();
    let mut state = 1_u32;
    let trembling: Vec<f64> = smooth
        .iter()
        .map(|d| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            d + 1e-6 * (f64::from(state >> 8) / f64::from(1 << 23) - 1.0)
        })
        .collect();
    let a = fast(&SOLID, &SPHERE, Contact::Shrinks, &times, &smooth);
    let b = fast(&SOLID, &SPHERE, Contact::Shrinks, &times, &trembling);
    let c = slow(&SOLID, &SPHERE, Contact::Shrinks, &times, &trembling);
    for i in 100..times.len() {
        assert!((a[i] - b[i]).abs() < 3e-3 * SPHERE.force(1e-3), "{i}: {} {}", a[i], b[i]);
        assert!((b[i] - c[i]).abs() < 1e-3 * SPHERE.force(1e-3), "{i}: {} {}", b[i], c[i]);
    }
}

#[test]
fn derivatives_against_differences() {
    let times = grid(3.0, 120);
    let forces = |p: [f64; 4]| {
        let law = Elastic { modulus_pa: p[0], ..SPHERE };
        let solid = LinearSolid { relaxed_fraction: p[1], tau_s: p[2] };
        let depths: Vec<f64> =
            times.iter().map(|t| 1e-3 * (t.min(1.0) - (t - 2.0).max(0.0)) - p[3]).collect();
        fast(&solid, &law, Contact::Shrinks, &times, &depths)
    };
    let point = [1e4, 0.5, 0.6, 1.23e-4];
    let base = forces(point);
    for i in 0..4 {
        let mut p = point.map(DualSVec64::<1>::from);
        p[i].eps = Derivative::derivative_generic(nalgebra::U1, nalgebra::U1, 0);
        let law = Elastic { indenter: SPHERE.indenter, modulus_pa: p[0], poisson_ratio: 0.5 };
        let solid = LinearSolid { relaxed_fraction: p[1], tau_s: p[2] };
        let depths: Vec<_> = times
            .iter()
            .map(|t| DualSVec64::<1>::from(1e-3 * (t.min(1.0) - (t - 2.0).max(0.0))) - p[3])
            .collect();
        let mut out = vec![DualSVec64::<1>::from(0.0); times.len()];
        solid.forces(&law, Contact::Shrinks, &times, &depths, &mut Scratch::new(), &mut out).unwrap();
        let h = 1e-6 * point[i];
        let (mut up, mut down) = (point, point);
        up[i] += h;
        down[i] -= h;
        let (up, down) = (forces(up), forces(down));
        let mut unloading = 0;
        for k in 0..times.len() {
            let exact = out[k].eps.unwrap_generic(nalgebra::U1, nalgebra::U1)[0];
            let slope = (up[k] - down[k]) / (2.0 * h);
            assert_relative_eq!(out[k].re, base[k], max_relative = 1e-12);
            let size = base.iter().copied().fold(0.0, f64::max) / point[i];
            assert!((exact - slope).abs() < 1e-5 * size + 1e-4 * slope.abs(), "{i} {k}: {exact} {slope}");
            unloading += usize::from(times[k] > 2.0 && base[k] > 0.0);
        }
        assert!(unloading > 5);
    }
}

#[test]
fn what_cannot_be_followed_is_refused() {
    let mut out = [0.0; 3];
    let mut run = |solid: LinearSolid<f64>, times: &[f64], depths: &[f64]| {
        solid.forces(&SPHERE, Contact::Shrinks, times, depths, &mut Scratch::new(), &mut out)
    };
    let (t, d) = ([0.0, 1.0, 2.0], [0.0, 1e-3, 2e-3]);
    assert_eq!(run(SOLID, &t, &d), Ok(()));
    assert_eq!(run(SOLID, &t[..2], &d[..2]), Err(HistoryError::Length { expected: 2, got: 3 }));
    assert_eq!(run(SOLID, &[0.0, 1.0, 0.5], &d), Err(HistoryError::Times { index: 2, value: 0.5 }));
    assert!(matches!(run(SOLID, &[0.0, f64::NAN, 2.0], &d), Err(HistoryError::Times { index: 1, .. })));
    assert!(matches!(
        run(SOLID, &t, &[0.0, f64::INFINITY, 0.0]),
        Err(HistoryError::Indentation { index: 1, .. })
    ));
    for (g, tau) in [(-0.1, 1.0), (1.1, 1.0), (f64::NAN, 1.0), (0.5, 0.0), (0.5, f64::NAN)] {
        let solid = LinearSolid { relaxed_fraction: g, tau_s: tau };
        assert!(matches!(run(solid, &t, &d), Err(HistoryError::Parameter(_))), "{g} {tau}");
    }
    let power = PowerLawSolid { exponent: 1.0, onset_s: 1.0 };
    assert!(forces_by_quadrature(&power, &SPHERE, Contact::Shrinks, &t, &d, &mut [0.0; 3]).is_err());
    let mut none: [f64; 0] = [];
    assert_eq!(SOLID.forces(&SPHERE, Contact::Shrinks, &[], &[], &mut Scratch::new(), &mut none), Ok(()));
    assert_eq!(fast(&SOLID, &SPHERE, Contact::Shrinks, &t, &[-1.0, -2.0, 0.0]), vec![0.0; 3]);
}

proptest! {
    /// Any history: no panic, no NaN.
    #[test]
    fn any_history(
        steps in prop::collection::vec((0.0_f64..1.0, -1.0_f64..1.0), 1..60),
        g in 0.0_f64..=1.0,
        tau in -3.0_f64..3.0,
        fixed in any::<bool>(),
    ) {
        let (mut t, mut d) = (0.0, -0.2);
        let (times, depths): (Vec<f64>, Vec<f64>) = steps
            .iter()
            .map(|(dt, dd)| {
                t += dt.max(0.1) - 0.1;
                d = 0.8 * d + 1e-3 * dd;
                (t, d)
            })
            .unzip();
        let solid = LinearSolid { relaxed_fraction: g, tau_s: 10_f64.powf(tau) };
        let contact = if fixed { Contact::Fixed } else { Contact::Shrinks };
        let a = fast(&solid, &SPHERE, contact, &times, &depths);
        let b = slow(&solid, &SPHERE, contact, &times, &depths);
        for f in a.iter().chain(&b) {
            prop_assert!(f.is_finite(), "{f}");
        }
    }

    /// Loading, then unloading: bounded by the elastic law, lower on the way back, zero before the indenter is back.
    #[test]
    fn a_loop_loses_work(g in 0.05_f64..0.95, tau in -1.5_f64..1.5, v in 0.3_f64..3.0) {
        let solid = LinearSolid { relaxed_fraction: g, tau_s: 10_f64.powf(tau) };
        let times = grid(2.0, 200);
        let depths: Vec<f64> = times.iter().map(|t| 1e-3 * v * (1.0 - (t - 1.0).abs())).collect();
        let f = fast(&solid, &SPHERE, Contact::Shrinks, &times, &depths);
        let size = SPHERE.force(1e-3 * v);
        for i in 0..=100 {
            let (up, down) = (f[i], f[200 - i]);
            let elastic = SPHERE.force(depths[i]);
            prop_assert!(down <= up + 1e-9 * size, "{i}: {up} {down}");
            prop_assert!(up <= elastic + 1e-9 * size && down >= 0.0);
            prop_assert!(up >= (1.0 - g) * elastic - 1e-9 * size);
        }
    }
}
