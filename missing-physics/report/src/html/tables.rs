//! The tables of a report.

use std::fmt::Write as _;

use missing_physics::diagnosis::{Confusion, Diagnosis, Outlier, listed};

use super::list;
use crate::context::ReportContext;
use crate::number::significant;
use crate::quantity::label;
use crate::runs::{by_misfit, residuals, sigma};
use crate::svg::escape;
use crate::text::changed;

/// Errors by channel, and how many readings lie within twice the noise.
pub(super) fn errors(d: &Diagnosis, context: &ReportContext) -> String {
    let mut table = String::from(
        "<div class=\"scroll\"><table><tr><th>channel</th><th>simulated, all data</th><th>now, all data</th><th>simulated, unseen data</th><th>now, unseen data</th><th>within twice the noise (95 % expected)</th></tr>",
    );
    for (before, after) in d.before.iter().zip(&d.after) {
        let channel = d.channels.iter().position(|(n, _)| *n == before.channel);
        let unit = channel.map_or("", |c| d.channels[c].1.as_str());
        let cell = |v: f64| format!("<td class=\"num\">{} {}</td>", significant(v, 3), escape(unit));
        // Writing to a string cannot fail.
        let _ = write!(
            table,
            "<tr><th scope=\"row\">{}</th>{}{}{}{}<td class=\"num\">{}</td></tr>",
            escape(&channel.map_or_else(|| before.channel.clone(), |c| label(context, &d.channels[c]))),
            cell(before.rmse),
            cell(after.rmse),
            cell(before.heldout_rmse),
            cell(after.heldout_rmse),
            channel.map(|c| within(d, c)).unwrap_or_default()
        );
    }
    table + "</table></div>"
}

/// The share of readings within two sigmas of the simulation, before and after.
fn within(d: &Diagnosis, c: usize) -> String {
    let Some(sigma) = sigma(d, c) else { return String::new() };
    let share = |after: bool| {
        let (mut inside, mut all) = (0_usize, 0_usize);
        for curves in &d.curves {
            let fit = if after { &curves.after } else { &curves.before };
            for left in residuals(curves, fit, c).filter(|v| v.is_finite()) {
                all += 1;
                inside += usize::from(left.abs() <= 1.96 * sigma);
            }
        }
        100.0 * inside as f64 / all.max(1) as f64
    };
    if changed(d) {
        format!("{:.0} %, now {:.0} %", share(false), share(true))
    } else {
        format!("{:.0} %", share(false))
    }
}

/// Every run, those that miss most first.
pub(super) fn runs(d: &Diagnosis) -> String {
    let order = by_misfit(d);
    if order.len() < 2 {
        return String::new();
    }
    let mut table = format!(
        "<details><summary>All {} runs, those that miss most first</summary><div class=\"scroll\"><table><tr><th>run</th><th>rows</th><th>simulated, off by</th>{}</tr>",
        order.len(),
        if changed(d) { "<th>now</th>" } else { "" }
    );
    for misfit in order {
        let curves = &d.curves[misfit.run];
        let now = if changed(d) {
            format!("<td class=\"num\">{} sigma</td>", significant(misfit.after, 2))
        } else {
            String::new()
        };
        let _ = write!(
            table,
            "<tr><th scope=\"row\">{}</th><td class=\"num\">{}</td><td class=\"num\">{} sigma</td>{now}</tr>",
            escape(&curves.run),
            curves.measured.first().map_or(0, Vec::len),
            significant(misfit.before, 2)
        );
    }
    table
        + "</table></div><p class=\"note\">Root mean square over all readings of a run; one sigma is the noise of a reading.</p></details>"
}

/// Shares of data from each rival that were taken for each.
pub(super) fn confusion(confusion: &Confusion) -> String {
    let mut table = String::from("<div class=\"scroll\"><table><tr><th>data from</th>");
    for set in &confusion.sets {
        let _ = write!(table, "<th>taken for {}</th>", escape(&listed(set)));
    }
    table.push_str("</tr>");
    for (set, row) in confusion.sets.iter().zip(&confusion.matrix) {
        let _ = write!(table, "<tr><th scope=\"row\">{}</th>", escape(&listed(set)));
        for share in row {
            let _ = write!(
                table,
                "<td class=\"num\" style=\"background:color-mix(in srgb,var(--after) {:.0}%,transparent)\">{:.0} %</td>",
                50.0 * share,
                100.0 * share
            );
        }
        table.push_str("</tr>");
    }
    table + "</table></div><p class=\"note\">By simulation from each rival's fit.</p>"
}

/// The rows that were set aside, a line each.
pub(super) fn outliers(d: &Diagnosis) -> String {
    let line = |o: &Outlier| {
        format!(
            "run {}, row {}, {}: {:.0} sigma from what all other rows say",
            o.run,
            o.row + 1,
            o.channel,
            o.z.abs()
        )
    };
    list(&d.outliers.iter().map(line).collect::<Vec<_>>())
}

/// The tests of adequacy, folded away; what was found is tested by the same.
pub(super) fn tests(d: &Diagnosis) -> String {
    let mut table = match d.final_p_value {
        Some(p) => format!("<p>With what was found: p = {}.</p>", significant(p, 2)),
        None => String::new(),
    };
    table.push_str("<details><summary>The tests behind the p-value</summary><div class=\"scroll\"><table><tr><th>test</th><th>statistic</th><th>its own p</th></tr>");
    for t in &d.tests {
        let _ = write!(
            table,
            "<tr><td>{}</td><td class=\"num\">{}</td><td class=\"num\">{}</td></tr>",
            escape(&t.name),
            significant(t.statistic, 3),
            significant(t.p_value, 2)
        );
    }
    table + "</table></div></details>"
}
