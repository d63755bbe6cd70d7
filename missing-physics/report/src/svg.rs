//! Small line charts as inline SVG.

use std::fmt::Write as _;

/// Text made safe for HTML and SVG, in content and in attributes.
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            c if c.is_control() && c != '\n' => {}
            c => safe.push(c),
        }
    }
    safe
}

/// What a chart draws: points or a line, in a named class that the page's style colours.
pub struct Series<'a> {
    /// Class of its mark, which the style colours.
    pub class: &'a str,
    /// Abscissae.
    pub x: &'a [f64],
    /// Ordinates, as many.
    pub y: &'a [f64],
    /// Whether it is drawn as dots, not as a line.
    pub points: bool,
}

/// A chart with axes.
pub struct Chart<'a> {
    /// What stands above it.
    pub title: String,
    /// What stands below it.
    pub x_label: String,
    /// What stands left of it.
    pub y_label: String,
    /// What is drawn, the first at the back.
    pub series: Vec<Series<'a>>,
    /// An interval of x to shade.
    pub shaded: Option<(f64, f64)>,
    /// Half height of a band about zero.
    pub band: Option<f64>,
}

/// Colours, light and dark, and how charts use them.
pub const CHART_STYLE: &str = include_str!("chart.css");

const WIDTH: f64 = 460.0;
const HEIGHT: f64 = 250.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 42.0;
/// More points than this say no more.
const MOST_POINTS: usize = 600;

impl Chart<'_> {
    /// The chart as an `<svg>` element.
    pub fn render(&self) -> String {
        let range = |pick: for<'s> fn(&'s Series<'_>) -> &'s [f64]| {
            let values = self.series.iter().flat_map(|s| pick(s).iter().copied()).filter(|v| v.is_finite());
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
        };
        let (x0, x1) = widened(range(|s| s.x), 0.0);
        let (mut y0, mut y1) = range(|s| s.y);
        if let Some(band) = self.band.filter(|b| b.is_finite()) {
            (y0, y1) = (y0.min(-band), y1.max(band));
        }
        let (y0, y1) = widened((y0, y1), 0.06);
        let px = |x: f64| LEFT + (x - x0) / (x1 - x0) * (WIDTH - LEFT - RIGHT);
        let py = |y: f64| HEIGHT - BOTTOM - (y - y0) / (y1 - y0) * (HEIGHT - TOP - BOTTOM);
        let mut svg = String::new();
        // Writing to a string cannot fail.
        let _ = write!(
            svg,
            "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{0}\"><title>{0}</title><text class=\"t\" x=\"{LEFT}\" y=\"16\">{0}</text>",
            escape(&self.title)
        );
        if let Some((from, to)) = self.shaded {
            let (a, b) = (px(from.clamp(x0, x1)), px(to.clamp(x0, x1)));
            let height = HEIGHT - TOP - BOTTOM;
            let _ = write!(
                svg,
                "<rect class=\"shade\" x=\"{a:.1}\" y=\"{TOP}\" width=\"{:.1}\" height=\"{height}\"/>",
                (b - a).max(1.0)
            );
        }
        if let Some(band) = self.band.filter(|b| b.is_finite()) {
            let (a, b) = (py(band.min(y1)), py((-band).max(y0)));
            let width = WIDTH - LEFT - RIGHT;
            let _ = write!(
                svg,
                "<rect class=\"band\" x=\"{LEFT}\" y=\"{a:.1}\" width=\"{width}\" height=\"{:.1}\"/>",
                b - a
            );
        }
        svg.push_str(&grid((x0, x1), (y0, y1), &px, &py));
        self.series.iter().for_each(|series| svg.push_str(&series.marks(&px, &py)));
        let middle = LEFT + 0.5 * (WIDTH - LEFT - RIGHT);
        let half = TOP + 0.5 * (HEIGHT - TOP - BOTTOM);
        let _ = write!(
            svg,
            "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{}</text><text transform=\"translate(13 {half}) rotate(-90)\" text-anchor=\"middle\">{}</text></svg>",
            HEIGHT - 10.0,
            escape(&self.x_label),
            escape(&self.y_label)
        );
        svg
    }
}

impl Series<'_> {
    /// The series as dots or as a line; `px` and `py` say where a number stands.
    fn marks(&self, px: &impl Fn(f64) -> f64, py: &impl Fn(f64) -> f64) -> String {
        let mut svg = String::new();
        // Writing to a string cannot fail.
        let stride = self.x.len().div_ceil(MOST_POINTS).max(1);
        let rows = self.x.iter().zip(self.y).step_by(stride).filter(|(x, y)| x.is_finite() && y.is_finite());
        let class = self.class;
        if self.points {
            let _ = write!(svg, "<g class=\"{class}\">");
            for (x, y) in rows {
                let _ = write!(svg, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"1.8\"/>", px(*x), py(*y));
            }
            svg.push_str("</g>");
        } else {
            let points: Vec<String> = rows.map(|(x, y)| format!("{:.1},{:.1}", px(*x), py(*y))).collect();
            let _ = write!(svg, "<polyline class=\"{class}\" points=\"{}\"/>", points.join(" "));
        }
        svg
    }
}

