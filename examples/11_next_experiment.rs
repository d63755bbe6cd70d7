//! A robot does what the tool proposes: a bottle with something hidden about it, tilted on the simulated wrist until the tool is
//! sure, against random actions and an even grid of them.
//!
//! `cargo run --release -p examples --example 11_next_experiment` (50 worlds; `--small`: 1, of two experiments at most)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use std::error::Error;
use std::f64::consts::PI;
use std::fmt::Write as _;

use hw_traits::programme::{TiltProgramme, run};
use liquid_haptics::fake::{AXIA80, FakeWrist, Load, Round};
use liquid_haptics::wrench::{PlanarWrench, world_from_body};
use missing_physics::diagnosis::Diagnosis;
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use rand::{RngExt as _, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

const GRAVITY: f64 = 9.80665;
const WATER: f64 = 997.0;
const RADIUS_M: f64 = 0.035;
const LENGTH_M: f64 = 0.172;
const BOTTLE_KG: f64 = 0.085;
const GRIPPER_KG: f64 = 0.9;
const GRASP_M: f64 = 0.75 * LENGTH_M;
/// Experiments after which a rig gives up.
fn patience() -> usize {
    if examples::small() { 2 } else { 8 }
}

/// How sure is sure.
const SURE: f64 = 0.95;

/// What may be hidden, and what the bottle is then like.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Hidden {
    Wall(f64),
    Gain(f64),
    Grasp(f64),
    Cap(f64),
}

impl Hidden {
    fn draw(rng: &mut ChaCha8Rng) -> Self {
        let size = rng.random_range(0.6..1.6);
        let sign = if rng.random::<bool>() { 1.0 } else { -1.0 };
        match rng.random_range(0..4) {
            0 => Self::Wall(0.0008 * size),
            1 => Self::Gain(0.02 * sign * size),
            2 => Self::Grasp(0.002 * sign * size),
            _ => Self::Cap(0.01 * size),
        }
    }

    fn id(self) -> &'static str {
        match self {
            Self::Wall(_) => "wall-thickness",
            Self::Gain(_) => "force-gain",
            Self::Grasp(_) => "grasp-offset",
            Self::Cap(_) => "cap-mass",
        }
    }
}

/// A tilt through a range of angles with an amount of water.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Action {
    from_rad: f64,
    to_rad: f64,
    volume_m3: f64,
}

/// What the rig can do; the tool proposes out of the like.
fn grid() -> Vec<Action> {
    let capacity = PI * RADIUS_M * RADIUS_M * LENGTH_M;
    let whole = [0.0, 0.1, 0.25, 0.5, 0.75, 0.9];
    let mut all: Vec<Action> =
        whole.iter().map(|share| Action { from_rad: 0.0, to_rad: PI, volume_m3: share * capacity }).collect();
    for (from_rad, to_rad) in [(0.0, 0.5 * PI), (0.5 * PI, PI)] {
        all.push(Action { from_rad, to_rad, volume_m3: 0.5 * capacity });
    }
    all
}

/// Rows of the recording of one action, done on the wrist through its traits.
fn act(action: Action, hidden: Hidden, label: usize, seed: u64) -> Outcome<String> {
    let wall = if let Hidden::Wall(wall) = hidden { wall } else { 0.0 };
    let (radius_m, length_m) = (RADIUS_M - wall, LENGTH_M - 2.0 * wall);
    let load = Load {
        cavity: Box::new(Round::new(radius_m, length_m, wall, 300)),
        radius_m,
        length_m,
        liquid_mass_kg: WATER * action.volume_m3,
        volume_m3: action.volume_m3,
        viscosity_m2_s: 1e-6,
        container_mass_kg: BOTTLE_KG,
        gripper_mass_kg: GRIPPER_KG,
        grasp_height_m: GRASP_M + if let Hidden::Grasp(offset) = hidden { offset } else { 0.0 },
        shell_center_m: 0.5 * LENGTH_M + if let Hidden::Cap(shift) = hidden { shift } else { 0.0 },
        force_gain: if let Hidden::Gain(gain) = hidden { gain } else { 0.0 },
        gravity_m_s2: GRAVITY,
    };
    let mut wrist = FakeWrist::new(load, AXIA80, seed).map_err(|e| e.to_string())?;
    const POSES: usize = 13;
    let angle =
        |k: usize| action.from_rad + (action.to_rad - action.from_rad) * k as f64 / (POSES - 1) as f64;
    let programme = TiltProgramme {
        angles_rad: (0..POSES).map(angle).collect(),
        rate_rad_s: 0.3,
        settle_s: 20.0,
        patience_s: 20.0,
        readings: 2000,
    };
    let mut rows = String::new();
    for pose in run(&mut wrist, &programme)? {
        let wrench = PlanarWrench::from(&world_from_body(&pose.wrench, pose.angle_rad));
        let PlanarWrench { fx_n, fy_n, tau_z_nm } = wrench;
        let tilt = pose.angle_rad.clamp(0.0, PI);
        writeln!(rows, "{label},{tilt:.6},{fx_n:.5},{fy_n:.5},{tau_z_nm:.6},{:.7}", action.volume_m3)?;
    }
    Ok(rows)
}

