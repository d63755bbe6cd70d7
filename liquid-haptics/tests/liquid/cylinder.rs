//! The cylinder's closed forms against quadrature over the whole range of shapes, tilts and volumes.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::f64::consts::PI;

use liquid_haptics::container::{Container, ContainerError, Cylinder, up_at_tilt};
use proptest::prelude::*;

/// Volume and first moments (about the lowest line of the wall, about the bottom) of what lies below a surface that meets
/// the bottom at `x = 1 - delta`, in a cylinder of unit radius at a tilt in (0, pi/2]: dense composite quadrature over the
/// angle, slice by slice along the axis. It shares no formula with the closed forms.
fn quadrature(length: f64, tilt: f64, delta: f64) -> [f64; 3] {
    // Composite Gauss-Legendre, 5 points a panel.
    const POINTS: [(f64, f64); 5] = [
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (-0.538_469_310_105_683, 0.478_628_670_499_366_47),
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let over = |from: f64, to: f64, panels: usize, f: &mut dyn FnMut(f64, f64)| {
        let h = (to - from) / panels as f64;
        for p in 0..panels {
            for (x, w) in POINTS {
                f(from + h * (p as f64 + 0.5 + 0.5 * x), 0.5 * h * w);
            }
        }
    };
    let cotangent = tilt.cos() / tilt.sin();
    // Heights along the axis at which the wet segment changes its kind: dry above, whole below.
    let top = if cotangent > 0.0 { (delta / cotangent).min(length) } else { length };
    let whole = if cotangent > 0.0 { ((delta - 2.0) / cotangent).clamp(0.0, length) } else { 0.0 };
    let mut sums = [0.0; 3];
    over(0.0, whole, 1, &mut |z, w| {
        sums[0] += w * PI;
        sums[1] += w * PI;
        sums[2] += w * PI * z;
    });
    // The segment's area goes with a power 3/2 of the distance from either end: quadratic panels towards both.
    let span = top - whole;
    over(0.0, 1.0, 60, &mut |u, w| {
        let (s, ds) = (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u));
        let z = whole + span * s;
        // Counted from the dry end, so that nothing cancels there.
        let left = if cotangent > 0.0 && top < length {
            cotangent * span * (1.0 - s)
        } else {
            delta - cotangent * z
        };
        let alpha = 2.0 * (0.5 * left.clamp(0.0, 2.0)).sqrt().asin();
        let (mut area, mut moment) = (0.0, 0.0);
        over(0.0, alpha, 12, &mut |phi, w| {
            let chord = 2.0 * phi.sin().powi(2) * w;
            area += chord;
            moment += chord * 2.0 * (0.5 * phi).sin().powi(2);
        });
        let w = w * ds * span;
        sums[0] += w * area;
        sums[1] += w * moment;
        sums[2] += w * area * z;
    });
    sums
}

#[allow(clippy::approx_constant, reason = "angles beside pi/2, not that angle")]
const TILTS: [f64; 16] = [
    1e-12,
    1e-9,
    1e-6,
    1e-3,
    0.1,
    0.4,
    PI / 4.0,
    1.2,
    1.5,
    1.57,
    1.570_79,
    1.570_796_3,
    1.570_796_326,
    1.570_796_326_793,
    1.570_796_326_794_896_6,
    0.0,
];
const RATIOS: [f64; 7] = [0.01, 0.1, 0.5, 1.0, 3.0, 20.0, 100.0];
const SHARES: [f64; 13] =
    [1e-9, 1e-7, 1e-5, 1e-3, 0.02, 0.1, 0.3, 0.5, 0.6, 0.9, 0.999, 1.0 - 1e-7, 1.0 - 1e-9];

