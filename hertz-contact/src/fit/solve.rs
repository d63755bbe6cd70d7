//! The search: contact points within a modulus, weights around both, intervals at the end.

use super::interval::report;
use super::robust::weight;
use super::state::{State, parameters, rising_to};
use super::{Baseline, Curve, Fit, FitError, Loss, Noise, Range, Report};

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

pub(super) fn run(fit: &Fit, curves: &[Curve<'_>], work: &mut Workspace) -> Result<Report, FitError> {
    fit.check()?;
    if curves.is_empty() {
        return Err(FitError::Empty);
    }
    work.curves.resize_with(curves.len(), State::default);
    for (index, (curve, state)) in curves.iter().zip(&mut work.curves).enumerate() {
        state.load(fit, index, curve)?;
        state.step = state.ready.step(&mut work.room);
    }
    let mut settled = settle(fit, work)?;
    match fit.range {
        Range::All => {}
        Range::UpTo(depth_m) => {
            for _ in 0..4 {
                let mut moved = false;
                for (index, state) in work.curves.iter_mut().enumerate() {
                    moved |= state.cut(fit, index, depth_m / state.ready.span_m)?;
                }
                if !moved {
                    break;
                }
                settled = settle(fit, work)?;
            }
        }
        Range::Automatic => settled = shorten(fit, work)?,
    }
    Ok(report(fit, work, settled))
}

/// Shortens curves until their residuals have no trend.
fn shorten(fit: &Fit, work: &mut Workspace) -> Result<Settled, FitError> {
    let limit_m = fit
        .indenter
        .radius_m()
        .map_or(f64::INFINITY, |r| 0.1 * r)
        .min(fit.layer.map_or(f64::INFINITY, |(_, per_m)| 0.1 / per_m));
    let mut depths = Vec::with_capacity(work.curves.len());
    for (index, state) in work.curves.iter_mut().enumerate() {
        let depth = (0.5 - state.at).min(limit_m / state.ready.span_m);
        // A range so short that it has too few samples is an error of the data, not of the law.
        state.cut(fit, index, depth)?;
        depths.push((depth, depth));
    }
    let mut settled = settle(fit, work)?;
    for _ in 0..8 {
        let mut moved = false;
        for (index, (state, (whole, depth))) in work.curves.iter_mut().zip(&mut depths).enumerate() {
            let shorter = 0.8 * *depth;
            if state.trend() > 3.0 && shorter > 0.2 * *whole && state.in_contact(state.at + shorter) >= 20 {
                *depth = shorter;
                moved |= state.cut(fit, index, shorter)?;
            }
        }
        if !moved {
            break;
        }
        settled = settle(fit, work)?;
    }
    Ok(settled)
}

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

fn settle(fit: &Fit, work: &mut Workspace) -> Result<Settled, FitError> {
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
    let mut pairs = std::mem::take(&mut work.pairs);
    let mut modulus = best_modulus(fit, &mut work.curves);
    let mut settled = Settled { modulus, converged: false, inflation: 1.0, freedom: 1.0, widened: 1.0 };
    for round in 0..ROUNDS {
        let loss = if round < 3 && fit.loss == Loss::Tukey { Loss::Huber } else { fit.loss };
        let (mut used, mut influence, mut sum, mut slope, mut lag, mut lagged) =
            (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let mut before = 0.0;
        for state in &mut work.curves {
            state.residuals(fit, modulus * state.per_pa, &mut pairs);
            state.measure_noise(fit, round, &pairs, &mut work.room);
            let (s, ratio, cut) = (state.sigma, state.ratio, state.ready.cut);
            let (mut own_lag, mut own, mut last) = (0.0, 0.0, None);
            for (p, (e, contact)) in state.ready.samples.iter_mut().filter(|p| p.u <= cut).zip(&pairs) {
                let variance = s * s * (1.0 + (ratio * contact).powi(2));
                let u = e / variance.sqrt();
                let (w, derivative) = weight(loss, u);
                p.weight = p.known * w / variance;
                used += 1.0;
                influence += (w * u) * (w * u);
                sum += w;
                slope += derivative;
                own += (w * u) * (w * u);
                own_lag += last.map_or(0.0, |last: f64| last * w * u);
                last = Some(w * u);
            }
            state.autocorrelation = if own > 0.0 { own_lag / own } else { 0.0 };
            lag += own_lag;
            lagged += own;
            state.ready.renew(fit.baseline);
            if round == 1 {
                state.scan(fit);
            }
            before += state.at.abs();
        }
        let old: f64 = modulus;
        modulus = best_modulus(fit, &mut work.curves);
        let after: f64 = work.curves.iter().map(|s| s.at.abs()).sum();
        let count = work.curves.len() as f64;
        let free = used - 1.0 - count * (parameters(fit) - 1) as f64;
        let (mean, correlation) = (slope / used, if lagged > 0.0 { lag / lagged } else { 0.0 });
        settled.modulus = modulus;
        settled.freedom = free.max(1.0);
        settled.inflation = influence / settled.freedom * (sum / used) / (mean * mean).max(1e-3);
        settled.widened = if correlation > 2.0 / used.sqrt() {
            let r = correlation.min(0.98);
            ((1.0 + r) / (1.0 - r)).sqrt()
        } else {
            1.0
        };
        let still = (modulus - old).abs() <= 1e-6 * modulus.abs() && (after - before).abs() <= 1e-6 * count;
        let weights_move = fit.loss != Loss::Square || fit.noise == Noise::Proportional;
        if (still && round > 3) || (!weights_move && round > 1) {
            settled.converged = modulus.is_finite();
            break;
        }
    }
    work.pairs = pairs;
    for (curve, state) in work.curves.iter().enumerate() {
        let p = state.ready.project(fit, state.at, 1);
        let stiffness = modulus * state.per_pa;
        // A straight line is what drift looks like; under a cylinder it is what contact looks like.
        let line = fit.baseline != Baseline::Zero && fit.indenter.exponent() != 1.0;
        let rest = if line { state.ready.rest_of_line() } else { p.rest };
        let improvement = rest - p.misfit(stiffness);
        let needed = SEEN * settled.inflation.max(1.0) * settled.widened.powi(2);
        if !(improvement > needed && stiffness > 0.0) {
            return Err(FitError::NoContact { curve, improvement });
        }
    }
    Ok(settled)
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
