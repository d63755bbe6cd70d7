//! Figures as SVG: panels side by side, each with its own axes.

use std::fmt::Write as _;
use std::path::PathBuf;

/// Size of a panel with its labels, and what is left free around the axes, px.
const SIZE: [f64; 2] = [330.0, 260.0];
const FREE: [f64; 4] = [52.0, 16.0, 30.0, 40.0];

/// What is drawn in a panel.
enum Mark {
    Line(Vec<[f64; 2]>),
    Dots(Vec<[f64; 2]>),
    /// A rectangle: its centre, its sides.
    Cell([f64; 2], [f64; 2]),
    Text([f64; 2], String),
}

/// A panel.
pub struct Panel {
    title: String,
    labels: [String; 2],
    marks: Vec<(Mark, String)>,
    legend: Vec<(String, String)>,
    equal: bool,
}

/// A colour of a row of `n`, from blue to red.
pub fn hue(k: usize, n: usize) -> String {
    format!("hsl({:.0},70%,40%)", 240.0 - 240.0 * k as f64 / (n.max(2) - 1) as f64)
}

/// A colour for a value from 0 (pale) to 1 (dark).
pub fn shade(value: f64) -> String {
    format!("hsl({:.0},75%,{:.0}%)", 60.0 - 60.0 * value.clamp(0.0, 1.0), 92.0 - 52.0 * value.clamp(0.0, 1.0))
}

impl Panel {
    /// An empty one, with its title and what its axes show.
    pub fn new(title: impl Into<String>, x: &str, y: &str) -> Self {
        Self {
            title: title.into(),
            labels: [x.into(), y.into()],
            marks: Vec::new(),
            legend: Vec::new(),
            equal: false,
        }
    }

    /// The same scale along both axes, as a map needs it.
    #[must_use]
    pub fn map(mut self) -> Self {
        self.equal = true;
        self
    }

    /// Adds a line.
    pub fn line(&mut self, points: impl IntoIterator<Item = [f64; 2]>, colour: &str) -> &mut Self {
        self.marks.push((Mark::Line(points.into_iter().collect()), colour.into()));
        self
    }

    /// Adds dots.
    pub fn dots(&mut self, points: impl IntoIterator<Item = [f64; 2]>, colour: &str) -> &mut Self {
        self.marks.push((Mark::Dots(points.into_iter().collect()), colour.into()));
        self
    }

    /// Adds a filled rectangle by its centre and sides.
    pub fn cell(&mut self, centre: [f64; 2], sides: [f64; 2], colour: &str) -> &mut Self {
        self.marks.push((Mark::Cell(centre, sides), colour.into()));
        self
    }

    /// Adds a short text, centred at a place.
    pub fn text(&mut self, at: [f64; 2], text: impl Into<String>) -> &mut Self {
        self.marks.push((Mark::Text(at, text.into()), "black".into()));
        self
    }

    /// Names a colour.
    pub fn name(&mut self, name: impl Into<String>, colour: &str) -> &mut Self {
        self.legend.push((name.into(), colour.into()));
        self
    }

    /// Smallest and largest value along an axis.
    fn range(&self, axis: usize) -> [f64; 2] {
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        let mut take = |v: f64| {
            if v.is_finite() {
                range = [range[0].min(v), range[1].max(v)];
            }
        };
        for (mark, _) in &self.marks {
            match mark {
                Mark::Line(points) | Mark::Dots(points) => points.iter().for_each(|p| take(p[axis])),
                Mark::Cell(c, s) => [-0.5, 0.5].iter().for_each(|h| take(c[axis] + h * s[axis])),
                Mark::Text(at, _) => take(at[axis]),
            }
        }
        match range {
            [low, high] if high > low => range,
            [low, _] if low.is_finite() => [low - 0.5, low + 0.5],
            _ => [0.0, 1.0],
        }
    }

