//! What is reported, and how sure it is.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::curve::Shape;
use super::report::{CurveReport, Flags, Report, SampleCounts};
use super::settings::Fit;
use super::solve::{Settled, Workspace, best_modulus};
use super::state::{State, rising_to};
use crate::law::{Elastic, Law, Validity};

pub(super) fn report(fit: &Fit, work: &mut Workspace, settled: Settled) -> Report {
    let modulus = settled.modulus;
    // The level is between 0 and 1 and the degrees of freedom at least 1: the distribution exists.
    let t = StudentsT::new(0.0, 1.0, settled.freedom).map_or(2.0, |d| d.inverse_cdf(0.5 + 0.5 * fit.level));
    let room = t * t * settled.inflation * settled.widened * settled.widened;
    let points: Vec<f64> = work.curves.iter().map(|s| s.at).collect();
    let shift = rounding(fit, work, modulus, &points);
    let sharp: Vec<f64> =
        work.curves.iter().map(|s| s.ready.project(fit, s.at, 1).curvature() * s.per_pa * s.per_pa).collect();
    let total: f64 = sharp.iter().sum();
    let curves = work
        .curves
        .iter()
        .zip(&sharp)
        .map(|(s, own)| curve_report(fit, s, modulus, (total - own).max(0.0) / (s.per_pa * s.per_pa), room))
        .collect();
    let mut end = |up: bool| {
        for (state, at) in work.curves.iter_mut().zip(&points) {
            state.at = *at;
        }
        let along = match work.curves.as_slice() {
            [one] => end_of_one(fit, one, modulus, room, up),
            _ => None,
        };
        along.unwrap_or_else(|| modulus_end(fit, &mut work.curves, modulus, total, room, up))
    };
    let modulus_interval_pa = ((end(false) - shift).max(0.0), end(true) + shift);
    for (state, at) in work.curves.iter_mut().zip(&points) {
        state.at = *at;
    }
    Report {
        modulus_pa: modulus,
        modulus_interval_pa,
        curves,
        widened: settled.widened,
        converged: settled.converged,
    }
}

/// How far a reading in coarse steps may move the modulus: where nothing touches, all samples are rounded the same way, by up
/// to half a step. Contact points are put back to `points`.
fn rounding(fit: &Fit, work: &mut Workspace, modulus: f64, points: &[f64]) -> f64 {
    let mut any = false;
    for state in &mut work.curves {
        state.moved = 0.0;
        any |= state.coarse;
    }
    if !any {
        return 0.0;
    }
    let mut shift = 0.0_f64;
    for sign in [0.5, -0.5] {
        for (state, at) in work.curves.iter_mut().zip(points).filter(|(s, _)| s.coarse) {
            state.ready.lift(*at, sign * state.step);
            state.ready.renew(fit.baseline);
        }
        shift = shift.max((best_modulus(fit, &mut work.curves) - modulus).abs());
        for (state, at) in work.curves.iter_mut().zip(points) {
            state.moved = state.moved.max((state.at - at).abs());
            state.at = *at;
            if state.coarse {
                state.ready.lift(*at, -sign * state.step);
                state.ready.renew(fit.baseline);
            }
        }
    }
    shift
}

/// As [`modulus_end`] of a single curve: the farthest modulus at which the misfit has risen by no more than `room`, over contact points.
/// Nothing where it does not settle at once.
fn end_of_one(fit: &Fit, state: &State, modulus: f64, room: f64, up: bool) -> Option<f64> {
    /// Of a standard error of the contact point: the modulus goes with the square of it.
    const NEAR: f64 = 1e-3;
    let sign = if up { 1.0 } else { -1.0 };
    let k = modulus * state.per_pa;
    let p = state.ready.project(fit, state.at, 1);
    let least = p.misfit(k);
    let sharp = p.curvature();
    let mut at = state.at + sign * (room / sharp).sqrt() * p.c / (k * p.e);
    let mut way = f64::INFINITY;
    for _ in 0..8 {
        if !(at > state.bounds.0 && at < state.bounds.1) {
            return None;
        }
        let p = state.ready.project(fit, at, 1);
        // The misfit is a parabola over the stiffness.
        let inner = p.b * p.b - p.a * (p.rest - least - room);
        let k = (p.b + sign * inner.sqrt()) / p.a;
        let step = (p.d - k * p.c) / (k * p.e);
        if !(p.a > 0.0 && p.e > 0.0 && k > 0.0 && step.abs() < 0.5 * way) {
            return None;
        }
        if step * step * k * k * p.e < NEAR * NEAR * room {
            return Some(k / state.per_pa);
        }
        (at, way) = (at - step, step.abs());
    }
    None
}