/// Lines at round numbers with their labels; `px` and `py` say where a number stands.
fn grid(
    (x0, x1): (f64, f64),
    (y0, y1): (f64, f64),
    px: &impl Fn(f64) -> f64,
    py: &impl Fn(f64) -> f64,
) -> String {
    let mut svg = String::new();
    // Writing to a string cannot fail.
    for tick in ticks(x0, x1) {
        let x = px(tick.0);
        let bottom = HEIGHT - BOTTOM;
        let _ = write!(
            svg,
            "<line class=\"grid\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{TOP}\" y2=\"{bottom}\"/><text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            bottom + 14.0,
            tick.1
        );
    }
    for tick in ticks(y0, y1) {
        let y = py(tick.0);
        let _ = write!(
            svg,
            "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            WIDTH - RIGHT,
            LEFT - 6.0,
            y + 3.5,
            tick.1
        );
    }
    svg
}

/// Charts side by side as a picture that stands alone, with lines of words below.
pub(crate) fn picture(charts: &[String], words: &[String]) -> String {
    /// Width of a letter of the words, with room to spare.
    const LETTER: f64 = 6.2;
    let width = WIDTH * charts.len().max(1) as f64;
    let longest = ((width - LEFT - RIGHT) / LETTER) as usize;
    let lines: Vec<String> = words.iter().flat_map(|text| wrapped(text, longest)).collect();
    let height = HEIGHT + 18.0 * lines.len() as f64 + 8.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\"><style>{CHART_STYLE}</style><rect width=\"{width}\" height=\"{height}\" fill=\"var(--paper)\"/>"
    );
    for (i, chart) in charts.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(
            svg,
            "<svg x=\"{}\" width=\"{WIDTH}\" height=\"{HEIGHT}\">{chart}</svg>",
            WIDTH * i as f64
        );
    }
    for (i, line) in lines.iter().enumerate() {
        let y = HEIGHT + 12.0 + 18.0 * i as f64;
        let _ = write!(svg, "<text x=\"{LEFT}\" y=\"{y}\">{}</text>", escape(line));
    }
    svg.push_str("</svg>\n");
    svg
}

/// A text in lines of so many letters, or more where a word is longer.
fn wrapped(text: &str, longest: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut().filter(|line| line.chars().count() + 1 + word.chars().count() <= longest) {
            Some(line) => {
                line.push(' ');
                line.push_str(word);
            }
            None => lines.push(word.to_owned()),
        }
    }
    lines
}

/// A range that is not empty, with some room.
pub(crate) fn widened((low, high): (f64, f64), room: f64) -> (f64, f64) {
    if !(low.is_finite() && high.is_finite()) {
        return (0.0, 1.0);
    }
    let span = high - low;
    if span <= 1e-12 * high.abs().max(low.abs()) || span == 0.0 {
        let half = 0.5 * high.abs().max(1e-9);
        return (low - half, high + half);
    }
    (low - room * span, high + room * span)
}

/// Ticks at round numbers, with their labels.
pub(crate) fn ticks(low: f64, high: f64) -> Vec<(f64, String)> {
    let raw = (high - low) / 5.0;
    let power = 10f64.powf(raw.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= raw).unwrap_or(10.0 * power);
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let first = (low / step).ceil() as i64;
    (0..12)
        .map(|k| (first + k) as f64 * step)
        .take_while(|v| *v <= high + 1e-9 * step)
        .map(|v| {
            let v = if v.abs() < 1e-9 * step { 0.0 } else { v };
            let label =
                if decimals > 5 || v.abs() >= 1e6 { format!("{v:.1e}") } else { format!("{v:.decimals$}") };
            (v, label)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let labels: Vec<String> = ticks(-0.13, 0.52).into_iter().map(|t| t.1).collect();
        assert_eq!(labels, ["0.0", "0.2", "0.4"]);
        assert!(ticks(0.0, 1e-9).len() > 2);
    }

    #[test]
    fn words_below_a_picture_stay_in_it() {
        assert_eq!(wrapped("the simulation does not hold", 12), ["the", "simulation", "does not", "hold"]);
    }

    #[test]
    fn markup_in_a_label_stays_text() {
        let hostile = "<script>alert('x')</script>&\"";
        let chart = Chart {
            title: hostile.into(),
            x_label: hostile.into(),
            y_label: String::new(),
            series: vec![Series { class: "data", x: &[f64::NAN], y: &[1.0], points: true }],
            shaded: Some((f64::NEG_INFINITY, f64::INFINITY)),
            band: Some(f64::NAN),
        };
        let svg = chart.render();
        assert!(!svg.contains("<script") && !svg.contains("NaN"), "{svg}");
    }
}
