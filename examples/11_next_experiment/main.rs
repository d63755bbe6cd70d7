//! A robot does what the tool proposes: something is hidden about a bottle, or about a soft body; the rig swings, tilts or presses until
//! the tool is sure what it is, against random actions and an even grid of them.
//!
//! `cargo run --release -p examples --example 11_next_experiment` (50 worlds a rig; `--small`: 1, of two experiments at most)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

mod contact;
mod swung;
mod tilted;
mod wrist;

use std::error::Error;

use missing_physics::diagnosis::Diagnosis;
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// How sure is sure.
const SURE: f64 = 0.95;
/// Worlds looked at for one whose first answer is ambiguous.
const DRAWN: u64 = 20;

/// A rig, what may be hidden about it, and what it can do.
trait Rig {
    /// What is hidden.
    type Hidden: Copy + Send + Sync;
    /// What it does.
    type Action: Copy + Send + Sync;
    /// In the table.
    const NAME: &'static str;
    /// First line of the data.
    const COLUMNS: &'static str;

    /// The recording's header.
    fn header() -> String;
    /// Hides something.
    fn draw(rng: &mut ChaCha8Rng) -> Self::Hidden;
    /// Its name in the tool.
    fn id(hidden: Self::Hidden) -> &'static str;
    /// What is done at first.
    fn first() -> Self::Action;
    /// Anything that the rig can do, drawn.
    fn random(rng: &mut ChaCha8Rng) -> Self::Action;
    /// An even grid of what the rig can do.
    fn grid() -> Vec<Self::Action>;
    /// A proposal's values as an action of this rig, if it can do that.
    fn proposed(value: &dyn Fn(&str) -> Option<f64>) -> Option<Self::Action>;
    /// Rows of the recording of one action, done through the rig's traits.
    fn act(action: Self::Action, hidden: Self::Hidden, label: usize, seed: u64) -> Outcome<String>;
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Policy {
    Proposed,
    Random,
    Grid,
}

const POLICIES: [Policy; 3] = [Policy::Proposed, Policy::Random, Policy::Grid];

/// Experiments after which a rig gives up.
fn patience() -> usize {
    if examples::small() { 2 } else { 8 }
}

fn ask<R: Rig>(rows: &str, seed: u64) -> Outcome<Diagnosis> {
    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("recording.toml"), R::header())?;
    std::fs::write(folder.path().join("data.csv"), format!("{}\n{rows}", R::COLUMNS))?;
    let (_, mut loaded) = missing_physics_domains::load(folder.path()).map_err(|e| e.to_string())?;
    loaded.experiments.retain(|e| proposed::<R>(&e.action).is_some());
    let options = Options { seed, replicates: 199, ..Options::default() };
    Ok(diagnose(&*loaded.model, &loaded.recording, &loaded.experiments, &options, &Silent)?)
}

/// A number of which each factor between the limits is equally likely.
fn on_log_scale(rng: &mut ChaCha8Rng, [least, most]: [f64; 2]) -> f64 {
    rng.random_range(least.ln()..most.ln()).exp()
}

/// A proposed action as one of the rig's, if it can do it.
fn proposed<R: Rig>(action: &[(String, f64)]) -> Option<R::Action> {
    R::proposed(&|name| action.iter().find(|(n, _)| n == name).map(|(_, v)| *v))
}

/// One rig with something hidden about it, and what it has recorded.
struct World<R: Rig> {
    hidden: R::Hidden,
    seed: u64,
    rows: String,
    done: usize,
    answer: Diagnosis,
}

impl<R: Rig> World<R> {
    fn new(seed: u64) -> Outcome<Self> {
        let hidden = R::draw(&mut ChaCha8Rng::seed_from_u64(seed));
        let rows = R::act(R::first(), hidden, 1, seed)?;
        let answer = ask::<R>(&rows, seed)?;
        Ok(Self { hidden, seed, rows, done: 0, answer })
    }

    /// How probable the tool thinks that what is hidden is at work.
    fn belief(&self) -> f64 {
        let id = R::id(self.hidden);
        self.answer.mechanisms.iter().find(|m| m.id == id).map_or(0.0, |m| m.probability)
    }

    fn act(&mut self, action: R::Action) -> Outcome<()> {
        self.done += 1;
        let noise = self.seed ^ (self.done as u64) << 32;
        self.rows += &R::act(action, self.hidden, self.done + 1, noise)?;
        self.answer = ask::<R>(&self.rows, self.seed)?;
        Ok(())
    }

    /// The action that the tool proposes, if it does.
    fn proposed(&self) -> Option<R::Action> {
        proposed::<R>(&self.answer.next_experiment.as_ref()?.action)
    }

