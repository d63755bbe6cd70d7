//! The charts of a diagnosis.

use std::fmt::Write as _;

use missing_physics::diagnosis::{Curves, Diagnosis, Location, Verdict};

use super::number::probability;
use super::svg::{self, Chart, Series, escape};
use super::text::headline;

/// Runs drawn; more say no more.
const MOST_RUNS: usize = 4;

/// For each channel: data with both fits, and residuals before and after.
pub(super) fn channels(d: &Diagnosis) -> String {
    let mut html = String::new();
    for c in by_misfit(d) {
        // Writing to a string cannot fail.
        let _ = write!(html, "<h3>{}</h3><div class=\"charts\">", escape(&d.channels[c].0));
        for curves in d.curves.iter().take(MOST_RUNS) {
            let [data, left] = charts(d, c, curves);
            let _ = write!(html, "<figure>{data}</figure><figure>{left}</figure>");
        }
        html.push_str("</div>");
        if d.curves.len() > MOST_RUNS {
            let _ = write!(
                html,
                "<p class=\"note\">The first {MOST_RUNS} of {} runs are drawn.</p>",
                d.curves.len()
            );
        }
    }
    html
}

/// The channel that misses most, in the first run in which it does: data with both fits, and residuals before and after.
pub fn picture(d: &Diagnosis) -> String {
    let drawn = by_misfit(d).first().and_then(|&c| {
        let place = place(d, c);
        let run =
            d.curves.iter().find(|r| place.is_none_or(|l| l.runs.is_empty() || l.runs.contains(&r.run)));
        run.or(d.curves.first()).map(|curves| charts(d, c, curves))
    });
    let shaded = by_misfit(d).first().is_some_and(|&c| interval(d, c).is_some());
    let words = [headline(d), key(changed(d), shaded)];
    svg::picture(drawn.as_ref().map_or(&[], |pair| pair.as_slice()), &words)
}

/// What the colours mean, of those that are there.
fn key(changed: bool, shaded: bool) -> String {
    let mut key = "Grey: measured. Red: simulated.".to_owned();
    if changed {
        key.push_str(" Blue: with what was found.");
    }
    if shaded {
        key.push_str(" Without the shaded rows the simulation would hold.");
    }
    key
}

/// Whether the diagnosis has a second fit to draw.
fn changed(d: &Diagnosis) -> bool {
    d.law.is_some() || matches!(d.verdict, Verdict::Explained | Verdict::Partly | Verdict::Ambiguous)
}

/// The rows that miss, along the variable of their place.
fn interval(d: &Diagnosis, c: usize) -> Option<(f64, f64)> {
    place(d, c).and_then(|l| Some((l.from?, l.to?))).filter(|_| !d.variables.is_empty())
}

/// The channels, those that miss first.
fn by_misfit(d: &Diagnosis) -> Vec<usize> {
    let mut order: Vec<usize> = (0..d.channels.len()).collect();
    let rank =
        |c: &usize| d.location.iter().position(|l| l.channel == d.channels[*c].0).unwrap_or(usize::MAX);
    order.sort_by_key(rank);
    order
}

/// Where a channel misses.
fn place(d: &Diagnosis, c: usize) -> Option<&Location> {
    d.location.iter().find(|l| l.channel == d.channels[c].0)
}

/// One run's data with both fits, and its residuals.
fn charts(d: &Diagnosis, c: usize, curves: &Curves) -> [String; 2] {
    let (channel, unit) = &d.channels[c];
    let changed = changed(d);
    let place = place(d, c);
    // Plotted along the variable of the located interval, else along the first.
    let variable =
        place.and_then(|l| d.variables.iter().position(|(n, _)| Some(n) == l.variable.as_ref())).unwrap_or(0);
    let shaded = interval(d, c);
    let axis = d.variables.get(variable).map_or_else(|| "row".to_owned(), |(n, _)| n.clone());
    let rows: Vec<f64> = match curves.inputs.get(variable) {
        Some(column) => column.clone(),
        None => (0..curves.measured[c].len()).map(|i| i as f64).collect(),
    };
    let left = |fit: &[f64]| -> Vec<f64> { curves.measured[c].iter().zip(fit).map(|(m, p)| m - p).collect() };
    let (before, after) = (left(&curves.before[c]), left(&curves.after[c]));
    let mut series = vec![
        Series { class: "data", x: &rows, y: &curves.measured[c], points: true },
        Series { class: "before", x: &rows, y: &curves.before[c], points: false },
    ];
    let mut residuals = vec![Series { class: "before", x: &rows, y: &before, points: true }];
    if changed {
        series.push(Series { class: "after", x: &rows, y: &curves.after[c], points: false });
        residuals.push(Series { class: "after", x: &rows, y: &after, points: true });
    }
    let chart = |what: &str, y_label: String, series, shaded, band| {
        let title = format!("run {}: {what}", curves.run);
        Chart { title, x_label: axis.clone(), y_label, series, shaded, band }.render()
    };
    let band = d.noise.iter().find(|n| n.channel == *channel).map(|n| 2.0 * n.sigma);
    [
        chart("measured and simulated", channel.clone(), series, None, None),
        chart("measured less simulated", format!("residual in {unit}"), residuals, shaded, band),
    ]
}

/// Probabilities of the mechanisms as bars.
pub(super) fn probabilities(d: &Diagnosis) -> String {
    let mut html = String::from("<table class=\"bars\">");
    for m in &d.mechanisms {
        let p = m.probability.clamp(0.0, 1.0);
        let class = if d.chosen.contains(&m.id) { "bar chosen" } else { "bar" };
        let why = m
            .ruled_out
            .as_ref()
            .map_or_else(String::new, |r| format!(" <span class=\"note\">alone: {}</span>", escape(r)));
        let _ = write!(
            html,
            "<tr><th scope=\"row\">{}</th><td class=\"track\"><div class=\"{class}\" style=\"width:{:.1}%\"></div></td><td>{}{why}</td></tr>",
            escape(&m.name),
            100.0 * p,
            escape(&probability(p))
        );
    }
    html.push_str("</table>");
    html
}
