//! A watch over runs that arrive one by one: false alarms over whole days, delays, and a finger that softens at noon.
//!
//! A finger presses on a pad 40 times a day; each press begins at a height of its own. The noise is 20 mN, which the watch does not
//! know. A change of one sigma a run is one that a test with the true noise and the true change sees as one standard error in one run.
//!
//! `cargo run --release -p examples --example 18_watch` (`--small`: few days)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use missing_physics::data::{Recording, Run};
use missing_physics::engine::stream::{Look, Watch, What};
use missing_physics::model::{Model, PredictError, Quantity, Spec, SpecBuilder, SpecError, UNBOUNDED};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rayon::prelude::*;

/// Readings of a press, its depth (mm), and the noise (N).
const ROWS: usize = 25;
const DEPTH_MM: f64 = 2.0;
const NOISE_N: f64 = 0.020;
/// Stiffness in the morning, N/mm^1.5.
const STIFFNESS: f64 = 0.5;
/// Presses in which all is well.
const REFERENCE: usize = 20;

/// Hertz: F = F0 + k d^1.5; a pad that is pressed flat is the mechanism.
struct Finger(Spec);

impl Finger {
    fn new() -> Result<Self, SpecError> {
        let mut b = SpecBuilder::new("a spring of Hertz");
        b.shared("stiffness_n_per_mm15", "N/mm^1.5", 0.4, [0.0, f64::INFINITY], 0.1);
        let flat = b.shared("flat_n_per_mm3", "N/mm^3", 0.0, UNBOUNDED, 0.05);
        b.nuisance("zero_n", "N", UNBOUNDED, 1.0);
        b.mechanism("flat", &[flat], ["a pad that is pressed flat", "It ends.", "F = c d^3", ""], &[]);
        Ok(Self(b.build()?))
    }
}

impl Model for Finger {
    fn spec(&self) -> &Spec {
        &self.0
    }

    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        for (out, d) in out.iter_mut().zip(&run.inputs[0]) {
            *out = nuisance[0] + shared[0] * d.powf(1.5) + shared[1] * d.powi(3);
        }
        Ok(())
    }
}

/// A rig that presses: a hand that is not steady, a sensor with a zero that wanders.
struct Rig {
    rng: ChaCha8Rng,
    presses: usize,
}

impl Rig {
    fn press(&mut self, stiffness: f64) -> Result<Run, Box<dyn std::error::Error + Send + Sync>> {
        let zero_n = Uniform::new(-1.0, 1.0)?.sample(&mut self.rng);
        let depth_mm: Vec<f64> = (0..ROWS).map(|i| DEPTH_MM * i as f64 / (ROWS - 1) as f64).collect();
        let force = depth_mm.iter().map(|d| {
            let noise: f64 = StandardNormal.sample(&mut self.rng);
            zero_n + stiffness * d * d.sqrt() + NOISE_N * noise
        });
        let force = force.collect();
        self.presses += 1;
        Ok(Run { label: format!("{}", self.presses), inputs: vec![depth_mm], outputs: vec![force], kind: 0 })
    }
}

/// How far a unit of stiffness misses in one press, in standard errors, once the press's own zero is fitted.
fn sigmas_of_a_unit() -> f64 {
    let shape: Vec<f64> = (0..ROWS).map(|i| (DEPTH_MM * i as f64 / (ROWS - 1) as f64).powf(1.5)).collect();
    let mean = shape.iter().sum::<f64>() / ROWS as f64;
    shape.iter().map(|s| (s - mean).powi(2)).sum::<f64>().sqrt() / NOISE_N
}

/// A day: presses with the stiffness of each.
fn day(
    seed: u64,
    presses: usize,
    stiffness: impl Fn(usize) -> f64,
    mut each: impl FnMut(&Look),
) -> Result<Option<usize>, Box<dyn std::error::Error + Send + Sync>> {
    let mut rig = Rig { rng: ChaCha8Rng::seed_from_u64(seed), presses: 0 };
    let runs = (0..REFERENCE).map(|_| rig.press(STIFFNESS)).collect::<Result<Vec<_>, _>>()?;
    let reference = Recording {
        channels: vec![Quantity::new("force_n", "N")],
        variables: vec![Quantity::new("depth_mm", "mm")],
        runs,
        noise_along: Some(0),
        calibration: vec![None],
        resolution: vec![0.0],
    };
    let model = Finger::new()?;
    let mut watch = Watch::new(&model, &reference, 0.05)?;
    for k in 0..presses {
        let look = watch.add(&rig.press(stiffness(k))?)?;
        each(&look);
        if look.alarm.is_some() {
            return Ok(look.alarm.map(|run| run - REFERENCE));
        }
    }
    Ok(None)
}

