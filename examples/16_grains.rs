//! Chapter 3 on a simulated rig: what grains are from one depth picture, the height for a wanted ring, what a bowl will spill.
//!
//! `cargo run --release -p examples --example 16_grains` (`--small`: fewer heaps, no pattern); draws `grains.svg` into the temporary
//! folder
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use std::error::Error;

use examples::grains::{begin, heap, height_map, look, panel, pour, rings, scatter};
use granular_infer::campaign::{Grains, Rig};
use granular_infer::fake::{FakeRig, Kind};
use granular_infer::posterior::{GrainPosterior, Inferred};
use granular_infer::scene::{COUSCOUS, Grain, Scene, prior};
use granular_infer::summary::NAMES;
use granular_infer::tasks::{Bowl, Ring, RingHeights, spilled};
use granular_infer::view::View;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use statrs::statistics::Statistics as _;

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let (posterior, heights) = (GrainPosterior::shipped()?, RingHeights::shipped()?);
    let mut svg = begin(3, 2);
    let hidden = Grain { sliding_friction: 0.45, rolling_friction: 0.12, restitution: 0.35 };
    let inferred = one_picture(&posterior, hidden, &mut svg)?;
    unseen(&posterior)?;
    pattern(&heights, &mut svg)?;
    bowl(hidden, &inferred)?;
    svg.push_str("</svg>\n");
    let path = std::env::temp_dir().join("grains.svg");
    std::fs::write(&path, svg)?;
    println!("\nheaps, heights, posterior, rings: {}", path.display());
    Ok(())
}

