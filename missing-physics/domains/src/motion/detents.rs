//! Where fits of a detent begin: by what the motion lacks, along the position that was measured.
//!
//! A force that repeats a few times a turn moves a joint by more than its own period where it is strong, and then no fit leads from the
//! motion without it to the motion with it. (Where it is weak, one does, and needs no such beginning.) The acceleration that is missing is
//! told by the readings themselves: second differences of what a fit leaves, against the sine and cosine of each multiple of the measured
//! angle (least squares on the equations, not on the motion; their averages over the rows of a difference are the weak form of both).

use missing_physics::data::Run;
use nalgebra::{DMatrix, DVector};

use super::scales::rms;

/// Rows from one reading of a second difference to the next.
const STRIDES: [usize; 5] = [1, 2, 4, 8, 16];
/// Periods in a turn.
const PERIODS: std::ops::RangeInclusive<usize> = 1..=60;
/// Numbers of periods that are told.
const TOLD: usize = 3;
/// A detent is strong where a fit without it is wrong by more than this angle of its period, rad, as a root mean square: sines bend.
const BENDS: f64 = 0.5;
/// Columns beside the detent: a constant, what is left and its rate (the equations pull it back), the sign of the velocity.
const BESIDE: usize = 4;
/// Rows that are more unevenly apart than this part are not used.
const UNEVEN: f64 = 0.05;

/// A detent: the force is `amplitude sin(periods x + phase)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Detent {
    pub(super) amplitude: f64,
    pub(super) phase: f64,
    pub(super) periods: f64,
}

