//! Groups of bars with their intervals, as SVG.

use std::fmt::Write as _;

/// A colour for each row of a table.
pub const COLOURS: [&str; 6] = ["#999", "#d55e00", "#56b4e9", "#0072b2", "#009e73", "#cc79a7"];

/// A row of a table: mean and half interval in each group.
#[derive(Debug, Clone)]
pub struct Bars {
    /// What the legend says.
    pub name: String,
    /// Group by group.
    pub values: Vec<(f64, f64)>,
}

/// Where bars stand, in the picture's units.
#[derive(Debug, Clone, Copy)]
pub struct Stand {
    /// The first bar's left side.
    pub left: f64,
    /// Their foot.
    pub bottom: f64,
    /// The highest one's height, its interval included.
    pub height: f64,
    /// From group to group, and from bar to bar.
    pub step: [f64; 2],
    /// The legend's first line.
    pub legend: f64,
}

/// Draws rows of a table, a group for each column.
pub fn draw(svg: &mut String, bars: &[Bars], groups: &[String], stand: &Stand) {
    let Stand { left, bottom, step: [group, bar], .. } = *stand;
    let most = bars.iter().flat_map(|b| &b.values).map(|v| v.0 + v.1).fold(1.0, f64::max);
    let level = |v: f64| bottom - stand.height * v.max(0.0) / most;
    let width = bar - 2.0;
    for (b, row) in bars.iter().enumerate() {
        let colour = COLOURS[b % COLOURS.len()];
        for (g, (mean, half)) in row.values.iter().enumerate() {
            let x = left + group * g as f64 + bar * b as f64;
            let (top, least) = (level(mean + half), level(mean - half));
            // Writing to a string cannot fail.
            let _ = write!(
                svg,
                "<rect x='{x}' y='{:.1}' width='{width}' height='{:.1}' fill='{colour}'/><path d='M{:.1} {top:.1}V{least:.1}' stroke='black'/><text x='{x}' y='{:.1}' font-size='9'>{mean:.0}</text>",
                level(*mean),
                bottom - level(*mean),
                x + 0.5 * width,
                top - 4.0,
            );
        }
        let y = stand.legend + 16.0 * b as f64;
        let _ = write!(
            svg,
            "<rect x='{left}' y='{:.1}' width='10' height='10' fill='{colour}'/><text x='{:.1}' y='{y:.1}'>{}</text>",
            y - 9.0,
            left + 16.0,
            row.name
        );
    }
    for (g, name) in groups.iter().enumerate() {
        let _ = write!(svg, "<text x='{}' y='{}'>{name}</text>", left + group * g as f64, bottom + 16.0);
    }
}