fn dice(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// One pour, one picture, one posterior; then the same again with what was inferred.
fn one_picture(
    posterior: &GrainPosterior,
    hidden: Grain,
    svg: &mut String,
) -> Result<Inferred, Box<dyn Error + Send + Sync>> {
    let (scene, view) = (Scene::default(), View::default());
    let kind = Kind { grain: hidden, shape: None, size_variation: 0.0, work_of_adhesion_j_m2: 0.0 };
    let mut rig = FakeRig::new(scene, kind, view, 11);
    pour(&mut rig, [0.0, 0.0, 0.12])?;
    let map = look(&mut rig)?;
    let statistics = view.statistics(&map, &[], scene.rig.diameter_m)?;
    let inferred = posterior.infer(&statistics)?;
    let estimate = inferred.estimate()?;
    let again = scene.grains(&estimate, 0.12, 5)?;
    let second = view.features(&again, &scene.rig, &mut dice(5))?;
    println!("The 16 statistics of a picture, and of a pour with what was inferred from it:");
    for ((name, a), b) in NAMES.iter().zip(&statistics).zip(&second) {
        println!("  {name:12} {a:>9.4} {b:>9.4}");
    }
    println!("L2 in the training's spreads: {:.2}", posterior.distance(&statistics, &second));
    println!("as unlike the training as {:.0} % of it", 100.0 * inferred.resemblance.p_value);
    for (j, (name, truth)) in ["mu_s", "mu_r", "e"].iter().zip(hidden.theta()).enumerate() {
        let spans: Vec<String> = inferred
            .posterior
            .intervals(j, 0.9, &mut dice(1))?
            .iter()
            .map(|[a, b]| format!("{a:.3} to {b:.3}"))
            .collect();
        println!("  {name:5} {:.3}, 90 %: {}; hidden {truth:.3}", estimate.theta()[j], spans.join(", "));
    }
    let draws = inferred.posterior.sample(1500, &mut dice(2))?;
    let bounds = prior()?.bounds();
    let pairs = |a: usize, b: usize| -> Vec<[f64; 2]> {
        let u = |t: &[f64], k: usize| if k == 1 { t[k].ln() } else { t[k] };
        draws.rows().map(|t| [u(t, a), u(t, b)]).collect()
    };
    let truth = [hidden.sliding_friction, hidden.rolling_friction.ln(), hidden.restitution];
    panel(svg, 0, 0, "poured: mu_s 0.45, mu_r 0.12, e 0.35")?;
    heap(svg, &rig.truth(), 0.09)?;
    panel(svg, 1, 0, "heights that the depth camera sees")?;
    height_map(svg, &map, 0.02, 1.0)?;
    panel(svg, 2, 0, "poured with what was inferred")?;
    heap(svg, &again, 0.09)?;
    panel(svg, 0, 1, "posterior, truth in red")?;
    scatter(svg, &pairs(0, 2), [truth[0], truth[2]], [bounds[0], bounds[2]], ["mu_s", "e"])?;
    panel(svg, 1, 1, "posterior, truth in red")?;
    scatter(svg, &pairs(0, 1), [truth[0], truth[1]], [bounds[0], bounds[1]], ["mu_s", "ln mu_r"])?;
    Ok(inferred)
}

/// Section 3.6: errors over heaps of unseen grains, and the statistics of heaps poured again.
fn unseen(posterior: &GrainPosterior) -> Result<(), Box<dyn Error + Send + Sync>> {
    let heaps: u64 = if examples::small() { 3 } else { 50 };
    let (scene, view, prior) = (Scene::default(), View::default(), prior()?);
    let one = |i: u64| -> Option<[f64; 4]> {
        let truth = Grain::from_theta(&prior.sample(&mut dice(9000 + i)))?;
        let seen = |grain: &Grain, seed: u64| {
            let grains = scene.grains(grain, 0.12, seed).ok()?;
            view.features(&grains, &scene.rig, &mut dice(seed)).ok()
        };
        let first = seen(&truth, 100 + i)?;
        let estimate = posterior.infer(&first).ok()?.estimate().ok()?;
        Some([
            estimate.sliding_friction - truth.sliding_friction,
            (estimate.rolling_friction / truth.rolling_friction).ln(),
            estimate.restitution - truth.restitution,
            posterior.distance(&first, &seen(&estimate, 500 + i)?),
        ])
    };
    let errors: Vec<[f64; 4]> = (0..heaps).into_par_iter().filter_map(one).collect();
    println!(
        "\nErrors over {} unseen heaps (section 3.6): mean, its 95 % interval, spread; here and in [Matl 2021]",
        errors.len()
    );
    let published = [(0.0380, 0.0646), (-1.1695, 0.7032), (-0.0008, 0.0148), (1.582, 0.336)];
    for (k, (name, (m, s))) in ["mu_s", "ln mu_r", "e", "L2 of statistics"].iter().zip(published).enumerate()
    {
        let of = || errors.iter().map(|e| e[k]);
        // 95 % intervals of a mean are what [Matl 2021] prints behind +-.
        let (mean, sd, to_mean) = (of().mean(), of().std_dev(), 1.96 / (errors.len() as f64).sqrt());
        let theirs = s * 50_f64.sqrt() / 1.96;
        println!("  {name:18} {mean:+8.4} +- {:.4}, {sd:.3}   {m:+8.4} +- {s:.4}, {theirs:.3}", sd * to_mean);
    }
    Ok(())
}

/// Three rings at three places, each asked for by its two radii; the fake pours, the camera compares.
fn pattern(heights: &RingHeights, svg: &mut String) -> Result<(), Box<dyn Error + Send + Sync>> {
    let (scene, view) = (Scene::default(), View::default());
    // The wanted radii are those that couscous made once, from heights that the planner does not know.
    let makes = [0.025, 0.06, 0.11];
    let count = if examples::small() { 1 } else { makes.len() };
    let kind = Kind { grain: COUSCOUS, shape: None, size_variation: 0.0, work_of_adhesion_j_m2: 0.0 };
    let mut rig = FakeRig::new(scene, kind.clone(), view, 21);
    let mut all = Grains::default();
    let mut drawn = Vec::new();
    println!(
        "\nRings (5th and 50th percentile of the distance, mm)   wanted          height          poured"
    );
    for (k, height) in makes.iter().enumerate().take(count) {
        let example = scene.grains(&COUSCOUS, *height, 300 + k as u64)?;
        let points = view.points(&example, &scene.rig, &mut dice(k as u64))?;
        let wanted = Ring::of(&points, [0.0; 2], f64::INFINITY).ok_or("no grains are seen")?;
        let (planned, sd) = heights.height_m(wanted)?;
        // Each on cloth of its own, under the camera; the picture shows them side by side.
        let place = [0.11 * (k as f64 - 1.0), 0.07 * (k % 2) as f64 - 0.035];
        if k > 0 {
            rig = FakeRig::new(scene, kind.clone(), view, 21 + k as u64);
        }
        pour(&mut rig, [0.0, 0.0, planned])?;
        let map = look(&mut rig)?;
        let points = view.chosen(&map, &[], scene.rig.diameter_m)?;
        let got = Ring::of(&points, [0.0; 2], f64::INFINITY).ok_or("no grains are seen")?;
        println!(
            "  from {:.1} cm                                        {:5.1} {:5.1}   {:5.1} +- {:.1} cm   {:5.1} {:5.1}",
            100.0 * height,
            1e3 * wanted.inner_m,
            1e3 * wanted.outer_m,
            100.0 * planned,
            100.0 * sd,
            1e3 * got.inner_m,
            1e3 * got.outer_m
        );
        let truth = rig.truth();
        let near = truth.positions_m.iter().zip(&truth.radii_m).filter(|(p, _)| p[0].hypot(p[1]) < 0.055);
        for (p, r) in near {
            all.positions_m.push([p[0] + place[0], p[1] + place[1], p[2]]);
            all.radii_m.push(*r);
        }
        drawn.push((place, wanted, got));
    }
    panel(svg, 2, 1, "rings wanted (green) and poured (red)")?;
    rings(svg, &all, &drawn, 0.18)?;
    Ok(())
}

/// Spilled grains, foretold from the posterior and poured with the hidden grain.
fn bowl(hidden: Grain, inferred: &Inferred) -> Result<(), Box<dyn Error + Send + Sync>> {
    let (count, pours) = if examples::small() { (40, 2) } else { (250, 8) };
    let scene = Scene { rig: Rig { count, ..Scene::default().rig }, ..Scene::default() };
    let bowl = Bowl::round(0.03, 0.05, 0.025)?;
    let draws = inferred.posterior.sample(pours, &mut dice(3))?;
    println!(
        "\nGrains of {count} that a bowl of 10 cm spills       foretold (of {pours} draws)   hidden grain"
    );
    for height in [0.06, 0.14, 0.25] {
        let of = |grain: Option<Grain>, seed: u64| spilled(&scene, &bowl, &grain?, height, seed).ok();
        let foretold: Vec<usize> = (0..pours)
            .into_par_iter()
            .filter_map(|i| of(Grain::from_theta(draws.row(i)), 40 + i as u64))
            .collect();
        let real = of(Some(hidden), 90).ok_or("the pour failed")?;
        let mean = foretold.iter().sum::<usize>() as f64 / foretold.len() as f64;
        let (low, high) = (foretold.iter().min().unwrap_or(&0), foretold.iter().max().unwrap_or(&0));
        println!(
            "  from {:4.0} cm                                  {mean:6.1} ({low} to {high})          {real}",
            100.0 * height
        );
    }
    Ok(())
}
