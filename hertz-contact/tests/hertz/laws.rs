//! The laws against known answers, differences and their own inverses.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::f64::consts::PI;

use approx::assert_relative_eq;
use hertz_contact::Number;
use hertz_contact::indenter::{Indenter, effective_modulus_pa, effective_radius_m};
use hertz_contact::law::*;
use num_dual::{Derivative, DualSVec64};
use proptest::prelude::*;

const SPHERE: Indenter = Indenter::Sphere { radius_m: 0.02 };
const CYLINDER: Indenter = Indenter::Cylinder { radius_m: 0.02 };
const CONE: Indenter = Indenter::Cone { angle_rad: 0.3 };

fn jkr<T: Number>(w: T) -> Jkr<T> {
    Jkr { radius_m: 0.02, modulus_pa: T::from(8e3), poisson_ratio: 0.5, work_of_adhesion_j_m2: w }
}

/// Every law with the deepest indentation (m) at which it is tried.
fn laws<T: Number>() -> Vec<(&'static str, Box<dyn Law<T>>)> {
    let e = T::from(8e3);
    let elastic = |indenter| Elastic { indenter, modulus_pa: e, poisson_ratio: 0.4 };
    let per_m = T::from(1.0 / 0.015);
    let layered = |indenter, base| Layered {
        elastic: elastic(indenter),
        layer: Layer::new(&indenter, 0.4, base).unwrap(),
        inverse_thickness_per_m: per_m,
    };
    let dimitriadis = |base| Dimitriadis {
        radius_m: 0.02,
        modulus_pa: e,
        poisson_ratio: 0.4,
        base,
        inverse_thickness_per_m: per_m,
    };
    let membrane = Membrane { tension_n_m: T::from(30.0), stretching_n_m3: T::from(1e5) };
    let full = Indentation {
        layer: Some(Layer::new(&SPHERE, 0.5, Base::Bonded).unwrap()),
        inverse_thickness_per_m: per_m,
        work_of_adhesion_j_m2: T::from(0.05),
        stiffening: T::from(0.4),
        tension_n_m: T::from(5.0),
        stretching_n_m3: T::from(1e4),
        rim_depth_m: T::from(0.0051),
        rim_stiffness_n_m: T::from(100.0),
        compliance_m_n: T::from(1e-4),
        ..Indentation::elastic(SPHERE, e, 0.5)
    };
    vec![
        ("sphere", Box::new(elastic(SPHERE)) as Box<dyn Law<T>>),
        ("punch", Box::new(elastic(CYLINDER))),
        ("cone", Box::new(elastic(CONE))),
        ("Sneddon", Box::new(SneddonSphere { radius_m: 0.02, modulus_pa: e, poisson_ratio: 0.4 })),
        ("power", Box::new(PowerLaw { coefficient: T::from(3e3), exponent: 1.73 })),
        ("neo-Hooke", Box::new(NeoHookean { radius_m: 0.02, modulus_pa: e })),
        ("JKR", Box::new(jkr(T::from(0.3)))),
        ("JKR, weak", Box::new(jkr(T::from(1e-5)))),
        (
            "DMT",
            Box::new(Dmt {
                radius_m: 0.02,
                modulus_pa: e,
                poisson_ratio: 0.5,
                work_of_adhesion_j_m2: T::from(0.3),
            }),
        ),
        ("layer, sphere", Box::new(layered(SPHERE, Base::Bonded))),
        ("layer, punch", Box::new(layered(CYLINDER, Base::Bonded))),
        ("layer, cone", Box::new(layered(CONE, Base::Free))),
        ("Dimitriadis", Box::new(dimitriadis(Base::Bonded))),
        ("Dimitriadis, free", Box::new(dimitriadis(Base::Free))),
        ("membrane", Box::new(membrane)),
        ("rim", Box::new(Rim { depth_m: T::from(1e-3), stiffness_n_m: T::from(200.0) })),
        (
            "stiffened",
            Box::new(Stiffened { law: elastic(SPHERE), coefficient: T::from(0.7), radius_m: 0.02 }),
        ),
        (
            "softened",
            Box::new(Stiffened { law: elastic(SPHERE), coefficient: T::from(-0.15), radius_m: 0.02 }),
        ),
        ("compliant", Box::new(Compliant { law: elastic(SPHERE), compliance_m_n: T::from(1e-3) })),
        ("compliant JKR", Box::new(Compliant { law: jkr(T::from(0.3)), compliance_m_n: T::from(1e-3) })),
        ("everything", Box::new(full)),
    ]
}