/// Where the misfit has risen by `room` above its smallest, on one side of the modulus.
fn modulus_end(fit: &Fit, curves: &mut [State], modulus: f64, sharp: f64, room: f64, up: bool) -> f64 {
    let sign = if up { 1.0 } else { -1.0 };
    let mut risen = |way: f64| {
        let e = modulus + sign * way;
        let (mut misfit, mut slope) = (0.0, 0.0);
        for state in curves.iter_mut() {
            let k = e * state.per_pa;
            let p = state.refine(fit, Some(k));
            misfit += p.misfit(k);
            slope += 2.0 * (k * p.a - p.b) * state.per_pa;
        }
        (misfit, sign * slope)
    };
    let least = risen(0.0).0;
    let error = if sharp > 0.0 { (room / sharp).sqrt() } else { modulus };
    let limit = if up { 1e6 * modulus } else { modulus };
    let (mut low, mut high) = (0.0, error.min(limit));
    loop {
        if risen(high).0 - least > room {
            break;
        }
        if high >= limit {
            return if up { f64::INFINITY } else { 0.0 };
        }
        low = high;
        high = (2.0 * high).min(limit);
    }
    let tolerance = 1e-4 * error;
    let way = rising_to(
        tolerance,
        |way| {
            let (misfit, slope) = risen(way);
            (misfit - least - room, slope)
        },
        low,
        high,
        error,
    );
    modulus + sign * way
}

