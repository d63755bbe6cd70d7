//! The benchmark's tasks that are shared as a paper only: simulators after its text, observations and stimuli of our own.

use std::sync::OnceLock;

use bayes_sim::prior::{Marginal, Prior};
use nalgebra::{DMatrix, DVector};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Binomial, ChiSquared, Distribution};

use super::{Task, normal, slcp};

/// Time steps of the spike train, and parameters: an offset and a filter of nine lags.
pub(crate) const STEPS: usize = 100;
pub(crate) const LAGS: usize = 9;

/// A column of ones and the stimulus at each lag, `STEPS x (LAGS + 1)`.
pub(crate) fn design() -> &'static DMatrix<f64> {
    static DESIGN: OnceLock<DMatrix<f64>> = OnceLock::new();
    DESIGN.get_or_init(|| {
        let mut rng = ChaCha8Rng::seed_from_u64(42);
        let stimulus: Vec<f64> = (0..STEPS).map(|_| normal(&mut rng)).collect();
        let at = |t: usize, j: usize| match j {
            0 => 1.0,
            _ if t + 1 >= j => stimulus[t + 1 - j],
            _ => 0.0,
        };
        DMatrix::from_fn(STEPS, LAGS + 1, at)
    })
}

/// Precision of the prior: second differences of the filter are small.
pub(crate) fn smoothness() -> DMatrix<f64> {
    let d = DMatrix::from_fn(LAGS, LAGS, |i, j| {
        if i == j {
            1.0
        } else if i == j + 1 {
            -1.0
        } else {
            0.0
        }
    });
    let rising =
        DMatrix::from_fn(LAGS, LAGS, |i, j| if i == j { (i as f64 / LAGS as f64).sqrt() } else { 0.0 });
    let f = &d * &d + rising;
    let mut precision = DMatrix::zeros(LAGS + 1, LAGS + 1);
    precision[(0, 0)] = 0.5;
    precision.view_mut((1, 1), (LAGS, LAGS)).copy_from(&(f.transpose() * f));
    precision
}

fn spikes(theta: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
    let psi = design() * DVector::from_column_slice(theta);
    psi.iter().map(|p| f64::from(u8::from(rng.random::<f64>() < 1.0 / (1.0 + (-p).exp())))).collect()
}

fn glm_prior() -> Prior {
    let covariance = smoothness().try_inverse().unwrap();
    Prior::gaussian(&DVector::zeros(LAGS + 1), &covariance).unwrap()
}

/// A spike train's generalised linear model, by its sufficient statistics.
pub(crate) fn bernoulli_glm() -> Task {
    let simulate = |theta: &[f64], rng: &mut ChaCha8Rng| {
        let statistics = design().transpose() * DVector::from_vec(spikes(theta, rng));
        statistics.iter().copied().collect()
    };
    Task { name: "bernoulli_glm", prior: glm_prior(), x_dim: LAGS + 1, simulate }
}

/// The same from the spikes themselves.
pub(crate) fn bernoulli_glm_raw() -> Task {
    Task { name: "bernoulli_glm_raw", prior: glm_prior(), x_dim: STEPS, simulate: spikes }
}

/// One step of the classical Runge-Kutta method.
fn step(y: [f64; 2], h: f64, rate: impl Fn([f64; 2]) -> [f64; 2]) -> [f64; 2] {
    let along = |k: [f64; 2], by: f64| [y[0] + by * k[0], y[1] + by * k[1]];
    let a = rate(y);
    let b = rate(along(a, 0.5 * h));
    let c = rate(along(b, 0.5 * h));
    let d = rate(along(c, h));
    std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
}

/// Share of the people infected every 17 days, from day 0.
pub(crate) fn infected(theta: &[f64]) -> Vec<f64> {
    let (beta, gamma) = (theta[0], theta[1]);
    let mut y = [1.0 - 1e-6, 1e-6];
    let mut out = vec![y[1]];
    for _ in 1..10 {
        for _ in 0..17 * 4 {
            y = step(y, 0.25, |[s, i]| [-beta * s * i, beta * s * i - gamma * i]);
        }
        out.push(y[1].clamp(0.0, 1.0));
    }
    out
}

