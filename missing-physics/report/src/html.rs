//! One self-contained page: no script, no other file.

use std::fmt::Write as _;

use missing_physics::diagnosis::{
    Confusion, Diagnosis, Law, MechanismReport, NextExperiment, Outlier, Verdict,
};

use super::context::ReportContext;
use super::number::{estimate, listed, p_value, significant};
use super::plots;
use super::svg::{CHART_STYLE, escape};
use super::text::{closest, headline, law_kind, leftover_sentence, limits, noise_sentence, where_sentence};

/// Style of a page.
pub const STYLE: &str = "
*{box-sizing:border-box}body{margin:0 auto;max-width:1020px;padding:2rem 1.2rem 4rem;font:16px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper)}
h1{font-size:1.6rem;line-height:1.25;margin:.2rem 0 1rem}h2{font-size:1.15rem;margin:2.2rem 0 .6rem;border-bottom:1px solid var(--line);padding-bottom:.2rem}h3{font-size:1rem;margin:1.2rem 0 .3rem}
.kicker,.note,figcaption{color:var(--soft);font-size:.88rem}.verdict{display:inline-block;padding:.1rem .6rem;border-radius:1rem;background:var(--after);color:var(--paper);font-weight:600;font-size:.85rem}
.verdict.unexplained{background:var(--before)}table{border-collapse:collapse;margin:.4rem 0;width:100%;font-size:.93rem}th,td{text-align:left;padding:.3rem .7rem .3rem 0;border-bottom:1px solid var(--line);vertical-align:top}th{font-weight:600}
.num{font-variant-numeric:tabular-nums}.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(340px,1fr));gap:.6rem}figure{margin:0;background:var(--card);border-radius:.5rem;padding:.3rem}
svg{width:100%;height:auto;display:block}
.key span{margin-right:1.2rem}.key i{display:inline-block;width:1.4rem;height:.22rem;vertical-align:middle;margin-right:.35rem}.bars th{width:14rem;font-weight:400}.track{width:45%}.bar{height:.8rem;border-radius:.2rem;background:var(--data);min-width:2px}.bar.chosen{background:var(--after)}
ul{margin:.3rem 0;padding-left:1.2rem}code{font-size:.92em}@media print{body{max-width:none;padding:0}figure{break-inside:avoid}}
";

/// The page.
pub fn html(d: &Diagnosis, context: &ReportContext) -> String {
    let mut page = String::with_capacity(64 * 1024);
    page.push_str(&head(d, context));
    let misses: Vec<String> = d.location.iter().map(|l| where_sentence(d, l)).collect();
    section(&mut page, "Where it misses", &list(&misses));
    if d.verdict != Verdict::Adequate {
        section(&mut page, "How probable each mechanism is", &plots::probabilities(d));
        section(&mut page, "What was left out", &parameters(d, &context.citations));
    }
    section(&mut page, "What comes closest", &list(&closest(d)));
    section(&mut page, "The law in the residual", &d.law.as_ref().map(law).unwrap_or_default());
    section(&mut page, "How much better", &errors(d));
    let left: Vec<String> = d.leftover.iter().map(|l| leftover_sentence(d, l)).collect();
    section(&mut page, "What is left", &list(&left));
    section(&mut page, "What would have shown, if larger", &list(&limits(d)));
    let confused = d.confusion.as_ref().map(confusion).unwrap_or_default();
    section(&mut page, "How the rivals are confused", &confused);
    section(&mut page, "Do this next", &d.next_experiment.as_ref().map(next).unwrap_or_default());
    let unsure: Vec<String> = d.undetermined.iter().chain(&d.remarks).cloned().collect();
    section(&mut page, "What these data cannot say", &list(&unsure));
    section(&mut page, "Data and fits", &format!("{CURVES_KEY}{}", plots::channels(d)));
    let noise: Vec<String> = d.noise.iter().map(|n| noise_sentence(d, n)).collect();
    section(&mut page, "Noise", &list(&noise));
    section(&mut page, "Rows set aside", &outliers(d));
    section(&mut page, &format!("Adequacy of the baseline: {}", p_value(d)), &tests(d));
    page.push_str(&foot(context));
    page.push_str("</body></html>\n");
    page
}

/// Everything before the first section: style, title, verdict, headline, baseline.
fn head(d: &Diagnosis, context: &ReportContext) -> String {
    let word = d.verdict.word();
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>{0}: {word}</title><style>{CHART_STYLE}{STYLE}</style></head><body><p class=\"kicker\">{0} &#183; {1} &#183; {2} runs</p><p><span class=\"verdict {word}\">{word}</span></p><h1>{3}</h1><p>Baseline: {4}.</p>",
        escape(&context.title),
        escape(&context.domain),
        d.curves.len(),
        escape(&headline(d)),
        escape(&d.baseline)
    )
}

