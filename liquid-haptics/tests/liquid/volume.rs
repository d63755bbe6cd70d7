//! Volumes recovered from poses that were simulated by quadrature.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::f64::consts::PI;

use liquid_haptics::volume::{
    Cause, ErrorCorrelation, ForceGain, Liquid, MassFit, SettledPose, Verdict, VolumeError, VolumeFit,
    fit_mass,
};

use crate::common::poses::{
    CAVITY, GRASP, SIGMA_N, SIGMA_NM, bottle, exact, fit, holds, noisy, sweep, tilts,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Without noise the volume is the one that was simulated, by mass and by density, to what the quadrature leaves.
#[test]
fn noiseless_poses_give_the_volume() {
    let bottle = bottle();
    for share in [0.05, 0.2, 0.5, 0.7, 0.95] {
        let truth = share * CAVITY.capacity();
        for liquid in [exact(870.0 * truth), Liquid::Density(870.0)] {
            let poses = sweep(&tilts(), 870.0 * truth, share);
            let estimate = fit(&bottle, liquid, Some(1e-5)).estimate(&poses).unwrap();
            approx::assert_relative_eq!(estimate.volume_m3, truth, max_relative = 1e-4);
            approx::assert_relative_eq!(estimate.mass_kg, 870.0 * truth, max_relative = 1e-4);
            assert_eq!(estimate.verdict, Verdict::Determined, "{share}");
            assert!(holds(&estimate, truth) && estimate.misfit_p.unwrap() > 0.9, "{estimate:?}");
        }
    }
}

/// With force and torque noise, 95 % intervals hold the truth in 95 of 100 sweeps: noise known and estimated, density and mass
/// from the forces (its error counted), and both.
#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    const SWEEPS: usize = 200;
    let bottle = bottle();
    let shares = [0.15, 0.3, 0.45, 0.6, 0.75, 0.88];
    let clean: Vec<_> = shares.map(|s| sweep(&tilts(), 1000.0 * s * CAVITY.capacity(), s)).to_vec();
    let mut rng = ChaCha8Rng::seed_from_u64(19);
    let mut held = [0; 6];
    let mut errors = Vec::new();
    for _ in 0..SWEEPS {
        let k = rng.random_range(0..shares.len());
        let truth = shares[k] * CAVITY.capacity();
        let poses = noisy(&clean[k], &mut rng);
        let forces = MassFit { gain: ForceGain::Known(0.0), offsets: false, sigma_n: Some(SIGMA_N) };
        let felt = fit_mass(&GRASP, &poses, &forces).unwrap();
        let mass = Liquid::from(&felt);
        let both =
            Liquid::MassAndDensity { mass_kg: felt.mass_kg, error_kg: felt.error_kg, density_kg_m3: 1000.0 };
        let ways = [
            (mass, Some(SIGMA_NM)),
            (mass, None),
            (Liquid::Density(1000.0), Some(SIGMA_NM)),
            (Liquid::Density(1000.0), None),
            (both, Some(SIGMA_NM)),
            (both, None),
        ];
        for (held, (liquid, sigma)) in held.iter_mut().zip(ways) {
            let estimate = fit(&bottle, liquid, sigma).estimate(&poses).unwrap();
            *held += usize::from(holds(&estimate, truth));
            errors.push((estimate.volume_m3 - truth).abs());
        }
    }
    errors.sort_by(f64::total_cmp);
    println!("held {held:?} of {SWEEPS}; middle error {:.2e} m^3", errors[errors.len() / 2]);
    // Three standard deviations of a binomial count about 190, and not all of them.
    assert!(held.iter().all(|h| (181..200).contains(h)), "{held:?}");
    // Of 755 ml: the middle error is below 2 ml.
    assert!(errors[errors.len() / 2] < 2e-6, "{}", errors[errors.len() / 2]);
}

/// A torque that wanders from pose to pose: the correlation that ten sweeps of the empty bottle show makes intervals that hold as often as they
/// say, and without them they do not.
#[test]
fn intervals_hold_where_the_sensor_wanders() {
    const SWEEPS: usize = 300;
    let (share, lag_one) = (0.6f64, 0.5f64);
    let bottle = bottle();
    let mut rng = ChaCha8Rng::seed_from_u64(29);
    let mut wandering = |poses: &[SettledPose]| -> Vec<SettledPose> {
        let mut draw = |variance: f64| -> f64 {
            SIGMA_NM * variance.sqrt() * Distribution::<f64>::sample(&StandardNormal, &mut rng)
        };
        let mut wander = draw(share);
        let mut felt = poses.to_vec();
        for pose in &mut felt {
            pose.wrench.tau_z_nm += wander + draw(1.0 - share);
            wander = lag_one * wander + draw(share * (1.0 - lag_one * lag_one));
        }
        felt
    };
    let empty = sweep(&tilts(), 0.0, 0.0);
    let errors: Vec<Vec<f64>> = (0..10)
        .map(|_| {
            let pairs = wandering(&empty).into_iter().zip(&empty);
            pairs.map(|(felt, clean)| felt.wrench.tau_z_nm - clean.wrench.tau_z_nm).collect()
        })
        .collect();
    let (learned, _) = ErrorCorrelation::of_sweeps(&errors).unwrap();
    let shares = [0.15, 0.3, 0.45, 0.6, 0.75, 0.88];
    let clean: Vec<_> = shares.map(|s| sweep(&tilts(), 1000.0 * s * CAVITY.capacity(), s)).to_vec();
    let mut held = [0; 2];
    for k in 0..SWEEPS {
        let truth = shares[k % 6] * CAVITY.capacity();
        let poses = wandering(&clean[k % 6]);
        for (held, error_correlation) in held.iter_mut().zip([learned, ErrorCorrelation::NONE]) {
            let fit = VolumeFit { error_correlation, ..fit(&bottle, exact(1000.0 * truth), None) };
            *held += usize::from(holds(&fit.estimate(&poses).unwrap(), truth));
        }
    }
    println!("{learned:?}: held {} of {SWEEPS}; without, {}", held[0], held[1]);
    // 93 to 97 %.
    assert!((279..=291).contains(&held[0]), "{}", held[0]);
    assert!(held[1] < 265, "{}", held[1]);
}

