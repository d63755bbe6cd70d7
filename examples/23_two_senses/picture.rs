//! What each sense says of one bottle: volume against viscosity, and the volume by itself.

use std::path::PathBuf;

use examples::plot::{self, Panel, shade};
use liquid_haptics::fusion::Posterior;

use crate::rig::{Axes, Case, plan};
use crate::{Outcome, SENSES, posteriors};

const CELLS: usize = 60;
const COLOURS: [&str; 3] = ["hsl(30,80%,45%)", "hsl(220,70%,45%)", "black"];

/// Draws each case in a row.
pub(crate) fn draw(cases: &[Case]) -> Outcome<PathBuf> {
    let fit = plan(Axes::Torque)?;
    let mut panels = Vec::new();
    for case in cases {
        let three = posteriors(Axes::Torque, &fit, &case.feel()?)?.three;
        panels.extend(row(case, &three));
    }
    Ok(plot::write("two_senses.svg", &panels, 4)?)
}

fn row(case: &Case, three: &[Posterior; 3]) -> Vec<Panel> {
    let (name, truth) = (case.kind().name, [case.volume_m3() * 1e6, case.kind().viscosity.log10()]);
    let capacity_ml = truth[0] / case.fill;
    let volumes: Vec<f64> = (0..=CELLS).map(|k| 1e-6 * capacity_ml * k as f64 / CELLS as f64).collect();
    let decades: Vec<f64> = (0..CELLS).map(|k| -6.5 + 5.5 * (k as f64 + 0.5) / CELLS as f64).collect();
    let viscosities: Vec<f64> = decades.iter().map(|d| 10f64.powf(*d)).collect();
    let sides = [capacity_ml / CELLS as f64, 5.5 / CELLS as f64];
    let mut panels = Vec::new();
    let mut lines = Panel::new(format!("{name}: volume"), "mL", "density of the posterior over its largest");
    for ((posterior, sense), colour) in three.iter().zip(SENSES).zip(COLOURS) {
        let map = posterior.volume_and_viscosity(&volumes, &viscosities);
        let most = map.iter().flatten().fold(f64::MIN_POSITIVE, |most: f64, v| most.max(*v));
        let mut panel = Panel::new(format!("{name}: {sense}"), "volume, mL", "log10 of the viscosity, m2/s");
        for (k, column) in map.iter().enumerate() {
            for (value, decade) in column.iter().zip(&decades) {
                let centre = [(k as f64 + 0.5) * sides[0], *decade];
                panel.cell(centre, sides, &shade((value / most).powf(0.4)));
            }
        }
        panel.dots([truth], "black");
        panels.push(panel);
        let points: Vec<[f64; 2]> = posterior.volume_m3().points().collect();
        let highest = points.iter().fold(f64::MIN_POSITIVE, |most, p| most.max(p[1]));
        lines.line(points.iter().map(|p| [1e6 * p[0], p[1] / highest]), colour).name(sense, colour);
    }
    lines.line([[truth[0], 0.0], [truth[0], 1.0]], "hsl(0,0%,70%)");
    panels.push(lines);
    panels
}
