//! Where fits of a detent begin: by what the motion lacks, along the position that was measured.
//!
//! A force that repeats a few times a turn moves a joint by more than its own period where it is strong, and then no fit leads from the
//! motion without it to the motion with it. The acceleration that is missing is told by the readings themselves: second differences of what
//! a fit leaves, against the sine and cosine of each multiple of the measured angle (least squares on the equations, not on the motion;
//! their averages over the rows of a difference are the weak form of both).

use missing_physics::data::Run;
use nalgebra::{DMatrix, DVector};

/// Rows from one reading of a second difference to the next.
const STRIDES: [usize; 5] = [1, 2, 4, 8, 16];
/// Periods in a turn.
const PERIODS: std::ops::RangeInclusive<usize> = 1..=60;
/// Numbers of periods that are told.
const TOLD: usize = 3;
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

/// The detents that explain most of the missing acceleration, the best first, of angles that were measured (`[run][row]`, rad) and what a fit
/// leaves of them.
pub(super) fn detents(runs: &[Run], channel: usize, left: &[Vec<Vec<f64>>]) -> Vec<Detent> {
    let mut best: Vec<(f64, Detent)> = Vec::new();
    for stride in STRIDES {
        let rows: Vec<Row> = runs
            .iter()
            .zip(left)
            .flat_map(|(run, left)| rows(run, channel, &left[channel], stride))
            .collect();
        if rows.len() < 4 * BESIDE {
            continue;
        }
        let Some((without, _)) = fitted(&rows, stride, None) else { continue };
        for periods in PERIODS {
            let Some((with, [sine, cosine])) = fitted(&rows, stride, Some(periods as f64)) else { continue };
            let gain = rows.len() as f64 * (without / with.max(f64::MIN_POSITIVE)).ln();
            let (amplitude, phase) = (sine.hypot(cosine), cosine.atan2(sine));
            let detent = Detent { amplitude, phase, periods: periods as f64 };
            match best.iter_mut().find(|(_, other)| other.periods == detent.periods) {
                Some(known) if known.0 < gain => *known = (gain, detent),
                Some(_) => {}
                None => best.push((gain, detent)),
            }
        }
    }
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    best.truncate(TOLD);
    best.into_iter().map(|(_, detent)| detent).collect()
}

/// A second difference: of what is left, with what stands beside it, and the angles over which it is an average.
struct Row<'a> {
    acceleration: f64,
    beside: [f64; BESIDE],
    angles: &'a [f64],
}

/// Second differences of a run, one for each stride of rows.
fn rows<'a>(run: &'a Run, channel: usize, left: &[f64], stride: usize) -> Vec<Row<'a>> {
    let (times, angles) = (&run.inputs[0], &run.outputs[channel]);
    let row = |i: usize| -> Option<Row<'a>> {
        let (first, last) = (i - stride, i + stride);
        let (before, after) = (times[i] - times[first], times[last] - times[i]);
        let step = 0.5 * (before + after);
        let known = angles[first..=last].iter().chain(&left[first..=last]).all(|v| v.is_finite());
        let rate = (left[last] - left[first]) / (2.0 * step);
        (known && (before - after).abs() < UNEVEN * step).then(|| Row {
            acceleration: (left[last] - 2.0 * left[i] + left[first]) / (step * step),
            beside: [1.0, left[i], rate, (angles[last] - angles[first]).signum()],
            angles: &angles[first..=last],
        })
    };
    (stride..times.len().saturating_sub(stride)).step_by(stride).filter_map(row).collect()
}

/// The squares that are left of the accelerations by least squares beside a detent, if any, and its sine and cosine.
fn fitted(rows: &[Row<'_>], stride: usize, periods: Option<f64>) -> Option<(f64, [f64; 2])> {
    let columns = BESIDE + 2 * usize::from(periods.is_some());
    let (mut normal, mut products) =
        (DMatrix::<f64>::zeros(columns, columns), DVector::<f64>::zeros(columns));
    let mut squares = 0.0;
    for row in rows {
        let mut values = [0.0; BESIDE + 2];
        values[..BESIDE].copy_from_slice(&row.beside);
        if let Some(periods) = periods {
            // The average that a second difference is, of the acceleration between its readings.
            for (k, angle) in row.angles.iter().enumerate() {
                let weight = (stride - k.abs_diff(stride)) as f64 / (stride * stride) as f64;
                let (sine, cosine) = (periods * angle).sin_cos();
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
    let detent = if periods.is_some() { [solution[BESIDE], solution[BESIDE + 1]] } else { [0.0; 2] };
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
}