/// `others`: the curvature that the other curves give the stiffness.
fn curve_report(fit: &Fit, s: &State, modulus: f64, others: f64, room: f64) -> CurveReport {
    let (ready, k) = (&s.ready, modulus * s.per_pa);
    let risen = |at: f64| {
        let p = ready.project(fit, at, 1);
        let best = if p.a + others > 0.0 { ((p.b + others * k) / (p.a + others)).max(0.0) } else { 0.0 };
        let misfit = p.misfit(best) + others * (best - k) * (best - k);
        (misfit, 2.0 * best * (p.d - best * p.c))
    };
    let here = ready.project(fit, s.at, 1);
    let least = risen(s.at).0;
    // Where it would be if the misfit were a parabola.
    let sharp = k * k * (here.e - here.c * here.c / (here.a + others));
    let likely = if sharp > 0.0 { (room / sharp).sqrt() } else { 1e-3 };
    let end = |sign: f64, bound: f64| {
        let limit = (bound - s.at).abs();
        let (mut low, mut high) = (0.0, limit.min(1.5 * likely));
        loop {
            if risen(s.at + sign * high).0 - least > room {
                break;
            }
            if high >= limit {
                return sign * f64::INFINITY;
            }
            low = high;
            high = (4.0 * high).min(limit);
        }
        let f = |way: f64| {
            let (misfit, slope) = risen(s.at + sign * way);
            (misfit - least - room, sign * slope)
        };
        let way = rising_to(1e-4 * high, f, low, high, likely.max(low));
        ready.middle_m + ready.span_m * (s.at + sign * (way + s.moved))
    };
    let contact_interval_m = (end(-1.0, s.bounds.0), end(1.0, s.bounds.1));
    let (level, tilt) = ready.baseline(fit, s.at, k);
    let (mut used, mut touching, mut outliers, mut deepest) = (0, 0, 0, s.at);
    for p in ready.used() {
        let contact = k * Shape::new(fit, ready.span_m).at(p.u - s.at).0;
        let full = p.known / (s.sigma * s.sigma * (1.0 + (s.ratio * contact).powi(2)));
        used += 1;
        touching += usize::from(p.u > s.at);
        outliers += usize::from(p.weight < 0.5 * full);
        deepest = p.u.max(deepest);
    }
    let depth_m = (deepest - s.at) * ready.span_m;
    let law = Elastic { indenter: fit.indenter, modulus_pa: modulus, poisson_ratio: fit.poisson_ratio };
    let beyond_layer = fit.layer.is_some_and(|below| {
        let per_m = below.inverse_thickness_per_m;
        depth_m * per_m > 0.1 || fit.indenter.reach_m(depth_m) * per_m > below.layer.chi_end()
    });
    let width = contact_interval_m.1 - contact_interval_m.0;
    CurveReport {
        contact_m: ready.middle_m + ready.span_m * s.at,
        contact_interval_m,
        offset_n: ready.mean_n + ready.unit_n * (level - tilt * ready.middle_m / ready.span_m),
        tilt_n_m: ready.unit_n * tilt / ready.span_m,
        sigma_n: s.sigma * ready.unit_n,
        proportional: s.sigma * s.ratio,
        depth_m,
        samples: SampleCounts { used, in_contact: touching, outliers },
        autocorrelation: s.autocorrelation,
        flags: Flags {
            contact_unseen: used - touching < 3,
            contact_undetermined: !(width < 0.5 * depth_m),
            misfit: s.trend() > 4.0,
            coarse_reading: s.coarse,
            beyond_law: beyond_layer
                || matches!(law.validity(depth_m * (1.0 - 1e-9)), Validity::Beyond { .. }),
        },
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

    use super::super::settings::{Baseline, Curve, Fit, Loss};
    use super::super::solve::{Workspace, settle};
    use super::super::state::State;
    use super::{end_of_one, modulus_end};
    use crate::indenter::Indenter;
    use crate::law::{Elastic, Law};

    /// The way along the valley ends where the profile over contact points does.
    #[test]
    fn the_end_of_one_curve_is_that_of_the_profile() {
        let sphere = Indenter::Sphere { radius_m: 0.01 };
        let law = Elastic { indenter: sphere, modulus_pa: 1e4, poisson_ratio: 0.5 };
        let stage: Vec<f64> = (0..300).map(|i| 5e-6 * f64::from(i)).collect();
        let force: Vec<f64> = stage
            .iter()
            .enumerate()
            .map(|(i, d)| law.force(d - 4e-4) + 1e-3 * (1.7 * i as f64).sin())
            .collect();
        let curve = Curve { indentation_m: &stage, force_n: &force, sigma_n: None };
        for baseline in [Baseline::Zero, Baseline::Offset, Baseline::Tilt] {
            let fit = Fit { baseline, loss: Loss::Square, ..Fit::new(sphere, 0.5) };
            let mut work = Workspace::new();
            let mut state = State::default();
            state.load(&fit, 0, &curve).unwrap();
            work.curves.push(state);
            let settled = settle(&fit, &mut work).unwrap();
            let at = work.curves[0].at;
            let room = 4.0 * settled.inflation;
            let sharp = work.curves[0].ready.project(&fit, at, 1).curvature() * work.curves[0].per_pa.powi(2);
            for up in [false, true] {
                let along = end_of_one(&fit, &work.curves[0], settled.modulus, room, up).unwrap();
                work.curves[0].at = at;
                let profile = modulus_end(&fit, &mut work.curves, settled.modulus, sharp, room, up);
                work.curves[0].at = at;
                let half = (profile - settled.modulus).abs();
                assert!(
                    half > 0.0 && (along - profile).abs() < 1e-3 * half,
                    "{baseline:?} {up}: {along} {profile}"
                );
            }
        }
    }
}
