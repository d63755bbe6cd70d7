//! Figures 6.3 and 6.5: forces of balls, a cylinder and a cone, the moduli behind them, and forces with a radius left out.

use examples::plot::{Panel, hue};
use hertz_contact::indenter::Indenter;
use rayon::prelude::*;
use stretch::fake::{Membrane, Shape, Sheet};
use stretch::force::curve;
use stretch::modulus::{POISSON_RATIO, Press, Surface, effective_pa};

use super::{Outcome, stretches};

const RADII_M: [f64; 5] = [0.008, 0.011, 0.014, 0.018, 0.024];
/// Radius of figure 6.5's unknown ball, m: none of those that were pressed.
const ASKED_M: f64 = 0.0125;

fn depths() -> Vec<f64> {
    (1..=5).map(|k| 3e-3 * f64::from(k)).collect()
}

/// Forces (N) of presses into a membrane, ever deeper.
fn presses(shape: Shape, stretch_m: f64) -> Vec<(f64, f64)> {
    let mut membrane = Membrane::new(Sheet::matl_2021(), stretch_m);
    let press = |d: f64| {
        membrane.press(&shape, [0.0; 2], d);
        (d, membrane.force_n)
    };
    depths().into_iter().map(press).collect()
}

/// Figures 6.3 and 6.5.
pub(crate) fn curves(panels: &mut Vec<Panel>) -> Outcome<Surface> {
    let stretches = stretches();
    let n = stretches.len();
    let [ball, rod, cone] = [
        Indenter::Sphere { radius_m: 0.01 },
        Indenter::Cylinder { radius_m: 0.01 },
        Indenter::Cone { angle_rad: 0.785 },
    ];
    let three = [
        ("6.3 a: force (N), ball of 20 mm", ball, Shape::Ball { radius_m: 0.01 }),
        ("6.3 b: force (N), cylinder of 20 mm", rod, Shape::Cylinder { radius_m: 0.01 }),
        ("6.3 c: force (N), cone of 45 degrees", cone, Shape::Cone { angle_rad: 0.785 }),
    ];
    let mut by_shape = Panel::new("6.3 f: E* (kPa) by indenter", "stretch (mm)", "");
    println!("\nEffective modulus E* (kPa) by indenter (figure 6.3 f); columns: stretch (mm)");
    println!("{:>10}{}", "", stretches.iter().map(|x| format!("{:>8.0}", 1e3 * x)).collect::<String>());
    for (k, (title, indenter, shape)) in three.into_iter().enumerate() {
        let all: Vec<Vec<(f64, f64)>> = stretches.par_iter().map(|x| presses(shape, *x)).collect();
        let mut panel = Panel::new(title, "depth (mm)", "");
        let mut moduli = Vec::new();
        for (l, (x, pressed)) in stretches.iter().zip(&all).enumerate() {
            let (e, _) = effective_pa(&indenter, pressed)?;
            let colour = hue(l, n);
            panel.dots(pressed.iter().map(|(d, f)| [1e3 * d, *f]), &colour);
            let per = indenter.factor() * e / (1.0 - POISSON_RATIO * POISSON_RATIO);
            let line = (0..=30).map(|i| 5e-4 * f64::from(i));
            panel.line(line.map(|d| [1e3 * d, per * d.powf(indenter.exponent())]), &colour);
            panel.name(format!("{:.0} mm", 1e3 * x), &colour);
            moduli.push([1e3 * x, 1e-3 * e]);
        }
        panels.push(panel);
        let name = ["ball", "cylinder", "cone"][k];
        println!("{name:>10}{}", moduli.iter().map(|m| format!("{:>8.2}", m[1])).collect::<String>());
        let colour = hue(k, 3);
        by_shape.line(moduli.clone(), &colour).dots(moduli, &colour).name(name, &colour);
    }
    let balls = balls(&stretches);
    panels.push(by_diameter(&balls));
    let surface = Surface::fit(&balls)?;
    moduli(&surface, &balls, &stretches, panels)?;
    panels.push(by_shape);
    interpolated(&surface, &stretches, panels)?;
    Ok(surface)
}

/// Presses of all balls at all stretches.
fn balls(stretches: &[f64]) -> Vec<Press> {
    let states: Vec<(f64, f64)> =
        RADII_M.iter().flat_map(|r| stretches.iter().map(move |x| (*r, *x))).collect();
    let of = |(radius_m, stretch_m): (f64, f64)| -> Vec<Press> {
        presses(Shape::Ball { radius_m }, stretch_m)
            .into_iter()
            .map(|(indentation_m, force_n)| Press { stretch_m, radius_m, indentation_m, force_n })
            .collect()
    };
    states.into_par_iter().flat_map_iter(of).collect()
}

/// Figure 6.3 d: balls at a stretch of 30 mm.
fn by_diameter(balls: &[Press]) -> Panel {
    let mut panel = Panel::new("6.3 d: force (N), balls at 30 mm of stretch", "depth (mm)", "");
    for (k, r) in RADII_M.into_iter().enumerate() {
        let mine = balls.iter().filter(|p| p.radius_m == r && (p.stretch_m - 0.03).abs() < 1e-9);
        let points: Vec<[f64; 2]> = mine.map(|p| [1e3 * p.indentation_m, p.force_n]).collect();
        let colour = hue(k, RADII_M.len());
        panel.line(points.clone(), &colour).dots(points, &colour).name(format!("{:.0} mm", 2e3 * r), &colour);
    }
    panel
}

