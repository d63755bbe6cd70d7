//! A robot's dough is not the one that it learned: the tool says what has changed, the model is repaired with it, and the controller
//! wastes less. The rolls are those of the fake, which is no polynomial; the tool sees the files alone.
//!
//! `cargo run --release -p examples --example 12_dough_story` (`--small`: fewer doughs and rollouts)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use std::error::Error;
use std::fmt::Write as _;

use dough_mbrl::band::Band;
use dough_mbrl::fake::{DoughKind, Effects, FakeRig};
use dough_mbrl::mpc::{Mpc, MpcSettings};
use dough_mbrl::objective::Worth;
use dough_mbrl::policy::Policy;
use dough_mbrl::powell::PowellPlanner;
use dough_mbrl::predictor::Refit;
use dough_mbrl::repair::{Repaired, Response};
use dough_mbrl::ridge::Ridge;
use dough_mbrl::rollout::{End, Rolled, RolloutError, Setup};
use examples::dough::{explore, mean_and_half, rollouts, rolls};
use missing_physics::diagnosis::Diagnosis;
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

const NONE: Effects =
    Effects { drying_per_s: 0.0, slip_n: 0.0, springback: 0.0, sticking: 0.0, softening: 0.0 };
const INCH_M: f64 = 0.0254;

/// Random rolls on each dough.
const EACH: usize = 16;
/// Doughs that a person puts down before giving up.
const PATIENCE: u64 = 8;

/// Doughs rolled at random, each on a rig of its own.
fn doughs(kind: DoughKind, count: u64, seed: u64) -> Outcome<Vec<Vec<Rolled>>> {
    let each: Vec<Vec<Vec<Rolled>>> = (0..count)
        .into_par_iter()
        .map(|k| explore(kind, NONE, EACH, 1000 * seed + k))
        .collect::<Result<_, _>>()?;
    Ok(each.into_iter().flatten().collect())
}

/// The band's force on a rigid probe of 30 mm, as the format writes it: by least squares on force over depth.
fn band() -> Outcome<Band> {
    let mut rig = FakeRig::new(DoughKind::A, NONE, 1).with_rigid_probe(0.03);
    let handling = Setup::of(rig.camera_in_world()).handling;
    let (mut rows, mut stiffness) = (Vec::new(), Vec::new());
    let throw0_m = Band::default().throw0_m;
    for throw_mm in (40..=120).step_by(10) {
        handling.stretch(&mut rig, 1e-3 * f64::from(throw_mm))?;
        for depth_mm in (5..=29).step_by(4) {
            let depth_m = 1e-3 * f64::from(depth_mm);
            handling.go(&mut rig, [0.4, 0.0, 0.03 - depth_m], 0.1)?;
            rows.extend([1.0, 1e-3 * f64::from(throw_mm) - throw0_m, depth_m]);
            stiffness.push(rig.probe_force_n() / depth_m);
            handling.go(&mut rig, [0.4, 0.0, 0.1], 0.3)?;
        }
    }
    let design = DMatrix::from_row_slice(stiffness.len(), 3, &rows);
    let found = design.svd(true, true).solve(&DVector::from_vec(stiffness), 1e-12)?;
    Ok(Band { k0_n_m: found[0], k1_n_m2: found[1], throw0_m, k2_per_m: (found[2] / found[0]).max(0.0) })
}

/// Doughs as a table of the format; times are since each was made.
fn table(doughs: &[Vec<Rolled>]) -> Outcome<String> {
    let mut text = String::from(
        "run,step,length_m,width_m,height_m,throw_m,depth_m,next_length_m,next_width_m,next_height_m,t_s\n",
    );
    for (run, dough) in doughs.iter().enumerate() {
        let made_s = dough.first().map_or(0.0, |r| r.t_s);
        for (step, rolled) in dough.iter().enumerate() {
            write!(text, "{},{}", run + 1, step + 1)?;
            let roll = rolled.roll;
            for value in roll.state.iter().chain(&roll.action).chain(&roll.next) {
                write!(text, ",{value:.5}")?;
            }
            writeln!(text, ",{:.2}", rolled.t_s - made_s)?;
        }
    }
    Ok(text)
}

/// What the tool says of a recording.
fn ask(band: &Band, training: &[Vec<Rolled>], doughs: &[Vec<Rolled>], seed: u64) -> Outcome<Diagnosis> {
    let folder = tempfile::tempdir()?;
    let Band { k0_n_m, k1_n_m2, throw0_m, k2_per_m } = *band;
    let header = format!(
        "format = 1\ndomain = \"dough-roll\"\ndata = \"data.csv\"\n\n[rig]\ntraining = \"training.csv\"\n\
         band = {{ k0_n_m = {k0_n_m:?}, k1_n_m2 = {k1_n_m2:?}, throw0_m = {throw0_m:?}, k2_per_m = {k2_per_m:?} }}\n"
    );
    std::fs::write(folder.path().join("recording.toml"), header)?;
    std::fs::write(folder.path().join("training.csv"), table(training)?)?;
    std::fs::write(folder.path().join("data.csv"), table(doughs)?)?;
    let (_, loaded) = missing_physics_cli::domains::load(folder.path()).map_err(|e| e.to_string())?;
    let options = Options { seed, replicates: 199, ..Options::default() };
    Ok(diagnose(&*loaded.model, &loaded.recording, &loaded.experiments, &options, &Silent)?)
}

