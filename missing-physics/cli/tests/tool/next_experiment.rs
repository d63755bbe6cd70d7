//! What is proposed where two mechanisms explain a recording, done.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::fmt::Write as _;

use missing_physics::diagnosis::Diagnosis;
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use missing_physics_domains::Loaded;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};
use worlds::physics::indentation::{Effects, IndentationWorld, Indenter, Step};
use worlds::physics::slosh::{SloshWorld, Start};

fn load(header: &str, data: &str) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("recording.toml"), header).unwrap();
    std::fs::write(folder.path().join("data.csv"), data).unwrap();
    missing_physics_domains::load(folder.path()).unwrap().1
}

/// Curves of a ball on a soft body, each from a depth to another.
fn ask(effects: Effects, curves: &[[f64; 2]], seed: u64) -> Diagnosis {
    const ROWS: usize = 40;
    let step = |[from, to]: [f64; 2], row: usize| {
        let share = row as f64 / (ROWS - 1) as f64;
        Step { delta_m: from + share * (to - from), t_s: share, down: true }
    };
    let world = IndentationWorld {
        indenter: Indenter::Sphere(0.01),
        poisson_ratio: 0.5,
        moduli_pa: vec![2e4],
        runs: curves.iter().map(|&curve| (0, (0..ROWS).map(|row| step(curve, row)).collect())).collect(),
        effects,
    };
    let (mut rng, noise) = (ChaCha8Rng::seed_from_u64(seed), Normal::new(0.0, 1e-3).unwrap());
    let mut data = "run,delta_m,force_n,t_s,segment\n".to_owned();
    let steps =
        world.runs.iter().enumerate().flat_map(|(run, (_, steps))| steps.iter().map(move |s| (run, s)));
    for ((run, step), force) in steps.zip(world.readings()) {
        let force = force + noise.sample(&mut rng);
        writeln!(data, "{run},{:.7},{force:.6},{:.4},load", step.delta_m, step.t_s).unwrap();
    }
    let header = "format = 1\ndomain = \"indentation\"\ndata = \"data.csv\"\n\n[rig]\n\
                  indenter = { shape = \"sphere\", radius_m = 0.01 }\npoisson_ratio = 0.5\n";
    let loaded = load(header, &data);
    let options = Options { replicates: 199, ..Options::default() };
    diagnose(&*loaded.model, &loaded.recording, &loaded.experiments, &options, &Silent).unwrap()
}

/// A faint constant force looks like adhesion wherever there is contact; above the contact only the sensor's own offset is felt.
#[test]
fn an_offset_that_looks_like_adhesion_is_looked_for_above_the_contact() {
    let effects = Effects { force_offset_n: -1.5e-3, ..Effects::default() };
    let first = [[0.0, 1e-3]; 3];
    let unsure = (0..20)
        .map(|seed| (seed, ask(effects, &first, seed)))
        .find(|(_, answer)| answer.verdict.word() == "ambiguous");
    let (seed, answer) = unsure.unwrap();
    let next = answer.next_experiment.unwrap();
    let value = |name: &str| next.action.iter().find(|(n, _)| n == name).map(|(_, value)| *value);
    let [from, to] = [value("from_m").unwrap(), value("delta_m").unwrap()];
    assert!(from < 0.0 && to > 0.0, "{}", next.words);
    let curves = [first, [[from, to]; 3]].concat();
    assert_eq!(ask(effects, &curves, seed).chosen, ["force-offset"]);
}

/// What is proposed of a wave says how high it is to begin, in the reading's unit, and how long it is to be recorded.
#[test]
fn a_proposed_swing_says_how_high_and_how_long() {
    let (radius_m, volume_m3, mass_kg) = (0.04, 4e-4, 0.4);
    let world = SloshWorld {
        radius_m,
        mass_kg,
        volume_m3,
        viscosity_m2_s: 1e-6,
        starts: vec![Start::wave(0.02, 0.5)],
        rows: 121,
        rate_hz: 40.0,
        effects: worlds::physics::slosh::Effects::default(),
    };
    let mut data = "run,t_s,tau_z_nm\n".to_owned();
    for (row, torque_nm) in world.readings().iter().enumerate() {
        writeln!(data, "1,{:.4},{torque_nm:.7}", row as f64 / world.rate_hz).unwrap();
    }
    let header = format!(
        "format = 1\ndomain = \"slosh\"\ndata = \"data.csv\"\n\n[rig]\ncontainer = {{ shape = \"cylinder\", \
         radius_m = {radius_m} }}\nliquid_mass_kg = {mass_kg}\nvolume_m3 = {volume_m3}\n"
    );
    let loaded = load(&header, &data);
    let mut heights = Vec::new();
    for experiment in &loaded.experiments {
        let value = |name: &str| experiment.action.iter().find(|(n, _)| n == name).map(|(_, value)| *value);
        let (Some(height), Some(duration)) = (value("amplitude_nm"), value("duration_s")) else { continue };
        heights.push(height);
        assert_eq!(experiment.nuisance[0].iter().copied().fold(0.0, f64::max), height);
        let last = experiment.runs[0].inputs[0].last().unwrap();
        assert!((last - duration).abs() < 1.5 / world.rate_hz, "{last} s, and not {duration} s");
    }
    for share in [0.25, 4.0] {
        assert!(heights.iter().any(|h| (h / (share * 0.02) - 1.0).abs() < 0.02), "{heights:?}");
    }
}
