//! Learns the posterior of [Matl 2021], chapter 3, from a campaign, measures it on pours it has not seen, and writes what the crate ships.
//!
//! ```text
//! for k in $(seq 0 39); do cargo run --release -p granular-infer --example pours -- grains 2000 $k 40 g$k.txt; done
//! cargo run --release -p granular-infer --example pours -- heights 800 0 1 h.txt
//! cargo run --release -p granular-infer --example study -- granular-infer pours.npz g*.txt h.txt
//! ```
//! Every tenth pour is held out; `posterior.json.gz` and `heights.json.gz` are written into the folder. `pours.npz` has `theta` (`mu_s, mu_r, e`), `statistics` and `centres_m` for Python.
#![allow(clippy::print_stdout, reason = "prints what it measures")]

use std::error::Error;
use std::path::Path;

use bayes_sim::calibration::{expected_coverage, sbc_ranks};
use bayes_sim::campaign::Results;
use bayes_sim::points::Points;
use bayes_sim::posterior::ConditionalDensity;
use bayes_sim::prior::Prior;
use bayes_sim::simulations::Simulations;
use granular_infer::camera::Flaws;
use granular_infer::columns::{Table, npz};
use granular_infer::posterior::{GrainPosterior, settings};
use granular_infer::scene::{Grain, Scene};
use granular_infer::summary::COUNT;
use granular_infer::tasks::{Heights, Ring, RingHeights, heights};
use granular_infer::view::{View, seen};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use statrs::statistics::Statistics as _;

const HEIGHT_M: f64 = 0.12;
/// One pour in so many is held out.
const HELD_OUT: usize = 10;
/// Heaps that [Matl 2021] measures on.
const HEAPS: usize = 50;
/// The posterior is measured on so many unseen pours or more.
const LEAST: usize = 50;
/// Unseen heaps that are poured again with what was inferred.
const AGAIN: usize = 50;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [out, columns, files @ ..] = arguments.as_slice() else {
        return Err("expected FOLDER OUT.npz FILE...".into());
    };
    let out = Path::new(out);
    let shards = files.iter().map(|f| Results::read(Path::new(f))).collect::<Result<Vec<_>, _>>()?;
    let (pours, of_heights): (Vec<_>, Vec<_>) = shards.into_iter().partition(|s| s.campaign.prior.dim() == 3);
    let (scene, view) = (Scene::default(), View::default());
    if !of_heights.is_empty() {
        learn_heights(&Results::merge(of_heights)?, &scene, &view, out)?;
    }
    if pours.is_empty() {
        return Ok(());
    }
    let results = Results::merge(pours)?;
    let (mut training, mut unseen) = (results.clone(), results.clone());
    training.records.retain(|i, _| i % HELD_OUT != 0);
    unseen.records.retain(|i, _| i % HELD_OUT == 0);
    let all = seen(&results, &scene, &view, 1)?;
    std::fs::write(columns, python(&all.simulations, &results)?)?;
    println!(
        "{} of {} pours, {} failed, {} left the picture",
        results.records.len(),
        results.campaign.count,
        results.failures().count(),
        all.left_out.len()
    );
    for (index, error) in all.left_out.iter().take(3) {
        println!("  pour {index}: {error}");
    }

    let simulations = seen(&training, &scene, &view, 1)?.simulations;
    let prior = &results.campaign.prior;
    let posterior = GrainPosterior::train(prior, &simulations, &settings(), 1)?;
    if unseen.records.len() < LEAST {
        println!("fewer than {LEAST} unseen pours: nothing is measured");
        return ship(&posterior, out);
    }
    let tests = seen(&unseen, &scene, &view, 1)?.simulations;
    calibration(&posterior, &tests)?;
    ship(&posterior, out)?;
    println!(
        "\nwhat is inferred less the truth: mean, spread and the mean's 95 % interval, over {} unseen pours",
        tests.len()
    );
    // What [Matl 2021] prints behind +- are intervals of a mean, as its chapter 2 says of its own.
    let printed = [(0.0380, 0.0646), (-1.1695, 0.7032), (-0.0008, 0.0148)];
    row("[Matl 2021]", &printed.map(|(mean, interval)| (mean, interval / of_mean(1.0, HEAPS))), HEAPS);
    row("here", &errors(&posterior, &tests)?, tests.len());
    row("of the prior", &of_prior(&posterior, &tests), tests.len());
    again(&posterior, &scene, &view, &tests)?;

    fewer(prior, &simulations, &tests)?;
    flawed(&posterior, [&training, &unseen], &scene, &view)
}