fn told(answer: &Diagnosis) -> String {
    let mut text = format!("{} (p {:.3})", answer.verdict.word(), answer.p_value);
    if !answer.chosen.is_empty() {
        write!(text, ": {}", answer.chosen.join(" + ")).ok();
    }
    for set in &answer.confused_with {
        write!(text, " or {}", set.join(" + ")).ok();
    }
    for mechanism in answer.mechanisms.iter().filter(|m| answer.chosen.contains(&m.id)) {
        for p in &mechanism.parameters {
            write!(text, "; {} {:.4} [{:.4}, {:.4}]", p.name, p.value, p.ci95[0], p.ci95[1]).ok();
        }
    }
    text
}

/// What the controller can use of an answer.
fn response(answer: &Diagnosis, band: Band) -> Response {
    let value = |id: &str| {
        let chosen = answer.mechanisms.iter().find(|m| m.id == id && answer.chosen.contains(&m.id));
        chosen.and_then(|m| m.parameters.first()).map(|p| p.value)
    };
    let factor = value("stiffness-change").unwrap_or(1.0);
    Response { factor, slip_n: value("slip").unwrap_or(0.0), band }
}

fn main() -> Outcome<()> {
    let small = examples::small();
    let (trained, tried, each, nulls) = if small { (10, 6, 6, 2) } else { (20, 10, 20, 20) };
    let band = band()?;
    let training = doughs(DoughKind::C, trained, 1)?;
    let model = Ridge::learn(&rolls(&training), 2, 1e-3)?;
    println!("learned from {trained} doughs of the stiff kind (C), {EACH} random rolls each");
    println!("\nnothing hidden: other doughs of the same kind, {nulls} times");
    let answers: Vec<String> = (0..nulls)
        .into_par_iter()
        .map(|s| Ok(told(&ask(&band, &training, &doughs(DoughKind::C, tried, 50 + s)?, s)?)))
        .collect::<Outcome<_>>()?;
    answers.iter().for_each(|a| println!("  {a}"));
    let quiet = answers.iter().filter(|a| a.starts_with("adequate")).count();
    println!("  {quiet} of {nulls} adequate");

    println!("\nhidden: today's {tried} doughs are of the soft kind (A)");
    let answer = ask(&band, &training, &doughs(DoughKind::A, tried, 7)?, 1)?;
    println!("  {}", told(&answer));
    let response = response(&answer, band);
    println!("  repaired with: factor {:.3}, slip below {:.3} N", response.factor, response.slip_n);
    let repaired = Repaired::new(model.clone(), response)?;
    println!(
        "\nrolls until a dough of the soft kind is at its goal, spoiled doughs' rolls included; {each} times,"
    );
    println!(
        "mean +- half the 95 % interval; H = 5, Powell, no refits (no success in {PATIENCE} doughs: all their rolls count)"
    );
    for inches in if small { vec![6.0] } else { vec![4.0, 6.0, 8.0] } {
        println!("  to {inches} in, as learned: {}", run(inches, each, &model)?);
        println!("  to {inches} in, repaired:   {}", run(inches, each, &repaired)?);
    }
    Ok(())
}

/// Rolls until a dough is at its goal, several times.
fn run<M: Refit + Clone + Sync + 'static>(inches: f64, each: u64, model: &M) -> Outcome<String> {
    let controller = |_| -> Result<Box<dyn Policy>, RolloutError> {
        let worth = Worth { horizon: 5, ..Worth::default() };
        let settings = MpcSettings { worth, refit_every: None, ..MpcSettings::default() };
        Ok(Box::new(Mpc::new(model.clone(), PowellPlanner::default(), settings)?))
    };
    let seeds = 400..400 + each * PATIENCE;
    let done = rollouts(DoughKind::A, NONE, inches * INCH_M, seeds, &controller)?;
    let (mut needed, mut spoiled, mut never) = (Vec::new(), 0, 0);
    for tries in done.chunks(PATIENCE as usize) {
        let good = tries.iter().position(|r| r.end == End::Reached);
        let used = good.map_or(tries.len(), |k| k + 1);
        needed.push(tries[..used].iter().map(|r| r.rolls.len() as f64).sum::<f64>());
        spoiled += good.unwrap_or(tries.len());
        never += usize::from(good.is_none());
    }
    let (mean, half) = mean_and_half(&needed);
    Ok(format!("{mean:5.1} +- {half:.1} rolls, {spoiled} doughs spoiled, {never} times none in all"))
}
