//! Chapter 5 on a simulated tip: how firm it is, what it feels, the load at which a box slips, and a grasp that answers.
//!
//! `cargo run --release -p examples --example 08_softcell` (`--small`: fewer trials); draws `softcell.svg` into the temporary folder
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use std::error::Error;
use std::fmt::Write;

use hw_traits::camera::Camera;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use softcell::fake::{Bench, Dome, FakeError, Touch};
use softcell::field::{Contour, Kernel, Plan};
use softcell::flow::{Tracker, TrackerSettings};
use softcell::grasp::{Grasp, GraspSettings};
use softcell::load::{ShearLoad, Sheared};
use softcell::modulus::{Pair, State, Stiffness, effective, printed_force_n};

/// The probe of section 5.4, m.
const PROBE_M: f64 = 0.019;

fn main() -> Result<(), Box<dyn Error>> {
    let stiffness = firmness()?;
    shear_loads()?;
    let contours = contours()?;
    let slips = slips(&stiffness)?;
    demonstration()?;
    let path = std::env::temp_dir().join("softcell.svg");
    std::fs::write(&path, picture(&contours, &slips)?)?;
    println!("\ncontours of equal shear and load at slip drawn: {}", path.display());
    Ok(())
}

/// Figures 5.5 and 5.7.
fn firmness() -> Result<Stiffness, Box<dyn Error>> {
    println!(
        "Effective modulus (figure 5.5 d; the thesis: 4.4 to 46.1 kPa over its pressures) and smallest force"
    );
    println!(
        "{:>9} {:>9} {:>19} {:>8} {:>14}",
        "p (kPa)", "E (kPa)", "95 % interval", "misfit", "F_min (mN)"
    );
    let dome = Dome::thesis();
    let mut rng = ChaCha8Rng::seed_from_u64(55);
    let mut found = Vec::new();
    for p in [0.0, 1000.0, 2000.0, 3000.0, 4500.0, 6140.0, 9000.0, 12000.0] {
        let stage: Vec<f64> = (0..80).map(|k| 0.1e-3 * f64::from(k)).collect();
        let mut noise = || -> f64 { 2e-3 * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
        let force: Vec<f64> = stage.iter().map(|d| dome.force_n(p, PROBE_M, d - 1e-3) + noise()).collect();
        let pair = Pair { tip_m: dome.radius_at_m(p), probe_m: PROBE_M };
        let e = effective(&stage, &force, &pair)?;
        found.push((State { pressure_pa: p, modulus_pa: e.modulus_pa, tip_m: pair.tip_m }, e));
    }
    let states: Vec<State> = found.iter().map(|f| f.0).collect();
    let stiffness = Stiffness::fit(&states)?;
    for (s, e) in &found {
        let least = stiffness.smallest_force_n(s.pressure_pa, 0.6e-3, PROBE_M)?.value;
        let (low, high) = e.interval_pa;
        println!(
            "{:>9.2} {:>9.2} {:>9.2} {:>9.2} {:>8} {:>14.1}",
            1e-3 * s.pressure_pa,
            1e-3 * e.modulus_pa,
            1e-3 * low,
            1e-3 * high,
            e.misfit,
            1e3 * least
        );
    }
    Ok(stiffness)
}

/// Figure 5.10: load against mean shear as the camera sees it, learned at four pressures, asked at others.
fn shear_loads() -> Result<(), Box<dyn Error>> {
    let at = |pressure_pa: f64, shear_m: f64, seed: u64| -> Result<Sheared, Box<dyn Error>> {
        let mut bench = Bench::thesis(seed);
        bench.holds_box = false;
        bench.air.leak = 0.0;
        bench.air.pressure_pa = pressure_pa;
        bench.touch.indentation_m = bench.indentation_now_m();
        let mut tracker = Tracker::new(&bench.picture()?.value, TrackerSettings::default())?;
        for k in 1..=4 {
            bench.touch.shear_m[1] = 0.25 * f64::from(k) * shear_m;
            tracker.next(&bench.picture()?.value)?;
        }
        let seen: Vec<f64> = tracker.tracks().iter().filter(|t| t.seen()).map(|t| t.by_px()[1]).collect();
        let mean = seen.iter().sum::<f64>() / seen.len() as f64;
        Ok(Sheared { pressure_pa, shear_m: mean, load_n: bench.carried_n(shear_m) })
    };
    let mut samples = Vec::new();
    for p in [0.0, 1000.0, 2000.0, 3000.0] {
        for k in 0..=4 {
            samples.push(at(p, 0.6e-3 * f64::from(k), 1)?);
        }
    }
    let load = ShearLoad::fit(&samples)?;
    println!("\nShear load from the mean shear (figure 5.10)");
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
    Ok(())
}

/// Figure 5.9: displacement along the shear.
fn contours() -> Result<Vec<Contour>, Box<dyn Error>> {
    let mut bench = Bench::thesis(3);
    bench.holds_box = false;
    bench.touch = Touch { indentation_m: 5e-3, ..Touch::none() };
    let mut tracker = Tracker::new(&bench.picture()?.value, TrackerSettings::default())?;
    bench.touch.shear_m = [0.0, 1.5e-3];
    tracker.next(&bench.picture()?.value)?;
    let seen: Vec<_> = tracker.tracks().iter().filter(|t| t.seen()).collect();
    let places: Vec<[f64; 2]> = seen.iter().map(|t| t.home_px).collect();
    let values: Vec<f64> = seen.iter().map(|t| t.by_px()[1]).collect();
    let highest = values.iter().copied().fold(0.0, f64::max);
    let levels: Vec<f64> = (2..10).map(|k| 0.1 * f64::from(k) * highest).collect();
    let plan = Plan::new(&places, Kernel::ThinPlate, 1e-3)?;
    Ok(plan.field(&values)?.contours([160.0, 80.0], [480.0, 400.0], (81, 81), &levels)?)
}

/// Pressure, loads at slip of each trial, and what the corrected eq. 5.3 and the printed one predict, kg.
struct Slip {
    pressure_pa: f64,
    masses_kg: Vec<f64>,
    true_n: f64,
    corrected_n: f64,
    printed_n: f64,
}

/// Figure 5.11: beads are poured in until the camera sees shear.
fn slips(stiffness: &Stiffness) -> Result<Vec<Slip>, Box<dyn Error>> {
    let trials: u64 = if examples::small() { 2 } else { 10 };
    let pressures: &[f64] = if examples::small() {
        &[0.0, 3000.0]
    } else {
        &[0.0, 500.0, 1000.0, 1500.0, 2000.0, 2500.0, 3000.0]
    };
    println!("\nLoad at slip ({trials} trials a pressure) and normal force (figure 5.11)");
    println!(
        "{:>9} {:>16} {:>13} {:>16} {:>21} {:>14}",
        "p (kPa)", "mass (g)", "95 % (g)", "normal, mu N (N)", "eq. 5.3 corrected (N)", "as printed (N)"
    );
    let mut slips = Vec::new();
    for &pressure_pa in pressures {
        let trial = |k: u64| mass_at_slip_kg(pressure_pa, 1000 + k).map_err(|e| e.to_string());
        let masses_kg: Vec<f64> = (0..trials).into_par_iter().map(trial).collect::<Result<_, String>>()?;
        let mut bench = Bench::thesis(0);
        bench.air.pressure_pa = pressure_pa;
        let depth_m = bench.indentation_now_m();
        let slip = Slip {
            pressure_pa,
            true_n: bench.normal_n(),
            corrected_n: stiffness.force_n(pressure_pa, depth_m, 0.0, f64::INFINITY)?.value,
            printed_n: printed_force_n(
                stiffness.modulus_pa(pressure_pa)?.value,
                stiffness.tip_m(pressure_pa)?,
                depth_m,
            ),
            masses_kg,
        };
        let n = slip.masses_kg.len() as f64;
        let mean = slip.masses_kg.iter().sum::<f64>() / n;
        let spread = (slip.masses_kg.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        println!(
            "{:>9.2} {:>16.1} {:>13.1} {:>9.2} {:>6.2} {:>21.2} {:>14.2}",
            1e-3 * pressure_pa,
            1e3 * mean,
            1e3 * 1.96 * spread / n.sqrt(),
            slip.true_n,
            bench.wall_friction * slip.true_n,
            slip.corrected_n,
            slip.printed_n
        );
        slips.push(slip);
    }
    Ok(slips)
}

/// Pressure held by hand of the simulation; friction differs a little from trial to trial.
fn mass_at_slip_kg(pressure_pa: f64, seed: u64) -> Result<f64, Box<dyn Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut bench = Bench::thesis(seed);
    let scatter: f64 = StandardNormal.sample(&mut rng);
    bench.wall_friction *= 1.0 + 0.03 * scatter;
    let settings = GraspSettings {
        start_pa: pressure_pa,
        step_pa: 1.0,
        limit_pa: pressure_pa.max(1.0),
        ..GraspSettings::default()
    };
    bench.air.pressure_pa = pressure_pa;
    let mut grasp = Grasp::new::<FakeError>(settings)?;
    while bench.t_s() < 120.0 {
        // Beads once the tip has come to rest.
        bench.pour_kg_s = if bench.t_s() > 3.0 { 10e-3 } else { 0.0 };
        if grasp.turn(&mut bench)?.shear {
            return Ok(bench.mass_kg);
        }
    }
    Err("no slip within two minutes".into())
}

/// The task of section 5.5.
fn demonstration() -> Result<(), Box<dyn Error>> {
    let mut bench = Bench::thesis(9);
    bench.pour_kg_s = 10e-3;
    let mut grasp = Grasp::new::<FakeError>(GraspSettings::default())?;
    println!("\nA grasp that answers shear: beads up to 210.2 g, as in the thesis");
    println!("{:>7} {:>9} {:>14} {:>13}", "t (s)", "mass (g)", "wanted (kPa)", "slid (mm)");
    while bench.mass_kg < 0.2102 {
        let turn = grasp.turn(&mut bench)?;
        if turn.shear {
            println!(
                "{:>7.1} {:>9.1} {:>14.2} {:>13.2}",
                turn.t_s,
                1e3 * bench.mass_kg,
                1e-3 * turn.wanted_pa,
                1e3 * bench.touch.shear_m[1]
            );
        }
    }
    println!("held: {:.1} g, {:.2} mm down the wall", 1e3 * bench.mass_kg, 1e3 * bench.touch.shear_m[1]);
    Ok(())
}

fn picture(contours: &[Contour], slips: &[Slip]) -> Result<String, std::fmt::Error> {
    let mut svg = String::from(
        "<svg xmlns='http://www.w3.org/2000/svg' width='760' height='380' font-family='sans-serif' font-size='12'>\
         <rect width='760' height='380' fill='white'/>",
    );
    write!(svg, "<text x='20' y='20'>lines of equal displacement along the shear (px)</text>")?;
    for (k, c) in contours.iter().enumerate() {
        for line in &c.lines {
            let points: String =
                line.iter().map(|p| format!("{:.1},{:.1} ", p[0] - 140.0, p[1] - 50.0)).collect();
            write!(svg, "<polyline points='{points}' fill='none' stroke='hsl({},70%,45%)'/>", 240 - 30 * k)?;
        }
        if let Some(p) = c.lines.first().and_then(|l| l.first()) {
            write!(
                svg,
                "<text x='{:.0}' y='{:.0}' font-size='9'>{:.1}</text>",
                p[0] - 140.0,
                p[1] - 50.0,
                c.level
            )?;
        }
    }
    write!(svg, "<text x='420' y='20'>load at slip (g) against pressure (kPa); line: mu N</text>")?;
    write!(svg, "<path d='M440,350 h290 M440,350 v-300' stroke='black'/>")?;
    let at = |p: f64, kg: f64| (440.0 + 0.09 * p, 350.0 - 1500.0 * kg);
    for k in 0..=3 {
        let (x, y) = at(1000.0 * f64::from(k), 0.05 * f64::from(k));
        write!(svg, "<text x='{x}' y='366'>{k}</text><text x='412' y='{y}'>{}</text>", 50 * k)?;
    }
    let line: String = slips
        .iter()
        .map(|s| at(s.pressure_pa, 0.45 * s.true_n / 9.80665))
        .map(|(x, y)| format!("{x:.1},{y:.1} "))
        .collect();
    write!(svg, "<polyline points='{line}' fill='none' stroke='grey'/>")?;
    for s in slips {
        for m in &s.masses_kg {
            let (x, y) = at(s.pressure_pa, *m);
            write!(svg, "<circle cx='{x:.1}' cy='{y:.1}' r='2.5' fill='steelblue'/>")?;
        }
    }
    svg.push_str("</svg>");
    Ok(svg)
}
