//! Two axes with round numbers and words.

use std::fmt::Write as _;

use crate::svg::{escape, ticks};

/// Axes over a rectangle of a picture.
pub(super) struct Frame<'a> {
    /// Width and height of the picture.
    pub(super) size: [f64; 2],
    /// Margins left, right, above and below.
    pub(super) margin: [f64; 4],
    pub(super) x: (f64, f64),
    pub(super) y: (f64, f64),
    pub(super) title: &'a str,
    pub(super) x_label: &'a str,
    pub(super) y_label: &'a str,
}

impl Frame<'_> {
    pub(super) fn px(&self, x: f64) -> f64 {
        let [left, right, ..] = self.margin;
        left + (x - self.x.0) / (self.x.1 - self.x.0) * (self.size[0] - left - right)
    }

    pub(super) fn py(&self, y: f64) -> f64 {
        let [.., above, below] = self.margin;
        self.size[1] - below - (y - self.y.0) / (self.y.1 - self.y.0) * (self.size[1] - above - below)
    }

    /// The picture: axes and title, `body` in between.
    pub(super) fn svg(&self, body: &str) -> String {
        let ([width, height], [left, right, above, below]) = (self.size, self.margin);
        let (end, floor) = (width - right, height - below);
        // Writing to a string cannot fail.
        let mut svg = format!(
            "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{0}\"><text class=\"t\" x=\"{left}\" y=\"16\">{0}</text>",
            escape(self.title)
        );
        for (x, label) in ticks(self.x.0, self.x.1) {
            let x = self.px(x);
            let _ = write!(
                svg,
                "<line class=\"grid\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{above}\" y2=\"{floor}\"/><text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{label}</text>",
                floor + 14.0
            );
        }
        for (y, label) in ticks(self.y.0, self.y.1) {
            let y = self.py(y);
            let _ = write!(
                svg,
                "<line class=\"grid\" x1=\"{left}\" x2=\"{end}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                left - 6.0,
                y + 3.5
            );
        }
        let (middle, half) = (0.5 * (left + end), 0.5 * (above + floor));
        let _ = write!(
            svg,
            "{body}<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{}</text><text transform=\"translate(13 {half}) rotate(-90)\" text-anchor=\"middle\">{}</text></svg>",
            height - 10.0,
            escape(self.x_label),
            escape(self.y_label)
        );
        svg
    }
}
