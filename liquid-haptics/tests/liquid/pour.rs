//! Pouring against quadrature: what has left is what was wanted.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::f64::consts::{FRAC_PI_2, PI};

use crate::common::Cavity;
use liquid_haptics::container::{Container, ContainerError, Cylinder, Fill};
use liquid_haptics::pour::{Bead, Mouth, Pour, PourError};
use nalgebra::UnitVector3;

const CAVITY: Cavity = Cavity { radius: 0.039, length: 0.158, bottom: 0.001 };
/// Midpoint columns: the volume is good to some 1e-9 of itself.
const COLUMNS: usize = 100_000;

fn bottle() -> Cylinder {
    Cylinder::new(0.040, 0.160, 0.001).unwrap()
}

/// Lowest point of the rim above the container's origin.
fn rim(tilt: f64, radius: f64) -> f64 {
    (CAVITY.bottom + CAVITY.length) * tilt.cos() - radius * tilt.sin()
}

/// Eq. 2.7: over volumes, amounts, lips and beads, what quadrature finds above the level at the lip is what was wanted.
#[test]
fn what_leaves_is_what_was_wanted() {
    let bottle = bottle();
    let mut checked = 0;
    for (lip, bead) in [(0.039, 0.0), (0.039, 0.004), (0.030, 0.0), (0.025, 0.005)] {
        let mouth = Mouth::new(lip, 0.159).unwrap();
        let pour = Pour::new(&bottle, mouth, Bead::measured(bead, bead).unwrap(), PI).unwrap();
        for inside in [200e-6, 400e-6, 500e-6, 700e-6] {
            for share in [0.01, 0.25, 0.5, 0.75] {
                let tilt = pour.tilt_rad(inside, share * inside).unwrap();
                let left = inside - CAVITY.below(tilt, rim(tilt, lip) + bead, COLUMNS)[0];
                approx::assert_relative_eq!(left, share * inside, max_relative = 1e-6);
                // A little earlier less has left: it is the first such tilt.
                let before = inside - CAVITY.below(tilt - 1e-3, rim(tilt - 1e-3, lip) + bead, COLUMNS)[0];
                assert!(before < left, "{before} had left before {left}");
                checked += 1;
            }
        }
    }
    assert_eq!(checked, 64);
    let mouth = Mouth::of_cylinder(&bottle);
    assert!((mouth.lowest_m(0.7) - rim(0.7, 0.039)).abs() < 1e-15);
}

/// Without a bead a wide mouth lets out everything, half a tilt to the side; with one, or with a lip, not by then.
#[test]
fn all_of_it_leaves_on_its_side() {
    let bottle = bottle();
    let pour = Pour::new(&bottle, Mouth::of_cylinder(&bottle), Bead::default(), PI).unwrap();
    let tilt = pour.tilt_rad(300e-6, 300e-6).unwrap();
    // The last 1e-13 of the capacity is a film that leaves within the last microradians.
    assert!((tilt - FRAC_PI_2).abs() < 1e-3, "empty at {tilt}");
    let brim = pour.pourable(bottle.capacity_m3()).unwrap();
    assert!(brim.start_tilt_rad < 1e-3 && brim.least_m3 < 1e-9 * bottle.capacity_m3());
    let lip = Pour::new(&bottle, Mouth::new(0.02, 0.159).unwrap(), Bead::default(), FRAC_PI_2).unwrap();
    let most = lip.pourable(300e-6).unwrap().most_m3;
    let stays = CAVITY.below(FRAC_PI_2, rim(FRAC_PI_2, 0.02), COLUMNS)[0];
    // At a right angle the columns are cut at the level by whole cells: the quadrature is of first order.
    approx::assert_relative_eq!(300e-6 - most, stays, max_relative = 2e-5);
    assert!(stays > 20e-6);
}