#[test]
fn heights_volumes_and_centres_agree_with_quadrature() {
    let mut worst = [0.0f64; 4];
    for ratio in RATIOS {
        let length = 1.0 / ratio;
        let cylinder = Cylinder::new(1.0, length, 0.0).unwrap();
        let capacity = cylinder.capacity_m3();
        for tilt in TILTS {
            let up = up_at_tilt(tilt);
            for share in SHARES {
                let volume = share * capacity;
                let fill = cylinder.fill(&up, volume).unwrap();
                let size = length.max(1.0);
                let back = cylinder.volume_below(&up, fill.surface_height_m).unwrap();
                // Heights are rounded to the size of the cylinder; volume moves with them by the surface's area.
                let rounding = 4e-16 * size * surface(length, tilt);
                worst[0] = worst[0].max(((back - volume).abs() - rounding).max(0.0) / volume);
                if tilt == 0.0 {
                    let expected = [0.0, 0.5 * share * length];
                    worst[1] = worst[1].max((fill.center_of_mass.x - expected[0]).abs() / size);
                    worst[2] = worst[2].max((fill.center_of_mass.z - expected[1]).abs() / size);
                    continue;
                }
                // Half full and less is integrated; the rest is its mirror image and is checked by mass balance.
                if share > 0.5 {
                    let other = cylinder.fill(&up, capacity - volume).unwrap();
                    let air = capacity - volume;
                    for (k, middle) in [(0, 0.0), (2, 0.5 * length)] {
                        let liquid = fill.center_of_mass[k];
                        let gas = 2.0 * middle - other.center_of_mass[k];
                        let balance = (volume * liquid + air * gas) / capacity - middle;
                        assert!(balance.abs() < 1e-12 * size, "{ratio} {tilt} {share}: {balance}");
                    }
                    continue;
                }
                let delta = 1.0 + fill.surface_height_m / tilt.sin();
                if delta < 1e-6 || delta * tilt.sin() < 1e-6 {
                    // The height as a number no longer resolves the depth: solve for it in the quadrature.
                    continue;
                }
                let [v, wall, bottom] = quadrature(length, tilt, delta);
                let condition = 1.0 + 1e-15 / (delta * tilt.sin()) / 1e-10;
                worst[3] = worst[3].max((v / volume - 1.0).abs() / condition);
                worst[1] = worst[1].max(((1.0 - fill.center_of_mass.x) - wall / v).abs() / condition);
                worst[2] = worst[2].max((fill.center_of_mass.z - bottom / v).abs() / size / condition);
            }
        }
    }
    println!(
        "volume of height {:.1e}, x {:.1e}, z {:.1e}, volume {:.1e}",
        worst[0], worst[1], worst[2], worst[3]
    );
    assert!(worst.iter().all(|w| *w < 1e-9), "{worst:?}");
}

/// Area of the largest horizontal cut.
fn surface(length: f64, tilt: f64) -> f64 {
    (PI / tilt.cos().abs().max(1e-300)).min(2.0 * length / tilt.sin().max(1e-300))
}

#[test]
fn what_does_not_fit_is_an_error() {
    assert!(Cylinder::new(0.0, 1.0, 0.0).is_err());
    assert!(Cylinder::new(1.0, f64::NAN, 0.0).is_err());
    assert!(Cylinder::new(1.0, 1.0, 0.5).is_err());
    assert!(Cylinder::new(1.0, 1.0, -0.1).is_err());
    let cylinder = Cylinder::new(0.04, 0.15, 0.001).unwrap();
    let up = up_at_tilt(0.3);
    for volume in [-1e-9, f64::NAN, f64::INFINITY, 1.001 * cylinder.capacity_m3()] {
        assert!(matches!(cylinder.fill(&up, volume), Err(ContainerError::Volume { .. })));
    }
    assert!(cylinder.volume_below(&up, f64::NAN).is_err());
    assert_eq!(cylinder.volume_below(&up, -1.0).unwrap(), 0.0);
    assert_eq!(cylinder.volume_below(&up, 1.0).unwrap(), cylinder.capacity_m3());
}