/// The estimated noise is right on average, however few the poses: its degrees of freedom count volume and mass.
#[test]
fn the_noise_is_estimated_without_bias() {
    const SWEEPS: usize = 400;
    let bottle = bottle();
    let mass = 1000.0 * 0.4 * CAVITY.capacity();
    let clean = sweep(&[0.5, 1.0, 1.5, 2.0, 2.5], mass, 0.4);
    let mut rng = ChaCha8Rng::seed_from_u64(23);
    // A mass that is exact, one that the torques know better than the forces do, and a density.
    let loose = Liquid::Mass { mass_kg: mass, error_kg: 0.2 };
    for (liquid, freedom) in [(exact(mass), 4.0), (loose, 3.0), (Liquid::Density(1000.0), 4.0)] {
        let fit = fit(&bottle, liquid, None);
        let sum: f64 =
            (0..SWEEPS).map(|_| fit.estimate(&noisy(&clean, &mut rng)).unwrap().sigma_nm.powi(2)).sum();
        let ratio = sum / SWEEPS as f64 / (SIGMA_NM * SIGMA_NM);
        println!("variance over the true one: {ratio:.3}");
        // Three standard errors of a mean of chi-square over its degrees of freedom: 0.11 to 0.12.
        assert!((ratio - 1.0).abs() < 3.0 * (2.0 / freedom / SWEEPS as f64).sqrt(), "{liquid:?}: {ratio}");
    }
}

/// The tilt that is chosen narrows the volume more than the others do, as measured by fits with one more pose.
#[test]
fn the_next_tilt_is_the_one_that_narrows_most() {
    let bottle = bottle();
    let (share, mass) = (0.35, 350e-6 * 1000.0);
    let liquid = Liquid::Mass { mass_kg: mass, error_kg: 0.01 };
    let fit = fit(&bottle, liquid, Some(SIGMA_NM));
    // Two poses that leave two volumes open, and three that leave one.
    for (sofar, separate) in [(vec![0.2, 0.4], true), (vec![0.2, 0.4, 1.3], false)] {
        let poses = sweep(&sofar, mass, share);
        let estimate = fit.estimate(&poses).unwrap();
        let several = matches!(estimate.verdict, Verdict::Undetermined { cause: Cause::SeveralVolumes, .. });
        assert_eq!(several, separate, "{estimate:?}");
        let next = fit.next_tilt(&poses, &estimate, 36).unwrap();
        let width = |tilt: f64| {
            let mut poses = poses.clone();
            poses.extend(sweep(&[tilt], mass, share));
            let [low, high] = fit.estimate(&poses).unwrap().interval_m3;
            high - low
        };
        let chosen = width(next.tilt_rad);
        let widths: Vec<f64> = (0..=36).map(|k| width(PI * f64::from(k) / 36.0)).collect();
        let least = widths.iter().copied().fold(f64::INFINITY, f64::min);
        println!(
            "tilt {:.3}: {chosen:.3e}, least {least:.3e}, upright {:.3e}, expected {:.3e}",
            next.tilt_rad, widths[0], next.expected_error_m3
        );
        // Information is averaged over the interval, the widths are at one volume: it need not be the very best.
        assert!(chosen < 1.2 * least, "{chosen} for {least}");
        assert!(chosen < 0.5 * widths[0], "{chosen} is no better than upright");
        // Two 1.96 standard errors, to first order.
        assert!((chosen / (3.92 * next.expected_error_m3) - 1.0).abs() < 0.4);
    }
    // Where two volumes explain the poses, one more at the tilt that is chosen decides between them.
    let by_density = VolumeFit { liquid: Liquid::Density(1000.0), ..fit };
    let truth = 0.9 * CAVITY.capacity();
    let poses = sweep(&[0.2, 0.3], 1000.0 * truth, 0.9);
    let estimate = by_density.estimate(&poses).unwrap();
    let next = by_density.next_tilt(&poses, &estimate, 36).unwrap();
    let poses = sweep(&[0.2, 0.3, next.tilt_rad], 1000.0 * truth, 0.9);
    assert_eq!(by_density.estimate(&poses).unwrap().verdict, Verdict::Determined);
    let nothing = VolumeFit { liquid: exact(0.0), ..fit };
    let estimate = nothing.estimate(&sweep(&[0.2, 0.4], 0.0, 0.0)).unwrap();
    assert!(matches!(nothing.next_tilt(&poses, &estimate, 36), Err(VolumeError::NothingToLearn { .. })));
}

