//! A heap as it was measured and as it is simulated, and what pictures show against the height of the funnel.

use granular_infer::camera::Flaws;
use granular_infer::seeing::HeightMap;
use missing_physics::diagnosis::Diagnosis;
use missing_physics::model::Model as _;
use missing_physics_report::{Colour, Figure, Map, Mark, Panel, Plane, Scale, Shape, shown};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::campaign::at_scale;
use super::learning::scaled;
use super::model::PourModel;
use super::read::{Picture, Read};
use super::statistic;
use crate::figures::Fit;

/// Simulated pours of which the mean is drawn.
const POURS: u64 = 4;
/// How far from the axis heaps are drawn, in edges of the cube that holds the grains in rows.
const REACH: f64 = 2.1;
/// Fewest and most cells along a map.
const CELLS: [f64; 2] = [24.0, 64.0];

/// The heap of the run that misses most, and the statistics that do.
pub(super) fn figures(read: &Read, model: &PourModel, d: &Diagnosis) -> Vec<Figure> {
    let run = shown(d).first().and_then(|&run| d.curves.get(run));
    let picture = run.and_then(|run| read.pictures.iter().find(|p| p.label == run.run));
    let mut figures: Vec<Figure> = picture.into_iter().map(|picture| heap(read, model, picture, d)).collect();
    figures.push(statistic::figure(read, model, d));
    figures
}

/// Mean heights of the cells of a square about the axis, m; row by row, NaN where nothing is seen.
struct Heights {
    /// Half the square's edge, m.
    reach_m: f64,
    columns: usize,
    cells: Vec<f64>,
}

impl Heights {
    fn of(read: &Read, map: &HeightMap) -> Self {
        let edge_d = 2.0 * REACH * (read.rig.count as f64).cbrt();
        let columns = edge_d.clamp(CELLS[0], CELLS[1]).round() as usize;
        let reach_m = 0.5 * edge_d * read.rig.diameter_m;
        let mut sums = vec![(0.0, 0.0); columns * columns];
        let at = |v: f64| ((v + reach_m) / (2.0 * reach_m) * columns as f64).floor();
        for ([x, y], z) in map.places_m.iter().zip(&map.heights_m).filter(|(_, z)| z.is_finite()) {
            let (column, row) = (at(*x), at(*y));
            let inside = |v: f64| v >= 0.0 && v < columns as f64;
            if inside(column) && inside(row) {
                let (sum, count) = &mut sums[row as usize * columns + column as usize];
                *sum += z;
                *count += 1.0;
            }
        }
        Self { reach_m, columns, cells: sums.into_iter().map(|(sum, count)| sum / count).collect() }
    }

    /// As a picture, in mm; colours reach to `most_mm`.
    fn map(&self, title: &str, value_label: &str, scale: Scale, most_mm: f64) -> Panel {
        let edge = 1e3 * self.reach_m;
        Panel::Map(Map {
            title: title.into(),
            x_label: "x (mm)".into(),
            y_label: "y (mm)".into(),
            value_label: value_label.into(),
            extent: [[-edge, edge]; 2],
            columns: self.columns,
            cells: self.cells.iter().map(|z| 1e3 * z).collect(),
            scale,
            most: most_mm,
        })
    }

    fn less(&self, other: &Self) -> Self {
        let cells = self.cells.iter().zip(&other.cells).map(|(a, b)| a - b).collect();
        Self { cells, ..*self }
    }

    /// Mean height (mm) against the distance from the axis (mm).
    fn profile(&self) -> Vec<[f64; 2]> {
        let step = 2.0 * self.reach_m / self.columns as f64;
        let rings = self.columns / 2;
        let mut sums = vec![(0.0, 0.0); rings];
        for (i, z) in self.cells.iter().enumerate().filter(|(_, z)| z.is_finite()) {
            let place = |k: usize| (k as f64 + 0.5) * step - self.reach_m;
            let ring = (place(i % self.columns).hypot(place(i / self.columns)) / step) as usize;
            if let Some((sum, count)) = sums.get_mut(ring) {
                *sum += z;
                *count += 1.0;
            }
        }
        sums.iter()
            .enumerate()
            .map(|(k, (sum, count))| [1e3 * (k as f64 + 0.5) * step, 1e3 * sum / count])
            .collect()
    }