fn false_alarms(days: usize) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let alarms = (0..days as u64)
        .into_par_iter()
        .map(|seed| day(seed, 40, |_| STIFFNESS, |_| ()).map(|alarm| usize::from(alarm.is_some())))
        .sum::<Result<usize, _>>()?;
    let share = 100.0 * alarms as f64 / days as f64;
    println!(
        "{days} days of 40 presses without a change, looked at after each: {alarms} with an alarm ({share:.1} %)\n"
    );
    Ok(())
}

fn delays(days: usize) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    println!(
        "a change from press 35 on           presses until the alarm: half the days   nine in ten   the best fixed test, half"
    );
    for sigmas in [1.0, 2.0, 3.0] {
        let by = sigmas / sigmas_of_a_unit();
        let stiffness = |k: usize| if k < 14 { STIFFNESS } else { STIFFNESS - by };
        let mut waits = (0..days as u64)
            .into_par_iter()
            .map(|seed| {
                let alarm = day(10_000 + seed, 114, stiffness, |_| ())?;
                // A false alarm before the change is none of it; a change that is never seen waits for ever.
                Ok::<_, Box<dyn std::error::Error + Send + Sync>>(match alarm {
                    Some(run) if run < 14 => None,
                    Some(run) => Some(run - 13),
                    None => Some(usize::MAX),
                })
            })
            .collect::<Result<Vec<_>, _>>()?
            .into_iter()
            .flatten()
            .collect::<Vec<_>>();
        waits.sort_unstable();
        let at =
            |share: f64| waits.get((share * (waits.len() - 1) as f64).ceil() as usize).copied().unwrap_or(0);
        // It knows when, what, which sign and how much noise: n runs show n^(1/2) times the sigmas, and 1.645 are needed.
        let fixed = (1.645_f64 / sigmas).powi(2).ceil();
        let said = |wait: usize| if wait == usize::MAX { "not in 100".to_owned() } else { wait.to_string() };
        println!(
            "{sigmas} sigma a press ({:.1} % softer) {:>35} {:>13} {fixed:>27}",
            100.0 * by / STIFFNESS,
            said(at(0.5)),
            said(at(0.9))
        );
    }
    println!();
    Ok(())
}

fn a_finger_that_softens_at_noon() -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    println!("a finger that is 3 % softer from press 35 on:");
    let noon = 14;
    let mut rig = Rig { rng: ChaCha8Rng::seed_from_u64(5), presses: 0 };
    let mut runs = Vec::new();
    for k in 0..REFERENCE + 24 {
        runs.push(rig.press(if k < REFERENCE + noon { STIFFNESS } else { 0.97 * STIFFNESS })?);
    }
    let reference = Recording {
        channels: vec![Quantity::new("force_n", "N")],
        variables: vec![Quantity::new("depth_mm", "mm")],
        runs: runs[..REFERENCE].to_vec(),
        noise_along: Some(0),
        calibration: vec![None],
        resolution: vec![0.0],
    };
    let model = Finger::new()?;
    let mut watch = Watch::new(&model, &reference, 0.05)?;
    for run in &runs[REFERENCE..] {
        let look = watch.add(run)?;
        if let (Some(changed), true) = (&look.changed, look.run >= 31) {
            say(&run.label, &look, changed);
        }
    }
    Ok(())
}

fn say(label: &str, look: &Look, changed: &missing_physics::engine::stream::Changed) {
    let Some((what, share)) = changed.what.first().filter(|_| look.alarm.is_some()) else {
        println!("press {label:>2}: e = {:.3}", look.e_value);
        return;
    };
    let what = match what {
        What::Parameter { name, .. } => name.clone(),
        What::Mechanism { name, .. } => name.clone(),
        What::Curve { channel } => format!("another curve of {channel}"),
    };
    let (by, error) = changed.by.first().copied().unwrap_or_default();
    println!(
        "press {label:>2}: e = {:.3e}, changed from press {} on (95 %: {} to {}): {what} ({share:.2}) by {by:+.4} +- {error:.4}",
        look.e_value,
        changed.first.1,
        changed.between.0 + 1,
        changed.between.1 + 1
    );
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let small = examples::small();
    let run = || {
        false_alarms(if small { 20 } else { 1000 })?;
        delays(if small { 10 } else { 200 })?;
        a_finger_that_softens_at_noon()
    };
    run().map_err(|error: Box<dyn std::error::Error + Send + Sync>| error.to_string())?;
    Ok(())
}
