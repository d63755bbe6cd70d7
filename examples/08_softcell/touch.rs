//! Figures 5.2, 5.9 and 5.10: what the camera sees of a press, a shear and a twist, and the load behind a shear.

use examples::plot::{Panel, hue};
use hw_traits::camera::Camera;
use softcell::fake::{Bench, Touch};
use softcell::field::{Kernel, Plan};
use softcell::flow::{Tracker, TrackerSettings};
use softcell::load::{ShearLoad, Sheared};
use softcell::shear::{MotionSettings, Moved, motion};

use super::Outcome;

/// A tip at a pressure, pressed by the box but not loaded.
fn bench(pressure_pa: f64, seed: u64) -> Bench {
    let mut bench = Bench::matl_2021(seed);
    bench.holds_box = false;
    (bench.air.leak, bench.air.pressure_pa) = (0.0, pressure_pa);
    bench.touch.indentation_m = bench.indentation_now_m();
    bench
}

/// Figure 5.2: traces of the markers, and what the motion is called.
pub(crate) fn traces() -> Outcome<Vec<Panel>> {
    println!("What moved (figure 5.2)");
    println!("{:>8} {:>7} {:>14} {:>11} {:>11}", "done", "shear", "press", "twist", "residual");
    let none = Touch { indentation_m: 3e-3, ..Touch::none() };
    let done = [
        ("press", Touch { at_m: [-3e-3, 0.0], indentation_m: 5e-3, ..none }, [-3e-3, 0.0]),
        ("shear", Touch { shear_m: [0.0, -1.5e-3], ..none }, [0.0; 2]),
        ("twist", Touch { turn_rad: 0.2, ..none }, [0.0; 2]),
    ];
    let mut panels = Vec::new();
    for (name, end, at_m) in done {
        let mut bench = bench(0.0, 52);
        let start = if name == "press" { Touch { at_m, indentation_m: 0.0, ..none } } else { none };
        bench.touch = start;
        let mut tracker = Tracker::new(&bench.picture()?.value, TrackerSettings::default())?;
        let mut lines: Vec<Vec<[f64; 2]>> = tracker.tracks().iter().map(|t| vec![t.at_px]).collect();
        for k in 1..=8 {
            let part = f64::from(k) / 8.0;
            bench.touch.indentation_m =
                start.indentation_m + part * (end.indentation_m - start.indentation_m);
            bench.touch.shear_m = end.shear_m.map(|s| part * s);
            bench.touch.turn_rad = part * end.turn_rad;
            tracker.next(&bench.picture()?.value)?;
            lines.iter_mut().zip(tracker.tracks()).for_each(|(line, t)| line.push(t.at_px));
        }
        let moved: Vec<Moved> = tracker
            .tracks()
            .iter()
            .filter(|t| t.seen())
            .map(|t| Moved { home: t.home_px, by: t.by_px() })
            .collect();
        let m = motion(&moved, &MotionSettings::new(0.1))?;
        println!(
            "{name:>8} {:>7} {:>14} {:>11} {:>11.2}",
            m.shear_part.present, m.indentation_part.present, m.torsion_part.present, m.residual
        );
        let mut panel = Panel::new(format!("5.2: {name}"), "column (px)", "row (px), down").map();
        for line in lines {
            panel.dots(line.last().map(|p| [p[0], -p[1]]), "crimson");
            panel.line(line.iter().map(|p| [p[0], -p[1]]), "steelblue");
        }
        panels.push(panel);
    }
    Ok(panels)
}

/// The shear (m) at which the skin carries a load (N); none where it slides first.
fn shear_of(bench: &Bench, load_n: f64) -> Option<f64> {
    let (mut low, mut high) = (0.0, 10e-3);
    if bench.carried_n(high) < load_n {
        return None;
    }
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if bench.carried_n(middle) < load_n { low = middle } else { high = middle }
    }
    Some(high)
}

