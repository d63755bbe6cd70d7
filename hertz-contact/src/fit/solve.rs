//! The search: contact points within a modulus, weights around both.

use super::robust::weight;
use super::settings::{Baseline, Fit, FitError, Loss, Noise};
use super::state::{State, parameters, rising_to};

/// Room for curves, to be used again.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    pub(super) curves: Vec<State>,
    /// Residuals with the contact's force.
    pairs: Vec<(f64, f64)>,
    pub(super) room: Vec<f64>,
}

impl Workspace {
    /// Empty; it grows to the largest fit.
    pub fn new() -> Self {
        Self::default()
    }
}

/// What a contact has to lower chi-squared by: five standard errors.
const SEEN: f64 = 25.0;
/// Rounds of weights.
const ROUNDS: usize = 30;

/// What the weights came to rest at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Settled {
    pub(super) modulus: f64,
    pub(super) converged: bool,
    /// Variance of weighted residuals over what their weights say.
    pub(super) inflation: f64,
    pub(super) freedom: f64,
    pub(super) widened: f64,
}

/// Sums over the weighted residuals of all curves.
#[derive(Debug, Clone, Copy, Default)]
struct Influence {
    /// Samples.
    used: f64,
    /// Squares of the residuals' influence `weight u`.
    squares: f64,
    weights: f64,
    /// Derivatives of the influence.
    slopes: f64,
    /// Products of the influences of neighbours.
    lagged: f64,
}

impl Influence {
    /// Weighs a curve's samples by their residuals.
    fn weigh(&mut self, state: &mut State, loss: Loss, pairs: &[(f64, f64)]) {
        let (s, ratio, cut) = (state.sigma, state.ratio, state.ready.cut);
        let (mut lagged, mut squares, mut last) = (0.0, 0.0, None);
        for (p, (e, contact)) in state.ready.samples.iter_mut().filter(|p| p.u <= cut).zip(pairs) {
            let variance = s * s * (1.0 + (ratio * contact).powi(2));
            let u = e / variance.sqrt();
            let (w, derivative) = weight(loss, u);
            p.weight = p.known * w / variance;
            self.used += 1.0;
            self.squares += (w * u) * (w * u);
            self.weights += w;
            self.slopes += derivative;
            squares += (w * u) * (w * u);
            lagged += last.map_or(0.0, |last: f64| last * w * u);
            last = Some(w * u);
        }
        state.autocorrelation = if squares > 0.0 { lagged / squares } else { 0.0 };
        self.lagged += lagged;
    }

    /// How sure a modulus is that settled with these residuals.
    fn settled(&self, fit: &Fit, curves: usize, modulus: f64) -> Settled {
        let free = self.used - 1.0 - curves as f64 * (parameters(fit) - 1) as f64;
        let freedom = free.max(1.0);
        let mean = self.slopes / self.used;
        let inflation = self.squares / freedom * (self.weights / self.used) / (mean * mean).max(1e-3);
        let correlation = if self.squares > 0.0 { self.lagged / self.squares } else { 0.0 };
        let widened = if correlation > 2.0 / self.used.sqrt() {
            let r = correlation.min(0.98);
            ((1.0 + r) / (1.0 - r)).sqrt()
        } else {
            1.0
        };
        Settled { modulus, converged: false, inflation, freedom, widened }
    }
}
/// Modulus, contact points and weights that agree with each other.
///
/// # Errors
/// [`FitError::NoContact`].
pub(super) fn settle(fit: &Fit, work: &mut Workspace) -> Result<Settled, FitError> {
    begin(fit, work);
    let mut pairs = std::mem::take(&mut work.pairs);
    let modulus = best_modulus(fit, &mut work.curves);
    let mut settled = Settled { modulus, converged: false, inflation: 1.0, freedom: 1.0, widened: 1.0 };
    let weights_move = fit.loss != Loss::Square || fit.noise == Noise::Proportional;
    for round in 0..ROUNDS {
        let old = settled.modulus;
        let mut influence = Influence::default();
        let loss = if round < 3 && fit.loss == Loss::Tukey { Loss::Huber } else { fit.loss };
        for state in &mut work.curves {
            state.residuals(fit, old * state.per_pa, &mut pairs);
            state.measure_noise(fit, round, &pairs, &mut work.room);
            influence.weigh(state, loss, &pairs);
            state.ready.renew(fit.baseline);
            if round == 1 {
                state.scan(fit);
            }
        }
        if !weights_move && work.curves.len() == 1 {
            // All weights have grown by one factor: what was best is best.
            settled = influence.settled(fit, work.curves.len(), modulus);
            settled.converged = modulus.is_finite();
            break;
        }
        let reach = |curves: &[State]| curves.iter().map(|s| s.at.abs()).sum::<f64>();
        let before = reach(&work.curves);
        let modulus = best_modulus(fit, &mut work.curves);
        settled = influence.settled(fit, work.curves.len(), modulus);
        let moved = (reach(&work.curves) - before).abs();
        let still = (modulus - old).abs() <= 1e-6 * modulus.abs() && moved <= 1e-6 * work.curves.len() as f64;
        if (still && round > 3) || (!weights_move && round > 1) {
            settled.converged = modulus.is_finite();
            break;
        }
    }
    work.pairs = pairs;
    check_contact(fit, &work.curves, &settled)?;
    Ok(settled)
}

