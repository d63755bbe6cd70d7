//! Posteriors of the benchmark sbibm (Lueckmann et al. 2021, PMLR 130:343) from one round of simulations: C2ST against its reference
//! posteriors, beside what its authors published for neural posterior estimation (NPE), and expected coverage.
//!
//! ```text
//! cargo run --release -p examples --example 06_posteriors -- --small   100 simulations of two_moons, one observation: seconds
//! cargo run --release -p examples --example 06_posteriors              1e3, 1e4 and 1e5, all tasks, ten observations: hours
//! cargo run --release -p examples --example 06_posteriors -- slcp autoregressive 100000 --observations=3 --points=3000
//! ```
//! Tasks, densities and numbers of simulations among the arguments keep to those named; `--coverage=0` leaves coverage out, which takes
//! long where the prior's box has five dimensions or more; `--seed=2` and so on draw and train anew.
#![allow(clippy::print_stdout, reason = "an example prints what it measures")]
#![allow(clippy::unwrap_used, reason = "what the tests share stops where data are damaged")]

#[path = "../bayes-sim/tests/bayes/common/mod.rs"]
mod common;

use std::error::Error;
use std::time::Instant;

use bayes_sim::autoregressive::{Autoregressive, AutoregressiveSettings};
use bayes_sim::c2st::c2st;
use bayes_sim::calibration::expected_coverage;
use bayes_sim::mdn::{Mdn, MdnSettings};
use bayes_sim::mdrff::{Mdrff, MdrffSettings};
use bayes_sim::posterior::ConditionalDensity;
use common::{Task, simulators};

/// Numbers of simulations.
const COUNTS: [usize; 3] = [1_000, 10_000, 100_000];
/// Mean C2ST of NPE at each of them (shared/sbibm/c2st_wide.csv).
const PUBLISHED: [(&str, [f64; 3]); 10] = [
    ("gaussian_linear", [0.6945, 0.5522, 0.5060]),
    ("two_moons", [0.7251, 0.6064, 0.5417]),
    ("slcp", [0.9752, 0.9006, 0.8315]),
    ("gaussian_mixture", [0.7161, 0.6153, 0.5478]),
    ("gaussian_linear_uniform", [0.6963, 0.5534, 0.5093]),
    ("bernoulli_glm", [0.8630, 0.6783, 0.5588]),
    ("bernoulli_glm_raw", [0.8996, 0.7648, 0.6074]),
    ("sir", [0.8151, 0.6796, 0.5848]),
    ("slcp_distractors", [0.9816, 0.9703, 0.8631]),
    ("lotka_volterra", [0.9994, 0.9968, 0.9808]),
];

/// Simulations and training with seeds of their own; the first are those of `bayes-sim/tests/bayes/posteriors.rs`.
fn train(
    name: &str,
    task: &Task,
    count: usize,
    seed: u64,
) -> Result<Box<dyn ConditionalDensity>, Box<dyn Error>> {
    let data = task.simulations(count, 41 + seed);
    Ok(match name {
        "mdn" => Box::new(Mdn::train(&task.prior, &data, &MdnSettings::default(), seed)?),
        "mdrff" => Box::new(Mdrff::train(&task.prior, &data, &MdrffSettings::default(), seed)?),
        _ => Box::new(Autoregressive::train(&task.prior, &data, &AutoregressiveSettings::default(), seed)?),
    })
}

/// The published score of a task at a number of simulations.
fn published(task: &str, count: usize) -> Option<f64> {
    let (_, scores) = PUBLISHED.iter().find(|(name, _)| *name == task)?;
    COUNTS.iter().zip(scores).find(|(c, _)| **c == count).map(|(_, score)| *score)
}

/// The number behind an option, or a default.
fn number(arguments: &[String], option: &str, default: usize) -> Result<usize, Box<dyn Error>> {
    let given = arguments.iter().find_map(|a| a.strip_prefix(option));
    given.map_or(Ok(default), |v| {
        v.parse().map_err(|_| format!("{option}{v}: a whole number is wanted").into())
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let small = examples::small();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let named = |name: &str| arguments.iter().any(|a| a == name);
    let tasks = [
        common::two_moons(),
        common::gaussian_linear(),
        common::slcp(),
        common::gaussian_mixture(),
        common::gaussian_linear_uniform(),
        simulators::bernoulli_glm(),
        simulators::bernoulli_glm_raw(),
        simulators::sir(),
        simulators::slcp_distractors(),
        simulators::lotka_volterra(),
    ];
    let densities = ["mdn", "mdrff", "autoregressive"];
    let any_task = tasks.iter().any(|t| named(t.name));
    let any_density = densities.iter().any(|d| named(d));
    let asked: Vec<usize> = COUNTS.into_iter().filter(|c| named(&c.to_string())).collect();
    let counts = match asked.as_slice() {
        [] if small => vec![100],
        [] => COUNTS.to_vec(),
        _ => asked,
    };
    let tasks: Vec<&Task> = tasks
        .iter()
        .filter(|t| if any_task { named(t.name) } else { !small || t.name == "two_moons" })
        .collect();
    let observations = number(&arguments, "--observations=", if small { 1 } else { 10 })?.clamp(1, 10);
    let points = number(&arguments, "--points=", if small { 300 } else { 10_000 })?.clamp(50, 10_000);
    let seed = number(&arguments, "--seed=", 1)?;
    let tests = number(&arguments, "--coverage=", if small { 100 } else { 1_000 })?;
    println!(
        "C2ST: 0.5 for a posterior that cannot be told from the reference. Coverage: mean of coverage less level."
    );
    println!(
        "{:24} {:>7} {:15} {:>7} {:>7} {:>9} {:>9}",
        "task", "sims", "density", "C2ST", "NPE", "coverage", "train s"
    );
    for task in tasks {
        for &count in &counts {
            let npe = published(task.name, count).map_or("-".to_owned(), |score| format!("{score:.3}"));
            for name in densities.iter().filter(|d| !any_density || named(d)) {
                let start = Instant::now();
                let density = train(name, task, count, seed as u64)?;
                let seconds = start.elapsed().as_secs_f64();
                let mut sum = 0.0;
                for i in 1..=observations {
                    let (x, reference) = common::reference(task, i, points)?;
                    let draws = density.sample(&x, points, &mut common::dice(i as u64))?;
                    sum += c2st(&reference, &draws, 1)?;
                }
                let coverage = if tests == 0 {
                    "-".to_owned()
                } else {
                    let tests = task.simulations(tests, 7);
                    format!("{:+.3}", expected_coverage(density.as_ref(), &tests, 200, 3)?.mean_error())
                };
                let score = sum / observations as f64;
                println!(
                    "{:24} {count:>7} {name:15} {score:>7.3} {npe:>7} {coverage:>9} {seconds:>9.1}",
                    task.name
                );
            }
        }
    }
    Ok(())
}
