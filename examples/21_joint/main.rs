//! A joint with hidden friction and a hidden delay: the tool doubts, asks for another motion, gets it and names both; a controller by the
//! repaired model follows a slow curve better.
//!
//! `cargo run --release -p examples --example 21_joint` (20 joints; `--small`: 1); draws the first joint that was in doubt into `joint.svg` in
//! the temporary folder.
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

mod ask;
mod control;
mod joint;

use std::error::Error;

use ask::{ask, fast, parameter, proposed, record};
use control::{Followed, Plant, follow};
use examples::plot::{self, Panel};
use hw_traits::conformance;
use joint::{Joint, SIGMA_NM, Truth};
use missing_physics::diagnosis::{Diagnosis, Verdict};

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// Joints, by their seeds; the small setting has one whose first motion leaves a doubt.
const SEEDS: std::ops::RangeInclusive<u64> = 1..=20;
const SMALL: u64 = 5;
/// Experiments that are done at the most, beside the first.
const PATIENCE: usize = 2;

/// What came of one joint.
struct Story {
    truth: Truth,
    first: Diagnosis,
    /// What was proposed and done, in words.
    done: Vec<String>,
    last: Diagnosis,
    repaired: Plant,
    /// How the joint follows the curve by the simulation as it was, by its repair that takes the joint for prompt, and by its repair.
    followed: [Followed; 3],
}

impl Story {
    fn of(seed: u64) -> Outcome<Self> {
        let truth = Truth::draw(seed);
        conformance::motor(&mut Joint::new(truth, seed)?, &[0.5, -0.5], 20, 6.0 * SIGMA_NM)?;
        let mut joint = Joint::new(truth, seed)?;
        let mut rows = record(&mut joint, 1, &fast())?;
        let (mut loaded, mut last) = ask(&rows, seed)?;
        let first = last.clone();
        let mut done = Vec::new();
        while let Some((words, commands)) = proposed(&loaded, &last).filter(|_| done.len() < PATIENCE) {
            done.push(words);
            rows += &record(&mut joint, 1 + done.len(), &commands)?;
            (loaded, last) = ask(&rows, seed)?;
        }
        let baseline = Plant::baseline(&first).ok_or("no parameters")?;
        let repaired = Plant::repaired(&last).ok_or("no parameters")?;
        let mut by = |plant: Plant| follow(&mut joint, &plant, Joint::place_rad);
        let followed = [by(baseline)?, by(repaired.prompt())?, by(repaired)?];
        Ok(Self { truth, first, done, last, repaired, followed })
    }

    /// Whether the answer is the truth and nothing else.
    fn is_right(&self) -> bool {
        let mut chosen = self.last.chosen.clone();
        chosen.sort();
        self.last.verdict == Verdict::Explained && chosen == ["input-delay", "stribeck-friction"]
    }

    /// How many of the hidden numbers their intervals hold, and how many have one.
    fn held(&self) -> [usize; 2] {
        let hidden = self.truth.hidden();
        let found = hidden.iter().filter_map(|(id, name, truth)| {
            let [low, high] = parameter(&self.last, id, name)?.ci95;
            Some((low..=high).contains(truth))
        });
        let found: Vec<bool> = found.collect();
        [found.iter().filter(|held| **held).count(), found.len()]
    }

    /// By how much the error of tracking has become smaller.
    fn better(&self) -> f64 {
        self.followed[0].rms_rad / self.followed[2].rms_rad
    }

    fn tell(&self, seed: u64) {
        println!("joint {seed}: {}", self.truth);
        println!("  after fast swings: {}", said(&self.first));
        for words in &self.done {
            println!("  proposed and done: {words}");
        }
        if !self.done.is_empty() {
            println!("  then: {}", said(&self.last));
        }
        for (id, name, truth) in self.truth.hidden() {
            if let Some(e) = parameter(&self.last, id, name) {
                let ([low, high], unit) = (e.ci95, &e.unit);
                println!(
                    "    {id}, {name}: {:.5} {unit} ({low:.5} to {high:.5}); the truth is {truth:.5}",
                    e.value
                );
            }
        }
        let [baseline, prompt, repaired] = [0, 1, 2].map(|k| 1e3 * self.followed[k].rms_rad);
        println!(
            "  tracking error, rms: {baseline:.2} mrad by the simulation as it was, {prompt:.2} by its repair without the delay, {repaired:.2} by \
             its repair: smaller by a factor of {:.1}",
            self.better()
        );
    }