    /// The height above which so small a part of the cells is, mm.
    fn highest_mm(&self, part: f64) -> f64 {
        let mut all: Vec<f64> = self.cells.iter().map(|z| 1e3 * z.abs()).filter(|z| z.is_finite()).collect();
        all.sort_by(f64::total_cmp);
        let at = ((1.0 - part) * all.len() as f64) as usize;
        all.get(at.min(all.len().saturating_sub(1))).copied().unwrap_or(0.0)
    }
}

/// Pours from a picture's height as a fit has them, seen by the recording's camera; nothing where that cannot be poured.
fn simulated(read: &Read, model: &PourModel, picture: &Picture, shared: &[f64]) -> Option<Heights> {
    let length = model.scale.length;
    let rig = at_scale(&read.rig, length);
    let view = model.poured(picture.height_m, shared);
    let flaws = Flaws { blur_px: view.blur_px2.max(0.0).sqrt(), ..Flaws::default() };
    let volume_m3 = rig.count as f64 * rig.grain_volume_m3() * length.powi(3);
    let pour = |seed: u64| {
        let grains = rig.pour(&view.conditions, seed).ok()?;
        let depth = read.camera.render(&scaled(&grains, length));
        let counts = read.camera.expose(&depth, &flaws, &mut ChaCha8Rng::seed_from_u64(seed));
        HeightMap::new(&read.camera, &counts, volume_m3).ok().map(|map| Heights::of(read, &map))
    };
    let poured: Vec<Heights> = (0..POURS).into_par_iter().filter_map(pour).collect();
    let count = poured.len() as f64;
    poured
        .into_iter()
        .reduce(|mut sum, other| {
            sum.cells.iter_mut().zip(other.cells).for_each(|(a, b)| *a += b);
            sum
        })
        .map(|mut mean| {
            mean.cells.iter_mut().for_each(|z| *z /= count);
            mean
        })
}

/// A heap: measured, and for each fit simulated and what is left.
fn heap(read: &Read, model: &PourModel, picture: &Picture, d: &Diagnosis) -> Figure {
    let measured = Heights::of(read, &picture.map);
    let fits: Vec<(Fit, Heights, Heights)> = Fit::of(d)
        .iter()
        .filter_map(|&fit| {
            let simulated = simulated(read, model, picture, &fit.shared(model.spec(), d))?;
            let left = measured.less(&simulated);
            Some((fit, simulated, left))
        })
        .collect();
    // A few cells more or less do not decide on colours.
    const HIGHEST: f64 = 2e-3;
    const FARTHEST: f64 = 1e-2;
    let grain_mm = 1e3 * read.rig.diameter_m;
    let simulated_mm = fits.iter().map(|(_, simulated, _)| simulated.highest_mm(HIGHEST));
    let most = simulated_mm.fold(measured.highest_mm(HIGHEST).max(grain_mm), f64::max);
    let off = fits.iter().map(|(.., left)| left.highest_mm(FARTHEST)).fold(grain_mm, f64::max);
    let mut panels = vec![measured.map("measured", "height (mm)", Scale::Up, most)];
    let mut lines = Vec::new();
    for (fit, simulated, left) in &fits {
        panels.push(simulated.map(fit.words(), "height (mm)", Scale::Up, most));
        let title = if *fit == Fit::Before { "measured less simulated" } else { "measured less that" };
        panels.push(left.map(title, "higher by (mm)", Scale::Both, off));
        lines.push(Mark::new(Shape::Line, fit.colour(), simulated.profile()).named(fit.words()));
    }
    lines.push(Mark::new(Shape::Dots, Colour::Data, measured.profile()).named("measured"));
    panels.push(Panel::Plane(Plane {
        title: "mean height about the axis".into(),
        x_label: "distance from the axis (mm)".into(),
        y_label: "height (mm)".into(),
        square: true,
        equal: false,
        marks: lines,
    }));
    let mut key = vec![(Colour::Data, "measured".to_owned())];
    key.extend(fits.iter().map(|(fit, ..)| (fit.colour(), fit.words().to_owned())));
    Figure {
        title: format!("The heap of run {}, from {:.0} mm", picture.label, 1e3 * picture.height_m),
        panels,
        key,
        note: format!(
            "Seen from above, in cells of {:.1} mm. Simulated: the mean of {POURS} pours as fitted, seen by the same camera.",
            2e3 * measured.reach_m / measured.columns as f64
        ),
    }
}
