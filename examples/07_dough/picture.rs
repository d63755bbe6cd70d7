//! Bars and lines as SVG.

use std::fmt::Write as _;

use dough_mbrl::rollout::Rollout;
use examples::bars::{self, Bars, COLOURS, Stand};

/// Mean throw and depth (mm) by fifths of the progress.
pub(crate) struct Lines {
    pub(crate) name: String,
    pub(crate) values: Vec<[f64; 2]>,
}

impl Lines {
    pub(crate) fn of(name: &str, rollouts: &[Rollout]) -> Self {
        let mut sums = [[0.0; 3]; 5];
        for rollout in rollouts {
            for (i, rolled) in rollout.rolls.iter().enumerate() {
                let sum = &mut sums[5 * i / rollout.rolls.len()];
                sum[0] += 1e3 * rolled.roll.action[0];
                sum[1] += 1e3 * rolled.roll.action[1];
                sum[2] += 1.0;
            }
        }
        Self { name: name.into(), values: sums.iter().map(|s| [s[0] / s[2], s[1] / s[2]]).collect() }
    }
}

pub(crate) fn draw(rows: &[Bars], goals: &[String], lines: &[Lines]) -> String {
    let mut svg = String::from(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 760 640' font-family='sans-serif' font-size='12'><rect width='760' height='640' fill='white'/><text x='50' y='20'>rolls to the goal (figure 7.4), goals from left to right</text>",
    );
    let stand = Stand { left: 50.0, bottom: 280.0, height: 230.0, step: [135.0, 18.0], legend: 40.0 };
    bars::draw(&mut svg, rows, goals, &stand);
    for (k, title, most) in [(0, "throw, mm (figure 7.6)", 120.0), (1, "depth, mm", 45.0)] {
        let left = 50.0 + 350.0 * f64::from(k);
        let _ = write!(
            svg,
            "<text x='{left}' y='320'>{title}</text><path d='M{left} 330V560H{:.0}' fill='none' stroke='black'/><text x='{left}' y='576'>progress</text>",
            left + 300.0
        );
        for (n, line) in lines.iter().enumerate() {
            let points: Vec<String> = line
                .values
                .iter()
                .enumerate()
                .filter(|(_, v)| v[k as usize].is_finite())
                .map(|(i, v)| {
                    format!(
                        "{:.1},{:.1}",
                        left + 60.0 * i as f64 + 30.0,
                        560.0 - 220.0 * v[k as usize] / most
                    )
                })
                .collect();
            let colour = COLOURS[n + 1];
            let _ = write!(
                svg,
                "<polyline points='{}' fill='none' stroke='{colour}' stroke-width='2'/><text x='{:.0}' y='{:.0}' fill='{colour}'>{}</text>",
                points.join(" "),
                left + 120.0,
                592.0 + 14.0 * n as f64,
                line.name
            );
        }
    }
    svg.push_str("</svg>\n");
    svg
}
