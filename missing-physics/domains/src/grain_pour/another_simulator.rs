//! How far pours of another simulator lie from the emulator, in what pours of one simulator differ by.
//!
//! `benches/peers/pours.py make FOLDER --kinds null --seed 21` (and 22, ...), then
//! `POURS=FOLDER cargo test --release -p missing-physics-domains another_simulator -- --ignored --nocapture`.

use std::path::{Path, PathBuf};

use granular_infer::camera::Camera;
use granular_infer::campaign::{Conditions, Grains, Ranges, Rig};
use granular_infer::dem::Pour;
use granular_infer::seeing::HeightMap;
use granular_infer::statistics::{COUNT, STATISTICS, Symmetry, statistics};
use missing_physics::observer::Silent;
use rayon::prelude::*;

use super::campaign::{BUNDLED_RIG, Campaign};
use super::law::statistics_of;
use super::model::PourModel;
use super::read::{Picture, Read, read};
use crate::recording::{Header, Source};

/// A recording's statistics less the emulator's, in sigmas, picture by picture: at the truth, and at the likeliest baseline.
struct Distance {
    heights_m: Vec<f64>,
    at_truth: Vec<[f64; COUNT]>,
    at_best: Vec<[f64; COUNT]>,
}

/// Mean over pictures of a statistic.
fn mean(all: &[[f64; COUNT]], k: usize) -> f64 {
    all.iter().map(|l| l[k]).sum::<f64>() / all.len() as f64
}

/// Mean over all pairs of different pictures of a recording of the product of their distances.
fn common(all: &[[f64; COUNT]], k: usize) -> f64 {
    let n = all.len() as f64;
    let own = all.iter().map(|l| l[k] * l[k]).sum::<f64>();
    ((n * mean(all, k)).powi(2) - own) / (n * (n - 1.0))
}

/// What the key says was poured; the azimuth of a tilt is that of the heap's centroid.
fn truth(key: &serde_json::Value, campaign: &Campaign, aside: [f64; 2]) -> Option<(Conditions, f64)> {
    let truth = |name: &str| key["truth"][name].as_f64();
    let mut c = Conditions {
        sliding_friction: truth("friction")?,
        rolling_friction: truth("rolling")?,
        restitution: truth("restitution")?,
        // LIGGGHTS's epsd2 has no dashpot.
        rolling_damping: 0.0,
        height_m: 0.0,
        ..campaign.ranges.baseline()
    };
    let mut blur = 0.0;
    for mechanism in key["mechanisms"].as_array()? {
        let value = mechanism["parameters"].as_object()?.values().next()?.as_f64()?;
        match mechanism["id"].as_str()? {
            "cohesion" => c.work_of_adhesion_j_m2 = value,
            "ground-friction" => c.ground_ratio = value / c.sliding_friction,
            "size-spread" => c.size_variation = value,
            "air-drag" => c.drag_per_m = value,
            "non-spherical-grains" => c.aspect_ratio = value,
            "funnel-offset" => c.height_m = value,
            "depth-blur" => blur = value * value,
            "tilted-ground" => c.tilt_rad = aside.map(|a| value * a / aside[0].hypot(aside[1])),
            _ => {}
        }
    }
    Some((c, blur))
}

fn distance(folder: &Path) -> Result<Distance, Box<dyn std::error::Error>> {
    let key: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(folder.join("key.json"))?)?;
    let read = read(&Header::read(&Source::folder(folder))?)?;
    let heights: Vec<f64> = read.pictures.iter().map(|p| p.height_m).collect();
    let campaign = Campaign::of(&read.rig, read.heights_m(), &Silent)?;
    let model = PourModel::new(&campaign, &read, &Silent)?;
    let aside = aside(&read);
    let (conditions, blur_px2) = truth(&key, &campaign, aside).ok_or("a key without a truth")?;
    let at_truth = distances(&model, &read, &conditions, blur_px2);
    let best = Conditions { height_m: 0.0, ..model.nearest_baseline(&read, &campaign) };
    let at_best = distances(&model, &read, &best, 0.0);
    println!("{} truth {conditions:?}\n   best {best:?}", folder.display());
    Ok(Distance { heights_m: heights, at_truth, at_best })
}

