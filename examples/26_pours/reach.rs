use granular_infer::scene::{Grain, prior};
use rayon::prelude::*;
use statrs::statistics::Statistics as _;

use crate::{Bench, HEIGHT_M};

/// Values of each parameter on either side of the middle.
const STEPS: i32 = 6;
/// Places of the greatest height and of the mean radius among the statistics.
const SHOWS: [usize; 2] = [0, 4];
/// Smaller changes of either than a grain's width, or of the heap's width than this part of it, do not matter.
const PART: f64 = 0.05;

/// Height and mean radius (m) of heaps of equal grains, on average.
fn shown(bench: &Bench, grain: &Grain, pours: usize) -> Option<[f64; 2]> {
    let all: Vec<_> = (0..pours as u64)
        .into_par_iter()
        .filter_map(|seed| bench.pour(grain, None, HEIGHT_M, 20_000 + seed))
        .collect();
    (!all.is_empty()).then(|| SHOWS.map(|j| all.iter().map(|x| x[j]).mean()))
}

/// The smallest offset at which a growing excess is above zero, linear between the offsets that were tried.
fn crossing(tried: &[(f64, f64)]) -> Option<f64> {
    tried.windows(2).find(|pair| pair[1].1 > 0.0).map(|pair| {
        let [(a, low), (b, high)] = [pair[0], pair[1]];
        a + (b - a) * (-low / (high - low)).clamp(0.0, 1.0)
    })
}

/// Section 3.5: errors of a parameter, the others known, from which on a heap is another one.
pub(crate) fn print(bench: &Bench) {
    let pours = bench.either(2, 12);
    let Ok(prior) = prior() else { return };
    let middle: Vec<f64> = prior.bounds().iter().map(|[low, high]| 0.5 * (low + high)).collect();
    let grain = |u: &[f64]| Grain { sliding_friction: u[0], rolling_friction: u[1].exp(), restitution: u[2] };
    let width_m = bench.scene.rig.diameter_m;
    let Some(base) = shown(bench, &grain(&middle), pours) else { return };
    println!(
        "\nErrors that show, about mu_s {:.2}, mu_r {:.3}, e {:.2} (height {:.1} mm, mean radius {:.1} mm, of {pours} pours)",
        middle[0],
        middle[1].exp(),
        middle[2],
        1e3 * base[0],
        1e3 * base[1]
    );
    println!("                 height or mean radius by a grain   [Matl 2021]   width by 5 %    [Matl 2021]");
    let published = [("0.05", "0.1"), ("3", "4"), ("0.01", "0.05")];
    for (j, name) in ["mu_s", "ln mu_r", "e"].iter().enumerate() {
        let half = 0.5 * (prior.bounds()[j][1] - prior.bounds()[j][0]);
        let mut both: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
        for side in [-1.0, 1.0] {
            let mut tried = [vec![(0.0, -width_m)], vec![(0.0, -PART)]];
            for step in 1..=STEPS {
                let offset = half * f64::from(step) / f64::from(STEPS);
                let mut at = middle.clone();
                at[j] += side * offset;
                let Some(now) = shown(bench, &grain(&at), pours) else { continue };
                let off = [(now[0] - base[0]).abs(), (now[1] - base[1]).abs()];
                tried[0].push((offset, off[0].max(off[1]) - width_m));
                tried[1].push((offset, off[1] / base[1] - PART));
            }
            for (found, tried) in both.iter_mut().zip(&tried) {
                found.extend(crossing(tried));
            }
        }
        let said = |found: &[f64]| match found.iter().copied().reduce(f64::min) {
            Some(least) => format!("{least:.2}"),
            None => format!("none to {half:.2}"),
        };
        println!(
            "  {name:8} {:>33} {:>13} {:>14} {:>13}",
            said(&both[0]),
            published[j].0,
            said(&both[1]),
            published[j].1
        );
    }
}