/// Errors of posteriors that were learned from fewer simulations.
fn fewer(prior: &Prior, simulations: &Simulations, tests: &Simulations) -> Result<(), Box<dyn Error>> {
    println!("\nsimulations");
    for share in [8, 2] {
        let rows: Vec<usize> = (0..simulations.len() / share).collect();
        let few = Simulations::new(simulations.theta().select(&rows), simulations.x().select(&rows))?;
        let less = GrainPosterior::train(prior, &few, &settings(), 1)?;
        row(&format!("{}", few.len()), &errors(&less, tests)?, tests.len());
    }
    Ok(())
}

/// What noise and blur of the unseen pictures do, grains chosen by height and by colour.
fn flawed(
    posterior: &GrainPosterior,
    [training, unseen]: [&Results; 2],
    scene: &Scene,
    view: &View,
) -> Result<(), Box<dyn Error>> {
    for by_colour in [false, true] {
        println!(
            "\nnoise and blur of the unseen pictures alone, grains chosen by {}",
            if by_colour { "colour" } else { "height" }
        );
        let base = View { by_colour, ..*view };
        let density = if by_colour {
            GrainPosterior::train(
                &training.campaign.prior,
                &seen(training, scene, &base, 1)?.simulations,
                &settings(),
                1,
            )?
        } else {
            posterior.clone()
        };
        for noise_m in [0.0, 2e-3, 4e-3] {
            let flaws = Flaws { noise_m, ..base.flaws };
            sensitivity(
                &format!("noise {} mm", 1e3 * noise_m),
                &density,
                unseen,
                scene,
                &View { flaws, ..base },
            )?;
        }
        for blur_px in [1.0, 2.0, 4.0] {
            let flaws = Flaws { blur_px, ..base.flaws };
            sensitivity(&format!("blur {blur_px} px"), &density, unseen, scene, &View { flaws, ..base })?;
        }
    }
    Ok(())
}

/// Writes the posterior.
fn ship(posterior: &GrainPosterior, out: &Path) -> Result<(), Box<dyn Error>> {
    let bytes = posterior.to_bytes()?;
    std::fs::write(out.join("posterior.json.gz"), &bytes)?;
    println!("trained on {} pictures, {} kB", posterior.simulations(), bytes.len() / 1000);
    Ok(())
}

/// Heights for rings: every fifth pour is held out.
fn learn_heights(results: &Results, scene: &Scene, view: &View, out: &Path) -> Result<(), Box<dyn Error>> {
    let all = heights(results, scene, view, 1)?;
    let part = |held_out: bool| -> Result<Heights, bayes_sim::error::Error> {
        let rows: Vec<usize> = (0..all.radii.len()).filter(|i| i.is_multiple_of(5) == held_out).collect();
        let of = |s: &Simulations| Simulations::new(s.theta().select(&rows), s.x().select(&rows));
        Ok(Heights { radii: of(&all.radii)?, pictures: of(&all.pictures)? })
    };
    let tests = part(true)?;
    let learned = RingHeights::train(&results.campaign.prior, &part(false)?, 1)?;
    std::fs::write(out.join("heights.json.gz"), learned.to_bytes()?)?;
    let print = |name: &str, found: Vec<(f64, f64)>| {
        let errors = || found.iter().zip(tests.radii.theta().rows()).map(|(f, t)| f.0 - t[0]);
        let within = errors().zip(&found).filter(|(e, f)| e.abs() < 1.96 * f.1).count();
        let (mean, sd) = mean_sd(errors().map(|e| 100.0 * e));
        println!(
            "height by {name}: error {mean:+.4} +- {sd:.4} cm (the mean +- {:.4}) over {} unseen pours ([Matl 2021]: 0.0530 +- 0.2221), {within} of them within 1.96 sigma",
            of_mean(sd, found.len()),
            found.len()
        );
    };
    let ring = |x: &[f64]| Ring { inner_m: x[0], outer_m: x[1] };
    print(
        "a ring's radii",
        tests.radii.x().rows().map(|x| learned.height_m(ring(x))).collect::<Result<_, _>>()?,
    );
    let by_picture = |i| learned.poured_from_m(&statistics(&tests.pictures, i));
    print("16 statistics", (0..tests.pictures.len()).map(by_picture).collect::<Result<_, _>>()?);
    Ok(())
}

fn python(all: &Simulations, results: &Results) -> Result<Vec<u8>, Box<dyn Error>> {
    let table = |name, points: &Points| Table { name, width: points.dim(), values: points.values().to_vec() };
    let centres: Vec<f64> =
        results.records.values().filter_map(|r| r.outcome.as_ref().ok()).flatten().copied().collect();
    Ok(npz(&[
        table("theta", all.theta()),
        table("statistics", all.x()),
        Table { name: "centres_m", width: results.campaign.x_dim, values: centres },
    ])?)
}

