//! What a product of posteriors says of grains that are poured several times from 12 cm: from the first picture, from two, and so on.
//!
//! Each posterior is the shipped one's, learned from single pictures: what it does not know of grains is the same in every picture of them, and a
//! product takes it for chance. Intervals get too narrow, which is why the crate has no such function; it has posteriors of series of three heights,
//! which are measured on the same grains, on the velvet that the first of them knows and on other cloths.
//!
//! ```text
//! cargo run --release -p granular-infer --example several -- 100 8     grains, pours of each
//! ```
#![allow(clippy::print_stdout, reason = "prints what it measures")]

use std::error::Error;

use bayes_sim::points::Points;
use bayes_sim::prior::Prior;
use granular_infer::posterior::GrainPosterior;
use granular_infer::scene::{CLOTHS, Grain, SERIES_M, Scene, prior};
use granular_infer::summary::COUNT;
use granular_infer::view::View;
use rand::{RngExt as _, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::Distribution as _;
use rand_distr::weighted::WeightedIndex;
use rayon::prelude::*;
use statrs::statistics::Statistics as _;

const HEIGHT_M: f64 = 0.12;
/// Draws from which intervals are read.
const DRAWS: usize = 2000;

/// Errors that cross threads.
type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

fn main() -> Outcome<()> {
    let arguments: Vec<usize> = std::env::args().skip(1).map(|a| a.parse()).collect::<Result<_, _>>()?;
    let [grains, pours] = arguments[..] else { return Err("expected GRAINS POURS".into()) };
    let (posterior, prior) = (GrainPosterior::shipped()?, prior()?);
    let mut rng = ChaCha8Rng::seed_from_u64(2026);
    let drawn: Vec<(Vec<f64>, u64)> = (0..grains).map(|_| (prior.sample(&mut rng), rng.random())).collect();
    let whole = poured(&drawn, &vec![HEIGHT_M; pours], None);
    println!("{} grains, {} of which left the picture once", grains, grains - whole.len());
    let counts = std::iter::successors(Some(1), |n| Some(2 * n)).take_while(|n| *n <= pours);
    for count in counts {
        let draws = |pictures: &[[f64; COUNT]]| product(&posterior, &pictures[..count]);
        println!("{count} pictures: {}", measured(&prior, &whole, draws)?);
    }
    let (velvet, cloths) = (GrainPosterior::shipped_series()?, GrainPosterior::shipped_cloths()?);
    for (on, of) in [("velvet", None), ("a cloth of its own each", Some(CLOTHS))] {
        let whole = poured(&drawn, &SERIES_M, of);
        println!("once from each of {SERIES_M:?} m on {on}; {} left the picture", grains - whole.len());
        for (learned, posterior) in [("velvet", &velvet), ("any cloth", &cloths)] {
            let draws = |pictures: &[[f64; COUNT]]| {
                Ok(posterior.infer_series(pictures)?.posterior.sample(DRAWS, &mut dice())?)
            };
            println!("  learned on {learned:9}: {}", measured(&prior, &whole, draws)?);
        }
    }
    Ok(())
}

/// Parameters of grains, and the statistics of each of their pours.
type Poured = (Vec<f64>, Vec<[f64; COUNT]>);

/// The grains all of whose pours stay in the picture, each on a cloth of its own where there is a range of their rolling friction.
fn poured(drawn: &[(Vec<f64>, u64)], heights_m: &[f64], cloths: Option<[f64; 2]>) -> Vec<Poured> {
    let of = |(theta, seed): &(Vec<f64>, u64)| {
        let part = || ChaCha8Rng::seed_from_u64(!seed).random();
        let scene = cloths.map_or(Scene::default(), |range| Scene::default().on_cloth(range, part()));
        let pictures = pictures(&scene, theta, heights_m, *seed);
        (pictures.len() == heights_m.len()).then(|| (theta.clone(), pictures))
    };
    drawn.par_iter().filter_map(of).collect()
}

/// Mean and spread of the errors over all grains, and how many 95 % intervals hold.
fn measured(
    prior: &Prior,
    poured: &[Poured],
    draws: impl Fn(&[[f64; COUNT]]) -> Outcome<Points> + Sync,
) -> Outcome<String> {
    let all: Vec<[(f64, bool); 3]> = poured
        .par_iter()
        .map(|(theta, pictures)| Ok(errors(prior, &draws(pictures)?, theta)))
        .collect::<Outcome<_>>()?;
    let n = all.len() as f64;
    let of = |j: usize, name: &str| {
        let errors = || all.iter().map(|e| e[j].0);
        let (mean, spread) = (errors().mean(), errors().std_dev());
        let within = all.iter().filter(|e| e[j].1).count();
        format!("{name} {mean:+.3} ± {spread:.3} (± {:.3}), {within} within", 1.96 * spread / n.sqrt())
    };
    Ok([of(0, "mu_s"), of(1, "ln mu_r"), of(2, "e")].join("   "))
}

/// Draws of the product of the posteriors of some pictures, the prior counted once: those of each picture, weighted and drawn again.
fn product(posterior: &GrainPosterior, pictures: &[[f64; COUNT]]) -> Outcome<Points> {
    let each = pictures.iter().map(|p| posterior.infer(p)).collect::<Result<Vec<_>, _>>()?;
    let mut pool = Points::new(3);
    for inferred in &each {
        for row in inferred.posterior.sample(DRAWS / each.len(), &mut dice())?.rows() {
            pool.push(row)?;
        }
    }
    let ln: Vec<Vec<f64>> = each.iter().map(|i| i.posterior.ln_densities(&pool)).collect::<Result<_, _>>()?;
    let prior = each[0].posterior.prior();
    let ln_weight = |(k, theta): (usize, &[f64])| -> Outcome<f64> {
        let of_each = || ln.iter().map(|l| l[k]);
        let largest = of_each().fold(f64::NEG_INFINITY, f64::max);
        let drawn_from = largest + of_each().map(|l| (l - largest).exp()).sum::<f64>().ln();
        Ok(of_each().sum::<f64>() - (each.len() as f64 - 1.0) * prior.ln_density(theta)? - drawn_from)
    };
    let ln_weights: Vec<f64> = pool.rows().enumerate().map(ln_weight).collect::<Outcome<_>>()?;
    let largest = ln_weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let choice = WeightedIndex::new(ln_weights.iter().map(|l| (l - largest).exp()))?;
    let mut rng = dice();
    Ok(pool.select(&(0..DRAWS).map(|_| choice.sample(&mut rng)).collect::<Vec<_>>()))
}

fn dice() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(7)
}

/// The statistics of the pours of one kind of grains that stay in the picture.
fn pictures(scene: &Scene, theta: &[f64], heights_m: &[f64], seed: u64) -> Vec<[f64; COUNT]> {
    let view = View::default();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let of_pour = |height_m: &f64| {
        let heap = scene.grains(&Grain::from_theta(theta)?, *height_m, rng.random()).ok()?;
        view.features(&heap, &scene.rig, &mut rng).ok()
    };
    heights_m.iter().filter_map(of_pour).collect()
}

/// Errors of `mu_s`, `ln mu_r` and e, and whether their 95 % intervals hold the truth.
fn errors(prior: &Prior, draws: &Points, theta: &[f64]) -> [(f64, bool); 3] {
    let truth = prior.coordinates(theta);
    std::array::from_fn(|j| {
        let mut column: Vec<f64> = draws.rows().map(|row| prior.coordinates(row)[j]).collect();
        column.sort_by(f64::total_cmp);
        let n = column.len();
        let [low, high] = [column[n / 40], column[n - 1 - n / 40]];
        (column.iter().mean() - truth[j], (low..=high).contains(&truth[j]))
    })
}