/// The strong detents that explain most of the missing acceleration, the best first, of angles that were measured (an output, rad) and what
/// a fit leaves of the outputs, `[run][output][row]`.
pub(super) fn detents(runs: &[Run], output: usize, left: &[Vec<Vec<f64>>]) -> Vec<Detent> {
    let left: Vec<&[f64]> = left.iter().map(|run| &run[output][..]).collect();
    let wrong = rms(&left.concat());
    let strong: Vec<f64> = PERIODS.map(|n| n as f64).filter(|periods| periods * wrong > BENDS).collect();
    if strong.is_empty() {
        return Vec::new();
    }
    let beside = |stride: usize| -> Option<(usize, Vec<Row>, f64)> {
        let of_run =
            |run: usize| rows(run, &runs[run].inputs[0], &runs[run].outputs[output], left[run], stride);
        let rows: Vec<Row> = (0..runs.len()).flat_map(of_run).collect();
        let (without, _) = (rows.len() >= 4 * BESIDE).then(|| fitted(&rows, stride, None))??;
        Some((stride, rows, without))
    };
    let strides: Vec<_> = STRIDES.into_iter().filter_map(beside).collect();
    let of_periods = |periods: f64| -> Option<(f64, Detent)> {
        let wave = |run: &Run| run.outputs[output].iter().map(|angle| (periods * angle).sin_cos()).collect();
        let waves: Vec<Vec<(f64, f64)>> = runs.iter().map(wave).collect();
        let by_stride = strides.iter().filter_map(|(stride, rows, without)| {
            let (with, [sine, cosine]) = fitted(rows, *stride, Some(&waves))?;
            let gain = rows.len() as f64 * (without / with.max(f64::MIN_POSITIVE)).ln();
            Some((gain, Detent { amplitude: sine.hypot(cosine), phase: cosine.atan2(sine), periods }))
        });
        by_stride.max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut best: Vec<(f64, Detent)> = strong.into_iter().filter_map(of_periods).collect();
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    best.truncate(TOLD);
    best.into_iter().map(|(_, detent)| detent).collect()
}

/// A second difference of what is left, with what stands beside it, and where it was taken.
struct Row {
    acceleration: f64,
    beside: [f64; BESIDE],
    run: usize,
    first: usize,
}

/// Second differences of a run, one for each stride of rows.
fn rows(run: usize, times: &[f64], angles: &[f64], left: &[f64], stride: usize) -> Vec<Row> {
    let row = |i: usize| -> Option<Row> {
        let (first, last) = (i - stride, i + stride);
        let (before, after) = (times[i] - times[first], times[last] - times[i]);
        let step = 0.5 * (before + after);
        let known = angles[first..=last].iter().chain(&left[first..=last]).all(|v| v.is_finite());
        let rate = (left[last] - left[first]) / (2.0 * step);
        (known && (before - after).abs() < UNEVEN * step).then(|| Row {
            acceleration: (left[last] - 2.0 * left[i] + left[first]) / (step * step),
            beside: [1.0, left[i], rate, (angles[last] - angles[first]).signum()],
            run,
            first,
        })
    };
    (stride..times.len().saturating_sub(stride)).step_by(stride).filter_map(row).collect()
}

/// The squares that are left of the accelerations by least squares beside a detent, if any, of which `waves` are sine and cosine at each row
/// of each run; and how much there is of both.
fn fitted(rows: &[Row], stride: usize, waves: Option<&[Vec<(f64, f64)>]>) -> Option<(f64, [f64; 2])> {
    let columns = BESIDE + 2 * usize::from(waves.is_some());
    let (mut normal, mut products) =
        (DMatrix::<f64>::zeros(columns, columns), DVector::<f64>::zeros(columns));
    let mut squares = 0.0;
    for row in rows {
        let mut values = [0.0; BESIDE + 2];
        values[..BESIDE].copy_from_slice(&row.beside);
        if let Some(waves) = waves {
            // The average that a second difference is, of the acceleration between its readings.
            for (k, (sine, cosine)) in waves[row.run][row.first..=row.first + 2 * stride].iter().enumerate() {
                let weight = (stride - k.abs_diff(stride)) as f64 / (stride * stride) as f64;
                values[BESIDE] += weight * sine;
                values[BESIDE + 1] += weight * cosine;
            }
        }
        for i in 0..columns {
            for j in 0..=i {
                normal[(i, j)] += values[i] * values[j];
            }
            products[i] += values[i] * row.acceleration;
        }
        squares += row.acceleration * row.acceleration;
    }
    // What nothing tells of is no column.
    (0..columns).for_each(|i| normal[(i, i)] += f64::EPSILON * normal[(i, i)] + f64::MIN_POSITIVE.sqrt());
    let solution = normal.cholesky()?.solve(&products);
    let detent = if waves.is_some() { [solution[BESIDE], solution[BESIDE + 1]] } else { [0.0; 2] };
    Some(((squares - solution.dot(&products)).max(0.0), detent))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An angle that runs on unevenly and readings that lack the motion under a detent: second derivatives by construction.
    #[test]
    fn a_detent_is_told_by_the_missing_acceleration() {
        let times: Vec<f64> = (0..3000).map(|k| 2e-3 * f64::from(k)).collect();
        let angle = |t: f64| 6.0 * t + 2.0 * (1.3 * t).sin();
        let (mut rate, mut at) = (0.0, 0.0);
        // What is left, integrated in steps of a hundredth of a row.
        let left = times.iter().map(|t| {
            let now = at;
            for part in 0..100 {
                let t = t + 2e-5 * (f64::from(part) + 0.5);
                rate += 2e-5 * (8.0 * (7.0 * angle(t) + 0.4).sin() - 0.5 * rate);
                at += 2e-5 * rate;
            }
            now
        });
        let left: Vec<f64> = left.collect();
        let angles = times.iter().map(|t| angle(*t)).collect();
        let run = Run { label: "1".into(), inputs: vec![times], outputs: vec![angles], kind: 0 };
        let found = detents(&[run], 0, &[vec![left]]);
        let Detent { amplitude, phase, periods } = found[0];
        assert_eq!(periods, 7.0);
        assert!((amplitude - 8.0).abs() < 0.1 && (phase - 0.4).abs() < 0.02, "{found:?}");
    }

    /// A fit that is wrong by a few milliradians has lost no period: whatever looks like a detent there needs no beginning of its own.
    #[test]
    fn what_moves_a_joint_by_little_is_no_strong_detent() {
        let times: Vec<f64> = (0..400).map(|k| 0.01 * f64::from(k)).collect();
        let angles: Vec<f64> = times.iter().map(|t| (5.0 * t).sin()).collect();
        let left = angles.iter().map(|angle| 8e-3 * (6.0 * angle).sin()).collect();
        let run = Run { label: "1".into(), inputs: vec![times], outputs: vec![angles], kind: 0 };
        assert!(detents(&[run], 0, &[vec![left]]).is_empty());
    }
}