    fn draw(&self, svg: &mut String, [left, top]: [f64; 2]) -> std::fmt::Result {
        let [before, after, above, below] = FREE;
        let frame = [SIZE[0] - before - after, SIZE[1] - above - below];
        let mut ranges = [self.range(0), self.range(1)];
        if self.equal {
            // The axis with room to spare is made longer.
            let per_px = [0, 1].map(|k| (ranges[k][1] - ranges[k][0]) / frame[k]);
            let most = per_px[0].max(per_px[1]);
            for k in 0..2 {
                let more = 0.5 * (most - per_px[k]) * frame[k];
                ranges[k] = [ranges[k][0] - more, ranges[k][1] + more];
            }
        }
        let x = |v: f64| left + before + frame[0] * (v - ranges[0][0]) / (ranges[0][1] - ranges[0][0]);
        let y = |v: f64| top + above + frame[1] * (ranges[1][1] - v) / (ranges[1][1] - ranges[1][0]);
        writeln!(
            svg,
            "<text x='{}' y='{}' font-weight='bold'>{}</text>",
            left + 8.0,
            top + 16.0,
            self.title
        )?;
        for (mark, colour) in &self.marks {
            match mark {
                Mark::Line(points) => {
                    let points: String =
                        points.iter().map(|p| format!("{:.1},{:.1} ", x(p[0]), y(p[1]))).collect();
                    writeln!(svg, "<polyline points='{points}' fill='none' stroke='{colour}'/>")?;
                }
                Mark::Dots(points) => {
                    for p in points {
                        writeln!(
                            svg,
                            "<circle cx='{:.1}' cy='{:.1}' r='2' fill='{colour}'/>",
                            x(p[0]),
                            y(p[1])
                        )?;
                    }
                }
                Mark::Cell(c, s) => writeln!(
                    svg,
                    "<rect x='{:.1}' y='{:.1}' width='{:.1}' height='{:.1}' fill='{colour}'/>",
                    x(c[0] - 0.5 * s[0]),
                    y(c[1] + 0.5 * s[1]),
                    x(c[0] + 0.5 * s[0]) - x(c[0] - 0.5 * s[0]) + 0.2,
                    y(c[1] - 0.5 * s[1]) - y(c[1] + 0.5 * s[1]) + 0.2
                )?,
                Mark::Text(at, text) => writeln!(
                    svg,
                    "<text x='{:.1}' y='{:.1}' font-size='9' text-anchor='middle'>{text}</text>",
                    x(at[0]),
                    y(at[1]) + 3.0
                )?,
            }
        }
        let [right, bottom] = [left + before + frame[0], top + above + frame[1]];
        writeln!(
            svg,
            "<path d='M{:.1},{:.1} V{bottom:.1} H{right:.1}' stroke='black' fill='none'/>",
            left + before,
            top + above
        )?;
        for v in ticks(ranges[0]) {
            let u = x(v);
            writeln!(
                svg,
                "<text x='{u:.1}' y='{:.1}' text-anchor='middle'>{}</text>",
                bottom + 14.0,
                short(v)
            )?;
        }
        for v in ticks(ranges[1]) {
            let (u, w) = (left + before - 4.0, y(v) + 4.0);
            writeln!(svg, "<text x='{u:.1}' y='{w:.1}' text-anchor='end'>{}</text>", short(v))?;
        }
        writeln!(
            svg,
            "<text x='{right:.1}' y='{:.1}' text-anchor='end'>{}</text>",
            bottom + 30.0,
            self.labels[0]
        )?;
        writeln!(svg, "<text x='{:.1}' y='{:.1}'>{}</text>", left + 8.0, top + 28.0, self.labels[1])?;
        for (k, (name, colour)) in self.legend.iter().enumerate() {
            let (u, v) = (left + before + 8.0, top + above + 14.0 + 12.0 * k as f64);
            writeln!(svg, "<text x='{u:.1}' y='{v:.1}' fill='{colour}'>{name}</text>")?;
        }
        Ok(())
    }
}

/// Round numbers across a range.
fn ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let rough = (high - low) / 4.0;
    let power = 10f64.powf(rough.log10().floor());
    let step = power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| m * power >= rough).unwrap_or(10.0);
    let first = (low / step).ceil() as i64;
    (first..).map(|k| k as f64 * step).take_while(|v| *v <= high + 1e-9 * step).take(12).collect()
}

/// A tick's number without the rounding of its sum.
fn short(v: f64) -> String {
    let text = format!("{v:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// Writes panels, so many in a row, as an SVG of a name into the temporary folder; where it is.
///
/// # Errors
/// What writing the file met.
pub fn write(name: &str, panels: &[Panel], in_a_row: usize) -> std::io::Result<PathBuf> {
    let rows = panels.len().div_ceil(in_a_row);
    let (width, height) = (SIZE[0] * in_a_row as f64, SIZE[1] * rows as f64);
    let mut svg = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}' font-family='sans-serif' font-size='11'>\n\
         <rect width='{width}' height='{height}' fill='white'/>\n"
    );
    for (k, panel) in panels.iter().enumerate() {
        let at = [SIZE[0] * (k % in_a_row) as f64, SIZE[1] * (k / in_a_row) as f64];
        panel.draw(&mut svg, at).map_err(std::io::Error::other)?;
    }
    svg.push_str("</svg>\n");
    let path = std::env::temp_dir().join(name);
    std::fs::write(&path, svg)?;
    Ok(path)
}
