//! Masses recovered from forces.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use crate::common::poses::{GRASP, SIGMA_N, noisy, sweep, tilts};
use liquid_haptics::volume::{ForceGain, MassFit, SettledPose, VolumeError, fit_mass};
use liquid_haptics::wrench::Grasp;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Mass alone, with the gain from empty poses, and with offsets that turn with the tilt: within what the standard error says.
#[test]
fn masses_are_within_their_errors() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (gain, mass) = (0.03, 0.4);
    let clean = sweep(&tilts(), mass, 0.5);
    let nothing = sweep(&tilts(), 0.0, 0.0);
    let offset = [0.5, -0.3];
    let change = |poses: &[SettledPose], gain: f64, offset: [f64; 2]| -> Vec<SettledPose> {
        let mut out = poses.to_vec();
        for SettledPose { tilt_rad, wrench } in &mut out {
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
