//! Lines, dots and areas over two axes.

use std::fmt::Write as _;

use super::Colour;
use super::frame::Frame;
use crate::svg::{escape, widened};

/// Marks over two axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plane {
    /// What stands above it.
    pub title: String,
    /// What stands below it, with its unit.
    pub x_label: String,
    /// What stands left of it, with its unit.
    pub y_label: String,
    /// Whether it is square, so that three of them stand side by side.
    pub square: bool,
    /// Whether one unit is as long along as across.
    pub equal: bool,
    /// What is drawn, the first at the back.
    pub marks: Vec<Mark>,
}

/// Something that is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// How it looks.
    pub shape: Shape,
    /// What it stands for.
    pub colour: Colour,
    /// Its points; what is not finite breaks a line.
    pub points: Vec<[f64; 2]>,
    /// What is said of it where it is pointed at.
    pub words: String,
}

/// How a mark looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A line through its points.
    Line,
    /// A thin line through its points.
    Thin,
    /// A dot at each point.
    Dots,
    /// A ring about each point.
    Rings,
    /// A cross at each point.
    Crosses,
    /// A triangle at each point.
    Triangles,
    /// What its points enclose.
    Area,
    /// Its words beside its first point.
    Text,
}

/// Half of a cross or triangle, and the radius of a ring.
const HALF: f64 = 4.0;

impl Mark {
    /// A mark without words.
    pub fn new(shape: Shape, colour: Colour, points: Vec<[f64; 2]>) -> Self {
        Self { shape, colour, points, words: String::new() }
    }

    /// The same mark with words.
    pub fn named(self, words: impl Into<String>) -> Self {
        Self { words: words.into(), ..self }
    }

    fn is_empty(&self) -> bool {
        !self.points.iter().any(is_finite)
    }

    /// As SVG, in pixels.
    fn svg(&self, frame: &Frame<'_>) -> String {
        let colour = self.colour.class();
        let place = |p: &[f64; 2]| [frame.px(p[0]), frame.py(p[1])];
        let at: Vec<[f64; 2]> = self.points.iter().filter(|p| is_finite(p)).map(place).collect();
        let title = if self.words.is_empty() || self.shape == Shape::Text {
            String::new()
        } else {
            format!("<title>{}</title>", escape(&self.words))
        };
        let each = |class: &str, of: &dyn Fn(f64, f64) -> String| {
            let all: String = at.iter().map(|[x, y]| of(*x, *y)).collect();
            format!("<g class=\"{class}{colour}\">{title}{all}</g>")
        };
        match self.shape {
            Shape::Line | Shape::Thin => {
                let class = if self.shape == Shape::Thin { "thin " } else { "" };
                let part = |part: &[[f64; 2]]| {
                    let points = listed(&part.iter().map(place).collect::<Vec<_>>());
                    format!("<polyline class=\"{class}{colour}\" points=\"{points}\">{title}</polyline>")
                };
                self.points.split(|p| !is_finite(p)).filter(|p| p.len() > 1).map(part).collect()
            }
            Shape::Area => {
                format!("<polygon class=\"area {colour}\" points=\"{}\">{title}</polygon>", listed(&at))
            }
            Shape::Dots => each("", &|x, y| format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.8\"/>")),
            Shape::Rings => {
                each("ring ", &|x, y| format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{HALF}\"/>"))
            }
            Shape::Crosses => each("ring ", &|x, y| {
                let [l, r, a, b] = [x - HALF, x + HALF, y - HALF, y + HALF];
                format!("<path d=\"M{l:.1} {a:.1}L{r:.1} {b:.1}M{l:.1} {b:.1}L{r:.1} {a:.1}\"/>")
            }),
            Shape::Triangles => each("", &|x, y| {
                let [l, r, a, b] = [x - HALF, x + HALF, y - HALF, y + HALF];
                format!("<path d=\"M{l:.1} {a:.1}H{r:.1}L{x:.1} {b:.1}Z\"/>")
            }),
            Shape::Text => at.first().map_or_else(String::new, |[x, y]| {
                let words = escape(&self.words);
                format!(
                    "<text class=\"mark {colour}\" x=\"{:.1}\" y=\"{:.1}\">{words}</text>",
                    x + 6.0,
                    y - 4.0
                )
            }),
        }
    }
}

impl Plane {
    /// As SVG; nothing where no mark has a place.
    pub(super) fn svg(&self) -> String {
        if self.marks.iter().all(Mark::is_empty) {
            return String::new();
        }
        let size = if self.square { [340.0, 320.0] } else { [460.0, 250.0] };
        let margin = if self.square { [54.0, 12.0, 26.0, 40.0] } else { [62.0, 12.0, 26.0, 42.0] };
        let ends = |axis: usize| {
            let values = self.marks.iter().flat_map(|m| m.points.iter().map(move |p| p[axis]));
            values
                .filter(|v| v.is_finite())
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
        };
        let (mut x, mut y) = (widened(ends(0), 0.03), widened(ends(1), 0.06));
        if self.equal {
            let room = [size[0] - margin[0] - margin[1], size[1] - margin[2] - margin[3]];
            let unit = ((x.1 - x.0) / room[0]).max((y.1 - y.0) / room[1]);
            let about = |(low, high): (f64, f64), pixels: f64| {
                let (middle, half) = (0.5 * (low + high), 0.5 * unit * pixels);
                (middle - half, middle + half)
            };
            (x, y) = (about(x, room[0]), about(y, room[1]));
        }
        let (title, x_label, y_label) = (&self.title, &self.x_label, &self.y_label);
        let frame = Frame { size, margin, x, y, title, x_label, y_label };
        frame.svg(&self.marks.iter().map(|mark| mark.svg(&frame)).collect::<String>())
    }
}

fn is_finite(p: &[f64; 2]) -> bool {
    p.iter().all(|v| v.is_finite())
}

fn listed(points: &[[f64; 2]]) -> String {
    let mut text = String::new();
    for [x, y] in points {
        // Writing to a string cannot fail.
        let _ = write!(text, "{x:.1},{y:.1} ");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_broken_where_a_value_is_missing() {
        let points = vec![[0.0, 0.0], [1.0, 1.0], [f64::NAN, 0.0], [2.0, 0.0], [3.0, 1.0]];
        let marks = vec![Mark::new(Shape::Line, Colour::Data, points)];
        let svg = Plane { marks, ..Plane::default() }.svg();
        assert_eq!(svg.matches("<polyline").count(), 2, "{svg}");
    }

    #[test]
    fn seen_from_above_a_metre_is_as_long_along_as_across() {
        let marks = vec![Mark::new(Shape::Dots, Colour::Data, vec![[0.0, 0.0], [1.0, 0.0], [0.0, 0.2]])];
        let svg = Plane { marks, square: true, equal: true, ..Plane::default() }.svg();
        let numbers = |name: &str| -> Vec<f64> {
            svg.split(&format!("{name}=\""))
                .skip(1)
                .filter_map(|rest| rest.split('"').next()?.parse().ok())
                .collect()
        };
        let (x, y) = (numbers(" cx"), numbers(" cy"));
        assert!(((x[1] - x[0]) - 5.0 * (y[0] - y[2])).abs() < 1.0, "{x:?} {y:?}");
    }
}