/// Worked by hand: E = 10 kPa, nu = 0.5, so E/(1 - nu^2) = 13.333 kPa; delta = 1 mm.
#[test]
fn half_space_by_hand() {
    let force = |indenter| Elastic { indenter, modulus_pa: 1e4, poisson_ratio: 0.5 }.force(1e-3);
    // 4/3 * 13333.3 * 0.1 * 3.162278e-5
    assert_relative_eq!(force(Indenter::Sphere { radius_m: 0.01 }), 0.056_218_273, max_relative = 1e-7);
    // 2 * 0.01 * 1e-3 * 13333.3
    assert_relative_eq!(force(Indenter::Cylinder { radius_m: 0.01 }), 0.266_666_667, max_relative = 1e-8);
    // 2/pi * 13333.3 * 1e-6 / tan(pi/4)
    assert_relative_eq!(force(Indenter::Cone { angle_rad: PI / 4.0 }), 8.488_263_6e-3, max_relative = 1e-7);
}

#[test]
fn two_balls_are_one() {
    assert_relative_eq!(effective_radius_m(0.02, 0.02), 0.01);
    assert_relative_eq!(effective_radius_m(0.02, f64::INFINITY), 0.02);
    let (soft, rigid) = ((1e4, 0.5), (f64::INFINITY, 0.3));
    assert_relative_eq!(effective_modulus_pa(soft, rigid), 1e4 / 0.75);
    assert_relative_eq!(effective_modulus_pa(soft, soft), 0.5e4 / 0.75);
}

/// The parabola's error in force is `-0.1 delta/R` at first order.
#[test]
fn the_true_sphere_is_hertz_when_shallow() {
    let sphere = SneddonSphere { radius_m: 0.02, modulus_pa: 8e3, poisson_ratio: 0.4 };
    let hertz = Elastic { indenter: SPHERE, modulus_pa: 8e3, poisson_ratio: 0.4 };
    for d in [1e-12, 1e-9, 1e-5, 2e-5, 2e-4, 1e-3] {
        let ratio = sphere.force(d) / hertz.force(d);
        let x: f64 = d / 0.02;
        assert!((ratio - (1.0 - 0.1 * x)).abs() < 0.1 * x * x + 1e-13, "{d}: {ratio}");
    }
    // Far in, the ball's radius is reached: a punch of radius R.
    assert_relative_eq!(sphere.derivative(2.0), 2.0 * 0.02 * 8e3 / 0.84, max_relative = 1e-9);
}

/// Sneddon's equations themselves, written with the contact radius.
#[test]
fn the_true_sphere_follows_sneddon() {
    let sphere = SneddonSphere { radius_m: 2.0, modulus_pa: 3.0, poisson_ratio: 0.25 };
    for a in [1e-3, 0.2, 0.21, 0.7, 1.5, 1.99, 1.999_999] {
        let r: f64 = 2.0;
        let log = 2.0 * (a / r).atanh();
        let (d, f) = (0.5 * a * log, 3.0 / 0.9375 * (0.5 * (a * a + r * r) * log - a * r));
        assert_relative_eq!(sphere.contact_radius_m(d), a, max_relative = 1e-9);
        // The formula loses digits where a is small.
        assert_relative_eq!(sphere.force(d), f, max_relative = 1e-9 + 1e-15 / (a * a));
    }
}

/// Johnson, Kendall and Roberts: pull-off, the force at delta = 0, and the parametric curve.
#[test]
fn jkr_known_answers() {
    let (r, e, w) = (0.02, 8e3 / 0.75, 0.3);
    let law = jkr(w);
    let pull = PI * w * r;
    assert_relative_eq!(law.force(law.rises_from_m()), -1.5 * pull, max_relative = 1e-12);
    assert_relative_eq!(law.force(law.pull_off_m()), -5.0 / 6.0 * pull, max_relative = 1e-5);
    assert_relative_eq!(law.force(0.0), -4.0 / 3.0 * pull, max_relative = 1e-12);
    assert_eq!(law.force(law.pull_off_m() * 1.001), 0.0);
    assert_eq!(law.force_on_approach(-1e-9), 0.0);
    let critical = (pull * r / (8.0 * e)).cbrt();
    for factor in [1.001, 1.2, 9_f64.cbrt(), 3.0, 5.0, 20.0, 1e3, 1e5] {
        let a = critical * factor;
        let d = a * a / r - (2.0 * PI * w * a / e).sqrt();
        let f = 4.0 * e * a.powi(3) / (3.0 * r) - (8.0 * PI * w * e * a.powi(3)).sqrt();
        assert_relative_eq!(law.contact_radius_m(d), a, max_relative = 1e-9);
        assert_relative_eq!(law.force(d), f, max_relative = 1e-9, epsilon = 1e-9 * pull);
    }
}

