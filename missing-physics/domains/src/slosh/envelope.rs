//! Where the fit of a wave with dry friction begins: its envelope, cycle by cycle.
//!
//! The exact decay has a local optimum for nearly every cycle in which the wave may have stopped. Its envelope does not: friction and
//! viscosity together take `dA/dt = -gamma omega A - 2 omega f / pi` of the amplitude (the energy of a cycle), so that
//! `A(t) = (A0 + c) exp(-gamma omega t) - c` until it is none, `c = 2 f / (pi gamma)`; that is searched as a whole.

use std::f64::consts::{PI, TAU};

use missing_physics::data::Run;

/// Damping ratios and frictions (shares of the largest amplitude) of the search's grid, as powers of their ratio.
const POINTS: i32 = 28;
/// The least of each.
const LEAST: [f64; 2] = [1e-4, 1e-3];
/// The greatest of each.
const MOST: [f64; 2] = [0.2, 0.5];
/// Fewest readings in a cycle that give an amplitude.
const FEWEST: usize = 5;
/// Points of the grid nearer than this (in its steps, along either axis) to a better one are not proposed as well.
const APART: i32 = 3;

/// Middle of each cycle, s, and the amplitude in it.
fn amplitudes(run: &Run, omega: f64) -> Vec<[f64; 2]> {
    let (Some(times), Some(values)) = (run.inputs.first(), run.outputs.first()) else { return Vec::new() };
    let mut found = Vec::new();
    let mut from = 0;
    while from < times.len() {
        let end = from + times[from..].partition_point(|t| *t < times[from] + TAU / omega);
        let (mut cc, mut cs, mut ss, mut cy, mut sy, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0, 0);
        for (t, y) in times[from..end].iter().zip(&values[from..end]).filter(|(_, y)| y.is_finite()) {
            let (s, c) = (omega * t).sin_cos();
            (cc, cs, ss, cy, sy) = (cc + c * c, cs + c * s, ss + s * s, cy + c * y, sy + s * y);
            count += 1;
        }
        let determinant = cc * ss - cs * cs;
        let complete = end < times.len();
        if count >= FEWEST && complete && determinant > 1e-6 * cc * ss {
            let [a, b] = [(cy * ss - sy * cs) / determinant, (sy * cc - cy * cs) / determinant];
            found.push([0.5 * (times[from] + times[end]), a.hypot(b)]);
        }
        from = end.max(from + 1);
    }
    found
}

/// Squares left of one run's amplitudes by a damping ratio and a friction, its first amplitude fitted to the cycles before the stop.
fn misfit(cycles: &[[f64; 2]], omega: f64, ratio: f64, friction: f64) -> f64 {
    let c = 2.0 * friction / (PI * ratio);
    let fade = |t: f64| (-ratio * omega * t).exp();
    let mut first = f64::INFINITY;
    for _ in 0..3 {
        let (mut top, mut bottom) = (0.0, 0.0);
        for [t, amplitude] in cycles.iter().filter(|[t, _]| (first + c) * fade(*t) > c) {
            top += fade(*t) * (amplitude + c);
            bottom += fade(*t) * fade(*t);
        }
        if bottom > 0.0 {
            first = (top / bottom - c).max(0.0);
        }
    }
    cycles.iter().map(|[t, amplitude]| (amplitude - ((first + c) * fade(*t) - c).max(0.0)).powi(2)).sum()
}

/// Damping ratio and friction (in the reading's unit) at which a fit may begin, the likeliest first, at most `most`.
pub(super) fn starts(runs: &[Run], omega: f64, largest: f64, most: usize) -> Vec<[f64; 2]> {
    let cycles: Vec<Vec<[f64; 2]>> = runs.iter().map(|run| amplitudes(run, omega)).collect();
    let at = |k: i32, axis: usize| {
        LEAST[axis] * (MOST[axis] / LEAST[axis]).powf(f64::from(k) / f64::from(POINTS - 1))
    };
    let mut grid: Vec<(f64, [i32; 2])> = (0..POINTS)
        .flat_map(|i| (0..POINTS).map(move |j| [i, j]))
        .map(|[i, j]| {
            let (ratio, friction) = (at(i, 0), at(j, 1) * largest);
            (cycles.iter().map(|c| misfit(c, omega, ratio, friction)).sum(), [i, j])
        })
        .collect();
    grid.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut taken: Vec<[i32; 2]> = Vec::new();
    for (_, place) in grid {
        let near = |t: &[i32; 2]| (t[0] - place[0]).abs() < APART && (t[1] - place[1]).abs() < APART;
        if taken.len() < most && !taken.iter().any(near) {
            taken.push(place);
        }
    }
    taken.into_iter().map(|[i, j]| [at(i, 0), at(j, 1) * largest]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wave drawn half cycle by half cycle between its turning points: each is twice the friction, and what viscosity takes, nearer.
    #[test]
    fn the_envelope_of_a_wave_that_stops_gives_its_friction() {
        let (omega, friction, fade) = (19.0, 1.2e-3, 0.97);
        let (mut amplitude, mut turns) = (0.02f64, vec![]);
        while amplitude > friction {
            turns.push(amplitude);
            amplitude = (amplitude - friction) * fade - friction;
        }
        let times: Vec<f64> = (0..500).map(|i| 0.01 * f64::from(i)).collect();
        let reading = |t: &f64| {
            let (half, phase) = ((omega * t / PI) as usize, omega * t % PI);
            let sign = if half % 2 == 0 { 1.0 } else { -1.0 };
            turns.get(half).map_or(0.0, |a| sign * ((a - friction) * phase.cos() + friction))
        };
        let values = times.iter().map(reading).collect();
        let run = Run { label: "a".into(), inputs: vec![times], outputs: vec![values], kind: 0 };
        let found = starts(&[run], omega, 0.02, 3);
        assert_eq!(found.len(), 3);
        let ratio = -f64::ln(fade) / PI;
        assert!((found[0][1] / friction - 1.0).abs() < 0.3, "{found:?}");
        assert!(found[0][0] / ratio < 3.0, "{found:?}");
    }
}