    fn draw(&self) -> Outcome<()> {
        const COLOURS: [&str; 3] = ["#999999", "#2060c0", "#c02020"];
        let mut panels = Vec::new();
        for (k, curves) in self.last.curves.iter().enumerate() {
            let mut panel = Panel::new(format!("motion {}", k + 1), "t / s", "angle / rad");
            let column = |y: &[f64]| -> Vec<[f64; 2]> {
                curves.inputs[0].iter().zip(y).map(|(t, y)| [*t, *y]).collect()
            };
            panel.line(column(&curves.measured[0]), COLOURS[0]).name("encoder", COLOURS[0]);
            panel.line(column(&curves.before[0]), COLOURS[1]).name("simulation", COLOURS[1]);
            panel.line(column(&curves.after[0]), COLOURS[2]).name("repaired", COLOURS[2]);
            panels.push(panel);
        }
        let mut friction = Panel::new("friction", "speed / (rad/s)", "rad/s^2");
        let over_speeds = |of: &dyn Fn(f64) -> f64| -> Vec<[f64; 2]> {
            (0..=200).map(|k| 0.015 * f64::from(k)).map(|v| [v, of(v)]).collect()
        };
        friction.line(over_speeds(&|v| self.truth.rubs(v)), COLOURS[0]).name("truth", COLOURS[0]);
        friction.line(over_speeds(&|v| self.repaired.friction(v)), COLOURS[2]).name("repaired", COLOURS[2]);
        panels.push(friction);
        let mut errors = Panel::new("tracking", "t / s", "error / mrad");
        for (followed, colour) in self.followed.iter().step_by(2).zip(&COLOURS[1..]) {
            errors.line(followed.errors.iter().map(|e| [e[0], 1e3 * e[1]]), colour);
        }
        errors.name("by the simulation", COLOURS[1]).name("by its repair", COLOURS[2]);
        panels.push(errors);
        let in_a_row = panels.len();
        println!("drawn: {}", plot::write("joint.svg", &panels, in_a_row)?.display());
        Ok(())
    }
}

/// An answer in a line.
fn said(d: &Diagnosis) -> String {
    let sets: Vec<String> =
        std::iter::once(&d.chosen).chain(&d.confused_with).map(|set| set.join(" + ")).collect();
    match d.verdict {
        Verdict::Adequate | Verdict::Unexplained => d.verdict.word().into(),
        _ => format!("{}: {}", d.verdict.word(), sets.join(", or ")),
    }
}

fn main() -> Outcome<()> {
    let seeds: Vec<u64> = if examples::small() { vec![SMALL] } else { SEEDS.collect() };
    let mut stories = Vec::new();
    for seed in seeds {
        let story = Story::of(seed)?;
        story.tell(seed);
        stories.push(story);
    }
    let count = |what: &dyn Fn(&Story) -> bool| stories.iter().filter(|s| what(s)).count();
    let held = stories.iter().map(Story::held).fold([0, 0], |a, b| [a[0] + b[0], a[1] + b[1]]);
    let mut better: Vec<f64> = stories.iter().map(Story::better).collect();
    better.sort_by(f64::total_cmp);
    println!(
        "\n{} of {} in doubt after fast swings, {} of these sure of the truth after what was proposed\nboth named and nothing else in {} of {}\n\
         {} of {} intervals hold the truth\nthe error of tracking becomes smaller by a factor of {:.1} in the middle, {:.1} at least",
        count(&|s| s.first.verdict == Verdict::Ambiguous),
        stories.len(),
        count(&|s| s.first.verdict == Verdict::Ambiguous && s.is_right()),
        count(&Story::is_right),
        stories.len(),
        held[0],
        held[1],
        better[better.len() / 2],
        better[0],
    );
    if let Some(story) = stories.iter().find(|s| !s.done.is_empty()) {
        story.draw()?;
    }
    Ok(())
}
