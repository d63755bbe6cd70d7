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
        modulus_end(fit, &mut work.curves, modulus, total, room, up)
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
    let least = risen(s.at).0;
    let end = |sign: f64, bound: f64| {
        let limit = (bound - s.at).abs();
        let (mut low, mut high) = (0.0, limit.min(1e-3));
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
        let way = rising_to(1e-4 * high, f, low, high, high);
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