/// What the answer was made from.
fn foot(context: &ReportContext) -> String {
    let Some(known) = context.provenance.as_object() else { return String::new() };
    let said = |key: &str| known.get(key).map(ToString::to_string).unwrap_or_default();
    let files = known.get("sha256").and_then(|files| files.as_object());
    let files: Vec<String> = files
        .into_iter()
        .flatten()
        .map(|(name, hash)| format!("{name}: {}", hash.as_str().unwrap_or_default()))
        .collect();
    format!(
        "<footer class=\"note\"><p>missing-physics {}, seed {}, alpha {}. SHA-256 of what was read:</p>{}</footer>",
        escape(known.get("version").and_then(|v| v.as_str()).unwrap_or_default()),
        escape(&said("seed")),
        escape(&said("alpha")),
        list(&files)
    )
}

/// A law with its kind and its coefficients.
fn law(law: &Law) -> String {
    let coefficients: Vec<String> = law.coefficients.iter().map(estimate).collect();
    format!(
        "<p><code>{}</code></p><p class=\"note\">{}</p>{}",
        escape(&law.formula),
        escape(law_kind(law.kind)),
        list(&coefficients)
    )
}

/// Shares of data from each rival that were taken for each.
fn confusion(confusion: &Confusion) -> String {
    let mut table = String::from("<table><tr><th>data from</th>");
    // Writing to a string cannot fail.
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
    table + "</table><p class=\"note\">By simulation from each rival's fit.</p>"
}

/// The next experiment and what it separates.
fn next(next: &NextExperiment) -> String {
    format!(
        "<p>{}: separates {} (expected log Bayes factor {}).</p>",
        escape(&next.words),
        escape(&listed(&next.separates)),
        significant(next.expected_log_bayes_factor, 2)
    )
}

/// What the colours of the curves mean.
const CURVES_KEY: &str = "<p class=\"key note\"><span><i style=\"background:var(--data)\"></i>measured</span><span><i style=\"background:var(--before)\"></i>baseline</span><span><i style=\"background:var(--after)\"></i>with what was found</span><span><i style=\"background:var(--shade);height:.8rem\"></i>without these rows the baseline would hold</span><span><i style=\"background:var(--band);height:.8rem\"></i>twice the noise</span></p>";

/// The rows that were set aside, a line each.
fn outliers(d: &Diagnosis) -> String {
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

/// The tests of adequacy, folded away.
fn tests(d: &Diagnosis) -> String {
    let mut table = String::from(
        "<details><summary>The tests behind the p-value</summary><table><tr><th>test</th><th>statistic</th><th>its own p</th></tr>",
    );
    for t in &d.tests {
        let _ = write!(
            table,
            "<tr><td>{}</td><td class=\"num\">{}</td><td class=\"num\">{}</td></tr>",
            escape(&t.name),
            significant(t.statistic, 3),
            significant(t.p_value, 2)
        );
    }
    table + "</table></details>"
}

/// A section; nothing where it would be empty.
fn section(page: &mut String, title: &str, body: &str) {
    if !body.is_empty() {
        let _ = write!(page, "<section><h2>{}</h2>{body}</section>", escape(title));
    }
}

fn list(lines: &[String]) -> String {
    if lines.is_empty() {
        return String::new();
    }
    let items: String = lines.iter().map(|l| format!("<li>{}</li>", escape(l))).collect();
    format!("<ul>{items}</ul>")
}

/// What is known of the mechanisms in the answer, and the sources that are cited for them by a key.
fn parameters(d: &Diagnosis, citations: &[String]) -> String {
    let said = |id: &String| d.chosen.contains(id) || d.confused_with.iter().flatten().any(|o| o == id);
    let mut table =
        String::from("<table><tr><th>mechanism</th><th>equation</th><th>parameters</th><th>source</th></tr>");
    let shown: Vec<&MechanismReport> = d.mechanisms.iter().filter(|m| said(&m.id)).collect();
    for m in &shown {
        let values: Vec<String> = m.parameters.iter().map(|e| escape(&estimate(e))).collect();
        let _ = write!(
            table,
            "<tr><td>{}</td><td>{}</td><td class=\"num\">{}</td><td class=\"note\">{}</td></tr>",
            escape(&m.name),
            escape(&m.equation),
            values.join("<br>"),
            escape(&m.reference)
        );
    }
    table.push_str("</table>");
    let key = |citation: &str| citation.split_inclusive(']').next().unwrap_or_default().to_owned();
    for citation in citations.iter().filter(|c| shown.iter().any(|m| m.reference.contains(&key(c)))) {
        let _ = write!(table, "<p class=\"note\">{}</p>", escape(citation));
    }
    if shown.is_empty() { String::new() } else { table }
}

fn errors(d: &Diagnosis) -> String {
    let mut table = String::from(
        "<table><tr><th>channel</th><th>baseline, all data</th><th>now, all data</th><th>baseline, unseen data</th><th>now, unseen data</th></tr>",
    );
    for (before, after) in d.before.iter().zip(&d.after) {
        let unit =
            d.channels.iter().find(|(n, _)| *n == before.channel).map(|(_, u)| u.clone()).unwrap_or_default();
        let cell = |v: f64| format!("<td class=\"num\">{} {}</td>", significant(v, 3), escape(&unit));
        let _ = write!(
            table,
            "<tr><th scope=\"row\">{}</th>{}{}{}{}</tr>",
            escape(&before.channel),
            cell(before.rmse),
            cell(after.rmse),
            cell(before.heldout_rmse),
            cell(after.heldout_rmse)
        );
    }
    table.push_str("</table>");
    table
}
