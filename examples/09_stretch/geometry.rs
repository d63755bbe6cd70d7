//! Figures 6.2 and 6.4: what touches, and how well its diameters are seen.

use examples::plot::{Panel, shade};
use rayon::prelude::*;
use stretch::contact::{cap, diameters};
use stretch::fake::{Filling, Rig, Shape};
use stretch::segment::State;

use super::{Outcome, at, look, stretches};

const STATES: [(State, &str, &str); 3] = [
    (State::Undeformed, "undeformed", "steelblue"),
    (State::Deformed, "deformed", "goldenrod"),
    (State::Contact, "in contact", "crimson"),
];

/// Figure 6.2: a section through the membrane over a ball; the ratio of the tensions that it shows.
pub(crate) fn section(panels: &mut Vec<Panel>) -> Outcome<()> {
    let mut rig = Rig::new(Shape::Ball { radius_m: 0.02 }, Filling::Rigid, 62);
    let (cloud, segmenter) = look(&mut rig, 0.0, at(0.0, -0.012))?;
    let mut panel = Panel::new("6.2: height (mm) along the middle row", "place (mm)", "");
    let columns = cloud.columns();
    let middle = segmenter.states.len() / columns / 2 * columns;
    for (state, name, colour) in STATES {
        let here = (middle..middle + columns).filter(|k| segmenter.states[*k] == state);
        let place = |k: usize| [1e3 * f64::from(cloud.points[k][0]), 1e3 * f64::from(cloud.smooth[k])];
        panel.dots(here.map(place), colour).name(name, colour);
    }
    panels.push(panel);
    println!("Ratio of the tensions across and along, as one picture's free membrane shows it");
    println!("{:>13} {:>16} {:>6}", "stretch (mm)", "seen", "true");
    let all = stretches();
    for &stretch_m in if examples::small() { &all[..1] } else { &all[..] } {
        let (cloud, segmenter) = look(&mut rig, stretch_m, at(0.0, -0.012))?;
        let [along, across] = rig.membrane().tension_n_m;
        let seen = segmenter.tension_ratio(&cloud);
        let words = seen.map_or("not seen".into(), |(r, sigma)| format!("{r:.2} +- {:.2}", 1.96 * sigma));
        println!("{:>13.0} {words:>16} {:>6.2}", 1e3 * stretch_m, across / along);
    }
    Ok(())
}

/// Error of a diameter along i and along j, m; none where no edge is seen.
type Errors = Option<[f64; 2]>;

fn face(diameter_m: f64, stretch_m: f64, depth_m: f64) -> Errors {
    let mut rig = Rig::new(Shape::Cylinder { radius_m: 0.5 * diameter_m }, Filling::Rigid, 64);
    let (cloud, segmenter) = look(&mut rig, stretch_m, at(0.0, -depth_m)).ok()?;
    let d = diameters(&cloud, &segmenter.states).ok()?;
    Some([d.i.value_m - diameter_m, d.j.value_m - diameter_m])
}