/// Weak adhesion: `F = F_Hertz - pi w R + O(w^(3/2))`, and its derivative at w = 0.
#[test]
fn weak_adhesion_pulls_pi_w_r() {
    let (d, w) = (2e-3, 1e-9);
    let lost = jkr(0.0).force(d) - jkr(w).force(d);
    assert_relative_eq!(lost, PI * w * 0.02, max_relative = 1e-2);
    for start in [0.0, 1e-12] {
        let w = DualSVec64::<1>::new(start, Derivative::derivative_generic(nalgebra::U1, nalgebra::U1, 0));
        let f = jkr(w).force(DualSVec64::<1>::from(d));
        let slope = f.eps.unwrap_generic(nalgebra::U1, nalgebra::U1)[0];
        assert_relative_eq!(slope, -PI * 0.02, max_relative = 1e-3);
    }
    assert_eq!(jkr(0.0).force(-1e-6), 0.0);
    assert_eq!(jkr(0.0).force(d), Elastic { indenter: SPHERE, modulus_pa: 8e3, poisson_ratio: 0.5 }.force(d));
}

#[test]
fn dmt_and_tabor() {
    let law = Dmt { radius_m: 0.02, modulus_pa: 8e3, poisson_ratio: 0.5, work_of_adhesion_j_m2: 0.3 };
    assert_relative_eq!(law.force(0.0), -2.0 * PI * 0.3 * 0.02);
    assert_eq!(law.force(-1e-9), 0.0);
    let e = 8e3_f64 / 0.75;
    assert_relative_eq!(
        jkr(0.3).tabor_number(1e-6),
        (0.02 * 0.09 / (e * e * 1e-18)).cbrt(),
        max_relative = 1e-12
    );
}

/// The sample gives, then the cell: force and true depth satisfy both equations.
#[test]
fn a_load_cell_that_gives() {
    let law = Elastic { indenter: SPHERE, modulus_pa: 8e3, poisson_ratio: 0.5 };
    for c in [0.0, 1e-6, 1e-3, 10.0] {
        let cell = Compliant { law, compliance_m_n: c };
        let mut last = 0.0;
        for i in 1..50 {
            let measured = 1e-4 * f64::from(i);
            let d = cell.true_indentation_m(measured);
            assert_relative_eq!(d + c * law.force(d), measured, max_relative = 1e-12);
            assert!(d > last);
            last = d;
        }
    }
    // A very soft cell takes all of the motion: the force is measured / C.
    let soft = Compliant { law, compliance_m_n: 1e6 };
    assert_relative_eq!(soft.force(1e-3), 1e-9, max_relative = 1e-3);
}

/// With adhesion, a rigid cell holds down to the fold, a soft one lets go at the force's minimum.
#[test]
fn a_load_cell_lets_go() {
    let law = jkr(0.3);
    let stiff = Compliant { law, compliance_m_n: 1e-9 };
    let d = 0.99 * law.pull_off_m();
    assert_relative_eq!(stiff.force(d), law.force(d), max_relative = 1e-4);
    let soft = Compliant { law, compliance_m_n: 1.0 };
    let at = |f: f64| law.rises_from_m() + f * law.force(law.rises_from_m());
    assert_relative_eq!(soft.force(at(1.0)), law.force(law.rises_from_m()), max_relative = 1e-6);
    assert_eq!(soft.force(at(1.02)), 0.0);
}

#[test]
fn a_rim_and_a_membrane() {
    let rim = Rim { depth_m: 2e-3, stiffness_n_m: 500.0 };
    assert_eq!(rim.force(2e-3), 0.0);
    assert_relative_eq!(rim.force(3e-3), 0.5, max_relative = 1e-12);
    let membrane = Membrane { tension_n_m: 40.0, stretching_n_m3: 1e6 };
    assert_relative_eq!(membrane.force(1e-2), 1.4, max_relative = 1e-12);
    assert_eq!(membrane.force(-1e-2), 0.0);
}