/// Each picture's statistics less their mean, in sigmas from pour to pour, what turns with the scene along and across the tilt; the
/// height of the conditions is added to the pictures'.
fn distances(model: &PourModel, read: &Read, conditions: &Conditions, blur_px2: f64) -> Vec<[f64; COUNT]> {
    let left = |picture: &Picture| {
        let height_m = picture.height_m / model.scale.length + conditions.height_m;
        let at = Conditions { height_m, ..*conditions };
        let (mean, sigma) = (model.law.emulator.mean(&at, blur_px2), model.law.emulator.sigma(&at, blur_px2));
        let seen = statistics_of(picture, read);
        let left: [f64; COUNT] = std::array::from_fn(|k| (seen[k] - mean[k]) / sigma[k]);
        // Along and across the tilt.
        let azimuth = conditions.tilt_rad[1].atan2(conditions.tilt_rad[0]);
        std::array::from_fn(|k| match STATISTICS[k].1 {
            Symmetry::Scalar => left[k],
            Symmetry::Vector => azimuth.cos() * left[k] + azimuth.sin() * left[k + 1],
            Symmetry::Tensor => (2.0 * azimuth).cos() * left[k] + (2.0 * azimuth).sin() * left[k + 1],
            Symmetry::Second if STATISTICS[k - 1].1 == Symmetry::Vector => {
                azimuth.cos() * left[k] - azimuth.sin() * left[k - 1]
            }
            Symmetry::Second => (2.0 * azimuth).cos() * left[k] - (2.0 * azimuth).sin() * left[k - 1],
        })
    };
    read.pictures.iter().map(left).collect()
}

/// Where the pictures' centroids lie.
fn aside(read: &Read) -> [f64; 2] {
    let at = |name| STATISTICS.iter().position(|s| s.0 == name).unwrap_or(0);
    let mean = |k: usize| read.pictures.iter().map(|p| statistics_of(p, read)[k]).sum::<f64>();
    [mean(at("centroid_x")), mean(at("centroid_y"))]
}

#[test]
#[ignore = "by hand: needs recordings of another simulator"]
#[allow(clippy::print_stdout, clippy::unwrap_used, reason = "a table for a person")]
fn another_simulator() {
    let folder =
        PathBuf::from(std::env::var_os("POURS").expect("POURS=FOLDER of recordings with nothing hidden"));
    let mut worlds: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    worlds.sort();
    let found: Vec<Distance> = worlds.iter().map(|w| distance(w).unwrap()).collect();
    assert!(!found.is_empty());
    println!(
        "mean squares over {} recordings, in those from pour to pour: of a picture, common to two pictures of a recording, and of two",
        found.len()
    );
    println!(
        "whose heights differ by a factor below and above {APART}; common at the likeliest baseline; each recording's mean at truth"
    );
    println!(
        "{:24} {:>7} {:>7} {:>7} {:>7} {:>7}",
        "statistic", "picture", "common", "near", "apart", "at best"
    );
    for (k, (name, _)) in STATISTICS.iter().enumerate() {
        let over = |of: &dyn Fn(&Distance) -> f64| found.iter().map(of).sum::<f64>() / found.len() as f64;
        let own =
            |d: &Distance| d.at_truth.iter().map(|l| l[k] * l[k]).sum::<f64>() / d.at_truth.len() as f64;
        let pairs = |apart: bool| {
            let (mut sum, mut n) = (0.0, 0.0);
            for d in &found {
                for i in 0..d.heights_m.len() {
                    for j in 0..i {
                        if ((d.heights_m[i] / d.heights_m[j]).ln().abs() > APART.ln()) == apart {
                            sum += d.at_truth[i][k] * d.at_truth[j][k];
                            n += 1.0;
                        }
                    }
                }
            }
            sum / n
        };
        let each: Vec<String> = found.iter().map(|d| format!("{:5.1}", mean(&d.at_truth, k))).collect();
        println!(
            "{name:24} {:7.2} {:7.2} {:7.2} {:7.2} {:7.2}   {}",
            over(&own),
            over(&|d| common(&d.at_truth, k)),
            pairs(false),
            pairs(true),
            over(&|d| common(&d.at_best, k)),
            each.join(" ")
        );
    }
}

