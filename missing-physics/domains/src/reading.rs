//! What every domain does with its table: runs, noise, resolution.

#[cfg(any(feature = "custom", feature = "motion", feature = "trajectory"))]
use missing_physics::data::Run;

use crate::recording::{Column, ReadError, Table, quoted};

/// Standard gravity, m/s^2 (CGPM 1901).
#[cfg(any(feature = "bounce", feature = "liquid-tilt", feature = "slosh", feature = "trajectory"))]
pub(super) const GRAVITY_M_S2: f64 = 9.80665;

/// A column of numbers.
pub(super) const fn number<'a>(name: &'a str, what: &'a str) -> Column<'a> {
    Column { name, what, label: false }
}

/// The rows of each run, in the order of the file; each has at least `fewest`, and the column `rising` rises in it.
///
/// # Errors
/// [`ReadError::TooFewRows`], [`ReadError::Cell`].
pub(super) fn check_runs(
    table: &Table,
    labels: &[String],
    fewest: usize,
    rising: Option<&str>,
) -> Result<Vec<(String, Vec<usize>)>, ReadError> {
    let expected =
        |what: &str| format!("{what}at least {fewest}{}", if what.is_empty() { "" } else { " rows" });
    let too_few = |what: String, got, expected| {
        Err(ReadError::TooFewRows { file: table.file.clone(), what, got, expected })
    };
    let runs = Table::by_run(labels);
    if runs.is_empty() {
        return too_few("the file".into(), 0, expected("runs of "));
    }
    for (label, rows) in &runs {
        if rows.len() < fewest {
            return too_few(format!("run {}", quoted(label)), rows.len(), expected(""));
        }
        let Some((name, column)) = rising.and_then(|name| Some((name, table.numbers(name)?))) else {
            continue;
        };
        for pair in rows.windows(2) {
            let (before, now) = (column[pair[0]], column[pair[1]]);
            if now <= before {
                let before = format!(
                    "more than {before}, the {} before it",
                    if name == "t_s" { "time" } else { "one" }
                );
                return Err(table.cell(pair[1], name, now, before));
            }
        }
    }
    Ok(runs)
}

/// The middle one of some values, the upper one of the two in the middle where their number is even; `None` of nothing.
#[cfg(any(feature = "grain-pour", feature = "slosh", feature = "trajectory"))]
pub(super) fn upper_median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// The calibrated sigma of each channel, where `[noise]` has one.
///
/// # Errors
/// [`ReadError::Value`].
#[cfg(any(
    feature = "custom",
    feature = "indentation",
    feature = "liquid-tilt",
    feature = "motion",
    feature = "slosh",
    feature = "trajectory"
))]
pub(super) fn calibration(
    header: &crate::recording::Header,
    channels: &[&str],
) -> Result<Vec<Option<f64>>, ReadError> {
    let noise = header.section("noise")?;
    channels.iter().map(|name| noise.number(name, f64::MIN_POSITIVE, 1e12)).collect()
}

/// The steps in which the sensors of all channels give their readings, of which columns say `steps`: none where readings were taken as they
/// changed.
#[cfg(any(feature = "custom", feature = "motion", feature = "trajectory"))]
pub(super) fn sensor_steps(runs: &[Run], steps: impl Iterator<Item = f64>) -> Vec<f64> {
    let of_sensor = |(channel, step)| if taken_at_changes(runs, channel, step) { 0.0 } else { step };
    steps.enumerate().map(of_sensor).collect()
}

/// Whether a channel's readings were taken as they changed, each a step from the one before at a moment of its own (the ticks of an encoder, the
/// bars of a fence that falls through a light gate): such readings are exact, and their step is none of a sensor's. The first input is the time.
#[cfg(any(feature = "custom", feature = "motion", feature = "trajectory"))]
fn taken_at_changes(runs: &[Run], channel: usize, step: f64) -> bool {
    /// Part of the changes that are of one step: some may have been missed.
    const MOST: f64 = 0.75;
    /// Two spans are alike to this part of them where a clock took the readings.
    const EVEN: f64 = 1e-3;
    if step <= 0.0 {
        return false;
    }
    let (mut changes, mut single, mut uneven) = (0_usize, 0_usize, false);
    for run in runs {
        let Some(times) = run.inputs.first() else { return false };
        let rows = times.iter().zip(&run.outputs[channel]).filter(|(_, value)| value.is_finite());
        let rows: Vec<(f64, f64)> = rows.map(|(t, value)| (*t, *value)).collect();
        let spans: Vec<f64> = rows.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
        uneven |= spans.windows(2).any(|pair| (pair[1] / pair[0] - 1.0).abs() > EVEN);
        for pair in rows.windows(2) {
            let by = ((pair[1].1 - pair[0].1) / step).round().abs();
            if by < 0.5 {
                return false;
            }
            changes += 1;
            single += usize::from(by < 1.5);
        }
    }
    uneven && single as f64 >= MOST * changes as f64 && changes > 0
}

/// The step of a column's readings where they are clearly steps of one size, else 0.
#[cfg(any(
    feature = "bounce",
    feature = "custom",
    feature = "indentation",
    feature = "liquid-tilt",
    feature = "slosh",
    feature = "trajectory"
))]
pub(super) fn resolution(column: &[f64]) -> f64 {
    let mut sorted = column.to_vec();
    sorted.sort_by(f64::total_cmp);
    let largest = sorted.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let gaps = sorted.windows(2).map(|w| w[1] - w[0]).filter(|g| *g > 1e-9 * largest);
    let step = gaps.fold(f64::INFINITY, f64::min);
    let whole = |v: &f64| ((v - sorted[0]) / step - ((v - sorted[0]) / step).round()).abs() < 1e-3;
    if step.is_finite() && sorted.iter().all(whole) { step } else { 0.0 }
}
