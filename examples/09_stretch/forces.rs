//! Figures 6.3 and 6.5: forces of balls, a cylinder and a cone, the moduli behind them, and forces with a radius left out.

use examples::plot::{Panel, hue};
use hertz_contact::indenter::Indenter;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use rayon::prelude::*;
use stretch::calibration::{ForceModel, LeftOut, Press};
use stretch::fake::{Membrane, Shape, Sheet};
use stretch::force::curve;
use stretch::membrane::MembraneModel;
use stretch::modulus::{HalfSpace, POISSON_RATIO, effective_pa};

use super::{Outcome, stretches};

const RADII_M: [f64; 5] = [0.008, 0.011, 0.014, 0.018, 0.024];
/// Radius of figure 6.5's unknown ball, m: none of those that were pressed.
const ASKED_M: f64 = 0.0125;
/// One sigma of the force gauge that balls are calibrated with, N, and of the depth that a press is set to, m: the membrane that is calibrated
/// is not smoother than its law.
const GAUGE_N: f64 = 5e-3;
const DEPTH_M: f64 = 5e-5;

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
pub(crate) fn curves(panels: &mut Vec<Panel>) -> Outcome<MembraneModel> {
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
    let balls = balls(&stretches)?;
    panels.push(by_diameter(&balls));
    let half_space = HalfSpace::fit(&balls)?;
    moduli(&half_space, &balls, &stretches, panels)?;
    panels.push(by_shape);
    let model = MembraneModel::fit(&balls)?;
    let range = balls.iter().map(|p| p.force_n).fold(0.0, f64::max);
    println!(
        "\nForces left out, of {range:.2} N, gauge {GAUGE_N} N and depths {:.2} mm (one sigma); N:",
        1e3 * DEPTH_M
    );
    println!("{:>36}{:>18}{:>18}", "", "a radius", "a stretch");
    let line = |name: &str, errors: [Option<LeftOut>; 2]| {
        let of = |e: Option<LeftOut>| {
            e.map_or("too few".into(), |e| format!("{:.4} +- {:.4}", e.mean_n, e.spread_n))
        };
        println!("{name:>36}{:>18}{:>18}", of(errors[0]), of(errors[1]));
    };
    line("a membrane's law", [model.radius_left_out(), model.stretch_left_out()]);
    line("a half-space, as in [Matl 2021]", [half_space.radius_left_out(), half_space.stretch_left_out()]);
    println!("{:>36}{:>18}", "[Matl 2021], on another hand", "0.023 +- 0.011");
    interpolated(&model, &half_space, &stretches, panels)?;
    Ok(model)
}

/// Presses of all balls at all stretches.
fn balls(stretches: &[f64]) -> Outcome<Vec<Press>> {
    let states: Vec<(f64, f64)> =
        RADII_M.iter().flat_map(|r| stretches.iter().map(move |x| (*r, *x))).collect();
    let of = |(state, (radius_m, stretch_m)): (usize, (f64, f64))| -> Outcome<Vec<Press>> {
        let mut rng = ChaCha8Rng::seed_from_u64(state as u64);
        let (gauge, depth) = (Normal::new(0.0, GAUGE_N)?, Normal::new(0.0, DEPTH_M)?);
        let press = |set_m: f64| {
            let mut membrane = Membrane::new(Sheet::matl_2021(), stretch_m);
            membrane.press(&Shape::Ball { radius_m }, [0.0; 2], set_m + depth.sample(&mut rng));
            let force_n = membrane.force_n + gauge.sample(&mut rng);
            Press { stretch_m, radius_m, indentation_m: set_m, force_n }
        };
        Ok(depths().into_iter().map(press).collect())
    };
    let all: Vec<Vec<Press>> = states.into_par_iter().enumerate().map(of).collect::<Outcome<_>>()?;
    Ok(all.into_iter().flatten().collect())
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

/// Figures 6.3 e and 6.5 a: the modulus by diameter and stretch.
fn moduli(surface: &HalfSpace, balls: &[Press], stretches: &[f64], panels: &mut Vec<Panel>) -> Outcome<()> {
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
    Ok(())
}

/// Figure 6.5 b and c: a ball that was not pressed; what the half-space says, and what the membrane does.
fn interpolated(
    model: &MembraneModel,
    half_space: &HalfSpace,
    stretches: &[f64],
    panels: &mut Vec<Panel>,
) -> Outcome<()> {
    let mut rising = Panel::new("6.5 b: E* (kPa) of a 25 mm ball, p + q ln(1 + x/x0)", "stretch (mm)", "");
    let (first, last) = (stretches[0], stretches[stretches.len() - 1]);
    let line = (0..=40).map(|k| first + (last - first) * f64::from(k) / 40.0);
    rising.line(
        line.filter_map(|x| half_space.modulus_pa(ASKED_M, x).ok().map(|e| [1e3 * x, 1e-3 * e])),
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
        let foretold = curve(model, ASKED_M, x, &depths)?;
        worst = pressed.iter().zip(&foretold).map(|(p, f)| (p.1 - f).abs()).fold(worst, f64::max);
        let fine: Vec<f64> = (0..=30).map(|i| 5e-4 * f64::from(i)).collect();
        let line = curve(model, ASKED_M, x, &fine)?;
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
