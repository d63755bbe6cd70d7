//! A page over many reports.

use std::fmt::Write as _;

use missing_physics::diagnosis::Diagnosis;

use super::opening;
use crate::context::ReportContext;
use crate::plots::thumbnail;
use crate::svg::escape;
use crate::text::headline;

/// A report among others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    title: String,
    domain: String,
    /// The verdict's word; nothing where there is no report.
    verdict: &'static str,
    /// The headline, or why there is no report.
    words: String,
    link: String,
    picture: String,
}

impl Entry {
    /// A report that lies in the file `link`, beside the index.
    pub fn new(d: &Diagnosis, context: &ReportContext, link: &str) -> Self {
        Self {
            title: context.title.clone(),
            domain: context.domain.clone(),
            verdict: d.verdict.word(),
            words: headline(d),
            link: link.into(),
            picture: thumbnail(d, context),
        }
    }

    /// A recording that has no report, and why.
    pub fn failed(title: &str, why: &str) -> Self {
        let (domain, link, picture) = (String::new(), String::new(), String::new());
        Self { title: title.into(), domain, verdict: "", words: why.into(), link, picture }
    }
}

/// The page: a card for each recording, with its verdict, its headline and its worst run.
pub fn index(entries: &[Entry]) -> String {
    let mut page = opening("Diagnoses");
    page.push_str("<style>.cards{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(300px,100%),1fr));gap:.8rem}.card{display:block;color:inherit;text-decoration:none;border:1px solid var(--line);border-radius:.5rem;padding:.7rem}a.card:hover{border-color:var(--soft)}.card p{margin:.3rem 0}</style>");
    let verdicts = ["unexplained", "partly", "ambiguous", "explained", "adequate"];
    let count = |word: &str| entries.iter().filter(|e| e.verdict == word).count();
    let mut counts: Vec<String> =
        verdicts.iter().filter(|w| count(w) > 0).map(|w| format!("{} {w}", count(w))).collect();
    if count("") > 0 {
        counts.push(format!("{} without a report", count("")));
    }
    // Writing to a string cannot fail.
    let _ = write!(
        page,
        "<h1>{} recordings</h1><p class=\"kicker\">{}</p><div class=\"cards\">",
        entries.len(),
        counts.join(", ")
    );
    for e in entries {
        let (tag, link) = if e.link.is_empty() {
            ("div", String::new())
        } else {
            ("a", format!(" href=\"{}\"", address(&e.link)))
        };
        let word = if e.verdict.is_empty() { "no report" } else { e.verdict };
        let _ = write!(
            page,
            "<{tag} class=\"card\"{link}><p class=\"kicker\">{}{}</p><p><span class=\"verdict {}\">{word}</span></p><p>{}</p>{}</{tag}>",
            escape(&e.title),
            if e.domain.is_empty() { String::new() } else { format!(" &#183; {}", escape(&e.domain)) },
            if e.verdict.is_empty() { "unexplained" } else { e.verdict },
            escape(&e.words),
            e.picture
        );
    }
    page.push_str("</div></body></html>\n");
    page
}

/// The name of a file as an address.
fn address(name: &str) -> String {
    let kept = |b: u8| b.is_ascii_alphanumeric() || b"-._~".contains(&b);
    name.bytes().map(|b| if kept(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_are_addresses() {
        assert_eq!(address("c01.html"), "c01.html");
        assert_eq!(address("a b#c%é.html"), "a%20b%23c%25%C3%A9.html");
    }
}
