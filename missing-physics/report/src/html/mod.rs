//! One self-contained page: a report to be read, and its runs to be explored. It asks for nothing from anywhere.

mod index;
mod mechanisms;
mod tables;

use std::fmt::Write as _;

use missing_physics::diagnosis::{Diagnosis, Law, NextExperiment, Verdict, listed};

use super::context::ReportContext;
use super::figure::FIGURE_STYLE;
use super::number::{estimate, p_value, significant};
use super::svg::{CHART_STYLE, escape};
use super::text::{
    as_if, closest, headline, law_kind, left_by_law, leftover_sentence, limits, noise_sentence, runs,
    where_sentence,
};
use super::{corner, explore, plots};

pub use index::{Entry, index};

/// Style of a page.
pub const STYLE: &str = include_str!("page.css");

/// Style of what a diagnosis has beyond other pages: the explorer and the corner plot.
const REPORT_STYLE: &str = "
[hidden]{display:none!important}.controls{display:flex;flex-wrap:wrap;gap:.4rem;margin:.6rem 0;align-items:center}.controls select,.controls button{font:inherit;font-size:.9rem;color:var(--ink);background:var(--card);border:1px solid var(--line);border-radius:.4rem;padding:.2rem .5rem;max-width:100%}
.controls button:hover{border-color:var(--soft)}.controls label{font-size:.9rem}svg.mark{display:inline-block;width:22px;height:10px;margin-right:.35rem;vertical-align:baseline}.plot{overflow:hidden}.u-select{background:var(--shade)}.where{min-height:1.5em;margin-top:0}.key{margin:.4rem 0}
@media print{.controls,.where{display:none}.uplot,.u-wrap,.uplot canvas{width:100%!important;height:auto!important}}svg.corner{max-width:100%}svg.corner text.s{font-size:9.5px}.frame{fill:none;stroke:var(--line)}.mass{fill:var(--after);fill-opacity:.16;stroke:var(--after);stroke-width:1}.tie{fill:var(--after)}
";

/// Nothing is asked for from anywhere, whatever names a recording has.
const POLICY: &str = "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'\">";

/// The page.
pub fn html(d: &Diagnosis, context: &ReportContext) -> String {
    let mut page = String::with_capacity(128 * 1024);
    page.push_str(&head(d, context));
    page.push_str(&explore::section(d, context, &format!("{}{CURVES_KEY}", plots::still(d, context))));
    for figure in &context.figures {
        section(&mut page, &figure.title, &figure.html());
    }
    let wrong = d.verdict != Verdict::Adequate;
    if wrong {
        section(&mut page, "What was left out", &mechanisms::parameters(d, &context.citations));
        let (title, body) = mechanisms::probabilities(d);
        section(&mut page, title, &body);
    }
    section(&mut page, "What comes closest", &list(&closest(d)));
    section(&mut page, "The law in the residual", &d.law.as_ref().map(|of| law(d, of)).unwrap_or_default());
    let misses: Vec<String> = d.location.iter().map(|l| where_sentence(d, l)).chain(as_if(d)).collect();
    section(&mut page, "Where it misses", &list(&misses));
    section(&mut page, "How much better", &tables::errors(d, context));
    section(&mut page, "Runs that differ", &list(&runs(d)));
    section(&mut page, "What would have shown, if larger", &list(&limits(d)));
    let unsure: Vec<String> = d.undetermined.iter().chain(&d.remarks).cloned().collect();
    section(&mut page, "What these data cannot say", &list(&unsure));
    let confused = d.confusion.as_ref().map(tables::confusion).unwrap_or_default();
    section(&mut page, "How the rivals are confused", &confused);
    section(&mut page, "Do this next", &d.next_experiment.as_ref().map(next).unwrap_or_default());
    let left: Vec<String> = d.leftover.iter().map(|l| leftover_sentence(d, l)).collect();
    section(&mut page, "What is left", &list(&left));
    section(&mut page, "Parameters together", &corner::corner(d));
    section(&mut page, "Run by run", &tables::runs(d));
    let noise: Vec<String> = d.noise.iter().map(|n| noise_sentence(d, n)).collect();
    section(&mut page, "Noise", &list(&noise));
    section(&mut page, "Rows set aside", &tables::outliers(d));
    section(&mut page, &format!("Adequacy of the baseline: {}", p_value(d)), &tables::tests(d));
    page.push_str(&foot(context));
    page.push_str("</body></html>\n");
    page
}

/// Everything before the first section: style, title, verdict, headline, baseline.
fn head(d: &Diagnosis, context: &ReportContext) -> String {
    let word = d.verdict.word();
    let runs = if d.curves.len() == 1 { "1 run".into() } else { format!("{} runs", d.curves.len()) };
    let title = format!("{}: {word}", context.title);
    opening(&title)
        + &format!(
            "<p class=\"kicker\">{0} &#183; {1} &#183; {runs}</p><p><span class=\"verdict {word}\">{word}</span></p><h1>{2}</h1><p>Baseline: {3}.</p>",
            escape(&context.title),
            escape(&context.domain),
            escape(&headline(d)),
            escape(&d.baseline)
        )
}

/// A page from its beginning to its body.
fn opening(title: &str) -> String {
    format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">{POLICY}<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>{}</title><style>{CHART_STYLE}{STYLE}{REPORT_STYLE}{FIGURE_STYLE}</style></head><body>",
        escape(title)
    )
}

/// What the answer was made from, and how to make it again.
fn foot(context: &ReportContext) -> String {
    let Some(known) = context.provenance.as_object() else { return String::new() };
    let said = |key: &str| known.get(key).map(ToString::to_string).unwrap_or_default();
    let (seed, alpha) = (said("seed"), said("alpha"));
    let files = known.get("sha256").and_then(|files| files.as_object());
    let files: Vec<String> = files
        .into_iter()
        .flatten()
        .map(|(name, hash)| format!("{name}: {}", hash.as_str().unwrap_or_default()))
        .collect();
    format!(
        "<footer class=\"note\"><p>missing-physics {}, seed {}, alpha {}. The same again: <code>missing-physics diagnose '{}' --seed {1} --alpha {2}</code>. SHA-256 of what was read:</p>{}</footer>",
        escape(known.get("version").and_then(|v| v.as_str()).unwrap_or_default()),
        escape(&seed),
        escape(&alpha),
        escape(&context.recording.replace('\'', "'\\''")),
        list(&files)
    )
}

/// A law with its kind and its coefficients.
fn law(d: &Diagnosis, law: &Law) -> String {
    let coefficients: Vec<String> =
        law.coefficients.iter().map(estimate).chain(left_by_law(d, law)).collect();
    format!(
        "<p><code>{}</code></p><p class=\"note\">{}</p>{}",
        escape(&law.formula),
        escape(law_kind(law.kind)),
        list(&coefficients)
    )
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
const CURVES_KEY: &str = "<p class=\"key note\"><span><i style=\"background:var(--data)\"></i>measured</span><span><i style=\"background:var(--before)\"></i>simulated</span><span><i style=\"background:var(--after)\"></i>with what was found</span><span><i style=\"background:var(--shade);height:.8rem\"></i>rows to which the misfit is traced</span><span><i style=\"background:var(--band);height:.8rem\"></i>twice the noise</span></p>";

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
