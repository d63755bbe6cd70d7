use granular_infer::scene::{COUSCOUS, Grain};
use granular_infer::summary::{COUNT, NAMES};
use rayon::prelude::*;
use statrs::statistics::Statistics as _;

use crate::{Bench, HEIGHT_M, Outcome};

/// Section 3.5: what chance alone does to the statistics of equal pours, at a small and at a large sliding friction.
pub(crate) fn print(bench: &Bench) -> Outcome<()> {
    let pours = bench.either(2, 500);
    println!(
        "Equal pours, {pours} of each: variance over the mean's square ([Matl 2021]: two orders of magnitude or more)"
    );
    for sliding_friction in [0.1, 1.0] {
        let grain = Grain { sliding_friction, ..COUSCOUS };
        let all: Vec<[f64; COUNT]> = (0..pours as u64)
            .into_par_iter()
            .filter_map(|seed| bench.pour(&grain, None, HEIGHT_M, seed))
            .collect();
        if all.len() < 2 {
            return Err(format!("grains of mu_s {sliding_friction} leave the picture").into());
        }
        let column = |j: usize| all.iter().map(|x| x[j]).collect::<Vec<f64>>();
        let relative = |j: usize| column(j).as_slice().variance() / column(j).as_slice().mean().powi(2);
        let mut ratios: Vec<(f64, &str)> = (0..COUNT).map(|j| (relative(j), NAMES[j])).collect();
        ratios.sort_by(|a, b| b.0.total_cmp(&a.0));
        let above: Vec<String> = ratios
            .iter()
            .take_while(|(ratio, _)| *ratio > 0.01)
            .map(|(ratio, name)| format!("{name} {ratio:.2e}"))
            .collect();
        println!(
            "  mu_s {sliding_friction}: below 0.01 for {} of {COUNT}, above it {}; the median {:.1e}",
            COUNT - above.len(),
            if above.is_empty() { "none".into() } else { above.join(", ") },
            0.5 * (ratios[COUNT / 2 - 1].0 + ratios[COUNT / 2].0)
        );
    }
    Ok(())
}