/// An epidemic, seen by ten samples of a thousand people.
pub(crate) fn sir() -> Task {
    let simulate = |theta: &[f64], rng: &mut ChaCha8Rng| {
        infected(theta).into_iter().map(|p| Binomial::new(1000, p).unwrap().sample(rng) as f64).collect()
    };
    let marginal = |median: f64, sd: f64| Marginal::LogNormal { mean: median.ln(), sd };
    let prior = Prior::new(vec![marginal(0.4, 0.5), marginal(0.125, 0.2)]).unwrap();
    Task { name: "sir", prior, x_dim: 10, simulate }
}

/// Logarithms of prey at ten times, then of predators.
pub(crate) fn populations(theta: &[f64]) -> Vec<f64> {
    let &[alpha, beta, gamma, delta] = theta else { return Vec::new() };
    // Logarithms: both stay positive, and fast growth is smooth.
    let mut y = [30.0_f64.ln(), 0.0];
    let mut out = [[0.0; 2]; 10];
    for (i, at) in out.iter_mut().enumerate() {
        for _ in 0..if i == 0 { 0 } else { 210 } {
            y = step(y, 0.01, |[x, y]| [alpha - beta * y.exp(), -gamma + delta * x.exp()]);
        }
        *at = y.map(|v| v.clamp(1e-10_f64.ln(), 1e4_f64.ln()));
    }
    out.iter().map(|y| y[0]).chain(out.iter().map(|y| y[1])).collect()
}

/// Prey and predators, seen through factors of lognormal noise.
pub(crate) fn lotka_volterra() -> Task {
    let simulate = |theta: &[f64], rng: &mut ChaCha8Rng| {
        populations(theta).into_iter().map(|ln| (ln + 0.1 * normal(rng)).exp()).collect()
    };
    let marginal = |mean: f64| Marginal::LogNormal { mean, sd: 0.5 };
    let prior = Prior::new([-0.125, -3.0, -0.125, -3.0].map(marginal).to_vec()).unwrap();
    Task { name: "lotka_volterra", prior, x_dim: 20, simulate }
}

/// Numbers among `slcp_distractors` that say nothing.
const DISTRACTORS: usize = 92;

/// Centres and factors of twenty Student distributions, and the order in which numbers are given.
struct Noise {
    parts: Vec<(DVector<f64>, DMatrix<f64>)>,
    order: Vec<usize>,
}

fn noise() -> &'static Noise {
    static NOISE: OnceLock<Noise> = OnceLock::new();
    NOISE.get_or_init(|| {
        let mut rng = ChaCha8Rng::seed_from_u64(42);
        let part = |rng: &mut ChaCha8Rng| {
            let centre = DVector::from_fn(DISTRACTORS, |_, _| 15.0 * normal(rng));
            let factor = DMatrix::from_fn(DISTRACTORS, DISTRACTORS, |i, j| match i.cmp(&j) {
                std::cmp::Ordering::Less => 0.0,
                std::cmp::Ordering::Equal => 3.0 * (normal(rng) + normal(rng).exp()),
                std::cmp::Ordering::Greater => 3.0 * normal(rng),
            });
            (centre, factor)
        };
        let parts = (0..20).map(|_| part(&mut rng)).collect();
        let mut order: Vec<usize> = (0..8 + DISTRACTORS).collect();
        order.shuffle(&mut rng);
        Noise { parts, order }
    })
}

/// Numbers of slcp among others that say nothing, with tails of two degrees of freedom.
pub(crate) fn distracted(mut x: Vec<f64>, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let noise = noise();
    let (centre, factor) = &noise.parts[rng.random_range(0..noise.parts.len())];
    let white = DVector::from_fn(DISTRACTORS, |_, _| normal(rng));
    let chi_squared: f64 = ChiSquared::new(2.0).unwrap().sample(rng);
    let wide = 1.0 / (0.5 * chi_squared).sqrt();
    x.extend((factor * white * wide + centre).iter());
    noise.order.iter().map(|&i| x[i]).collect()
}

/// slcp with 92 numbers more.
pub(crate) fn slcp_distractors() -> Task {
    let simulate = |theta: &[f64], rng: &mut ChaCha8Rng| {
        let x = (slcp().simulate)(theta, rng);
        distracted(x, rng)
    };
    Task { name: "slcp_distractors", x_dim: 8 + DISTRACTORS, simulate, ..slcp() }
}
