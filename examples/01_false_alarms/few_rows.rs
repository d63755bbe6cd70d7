//! Recordings of a few rows, cut out of worlds in which nothing is hidden.

use std::collections::HashMap;

use worlds::concealed::{Concealed, Hidden, Maker};

/// Domains of which a table of a few rows is a recording.
pub(crate) const DOMAINS: [&str; 5] = ["trajectory", "liquid-tilt", "slosh", "indentation", "bounce"];

/// Files of a recording: name and contents.
pub(crate) type Files = Vec<(String, Vec<u8>)>;

/// A world's files with so many runs, and so many rows of each: its first ones where rows hang on one another (impacts), else evenly
/// spaced ones; without a calibration of the noise.
pub(crate) fn cut(maker: &dyn Maker, seed: u64, runs: usize, rows: usize) -> Files {
    let Concealed { files, .. } = maker.conceal(Hidden::Nothing, seed);
    let part = |(name, contents): (String, Vec<u8>)| {
        let text = String::from_utf8_lossy(&contents).into_owned();
        let text = match name.as_str() {
            "data.csv" => part_of_table(&text, runs, rows, maker.domain() == "bounce"),
            "recording.toml" => without_calibration(&text),
            _ => text,
        };
        (name, text.into_bytes())
    };
    files.into_iter().map(part).collect()
}

fn part_of_table(text: &str, runs: usize, rows: usize, first: bool) -> String {
    let mut lines = text.lines();
    let mut kept = lines.next().unwrap_or_default().to_owned() + "\n";
    let mut order: Vec<&str> = Vec::new();
    let mut of_run: HashMap<&str, Vec<&str>> = HashMap::new();
    for line in lines {
        let label = line.split(',').next().unwrap_or_default();
        if !of_run.contains_key(label) {
            order.push(label);
        }
        of_run.entry(label).or_default().push(line);
    }
    for label in order.into_iter().take(runs) {
        let all = &of_run[label];
        let n = rows.min(all.len());
        let at = |k: usize| if first || n < 2 { k } else { k * (all.len() - 1) / (n - 1) };
        (0..n).for_each(|k| kept += &format!("{}\n", all[at(k)]));
    }
    kept
}

/// A header without its section `[noise]`.
fn without_calibration(text: &str) -> String {
    let mut inside = false;
    let outside = |line: &&str| {
        if line.starts_with('[') {
            inside = line.trim() == "[noise]";
        }
        !inside
    };
    text.lines().filter(outside).collect::<Vec<_>>().join("\n") + "\n"
}