#[test]
fn empty_and_full_are_limits() {
    let cylinder = Cylinder::new(0.04, 0.15, 0.001).unwrap();
    for tilt in [0.0, 0.3, 1.3, PI / 2.0, 2.0, 3.0, PI] {
        let up = up_at_tilt(tilt);
        let empty = cylinder.fill(&up, 0.0).unwrap();
        let little = cylinder.fill(&up, 1e-12 * cylinder.capacity_m3()).unwrap();
        assert!((empty.surface_height_m - little.surface_height_m).abs() < 1e-4, "{tilt}");
        // On its side the last drop lies along the whole wall, a hair off it in a corner.
        if tilt > 0.0 && tilt < PI && tilt != PI / 2.0 {
            assert!((empty.center_of_mass - little.center_of_mass).norm() < 1e-3, "{tilt}");
        }
        let full = cylinder.fill(&up, cylinder.capacity_m3()).unwrap();
        assert!((full.center_of_mass - nalgebra::Vector3::new(0.0, 0.0, 0.075)).norm() < 1e-15, "{tilt}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Centre of mass below the surface and inside the cavity; a little more liquid moves the surface up and the moments
    /// by what was added (mass balance), across all cases.
    #[test]
    fn liquid_lies_where_liquid_lies(
        log_ratio in -2.0f64..2.0, tilt in 0.0f64..PI, azimuth in 0.0f64..6.3, share in 0.0f64..1.0, wall in 0.0f64..0.4
    ) {
        let (radius, length) = (0.05, 0.05 / 10f64.powf(log_ratio));
        let cylinder = Cylinder::new(radius, length, wall * radius.min(0.5 * length)).unwrap();
        let (inner, wall) = (cylinder.inner_radius_m(), wall * radius.min(0.5 * length));
        let up = nalgebra::UnitVector3::new_normalize(nalgebra::Vector3::new(
            -tilt.sin() * azimuth.cos(), -tilt.sin() * azimuth.sin(), tilt.cos(),
        ));
        let volume = share * cylinder.capacity_m3();
        let fill = cylinder.fill(&up, volume).unwrap();
        let (c, size) = (fill.center_of_mass, radius.max(length));
        prop_assert!(c.dot(&up) <= fill.surface_height_m + 1e-12 * size);
        prop_assert!(c.x.hypot(c.y) <= inner * (1.0 + 1e-12));
        prop_assert!(c.z >= wall - 1e-12 * size && c.z <= length - wall + 1e-12 * size);
        let more = cylinder.fill(&up, (volume * (1.0 + 1e-6)).min(cylinder.capacity_m3())).unwrap();
        prop_assert!(more.surface_height_m >= fill.surface_height_m - 1e-15 * size);
        let added = more.volume_m3 - volume;
        if added > 0.0 && volume > 1e-3 * cylinder.capacity_m3() {
            // What was added lies at the surface.
            let at = (more.center_of_mass * more.volume_m3 - c * volume) / added;
            let height = at.dot(&up);
            let thin = (more.surface_height_m - fill.surface_height_m) + 1e-8 * size;
            prop_assert!((height - fill.surface_height_m).abs() <= thin, "{height} {}", fill.surface_height_m);
        }
        // Mirrored and turned over.
        let mirrored = cylinder.fill(&nalgebra::UnitVector3::new_unchecked(nalgebra::Vector3::new(-up.x, -up.y, up.z)), volume).unwrap();
        prop_assert!((mirrored.center_of_mass.x + c.x).abs() < 1e-15 && (mirrored.center_of_mass.z - c.z).abs() < 1e-15);
        let turned = cylinder.fill(&nalgebra::UnitVector3::new_unchecked(nalgebra::Vector3::new(up.x, up.y, -up.z)), volume).unwrap();
        prop_assert!((turned.center_of_mass.x - c.x).abs() < 1e-14 && (turned.center_of_mass.z - (length - c.z)).abs() < 1e-14 * size.max(1.0));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// The four cases meet: across the tilts and volumes at which one turns into another, centre and surface move by no more than
    /// the step does.
    #[test]
    fn the_four_cases_meet(log_ratio in -1.0f64..1.0, share in 0.02f64..0.98, top in proptest::bool::ANY) {
        let (radius, length) = (1.0, 1.0 / 10f64.powf(log_ratio));
        let cylinder = Cylinder::new(radius, length, 0.0).unwrap();
        let volume = share * cylinder.capacity_m3();
        // The surface reaches the bottom's (or the lid's) edge at this tilt.
        let depth = if top { (1.0 - share) * length } else { share * length };
        let edge = (depth / radius).atan();
        let step = 1e-9;
        let at = |tilt: f64| cylinder.fill(&up_at_tilt(tilt), volume).unwrap();
        let (before, after) = (at(edge - step), at(edge + step));
        let size = length.max(radius);
        let jump = (before.center_of_mass - after.center_of_mass).norm();
        prop_assert!(jump < 50.0 * step * size * (1.0 + size / length.min(radius)).powi(2), "{}", jump);
        prop_assert!((before.surface_height_m - after.surface_height_m).abs() < 50.0 * step * size);
    }
}
