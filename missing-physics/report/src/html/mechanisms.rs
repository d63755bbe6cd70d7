//! What is said of mechanisms: parameters and sources, probabilities, or what was tried.

use std::fmt::Write as _;

use missing_physics::diagnosis::{Diagnosis, MechanismReport, Verdict};

use crate::number::{estimate, probability, significant};
use crate::svg::escape;

/// What is known of the mechanisms in the answer, and the sources that are cited for them by a key.
pub(super) fn parameters(d: &Diagnosis, citations: &[String]) -> String {
    let said = |id: &String| d.chosen.contains(id) || d.confused_with.iter().flatten().any(|o| o == id);
    let mut table = String::from(
        "<div class=\"scroll\"><table><tr><th>mechanism</th><th>equation</th><th>parameters</th><th>source</th></tr>",
    );
    let shown: Vec<&MechanismReport> = d.mechanisms.iter().filter(|m| said(&m.id)).collect();
    for m in &shown {
        let values: Vec<String> = m.parameters.iter().map(|e| escape(&estimate(e))).collect();
        // Writing to a string cannot fail.
        let _ = write!(
            table,
            "<tr><td>{}</td><td>{}</td><td class=\"num\">{}</td><td class=\"note\">{}</td></tr>",
            escape(&m.name),
            escape(&m.equation),
            values.join("<br>"),
            escape(&m.reference)
        );
    }
    table.push_str("</table></div>");
    let key = |citation: &str| citation.split_inclusive(']').next().unwrap_or_default().to_owned();
    for citation in citations.iter().filter(|c| shown.iter().any(|m| m.reference.contains(&key(c)))) {
        let _ = write!(table, "<p class=\"note\">{}</p>", escape(citation));
    }
    if shown.is_empty() { String::new() } else { table }
}

/// Probabilities of the mechanisms as bars, where the truth may be among them; else what each of them gains on unseen data. With a title.
pub(super) fn probabilities(d: &Diagnosis) -> (&'static str, String) {
    if d.verdict == Verdict::Unexplained {
        return ("What was tried", tried(d));
    }
    let mut html = String::from("<table class=\"bars\">");
    for m in &d.mechanisms {
        let p = m.probability.clamp(0.0, 1.0);
        let class = if d.chosen.contains(&m.id) { "bar chosen" } else { "bar" };
        let _ = write!(
            html,
            "<tr><th scope=\"row\">{}</th><td class=\"track\"><div class=\"{class}\" style=\"width:{:.1}%\"></div></td><td>{}{}</td></tr>",
            escape(&m.name),
            100.0 * p,
            escape(&probability(p)),
            ruled_out(m)
        );
    }
    ("How probable each mechanism is", html + "</table><p class=\"note\">If the truth is among them.</p>")
}

/// No share of a whole: where none of them explains the data, their probabilities among themselves say nothing.
fn tried(d: &Diagnosis) -> String {
    let mut html = String::from(
        "<p>None of these explains the recording, alone or together with others.</p><div class=\"scroll\"><table><tr><th>mechanism</th><th>gain in log score on unseen data</th><th></th></tr>",
    );
    for m in &d.mechanisms {
        let _ = write!(
            html,
            "<tr><th scope=\"row\">{}</th><td class=\"num\">{}</td><td>{}</td></tr>",
            escape(&m.name),
            significant(m.heldout_log_score_gain, 2),
            ruled_out(m)
        );
    }
    html + "</table></div>"
}

fn ruled_out(m: &MechanismReport) -> String {
    let why = |r: &String| format!(" <span class=\"note\">alone: {}</span>", escape(r));
    m.ruled_out.as_ref().map(why).unwrap_or_default()
}
