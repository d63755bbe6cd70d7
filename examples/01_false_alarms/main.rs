//! How often the tool sees something where there is nothing.
//!
//! Null worlds with white, coloured and quantised noise and with wild readings; every run's start is fitted. The rate must lie inside the 95 %
//! binomial band of the promised one, at 5 % and at 1 %. Then recordings of 3 to 12 rows, cut out of null worlds of each domain, without a
//! calibration, and drops of 3 to 8 impacts.
//!
//! `cargo run --release -p examples --example 01_false_alarms` (2,000 worlds; `--small`: 7; `few` or `drops` for that part alone)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

mod drops;
mod few_rows;

use statrs::distribution::{Binomial, DiscreteCDF};
use worlds::concealed::makers;
use worlds::noise::Noise;
use worlds::physics::flight::{FlightWorld, Measured};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let part = std::env::args().nth(1).filter(|a| !a.starts_with('-'));
    let wanted = |name: &str| part.as_deref().is_none_or(|p| p == name);
    if wanted("flights") {
        flights()?;
    }
    if wanted("few") {
        few()?;
    }
    if wanted("drops") {
        drops::drops()?;
    }
    Ok(())
}

/// How many of some p-values are at most a level.
fn alarms(p: &[f64], level: f64) -> usize {
    p.iter().filter(|p| **p <= level).count()
}

/// Says whether all alarms are as many as promised.
fn compare(all: &[f64]) -> Result<(), Box<dyn std::error::Error>> {
    let n = all.len() as u64;
    for level in [0.05, 0.01] {
        let alarms = alarms(all, level);
        let law = Binomial::new(level, n)?;
        let (low, high) = (law.inverse_cdf(0.025), law.inverse_cdf(0.975));
        let inside = if (low..=high).contains(&(alarms as u64)) { "inside" } else { "OUTSIDE" };
        println!(
            "all: {:.2} % of {n} worlds at {} %: {alarms} alarms, {inside} the 95 % band {low} to {high}",
            100.0 * alarms as f64 / n as f64,
            100.0 * level
        );
    }
    Ok(())
}

/// Recordings of a few rows.
fn few() -> Result<(), Box<dyn std::error::Error>> {
    let count = if examples::small() { 1 } else { 40 };
    println!("{:28} {:>7} {:>8} {:>8} {:>8}", "few rows", "number", "refused", "at 5 %", "at 1 %");
    for (d, domain) in few_rows::DOMAINS.iter().enumerate() {
        let maker = makers().iter().find(|m| m.name() == *domain).ok_or("no such worlds")?;
        let mut all = Vec::new();
        let rows: &[usize] = if examples::small() { &[3, 12] } else { &[3, 4, 5, 6, 7, 8, 9, 10, 11, 12] };
        for (rows, runs) in rows.iter().flat_map(|&rows| [1, 3].map(|runs| (rows, runs))) {
            let files = |seed| few_rows::cut(*maker, seed, runs, rows);
            let first = 7_000_000 + 100_000 * d as u64 + 1000 * rows as u64 + 100 * runs as u64;
            let answers = examples::diagnose_files(&files, count, first, 399)?;
            let p: Vec<f64> = answers.iter().flatten().map(|d| d.p_value).collect();
            let refused = answers.len() - p.len();
            let name = format!("{domain}: {runs} x {rows}");
            println!("{name:28} {:>7} {refused:>8} {:>8} {:>8}", p.len(), alarms(&p, 0.05), alarms(&p, 0.01));
            all.extend(p);
        }
        compare(&all)?;
    }
    Ok(())
}

fn flights() -> Result<(), Box<dyn std::error::Error>> {
    let count = if examples::small() { 1 } else { 286 };
    let space = FlightWorld::thrown(Measured::Position);
    let height = FlightWorld::thrown(Measured::Height);
    let with = |world: FlightWorld, noise: Noise| FlightWorld { noise, ..world };
    let kinds = [
        ("height, white noise", with(height, Noise::white(0.002))),
        ("height, correlated by 0.6", with(height, Noise { correlation: 0.6, ..Noise::white(0.002) })),
        ("height, read to 5 mm", with(height, Noise { digit: 0.005, ..Noise::white(0.002) })),
        ("height, 1 % wild readings", with(height, Noise { outliers: 0.01, ..Noise::white(0.002) })),
        ("space, white noise", space),
        ("space, correlated by 0.8", with(space, Noise { correlation: 0.8, ..Noise::white(0.001) })),
        ("space, read to 2 mm", with(space, Noise { digit: 0.002, ..Noise::white(0.001) })),
    ];
    let mut all = Vec::new();
    println!("{:28} {:>7} {:>8} {:>8}", "null worlds", "number", "at 5 %", "at 1 %");
    for (k, (name, world)) in kinds.iter().enumerate() {
        let answers = examples::diagnose_many(name, &|_| *world, count, 10_000 * (k as u64 + 1), 399)?;
        let p: Vec<f64> = answers.iter().map(|d| d.p_value).collect();
        println!("{name:28} {:>7} {:>8} {:>8}", p.len(), alarms(&p, 0.05), alarms(&p, 0.01));
        all.extend(p);
    }
    compare(&all)
}
