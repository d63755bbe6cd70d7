//! Volumes recovered from poses that were simulated by quadrature.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

mod common;

use std::f64::consts::PI;

use common::Cavity;
use liquid_haptics::container::Cylinder;
use liquid_haptics::volume::{
    Cause, ForceGain, Liquid, MassFit, Pose, Verdict, VolumeError, VolumeEstimate, VolumeFit, fit_mass,
};
use liquid_haptics::wrench::{Departures, Grasp, PlanarWrench};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const CAVITY: Cavity = Cavity { radius: 0.039, length: 0.158, bottom: 0.001 };
const GRASP: Grasp = Grasp {
    container_mass_kg: 0.1,
    gripper_mass_kg: 0.9,
    grasp_height_m: 0.12,
    shell_center_m: 0.08,
    gravity_m_s2: 9.80665,
};
const SIGMA_NM: f64 = 5e-4;
const SIGMA_N: f64 = 0.02;
const NONE: Departures = Departures {
    force_gain: 0.0,
    torque_offset_nm: 0.0,
    angle_offset_rad: 0.0,
    grasp_offset_m: 0.0,
    shell_shift_m: 0.0,
    surface_lag_rad: 0.0,
};

fn bottle() -> Cylinder {
    Cylinder::new(0.040, 0.160, 0.001).unwrap()
}

/// Every ten degrees from upright to upside down.
fn tilts() -> Vec<f64> {
    (0..19).map(|k| f64::from(10 * k).to_radians()).collect()
}

/// Poses without noise: eq. 2.1 written out here, the liquid's centre of mass by quadrature (to some 1e-6 of the radius).
fn sweep(tilts: &[f64], mass: f64, share: f64) -> Vec<Pose> {
    let pose = |&tilt_rad: &f64| {
        let (sin, cos) = tilt_rad.sin_cos();
        let liquid = if mass > 0.0 {
            let [x, z] = CAVITY.center(tilt_rad, share * CAVITY.capacity(), 2000);
            mass * ((z - 0.12) * sin + x * cos)
        } else {
            0.0
        };
        let tau_z_nm = -9.80665 * (0.1 * (0.08 - 0.12) * sin + liquid);
        Pose { tilt_rad, wrench: PlanarWrench { fx_n: 0.0, fy_n: -9.80665 * (1.0 + mass), tau_z_nm } }
    };
    tilts.iter().map(pose).collect()
}

fn noisy(poses: &[Pose], rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let mut draw = |sigma: f64| sigma * Distribution::<f64>::sample(&StandardNormal, rng);
    let mut out = poses.to_vec();
    for Pose { wrench, .. } in &mut out {
        wrench.fx_n += draw(SIGMA_N);
        wrench.fy_n += draw(SIGMA_N);
        wrench.tau_z_nm += draw(SIGMA_NM);
    }
    out
}

fn fit<'a>(container: &'a Cylinder, liquid: Liquid, sigma_nm: Option<f64>) -> VolumeFit<'a> {
    VolumeFit { container, grasp: GRASP, departures: NONE, liquid, sigma_nm, widest_share: 0.5 }
}

fn exact(mass_kg: f64) -> Liquid {
    Liquid::Mass { mass_kg, error_kg: 0.0 }
}