/// Figures 6.3 e and 6.5 a: the modulus by diameter and stretch, and the error with a radius left out.
fn moduli(surface: &Surface, balls: &[Press], stretches: &[f64], panels: &mut Vec<Panel>) -> Outcome<()> {
    println!(
        "\nEffective modulus E* of balls (kPa); rows: stretch (mm), columns: diameter (mm) (figure 6.3 e)"
    );
    println!("{:>4}{}", "", RADII_M.iter().map(|r| format!("{:>9.0}", 2e3 * r)).collect::<String>());
    let mut over_stretch = Panel::new("6.3 e: E* (kPa) by diameter", "stretch (mm)", "");
    let mut over_diameter = Panel::new("6.5 a: E* (kPa) by stretch, a + b exp(-D/c)", "diameter (mm)", "");
    let own = |r: f64, x: f64| -> Outcome<f64> {
        let mine = balls.iter().filter(|p| p.radius_m == r && p.stretch_m == x);
        let pairs: Vec<(f64, f64)> = mine.map(|p| (p.indentation_m, p.force_n)).collect();
        Ok(1e-3 * effective_pa(&Indenter::Sphere { radius_m: r }, &pairs)?.0)
    };
    for (l, &x) in stretches.iter().enumerate() {
        let cells = RADII_M.iter().map(|r| own(*r, x)).collect::<Outcome<Vec<f64>>>()?;
        println!("{:>4.0}{}", 1e3 * x, cells.iter().map(|e| format!("{e:>9.2}")).collect::<String>());
        let colour = hue(l, stretches.len());
        over_diameter.dots(RADII_M.iter().zip(&cells).map(|(r, e)| [2e3 * r, *e]), &colour);
        let line = (0..=32).map(|i| 0.008 + 5e-4 * f64::from(i));
        over_diameter
            .line(line.filter_map(|r| surface.modulus_pa(r, x).ok().map(|e| [2e3 * r, 1e-3 * e])), &colour);
        over_diameter.name(format!("{:.0} mm", 1e3 * x), &colour);
    }
    for (k, r) in RADII_M.into_iter().enumerate() {
        let colour = hue(k, RADII_M.len());
        let points =
            stretches.iter().map(|x| Ok([1e3 * x, own(r, *x)?])).collect::<Outcome<Vec<[f64; 2]>>>()?;
        over_stretch
            .line(points.clone(), &colour)
            .dots(points, &colour)
            .name(format!("{:.0} mm", 2e3 * r), &colour);
    }
    panels.extend([over_stretch, over_diameter]);
    let (mean, spread) = surface.left_out_error_n();
    let range = balls.iter().map(|p| p.force_n).fold(0.0, f64::max);
    println!(
        "left out: {mean:.3} +- {spread:.3} N of {range:.2} N ([Matl 2021], on another hand: 0.023 +- 0.011 N)"
    );
    Ok(())
}

/// Figure 6.5 b and c: a ball that was not pressed; what the half-space says, and what the membrane does.
fn interpolated(surface: &Surface, stretches: &[f64], panels: &mut Vec<Panel>) -> Outcome<()> {
    let mut rising = Panel::new("6.5 b: E* (kPa) of a 25 mm ball, p + q ln(1 + x/x0)", "stretch (mm)", "");
    let (first, last) = (stretches[0], stretches[stretches.len() - 1]);
    let line = (0..=40).map(|k| first + (last - first) * f64::from(k) / 40.0);
    rising.line(
        line.filter_map(|x| surface.modulus_pa(ASKED_M, x).ok().map(|e| [1e3 * x, 1e-3 * e])),
        "steelblue",
    );
    let mut forces = Panel::new("6.5 c: force (N) of a 25 mm ball: lines foretold", "depth (mm)", "");
    let mut worst = 0f64;
    for (l, &x) in stretches.iter().enumerate() {
        let colour = hue(l, stretches.len());
        let pressed = presses(Shape::Ball { radius_m: ASKED_M }, x);
        let (e, _) = effective_pa(&Indenter::Sphere { radius_m: ASKED_M }, &pressed)?;
        rising.dots([[1e3 * x, 1e-3 * e]], "crimson");
        let depths: Vec<f64> = pressed.iter().map(|p| p.0).collect();
        let foretold = curve(surface, ASKED_M, x, &depths)?;
        worst = pressed.iter().zip(&foretold).map(|(p, f)| (p.1 - f).abs()).fold(worst, f64::max);
        let fine: Vec<f64> = (0..=30).map(|i| 5e-4 * f64::from(i)).collect();
        let line = curve(surface, ASKED_M, x, &fine)?;
        forces.line(fine.iter().zip(line).map(|(d, f)| [1e3 * d, f]), &colour);
        forces
            .dots(pressed.iter().map(|p| [1e3 * p.0, p.1]), &colour)
            .name(format!("{:.0} mm", 1e3 * x), &colour);
    }
    println!(
        "a ball of 25 mm, not among those pressed: F(delta) is off by {worst:.3} N at most (figure 6.5 c)"
    );
    panels.extend([rising, forces]);
    Ok(())
}