/// Figure 5.9: displacement along the shear under 0.8 N, by pressure, in mm at the skin's middle.
pub(crate) fn contours(panels: &mut Vec<Panel>) -> Outcome<()> {
    println!("\nShear under 0.8 N (figure 5.9): the firmer tip gives way less");
    println!("{:>9} {:>12} {:>14}", "p (kPa)", "box (mm)", "largest (px)");
    for p in [0.0, 1500.0, 3000.0] {
        let mut bench = bench(p, 3);
        let Some(shear_m) = shear_of(&bench, 0.8) else {
            println!("{:>9.2} {:>12}", 1e-3 * p, "slides");
            continue;
        };
        let mut tracker = Tracker::new(&bench.picture()?.value, TrackerSettings::default())?;
        // As slowly as the box slides: a marker is followed from picture to picture.
        for k in 1..=8 {
            bench.touch.shear_m = [0.0, shear_m * f64::from(k) / 8.0];
            tracker.next(&bench.picture()?.value)?;
        }
        let seen: Vec<_> = tracker.tracks().iter().filter(|t| t.seen()).collect();
        let places: Vec<[f64; 2]> = seen.iter().map(|t| t.home_px).collect();
        let values: Vec<f64> = seen.iter().map(|t| t.by_px()[1]).collect();
        let highest = values.iter().copied().fold(0.0, f64::max);
        println!("{:>9.2} {:>12.2} {:>14.1}", 1e-3 * p, 1e3 * shear_m, highest);
        let levels: Vec<f64> = (2..=9).map(|k| 0.1 * f64::from(k) * highest).collect();
        let plan = Plan::new(&places, Kernel::ThinPlate, 1e-3)?;
        let lines = plan.field(&values)?.contours([160.0, 80.0], [480.0, 400.0], (81, 81), &levels)?;
        let title = format!("5.9: 0.8 N at {:.1} kPa, along the shear (px)", 1e-3 * p);
        let mut panel = Panel::new(title, "column (px)", "row (px), down").map();
        for (k, contour) in lines.iter().enumerate() {
            for line in &contour.lines {
                panel.line(line.iter().map(|p| [p[0], -p[1]]), &hue(k, 8));
            }
            if let Some(p) = contour.lines.first().and_then(|l| l.first()) {
                panel.text([p[0], -p[1]], format!("{:.1}", contour.level));
            }
        }
        panels.push(panel);
    }
    Ok(())
}

/// Figure 5.10: load against mean shear as the camera sees it, learned at four pressures, asked at others.
pub(crate) fn shear_loads() -> Outcome<Panel> {
    let at = |pressure_pa: f64, shear_m: f64, seed: u64| -> Outcome<Sheared> {
        let mut bench = bench(pressure_pa, seed);
        let mut tracker = Tracker::new(&bench.picture()?.value, TrackerSettings::default())?;
        for k in 1..=4 {
            bench.touch.shear_m[1] = 0.25 * f64::from(k) * shear_m;
            tracker.next(&bench.picture()?.value)?;
        }
        let seen: Vec<f64> = tracker.tracks().iter().filter(|t| t.seen()).map(|t| t.by_px()[1]).collect();
        let mean = seen.iter().sum::<f64>() / seen.len() as f64;
        Ok(Sheared { pressure_pa, shear_m: mean, load_n: bench.carried_n(shear_m) })
    };
    let pressures = [0.0, 1000.0, 2000.0, 3000.0];
    let mut samples = Vec::new();
    for p in pressures {
        for k in 0..=4 {
            samples.push(at(p, 0.6e-3 * f64::from(k), 1)?);
        }
    }
    let load = ShearLoad::fit(&samples)?;
    let mut panel = Panel::new("5.10: shear load (N)", "mean shear (px)", "");
    for (k, p) in pressures.into_iter().enumerate() {
        let colour = hue(k, pressures.len());
        let mine = || samples.iter().filter(move |s| s.pressure_pa == p);
        let most = mine().map(|s| s.shear_m).fold(0.0, f64::max);
        panel.dots(mine().map(|s| [s.shear_m, s.load_n]), &colour);
        let line = (0..=20).map(|i| most * f64::from(i) / 20.0);
        panel.line(line.filter_map(|u| load.load_n(p, u).ok().map(|(f, _)| [u, f])), &colour);
        panel.name(format!("{:.0} kPa", 1e-3 * p), &colour);
    }
    println!("\nShear load from the mean shear (figure 5.10), at pressures that were not learned");
    println!("{:>9} {:>12} {:>9} {:>19}", "p (kPa)", "shear (px)", "load (N)", "read off (N)");
    for (p, u) in [(500.0, 1e-3), (1500.0, 2e-3), (2500.0, 1.5e-3)] {
        let s = at(p, u, 2)?;
        let (value, sigma) = load.load_n(s.pressure_pa, s.shear_m)?;
        println!(
            "{:>9.2} {:>12.2} {:>9.3} {:>10.3} +- {:.3}",
            1e-3 * p,
            s.shear_m,
            s.load_n,
            value,
            1.96 * sigma
        );
    }
    Ok(panel)
}
