//! Figures 4.7, B.6 and B.7 in one picture.

use crate::{Bar, Failure};
use std::fmt::Write;

/// Colours: touched; missed after the first, the second, a later impact was misheard; missed otherwise.
const COLOURS: [&str; 5] = ["#2ca02c", "#d62728", "#ff7f0e", "#ffbb78", "#999"];

/// Success and failures by the first misheard impact, and energy, a bar a ball and tracker.
pub(crate) fn picture(bars: &[Bar]) -> Result<String, Failure> {
    let mut svg = String::from(
        "<svg xmlns='http://www.w3.org/2000/svg' width='1360' height='380' font-family='sans-serif' font-size='12'><rect width='1360' height='380' fill='white'/><text x='40' y='24'>share of the throws within reach: touched (green), missed with the first misheard impact the 1st (red), the 2nd (orange), a later one (pale), none (grey)</text><text x='880' y='44'>energy of the paddle, cm^2/s</text>",
    );
    let most = bars.iter().map(|b| b.energy).fold(1e-9, f64::max);
    for (i, bar) in bars.iter().enumerate() {
        let group = i / 6;
        let x = 40.0 + 44.0 * i as f64 + 12.0 * group as f64;
        let right = 880.0 + 24.0 * i as f64 + 8.0 * group as f64;
        let [a, b, c] = bar.by_bounce;
        let mut y = 320.0;
        for (share, colour) in [bar.touched, a, b, c, bar.missed].into_iter().zip(COLOURS) {
            let h = 2.6 * share;
            y -= h;
            write!(svg, "<rect x='{x}' y='{y:.1}' width='36' height='{h:.1}' fill='{colour}'/>")?;
        }
        let h = 240.0 * bar.energy / most;
        let name = ["still", "1", "2", "2 n", "filter", "oracle"][bar.tracker];
        write!(
            svg,
            "<text x='{x}' y='336'>{name}</text><rect x='{right}' y='{:.1}' width='20' height='{h:.1}' fill='#1f77b4'/><text x='{right}' y='336'>{}</text>",
            320.0 - h,
            ["0", "1", "2", "n", "f", "o"][bar.tracker]
        )?;
        if bar.tracker == 0 {
            write!(
                svg,
                "<text x='{x}' y='354'>{}, {} out</text><text x='{right}' y='354'>{}</text>",
                bar.ball, bar.out, bar.ball
            )?;
        }
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}
