//! Random numbers that makers draw.

use rand::Rng;
use rand_distr::{Distribution, Uniform};

use crate::noise::Noise;

/// A number between two.
pub(crate) fn between(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    Uniform::new_inclusive(low, high).map_or(low, |u| u.sample(rng))
}

/// A number between two above zero, evenly on a log scale.
pub(crate) fn log_between(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    between(rng, low.ln(), high.ln()).exp()
}

/// One or the other sign.
pub(crate) fn sign(rng: &mut impl Rng) -> f64 {
    if rng.next_u32() & 1 == 0 { 1.0 } else { -1.0 }
}

/// A whole number from `low` to `high`.
pub(crate) fn whole(rng: &mut impl Rng, low: usize, high: usize) -> usize {
    low + (rng.next_u64() % (high - low + 1) as u64) as usize
}

/// `count` different numbers below `of`, rising.
pub(crate) fn choose(rng: &mut impl Rng, of: usize, count: usize) -> Vec<usize> {
    let mut all: Vec<usize> = (0..of).collect();
    let mut chosen: Vec<usize> =
        (0..count.min(of)).map(|_| all.swap_remove(whole(rng, 0, all.len() - 1))).collect();
    chosen.sort_unstable();
    chosen
}

/// How strong an effect is to be, in the sigmas of [`Key::strength`](super::Key::strength): from faint to strong.
pub(crate) fn strength(rng: &mut impl Rng) -> f64 {
    log_between(rng, 3.0, 150.0)
}

/// The strength of an effect beside which something smaller is still to be seen.
pub(crate) fn great_strength(rng: &mut impl Rng) -> f64 {
    log_between(rng, 40.0, 300.0)
}

/// One sigma of readings with their rounding, as a calibration finds it.
pub(crate) fn sigma(noise: &Noise) -> f64 {
    noise.sigma.hypot(noise.digit / 12f64.sqrt())
}

/// The sigma of readings as a header states it: 2 % off at most.
pub(crate) fn stated(rng: &mut impl Rng, noise: &Noise) -> f64 {
    sigma(noise) * between(rng, 0.98, 1.02)
}

/// Noise of the given sigma, as sensors have it: white, or correlated from row to row, or rounded to a coarse digit.
pub(crate) fn noise(rng: &mut impl Rng, sigma: f64) -> Noise {
    let white = Noise::white(sigma);
    match whole(rng, 0, 3) {
        0 => Noise { correlation: between(rng, 0.2, 0.7), ..white },
        1 => Noise { digit: sigma * between(rng, 0.5, 2.0), ..white },
        _ => white,
    }
}
