//! Learns a posterior from series of pours, the same grains from three heights each, and measures what each height and all of them say of
//! pours that it has not seen.
//!
//! ```text
//! cargo run --release -p granular-infer --example pours -- series 1684 0 1 s.txt
//! cargo run --release -p granular-infer --example series -- granular-infer/series.json.gz s.txt
//! cargo run --release -p granular-infer --example pours -- cloths 1684 0 1 c.txt
//! cargo run --release -p granular-infer --example series -- granular-infer/cloths.json.gz c.txt
//! ```
//! `--grains 2000` in front: of pours of so many grains each, and not of 600.
//!
//! Every tenth series is held out; the posterior that is shipped for velvet is measured on those too. A campaign of single pours (`grains`) is taken for series of one.
//! From fewer than 500 series nothing is held out: a trial of the command.
#![allow(clippy::print_stdout, reason = "prints what it measures")]

use std::error::Error;
use std::path::Path;

use bayes_sim::calibration::{expected_coverage, sbc_ranks};
use bayes_sim::campaign::Results;
use bayes_sim::points::Points;
use bayes_sim::simulations::Simulations;
use granular_infer::posterior::{GrainPosterior, settings};
use granular_infer::scene::{SERIES_M, Scene};
use granular_infer::summary::COUNT;
use granular_infer::view::{View, seen};
use rayon::prelude::*;
use statrs::statistics::Statistics as _;

/// One series in so many is held out.
const HELD_OUT: usize = 10;
/// Series from which some are held out.
const LEAST: usize = 500;
/// Draws behind a posterior's coverage.
const DRAWS: usize = 500;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut scene = Scene::default();
    if let [option, grains, ..] = &arguments[..]
        && option == "--grains"
    {
        scene.rig.count = grains.parse()?;
        arguments.drain(..2);
    }
    let [out, files @ ..] = arguments.as_slice() else {
        return Err("expected [--grains GRAINS] OUT.json.gz FILE...".into());
    };
    let shards = files.iter().map(|f| Results::read(Path::new(f))).collect::<Result<Vec<_>, _>>()?;
    let results = Results::merge(shards)?;
    let (coordinates, of_pour) = (results.campaign.x_dim, 3 * scene.rig.count);
    if ![of_pour, SERIES_M.len() * of_pour].contains(&coordinates) {
        let of = format!("one pour or {} of {} grains", SERIES_M.len(), scene.rig.count);
        return Err(format!("{coordinates} coordinates in a draw, expected those of {of} (--grains)").into());
    }
    let all = seen(&results, &scene, &View::default(), 1)?;
    let (simulations, prior) = (&all.simulations, &results.campaign.prior);
    let pours = simulations.x().dim() / COUNT;
    println!(
        "{} series of {pours} pours, {} failed, {} left the picture",
        results.records.len(),
        results.failures().count(),
        all.left_out.len()
    );
    let enough = simulations.len() >= LEAST;
    let part = |held_out: bool| -> Result<Simulations, bayes_sim::error::Error> {
        let mine = |i: &usize| !enough || i.is_multiple_of(HELD_OUT) == held_out;
        let rows: Vec<usize> = (0..simulations.len()).filter(mine).collect();
        Simulations::new(simulations.theta().select(&rows), simulations.x().select(&rows))
    };
    let (training, tests) = (part(false)?, part(true)?);
    if !enough {
        println!("too few to hold any out");
    }
    println!("learned from {}, measured on {}", training.len(), tests.len());

    let sets = [vec![0], vec![1], vec![2], vec![0, 2], vec![0, 1, 2]];
    for heights in sets.iter().filter(|set| set.iter().all(|height| *height < pours)) {
        let learned = GrainPosterior::train(prior, &pictures(&training, heights)?, &settings(), 1)?;
        let of =
            |h: &usize| if pours == 1 { "one".into() } else { format!("{:.0} cm", 100.0 * SERIES_M[*h]) };
        let name = heights.iter().map(of).collect::<Vec<_>>().join(", ");
        measure(&name, &learned, &pictures(&tests, heights)?)?;
        if heights.len() == pours {
            let bytes = learned.to_bytes()?;
            std::fs::write(out, &bytes)?;
            println!("{:24} {} kB", "", bytes.len() / 1000);
        }
    }
    if pours == SERIES_M.len() {
        measure("as shipped for velvet", &GrainPosterior::shipped_series()?, &tests)?;
    }
    Ok(())
}

/// The same pours with the pictures from some of the heights alone.
fn pictures(all: &Simulations, heights: &[usize]) -> Result<Simulations, bayes_sim::error::Error> {
    let mut x = Points::new(COUNT * heights.len());
    for row in all.x().rows() {
        let of_row: Vec<f64> =
            heights.iter().flat_map(|h| &row[h * COUNT..(h + 1) * COUNT]).copied().collect();
        x.push(&of_row)?;
    }
    Simulations::new(all.theta().clone(), x)
}

fn statistics(tests: &Simulations, i: usize) -> Vec<[f64; COUNT]> {
    tests.x().row(i).chunks_exact(COUNT).map(|x| std::array::from_fn(|j| x[j])).collect()
}

/// Errors of `mu_s`, `ln mu_r` and e, mean and spread; how often regions hold the truth, and whether its ranks are flat.
fn measure(name: &str, posterior: &GrainPosterior, tests: &Simulations) -> Result<(), Box<dyn Error>> {
    let one = |i: usize| -> Result<[f64; 3], bayes_sim::error::Error> {
        let (inferred, truth) =
            (posterior.infer_series(&statistics(tests, i))?.estimate()?, tests.theta().row(i));
        Ok([
            inferred.sliding_friction - truth[0],
            (inferred.rolling_friction / truth[1]).ln(),
            inferred.restitution - truth[2],
        ])
    };
    let all = (0..tests.len()).into_par_iter().map(one).collect::<Result<Vec<_>, _>>()?;
    let of = |(j, name): (usize, &str)| {
        let errors = || all.iter().map(|e| e[j]);
        let (mean, sd) = (errors().mean(), errors().std_dev());
        format!("{name} {mean:+.3} ± {sd:.3} (± {:.3})", 1.96 * sd / (tests.len() as f64).sqrt())
    };
    let text: Vec<String> = ["mu_s", "ln mu_r", "e"].into_iter().enumerate().map(of).collect();
    println!("{name:24} {}", text.join("   "));
    let coverage = expected_coverage(posterior, tests, DRAWS, 3)?.mean_error();
    let flat: Vec<String> =
        sbc_ranks(posterior, tests, DRAWS, 3)?.p_values().iter().map(|p| format!("{p:.3}")).collect();
    println!("{:24} coverage less level {coverage:+.3}, p of flat ranks {}", "", flat.join(", "));
    Ok(())
}
