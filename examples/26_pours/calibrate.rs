use examples::grains::{begin, height_map, look, panel, pour};
use granular_infer::dem::Clump;
use granular_infer::fake::{FakeRig, Kind};
use granular_infer::scene::{COUSCOUS, Grain};
use granular_infer::seeing::HeightMap;
use granular_infer::summary::COUNT;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::{Bench, HEIGHT_M, Outcome, spread};

/// Other heights of the outlet, m (figure 3.5).
const OTHERS_M: [f64; 5] = [0.02, 0.04, 0.06, 0.08, 0.10];
/// White in a picture of heights, m.
const WHITE_M: f64 = 0.025;
/// Part of the picture that is drawn: 20 cm.
const SHOWN: f64 = 0.4;

/// What a rig poured, as its camera saw it.
struct Poured {
    map: HeightMap,
    statistics: [f64; COUNT],
}

/// Pours a rig's grains once from a height and looks at them.
fn on_rig(bench: &Bench, kind: &Kind, height_m: f64, seed: u64) -> Outcome<Poured> {
    let mut rig = FakeRig::new(bench.scene, kind.clone(), bench.view, seed);
    pour(&mut rig, [0.0, 0.0, height_m])?;
    let map = look(&mut rig)?;
    let statistics = bench.view.statistics(&map, &[], bench.scene.rig.diameter_m)?;
    Ok(Poured { map, statistics })
}

/// Section 3.6: grains of other shapes on a rig, inferred from ten pours, the mean of the five best poured again and from other heights.
pub(crate) fn print(bench: &Bench) -> Outcome<()> {
    let (pours, best) = (bench.either(2, 10), bench.either(1, 5));
    let width_m = bench.scene.rig.diameter_m;
    let barley = Grain { sliding_friction: 0.3807, rolling_friction: 0.05, restitution: 0.4792 };
    let kind = |grain: Grain, shape: Clump| Kind {
        grain,
        shape: Some(shape),
        size_variation: 0.0,
        work_of_adhesion_j_m2: 0.0,
    };
    let kinds = [
        ("couscous, cylinders", kind(COUSCOUS, Clump::cylinder(width_m, width_m)?), "2.2263 +- 0.1377"),
        ("barley, rods", kind(barley, Clump::rod(1.1 * width_m, 1.8)?), "2.0311 +- 0.3807"),
    ];
    let mut svg = begin(OTHERS_M.len() + 1, 2 * kinds.len());
    for (row, (name, kind, published)) in kinds.iter().enumerate() {
        let real = (0..pours as u64)
            .into_par_iter()
            .map(|seed| on_rig(bench, kind, HEIGHT_M, 40 + seed))
            .collect::<Outcome<Vec<Poured>>>()?;
        let mut tried = Vec::new();
        for (seed, poured) in (0_u64..).zip(&real) {
            let grain = bench.posterior.infer(&poured.statistics)?.estimate()?;
            let again = bench.pour(&grain, None, HEIGHT_M, 50_000 + seed).ok_or("it leaves the picture")?;
            tried.push((bench.posterior.distance(&poured.statistics, &again), grain, poured));
        }
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        tried.truncate(best);
        let mean = |of: fn(&Grain) -> f64| tried.iter().map(|t| of(&t.1)).sum::<f64>() / best as f64;
        let grain = Grain {
            sliding_friction: mean(|g| g.sliding_friction),
            rolling_friction: mean(|g| g.rolling_friction.ln()).exp(),
            restitution: mean(|g| g.restitution),
        };
        println!(
            "\n{name}, mu_s {:.2}, mu_r {:.3}, e {:.2} on the rig; as spheres, the best {best} of {pours} pours: {:.2}, {:.3}, {:.2}",
            kind.grain.sliding_friction,
            kind.grain.rolling_friction,
            kind.grain.restitution,
            grain.sliding_friction,
            grain.rolling_friction,
            grain.restitution
        );
        let again = |of_rig: &Poured, seed: u64| -> Outcome<f64> {
            let poured = bench.pour(&grain, None, HEIGHT_M, seed).ok_or("it leaves the picture")?;
            Ok(bench.posterior.distance(&of_rig.statistics, &poured))
        };
        let from_there =
            (60_000_u64..).zip(&tried).map(|(seed, t)| again(t.2, seed)).collect::<Outcome<Vec<f64>>>()?;
        println!("  L2 of the statistics from 12 cm: {}   [Matl 2021]: {published}", spread(&from_there));
        // What chance alone leaves between two pours of the rig.
        let twins: Vec<f64> =
            real.windows(2).map(|w| bench.posterior.distance(&w[0].statistics, &w[1].statistics)).collect();
        println!("  of the rig's own pours, one to the next: {}", spread(&twins));
        print!("  from other heights:");
        let heights = if bench.small { &OTHERS_M[2..3] } else { &OTHERS_M[..] };
        for (column, &height_m) in heights.iter().chain([&HEIGHT_M]).enumerate() {
            let of_rig = on_rig(bench, kind, height_m, 70 + column as u64)?;
            let seed = 70_000 + column as u64;
            let foretold = bench.scene.grains(&grain, height_m, seed)?;
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let (map, _) = bench.view.look(&foretold, &bench.scene.rig, &mut rng)?;
            let seen = bench.view.statistics(&map, &[], width_m)?;
            print!(" {:.0} cm {:.2}", 100.0 * height_m, bench.posterior.distance(&of_rig.statistics, &seen));
            panel(&mut svg, column, 2 * row, &format!("{name}, from {:.0} cm", 100.0 * height_m))?;
            height_map(&mut svg, &of_rig.map, WHITE_M, SHOWN)?;
            panel(&mut svg, column, 2 * row + 1, "foretold, as spheres")?;
            height_map(&mut svg, &map, WHITE_M, SHOWN)?;
        }
        println!();
    }
    svg.push_str("</svg>\n");
    let path = std::env::temp_dir().join("pours.svg");
    std::fs::write(&path, svg)?;
    println!("\nheaps of the rig and those foretold: {}", path.display());
    Ok(())
}