/// Figure 6.4: errors of cylinders' diameters over depth and stretch, and those of a ball with their intervals.
pub(crate) fn faces(panels: &mut Vec<Panel>) {
    let (diameters_mm, depths_mm): (Vec<f64>, Vec<f64>) = if examples::small() {
        (vec![20.0], vec![3.0, 12.0])
    } else {
        (vec![10.0, 15.0, 20.0, 25.0, 30.0], vec![1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 12.0, 15.0])
    };
    let states: Vec<(f64, f64, f64)> = diameters_mm
        .iter()
        .flat_map(|&d| stretches().into_iter().map(move |x| (d, x)))
        .flat_map(|(d, x)| depths_mm.iter().map(move |&depth| (d, x, depth)))
        .collect();
    let errors: Vec<Errors> =
        states.par_iter().map(|&(d, x, depth)| face(1e-3 * d, x, 1e-3 * depth)).collect();
    let of =
        |d: f64, x: f64, depth: f64| states.iter().position(|s| *s == (d, x, depth)).and_then(|k| errors[k]);
    println!(
        "\nErrors of a 20 mm cylinder's diameter along i / j (mm; figure 6.4 b, c); columns: depth (mm)"
    );
    table(&depths_mm, &|x, depth| {
        of(20.0, x, depth).map_or("no edge".into(), |e| format!("{:+.2} / {:+.2}", 1e3 * e[0], 1e3 * e[1]))
    });
    println!(
        "\nMean absolute error along i and j over the stretches (mm; figure 6.4 a); columns: depth (mm)"
    );
    let head: String = depths_mm.iter().map(|d| format!("{d:>9.0}")).collect();
    println!("{:>9}{head}", "D (mm)");
    for &d in &diameters_mm {
        let cell = |depth: f64| {
            let seen: Vec<f64> = stretches()
                .into_iter()
                .filter_map(|x| of(d, x, depth))
                .map(|e| 0.5e3 * (e[0].abs() + e[1].abs()))
                .collect();
            if seen.is_empty() {
                return format!("{:>9}", "-");
            }
            format!(
                "{:>6.2} {}/{}",
                seen.iter().sum::<f64>() / seen.len() as f64,
                seen.len(),
                stretches().len()
            )
        };
        println!("{d:>9.0}{}", depths_mm.iter().map(|depth| cell(*depth)).collect::<String>());
    }
    let step = |values: &[f64], k: usize| {
        let gap = |a: usize, b: usize| values[b] - values[a];
        let (low, high) = (k.saturating_sub(1), (k + 1).min(values.len() - 1));
        gap(low, high) / (high - low).max(1) as f64
    };
    let stretched: Vec<f64> = stretches().iter().map(|x| 1e3 * x).collect();
    for (axis, title) in
        ["6.4 c: error along i (mm), 20 mm", "6.4 b: error along j (mm), 20 mm"].iter().enumerate()
    {
        let mut panel = Panel::new(*title, "depth (mm)", "stretch (mm)");
        for (k, &depth) in depths_mm.iter().enumerate() {
            for (l, x) in stretches().into_iter().enumerate() {
                let Some(e) = of(20.0, x, depth) else { continue };
                let off = 1e3 * e[axis];
                let sides = [step(&depths_mm, k), step(&stretched, l)];
                panel.cell([depth, 1e3 * x], sides, &shade(off.abs() / 3.0));
                panel.text([depth, 1e3 * x], format!("{off:+.1}"));
            }
        }
        panels.push(panel);
    }
    println!("\nErrors of a 30 mm ball's diameter and their 95 % half width (mm); columns: depth (mm)");
    let ball = |x: f64, depth: f64| -> String {
        let mut rig = Rig::new(Shape::Ball { radius_m: 0.015 }, Filling::Rigid, 64);
        let seen = look(&mut rig, x, at(0.0, -1e-3 * depth)).ok();
        match seen.map(|(cloud, segmenter)| cap(&cloud, &segmenter.states)) {
            Some(Ok(b)) => format!("{:+.1} +- {:.1}", 2e3 * (b.radius_m - 0.015), 3.92e3 * b.radius_sigma_m),
            Some(Err(stretch::contact::ContactError::Flat { .. })) => "open".into(),
            _ => "none".into(),
        }
    };
    table(&depths_mm, &ball);
}

/// A table over stretch and depth (mm).
fn table(depths_mm: &[f64], cell: &(dyn Fn(f64, f64) -> String + Sync)) {
    let head: String = depths_mm.iter().map(|d| format!("{d:>14.0}")).collect();
    println!("{:>13}{head}", "stretch (mm)");
    for x in stretches() {
        let cells: Vec<String> = depths_mm.par_iter().map(|d| format!("{:>14}", cell(x, *d))).collect();
        println!("{:>13.0}{}", 1e3 * x, cells.concat());
    }
}
