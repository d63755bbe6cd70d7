//! The score as a page: table, confusion matrices, power curves, and ten worlds with their reports.

use std::fmt::Write as _;

use rand::SeedableRng as _;
use rand::seq::IndexedRandom as _;
use rand_chacha::ChaCha8Rng;

use super::key::word;
use super::score::{DomainScore, Score};
use super::table::MEASURES;
use super::world::Judged;
use missing_physics_report::page::{CHART_STYLE, Chart, STYLE, Series, escape};

/// Worlds that are shown.
const SHOWN: usize = 10;

/// The page.
pub(super) fn page(score: &Score, judged: &[Judged], seal: &str, seed: u64) -> String {
    let mut page = format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>The proof</title><style>{CHART_STYLE}{STYLE}.heat td{{text-align:center;border:1px solid var(--line);padding:.25rem .4rem}}.heat th{{font-weight:400;font-size:.85rem}}</style></head><body><h1>Concealed effects: how often the tool is right, wrong and silent</h1><p class=\"note\">{} worlds, seed {seed}. Answers sealed before any diagnosis: SHA-256 <code>{seal}</code> of keys.jsonl.</p>",
        judged.len()
    );
    page.push_str(&scores(score));
    for domain in &score.domains {
        // Writing to a string cannot fail.
        let _ = write!(page, "<h2>{}</h2>{}{}", escape(&domain.domain), matrix(domain), power(domain));
    }
    page.push_str(&shown(judged, seed));
    page.push_str("</body></html>\n");
    page
}

fn scores(score: &Score) -> String {
    let columns: Vec<&DomainScore> = score.domains.iter().chain([&score.all]).collect();
    let mut table = String::from("<h2>The score</h2><table><tr><th></th><th>wanted</th>");
    columns.iter().for_each(|s| _ = write!(table, "<th>{}</th>", escape(&s.domain)));
    for (name, wanted, show) in &MEASURES {
        let _ = write!(table, "</tr><tr><td>{}</td><td>{}</td>", escape(name), escape(wanted));
        columns.iter().for_each(|s| _ = write!(table, "<td class=\"num\">{}</td>", escape(&show(s))));
    }
    table
        + "</tr></table><p class=\"note\">The data decide where the true mechanisms, refitted, have a log Bayes factor of at least 5 against every set that lacks one of them.</p>"
}

/// What was answered to each single hidden mechanism.
fn matrix(domain: &DomainScore) -> String {
    let mut answers: Vec<&String> = domain.confusion.values().flat_map(|row| row.keys()).collect();
    answers.sort();
    answers.dedup();
    // Mechanisms in the order of the rows, then everything else.
    answers.sort_by_key(|a| !domain.confusion.contains_key(*a));
    let mut table =
        String::from("<h3>One mechanism hidden: what was answered</h3><table class=\"heat\"><tr><th></th>");
    answers.iter().for_each(|a| _ = write!(table, "<th>{}</th>", escape(a)));
    for (truth, row) in &domain.confusion {
        let total: usize = row.values().sum();
        let _ = write!(table, "</tr><tr><th>{}</th>", escape(truth));
        for answer in &answers {
            let count = row.get(*answer).copied().unwrap_or(0);
            let share = 100.0 * count as f64 / total.max(1) as f64;
            let colour = if *answer == truth { "--after" } else { "--before" };
            let text = if count > 0 { count.to_string() } else { String::new() };
            let _ = write!(
                table,
                "<td style=\"background:color-mix(in srgb,var({colour}) {share:.0}%,transparent)\">{text}</td>"
            );
        }
    }
    table + "</tr></table>"
}

/// Detection against the size of the effect.
fn power(domain: &DomainScore) -> String {
    let sizes: Vec<f64> = domain.power.iter().map(|p| p.0).collect();
    let tool: Vec<f64> = domain.power.iter().map(|p| p.1.rate()).collect();
    let test: Vec<f64> = domain.power.iter().map(|p| p.2.rate()).collect();
    if sizes.len() < 2 {
        return String::new();
    }
    let line = |class, y| Series { class, x: &sizes, y, points: false };
    let chart = Chart {
        title: "Detected at 5 %".into(),
        x_label: "size: square root of the oracle's likelihood ratio".into(),
        y_label: "share".into(),
        series: vec![line("before", &test), line("after", &tool)],
        shaded: None,
        band: None,
    };
    format!(
        "<figure style=\"max-width:30rem\">{}<figcaption class=\"key\"><span><i style=\"background:var(--after)\"></i>the tool</span><span><i style=\"background:var(--before)\"></i>a likelihood-ratio test that knows the truth</span></figcaption></figure>",
        chart.render()
    )
}

/// Ten worlds drawn at random, whatever became of them.
fn shown(judged: &[Judged], seed: u64) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut table = String::from(
        "<h2>Ten worlds, drawn at random</h2><table><tr><th>world</th><th>hidden</th><th>answered</th><th>p</th></tr>",
    );
    for w in judged.sample(&mut rng, SHOWN) {
        let hidden = match (&w.key.unlisted, w.key.mechanisms.as_slice()) {
            (Some(words), _) => format!("unlisted: {words}"),
            (None, []) => word(w.key.hidden).into(),
            (None, ids) => ids.join(" + "),
        };
        let mut answer = w.outcome.verdict.clone();
        if !w.outcome.chosen.is_empty() {
            let _ = write!(answer, ": {}", w.outcome.chosen.join(" + "));
        }
        for rival in &w.outcome.confused_with {
            let _ = write!(answer, " or {}", rival.join(" + "));
        }
        let _ = write!(
            table,
            "<tr><td><a href=\"{0}/report.html\">{0}</a></td><td>{1}</td><td>{2}</td><td class=\"num\">{3:.3}</td></tr>",
            escape(&w.name),
            escape(&hidden),
            escape(&answer),
            w.outcome.p_value
        );
    }
    table + "</table>"
}
