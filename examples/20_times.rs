//! How long the tool takes for each recording in the repository, from its files to the answer: medians over some runs.
//!
//! `cargo run --release -p examples --example 20_times` (`--small`: two recordings, once)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use examples::small;
use missing_physics::engine::Options;
use missing_physics::observer::Silent;
use statrs::statistics::{Data, OrderStatistics};

/// Runs of which the median is taken.
const RUNS: usize = 3;

/// The folders of recordings below one, in order.
fn recordings(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    if folder.join("recording.toml").exists() {
        return Ok(vec![folder.into()]);
    }
    let mut below: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
    below.sort();
    let inner = below.iter().filter(|path| path.is_dir()).map(|path| recordings(path));
    Ok(inner.collect::<Result<Vec<_>, _>>()?.concat())
}

/// Domain and measured values of a recording, and the seconds of a diagnosis.
fn diagnose(folder: &Path) -> Result<(String, usize, f64), Box<dyn std::error::Error>> {
    let begin = Instant::now();
    let (domain, loaded) = missing_physics_domains::load(folder)?;
    loaded.diagnose(&Options::default(), &Silent)?;
    let seconds = begin.elapsed().as_secs_f64();
    let recording = &loaded.recording;
    let values = recording.runs.iter().map(|run| run.len() * recording.channels.len()).sum();
    let sound = loaded.additions.contains_key("impacts");
    Ok((format!("{}{}", domain.id(), if sound { ", from sound" } else { "" }), values, seconds))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../recordings");
    let (folders, runs) = if small() {
        (["dropped-ball", "steel-ball"].map(|name| root.join(name)).into(), 1)
    } else {
        (recordings(&root)?, RUNS)
    };
    println!("median over {runs} runs on {} threads\n", rayon::current_num_threads());
    println!("{:40} {:20} {:>7} {:>7}", "recording", "domain", "values", "s");
    let mut domains: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for folder in folders {
        let name = folder.strip_prefix(&root)?.display().to_string();
        match (0..runs).map(|_| diagnose(&folder)).collect::<Result<Vec<_>, _>>() {
            Ok(all) => {
                let seconds =
                    Data::new(all.iter().map(|(.., seconds)| *seconds).collect::<Vec<_>>()).median();
                let (domain, values) = all.first().map(|(d, v, _)| (d.clone(), *v)).unwrap_or_default();
                println!("{name:40} {domain:20} {values:7} {seconds:7.2}");
                domains.entry(domain).or_default().push(seconds);
            }
            // The simulator of one is a program in Python.
            Err(error) => println!("{name:40} not diagnosed: {error}"),
        }
    }
    println!("\n{:20} {:>10} {:>10}", "domain", "recordings", "median, s");
    for (domain, seconds) in domains {
        println!("{domain:20} {:10} {:10.2}", seconds.len(), Data::new(seconds).median());
    }
    Ok(())
}
