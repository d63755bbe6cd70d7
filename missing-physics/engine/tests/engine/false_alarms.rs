//! The promised rate of false alarms, on worlds in which nothing is wrong.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use crate::common::{Ball, World};
use missing_physics::diagnosis::Verdict;
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use statrs::distribution::{Binomial, DiscreteCDF};

const WORLDS: u64 = 300;

/// Counts p-values at or below a level and compares the count with the binomial law of that level, at 1 in 1,000.
fn holds(world: World) {
    holds_in(world, WORLDS);
}

fn holds_in(world: World, worlds: u64) {
    let model = Ball::default();
    let options = Options { replicates: 199, ..Options::default() };
    let p: Vec<f64> = (0..worlds)
        .map(|seed| {
            let options = Options { seed, ..options.clone() };
            let answer = diagnose(&model, &world.draw(1000 + seed), &[], &options, &Silent).unwrap();
            assert_eq!(answer.verdict == Verdict::Adequate, answer.p_value > 0.05);
            answer.p_value
        })
        .collect();
    for level in [0.01, 0.05, 0.2, 0.5] {
        let alarms = p.iter().filter(|p| **p <= level + 1e-12).count() as u64;
        let law = Binomial::new(level, worlds).unwrap();
        println!("level {level}: {alarms} alarms in {worlds} worlds");
        assert!(law.cdf(alarms) > 5e-4, "too few alarms at {level}: {alarms}");
        assert!(alarms == 0 || law.sf(alarms - 1) > 5e-4, "too many alarms at {level}: {alarms}");
    }
}

#[test]
fn white_noise() {
    holds(World::NULL);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_coloured_noise() {
    holds(World { phi: 0.7, ..World::NULL });
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_quantised_noise() {
    holds(World { digit: 0.01, ..World::NULL });
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_faintly_coloured_noise() {
    holds(World { phi: 0.3, ..World::NULL });
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_one_reading_in_a_hundred_is_wild() {
    holds(World { wild: 0.01, ..World::NULL });
}

/// So many rows show a correlation to a hundredth: it must be met that well, and lies between round numbers.
#[test]
#[ignore = "long: .ci/run --long"]
fn long_many_rows_of_coloured_noise() {
    holds_in(World { rows: 1000, phi: 0.5, ..World::NULL }, 40);
}

/// The least rows that are accepted, and some more: one run of a free fall with two unknowns and an unknown noise.
#[test]
fn one_run_of_a_few_rows() {
    for rows in [4, 5, 6, 8, 12] {
        println!("{rows} rows");
        holds(World { runs: 1, rows, ..World::NULL });
    }
}
