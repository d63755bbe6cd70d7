//! What the page can diagnose.

use missing_physics_domains as domains;
use missing_physics_domains::recording::unit_of;
use serde::Serialize;

/// Domains without threads or files of their own, in the order of the page.
const HERE: [&str; 6] = ["trajectory", "bounce", "slosh", "liquid-tilt", "indentation", "motion"];

/// A domain as the page shows it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DomainHere {
    /// Its identifier.
    pub id: &'static str,
    /// What it is, in one sentence.
    pub summary: &'static str,
    /// The columns of its table; none where the recording names them.
    pub columns: Vec<Channel>,
    /// A recording to begin from: names and contents of its files.
    pub template: Vec<(&'static str, &'static str)>,
}

/// A column that a domain reads.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Channel {
    /// Its name.
    pub name: String,
    /// The unit that its name ends in, or nothing.
    pub unit: &'static str,
    /// What it holds.
    pub what: String,
}

/// The domains that the page can diagnose.
pub fn domains() -> Vec<DomainHere> {
    let channel =
        |name: &str, what: &str| Channel { name: name.into(), unit: unit_of(name), what: what.into() };
    let here = |id: &&str| {
        let domain = domains::find(id).ok()?;
        let template = domain.template();
        Some(DomainHere {
            id: domain.id(),
            summary: domain.summary(),
            columns: domain.columns().iter().map(|c| channel(c.name, c.what)).collect(),
            template: vec![("recording.toml", template.header), template.data],
        })
    };
    HERE.iter().filter_map(here).collect()
}