fn ask(rows: &str, seed: u64) -> Outcome<Diagnosis> {
    let folder = tempfile::tempdir()?;
    let header = format!(
        "format = 1\ndomain = \"liquid-tilt\"\ndata = \"data.csv\"\n\n[rig]\ncontainer = {{ shape = \"cylinder\", radius_m = {RADIUS_M}, \
         length_m = {LENGTH_M} }}\ncontainer_mass_kg = {BOTTLE_KG}\ngripper_mass_kg = {GRIPPER_KG}\ngrasp_height_m = {GRASP_M}\n\
         gravity_m_s2 = {GRAVITY}\n"
    );
    std::fs::write(folder.path().join("recording.toml"), header)?;
    std::fs::write(
        folder.path().join("data.csv"),
        format!("run,theta_rad,fx_n,fy_n,tau_z_nm,volume_m3\n{rows}"),
    )?;
    let (_, loaded) = missing_physics_cli::domains::load(folder.path()).map_err(|e| e.to_string())?;
    let options = Options { seed, replicates: 199, ..Options::default() };
    Ok(diagnose(&*loaded.model, &loaded.recording, &loaded.experiments, &options, &Silent)?)
}

/// How probable the tool thinks that what is hidden is at work.
fn belief(answer: &Diagnosis, hidden: Hidden) -> f64 {
    answer.mechanisms.iter().find(|m| m.id == hidden.id()).map_or(0.0, |m| m.probability)
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Policy {
    Proposed,
    Random,
    Grid,
}

/// The action that the tool proposes, if it does.
fn proposed(answer: &Diagnosis) -> Option<Action> {
    let next = answer.next_experiment.as_ref()?;
    let value = |name: &str| next.action.iter().find(|(n, _)| n == name).map(|(_, v)| *v);
    Some(Action {
        from_rad: value("from_rad").unwrap_or(0.0),
        to_rad: value("theta_rad").unwrap_or(PI),
        volume_m3: value("volume_m3")?,
    })
}

/// Experiments beyond the first until the tool is sure of the truth ([`patience`] where it never was), and the first verdict.
fn experiments(policy: Policy, seed: u64, told: bool) -> Outcome<(usize, &'static str)> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let hidden = Hidden::draw(&mut rng);
    let all = grid();
    let first = Action { from_rad: 0.0, to_rad: 0.25 * PI, volume_m3: all[2].volume_m3 };
    let mut rows = act(first, hidden, 1, seed)?;
    let mut answer = ask(&rows, seed)?;
    let verdict = answer.verdict.word();
    for n in 0..patience() {
        if told {
            println!("  {}, P({}) = {:.2}", answer.verdict.word(), hidden.id(), belief(&answer, hidden));
        }
        if belief(&answer, hidden) >= SURE {
            return Ok((n, verdict));
        }
        let any = all[rng.random_range(0..all.len())];
        let action = match policy {
            Policy::Proposed => proposed(&answer).unwrap_or(any),
            Policy::Random => any,
            Policy::Grid => all[n % all.len()],
        };
        if let Some(next) = answer.next_experiment.as_ref().filter(|_| told) {
            println!("  proposed: {}", next.words);
        }
        rows += &act(action, hidden, n + 2, seed ^ (n as u64 + 1) << 32)?;
        answer = ask(&rows, seed)?;
    }
    Ok((patience(), verdict))
}

fn main() -> Outcome<()> {
    let worlds = if examples::small() { 1 } else { 50 };
    println!("One world, step by step:");
    experiments(Policy::Proposed, 3, true)?;
    println!("\nExperiments beyond the first until P(what is hidden) >= {SURE}, {worlds} worlds:");
    println!("{:10} {:>6} {:>8} {:>6} {:>6}", "policy", "mean", "median", "most", "never");
    for policy in [Policy::Proposed, Policy::Random, Policy::Grid] {
        let found: Vec<(usize, &str)> = (0..worlds)
            .into_par_iter()
            .map(|seed| experiments(policy, 100 + seed, false))
            .collect::<Outcome<_>>()?;
        let mut counts: Vec<usize> = found.iter().map(|f| f.0).collect();
        counts.sort_unstable();
        let mean = counts.iter().sum::<usize>() as f64 / counts.len() as f64;
        let never = counts.iter().filter(|n| **n == patience()).count();
        let name = format!("{policy:?}").to_lowercase();
        println!(
            "{name:10} {mean:6.2} {:8} {:6} {never:6}",
            counts[counts.len() / 2],
            counts[counts.len() - 1]
        );
        if policy == Policy::Proposed {
            let first = |word: &str| found.iter().filter(|f| f.1 == word).count();
            println!(
                "           first answers: {} ambiguous, {} explained, {} adequate, {} unexplained",
                first("ambiguous"),
                first("explained"),
                first("adequate"),
                first("unexplained")
            );
        }
    }
    Ok(())
}
