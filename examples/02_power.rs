//! How faint an effect the tool still sees, beside an oracle: the likelihood-ratio test that knows which effect it is.
//!
//! The oracle knows mechanism, noise level and whiteness; at 5 % it detects 3.24 standard errors in 90 % of worlds (3.56 for
//! two parameters, 3.76 for three: noncentral chi-square). The tool knows none of these. Size is measured by least squares on worlds without noise.
//!
//! `cargo run --release -p examples --example 02_power` (`--small`: few worlds)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use missing_physics::diagnosis::Verdict;
use worlds::noise::Noise;
use worlds::physics::flight::{Effects, FlightWorld, Measured};

/// Standard errors by which a gravity-only flight misses one draw: straight lines are fitted to the
/// coordinates less the fall.
fn size(world: &FlightWorld, seed: u64) -> f64 {
    let quiet = FlightWorld { noise: Noise::white(0.0), ..*world };
    let squares: f64 = quiet
        .draw(seed)
        .runs
        .into_iter()
        .map(|run| {
            let last = run.channels.len() - 1;
            let misfit = |(c, z): (usize, &Vec<f64>)| {
                let g = if c == last { 9.80665 } else { 0.0 };
                let y: Vec<f64> = run.t_s.iter().zip(z).map(|(t, z)| z + 0.5 * g * t * t).collect();
                let n = y.len() as f64;
                let (tm, ym) = (run.t_s.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
                let slope = run.t_s.iter().zip(&y).map(|(t, y)| (t - tm) * (y - ym)).sum::<f64>()
                    / run.t_s.iter().map(|t| (t - tm).powi(2)).sum::<f64>();
                run.t_s.iter().zip(&y).map(|(t, y)| (y - ym - slope * (t - tm)).powi(2)).sum::<f64>()
            };
            run.channels.iter().enumerate().map(misfit).sum::<f64>()
        })
        .sum();
    squares.sqrt() / world.noise.sigma
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (count, factors): (_, &[f64]) = if examples::small() { (1, &[1.5]) } else { (60, &[1.0, 1.5, 2.0]) };
    let base = FlightWorld::thrown(Measured::Position);
    type Grow = fn(f64) -> Effects;
    // Name, the oracle's size in standard errors, and the effect of a size.
    let kinds: [(&str, f64, Grow); 4] = [
        ("quadratic drag", 3.24, |s| Effects { quadratic_per_m: 1e-4 * s, ..Effects::default() }),
        ("linear drag", 3.24, |s| Effects { linear_per_s: 1e-3 * s, ..Effects::default() }),
        ("Magnus lift", 3.76, |s| Effects { magnus_per_s: [0.0, 3e-4 * s, 3e-4 * s], ..Effects::default() }),
        ("camera tilt", 3.56, |s| Effects { camera_tilt_rad: [1e-4 * s, 0.0], ..Effects::default() }),
    ];
    println!("{:16} {:>28} {:>12}", "effect", "times the oracle's size", "detected");
    for (k, (name, oracle, grow)) in kinds.iter().enumerate() {
        for (j, factor) in factors.iter().enumerate() {
            // Each throw is another one: the effect is grown until this one misses by the wanted size.
            let world = |seed| {
                let unit = size(&FlightWorld { effects: grow(1.0), ..base }, seed);
                FlightWorld { effects: grow(factor * oracle / unit), ..base }
            };
            let seed = 1_000_000 + 10_000 * (3 * k + j) as u64;
            let answers = examples::diagnose_many(name, &world, count, seed, 399)?;
            let seen = answers.iter().filter(|d| d.verdict != Verdict::Adequate).count();
            println!(
                "{name:16} {:>28} {:>10.1} %",
                format!("{factor:.1}"),
                100.0 * seen as f64 / count as f64
            );
        }
    }
    Ok(())
}