/// `neo-Hooke` in the form in which Lin et al. print it.
#[test]
fn neo_hooke_as_printed() {
    let law = NeoHookean { radius_m: 0.02, modulus_pa: 8e3 };
    let hertz = Elastic { indenter: SPHERE, modulus_pa: 8e3, poisson_ratio: 0.5 };
    assert_relative_eq!(law.force(1e-12), hertz.force(1e-12), max_relative = 1e-5);
    let b = 16.0 / 9.0 / 0.6 / PI * 8e3;
    for d in [1e-4, 1e-3, 1e-2, 2e-2] {
        let r: f64 = 0.02;
        let a = (r * d).sqrt();
        let top = a.powi(5) - 15.0 * r * a.powi(4) + 75.0 * r * r * a.powi(3);
        let f = b * PI * top / (5.0 * r * a * a - 50.0 * r * r * a + 125.0 * r.powi(3));
        assert_relative_eq!(law.force(d), f, max_relative = 1e-12);
    }
}

#[test]
fn derivatives_against_differences() {
    for (name, law) in laws::<f64>() {
        for d in [1e-5, 3e-4, 1.1e-3, 2e-3, 4e-3, 7e-3, -1e-5, -8e-5] {
            let h = 1e-5 * f64::abs(d);
            let f = |x| law.force(x);
            let slope = (8.0 * (f(d + h) - f(d - h)) - (f(d + 2.0 * h) - f(d - 2.0 * h))) / (12.0 * h);
            assert_relative_eq!(law.derivative(d), slope, max_relative = 2e-7, epsilon = 1e-9);
            assert!(law.derivative(d).is_finite(), "{name}");
        }
    }
}

/// A dual indentation gives the same force and stiffness.
#[test]
fn dual_numbers_agree() {
    for ((name, plain), (_, dual)) in laws::<f64>().into_iter().zip(laws::<DualSVec64<1>>()) {
        for d in [0.0, 1e-5, 1.1e-3, 7e-3, -8e-5] {
            let x = DualSVec64::<1>::new(d, Derivative::derivative_generic(nalgebra::U1, nalgebra::U1, 0));
            let f = dual.force(x);
            assert_relative_eq!(f.re, plain.force(d), max_relative = 1e-12);
            let eps = f.eps.unwrap_generic(nalgebra::U1, nalgebra::U1)[0];
            if d != 0.0 {
                assert_relative_eq!(eps, plain.derivative(d), max_relative = 1e-9);
            }
            assert!(eps.is_finite(), "{name} at {d}");
            assert_relative_eq!(dual.derivative(x).re, plain.derivative(d), max_relative = 1e-12);
        }
    }
}

/// Every parameter's derivative of the whole contact against differences, at values on and off.
#[test]
fn the_whole_contact_has_right_gradients() {
    let scales = [8e3, 60.0, 0.05, 0.4, 5.0, 1e4, 3e-3, 100.0, 1e-3];
    let build = |p: &[f64; 9]| contact(*p);
    for off in [false, true] {
        let point = scales.map(|s| if off && s != 8e3 { 0.0 } else { s });
        for d in [1e-3, 6e-3] {
            for i in 0..9 {
                let mut dual = point.map(DualSVec64::<1>::from);
                dual[i].eps = Derivative::derivative_generic(nalgebra::U1, nalgebra::U1, 0);
                let f = contact(dual).force(DualSVec64::<1>::from(d));
                let exact = f.eps.unwrap_generic(nalgebra::U1, nalgebra::U1)[0];
                // One-sided: below zero most parameters make no sense. The root of w needs small steps.
                let (mut near, mut far) = (point, point);
                let h = scales[i] * if i == 2 { 1e-7 } else { 1e-5 };
                near[i] += h;
                far[i] += 2.0 * h;
                let (f0, f1, f2) = (build(&point).force(d), build(&near).force(d), build(&far).force(d));
                let slope = (4.0 * (f1 - f0) - (f2 - f0)) / (2.0 * h);
                let size = f0.abs() / scales[i];
                assert!(
                    (exact - slope).abs() < 1e-4 * exact.abs() + 1e-6 * size,
                    "{i} off {off} at {d}: {exact} {slope}"
                );
            }
        }
    }
}

fn contact<T: Number>(p: [T; 9]) -> Indentation<T> {
    Indentation {
        layer: Some(Layer::new(&SPHERE, 0.5, Base::Bonded).unwrap()),
        inverse_thickness_per_m: p[1],
        work_of_adhesion_j_m2: p[2],
        stiffening: p[3],
        tension_n_m: p[4],
        stretching_n_m3: p[5],
        rim_depth_m: p[6],
        rim_stiffness_n_m: p[7],
        compliance_m_n: p[8],
        ..Indentation::elastic(SPHERE, p[0], 0.5)
    }
}

