//! A small picture of a channel in dots of Braille: two across and four down a character.

use crate::table::short;

/// Characters across and down.
const WIDTH: usize = 64;
const HEIGHT: usize = 4;

/// A picture of values over places between 0 and 1, a line each; with the ends of its axis.
pub(crate) fn picture(points: &[(f64, f64)]) -> Vec<String> {
    let finite = || points.iter().map(|(_, y)| *y).filter(|y| y.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    if low > high {
        return Vec::new();
    }
    let mut dots = [[0_u8; WIDTH]; HEIGHT];
    for (x, y) in points.iter().filter(|(_, y)| y.is_finite()) {
        let across = ((x * (2 * WIDTH) as f64) as usize).min(2 * WIDTH - 1);
        let up = if high > low { (y - low) / (high - low) } else { 0.5 };
        let down = (((1.0 - up) * (4 * HEIGHT - 1) as f64).round() as usize).min(4 * HEIGHT - 1);
        dots[down / 4][across / 2] |= BITS[down % 4][across % 2];
    }
    let labels = [short(high), short(low)];
    let room = labels.iter().map(String::len).max().unwrap_or(0);
    let line = |(k, row): (usize, &[u8; WIDTH])| {
        let label = if k == 0 {
            &labels[0]
        } else if k == HEIGHT - 1 {
            &labels[1]
        } else {
            ""
        };
        let row: String = row.iter().map(|b| char::from_u32(0x2800 + u32::from(*b)).unwrap_or(' ')).collect();
        format!("{label:>room$} {}", row.trim_end_matches('\u{2800}')).trim_end().to_owned()
    };
    dots.iter().enumerate().map(line).collect()
}

/// Bits of a character of Braille (Unicode, Braille Patterns) by row and column of the dot.
const BITS: [[u8; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_falls_falls() {
        let points: Vec<(f64, f64)> =
            (0..200).map(|i| (f64::from(i) / 200.0, 1.0 - f64::from(i) / 200.0)).collect();
        let lines = picture(&points);
        assert_eq!(lines.len(), HEIGHT);
        assert!(
            lines[0].starts_with("    1 ⠑") || lines[0].contains('⠑') || lines[0].contains('⠉'),
            "{lines:?}"
        );
        // What is drawn in the last line begins right of where the first ends.
        let blank = |line: &str| line.chars().filter(|c| *c == '\u{2800}').count();
        assert!(blank(&lines[3]) > 40 && blank(&lines[0]) == 0, "{lines:?}");
    }

    #[test]
    fn nothing_is_drawn_of_nothing() {
        assert!(picture(&[]).is_empty() && picture(&[(0.5, f64::NAN)]).is_empty());
        assert_eq!(picture(&[(0.5, 3.0)]).len(), HEIGHT);
    }
}