/// Heights that differ by more than this factor are far apart.
const APART: f64 = 1.8;
/// Scenes tried, pours of each.
const SCENES: u64 = 10;
const POURS: u64 = 12;

/// What is done to a scene.
type Change = fn(&mut Pour);

/// What a recording does not say of a pour: how the grains lay in the funnel, how they stop rolling.
fn unsaid() -> [(&'static str, Change); 2] {
    fn settled(scene: &mut Pour) {
        scene.closed_s = 0.4;
    }
    fn springy(scene: &mut Pour) {
        scene.grains.rolling_damping = 0.0;
        scene.ground.rolling_damping = 0.0;
    }
    [("the funnel opens when the grains have settled", settled), ("rolling without a dashpot", springy)]
}

/// Statistics of pours of a scene, as a camera without flaws sees them.
fn pictures(rig: &Rig, scene: &Pour) -> Vec<[f64; COUNT]> {
    let camera = Camera {
        focal_px: [250.0; 2],
        centre_px: [119.5; 2],
        height_m: 0.37,
        depth_unit_m: 1e-4,
        size_px: [240, 240],
    };
    let one = |seed: u64| {
        let grains = Grains::lying(scene.run(seed).ok()?, scene);
        let volume_m3 = rig.count as f64 * rig.grain_volume_m3();
        let map = HeightMap::from_depths(&camera, &camera.render(&grains), volume_m3).ok()?;
        Some(statistics(&map, rig.count, rig.diameter_m))
    };
    (0..POURS).into_par_iter().filter_map(one).collect()
}

/// By how much statistics move with what a recording does not say, in sigmas from pour to pour: mean over scenes of spheres with no
/// effect on, and their standard deviation from scene to scene.
#[test]
#[ignore = "by hand: pours 360 heaps and prints"]
#[allow(clippy::print_stdout, reason = "a table for a person")]
fn what_a_recording_does_not_say() {
    let rig = BUNDLED_RIG;
    let ranges = Ranges { rolling_friction: [0.07, 0.25], sliding_friction: [0.3, 0.8], ..Ranges::default() };
    let baseline = ranges.baseline();
    let mut moved = unsaid().map(|_| Vec::new());
    for scene in 0..SCENES {
        let drawn = ranges.draw(7, scene);
        let conditions = Conditions {
            sliding_friction: drawn.sliding_friction,
            rolling_friction: drawn.rolling_friction,
            restitution: drawn.restitution,
            height_m: drawn.height_m,
            ..baseline
        };
        let baseline = pictures(&rig, &rig.scene(&conditions));
        let sigma = |k: usize| {
            let square = baseline.iter().map(|s| (s[k] - mean(&baseline, k)).powi(2)).sum::<f64>();
            (square / (baseline.len() - 1) as f64).sqrt().max(1e-9)
        };
        for (moved, (_, change)) in moved.iter_mut().zip(unsaid()) {
            let mut scene = rig.scene(&conditions);
            change(&mut scene);
            let other = pictures(&rig, &scene);
            moved.push(std::array::from_fn::<f64, COUNT, _>(|k| {
                (mean(&other, k) - mean(&baseline, k)) / sigma(k)
            }));
        }
    }
    for ((name, _), moved) in unsaid().iter().zip(&moved) {
        println!("{name}");
        for (k, (statistic, _)) in STATISTICS.iter().enumerate() {
            let n = moved.len() as f64;
            let mean = moved.iter().map(|m| m[k]).sum::<f64>() / n;
            let spread = (moved.iter().map(|m| (m[k] - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
            println!("  {statistic:24} {mean:6.2} {spread:6.2}");
        }
    }
}