/// Mean and spread of each coordinate's error.
fn errors(posterior: &GrainPosterior, tests: &Simulations) -> Result<Vec<(f64, f64)>, Box<dyn Error>> {
    let one = |i: usize| -> Result<[f64; 3], bayes_sim::error::Error> {
        let inferred = posterior.infer(&statistics(tests, i))?.estimate()?;
        let truth = tests.theta().row(i);
        Ok([
            inferred.sliding_friction - truth[0],
            (inferred.rolling_friction / truth[1]).ln(),
            inferred.restitution - truth[2],
        ])
    };
    let all = (0..tests.len()).into_par_iter().map(one).collect::<Result<Vec<_>, _>>()?;
    Ok((0..3).map(|j| mean_sd(all.iter().map(|e| e[j]))).collect())
}

/// What an estimate at the prior's middle would have.
fn of_prior(posterior: &GrainPosterior, tests: &Simulations) -> Vec<(f64, f64)> {
    let prior = posterior.prior();
    (0..3)
        .map(|j| {
            let [low, high] = prior.bounds()[j];
            mean_sd(tests.theta().rows().map(|t| 0.5 * (low + high) - prior.coordinates(t)[j]))
        })
        .collect()
}

fn mean_sd(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    (values.clone().mean(), values.std_dev())
}

/// Half of the 95 % interval of the mean of `count` values of a spread.
fn of_mean(sd: f64, count: usize) -> f64 {
    1.96 * sd / (count as f64).sqrt()
}

fn row(name: &str, errors: &[(f64, f64)], count: usize) {
    let text: Vec<String> = ["mu_s", "ln mu_r", "e"]
        .iter()
        .zip(errors)
        .map(|(name, (mean, sd))| {
            format!("{name} {mean:+.4} +- {sd:.4} (the mean +- {:.4})", of_mean(*sd, count))
        })
        .collect();
    println!("{name:14} {}", text.join("   "));
}

fn statistics(tests: &Simulations, i: usize) -> [f64; COUNT] {
    let x = tests.x().row(i);
    std::array::from_fn(|j| x[j])
}

fn calibration(posterior: &GrainPosterior, tests: &Simulations) -> Result<(), Box<dyn Error>> {
    let coverage = expected_coverage(posterior, tests, 500, 3)?;
    let ranks = sbc_ranks(posterior, tests, 500, 3)?;
    let p: Vec<String> = ranks.p_values().iter().map(|p| format!("{p:.2}")).collect();
    println!(
        "coverage at 50 %: {:.2}, at 90 %: {:.2}, mean of coverage less level {:+.3}; p of flat ranks {}",
        coverage.at(0.5),
        coverage.at(0.9),
        coverage.mean_error(),
        p.join(", ")
    );
    Ok(())
}

/// Pours again with what was inferred and compares the statistics; and with the truth, which chance alone parts.
fn again(
    posterior: &GrainPosterior,
    scene: &Scene,
    view: &View,
    tests: &Simulations,
) -> Result<(), Box<dyn Error>> {
    let distance = |i: usize, grain: &Grain| -> Option<f64> {
        let grains = scene.grains(grain, HEIGHT_M, 77_000 + i as u64).ok()?;
        let x = view.features(&grains, &scene.rig, &mut ChaCha8Rng::seed_from_u64(i as u64)).ok()?;
        Some(posterior.distance(&x, &statistics(tests, i)))
    };
    let both: Vec<Option<(f64, f64)>> = (0..AGAIN.min(tests.len()))
        .into_par_iter()
        .map(|i| {
            let inferred = posterior.infer(&statistics(tests, i)).ok()?.estimate().ok()?;
            Some((distance(i, &inferred)?, distance(i, &Grain::from_theta(tests.theta().row(i))?)?))
        })
        .collect();
    let found: Vec<(f64, f64)> = both.into_iter().flatten().collect();
    let (inferred, truth) = (mean_sd(found.iter().map(|d| d.0)), mean_sd(found.iter().map(|d| d.1)));
    println!(
        "L2 of statistics over {} heaps: {:.3} +- {:.3} (the mean +- {:.3}) poured again as inferred ([Matl 2021]: 1.582 +- {:.3}, the mean +- 0.336), {:.3} +- {:.3} with the truth and another seed",
        found.len(),
        inferred.0,
        inferred.1,
        of_mean(inferred.1, found.len()),
        0.336 / of_mean(1.0, HEAPS),
        truth.0,
        truth.1
    );
    Ok(())
}

fn sensitivity(
    name: &str,
    posterior: &GrainPosterior,
    unseen: &Results,
    scene: &Scene,
    view: &View,
) -> Result<(), Box<dyn Error>> {
    match seen(unseen, scene, view, 1) {
        Ok(seen) => {
            let mean = expected_coverage(posterior, &seen.simulations, 200, 3)?.mean_error();
            row(name, &errors(posterior, &seen.simulations)?, seen.simulations.len());
            println!("{:14} {} pictures, coverage less level {mean:+.3}", "", seen.simulations.len());
        }
        Err(error) => println!("{name:14} {error}"),
    }
    Ok(())
}
