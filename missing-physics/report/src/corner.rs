//! The fitted parameters together: ellipses, marginal curves and correlations.

use std::fmt::Write as _;

use missing_physics::diagnosis::Diagnosis;

use super::number::significant;
use super::svg::escape;

/// More parameters than this are not read at a glance.
const MOST: usize = 6;
const CELL: f64 = 104.0;
const STEP: f64 = 112.0;
const LEFT: f64 = 78.0;
const TOP: f64 = 6.0;
/// An axis reaches so many sigmas to both sides.
const REACH: f64 = 3.2;
/// Radii of the ellipses that hold 68 and 95 % of a normal law in the plane: sqrt(-2 ln(1 - p)).
const RADII: [f64; 2] = [2.448, 1.510];

struct Parameter<'a> {
    name: &'a str,
    value: f64,
    sigma: f64,
    /// Its place among those that were fitted.
    at: usize,
}

/// The corner plot; nothing where fewer than two parameters were fitted.
pub(super) fn corner(d: &Diagnosis) -> String {
    let shown = shown(d);
    if shown.len() < 2 {
        return String::new();
    }
    let n = shown.len() as f64;
    let (width, height) = (LEFT + STEP * n, TOP + STEP * n + 34.0);
    let mut svg = format!(
        "<svg class=\"corner\" style=\"width:{width}px\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"parameters together\">"
    );
    for (i, y) in shown.iter().enumerate() {
        for (j, x) in shown.iter().enumerate() {
            // Writing to a string cannot fail.
            let _ = write!(
                svg,
                "<g transform=\"translate({:.0} {:.0})\">{}</g>",
                LEFT + STEP * j as f64,
                TOP + STEP * i as f64,
                cell(d, i, j, y, x)
            );
        }
        svg.push_str(&labels(i, shown.len(), y));
    }
    let all = d.repaired.fitted.len();
    let some = if all > shown.len() {
        format!(" {} of {all} parameters that were fitted.", shown.len())
    } else {
        String::new()
    };
    format!(
        "<figure class=\"wide\">{svg}</svg><figcaption>Ellipses hold 68 and 95 %, numbers are correlations.{some} All by the covariance of the fit, as if the posterior were normal; intervals in the tables follow the likelihood itself where that differs.</figcaption></figure>"
    )
}

/// Those of the chosen mechanisms first, then those that hang together with them most.
fn shown(d: &Diagnosis) -> Vec<Parameter<'_>> {
    let repaired = &d.repaired;
    let sigma = |k: usize| repaired.covariance.get(k).and_then(|row| row.get(k)).map_or(0.0, |v| v.sqrt());
    let mut found: Vec<Parameter<'_>> = repaired
        .fitted
        .iter()
        .enumerate()
        .filter_map(|(at, &index)| {
            let parameter = repaired.parameters.get(index)?;
            let known = sigma(at) > 0.0 && sigma(at).is_finite() && parameter.value.is_finite();
            known.then(|| Parameter { name: &parameter.name, value: parameter.value, sigma: sigma(at), at })
        })
        .collect();
    let chosen: Vec<&str> = d
        .mechanisms
        .iter()
        .filter(|m| d.chosen.contains(&m.id))
        .flat_map(|m| m.parameters.iter().map(|p| p.name.as_str()))
        .collect();
    let own: Vec<usize> = found.iter().filter(|p| chosen.contains(&p.name)).map(|p| p.at).collect();
    let tied = |p: &Parameter<'_>| {
        let to = |&k: &usize| (repaired.covariance[p.at][k] / (p.sigma * sigma(k))).abs();
        if own.contains(&p.at) { f64::INFINITY } else { own.iter().map(to).fold(0.0, f64::max) }
    };
    found.sort_by(|a, b| tied(b).total_cmp(&tied(a)));
    found.truncate(MOST);
    found
}

fn cell(d: &Diagnosis, i: usize, j: usize, y: &Parameter<'_>, x: &Parameter<'_>) -> String {
    let frame = format!("<rect class=\"frame\" width=\"{CELL}\" height=\"{CELL}\"/>");
    let at = |sigmas: f64| 0.5 * CELL * (1.0 + sigmas / REACH);
    if i == j {
        let height = |s: f64| CELL * (1.0 - 0.88 * (-0.5 * s * s).exp());
        let curve = |reach: f64| -> String {
            (-24..=24)
                .map(|k| f64::from(k) / 24.0 * reach)
                .map(|s| format!("{:.1},{:.1} ", at(s), height(s)))
                .collect()
        };
        let (a, b) = (at(-1.96), at(1.96));
        return format!(
            "{frame}<polygon class=\"mass\" points=\"{a:.1},{CELL} {}{b:.1},{CELL}\"/><polyline class=\"after\" points=\"{}\"/>",
            curve(1.96),
            curve(REACH)
        );
    }
    let correlation = (d.repaired.covariance[y.at][x.at] / (y.sigma * x.sigma)).clamp(-1.0, 1.0);
    if j > i {
        return format!(
            "<rect class=\"tie\" style=\"fill-opacity:{:.2}\" width=\"{CELL}\" height=\"{CELL}\"/><text class=\"t\" x=\"{1}\" y=\"{1}\" text-anchor=\"middle\">{correlation:.2}</text>",
            0.5 * correlation.abs(),
            0.5 * CELL
        );
    }
    let across = (1.0 - correlation * correlation).sqrt();
    let ellipse = |radius: &f64| -> String {
        let points = (0..48).map(|k| f64::from(k) / 48.0 * std::f64::consts::TAU).map(|t| {
            let (sx, sy) = (radius * t.cos(), radius * (correlation * t.cos() + across * t.sin()));
            format!("{:.1},{:.1} ", at(sx), CELL - at(sy))
        });
        format!("<polygon class=\"mass\" points=\"{}\"/>", points.collect::<String>())
    };
    frame + &RADII.iter().map(ellipse).collect::<String>()
}

/// Name and range of a parameter, below its column and left of its row.
fn labels(i: usize, n: usize, p: &Parameter<'_>) -> String {
    let digits = ((p.value.abs() / p.sigma).max(1.0).log10().ceil() as usize + 1).clamp(2, 5);
    let ends =
        [-2.0, 2.0].map(|s| (0.5 * CELL * (1.0 + s / REACH), significant(p.value + s * p.sigma, digits)));
    let (x, y) = (LEFT + STEP * i as f64, TOP + STEP * i as f64);
    let bottom = TOP + STEP * n as f64;
    let mut svg = format!(
        "<text class=\"t\" x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{2}</text><text class=\"t\" transform=\"translate(12 {3:.0}) rotate(-90)\" text-anchor=\"middle\">{2}</text>",
        x + 0.5 * CELL,
        bottom + 26.0,
        escape(&short(p.name)),
        y + 0.5 * CELL
    );
    for (at, text) in ends {
        let _ = write!(
            svg,
            "<text class=\"s\" x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{text}</text>",
            x + at,
            bottom + 10.0
        );
        if i > 0 {
            let _ = write!(
                svg,
                "<text class=\"s\" x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"end\">{text}</text>",
                LEFT - 4.0,
                y + CELL - at + 4.0
            );
        }
    }
    svg
}

/// A name that fits below its cell.
fn short(name: &str) -> String {
    const LONGEST: usize = 18;
    if name.chars().count() <= LONGEST {
        name.into()
    } else {
        name.chars().take(LONGEST - 1).chain(['…']).collect()
    }
}