fn holds(estimate: &VolumeEstimate, truth: f64) -> bool {
    let [low, high] = estimate.interval_m3;
    low <= truth && truth <= high
}

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
/// from the forces (its error counted).
#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    const SWEEPS: usize = 200;
    let bottle = bottle();
    let shares = [0.15, 0.3, 0.45, 0.6, 0.75, 0.88];
    let clean: Vec<Vec<Pose>> = shares.map(|s| sweep(&tilts(), 1000.0 * s * CAVITY.capacity(), s)).to_vec();
    let mut rng = ChaCha8Rng::seed_from_u64(19);
    let mut held = [0; 4];
    let mut errors = Vec::new();
    for _ in 0..SWEEPS {
        let k = rng.random_range(0..shares.len());
        let truth = shares[k] * CAVITY.capacity();
        let poses = noisy(&clean[k], &mut rng);
        let forces = MassFit { gain: ForceGain::Known(0.0), offsets: false, sigma_n: Some(SIGMA_N) };
        let mass = Liquid::from(&fit_mass(&GRASP, &poses, &forces).unwrap());
        let ways = [
            (mass, Some(SIGMA_NM)),
            (mass, None),
            (Liquid::Density(1000.0), Some(SIGMA_NM)),
            (Liquid::Density(1000.0), None),
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

/// The thesis's trap: no liquid weighs nothing wherever it lies, so that every volume explains the torque; it is empty.
#[test]
fn nothing_inside_is_empty() {
    let bottle = bottle();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let clean = sweep(&tilts(), 0.0, 0.0);
    let mut empty = 0;
    for _ in 0..40 {
        let poses = noisy(&clean, &mut rng);
        let forces = MassFit { gain: ForceGain::Known(0.0), offsets: false, sigma_n: None };
        let mass = fit_mass(&GRASP, &poses, &forces).unwrap();
        let Ok(estimate) = fit(&bottle, Liquid::from(&mass), Some(SIGMA_NM)).estimate(&poses) else {
            continue;
        };
        if estimate.verdict == Verdict::Empty {
            empty += 1;
            assert_eq!(estimate.volume_m3, 0.0);
        }
        let by_density = fit(&bottle, Liquid::Density(1000.0), Some(SIGMA_NM)).estimate(&poses).unwrap();
        assert!(by_density.interval_m3[1] < 5e-6, "{by_density:?}");
    }
    // A mass beyond 1.96 errors of zero on either side comes once in twenty.
    assert!(empty >= 33, "{empty} of 40");
    let exactly = fit(&bottle, exact(0.0), None).estimate(&clean).unwrap();
    assert_eq!((exactly.verdict, exactly.volume_m3), (Verdict::Empty, 0.0));
    let [low, high] = exactly.interval_m3;
    assert!(low == 0.0 && high > 0.999 * CAVITY.capacity(), "the torques leave all volumes open");
    let negative = Liquid::Mass { mass_kg: -0.01, error_kg: 0.001 };
    assert!(matches!(
        fit(&bottle, negative, None).estimate(&clean),
        Err(VolumeError::NegativeMass { mass_kg: -0.01, .. })
    ));
}

#[test]
fn a_full_bottle_is_full() {
    let bottle = bottle();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mass = 1000.0 * CAVITY.capacity();
    for liquid in [exact(mass), Liquid::Density(1000.0)] {
        // Within what the noise hides of the brim.
        let poses = noisy(&sweep(&tilts(), mass, 1.0), &mut rng);
        let estimate = fit(&bottle, liquid, Some(5e-3)).estimate(&poses).unwrap();
        assert_eq!(estimate.verdict, Verdict::Full, "{estimate:?}");
        assert!(estimate.volume_m3 > 0.95 * CAVITY.capacity());
    }
}

/// Poses of one tilt, and poses in which the liquid has no lever, leave the volume open.
#[test]
fn poses_that_say_nothing_are_undetermined() {
    let bottle = bottle();
    let truth = 0.9 * CAVITY.capacity();
    let cause = |tilts: &[f64], liquid| {
        let poses = sweep(tilts, 1000.0 * truth, 0.9);
        let estimate = fit(&bottle, liquid, Some(SIGMA_NM)).estimate(&poses).unwrap();
        assert!(holds(&estimate, truth));
        match estimate.verdict {
            Verdict::Undetermined { cause, candidates } => (cause, candidates),
            other => panic!("{other:?}"),
        }
    };
    let mass = exact(1000.0 * truth);
    assert_eq!(cause(&[0.0, 0.0, PI], mass).0, Cause::Flat);
    assert_eq!(cause(&[1.0, 1.001, 1.002], mass).0, Cause::AlikePoses);
    // A known density: as long as the lid stays dry and the bottom wet, the liquid's moment about the grasp is quadratic in the
    // volume whatever the tilt, its least where the depth is the grasp's height: two volumes have one torque.
    let (why, candidates) = cause(&[0.2, 0.25, 0.3], Liquid::Density(1000.0));
    assert_eq!(why, Cause::SeveralVolumes);
    assert_eq!(candidates.len(), 2);
    assert!(candidates[0].interval_m3[1] < candidates[1].interval_m3[0]);
    let near = |c: &liquid_haptics::volume::Candidate| (c.volume_m3 - truth).abs() < 1e-5;
    assert_eq!(candidates.iter().filter(|c| near(c)).count(), 1, "{candidates:?}");
    // The other one by hand: depths d and 2 (0.12 - 0.001) - d from the cavity's bottom.
    let other = (2.0 * 0.119 / CAVITY.length - 0.9) * CAVITY.capacity();
    approx::assert_relative_eq!(candidates[0].volume_m3, other, max_relative = 1e-3);
}

/// Another bottle than the one that was held: no volume explains the torques, and where the noise is not known it is larger.
#[test]
fn the_wrong_container_does_not_fit() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mass = 400e-6 * 1000.0;
    let poses = noisy(&sweep(&tilts(), mass, 400e-6 / CAVITY.capacity()), &mut rng);
    let right = fit(&bottle(), exact(mass), Some(SIGMA_NM)).estimate(&poses).unwrap();
    assert_eq!(right.verdict, Verdict::Determined);
    let wide = Cylinder::new(0.052, 0.160, 0.001).unwrap();
    let wrong = fit(&wide, exact(mass), Some(SIGMA_NM)).estimate(&poses).unwrap();
    assert_eq!(wrong.verdict, Verdict::Misfit, "{wrong:?}");
    assert!(wrong.misfit_p.unwrap() < 1e-6);
    let unknown = fit(&wide, exact(mass), None).estimate(&poses).unwrap();
    assert!(unknown.sigma_nm > 3.0 * SIGMA_NM && unknown.misfit_p.is_none(), "{unknown:?}");
}

/// A departure that is stated is taken into account; one that is not is a misfit.
#[test]
fn stated_departures_count() {
    let bottle = bottle();
    let truth = 0.5 * CAVITY.capacity();
    let mut poses = sweep(&tilts(), 1000.0 * truth, 0.5);
    for pose in &mut poses {
        pose.wrench.tau_z_nm += 0.02;
    }
    let without = fit(&bottle, exact(1000.0 * truth), Some(SIGMA_NM));
    let with = VolumeFit { departures: Departures { torque_offset_nm: 0.02, ..NONE }, ..without };
    assert_eq!(without.estimate(&poses).unwrap().verdict, Verdict::Misfit);
    let estimate = with.estimate(&poses).unwrap();
    approx::assert_relative_eq!(estimate.volume_m3, truth, max_relative = 1e-4);
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

/// Mass alone, with the gain from empty poses, and with offsets that turn with the tilt: within what the standard error says.
#[test]
fn masses_are_within_their_errors() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (gain, mass) = (0.03, 0.4);
    let clean = sweep(&tilts(), mass, 0.5);
    let nothing = sweep(&tilts(), 0.0, 0.0);
    let offset = [0.5, -0.3];
    let change = |poses: &[Pose], gain: f64, offset: [f64; 2]| -> Vec<Pose> {
        let mut out = poses.to_vec();
        for Pose { tilt_rad, wrench } in &mut out {
            let (sin, cos) = tilt_rad.sin_cos();
            wrench.fy_n = wrench.fy_n * (1.0 + gain) - sin * offset[0] + cos * offset[1];
            wrench.fx_n += cos * offset[0] + sin * offset[1];
        }
        out
    };
    let mut squares = [0.0; 4];
    for _ in 0..300 {
        for (k, (from_empty, offsets)) in
            [(false, false), (true, false), (false, true), (true, true)].into_iter().enumerate()
        {
            let offset = if offsets { offset } else { [0.0; 2] };
            let loaded = noisy(&change(&clean, gain, offset), &mut rng);
            let empty = noisy(&change(&nothing, gain, offset), &mut rng);
            let gain_from = if from_empty { ForceGain::FromEmpty(&empty) } else { ForceGain::Known(gain) };
            let fit = MassFit { gain: gain_from, offsets, sigma_n: None };
            let found = fit_mass(&GRASP, &loaded, &fit).unwrap();
            squares[k] += ((found.mass_kg - mass) / found.error_kg).powi(2) / 300.0;
            assert!((found.force_gain - gain).abs() <= 5.0 * found.force_gain_error + 1e-15);
            assert!((found.offset_n[0] - offset[0]).abs() < 0.05, "{found:?}");
        }
    }
    println!("mean squares of errors over standard errors: {squares:?}");
    // Chi-square of 300 over 300: 1 within 3 x 0.082, and a few parts in a hundred for a noise of some 18 degrees of freedom.
    assert!(squares.iter().all(|s| (0.75..1.4).contains(s)), "{squares:?}");
}

/// Offsets and the gain need poses that tell them from the mass.
#[test]
fn masses_that_no_pose_determines_are_refused() {
    let poses = sweep(&[0.7; 5], 0.4, 0.5);
    let fit = |gain, offsets, sigma_n| MassFit { gain, offsets, sigma_n };
    let known = ForceGain::Known(0.0);
    let refused = fit_mass(&GRASP, &poses, &fit(known, true, None));
    assert!(
        matches!(refused, Err(VolumeError::NotDetermined { what: "mass and offsets", fixed: 2, fitted: 3 })),
        "{refused:?}"
    );
    assert!(fit_mass(&GRASP, &poses, &fit(known, false, None)).is_ok());
    let one = &poses[..1];
    let refused = fit_mass(&GRASP, one, &fit(known, false, None));
    assert!(matches!(refused, Err(VolumeError::TooFew { got: 1, least: 2, .. })));
    let single = fit_mass(&GRASP, one, &fit(known, false, Some(SIGMA_N))).unwrap();
    approx::assert_relative_eq!(single.mass_kg, 0.4, max_relative = 1e-12);
    approx::assert_relative_eq!(single.error_kg, SIGMA_N / 9.80665, max_relative = 1e-12);
    let refused = fit_mass(&GRASP, &poses, &fit(ForceGain::FromEmpty(&[]), false, None));
    assert!(matches!(refused, Err(VolumeError::TooFew { what: "poses", got: 0, .. })));
    let weightless = Grasp { container_mass_kg: 0.0, gripper_mass_kg: 0.0, ..GRASP };
    let refused = fit_mass(&weightless, &poses, &fit(ForceGain::FromEmpty(&poses), false, None));
    assert!(matches!(
        refused,
        Err(VolumeError::NotDetermined { what: "mass and gain", fixed: 1, fitted: 2 })
    ));
    let refused = fit_mass(&GRASP, &poses, &fit(ForceGain::Known(-1.0), false, None));
    assert!(matches!(refused, Err(VolumeError::Range { name: "force_gain", got: -1.0, .. })));
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
#[ignore = "a timing to look at"]
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
