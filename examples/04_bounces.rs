//! What the tool says of drops in which something is hidden, and how often it doubts drops in which nothing is.
//!
//! `cargo run --release -p examples --example 04_bounces` (60 null recordings of each kind and 20 of each effect;
//! `--small`: one of every fifth kind)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use missing_physics::diagnosis::{Diagnosis, Verdict};
use worlds::physics::bounce::{BounceWorld, Effects};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let none = Effects::default();
    let drops = BounceWorld::drops();
    let known = BounceWorld { height_known: true, ..drops };
    let of = |effects: Effects| BounceWorld { effects, ..drops };
    let kinds = [
        ("nothing; height not known", 60, drops),
        ("nothing; height known", 60, known),
        ("nothing; noise not known", 60, BounceWorld { noise_known: false, ..drops }),
        ("air-drag", 20, of(Effects { drag_per_m: 0.05, ..none })),
        ("velocity-dependent-restitution", 20, of(Effects { slope_s_m: 0.01, ..none })),
        ("table-tilt", 20, of(Effects { table_slope: [0.01, -0.02], ..none })),
        ("tangential-friction", 20, of(Effects { friction: 0.25, ..none })),
        ("clock-rate", 20, BounceWorld { effects: Effects { clock_rate: 0.003, ..none }, ..known }),
        ("missed-impact", 20, of(Effects { unheard: 0.2, ..none })),
        ("unlisted: one side is dead", 20, of(Effects { softer_side: 0.006, ..none })),
    ];
    println!(
        "{:32} {:>6} {:>8} {:>6} {:>12} {:>8} {:>11}",
        "hidden in 30 drops", "number", "adequate", "named", "among rivals", "another", "unexplained"
    );
    let small = examples::small();
    for (k, (name, count, world)) in kinds.iter().enumerate().step_by(if small { 5 } else { 1 }) {
        let count: u64 = if small { 1 } else { *count };
        let files = |seed| {
            let files = ["recording.toml", "data.csv"].into_iter().zip(world.files(seed));
            files.map(|(name, text)| (name.to_owned(), text.into_bytes())).collect()
        };
        let answers = examples::diagnose_files(&files, count, 4_000_000 + 1000 * k as u64, 499)?;
        let mut tally = [0; 5];
        answers.iter().flatten().for_each(|answer| tally[kind(answer, name)] += 1);
        let [adequate, named, rivals, another, unexplained] = tally;
        println!("{name:32} {count:>6} {adequate:>8} {named:>6} {rivals:>12} {another:>8} {unexplained:>11}");
    }
    Ok(())
}

/// Which column an answer counts in, where `hidden` is what is hidden.
fn kind(answer: &Diagnosis, hidden: &str) -> usize {
    let is = |set: &[String]| set.len() == 1 && set[0] == hidden;
    match answer.verdict {
        Verdict::Adequate => 0,
        Verdict::Explained if is(&answer.chosen) => 1,
        Verdict::Partly if is(&answer.chosen) && answer.confused_with.is_empty() => 1,
        Verdict::Ambiguous | Verdict::Partly
            if is(&answer.chosen) || answer.confused_with.iter().any(|s| is(s)) =>
        {
            2
        }
        Verdict::Explained | Verdict::Partly | Verdict::Ambiguous => 3,
        Verdict::Unexplained => 4,
    }
}