/// A prism of 256 sides is the cylinder to 1e-4: its volume comes out alike.
#[cfg(feature = "mesh")]
#[test]
fn a_mesh_gives_the_volume_too() {
    use liquid_haptics::container::mesh::{MeshContainer, PlannedMesh};
    use nalgebra::Point3;

    const SIDES: u32 = 256;
    let mut vertices = vec![Point3::new(0.0, 0.0, 0.001), Point3::new(0.0, 0.0, 0.159)];
    for k in 0..SIDES {
        let (sin, cos) = (2.0 * PI * f64::from(k) / f64::from(SIDES)).sin_cos();
        vertices.extend([0.001, 0.159].map(|z| Point3::new(0.039 * cos, 0.039 * sin, z)));
    }
    let at = |k: u32, top: u32| 2 + 2 * (k % SIDES) + top;
    let triangles = (0..SIDES).flat_map(|k| {
        let (a, b, c, d) = (at(k, 0), at(k + 1, 0), at(k + 1, 1), at(k, 1));
        [[0, b, a], [1, d, c], [a, b, c], [a, c, d]]
    });
    let mesh = PlannedMesh::new(MeshContainer::new(vertices, triangles.collect()).unwrap());
    let truth = 0.4 * CAVITY.capacity();
    let poses = sweep(&tilts(), 1000.0 * truth, 0.4);
    let fit = VolumeFit { container: &mesh, ..fit(&bottle(), exact(1000.0 * truth), Some(SIGMA_NM)) };
    let estimate = fit.estimate(&poses).unwrap();
    assert_eq!(estimate.verdict, Verdict::Determined);
    approx::assert_relative_eq!(estimate.volume_m3, truth, max_relative = 2e-3);
}

#[test]
fn what_cannot_be_is_refused() {
    let bottle = bottle();
    let poses = sweep(&tilts(), 0.4, 0.5);
    let name = |fit: VolumeFit<'_>| match fit.estimate(&poses) {
        Err(VolumeError::Range { name, .. }) => name,
        other => panic!("{other:?}"),
    };
    assert_eq!(name(fit(&bottle, Liquid::Density(-1.0), None)), "density_kg_m3");
    assert_eq!(name(fit(&bottle, exact(f64::NAN), None)), "mass_kg");
    assert_eq!(name(fit(&bottle, Liquid::Mass { mass_kg: 0.1, error_kg: -1.0 }, None)), "error_kg");
    assert_eq!(name(fit(&bottle, exact(0.4), Some(0.0))), "sigma_nm");
    let both = Liquid::MassAndDensity { mass_kg: 0.4, error_kg: 0.0, density_kg_m3: 1000.0 };
    assert_eq!(name(fit(&bottle, both, None)), "error_kg");
    let good = fit(&bottle, exact(0.4), None);
    assert_eq!(name(VolumeFit { widest_share: 0.0, ..good }), "widest_share");
    assert!(matches!(good.estimate(&[]), Err(VolumeError::TooFew { got: 0, .. })));
    assert!(matches!(good.estimate(&poses[..2]), Err(VolumeError::TooFew { got: 2, least: 3, .. })));
    let mut broken = poses.clone();
    broken[4].wrench.tau_z_nm = f64::NAN;
    assert!(matches!(good.estimate(&broken), Err(VolumeError::Pose { index: 4, .. })));
    assert!(matches!(
        good.next_tilt(&poses, &good.estimate(&poses).unwrap(), 0),
        Err(VolumeError::TooFew { what: "steps", .. })
    ));
}

/// Prints how long an estimate of 19 poses takes.
#[test]
#[ignore = "by hand: a time depends on the machine"]
fn how_long_it_takes() {
    let bottle = bottle();
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let poses = noisy(&sweep(&tilts(), 0.4, 0.5), &mut rng);
    let prior = Liquid::Mass { mass_kg: 0.4, error_kg: 5e-4 };
    for (name, liquid, sigma) in [
        ("exact mass, known noise", exact(0.4), Some(SIGMA_NM)),
        ("mass with error, unknown noise", prior, None),
        ("density, unknown noise", Liquid::Density(1060.0), None),
    ] {
        let fit = fit(&bottle, liquid, sigma);
        let mut times: Vec<f64> = (0..200)
            .map(|_| {
                let start = std::time::Instant::now();
                std::hint::black_box(fit.estimate(std::hint::black_box(&poses)).unwrap());
                start.elapsed().as_secs_f64()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!("{name}: middle {:.3} ms, slowest {:.3} ms", 1e3 * times[100], 1e3 * times[199]);
    }
}