/// All effects off is Hertz, to the last bit for plain numbers.
#[test]
fn the_bare_contact_is_hertz() {
    for indenter in [SPHERE, CYLINDER, CONE] {
        let whole = Indentation::elastic(indenter, 8e3, 0.45);
        let bare = Elastic { indenter, modulus_pa: 8e3, poisson_ratio: 0.45 };
        for d in [-1e-3, 0.0, 1e-6, 2e-3] {
            assert_eq!(whole.force(d), bare.force(d));
            assert_eq!(whole.derivative(d), bare.derivative(d));
        }
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let elastic = |indenter| Elastic { indenter, modulus_pa: 8e3, poisson_ratio: 0.4 };
    let bad = Indenter::Sphere { radius_m: -1.0 };
    assert_eq!(elastic(bad).check(), Err(LawError::NotPositive { name: "radius_m", value: -1.0 }));
    assert!(elastic(Indenter::Cone { angle_rad: 1.6 }).check().is_err());
    assert!(elastic(Indenter::Cone { angle_rad: f64::NAN }).check().is_err());
    assert!(Elastic { modulus_pa: 0.0, ..elastic(SPHERE) }.check().is_err());
    assert!(Elastic { poisson_ratio: 0.51, ..elastic(SPHERE) }.check().is_err());
    assert!(Layer::new(&bad, 0.4, Base::Bonded).is_err());
    assert!(Layer::new(&SPHERE, f64::NAN, Base::Bonded).is_err());
    let whole = Indentation::elastic(CONE, 8e3, 0.4);
    assert!(whole.check().is_ok());
    let sticky = Indentation { work_of_adhesion_j_m2: 0.1, ..whole };
    assert_eq!(sticky.check(), Err(LawError::Indenter { effect: "adhesion" }));
    assert!(Indentation { stiffening: 0.1, ..whole }.check().is_err());
    for (name, law) in laws::<f64>() {
        assert_eq!(law.check(), Ok(()), "{name}");
    }
}

#[test]
fn inverses_of_forces_that_do_not_exist() {
    for (name, law) in laws::<f64>() {
        assert!(law.inverse(f64::NAN).is_err(), "{name}");
        assert!(law.inverse(f64::INFINITY).is_err(), "{name}");
        assert!(matches!(law.inverse(-10.0), Err(InverseError::BelowLowest { .. })), "{name}");
    }
    let none = Membrane { tension_n_m: 0.0, stretching_n_m3: 0.0 };
    assert!(matches!(none.inverse(1.0), Err(InverseError::NotReached { .. })));
}

#[test]
fn validity_is_said() {
    let law = Elastic { indenter: SPHERE, modulus_pa: 8e3, poisson_ratio: 0.4 };
    assert_eq!(law.validity(-1.0), Validity::NoContact);
    assert_eq!(law.validity(1e-3), Validity::Holds);
    assert!(
        matches!(law.validity(1e-2), Validity::Beyond { quantity: "delta / R", value, .. } if value == 0.5)
    );
    assert_eq!(jkr(0.3).validity(-1e-5), Validity::Holds);
    assert_eq!(jkr(0.3).validity(-1.0), Validity::NoContact);
    assert_eq!(law.validity(f64::NAN), Validity::NoContact);
}

proptest! {
    #[test]
    fn the_inverse_undoes_the_force(d in -5.0_f64..-1.7, which in 0usize..21) {
        let d = 10_f64.powf(d);
        let (name, law) = laws::<f64>().swap_remove(which);
        let d = if name == "rim" { d + 1e-3 } else { d };
        let f = law.force(d);
        let back = law.inverse(f).unwrap();
        prop_assert!((back - d).abs() <= 1e-9 * d, "{name}: {d} {f} {back}");
    }

    #[test]
    fn forces_rise(d in -5.0_f64..-1.7, which in 0usize..21) {
        let d = 10_f64.powf(d);
        let (name, law) = laws::<f64>().swap_remove(which);
        prop_assert!(law.force(d * 1.01) >= law.force(d), "{name} at {d}");
        prop_assert!(law.derivative(d) >= 0.0, "{name} at {d}");
    }

    #[test]
    fn no_number_panics(d in any::<f64>(), f in any::<f64>(), which in 0usize..21) {
        let (name, law) = laws::<f64>().swap_remove(which);
        let force = law.force(d);
        prop_assert!(d.is_nan() || force.is_finite() || d.abs() > 1e60, "{name} at {d}: {force}");
        let _ = (law.derivative(d), law.validity(d), law.inverse(f));
    }
}
