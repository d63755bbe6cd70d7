//! The runs of a diagnosis to be explored: all of them as data, a library that draws, and a script.

use missing_physics::diagnosis::Diagnosis;
use serde::Serialize;

use super::context::ReportContext;
use super::quantity::{axis_label, label};
use super::runs::{self, Misfit, along, axis, interval, place, together};
use super::text::changed;

/// uPlot 1.6.32 by Leon Sorokin (npm: `uplot`).
const LIBRARY: &str = include_str!("uPlot.iife.min.js");
const LIBRARY_STYLE: &str = include_str!("uPlot.min.css");
const LIBRARY_LICENCE: &str = include_str!("LICENSE-uPlot");
const SCRIPT: &str = include_str!("explore.js");
/// Rows times columns beyond this are thinned: a page stays below a few megabytes.
const MOST_CELLS: usize = 150_000;

#[derive(Serialize)]
struct Data {
    changed: bool,
    /// The run that is shown first; below zero for all.
    first: i64,
    /// Whether logarithmic axes make sense, and whether they are drawn at first.
    log: bool,
    log_first: bool,
    /// The channels that are places along and across, seen from above.
    plan: Option<[usize; 2]>,
    /// Whether phase portraits are drawn: of what swings in time.
    phase: bool,
    /// Which rows are there: every so many-th.
    every: usize,
    variables: Vec<Variable>,
    channels: Vec<Channel>,
    runs: Vec<Run>,
}

#[derive(Serialize)]
struct Variable {
    label: String,
}

#[derive(Serialize)]
struct Channel {
    label: String,
    unit: String,
    sigma: Option<f64>,
    /// The variable along which it is drawn at first.
    axis: usize,
    place: Option<Place>,
}

#[derive(Serialize)]
struct Place {
    variable: usize,
    from: f64,
    to: f64,
    runs: Vec<String>,
}

#[derive(Serialize)]
struct Run {
    label: String,
    /// Root mean square residual in sigmas.
    before: f64,
    after: f64,
    inputs: Vec<Vec<f64>>,
    channels: Vec<Columns>,
}

#[derive(Serialize)]
struct Columns {
    measured: Vec<f64>,
    before: Vec<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    after: Option<Vec<f64>>,
    /// Rows that were set aside.
    aside: Vec<usize>,
}

/// What replaces the still picture `instead` where scripts run.
pub(super) fn section(d: &Diagnosis, context: &ReportContext, instead: &str) -> String {
    if d.curves.is_empty() || d.channels.is_empty() {
        return instead.to_owned();
    }
    // Numbers, texts and lists always serialise; numbers that are not finite become null. No text ends the element early.
    let data = serde_json::to_string(&data(d, context)).unwrap_or_default().replace('<', "\\u003c");
    format!(
        "<style>{LIBRARY_STYLE}</style><div id=\"explore\">{instead}</div><script type=\"application/json\" id=\"curves\">{data}</script><script>/*\n{LIBRARY_LICENCE}*/\n{LIBRARY}</script><script>{SCRIPT}</script>"
    )
}

fn data(d: &Diagnosis, context: &ReportContext) -> Data {
    let columns = d.variables.len().max(1) + 3 * d.channels.len();
    let rows: usize = d.curves.iter().filter_map(|c| c.measured.first()).map(Vec::len).sum();
    let every = (rows * columns).div_ceil(MOST_CELLS).max(1);
    let variables: Vec<Variable> =
        (0..d.variables.len().max(1)).map(|v| Variable { label: axis_label(d, context, v) }).collect();
    let order = runs::channels(d);
    let channels = order.iter().map(|&c| channel(d, context, c)).collect();
    let by_misfit = runs::by_misfit(d);
    let runs = by_misfit.iter().map(|misfit| run(d, misfit, &order, variables.len(), every)).collect();
    Data {
        changed: changed(d),
        first: if together(d) { -1 } else { worst(d, &by_misfit) },
        log: positive(d),
        // A force against a depth is a power law, to those who measure it.
        log_first: positive(d) && context.domain == "indentation",
        plan: plan(d, &order),
        phase: matches!(context.domain.as_str(), "motion" | "slosh")
            && d.variables.first().is_some_and(|(name, _)| name == "t_s"),
        every,
        variables,
        channels,
        runs,
    }
}

