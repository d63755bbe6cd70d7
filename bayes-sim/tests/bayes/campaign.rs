//! Campaigns: the same whatever the threads and shards, resumable, failures kept.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use bayes_sim::campaign::{Campaign, Results, Shard, SimulationFailure, Simulator};
use bayes_sim::error::Error;
use bayes_sim::prior::{Marginal, Prior};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Fails where its first parameter is small, and gives NaN where the second is.
struct Shaky;

impl Simulator for Shaky {
    fn x_dim(&self) -> usize {
        2
    }

    fn simulate(&self, theta: &[f64], rng: &mut ChaCha8Rng) -> Result<Vec<f64>, SimulationFailure> {
        if theta[0] < 0.1 {
            return Err(SimulationFailure { reason: "fell over,\nfar too early".to_owned() });
        }
        let x = theta[0] + rng.random::<f64>();
        Ok(vec![x, if theta[1] < 2e-3 { f64::NAN } else { theta[1] * x }])
    }
}

fn campaign(count: usize) -> Campaign {
    let marginals =
        vec![Marginal::Uniform { low: 0.0, high: 1.0 }, Marginal::LogUniform { low: 1e-3, high: 10.0 }];
    Campaign { prior: Prior::new(marginals).unwrap(), x_dim: 2, count, seed: 9 }
}

fn run(campaign: &Campaign, shard: Shard, path: &std::path::Path) -> Result<Results, Error> {
    campaign.run(&Shaky, shard, path, &|_, _| {}, &AtomicBool::new(false))
}

#[test]
fn shards_merge_to_the_whole_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let campaign = campaign(1500);
    let whole = run(&campaign, Shard::WHOLE, &folder.path().join("whole")).unwrap();
    let shards = (0..3).map(|index| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(index + 1).build().unwrap();
        let path = folder.path().join(format!("part{index}"));
        pool.install(|| run(&campaign, Shard { index, count: 3 }, &path)).unwrap();
        // From the file: what was written reads back with the same bits.
        Results::read(&path).unwrap()
    });
    let merged = Results::merge(shards).unwrap();
    assert_eq!(merged.missing(), 0);
    assert_eq!(merged.simulations().unwrap(), whole.simulations().unwrap());
    let (failed, of_nan): (Vec<_>, Vec<_>) = whole.failures().partition(|(r, _)| r.theta[0] < 0.1);
    assert!(failed.len() > 100 && !of_nan.is_empty());
    assert!(of_nan.iter().all(|(_, f)| f.reason.contains("NaN")));
    assert_eq!(whole.simulations().unwrap().len() + failed.len() + of_nan.len(), 1500);
}

#[test]
fn a_run_that_was_stopped_and_cut_goes_on_to_the_same_end() {
    let folder = tempfile::tempdir().unwrap();
    let (path, campaign) = (folder.path().join("file"), campaign(1200));
    let (stop, seen) = (AtomicBool::new(false), Mutex::new(Vec::new()));
    let progress = |done: usize, of: usize| {
        seen.lock().unwrap().push((done, of));
        stop.store(done > 300, Ordering::Relaxed);
    };
    let part = campaign.run(&Shaky, Shard::WHOLE, &path, &progress, &stop).unwrap();
    assert!(part.missing() > 0 && part.missing() < 1200);
    assert_eq!(seen.lock().unwrap().first(), Some(&(0, 1200)));
    // As if the machine had gone off in the middle of a line.
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, &text[..text.len() - 11]).unwrap();
    let end = run(&campaign, Shard::WHOLE, &path).unwrap();
    let fresh = run(&campaign, Shard::WHOLE, &folder.path().join("fresh")).unwrap();
    assert_eq!(end.missing(), 0);
    assert_eq!(end.simulations().unwrap(), fresh.simulations().unwrap());
    assert_eq!(Results::read(&path).unwrap().simulations().unwrap(), fresh.simulations().unwrap());
}

/// Draws that take hours are not lost: the first are written once each thread has one.
#[test]
fn the_first_draws_are_written_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let stop = AtomicBool::new(false);
    let progress = |done: usize, _: usize| stop.store(done > 0, Ordering::Relaxed);
    let path = folder.path().join("file");
    let part = campaign(1200).run(&Shaky, Shard::WHOLE, &path, &progress, &stop).unwrap();
    assert_eq!(part.missing(), 1200 - rayon::current_num_threads());
    assert_eq!(Results::read(&path).unwrap().missing(), part.missing());
}

#[test]
fn wrong_files_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file");
    run(&campaign(60), Shard::WHOLE, &path).unwrap();
    assert!(matches!(
        run(&Campaign { seed: 1, ..campaign(60) }, Shard::WHOLE, &path),
        Err(Error::Mismatch { .. })
    ));
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replacen("\"version\":1", "\"version\":7", 1)).unwrap();
    let message = Results::read(&path).unwrap_err().to_string();
    assert!(message.contains("version 7") && message.contains("version 1"), "{message}");
    std::fs::write(&path, "a,b\n1,2\n").unwrap();
    assert!(matches!(Results::read(&path), Err(Error::Format { .. })));
    std::fs::write(&path, text + "garbage\n").unwrap();
    let message = Results::read(&path).unwrap_err().to_string();
    assert!(message.contains("garbage") && message.contains("line 62"), "{message}");
    let shard = Shard { index: 3, count: 3 };
    assert!(matches!(run(&campaign(60), shard, &folder.path().join("new")), Err(Error::Setting { .. })));
}
