//! How often the right mechanism is named, and how often its 95 % interval holds the truth.
//!
//! `cargo run --release -p examples --example 03_intervals` (1,000 worlds; `--small`: 8)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use worlds::noise::Noise;
use worlds::physics::flight::{Effects, FlightWorld, Measured};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let count = if examples::small() { 2 } else { 250 };
    let base = FlightWorld::thrown(Measured::Position);
    let drop = FlightWorld { noise: Noise::white(0.005), ..FlightWorld::dropped(4, [45, 55], 30.0) };
    let of = |world: FlightWorld, effects: Effects| FlightWorld { effects, ..world };
    let none = Effects::default();
    let kinds = [
        ("quadratic-drag", "k_per_m", 0.012, of(base, Effects { quadratic_per_m: 0.012, ..none })),
        ("quadratic-drag", "k_per_m", 0.02, of(drop, Effects { quadratic_per_m: 0.02, ..none })),
        (
            "magnus-lift",
            "lift_y_per_s",
            0.05,
            of(base, Effects { magnus_per_s: [0.01, 0.05, -0.02], ..none }),
        ),
        ("camera-tilt", "about_x_rad", 0.006, of(base, Effects { camera_tilt_rad: [0.006, -0.002], ..none })),
    ];
    let (mut named_all, mut covered_all, mut n) = (0, 0, 0);
    println!(
        "{:16} {:14} {:>8} {:>14} {:>20}",
        "hidden", "parameter", "named", "in the answer", "interval holds it"
    );
    for (k, (id, parameter, truth, world)) in kinds.iter().enumerate() {
        let answers = examples::diagnose_many(id, &|_| *world, count, 2_000_000 + 10_000 * k as u64, 199)?;
        let is = |set: &Vec<String>| set.len() == 1 && set[0] == *id;
        let named: Vec<_> = answers.iter().filter(|d| is(&d.chosen)).collect();
        let inside = answers.iter().filter(|d| is(&d.chosen) || d.confused_with.iter().any(is)).count();
        let holds = |d: &&&missing_physics::diagnosis::Diagnosis| {
            let parameters = d.mechanisms.iter().filter(|m| m.id == *id).flat_map(|m| &m.parameters);
            parameters.filter(|e| e.name == *parameter).any(|e| e.ci95[0] <= *truth && *truth <= e.ci95[1])
        };
        let covered = named.iter().filter(holds).count();
        let percent = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
        println!(
            "{id:16} {parameter:14} {:>6.1} % {:>12.1} % {:>18.1} %",
            percent(named.len(), answers.len()),
            percent(inside, answers.len()),
            percent(covered, named.len())
        );
        named_all += named.len();
        covered_all += covered;
        n += answers.len();
    }
    println!(
        "all {n} worlds: {named_all} named; the interval holds the truth in {:.1} %",
        100.0 * covered_all as f64 / named_all.max(1) as f64
    );
    Ok(())
}
