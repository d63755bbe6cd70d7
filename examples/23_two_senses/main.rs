//! One bottle, two senses: what settled poses and a swing to upright say of volume, density and viscosity, each alone and both as one posterior.
//!
//! `cargo run --release -p examples --example 23_two_senses` (150 bottles of five liquids at five fills, and 18 that are wider than stated; `--small`: 6) writes `two_senses.svg` in the
//! temporary folder. Each is weighed as by a sensor of six axes, by
//! the same at small tilts alone, and by one that has the joint's torque alone.
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

mod picture;
mod rig;
mod table;

use std::error::Error;
use std::time::Instant;

use liquid_haptics::fusion::{FusionFit, Marginal, Posterior};
use rayon::prelude::*;

use rig::{Axes, Case, FILLS, LIQUIDS, Readings, SENSORS, plan};

pub(crate) type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// Who says it.
pub(crate) const SENSES: [&str; 3] = ["poses", "swing", "both"];

/// What the senses say of one bottle.
pub(crate) struct Said {
    pub(crate) three: [Posterior; 3],
    /// Volume, density and viscosity of each.
    pub(crate) marginals: [[Marginal; 3]; 3],
    pub(crate) frequency_p: Option<f64>,
    pub(crate) swings: bool,
    /// How long the posterior by both took, the swing's motion included, s.
    pub(crate) took_s: f64,
}

/// A bottle, with what each sensor says.
pub(crate) struct Tried {
    pub(crate) case: Case,
    /// One for each of [`SENSORS`].
    pub(crate) said: [Said; 3],
}

/// By poses, by the swing, and by both.
pub(crate) fn posteriors(axes: Axes, fit: &FusionFit, readings: &Readings) -> Outcome<Said> {
    let poses = readings.poses(axes);
    let by_poses = fit.posterior(Some(poses), None)?;
    let begin = Instant::now();
    let motion = fit.motion(&readings.swing())?;
    let both = fit.posterior(Some(poses), Some(&motion))?;
    let took_s = begin.elapsed().as_secs_f64();
    let by_swing = fit.posterior(None, Some(&motion))?;
    let frequency_p = fit.frequency_p(&by_poses, &motion);
    let three = [by_poses, by_swing, both];
    let marginals = three.each_ref().map(|p| [p.volume_m3(), p.density_kg_m3(), p.viscosity_m2_s()]);
    Ok(Said { three, marginals, frequency_p, swings: motion.swings(), took_s })
}

fn feel(cases: Vec<Case>) -> Outcome<Vec<Tried>> {
    let plans = [plan(Axes::Six)?, plan(Axes::Open)?, plan(Axes::Torque)?];
    let one = |case: Case| {
        let readings = case.feel()?;
        let said = |k: usize| {
            posteriors(SENSORS[k].1, &plans[k], &readings)
                .map_err(|e| format!("{} at {}, seed {}: {e}", case.kind().name, case.fill, case.seed))
        };
        Ok(Tried { said: [said(0)?, said(1)?, said(2)?], case })
    };
    cases.into_par_iter().map(one).collect()
}

fn main() -> Outcome<()> {
    let small = examples::small();
    let repeats = if small { 1 } else { 6 };
    let mut cases = Vec::new();
    for liquid in 0..LIQUIDS.len() {
        for fill in FILLS {
            for _ in 0..repeats {
                let seed = 1000 + 10 * cases.len() as u64;
                if !small || (liquid % 2 == 0 && (fill == 0.25 || fill == 0.5)) {
                    cases.push(Case { liquid, fill, seed, wider: 1.0 });
                }
            }
        }
    }
    let tried = feel(cases)?;
    table::print(&tried);
    let each = if small { 1 } else { 6 };
    let others = (0..each).flat_map(|k| {
        let case = |wider: f64| Case { liquid: 0, fill: 0.4, seed: 50_000 + 10 * k, wider };
        [case(1.0), case(1.1), case(1.25)]
    });
    table::contradictions(&feel(others.collect())?);
    let seed = 77;
    let path = picture::draw(&[
        Case { liquid: 0, fill: 0.25, seed, wider: 1.0 },
        Case { liquid: 4, fill: 0.25, seed, wider: 1.0 },
    ])?;
    println!("picture: {}", path.display());
    Ok(())
}
