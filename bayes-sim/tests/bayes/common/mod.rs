//! What the tests share: tasks of the benchmark sbibm with their simulators, and its reference posteriors.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, says what it saw, and does not use all of this"
)]

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};
use std::io::Read;
use std::path::PathBuf;

pub(crate) mod references;
pub(crate) mod simulators;

use bayes_sim::points::Points;
use bayes_sim::prior::{Marginal, Prior};
use bayes_sim::simulations::Simulations;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// One of the benchmark's tasks (Lueckmann et al. 2021, PMLR 130:343).
pub(crate) struct Task {
    pub(crate) name: &'static str,
    pub(crate) prior: Prior,
    pub(crate) x_dim: usize,
    pub(crate) simulate: fn(&[f64], &mut ChaCha8Rng) -> Vec<f64>,
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Mean of a Gaussian, under a Gaussian prior.
pub(crate) fn gaussian_linear() -> Task {
    let prior = Prior::new(vec![Marginal::Normal { mean: 0.0, sd: 0.1_f64.sqrt() }; 10]).unwrap();
    Task { name: "gaussian_linear", prior, x_dim: 10, simulate: gaussian_noise }
}

/// The same under a flat prior; its posterior is exact in [`references`].
pub(crate) fn gaussian_linear_uniform() -> Task {
    let prior = Prior::uniform(&[[-1.0, 1.0]; 10]).unwrap();
    Task { name: "gaussian_linear_uniform", prior, x_dim: 10, simulate: gaussian_noise }
}

fn gaussian_noise(theta: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
    theta.iter().map(|t| t + 0.1_f64.sqrt() * normal(rng)).collect()
}

/// A wide and a narrow Gaussian about the same mean; its posterior is exact in [`references`].
pub(crate) fn gaussian_mixture() -> Task {
    let simulate = |theta: &[f64], rng: &mut ChaCha8Rng| {
        let sd = if rng.random::<bool>() { 1.0 } else { 0.1 };
        theta.iter().map(|t| t + sd * normal(rng)).collect()
    };
    let prior = Prior::uniform(&[[-10.0, 10.0]; 2]).unwrap();
    Task { name: "gaussian_mixture", prior, x_dim: 2, simulate }
}

/// Two crescents.
pub(crate) fn two_moons() -> Task {
    let simulate = |theta: &[f64], rng: &mut ChaCha8Rng| {
        let a = rng.random_range(-FRAC_PI_2..FRAC_PI_2);
        let r = 0.1 + 0.01 * normal(rng);
        let (t0, t1) = (theta[0], theta[1]);
        vec![r * a.cos() + 0.25 - (t0 + t1).abs() * FRAC_1_SQRT_2, r * a.sin() + (t1 - t0) * FRAC_1_SQRT_2]
    };
    Task { name: "two_moons", prior: Prior::uniform(&[[-1.0, 1.0]; 2]).unwrap(), x_dim: 2, simulate }
}

/// Simple likelihood, complex posterior: four draws of a Gaussian whose covariance is asked for as well.
pub(crate) fn slcp() -> Task {
    let simulate = |theta: &[f64], rng: &mut ChaCha8Rng| {
        let (s1, s2, rho) = (theta[2].powi(2), theta[3].powi(2), theta[4].tanh());
        let (a, b, c) = (s1 * s1 + 1e-6, rho * s1 * s2, s2 * s2 + 1e-6);
        let l11 = a.sqrt();
        let l21 = b / l11;
        let l22 = (c - l21 * l21).max(0.0).sqrt();
        let mut x = Vec::with_capacity(8);
        for _ in 0..4 {
            let (z1, z2) = (normal(rng), normal(rng));
            x.extend([theta[0] + l11 * z1, theta[1] + l21 * z1 + l22 * z2]);
        }
        x
    };
    Task { name: "slcp", prior: Prior::uniform(&[[-3.0, 3.0]; 5]).unwrap(), x_dim: 8, simulate }
}

impl Task {
    pub(crate) fn simulate(&self, theta: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
        (self.simulate)(theta, rng)
    }

    /// `count` draws of the prior, each simulated.
    pub(crate) fn simulations(&self, count: usize, seed: u64) -> Simulations {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (mut theta, mut x) = (Points::new(self.prior.dim()), Points::new(self.x_dim));
        for _ in 0..count {
            let t = self.prior.sample(&mut rng);
            x.push(&self.simulate(&t, &mut rng)).unwrap();
            theta.push(&t).unwrap();
        }
        Simulations::new(theta, x).unwrap()
    }
}

/// Observation `i`, from 1, and the first `count` points of its reference posterior. As many of `two_moons` as the tests take lie beside
/// them; the rest lies beside the workspace, and it is an error where it does not.
pub(crate) fn reference(task: &Task, i: usize, count: usize) -> std::io::Result<(Vec<f64>, Points)> {
    let kept_task = match task.name {
        "gaussian_linear" | "two_moons" | "slcp" => task.name,
        // What is added says nothing about the parameters: the same posterior.
        "slcp_distractors" => "slcp",
        _ => return Ok(references::simulated(task, i as u64, count)),
    };
    let beside = match (kept_task, i) {
        ("two_moons", 1) => count <= 4000,
        ("two_moons", 2) => count <= 2000,
        _ => false,
    };
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../bayes-sim")
        .join(if beside { "tests/bayes/data" } else { "../../shared/sbibm" })
        .join(format!("{kept_task}/num_observation_{i}"));
    let open = |name: &str| {
        let path = folder.join(name);
        let said = |e: std::io::Error| std::io::Error::new(e.kind(), format!("{}: {e}", path.display()));
        std::fs::File::open(&path).map_err(said)
    };
    let (mut observation, mut text) = (String::new(), String::new());
    open("observation.csv")?.read_to_string(&mut observation)?;
    let packed = open("reference_posterior_samples.csv.bz2")?;
    bzip2::read::BzDecoder::new(packed).read_to_string(&mut text)?;
    let row = |line: &str| line.split(',').map(|v| v.trim().parse().unwrap()).collect::<Vec<f64>>();
    let rows: Vec<Vec<f64>> = text.lines().skip(1).take(count).map(row).collect();
    let points = Points::from_rows(task.prior.dim(), rows.iter().map(Vec::as_slice)).unwrap();
    let mut x = row(observation.lines().nth(1).unwrap());
    if kept_task != task.name {
        x = simulators::distracted(x, &mut ChaCha8Rng::seed_from_u64(i as u64));
    }
    Ok((x, points))
}

/// A generator behind the trait object that densities take.
pub(crate) fn dice(seed: u64) -> impl Rng {
    ChaCha8Rng::seed_from_u64(seed)
}
