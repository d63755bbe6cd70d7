//! Pours from the small bottle, by a tilt that is worked out beforehand: it has a lip, water a bead, and neither is quite as stated.

use std::f64::consts::PI;

use liquid_haptics::fake::{Cavity, Round};
use liquid_haptics::pour::{Bead, Mouth, Pour};
use liquid_haptics::volume::{ErrorCorrelation, Liquid};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::vessel::SMALL;
use super::{Outcome, WATER, WATER_M2_S, line, mass, shown, sweep, volume};

/// Radius of the opening, and how high the bead of water stands above the lip.
const LIP_M: f64 = 0.027;
const BEAD_M: f64 = 0.0048;

/// How much more than wanted leaves the bottle, m3, where so much is inside and so much is thought to be.
fn poured(inside_m3: f64, thought_m3: f64, wanted_m3: f64, seed: u64) -> Outcome<f64> {
    let (inner, rim) = (SMALL.inner()?, SMALL.length_m - SMALL.wall_m);
    let pour = Pour::new(&inner, Mouth::new(LIP_M, rim)?, Bead::measured(BEAD_M, BEAD_M)?, PI)?;
    let tilt = pour.tilt_rad(thought_m3, wanted_m3)?;
    // The pour itself: the wrist's angle and the bead differ from what was stated, and columns say what stays.
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = |sigma: f64| sigma * Distribution::<f64>::sample(&StandardNormal, &mut rng);
    let (tilt, bead) = (tilt + draw(1e-3), BEAD_M + draw(3e-4));
    let level = rim * tilt.cos() - LIP_M * tilt.sin() + bead;
    let cavity =
        Round::new(SMALL.radius_m - SMALL.wall_m, SMALL.length_m - 2.0 * SMALL.wall_m, SMALL.wall_m, 20_000);
    Ok(inside_m3 - cavity.below(tilt, level)[0] - wanted_m3)
}

/// A quarter, half and three quarters of what is known to be inside.
pub(crate) fn of_known(each: u64) -> Outcome<()> {
    let parts = [200e-6, 400e-6, 500e-6].into_iter().flat_map(|v| [0.25, 0.5, 0.75].map(|part| (v, part)));
    let tries: Vec<(f64, f64, u64)> =
        parts.flat_map(|(v, part)| (0..each).map(move |i| (v, part, i))).collect();
    let errors: Outcome<Vec<f64>> = tries
        .into_par_iter()
        .map(|(inside, part, i)| {
            poured(inside, inside, part * inside, 8500 + i + (1e7 * inside) as u64 + (40.0 * part) as u64)
        })
        .collect();
    let errors = errors?;
    let sizes: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
    let what = format!("pours: {} of 1/4, 1/2, 3/4, size of the error", errors.len());
    line(&what, &shown(&sizes, 1e6, "mL"), "1.55 +- 1.60 mL");
    line("  the largest", &format!("{:.2} mL", 1e6 * sizes.iter().fold(0.0, |m: f64, e| m.max(*e))), "5 mL");
    Ok(())
}

/// 100 mL from what was felt to be inside.
pub(crate) fn of_felt(each: u64, correlation: ErrorCorrelation) -> Outcome<()> {
    let inner = SMALL.inner()?;
    let tries: Vec<(f64, u64)> =
        [200e-6, 300e-6, 400e-6, 500e-6].into_iter().flat_map(|v| (0..each).map(move |i| (v, i))).collect();
    let felt: Outcome<Vec<[f64; 2]>> = tries
        .into_par_iter()
        .map(|(truth, i)| {
            let seed = 8000 + i + (1e7 * truth) as u64;
            let poses = sweep(SMALL.load(truth, WATER, WATER_M2_S), seed)?;
            let liquid = Liquid::from(&mass(&poses, None)?);
            let [inside, ..] = volume(&inner, SMALL.grasp(), &poses, liquid, correlation)?;
            Ok([inside - truth, poured(truth, inside, 100e-6, seed)?])
        })
        .collect();
    let felt = felt?;
    let of = |k: usize| felt.iter().map(|f| f[k]).collect::<Vec<f64>>();
    line("pours: volume felt before", &shown(&of(0), 1e6, "mL"), "5.09 +- 2.59 mL");
    line(&format!("pours: {} of 100 mL", felt.len()), &shown(&of(1), 1e6, "mL"), "1.80 +- 2.04 mL");
    Ok(())
}