/// A bead that breaks higher than it rests lets out a least amount, and says so; more than can leave is refused with the most.
#[test]
fn too_little_and_too_much_are_errors_that_say_what_can_be_poured() {
    let bottle = bottle();
    let bead = Bead::capillary(0.072, 997.0, 0.75 * PI, 0.25 * PI, 9.80665).unwrap();
    let pour = Pour::new(&bottle, Mouth::of_cylinder(&bottle), bead, FRAC_PI_2).unwrap();
    let inside = 400e-6;
    let can = pour.pourable(inside).unwrap();
    // By hand: the tilt at which all still lies below the higher level, and what lies above the lower one there.
    let at = |tilt: f64, bead: f64| CAVITY.below(tilt, rim(tilt, 0.039) + bead, COLUMNS)[0];
    approx::assert_relative_eq!(at(can.start_tilt_rad, bead.hold_m()), inside, max_relative = 1e-6);
    let least = inside - at(can.start_tilt_rad, bead.rest_m());
    approx::assert_relative_eq!(can.least_m3, least, max_relative = 1e-6);
    assert!(least > 5e-6, "{least}");
    let Err(PourError::NotPourable { wanted_m3, least_m3, most_m3 }) = pour.tilt_rad(inside, 0.9 * least)
    else {
        panic!("less than the bead lets out");
    };
    assert_eq!((wanted_m3, least_m3, most_m3), (0.9 * least, can.least_m3, can.most_m3));
    let tilt = pour.tilt_rad(inside, can.least_m3).unwrap();
    assert!((tilt - can.start_tilt_rad).abs() < 1e-6);
    for wanted in [1.001 * can.most_m3, inside, 1.5 * inside] {
        assert!(
            matches!(pour.tilt_rad(inside, wanted), Err(PourError::NotPourable { most_m3, .. }) if most_m3 == can.most_m3)
        );
    }
    assert!(pour.tilt_rad(inside, can.most_m3).is_ok());
    let film = inside - can.most_m3;
    assert!(film > 1e-6 && film < 0.1 * inside, "{film} stays on the side");
}

/// Puddles of water: l_c is 2.71 mm (de Gennes et al. 2004, table 2.1 and section 2.2), 2 l_c at 180 degrees.
#[test]
fn the_bead_of_water_is_some_millimetres() {
    let height =
        |degrees: f64| Bead::capillary(0.072, 997.0, degrees.to_radians(), 0.0, 9.80665).unwrap().hold_m();
    approx::assert_relative_eq!(height(180.0), 5.427e-3, max_relative = 1e-3);
    approx::assert_relative_eq!(height(90.0), 5.427e-3 / 2f64.sqrt(), max_relative = 1e-3);
    assert_eq!(height(0.0), 0.0);
    assert!(matches!(Bead::measured(0.001, 0.002), Err(PourError::Range { name: "rest_m", .. })));
    assert!(matches!(
        Bead::capillary(0.072, 997.0, 1.0, 2.0, 9.8),
        Err(PourError::Range { name: "receding_rad", .. })
    ));
    assert!(matches!(
        Bead::capillary(0.0, 997.0, 1.0, 1.0, 9.8),
        Err(PourError::Range { name: "surface_tension_n_m", .. })
    ));
}

/// Turned at the rate, the flow is the one that was wanted: what leaves in a short time, by quadrature.
#[test]
fn the_rate_gives_the_flow() {
    let bottle = bottle();
    let bead = Bead::measured(0.004, 0.003).unwrap();
    let pour = Pour::new(&bottle, Mouth::of_cylinder(&bottle), bead, PI).unwrap();
    let flow = 20e-6;
    for tilt in [0.7, 1.0, 1.3, 1.5] {
        let rate = pour.tilt_rate_rad_s(tilt, flow).unwrap();
        let at = |tilt: f64| CAVITY.below(tilt, rim(tilt, 0.039) + 0.003, COLUMNS)[0];
        let half = 0.5e-3;
        let left = at(tilt - rate * half) - at(tilt + rate * half);
        // The quadrature's own error over a difference of 1e-4 of the volume.
        approx::assert_relative_eq!(left / (2.0 * half), flow, max_relative = 1e-4);
    }
    // Upright the level is below a full bottle's rim: nothing flows.
    assert!(matches!(pour.tilt_rate_rad_s(0.0, flow), Err(PourError::NoFlow { .. })));
    assert!(matches!(pour.tilt_rate_rad_s(1.0, -flow), Err(PourError::Range { .. })));
    assert!(matches!(pour.tilt_rate_rad_s(4.0, flow), Err(PourError::Range { .. })));
}

