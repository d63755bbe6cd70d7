//! Values over a plane, by colour.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::frame::Frame;
use crate::number::significant;
use crate::svg::escape;

/// Values over two axes, one unit as long along as across.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Map {
    /// What stands above it.
    pub title: String,
    /// What stands below it, with its unit.
    pub x_label: String,
    /// What stands left of it, with its unit.
    pub y_label: String,
    /// What the colours mean, with its unit.
    pub value_label: String,
    /// From where to where it reaches, along and across.
    pub extent: [[f64; 2]; 2],
    /// Cells of a row.
    pub columns: usize,
    /// Values of the cells, row by row from the lowest; NaN where nothing is known.
    pub cells: Vec<f64>,
    /// How values are coloured.
    pub scale: Scale,
    /// The value from which on colours are the same.
    pub most: f64,
}

/// How values are coloured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// From zero on.
    #[default]
    Up,
    /// To both sides of zero, which has no colour.
    Both,
}

/// Colours to each side of zero.
const LEVELS: i32 = 16;
const SIZE: [f64; 2] = [340.0, 300.0];
const MARGIN: [f64; 4] = [54.0, 64.0, 26.0, 52.0];

impl Map {
    /// As SVG; nothing where no cell has a value.
    pub(super) fn svg(&self) -> String {
        let rows = self.cells.len() / self.columns.max(1);
        let [[x0, x1], [y0, y1]] = self.extent;
        let sound = self.cells.iter().any(|v| v.is_finite()) && self.most > 0.0 && x1 > x0 && y1 > y0;
        if !sound || rows == 0 {
            return String::new();
        }
        let (title, x_label, y_label) = (&self.title, &self.x_label, &self.y_label);
        let frame = Frame { size: SIZE, margin: MARGIN, x: (x0, x1), y: (y0, y1), title, x_label, y_label };
        let step = [(x1 - x0) / self.columns as f64, (y1 - y0) / rows as f64];
        let mut paths: BTreeMap<i32, String> = BTreeMap::new();
        for (row, cells) in self.cells.chunks_exact(self.columns).enumerate() {
            let bottom = frame.py(y0 + step[1] * row as f64);
            let top = frame.py(y0 + step[1] * (row + 1) as f64);
            let mut column = 0;
            while column < cells.len() {
                let level = self.level(cells[column]);
                let same = cells[column..].iter().take_while(|v| self.level(**v) == level).count();
                if let Some(level) = level.filter(|l| *l != 0) {
                    let [left, right] = [column, column + same].map(|c| frame.px(x0 + step[0] * c as f64));
                    // Writing to a string cannot fail.
                    let _ = write!(
                        paths.entry(level).or_default(),
                        "M{left:.1} {top:.1}H{right:.1}V{bottom:.1}H{left:.1}Z"
                    );
                }
                column += same;
            }
        }
        let mut body = String::new();
        for (level, path) in paths {
            let [from, to] = [f64::from(level) - 0.5, f64::from(level) + 0.5]
                .map(|l| significant(l * self.most / f64::from(LEVELS), 2));
            let _ = write!(
                body,
                "<path class=\"level {}\" fill-opacity=\"{:.3}\" d=\"{path}\"><title>{}: {from} to {to}</title></path>",
                side(level),
                opacity(level),
                escape(&self.value_label)
            );
        }
        body.push_str(&self.bar());
        frame.svg(&body)
    }

    /// The number of a value's colour, below zero on the other side; nothing for what is not known.
    fn level(&self, value: f64) -> Option<i32> {
        let share = (value / self.most).clamp(if self.scale == Scale::Both { -1.0 } else { 0.0 }, 1.0);
        value.is_finite().then(|| (share * f64::from(LEVELS)).round() as i32)
    }

    /// What the colours mean.
    fn bar(&self) -> String {
        let [.., top, below] = MARGIN;
        let (left, wide) = (SIZE[0] - MARGIN[1] + 8.0, 10.0);
        let lowest = if self.scale == Scale::Both { -LEVELS } else { 0 };
        let tall = (SIZE[1] - top - below) / f64::from(LEVELS - lowest + 1);
        let y = |level: i32| top + f64::from(LEVELS - level) * tall;
        let mut bar = String::new();
        for level in lowest..=LEVELS {
            // Writing to a string cannot fail.
            let _ = write!(
                bar,
                "<rect class=\"level {}\" fill-opacity=\"{:.3}\" x=\"{left}\" y=\"{:.2}\" width=\"{wide}\" height=\"{tall:.2}\"/>",
                side(level),
                opacity(level),
                y(level)
            );
        }
        let full = SIZE[1] - top - below;
        let _ = write!(
            bar,
            "<rect class=\"frame\" x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{full}\"/>"
        );
        for level in [lowest, (lowest + LEVELS) / 2, LEVELS] {
            let value = f64::from(level) * self.most / f64::from(LEVELS);
            let _ = write!(
                bar,
                "<text x=\"{}\" y=\"{:.1}\">{}</text>",
                left + wide + 4.0,
                y(level) + 0.5 * tall + 3.5,
                significant(value, 2)
            );
        }
        let _ = write!(
            bar,
            "<text x=\"{}\" y=\"16\" text-anchor=\"end\">{}</text>",
            SIZE[0] - 4.0,
            escape(&self.value_label)
        );
        bar
    }
}

/// The colour of a side of zero.
fn side(level: i32) -> &'static str {
    if level < 0 { "before" } else { "after" }
}

fn opacity(level: i32) -> f64 {
    f64::from(level.abs()) / f64::from(LEVELS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cell is drawn in the colour of its value, in its place; those of no value are left out.
    #[test]
    fn cells_are_where_their_values_are() {
        let map = Map {
            extent: [[0.0, 4.0], [0.0, 1.0]],
            columns: 4,
            cells: vec![1.0, 1.0, f64::NAN, -9.0],
            scale: Scale::Both,
            most: 2.0,
            ..Map::default()
        };
        let svg = map.svg();
        let (cells, _) = svg.split_once("<rect").unwrap_or_default();
        let paths: Vec<&str> = cells.split("<path").skip(1).collect();
        assert_eq!(paths.len(), 2, "{cells}");
        assert!(paths[0].contains("before") && paths[0].contains("fill-opacity=\"1.000\""), "{cells}");
        assert!(paths[1].contains("after") && paths[1].contains("fill-opacity=\"0.500\""), "{cells}");
        // Two cells of four as one rectangle.
        let wide = SIZE[0] - MARGIN[0] - MARGIN[1];
        assert!(paths[1].contains(&format!("M{:.1} ", MARGIN[0])), "{cells}");
        assert!(paths[1].contains(&format!("H{:.1}V", MARGIN[0] + 0.5 * wide)), "{cells}");
    }
}