/// First weights, without spikes, and first contact points.
fn begin(fit: &Fit, work: &mut Workspace) {
    for state in &mut work.curves {
        state.sigma = 0.0;
        for p in &mut state.ready.samples {
            p.weight = p.known;
        }
        if fit.loss != Loss::Square {
            state.despike(&mut work.room);
        }
        state.ready.renew(fit.baseline);
        state.scan(fit);
    }
}

/// Refuses curves that a contact explains hardly better than none does.
fn check_contact(fit: &Fit, curves: &[State], settled: &Settled) -> Result<(), FitError> {
    for (curve, state) in curves.iter().enumerate() {
        let p = state.ready.project(fit, state.at, 1);
        let stiffness = settled.modulus * state.per_pa;
        // A straight line is what drift looks like; under a cylinder it is what contact looks like.
        let line = fit.baseline != Baseline::Zero && fit.indenter.exponent() != 1.0;
        let rest = if line { state.ready.rest_of_line() } else { p.rest };
        let improvement = rest - p.misfit(stiffness);
        let needed = SEEN * settled.inflation.max(1.0) * settled.widened.powi(2);
        if !(improvement > needed && stiffness > 0.0) {
            return Err(FitError::NoContact { curve, improvement });
        }
    }
    Ok(())
}

/// The modulus in Pa with the smallest misfit over all curves; their contact points come along.
pub(super) fn best_modulus(fit: &Fit, curves: &mut [State]) -> f64 {
    let (mut low, mut high, mut sum, mut weight) = (f64::INFINITY, 0.0_f64, 0.0, 0.0);
    for state in curves.iter_mut() {
        let p = state.refine(fit, None);
        let (modulus, sharp) = (p.stiffness() / state.per_pa, p.curvature() * state.per_pa * state.per_pa);
        (low, high) = (low.min(modulus), high.max(modulus));
        sum += sharp * modulus;
        weight += sharp;
    }
    if curves.len() < 2 || !(high > low) {
        return high;
    }
    let start = if weight > 0.0 { sum / weight } else { 0.5 * (low + high) };
    let modulus = rising_to(1e-9 * high, |e| slope_over_modulus(fit, curves, e), low, high, start);
    slope_over_modulus(fit, curves, modulus);
    modulus
}

/// Derivative of the misfit with respect to the modulus, the contact points following, and the curvature.
fn slope_over_modulus(fit: &Fit, curves: &mut [State], modulus: f64) -> (f64, f64) {
    let (mut slope, mut curvature) = (0.0, 0.0);
    for state in curves {
        let k = modulus * state.per_pa;
        let p = state.refine(fit, Some(k));
        slope += 2.0 * (k * p.a - p.b) * state.per_pa;
        curvature += 2.0 * p.curvature() * state.per_pa * state.per_pa;
    }
    (slope, curvature)
}
