//! What pictures of pours show, in words and units, against the height of the funnel.

use granular_infer::statistics::{COUNT, RINGS, STATISTICS};
use missing_physics::diagnosis::Diagnosis;
use missing_physics::model::Model as _;
use missing_physics_report::{Colour, Figure, Mark, Panel, Plane, Shape};

use super::law::statistics_of;
use super::model::PourModel;
use super::read::Read;
use crate::figures::Fit;

/// Most statistics that are drawn.
const MOST: usize = 6;
/// Places of a curve.
const STEPS: u32 = 24;
/// Half the width of a 95 % interval of a normal law, in sigmas.
const SIGMAS: f64 = 1.96;

/// A statistic as a person knows it.
struct Statistic {
    words: String,
    /// What a value of the picture's statistics is in the unit of the words.
    shown: Box<dyn Fn(f64) -> f64>,
}

/// The statistic of a number.
fn statistic(k: usize, read: &Read) -> Statistic {
    let (name, _) = &STATISTICS[k];
    let diameter_mm = 1e3 * read.rig.diameter_m;
    let length_mm = diameter_mm * (read.rig.count as f64).cbrt();
    let plain = |words: &str| (words.to_owned(), Box::new(|v| v) as Box<dyn Fn(f64) -> f64>);
    let times =
        |words: &str, unit: f64| (words.to_owned(), Box::new(move |v| unit * v) as Box<dyn Fn(f64) -> f64>);
    let root =
        |words: &str| (words.to_owned(), Box::new(|v: f64| (0.5 * v).exp()) as Box<dyn Fn(f64) -> f64>);
    let (words, shown) = match name.as_str() {
        "ground_level" => times("ground below where it was stated (mm)", diameter_mm),
        "ground_slope_x" => plain("slope of the ground along x"),
        "ground_slope_y" => plain("slope of the ground along y"),
        "roughness" => root("step to the next pixel (diameters)"),
        "roughness_2_over_1_px" => root("step to the second pixel over that to the next"),
        "roughness_4_over_2_px" => root("step to the fourth pixel over that to the second"),
        "stray_height" => {
            ("height of strays (mm)".into(), Box::new(move |v: f64| diameter_mm * v.exp()) as Box<_>)
        }
        "centroid_x" => times("heap's centre along x (mm)", length_mm),
        "centroid_y" => times("heap's centre along y (mm)", length_mm),
        "oval_xx_yy" => plain("heap longer along x than along y (share)"),
        "oval_xy" => plain("heap longer along x = y (share)"),
        _ => {
            // The rings come after the ground's three; a statistic is the root of a mean height in diameters, a hundredth added.
            let ring = RINGS.get(k.wrapping_sub(3)..).and_then(|r| r.get(..2)).unwrap_or(&[0.0; 2]);
            let [from, to] = [ring[0], ring[1]].map(|r| length_mm * r);
            let words = format!("height {from:.0} to {to:.0} mm off the axis (mm)");
            (words, Box::new(move |v: f64| diameter_mm * (v * v - 0.01)) as Box<_>)
        }
    };
    Statistic { words, shown }
}

/// The statistics that miss most, each against the height of the funnel.
pub(super) fn figure(read: &Read, model: &PourModel, d: &Diagnosis) -> Figure {
    let before = Fit::Before.shared(model.spec(), d);
    let seen: Vec<(f64, [f64; COUNT])> =
        read.pictures.iter().map(|p| (p.height_m, statistics_of(p, read))).collect();
    let mut misfit = [0.0; COUNT];
    for (height_m, seen) in &seen {
        let (mean, sigma) = (model.mean(*height_m, &before), model.sigma(*height_m));
        (0..COUNT)
            .for_each(|k| misfit[k] += ((seen[k] - mean[k]) / sigma[k]).powi(2) / read.pictures.len() as f64);
    }
    let mut order: Vec<usize> = (0..COUNT).collect();
    order.sort_by(|&a, &b| misfit[b].total_cmp(&misfit[a]));
    let [low, high] = read.heights_m();
    let room = 0.05 * (high - low).max(0.1 * high);
    let heights: Vec<f64> = (0..=STEPS)
        .map(|k| (low - room) + (high - low + 2.0 * room) * f64::from(k) / f64::from(STEPS))
        .collect();
    let fits: Vec<(Fit, Vec<[f64; COUNT]>)> = Fit::of(d)
        .iter()
        .map(|&fit| {
            let shared = fit.shared(model.spec(), d);
            (fit, heights.iter().map(|h| model.mean(*h, &shared)).collect())
        })
        .collect();
    let sigmas: Vec<[f64; COUNT]> = heights.iter().map(|h| model.sigma(*h)).collect();
    let panel = |&k: &usize| {
        let Statistic { words, shown } = statistic(k, read);
        let mut marks = Vec::new();
        if let Some((fit, means)) = fits.last() {
            let edge = |side: f64| {
                let at = move |((h, mean), sigma): ((&f64, &[f64; COUNT]), &[f64; COUNT])| {
                    (1e3 * h, mean[k] + side * SIGMAS * sigma[k])
                };
                heights.iter().zip(means).zip(&sigmas).map(at).collect::<Vec<(f64, f64)>>()
            };
            let around = edge(1.0).into_iter().chain(edge(-1.0).into_iter().rev());
            let around = around.map(|(h, v)| [h, shown(v)]).collect();
            marks.push(Mark::new(Shape::Area, fit.colour(), around).named("95 % of the pictures"));
        }
        for (fit, means) in &fits {
            let line = heights.iter().zip(means).map(|(h, mean)| [1e3 * h, shown(mean[k])]).collect();
            marks.push(Mark::new(Shape::Line, fit.colour(), line).named(fit.words()));
        }
        let dots = seen.iter().map(|(h, seen)| [1e3 * h, shown(seen[k])]).collect();
        marks.push(Mark::new(Shape::Dots, Colour::Data, dots).named("measured"));
        Panel::Plane(Plane {
            title: format!("simulated: off by {:.1} sigma", misfit[k].sqrt()),
            x_label: "height of the funnel (mm)".into(),
            y_label: words,
            square: false,
            equal: false,
            marks,
        })
    };
    let mut key = vec![(Colour::Data, "measured".to_owned())];
    key.extend(fits.iter().map(|(fit, _)| (fit.colour(), fit.words().to_owned())));
    Figure {
        title: "What the pictures show, by the height of the funnel".into(),
        panels: order.iter().take(MOST).map(panel).collect(),
        key,
        note: format!(
            "The {MOST} of {COUNT} statistics that are farthest off in the simulation; band: where 95 % of the pictures should be, about the last \
             of the lines."
        ),
    }
}
