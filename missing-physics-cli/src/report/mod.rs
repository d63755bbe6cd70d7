//! A diagnosis as text for a person, as JSON for a program, as one HTML page, and as a picture.

mod html;
mod json;
mod number;
mod plots;
mod svg;
mod text;

/// What other pages share with the report's.
pub(crate) mod page {
    pub(crate) use super::html::STYLE;
    pub(crate) use super::svg::{CHART_STYLE, Chart, Series, escape};
}

pub use html::html;
pub use json::json;
pub use plots::picture;
pub use text::text;

use crate::domains::Impact;

/// What a report says of the recording beside the diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct ReportContext {
    /// Identifier of the domain.
    pub domain: String,
    /// The folder, as it was given.
    pub recording: String,
    /// Title of the page.
    pub title: String,
    /// Impacts, where they were heard.
    pub impacts: Vec<Impact>,
}
