//! Reference posteriors of tasks that are shared without one: exact draws where there are some, else a long Metropolis chain on
//! the exact likelihood. Nothing of the crate is used but its tables.

use bayes_sim::points::Points;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::simulators::{design, infected, populations, smoothness};
use super::{Task, normal};

/// A simulated observation and draws of its posterior.
pub(crate) fn simulated(task: &Task, seed: u64, count: usize) -> (Vec<f64>, Points) {
    let mut rng = ChaCha8Rng::seed_from_u64(1_000_000 + seed);
    let theta = task.prior.sample(&mut rng);
    let x = task.simulate(&theta, &mut rng);
    let ln: Vec<f64> = theta.iter().map(|t| t.ln()).collect();
    let rows = match task.name {
        "bernoulli_glm" => metropolis(&theta, count, &mut rng, |t| glm(t, &DVector::from_column_slice(&x))),
        "bernoulli_glm_raw" => {
            let statistics = design().transpose() * DVector::from_column_slice(&x);
            metropolis(&theta, count, &mut rng, |t| glm(t, &statistics))
        }
        "sir" => exp(metropolis(&ln, count, &mut rng, |u| epidemic(u, &x))),
        "lotka_volterra" => exp(metropolis(&ln, count, &mut rng, |u| predation(u, &x))),
        _ => gaussian(task, &x, count, &mut rng),
    };
    let points = Points::from_rows(theta.len(), rows.iter().map(Vec::as_slice)).unwrap();
    (x, points)
}

fn exp(mut rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    rows.iter_mut().flatten().for_each(|u| *u = u.exp());
    rows
}

fn glm(theta: &[f64], statistics: &DVector<f64>) -> f64 {
    let theta = DVector::from_column_slice(theta);
    let silent: f64 = (design() * &theta).iter().map(|p| p.exp().ln_1p()).sum();
    theta.dot(statistics) - silent - 0.5 * theta.dot(&(smoothness_once() * &theta))
}

fn smoothness_once() -> &'static DMatrix<f64> {
    static ONCE: std::sync::OnceLock<DMatrix<f64>> = std::sync::OnceLock::new();
    ONCE.get_or_init(smoothness)
}

/// Log density of the logarithms of the parameters under log-normal priors.
fn ln_prior(u: &[f64], moments: &[[f64; 2]]) -> f64 {
    u.iter().zip(moments).map(|(u, [mean, sd])| -0.5 * ((u - mean) / sd).powi(2)).sum()
}

fn epidemic(u: &[f64], x: &[f64]) -> f64 {
    let shares = infected(&[u[0].exp(), u[1].exp()]);
    let seen = shares.iter().zip(x).map(|(p, n)| {
        let p = p.clamp(1e-12, 1.0 - 1e-12);
        n * p.ln() + (1000.0 - n) * (-p).ln_1p()
    });
    ln_prior(u, &[[0.4_f64.ln(), 0.5], [0.125_f64.ln(), 0.2]]) + seen.sum::<f64>()
}

fn predation(u: &[f64], x: &[f64]) -> f64 {
    let theta: Vec<f64> = u.iter().map(|u| u.exp()).collect();
    let seen = populations(&theta).into_iter().zip(x).map(|(ln, x)| -0.5 * ((x.ln() - ln) / 0.1).powi(2));
    ln_prior(u, &[[-0.125, 0.5], [-3.0, 0.5], [-0.125, 0.5], [-3.0, 0.5]]) + seen.sum::<f64>()
}

/// Random-walk Metropolis from `start`: steps from the covariance so far while it warms up, then one in `20 d` recorded.
fn metropolis(
    start: &[f64],
    count: usize,
    rng: &mut ChaCha8Rng,
    ln: impl Fn(&[f64]) -> f64,
) -> Vec<Vec<f64>> {
    let d = start.len();
    let (warm, thin) = (4000 * d, 20 * d);
    let mut at = DVector::from_column_slice(start);
    let mut here = ln(at.as_slice());
    let mut factor = DMatrix::identity(d, d) * 0.01;
    let (mut seen, mut chain) = (Vec::new(), Vec::new());
    for i in 0..warm + thin * count {
        if i < warm && i % (100 * d) == 0 && i > 0 {
            // The later half: the way from the start is no part of the covariance.
            let tail: &[DVector<f64>] = &seen[seen.len() / 2..];
            let mean = tail.iter().sum::<DVector<f64>>() / tail.len() as f64;
            let scatter: DMatrix<f64> = tail.iter().map(|v| (v - &mean) * (v - &mean).transpose()).sum();
            let covariance = scatter / tail.len() as f64 + DMatrix::identity(d, d) * 1e-10;
            factor = covariance.cholesky().unwrap().unpack() * (2.38 / (d as f64).sqrt());
        }
        let there = &at + &factor * DVector::from_fn(d, |_, _| normal(rng));
        let value = ln(there.as_slice());
        if value - here > rng.random::<f64>().ln() {
            (at, here) = (there, value);
        }
        if i < warm {
            seen.push(at.clone());
        } else if (i - warm) % thin == 0 {
            chain.push(at.as_slice().to_vec());
        }
    }
    chain
}

/// Gaussians cut to the prior's box, by rejection.
fn gaussian(task: &Task, x: &[f64], count: usize, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let is_mixture = task.name == "gaussian_mixture";
    let bound = if is_mixture { 10.0 } else { 1.0 };
    let draw = |rng: &mut ChaCha8Rng| -> Vec<f64> {
        let sd = match (is_mixture, rng.random::<bool>()) {
            (true, true) => 1.0,
            (true, false) => 0.1,
            (false, _) => 0.1_f64.sqrt(),
        };
        let near = |x: &f64, rng: &mut ChaCha8Rng| x + sd * normal(rng);
        let inside = |x: &f64, rng: &mut ChaCha8Rng| loop {
            let t = near(x, rng);
            if t.abs() <= bound {
                return t;
            }
        };
        x.iter().map(|x| if is_mixture { near(x, rng) } else { inside(x, rng) }).collect()
    };
    std::iter::repeat_with(|| draw(rng)).filter(|t| t.iter().all(|t| t.abs() <= bound)).take(count).collect()
}
