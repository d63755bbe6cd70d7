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

    /// Writes this panel with its upper left corner at a place.
    fn draw(&self, svg: &mut String, [left, top]: [f64; 2]) -> std::fmt::Result {
        let title = [left + 8.0, top + 16.0];
        writeln!(svg, "<text x='{}' y='{}' font-weight='bold'>{}</text>", title[0], title[1], self.title)?;
        let axes = self.axes([left, top]);
        for (mark, colour) in &self.marks {
            axes.draw_mark(svg, mark, colour)?;
        }
        axes.draw_ticks(svg)?;
        let [from, to] = axes.corners;
        writeln!(
            svg,
            "<text x='{:.1}' y='{:.1}' text-anchor='end'>{}</text>",
            to[0],
            to[1] + 30.0,
            self.labels[0]
        )?;
        writeln!(svg, "<text x='{:.1}' y='{:.1}'>{}</text>", left + 8.0, top + 28.0, self.labels[1])?;
        for (k, (name, colour)) in self.legend.iter().enumerate() {
            let (u, v) = (from[0] + 8.0, from[1] + 14.0 + 12.0 * k as f64);
            writeln!(svg, "<text x='{u:.1}' y='{v:.1}' fill='{colour}'>{name}</text>")?;
        }
        Ok(())
    }

    /// The axes within a panel whose upper left corner is at a place.
    fn axes(&self, [left, top]: [f64; 2]) -> Axes {
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
        let from = [left + before, top + above];
        Axes { ranges, corners: [from, [from[0] + frame[0], from[1] + frame[1]]] }
    }
}

/// Where values lie in the picture.
struct Axes {
    /// Smallest and largest value along each axis.
    ranges: [[f64; 2]; 2],
    /// The frame's upper left and lower right corner, px.
    corners: [[f64; 2]; 2],
}

impl Axes {
    fn x(&self, v: f64) -> f64 {
        let [[low, high], _] = self.ranges;
        let [[left, _], [right, _]] = self.corners;
        left + (right - left) * (v - low) / (high - low)
    }

    fn y(&self, v: f64) -> f64 {
        let [_, [low, high]] = self.ranges;
        let [[_, top], [_, bottom]] = self.corners;
        top + (bottom - top) * (high - v) / (high - low)
    }

    fn draw_mark(&self, svg: &mut String, mark: &Mark, colour: &str) -> std::fmt::Result {
        let place = |[x, y]: [f64; 2]| [self.x(x), self.y(y)];
        match mark {
            Mark::Line(points) => {
                let points = points.iter().map(|p| place(*p));
                let points: String = points.map(|[x, y]| format!("{x:.1},{y:.1} ")).collect();
                writeln!(svg, "<polyline points='{points}' fill='none' stroke='{colour}'/>")
            }
            Mark::Dots(points) => points.iter().map(|p| place(*p)).try_for_each(|[x, y]| {
                writeln!(svg, "<circle cx='{x:.1}' cy='{y:.1}' r='2' fill='{colour}'/>")
            }),
            Mark::Cell(centre, sides) => {
                let corner = |h: f64| place([centre[0] + h * sides[0], centre[1] - h * sides[1]]);
                let ([x, y], [right, bottom]) = (corner(-0.5), corner(0.5));
                let (width, height) = (right - x + 0.2, bottom - y + 0.2);
                writeln!(
                    svg,
                    "<rect x='{x:.1}' y='{y:.1}' width='{width:.1}' height='{height:.1}' fill='{colour}'/>"
                )
            }
            Mark::Text(at, text) => {
                let [x, y] = place(*at);
                let y = y + 3.0;
                writeln!(svg, "<text x='{x:.1}' y='{y:.1}' font-size='9' text-anchor='middle'>{text}</text>")
            }
        }
    }

    /// The frame's left and lower side with round numbers.
    fn draw_ticks(&self, svg: &mut String) -> std::fmt::Result {
        let [[left, top], [right, bottom]] = self.corners;
        writeln!(svg, "<path d='M{left:.1},{top:.1} V{bottom:.1} H{right:.1}' stroke='black' fill='none'/>")?;
        for v in ticks(self.ranges[0]) {
            let (x, y) = (self.x(v), bottom + 14.0);
            writeln!(svg, "<text x='{x:.1}' y='{y:.1}' text-anchor='middle'>{}</text>", short(v))?;
        }
        for v in ticks(self.ranges[1]) {
            let (x, y) = (left - 4.0, self.y(v) + 4.0);
            writeln!(svg, "<text x='{x:.1}' y='{y:.1}' text-anchor='end'>{}</text>", short(v))?;
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
