//! What a domain adds to a report: pictures of its own, drawn from the data and the fitted model.

mod frame;
mod map;
mod plane;

use std::fmt::Write as _;

pub use map::{Map, Scale};
pub use plane::{Mark, Plane, Shape};

use super::svg::escape;

/// A picture that a domain adds to a report: panels under a title.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure {
    /// What stands above it.
    pub title: String,
    /// What is drawn, side by side.
    pub panels: Vec<Panel>,
    /// What the marks mean, in words.
    pub key: Vec<(Colour, String)>,
    /// What stands below it.
    pub note: String,
}

/// One of the pictures of a figure.
#[derive(Debug, Clone, PartialEq)]
pub enum Panel {
    /// Marks over two axes.
    Plane(Plane),
    /// Values over two axes, by colour.
    Map(Map),
}

/// Colours by what they stand for; they follow the page, light or dark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// What was measured.
    Data,
    /// What the simulation says.
    Before,
    /// What it says with what was found.
    After,
    /// What belongs to the set-up.
    Ink,
    /// What stands behind.
    Soft,
}

impl Colour {
    /// The class that the page's style colours.
    fn class(self) -> &'static str {
        match self {
            Self::Data => "data",
            Self::Before => "before",
            Self::After => "after",
            Self::Ink => "ink",
            Self::Soft => "soft",
        }
    }
}

/// Style of figures.
pub(super) const FIGURE_STYLE: &str = "
.panels{display:grid;gap:.6rem;grid-template-columns:repeat(auto-fit,minmax(min(340px,100%),1fr))}.panels.small{grid-template-columns:repeat(auto-fit,minmax(min(250px,100%),1fr))}.panels figure{max-width:640px}.panels.small figure{max-width:440px}
.ink{--own:var(--ink)}.soft{--own:var(--soft)}.data{--own:var(--soft)}.before{--own:var(--before)}.after{--own:var(--after)}polyline.data,polyline.ink,polyline.soft{stroke:var(--own)}polyline.thin{stroke-width:.8}.panels g.data,g.ink,g.soft{fill:var(--own)}g.ring{fill:none;stroke:var(--own);stroke-width:1.5}polygon.area{fill:var(--own);fill-opacity:.3;stroke:none}text.mark{fill:var(--own)}.level{fill:var(--own);shape-rendering:crispEdges}.frame{fill:none;stroke:var(--line)}
";

impl Figure {
    /// The figure as a part of a page; nothing where nothing is drawn.
    pub(super) fn html(&self) -> String {
        let drawn: Vec<String> = self.panels.iter().map(Panel::svg).filter(|svg| !svg.is_empty()).collect();
        if drawn.is_empty() {
            return String::new();
        }
        let small = self.panels.iter().any(Panel::is_small);
        let mut html = format!("<div class=\"panels{}\">", if small { " small" } else { "" });
        for svg in drawn {
            // Writing to a string cannot fail.
            let _ = write!(html, "<figure>{svg}</figure>");
        }
        html.push_str("</div>");
        if !self.key.is_empty() {
            html.push_str("<p class=\"key note\">");
            for (colour, words) in &self.key {
                let class = colour.class();
                let _ = write!(
                    html,
                    "<span><i class=\"{class}\" style=\"background:var(--own)\"></i>{}</span>",
                    escape(words)
                );
            }
            html.push_str("</p>");
        }
        if !self.note.is_empty() {
            let _ = write!(html, "<p class=\"note\">{}</p>", escape(&self.note));
        }
        html
    }
}

impl Panel {
    fn svg(&self) -> String {
        match self {
            Self::Plane(plane) => plane.svg(),
            Self::Map(map) => map.svg(),
        }
    }

    /// Whether it is square, so that three of them stand side by side.
    fn is_small(&self) -> bool {
        match self {
            Self::Plane(plane) => plane.square,
            Self::Map(_) => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_of_nothing_is_no_figure() {
        let none = Figure { title: "heap".into(), note: "none".into(), ..Figure::default() };
        assert_eq!(none.html(), "");
        let empty = Plane { marks: vec![Mark::new(Shape::Line, Colour::Data, vec![])], ..Plane::default() };
        let map = Map { columns: 2, cells: vec![f64::NAN; 4], ..Map::default() };
        let panels = vec![Panel::Plane(empty), Panel::Map(map)];
        assert_eq!(Figure { panels, ..none }.html(), "");
    }

    #[test]
    fn markup_in_a_figure_stays_text() {
        let hostile = "<script>x</script>\"'";
        let mark = Mark::new(Shape::Dots, Colour::Data, vec![[0.0, f64::NAN], [1.0, 2.0]]).named(hostile);
        let plane = Plane {
            title: hostile.into(),
            x_label: hostile.into(),
            y_label: hostile.into(),
            marks: vec![mark],
            ..Plane::default()
        };
        let figure = Figure {
            title: String::new(),
            panels: vec![Panel::Plane(plane)],
            key: vec![(Colour::Data, hostile.into())],
            note: hostile.into(),
        };
        let html = figure.html();
        assert!(!html.contains("<script") && !html.contains("NaN"), "{html}");
        assert_eq!(html.matches("<circle").count(), 1, "{html}");
    }
}
