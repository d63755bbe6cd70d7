//! Where a fit begins: what a recording of a decaying wave shows at sight.

use std::f64::consts::TAU;

use liquid_haptics::slosh::UprightCylinder;
use missing_physics::data::Run;

use crate::reading::upper_median;

/// Frequencies (rad/s) at which the residual's spectrum, summed over the runs, is highest.
pub(super) fn peaks(runs: &[Run], residual: &[Vec<Vec<f64>>], [lowest, highest]: [f64; 2]) -> Vec<f64> {
    let (mut longest, mut gap): (f64, f64) = (0.0, f64::INFINITY);
    for run in runs {
        let Some(times) = run.inputs.first() else { continue };
        if let (Some(first), Some(last)) = (times.first(), times.last()) {
            longest = longest.max(last - first);
            gap = gap.min((last - first) / (times.len().max(2) - 1) as f64);
        }
    }
    if !(longest > 0.0 && gap > 0.0) {
        return Vec::new();
    }
    let step = 0.25 * TAU / longest;
    let (lowest, highest) = (lowest.max(4.0 * step), highest.min(0.5 * TAU / gap));
    let frequencies: Vec<f64> =
        (0..20_000).map(|k| lowest + f64::from(k) * step).take_while(|w| *w < highest).collect();
    let power: Vec<f64> = frequencies
        .iter()
        .map(|w| {
            runs.iter()
                .zip(residual)
                .map(|(run, left)| {
                    let (mut re, mut im) = (0.0, 0.0);
                    for (t, r) in run.inputs[0].iter().zip(&left[0]).filter(|(_, r)| r.is_finite()) {
                        let (s, c) = (w * t).sin_cos();
                        (re, im) = (re + r * c, im + r * s);
                    }
                    re * re + im * im
                })
                .sum()
        })
        .collect();
    let mut tops: Vec<usize> = (1..power.len().saturating_sub(1))
        .filter(|&i| power[i] >= power[i - 1] && power[i] > power[i + 1])
        .collect();
    tops.sort_by(|&a, &b| power[b].total_cmp(&power[a]));
    tops.into_iter().map(|i| frequencies[i]).collect()
}

/// Amplitudes at t = 0 of the cosine and the sine of a run's wave: least squares of a decaying sine over its first cycles.
pub(super) fn first_wave(cylinder: &UprightCylinder, viscosity: f64, run: &Run) -> Option<[f64; 2]> {
    /// So many that noise averages out, so few that what bends the decay has not begun to.
    const CYCLES: f64 = 3.0;
    let (times, values) = (run.inputs.first()?, run.outputs.first()?);
    let (w, ratio) = (cylinder.angular_frequency_rad_s(0, 0.0), cylinder.damping_ratio(viscosity).min(0.5));
    let (mut cc, mut cs, mut ss, mut cy, mut sy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (t, y) in times.iter().zip(values).filter(|(t, y)| **t < CYCLES * TAU / w && y.is_finite()) {
        let fade = (-ratio * w * t).exp();
        let (s, c) = (w * (1.0 - ratio * ratio).sqrt() * t).sin_cos();
        let (s, c) = (fade * s, fade * c);
        (cc, cs, ss, cy, sy) = (cc + c * c, cs + c * s, ss + s * s, cy + c * y, sy + s * y);
    }
    let determinant = cc * ss - cs * cs;
    (determinant > 1e-9 * cc * ss)
        .then(|| [(cy * ss - sy * cs) / determinant, (sy * cc - cy * cs) / determinant])
}

/// A viscosity to begin with: from how much of the wave is left in the later half of the runs.
pub(super) fn viscosity_guess(cylinder: &UprightCylinder, runs: &[Run]) -> f64 {
    let w = cylinder.angular_frequency_rad_s(0, 0.0);
    let ratios = runs
        .iter()
        .filter_map(|run| {
            let (times, values) = (run.inputs.first()?, run.outputs.first()?);
            let span = times.last()? - times.first()?;
            let middle = times.first()? + 0.3 * span;
            let power = |early: bool| {
                let part = times.iter().zip(values).filter(|(t, v)| (**t < middle) == early && v.is_finite());
                let (sum, n) = part.fold((0.0, 0.0), |(s, n), (_, v)| (s + v * v, n + 1.0));
                sum / f64::max(n, 1.0)
            };
            // Mean powers half a run apart fall by exp(-gamma omega span).
            let fall = (power(true) / power(false)).ln() / (w * span);
            (fall.is_finite() && fall > 0.0).then_some(fall)
        })
        .collect();
    let ratio = upper_median(ratios).unwrap_or(0.01).clamp(1e-4, 0.3);
    cylinder.kinematic_viscosity_m2_s(ratio)
}
