//! Figure 5.11 and the task of section 5.5: loads at slip, and a grasp that answers.

use examples::plot::Panel;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use softcell::fake::{Bench, FakeError};
use softcell::grasp::{Grasp, GraspSettings};
use softcell::modulus::{Stiffness, printed_force_n};

use super::Outcome;

const GRAVITY: f64 = 9.80665;

/// Figure 5.11: beads are poured in until the camera sees shear.
pub(crate) fn slips(stiffness: &Stiffness, panels: &mut Vec<Panel>) -> Outcome<()> {
    let (trials, pressures): (u64, &[f64]) = if examples::small() {
        (2, &[0.0, 3000.0])
    } else {
        (10, &[0.0, 500.0, 1000.0, 1500.0, 2000.0, 2500.0, 3000.0])
    };
    println!("\nLoad at slip ({trials} trials a pressure) and normal force (figure 5.11)");
    println!(
        "{:>9} {:>16} {:>13} {:>16} {:>21} {:>14}",
        "p (kPa)", "mass (g)", "95 % (g)", "normal, mu N (N)", "eq. 5.3 corrected (N)", "as printed (N)"
    );
    let mut load = Panel::new("5.11 a: mass at slip (g)", "pressure (kPa)", "");
    let mut normal = Panel::new("5.11 b: normal force (N)", "indentation (mm)", "");
    let (mut held, mut lines) = (Vec::new(), [Vec::new(), Vec::new(), Vec::new()]);
    for &pressure_pa in pressures {
        let trial = |k: u64| mass_at_slip_kg(pressure_pa, 1000 + k).map_err(|e| e.to_string());
        let masses_kg: Vec<f64> = (0..trials).into_par_iter().map(trial).collect::<Result<_, String>>()?;
        let mut bench = Bench::matl_2021(0);
        bench.air.pressure_pa = pressure_pa;
        let (depth_m, normal_n) = (bench.indentation_now_m(), bench.normal_n());
        let corrected_n = stiffness.force_n(pressure_pa, depth_m, 0.0, f64::INFINITY)?.value;
        let modulus_pa = stiffness.modulus_pa(pressure_pa)?.value;
        let printed_n = printed_force_n(modulus_pa, stiffness.tip_m(pressure_pa)?, depth_m);
        let n = masses_kg.len() as f64;
        let mean = masses_kg.iter().sum::<f64>() / n;
        let spread = (masses_kg.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        println!(
            "{:>9.2} {:>16.1} {:>13.1} {:>9.2} {:>6.2} {:>21.2} {:>14.2}",
            1e-3 * pressure_pa,
            1e3 * mean,
            1e3 * 1.96 * spread / n.sqrt(),
            normal_n,
            bench.wall_friction * normal_n,
            corrected_n,
            printed_n
        );
        load.dots(masses_kg.iter().map(|m| [1e-3 * pressure_pa, 1e3 * m]), "steelblue");
        held.push([1e-3 * pressure_pa, 1e3 * bench.wall_friction * normal_n / GRAVITY]);
        // What the load at slip says of the normal force, with the wall's friction known.
        normal.dots([[1e3 * depth_m, mean * GRAVITY / bench.wall_friction]], "steelblue");
        for (line, force) in lines.iter_mut().zip([normal_n, corrected_n, printed_n]) {
            line.push([1e3 * depth_m, force]);
        }
    }
    load.line(held, "grey").name("detected shear", "steelblue").name("mu N of the wall", "grey");
    normal.name("from the load at slip", "steelblue");
    let names =
        [("simulated tip", "grey"), ("eq. 5.3 corrected", "seagreen"), ("eq. 5.3 as printed", "crimson")];
    for (line, (name, colour)) in lines.into_iter().zip(names) {
        normal.line(line, colour).name(name, colour);
    }
    panels.extend([load, normal]);
    Ok(())
}

/// Pressure held by hand of the simulation; friction differs a little from trial to trial.
fn mass_at_slip_kg(pressure_pa: f64, seed: u64) -> Outcome<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut bench = Bench::matl_2021(seed);
    let scatter: f64 = StandardNormal.sample(&mut rng);
    bench.wall_friction *= 1.0 + 0.03 * scatter;
    let settings = GraspSettings {
        start_pa: pressure_pa,
        step_pa: 1.0,
        limit_pa: pressure_pa.max(1.0),
        ..GraspSettings::default()
    };
    bench.air.pressure_pa = pressure_pa;
    // What the wall holds by far is in the box from the start.
    bench.mass_kg = bench.mass_kg.max(0.7 * bench.wall_friction * bench.normal_n() / GRAVITY);
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
pub(crate) fn demonstration() -> Outcome<Panel> {
    let mut bench = Bench::matl_2021(9);
    bench.pour_kg_s = 10e-3;
    let mut grasp = Grasp::new::<FakeError>(GraspSettings::default())?;
    println!("\nA grasp that answers shear: beads up to 210.2 g, as in [Matl 2021]");
    println!("{:>7} {:>9} {:>14} {:>13}", "t (s)", "mass (g)", "wanted (kPa)", "slid (mm)");
    let mut panel = Panel::new("5.5: a grasp that answers shear", "time (s)", "");
    let (mut pressure, mut mass, mut slid) = (Vec::new(), Vec::new(), Vec::new());
    while bench.mass_kg < 0.2102 {
        let turn = grasp.turn(&mut bench)?;
        pressure.push([turn.t_s, 1e-3 * turn.pressure_pa]);
        mass.push([turn.t_s, 10.0 * bench.mass_kg]);
        slid.push([turn.t_s, 1e3 * bench.touch.shear_m[1]]);
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
    let named = [
        (pressure, "pressure (kPa)", "steelblue"),
        (mass, "mass (100 g)", "grey"),
        (slid, "slid (mm)", "crimson"),
    ];
    for (line, name, colour) in named {
        panel.line(line, colour).name(name, colour);
    }
    Ok(panel)
}
