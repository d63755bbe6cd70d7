//! The layer's factor against a plain contact solution by rings of pressure, and against published series.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::f64::consts::PI;

use hertz_contact::indenter::Indenter;
use hertz_contact::law::{Base, Dimitriadis, Elastic, Law, Layer, Layered, Validity};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

const SPHERE: Indenter = Indenter::Sphere { radius_m: 1.0 };
const CYLINDER: Indenter = Indenter::Cylinder { radius_m: 1.0 };
const CONE: Indenter = Indenter::Cone { angle_rad: PI / 4.0 };

/// J0 and J1 by their integrals; the trapezoid rule is exact for as many points as the argument has units.
fn bessel(x: f64) -> (f64, f64) {
    let n = 64 + x.abs() as usize;
    let (mut j0, mut j1) = (0.0, 0.0);
    for i in 0..n {
        let t = PI * (i as f64 + 0.5) / n as f64;
        j0 += (x * t.sin()).cos();
        j1 += (t - x * t.sin()).cos();
    }
    (j0 / n as f64, j1 / n as f64)
}

/// Complete elliptic integrals K and E of the squared modulus, by the arithmetic-geometric mean.
fn elliptic(m: f64) -> (f64, f64) {
    let (mut a, mut b, mut sum, mut power) = (1.0, (1.0 - m).sqrt(), 0.5 * m, 0.5);
    for _ in 0..40 {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        power *= 2.0;
        sum += power * c * c;
    }
    let k = PI / (2.0 * a);
    (k, k * (1.0 - sum))
}

/// What the surface of a half-space (E* = 1) goes down at r under unit pressure on a disc of radius b.
fn half_space(b: f64, r: f64) -> f64 {
    if b == 0.0 {
        0.0
    } else if r < b {
        4.0 * b / PI * elliptic((r / b).powi(2)).1
    } else {
        let m = (b / r).powi(2);
        let (k, e) = elliptic(m);
        4.0 * r / PI * (e - (1.0 - m) * k)
    }
}

/// Response of a layer over a half-space, from the textbook's form in hyperbolic functions.
fn response(x: f64, nu: f64, base: Base) -> f64 {
    let k = 3.0 - 4.0 * nu;
    match base {
        Base::Free => ((2.0 * x).cosh() - 1.0) / ((2.0 * x).sinh() + 2.0 * x),
        Base::Bonded => {
            (2.0 * k * (2.0 * x).sinh() - 4.0 * x) / (2.0 * k * (2.0 * x).cosh() + 1.0 + k * k + 4.0 * x * x)
        }
    }
}

/// Force (E* = 1, H = 1) on a body of the profile pressed in by `depth`, from ring pressures on a grid out to `edge`:
/// what pulls at the rim is set free until nothing does.
fn force_by_rings(profile: impl Fn(f64) -> f64, depth: f64, edge: f64, nu: f64, base: Base, n: usize) -> f64 {
    let width = edge / n as f64;
    let middles: Vec<f64> = (0..n).map(|i| (i as f64 + 0.5) * width).collect();
    let borders: Vec<f64> = (0..=n).map(|i| i as f64 * width).collect();
    let waves: Vec<f64> = (0..400).map(|i| (f64::from(i) + 0.5) * 0.05).collect();
    let j0: Vec<Vec<f64>> = middles.iter().map(|r| waves.iter().map(|x| bessel(x * r).0).collect()).collect();
    let j1: Vec<Vec<f64>> = borders.iter().map(|b| waves.iter().map(|x| bessel(x * b).1).collect()).collect();
    let missing: Vec<f64> = waves.iter().map(|x| 2.0 * 0.05 * (1.0 - response(*x, nu, base)) / x).collect();
    let disc = |b: usize, r: usize| -> f64 {
        let layer: f64 = (0..waves.len()).map(|i| missing[i] * j1[b][i] * j0[r][i]).sum();
        half_space(borders[b], middles[r]) - borders[b] * layer
    };
    let all: Vec<Vec<f64>> = (0..n).map(|r| (0..=n).map(|b| disc(b, r)).collect()).collect();
    let mut touching = n;
    loop {
        let matrix = DMatrix::from_fn(touching, touching, |i, j| all[i][j + 1] - all[i][j]);
        let right = DVector::from_fn(touching, |i, _| depth - profile(middles[i]));
        let p = matrix.lu().solve(&right).unwrap();
        let pressed = p.iter().rposition(|p| *p > 0.0).unwrap() + 1;
        if pressed == touching {
            return p.iter().zip(borders.windows(2)).map(|(p, b)| p * PI * (b[1] * b[1] - b[0] * b[0])).sum();
        }
        // One too many at once would not come back.
        touching -= (touching - pressed).div_ceil(8);
    }
}