    /// Experiments until the tool is sure of the truth ([`patience`] where it never was).
    fn until_sure(mut self, policy: Policy, printed: bool) -> Outcome<usize> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed ^ 0xdead);
        let grid = R::grid();
        while self.done < patience() {
            let sure = self.belief() >= SURE;
            if printed {
                self.tell();
            }
            if sure {
                break;
            }
            let action = match policy {
                Policy::Proposed => self.proposed().unwrap_or_else(|| R::random(&mut rng)),
                Policy::Random => R::random(&mut rng),
                Policy::Grid => grid[self.done % grid.len()],
            };
            self.act(action)?;
        }
        Ok(self.done)
    }

    fn tell(&self) {
        println!("  {}, P({}) = {:.2}", self.answer.verdict.word(), R::id(self.hidden), self.belief());
        if let (true, Some(next)) = (self.belief() < SURE, &self.answer.next_experiment) {
            println!("  proposed: {}", next.words);
        }
    }

    /// The first of some worlds whose first answer is ambiguous, and how many were looked at.
    fn ambiguous(from: u64) -> Outcome<(Option<Self>, u64)> {
        for looked in 0..DRAWN {
            let world = Self::new(from + looked)?;
            if world.answer.verdict.word() == "ambiguous" {
                return Ok((Some(world), looked + 1));
            }
        }
        Ok((None, DRAWN))
    }
}

/// The table of one rig: experiments that each policy took, world by world.
fn race<R: Rig>(worlds: u64) -> Outcome<[Vec<usize>; 3]> {
    println!("{}: one world, step by step", R::NAME);
    if let (Some(world), _) = World::<R>::ambiguous(1 << 20)? {
        world.until_sure(Policy::Proposed, true)?;
    }
    let started: Vec<(u64, u64, bool)> = (0..worlds)
        .into_par_iter()
        .map(|w| {
            let from = w * DRAWN;
            let (world, looked) = World::<R>::ambiguous(from)?;
            Ok((from + looked - 1, looked, world.is_some()))
        })
        .collect::<Outcome<_>>()?;
    let seeds: Vec<u64> = started.iter().filter(|s| s.2).map(|s| s.0).collect();
    let drawn: u64 = started.iter().map(|s| s.1).sum();
    println!("  {} worlds whose first answer is ambiguous, of {drawn} drawn", seeds.len());
    let mut table = [const { Vec::new() }; 3];
    for (row, policy) in table.iter_mut().zip(POLICIES) {
        *row = seeds
            .par_iter()
            .map(|seed| World::<R>::new(*seed)?.until_sure(policy, false))
            .collect::<Outcome<_>>()?;
    }
    show(&table);
    Ok(table)
}

fn mean(counts: &[usize]) -> f64 {
    counts.iter().sum::<usize>() as f64 / counts.len().max(1) as f64
}

/// Mean, median, most, and how many were never sure, of each policy; its mean over that of random actions.
fn show(table: &[Vec<usize>; 3]) {
    println!(
        "  {:10} {:>6} {:>8} {:>6} {:>6} {:>16}",
        "policy", "mean", "median", "most", "never", "over random's"
    );
    for (counts, policy) in table.iter().zip(POLICIES) {
        let mut sorted = counts.clone();
        sorted.sort_unstable();
        let never = sorted.iter().filter(|n| **n == patience()).count();
        let middle = sorted.get(sorted.len() / 2).copied().unwrap_or(0);
        let most = sorted.last().copied().unwrap_or(0);
        let (name, share) = (format!("{policy:?}").to_lowercase(), mean(counts) / mean(&table[1]));
        println!("  {name:10} {:6.2} {middle:8} {most:6} {never:6} {share:16.2}", mean(counts));
    }
}

/// One line of the summary: worlds, and mean experiments of each policy.
fn sum_up(name: &str, table: &[Vec<usize>; 3]) {
    let [proposed, random, grid] = table.each_ref().map(|counts| mean(counts));
    let share = proposed / random;
    println!("{name:22} {:6} {proposed:12.2} {random:15.2} {grid:10.2} {share:14.2}", table[0].len());
}

fn main() -> Outcome<()> {
    let worlds = if examples::small() { 1 } else { 50 };
    println!("Experiments beyond the first until P(what is hidden) >= {SURE}\n");
    let rigs = [
        (swung::Swung::NAME, race::<swung::Swung> as fn(u64) -> Outcome<[Vec<usize>; 3]>),
        (tilted::Tilted::NAME, race::<tilted::Tilted>),
        (contact::Contact::NAME, race::<contact::Contact>),
    ];
    let mut tables = Vec::new();
    for (name, race) in rigs {
        tables.push((name, race(worlds)?));
        println!();
    }
    println!(
        "{:22} {:>6} {:>12} {:>15} {:>10} {:>14}",
        "", "worlds", "experiments", "random actions", "even grid", "over random's"
    );
    let mut all = [const { Vec::new() }; 3];
    for (name, table) in tables {
        sum_up(name, &table);
        all.iter_mut().zip(table).for_each(|(all, one)| all.extend(one));
    }
    sum_up("all", &all);
    Ok(())
}
