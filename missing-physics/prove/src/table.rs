//! The score as a table.

use super::score::{DomainScore, Part, Score};

/// A measure: its name, what is wanted of it, and how it reads in a domain.
pub(super) type Measure = (&'static str, &'static str, fn(&DomainScore) -> String);

/// All measures, in the order of the table.
pub(super) const MEASURES: [Measure; 23] = [
    ("false alarms at 5 %", "in the band", |s| banded(s.alarms_5, 0.05)),
    ("false alarms at 1 %", "in the band", |s| banded(s.alarms_1, 0.01)),
    ("listed effects detected", "", |s| part(s.detected)),
    ("  by an oracle's test", "", |s| part(s.oracle_detected)),
    ("where the data decide: named right", ">= 90 %", |s| part(s.right)),
    ("  honestly ambiguous", "", |s| part(s.ambiguous)),
    ("  wrong name", "<= 5 %", |s| part(s.wrong)),
    ("  answer set holds the truth", ">= 95 %", |s| part(s.holds)),
    ("  sets in an answer", "<= 2", |s| number(s.set_size, 2)),
    ("wrong name, of all listed", "<= 5 %", |s| part(s.wrong_of_all)),
    ("named right: a leftover said", "<= 5 %", |s| part(s.leftover_alarms)),
    ("unlisted and doubted: unexplained", ">= 80 %", |s| part(s.unexplained)),
    ("a leftover beside: main cause named", ">= 90 %", |s| part(s.main_cause)),
    ("  in the answer, with rivals", "", |s| part(s.main_cause_among)),
    ("  a wrong name", "", |s| part(s.wrong_beside)),
    ("  leftover said", ">= 90 %", |s| part(s.leftover_said)),
    ("    where an oracle finds it", ">= 90 %", |s| part(s.leftover_shown)),
    ("  intervals that hold the truth", ">= 90 %", |s| part(s.covered_beside)),
    ("imitated by the list: wrong name", "<= 5 %", |s| part(s.imitated)),
    ("local effects located (p <= 0.001)", ">= 95 %", |s| part(s.located)),
    ("intervals that hold the truth", "93 to 97 %", |s| part(s.covered)),
    ("error left out / true model's", "<= 1.05", |s| number(s.heldout_ratio, 3)),
    ("median time of a diagnosis, s", "", |s| number(s.seconds, 1)),
];

fn part(p: Part) -> String {
    if p.of == 0 { "-".into() } else { format!("{}/{} ({:.0} %)", p.hits, p.of, 100.0 * p.rate()) }
}

fn banded(p: Part, rate: f64) -> String {
    let [low, high] = p.band(rate);
    if p.of == 0 { "-".into() } else { format!("{}/{} ({low} to {high})", p.hits, p.of) }
}

fn number(value: f64, decimals: usize) -> String {
    if value.is_finite() { format!("{value:.decimals$}") } else { "-".into() }
}

/// The table as text.
pub(super) fn table(score: &Score) -> String {
    let columns: Vec<&DomainScore> = score.domains.iter().chain([&score.all]).collect();
    let mut rows = vec![vec![String::new(), "wanted".into()]];
    rows[0].extend(columns.iter().map(|s| s.domain.clone()));
    for (name, wanted, show) in &MEASURES {
        let mut row = vec![(*name).to_owned(), (*wanted).to_owned()];
        row.extend(columns.iter().map(|s| show(s)));
        rows.push(row);
    }
    let width = |column: usize| rows.iter().map(|r| r[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns.len() + 2).map(width).collect();
    let mut text = String::new();
    for row in &rows {
        let cells: Vec<String> = row.iter().zip(&widths).map(|(cell, w)| format!("{cell:<w$}")).collect();
        text.push_str(cells.join("  ").trim_end());
        text.push('\n');
    }
    text
}