/// The sum over waves is a midpoint rule: over a smooth decaying function it is good to 1e-5.
#[test]
fn rings_give_hertz_on_a_thick_layer() {
    let depth: f64 = 1e-4;
    let force = force_by_rings(|r| 0.5 * r * r, depth, 0.015, 0.5, Base::Bonded, 150);
    let factor = force / (4.0 / 3.0 * depth.powf(1.5));
    // First order: 1 + 1.14 chi at chi = 0.01.
    assert!((factor - 1.0114).abs() < 2e-3, "{factor}");
}

/// 1 % is what is asked; 0.4 % is what the rings themselves reach.
fn a_sphere_against_rings(nu: f64, base: Base, chis: &[f64]) {
    let layer = Layer::new(&SPHERE, nu, base).unwrap();
    for &chi in chis {
        let depth = chi * chi;
        let force = force_by_rings(|r| 0.5 * r * r, depth, 1.9 * chi, nu, base, 110);
        let factor = force / (4.0 / 3.0 * chi * chi * chi);
        let ratio = layer.factor(chi).0 / factor;
        assert!((ratio - 1.0).abs() < 4e-3, "{base:?} {nu} {chi}: {factor} {ratio}");
    }
}

#[test]
fn a_gel_under_a_sphere_against_rings() {
    a_sphere_against_rings(0.5, Base::Bonded, &[0.3, 1.0, 2.2]);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_spheres_against_rings() {
    for base in [Base::Bonded, Base::Free] {
        for nu in [0.0, 0.3, 0.45, 0.5] {
            a_sphere_against_rings(nu, base, &[0.1, 0.3, 0.5, 0.75, 1.0, 1.5, 2.2]);
        }
    }
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_punches_and_cones_against_rings() {
    for base in [Base::Bonded, Base::Free] {
        for nu in [0.3, 0.5] {
            let layer = Layer::new(&CYLINDER, nu, base).unwrap();
            for chi in [0.2, 1.0, 2.5] {
                let force = |n| force_by_rings(|_| 0.0, 1.0, chi, nu, base, n);
                // The edge's singular pressure makes the error fall with 1/n: extrapolated.
                let ratio = layer.factor(chi).0 / ((2.0 * force(120) - force(60)) / (2.0 * chi));
                assert!((ratio - 1.0).abs() < 4e-3, "{base:?} {nu} {chi}: {ratio}");
            }
            let layer = Layer::new(&CONE, nu, base).unwrap();
            for chi in [0.2, 1.0, 2.5] {
                let force = force_by_rings(|r| r, chi, 1.5 * chi, nu, base, 120);
                let ratio = layer.factor(chi).0 / (force / (2.0 / PI * chi * chi));
                assert!((ratio - 1.0).abs() < 4e-3, "{base:?} {nu} {chi}: {ratio}");
            }
        }
    }
}

/// The first-order term is Dimitriadis's; so are the numbers on how far off their polynomial is.
#[test]
fn dimitriadis_is_the_beginning() {
    let elastic = Elastic { indenter: SPHERE, modulus_pa: 1.0, poisson_ratio: 0.5 };
    let ratio = |chi: f64, base, nu: f64| {
        let poly = Dimitriadis {
            radius_m: 1.0,
            modulus_pa: 1.0,
            poisson_ratio: nu,
            base,
            inverse_thickness_per_m: 1.0,
        };
        let layered = Layered {
            elastic: Elastic { poisson_ratio: nu, ..elastic },
            layer: Layer::new(&SPHERE, nu, base).unwrap(),
            inverse_thickness_per_m: 1.0,
        };
        poly.force(chi * chi) / layered.force(chi * chi)
    };
    // On a base without friction the factor is the same for every Poisson's ratio; theirs meets it near 0.3 only.
    for (base, nu) in [(Base::Bonded, 0.3), (Base::Bonded, 0.4), (Base::Bonded, 0.5), (Base::Free, 0.3)] {
        assert!((ratio(0.02, base, nu) - 1.0).abs() < 1e-3, "{base:?} {nu} {}", ratio(0.02, base, nu));
    }
    let bonded = |chi| ratio(chi, Base::Bonded, 0.5);
    assert!((bonded(0.3) - 0.97).abs() < 5e-3, "{}", bonded(0.3));
    assert!((bonded(0.5) - 0.92).abs() < 5e-3, "{}", bonded(0.5));
    assert!((bonded(0.75) - 0.847).abs() < 5e-3, "{}", bonded(0.75));
    // The coefficients printed for nu = 0.5; the general formula gives the last one of the bonded layer with a minus.
    let at = |base, chi: f64| {
        let poly = Dimitriadis {
            radius_m: 1.0,
            modulus_pa: 1.0,
            poisson_ratio: 0.5,
            base,
            inverse_thickness_per_m: 1.0,
        };
        poly.force(chi * chi) / elastic.force(chi * chi)
    };
    let one = 1.0 + 1.133 + 1.283 + 0.769 - 0.0975;
    assert!((at(Base::Bonded, 1.0) / one - 1.0).abs() < 1e-3);
    let one = 1.0 + 0.884 + 0.781 + 0.386 + 0.0048;
    assert!((at(Base::Free, 1.0) / one - 1.0).abs() < 1e-3);
}

/// A wide punch on a compressible bonded layer squeezes it like a piston: stiffness `pi a^2 E (1 - nu)/((1 + nu)(1 - 2 nu) H)`,
/// to first order in H/a.
#[test]
fn wide_contacts_approach_the_piston() {
    for nu in [0.0, 0.2, 0.3] {
        let layer = Layer::new(&CYLINDER, nu, Base::Bonded).unwrap();
        let piston =
            |chi: f64| 0.5 * PI * chi * (1.0 - nu * nu) * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let (near, far) = (layer.factor(2.0).0 / piston(2.0), layer.factor(4.0).0 / piston(4.0));
        // The edge's excess falls like H/a.
        assert!(far < near && (2.0 * far - near - 1.0).abs() < 0.02, "{nu}: {near} {far}");
    }
}

#[test]
fn the_factor_starts_at_one_and_goes_on_beyond_the_series() {
    for indenter in [SPHERE, CYLINDER, CONE] {
        for base in [Base::Bonded, Base::Free] {
            let layer = Layer::new(&indenter, 0.5, base).unwrap();
            assert!((layer.factor(0.0_f64).0 - 1.0).abs() < 1e-12);
            assert!((layer.factor(-3.0_f64).0 - 1.0).abs() < 1e-12);
            let end = layer.chi_end();
            let (below, above) = (layer.factor(end * (1.0 - 1e-9)), layer.factor(end * (1.0 + 1e-9)));
            assert!((below.0 / above.0 - 1.0).abs() < 1e-7 && (below.1 - above.1).abs() < 1e-6);
            assert!(layer.factor(1e3_f64).0.is_finite());
        }
    }
    let per_m = 1.0 / 0.01;
    let law = Layered {
        elastic: Elastic {
            indenter: Indenter::Sphere { radius_m: 1.0 },
            modulus_pa: 1e4,
            poisson_ratio: 0.5,
        },
        layer: Layer::new(&SPHERE, 0.5, Base::Bonded).unwrap(),
        inverse_thickness_per_m: per_m,
    };
    assert!(matches!(law.validity(9e-4), Validity::Beyond { quantity: "chi", .. }));
    assert!(matches!(law.validity(1e-2), Validity::Beyond { quantity: "delta / thickness", .. }));
    assert_eq!(law.validity(1e-4), Validity::Holds);
}

proptest! {
    #[test]
    fn thinner_is_stiffer(chi in 0.0_f64..6.0, nu in -0.9_f64..0.5, which in 0usize..3, free in any::<bool>()) {
        let indenter = [SPHERE, CYLINDER, CONE][which];
        let layer = Layer::new(&indenter, nu, if free { Base::Free } else { Base::Bonded }).unwrap();
        let (factor, slope) = layer.factor(chi);
        let h = 1e-6 * (1.0 + chi);
        let difference = (layer.factor(chi + h).0.ln() - layer.factor((chi - h).max(0.0)).0.ln())
            / (chi + h - (chi - h).max(0.0));
        prop_assert!(factor >= 1.0 - 1e-9 && slope >= -1e-6, "{factor} {slope}");
        prop_assert!((difference * chi - slope).abs() < 1e-5, "{difference} {slope}");
    }
}
