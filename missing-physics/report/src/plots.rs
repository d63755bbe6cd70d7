//! The charts of a diagnosis, still.

use missing_physics::diagnosis::{Curves, Diagnosis};

use super::context::ReportContext;
use super::quantity::{axis_label, label};
use super::runs::{self, along, axis, channels, interval, located, residuals, together};
use super::svg::{self, Chart, Series};
use super::text::{changed, headline};

/// For each channel the run that misses most: data with both fits, and residuals before and after.
pub(super) fn still(d: &Diagnosis, context: &ReportContext) -> String {
    let figure = |chart: &String| format!("<figure>{chart}</figure>");
    let of = |c: usize| charts(d, context, c).iter().map(figure).collect::<String>();
    channels(d).into_iter().map(|c| format!("<div class=\"charts\">{}</div>", of(c))).collect()
}

/// The channel that misses most, in the run in which it misses most: data with both fits, and residuals before and after.
pub fn picture(d: &Diagnosis, context: &ReportContext) -> String {
    let worst = channels(d).first().copied();
    let drawn = worst.map(|c| charts(d, context, c)).unwrap_or_default();
    let shaded = worst.is_some_and(|c| shade(d, c).is_some());
    svg::picture(&drawn, &[headline(d), key(changed(d), shaded)])
}

/// What the colours mean, of those that are there.
fn key(changed: bool, shaded: bool) -> String {
    let mut key = "Grey: measured. Red: simulated.".to_owned();
    if changed {
        key.push_str(" Blue: with what was found.");
    }
    if shaded {
        key.push_str(" The misfit is traced to the shaded rows.");
    }
    key
}

/// The interval of a channel, if it lies in what is drawn.
fn shade(d: &Diagnosis, c: usize) -> Option<(f64, f64)> {
    let drawn = together(d) || runs::worst(d).is_some_and(|run| located(d, c, &d.curves[run].run));
    interval(d, c).filter(|_| drawn)
}

/// What is drawn of a channel: axis, readings, both fits and what they leave.
#[derive(Default)]
struct Rows {
    axis: Vec<f64>,
    measured: Vec<f64>,
    fits: [Vec<f64>; 2],
    left: [Vec<f64>; 2],
}

impl Rows {
    fn add(&mut self, d: &Diagnosis, c: usize, curves: &Curves) {
        self.axis.extend(along(curves, axis(d, c)));
        self.measured.extend(&curves.measured[c]);
        for (k, fit) in [&curves.before, &curves.after].into_iter().enumerate() {
            self.fits[k].extend(&fit[c]);
            self.left[k].extend(residuals(curves, fit, c));
        }
    }
}

/// Data of the worst run, or of all where runs are but a row or two, with both fits; and residuals.
fn charts(d: &Diagnosis, context: &ReportContext, c: usize) -> Vec<String> {
    let mut rows = Rows::default();
    let together = together(d);
    let title = if together {
        d.curves.iter().for_each(|curves| rows.add(d, c, curves));
        format!("all {} runs", d.curves.len())
    } else {
        let Some(curves) = runs::worst(d).map(|run| &d.curves[run]) else { return Vec::new() };
        rows.add(d, c, curves);
        if d.curves.len() > 1 {
            format!("the run that misses most, {}", curves.run)
        } else {
            format!("run {}", curves.run)
        }
    };
    let fits = if changed(d) { 2 } else { 1 };
    let classes = ["before", "after"];
    let of = |columns: &'static str, k: usize, points| Series {
        class: classes[k],
        x: &rows.axis,
        y: if columns == "fits" { &rows.fits[k] } else { &rows.left[k] },
        points,
    };
    // Readings stand on top of the lines.
    let mut series: Vec<Series<'_>> = (0..fits).map(|k| of("fits", k, together)).collect();
    series.push(Series { class: "data", x: &rows.axis, y: &rows.measured, points: true });
    let residual = (0..fits).map(|k| of("left", k, true)).collect();
    let unit = &d.channels[c].1;
    let left_label = if unit.is_empty() {
        "measured less simulated".into()
    } else {
        format!("measured less simulated ({unit})")
    };
    let chart = |y_label: String, series, shaded, band| {
        Chart {
            title: title.clone(),
            x_label: axis_label(d, context, axis(d, c)),
            y_label,
            series,
            shaded,
            band,
        }
        .render()
    };
    vec![
        chart(label(context, &d.channels[c]), series, None, None),
        chart(left_label, residual, shade(d, c), runs::sigma(d, c).map(|s| 2.0 * s)),
    ]
}

/// Data of the worst run with both fits, small.
pub(super) fn thumbnail(d: &Diagnosis, context: &ReportContext) -> String {
    let chart = channels(d).first().and_then(|&c| charts(d, context, c).into_iter().next());
    chart.map(|chart| format!("<figure>{chart}</figure>")).unwrap_or_default()
}
