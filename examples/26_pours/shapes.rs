use granular_infer::dem::Clump;
use granular_infer::scene::Grain;
use rayon::prelude::*;

use crate::{Bench, HEIGHT_M, Outcome, spread};

/// A name, a shape if no sphere, what [Matl 2021] prints of the statistics' L2.
type Kind = (&'static str, Option<Clump>, &'static str);

/// Section 3.6: cubes and cylinders as wide as the spheres, inferred as spheres and poured again as spheres.
pub(crate) fn print(bench: &Bench) -> Outcome<()> {
    let heaps = bench.either(2, 50);
    let across_m = bench.scene.rig.diameter_m;
    let kinds: [Kind; 3] = [
        ("spheres", None, ""),
        ("cubes", Some(Clump::cube(across_m)?), "   [Matl 2021]: 1.8301 +- 1.9275"),
        ("cylinders", Some(Clump::cylinder(across_m, across_m)?), "   [Matl 2021]: 4.0139 +- 1.0574"),
    ];
    println!("\nOther shapes, {heaps} heaps each, mu_s from 0.1 to 1, e 0.5, mu_r 0.05");
    for (name, shape, published) in &kinds {
        let one = |i: usize| -> Option<(f64, f64, bool)> {
            let sliding_friction = 0.1 + 0.9 * i as f64 / (heaps - 1) as f64;
            let truth = Grain { sliding_friction, rolling_friction: 0.05, restitution: 0.5 };
            let seed = 30_000 + i as u64;
            let picture = bench.pour(&truth, shape.as_ref(), HEIGHT_M, seed)?;
            let inferred = bench.posterior.infer(&picture).ok()?;
            let estimate = inferred.estimate().ok()?;
            let again = bench.pour(&estimate, None, HEIGHT_M, seed + 1_000)?;
            Some((
                bench.posterior.distance(&picture, &again),
                estimate.sliding_friction - sliding_friction,
                inferred.resemblance.is_doubtful(),
            ))
        };
        let found: Vec<_> = (0..heaps).into_par_iter().filter_map(one).collect();
        if found.len() < 2 {
            println!("  {name}: {} of {heaps} heaps stay in the picture", found.len());
            continue;
        }
        let column = |of: fn(&(f64, f64, bool)) -> f64| found.iter().map(of).collect::<Vec<f64>>();
        println!("  {name:10} L2 of the statistics {}{published}", spread(&column(|f| f.0)));
        println!(
            "  {:10} mu_s off by {}; {} of {} pictures doubted",
            "",
            spread(&column(|f| f.1)),
            found.iter().filter(|f| f.2).count(),
            found.len()
        );
    }
    Ok(())
}
