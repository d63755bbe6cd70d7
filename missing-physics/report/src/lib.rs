//! A diagnosis of `missing-physics` as text for a person, as JSON for a program, as one HTML page, and as a picture.

mod html;
mod json;
mod number;
mod plots;
mod svg;
mod text;

mod write;

/// What other pages share with the report's.
pub mod page {
    pub use crate::html::STYLE;
    pub use crate::svg::{CHART_STYLE, Chart, Series, escape};
}

pub use html::html;
pub use json::json;
pub use plots::picture;
pub use text::text;
pub use write::write_whole;

/// What a report says of the recording beside the diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct ReportContext {
    /// Identifier of the domain.
    pub domain: String,
    /// The folder, as it was given.
    pub recording: String,
    /// Title of the page.
    pub title: String,
    /// What the domain adds to the answer, by the key it has there.
    pub additions: serde_json::Map<String, serde_json::Value>,
}