/// A box as a mesh: on its edge the liquid is a prism, by hand.
#[cfg(feature = "mesh")]
#[test]
fn a_box_of_triangles_pours_like_a_prism() {
    use liquid_haptics::container::mesh::{MeshContainer, PlannedMesh};
    use nalgebra::Point3;

    let (half, length) = (0.04, 0.15);
    let pick = |k: usize, axis: usize| k >> axis & 1 == 1;
    let side = |up| if up { half } else { -half };
    let vertices = (0..8)
        .map(|k| Point3::new(side(pick(k, 0)), side(pick(k, 1)), if pick(k, 2) { length } else { 0.0 }))
        .collect();
    let quads: [[u32; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    let planned = PlannedMesh::new(MeshContainer::new(vertices, triangles).unwrap());
    let mouth = Mouth::new(half, length).unwrap();
    let pour = Pour::new(&planned, mouth, Bead::default(), FRAC_PI_2).unwrap();
    let width = 2.0 * half;
    let inside = 0.8 * width * width * length;
    // All that stays is a triangular prism at the lower wall: its legs the wall's length and that times the tangent of what is
    // left to the side.
    for stays in [0.3, 0.1, 0.01] {
        let stays = stays * width * width * length;
        let tilt = pour.tilt_rad(inside, inside - stays).unwrap();
        let prism = 0.5 * length * length * (FRAC_PI_2 - tilt).tan() * width;
        approx::assert_relative_eq!(prism, stays, max_relative = 1e-6);
    }
    // While the level still covers the bottom: the box less a triangle along the top.
    let tilt = pour.tilt_rad(inside, 0.1 * width * width * length).unwrap();
    let stays = width * width * (length - 0.5 * width * tilt.tan());
    approx::assert_relative_eq!(inside - stays, 0.1 * width * width * length, max_relative = 1e-6);
}

/// What stays need not fall all the way: the first tilt counts, and what has left does not come back.
#[test]
fn a_belly_that_fills_again_gives_nothing_back() {
    /// Stays 1 - sin(2 tilt), whatever the level.
    struct Belly;
    impl Container for Belly {
        fn capacity_m3(&self) -> f64 {
            1.0
        }
        fn fill(&self, _: &UnitVector3<f64>, got_m3: f64) -> Result<Fill, ContainerError> {
            Err(ContainerError::Volume { got_m3, capacity_m3: 1.0 })
        }
        fn volume_below(&self, up: &UnitVector3<f64>, _: f64) -> Result<f64, ContainerError> {
            Ok(1.0 - (2.0 * (-up.x).atan2(up.z)).sin().max(0.0))
        }
    }
    let pour = Pour::new(&Belly, Mouth::new(0.1, 0.1).unwrap(), Bead::default(), FRAC_PI_2).unwrap();
    let tilt = pour.tilt_rad(1.0, 0.5).unwrap();
    assert!((tilt - PI / 12.0).abs() < 1e-9, "{tilt}");
    // The most leaves at a quarter of a turn's half, though a steeper tilt keeps more.
    approx::assert_relative_eq!(pour.pourable(1.0).unwrap().most_m3, 1.0, max_relative = 1e-9);
    assert!(pour.tilt_rad(1.0, 1.0).is_ok());
}

#[test]
fn what_cannot_be_is_refused() {
    let bottle = bottle();
    let mouth = Mouth::of_cylinder(&bottle);
    assert!(matches!(Mouth::new(0.0, 0.1), Err(PourError::Range { name: "radius_m", .. })));
    assert!(matches!(Pour::new(&bottle, mouth, Bead::default(), 4.0), Err(PourError::Range { .. })));
    let pour = Pour::new(&bottle, mouth, Bead::default(), PI).unwrap();
    let over = 1.01 * bottle.capacity_m3();
    for (inside, wanted) in [(over, 1e-6), (0.0, 1e-6), (1e-4, 0.0), (1e-4, f64::NAN)] {
        assert!(matches!(pour.tilt_rad(inside, wanted), Err(PourError::Range { .. })));
    }
    // Little in a bottle that is hardly tilted: none leaves.
    let timid = Pour::new(&bottle, mouth, Bead::default(), 0.3).unwrap();
    assert!(matches!(timid.pourable(50e-6), Err(PourError::NothingLeaves { .. })));
}
