//! The bottle at its tilts, with its liquid: what a sweep looks like from the side.

use std::sync::Arc;

use liquid_haptics::container::up_at_tilt;
use missing_physics::data::{Recording, Run};
use missing_physics::diagnosis::{Curves, Diagnosis};
use missing_physics::model::Model as _;
use missing_physics_report::{Colour, Figure, Mark, Panel, Plane, Shape, shown};

use super::model::{LiquidTiltModel, Loaded};
use super::section::{below, section};
use crate::figures::Fit;

/// Most tilts that are drawn.
const MOST: usize = 6;

/// What the wrist felt, by channel.
const FORCE: usize = 1;
const TORQUE: usize = 2;

/// The bottle of the run that misses most, at some of its tilts.
pub(super) fn figures(model: &LiquidTiltModel, recording: &Arc<Recording>, d: &Diagnosis) -> Vec<Figure> {
    let Some(curves) = shown(d).first().and_then(|&run| d.curves.get(run)) else { return Vec::new() };
    let Some(run) = recording.runs.iter().find(|run| run.label == curves.run) else { return Vec::new() };
    let fits: Vec<(Fit, Loaded)> = Fit::of(d)
        .iter()
        .filter_map(|&fit| {
            Some((fit, model.loaded(run, &fit.shared(model.spec(), d), fit.channels(curves))?))
        })
        .collect();
    let n = run.len();
    let tilts = n.min(MOST);
    let rows = (0..tilts).map(|k| if tilts > 1 { k * (n - 1) / (tilts - 1) } else { 0 });
    let panels = rows.map(|row| Panel::Plane(bottle(model, run, curves, &fits, row))).collect();
    let mut key = vec![(Colour::Ink, "the container".into()), (Colour::Data, "measured".into())];
    key.extend(fits.iter().map(|(fit, _)| (fit.colour(), fit.words().to_owned())));
    let load = |(fit, loaded): &(Fit, Loaded)| {
        format!("{:.0} g in {:.0} ml ({})", 1e3 * loaded.mass_kg, 1e6 * loaded.volume_m3, fit.words())
    };
    let loads: Vec<String> = fits.iter().map(load).collect();
    let several = d.curves.len() > 1;
    vec![Figure {
        title: format!(
            "The container at its tilts, run {}{}",
            curves.run,
            if several { ", which misses most" } else { "" }
        ),
        panels,
        key,
        note: format!(
            "Cut along the tilt, the grasp at the origin; coloured: the liquid as it was fitted, {}. On the grasp's height: where the \
             weight pulls, measured (dot) and simulated (ring), torque over force.",
            loads.join(", ")
        ),
    }]
}

/// The container at the tilt of a row.
fn bottle(model: &LiquidTiltModel, run: &Run, curves: &Curves, fits: &[(Fit, Loaded)], row: usize) -> Plane {
    let setup = model.setup();
    let stated = run.inputs[0][row];
    let mut marks = Vec::new();
    for (fit, loaded) in fits {
        let grasp = setup.grasp.grasp_height_m + loaded.departures[row].grasp_offset_m;
        let tilt = stated + loaded.departures[row].angle_offset_rad;
        let level = tilt - loaded.departures[row].surface_lag_rad;
        let (sin, cos) = tilt.sin_cos();
        // As `Grasp` has it: origin at the grasp, y up, clockwise.
        let world = |[x, z]: [f64; 2]| [(z - grasp) * sin + x * cos, (z - grasp) * cos - x * sin];
        let up = up_at_tilt(level);
        let Ok(fill) = loaded.cavity.fill(&up, loaded.volume_m3) else { continue };
        let last = fits.last().is_some_and(|(last, _)| last == fit);
        for wall in section(&setup.vessel, loaded.wall_m) {
            let (wet, surface) = below(&wall, [up.x, up.z], fill.surface_height_m);
            let place = |points: Vec<[f64; 2]>| points.into_iter().map(world).collect::<Vec<_>>();
            if last {
                marks.push(Mark::new(Shape::Area, fit.colour(), place(wet)).named("the liquid"));
            }
            let words = format!("surface, {}", fit.words());
            marks.push(Mark::new(Shape::Line, fit.colour(), place(surface)).named(words));
            if last && loaded.wall_m > 0.0 {
                marks.push(Mark::new(Shape::Thin, Colour::Soft, closed(place(wall))));
            }
        }
        if last {
            let outlines = section(&setup.vessel, 0.0).into_iter();
            marks.extend(outlines.map(|outline| {
                let outline = outline.into_iter().map(world).collect();
                Mark::new(Shape::Line, Colour::Ink, closed(outline)).named("the container")
            }));
        }
    }
    let pulls = |channels: &[Vec<f64>]| vec![[channels[TORQUE][row] / channels[FORCE][row], 0.0]];
    let at = |pull: &[[f64; 2]]| format!("the weight pulls at {:.1} mm", 1e3 * pull[0][0]);
    for (fit, _) in fits {
        let pull = pulls(fit.channels(curves));
        let words = format!("{}, {}", at(&pull), fit.words());
        marks.push(Mark::new(Shape::Rings, fit.colour(), pull).named(words));
    }
    let pull = pulls(&curves.measured);
    let words = format!("{}, measured", at(&pull));
    marks.push(Mark::new(Shape::Dots, Colour::Data, pull).named(words));
    Plane {
        title: format!("tilted by {:.0} degrees", stated.to_degrees()),
        x_label: "across (m)".into(),
        y_label: "height above the grasp (m)".into(),
        square: true,
        equal: true,
        marks,
    }
}

/// An outline that ends where it began.
fn closed(mut outline: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    outline.extend(outline.first().copied());
    outline
}