/// The place of the run that is shown first among those in order: the worst of those in which the first channel misses.
fn worst(d: &Diagnosis, order: &[Misfit]) -> i64 {
    let shown = runs::worst(d);
    order.iter().position(|m| Some(m.run) == shown).map_or(0, |at| at as i64)
}

/// Whether most of what is drawn first is above zero along both axes.
fn positive(d: &Diagnosis) -> bool {
    let Some(&c) = runs::channels(d).first() else { return false };
    let (mut above, mut all) = (0_usize, 0_usize);
    for curves in &d.curves {
        for (x, y) in along(curves, axis(d, c)).iter().zip(&curves.measured[c]) {
            all += 1;
            above += usize::from(*x > 0.0 && *y > 0.0);
        }
    }
    4 * above > 3 * all
}

/// Where the channels `x_m` and `y_m` stand in the order of the page.
fn plan(d: &Diagnosis, order: &[usize]) -> Option<[usize; 2]> {
    let at = |name: &str| order.iter().position(|&c| d.channels[c].0 == name);
    Some([at("x_m")?, at("y_m")?])
}

fn channel(d: &Diagnosis, context: &ReportContext, c: usize) -> Channel {
    let place = interval(d, c).and_then(|(from, to)| {
        let runs = place(d, c)?.runs.clone();
        Some(Place { variable: axis(d, c), from, to, runs })
    });
    Channel {
        label: label(context, &d.channels[c]),
        unit: d.channels[c].1.clone(),
        sigma: runs::sigma(d, c),
        axis: axis(d, c),
        place,
    }
}

fn run(d: &Diagnosis, misfit: &Misfit, order: &[usize], variables: usize, every: usize) -> Run {
    let curves = &d.curves[misfit.run];
    let inputs = (0..variables).map(|v| rounded(&along(curves, v), every, 1e-5)).collect();
    let columns = |&c: &usize| {
        let measured = &curves.measured[c];
        // A hundredth of the noise is not seen.
        let span = measured.iter().filter(|v| v.is_finite()).fold(0.0_f64, |m, v| m.max(v.abs()));
        let step = runs::sigma(d, c).map_or(1e-6, |sigma| 0.01 * sigma / span);
        let aside = d.outliers.iter().filter(|o| o.run == curves.run && o.channel == d.channels[c].0);
        Columns {
            measured: rounded(measured, every, step),
            before: rounded(&curves.before[c], every, step),
            after: changed(d).then(|| rounded(&curves.after[c], every, step)),
            aside: aside.filter(|o| o.row % every == 0).map(|o| o.row / every).collect(),
        }
    };
    Run {
        label: curves.run.clone(),
        before: misfit.before,
        after: misfit.after,
        inputs,
        channels: order.iter().map(columns).collect(),
    }
}

/// Every so many-th value, to the digits that `step` needs, a share of the largest.
fn rounded(values: &[f64], every: usize, step: f64) -> Vec<f64> {
    let digits = if step > 0.0 { (-step.log10()).ceil().clamp(3.0, 12.0) as usize } else { 6 };
    let round = |v: &f64| format!("{v:.digits$e}").parse().unwrap_or(*v);
    values.iter().step_by(every).map(round).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_that_nobody_sees_are_not_written() {
        assert_eq!(rounded(&[1.234_567_89, 7.0, 0.001_234_567_89], 2, 1e-3), [1.235, 0.001_235]);
        assert!(rounded(&[f64::NAN], 1, 1e-3)[0].is_nan());
    }
}
