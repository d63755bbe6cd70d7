#![doc = include_str!("../README.md")]
mod context;
mod corner;
mod explore;
mod figure;
mod html;
mod json;
mod number;
mod plots;
mod quantity;
mod runs;
mod svg;
mod text;
mod write;

/// What other pages share with the report's.
pub mod page {
    pub use crate::html::STYLE;
    pub use crate::svg::{CHART_STYLE, Chart, Series, escape};
}

pub use context::ReportContext;
pub use figure::{Colour, Figure, Map, Mark, Panel, Plane, Scale, Shape};
pub use html::{Entry, html, index};
pub use json::json;
pub use plots::picture;
pub use runs::shown;
pub use text::{text, tried};
pub use write::write_whole;
