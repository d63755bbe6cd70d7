//! Pouring with the scale in the loop, beside the open loop of [Matl 2021]: six liquids, three vessels, 20 to 120 mL.
//!
//! `cargo run --release -p examples --example 22_pouring` (108 pours, each four times; `--small`: 6 of the bottle, twice) writes `pouring.svg` in the
//! temporary folder: a pour of water and one of honey. Volume, density and viscosity are felt first, by a slow turn and a swing.
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

mod picture;
mod rig;
mod sense;

use std::error::Error;
use std::f64::consts::PI;

use hw_traits::clock::Clock;
use hw_traits::rotary::Rotary;
use liquid_haptics::fake::{AXIA80, Cavity, FakePour, Round, Sensor};
use liquid_haptics::pour::closed_loop::{ClosedLoop, Inside, Manner, Moment, Poured, Scale};
use liquid_haptics::pour::{Bead, Mouth, Pour};
use rayon::prelude::*;

use rig::{Case, LIQUIDS, VESSELS, WALL_M};

pub(crate) type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// What came of a case.
struct Tried {
    case: Case,
    inside: Inside,
    /// Poured without the loop, m^3: at rest in the end, and when it is turned back.
    at_rest_m3: f64,
    open_m3: f64,
    closed: Closed,
    /// Poured in the loop by who takes everything for water, and with a sensor that does not wander, m^3.
    as_water_m3: Option<f64>,
    still_m3: Option<f64>,
}

/// A pour in the loop: what is believed, and what is true (m^3).
struct Closed {
    poured: Poured,
    truth_m3: f64,
}

fn main() -> Outcome<()> {
    let small = examples::small();
    let vessels = if small { 1 } else { VESSELS.len() };
    let wanted: &[f64] = if small { &[60e-6] } else { &[20e-6, 60e-6, 120e-6] };
    let repeats = if small { 1 } else { 2 };
    let mut cases = Vec::new();
    for liquid in 0..LIQUIDS.len() {
        for vessel in 0..vessels {
            for wanted_m3 in wanted {
                for _ in 0..repeats {
                    cases.push(Case::new(liquid, vessel, *wanted_m3, 100 + 2 * cases.len() as u64));
                }
            }
        }
    }
    let results: Outcome<Vec<Tried>> = cases.into_par_iter().map(|case| one(case, small)).collect();
    let results = results?;
    table(&results);
    let path = picture::draw(&[Case::new(1, 0, 100e-6, 7), Case::new(5, 0, 60e-6, 9)])?;
    println!("picture: {}", path.display());
    Ok(())
}

/// The vessel as it is stated, with a volume and what it holds as they were felt.
pub(crate) fn in_the_loop(
    case: &Case,
    inside: Inside,
    sensor: Sensor,
    observer: &mut dyn FnMut(&Moment),
) -> Outcome<(Poured, FakePour)> {
    let cylinder = case.cylinder()?;
    let plan = ClosedLoop {
        pour: open_pour(case, &cylinder)?,
        inside,
        scale: Scale { wander_n: sensor.wander_steps * sensor.force_step_n, ..Scale::AXIA80 },
        manner: Manner::default(),
        gravity_m_s2: rig::GRAVITY,
    };
    let mut wrist =
        FakePour::new(case.truth, case.disturbances, sensor, case.seed).map_err(|e| e.to_string())?;
    let poured = plan
        .pour_observed(&mut wrist, case.wanted_m3, observer)
        .map_err(|e| format!("{} of {}: {e}", case.wanted_m3, case.kind().name))?;
    Ok((poured, wrist))
}

fn open_pour<'a>(case: &Case, cylinder: &'a liquid_haptics::container::Cylinder) -> Outcome<Pour<'a>> {
    let stated = &case.stated;
    let mouth = Mouth::new(stated.lip_radius_m, stated.length_m + WALL_M)?;
    Ok(Pour::new(cylinder, mouth, Bead::measured(stated.hold_m, stated.rest_m)?, PI)?)
}

/// What the computed tilt leaves inside once all is at rest, however long that takes, as columns say it: what has left, m^3.
fn at_rest(case: &Case, inside: Inside) -> Outcome<f64> {
    let cylinder = case.cylinder()?;
    let stated = open_pour(case, &cylinder)?.tilt_rad(inside.volume_m3, case.wanted_m3)?;
    let truth = &case.truth;
    let tilt = stated + case.disturbances.angle_offset_rad;
    let level = (truth.length_m + WALL_M) * tilt.cos() - truth.lip_radius_m * tilt.sin() + truth.rest_m;
    let cavity = Round::new(truth.radius_m, truth.length_m, WALL_M, 20_000);
    Ok(truth.volume_m3 - cavity.below(tilt, level)[0])
}

/// The open loop: turn to the computed tilt at 0.1 rad/s, wait until next to nothing flows (which the rig cannot see, but the simulation can), at most two
/// minutes, and turn back.
fn open_loop(case: &Case, inside: Inside) -> Outcome<f64> {
    let cylinder = case.cylinder()?;
    let tilt = open_pour(case, &cylinder)?.tilt_rad(inside.volume_m3, case.wanted_m3)?;
    let mut wrist =
        FakePour::new(case.truth, case.disturbances, AXIA80, case.seed).map_err(|e| e.to_string())?;
    let mut go = |angle: f64, rate: f64| -> Result<(), hw_traits::ErrorKind> {
        wrist.turn_to(angle, rate)?;
        while !wrist.settled()? {
            wrist.sleep_s(0.05)?;
        }
        wrist.sleep_s(2.0)?;
        let begin = wrist.now_s()?;
        while wrist.flow_m3_s() > 2e-8 && wrist.now_s()? < begin + 120.0 {
            wrist.sleep_s(0.05)?;
        }
        wrist.sleep_s(3.0)
    };
    go(tilt, 0.1).and_then(|()| go(0.0, 1.0)).map_err(|e| e.to_string())?;
    Ok(wrist.poured_m3())
}

fn one(case: Case, small: bool) -> Outcome<Tried> {
    let inside = sense::felt(&case)?;
    let (poured, wrist) = in_the_loop(&case, inside, AXIA80, &mut |_| {})?;
    let other = |inside: Inside, sensor: Sensor| {
        let pour = || in_the_loop(&case, inside, sensor, &mut |_| {}).ok();
        if small { None } else { pour().map(|(_, wrist)| wrist.poured_m3()) }
    };
    let as_water_m3 = other(Inside { viscosity_m2_s: 1e-6, ..inside }, AXIA80);
    let still_m3 = other(inside, Sensor { wander_steps: 0.0, ..AXIA80 });
    Ok(Tried {
        at_rest_m3: at_rest(&case, inside)?,
        open_m3: open_loop(&case, inside)?,
        closed: Closed { poured, truth_m3: wrist.poured_m3() },
        as_water_m3,
        still_m3,
        inside,
        case,
    })
}

/// Mean, its 95 % interval, spread, and the largest of errors, mL.
fn shown(errors: &[f64]) -> String {
    if errors.is_empty() {
        return "-".into();
    }
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let spread = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt();
    let worst = errors.iter().fold(0.0f64, |most, e| most.max(e.abs()));
    format!("{mean:+6.2} +- {:4.2}, {spread:4.2}, {worst:5.2}", 1.96 * spread / n.sqrt())
}

fn table(results: &[Tried]) {
    println!("errors in mL: mean +- its 95 % interval, spread, worst\n");
    println!(
        "{:18} {:>4} {:>29} {:>29} {:>29} {:>29}",
        "", "", "open loop, at rest", "open loop, 2 min", "in the loop", "in the loop, as if water"
    );
    let row = |name: &str, of: &[&Tried]| {
        let errors = |get: &dyn Fn(&Tried) -> Option<f64>| -> Vec<f64> {
            of.iter().filter_map(|r| Some(1e6 * (get(r)? - r.case.wanted_m3))).collect()
        };
        let as_water = errors(&|r| r.as_water_m3);
        let failed = of.len() - as_water.len();
        let failed =
            if failed > 0 && failed < of.len() { format!(" ({failed} failed)") } else { String::new() };
        println!(
            "{name:18} {:4} {:>29} {:>29} {:>29} {:>29}{failed}",
            of.len(),
            shown(&errors(&|r| Some(r.at_rest_m3))),
            shown(&errors(&|r| Some(r.open_m3))),
            shown(&errors(&|r| Some(r.closed.truth_m3))),
            shown(&as_water)
        );
    };
    for (k, liquid) in LIQUIDS.iter().enumerate() {
        row(liquid.name, &results.iter().filter(|r| r.case.liquid == k).collect::<Vec<_>>());
    }
    for (k, vessel) in VESSELS.iter().enumerate() {
        let of: Vec<&Tried> = results.iter().filter(|r| r.case.vessel == k).collect();
        if !of.is_empty() {
            row(vessel.name, &of);
        }
    }
    for wanted in [20.0, 60.0, 120.0] {
        let of: Vec<&Tried> =
            results.iter().filter(|r| (1e6 * r.case.wanted_m3 - wanted).abs() < 0.5).collect();
        if !of.is_empty() {
            row(&format!("{wanted} mL"), &of);
        }
    }
    row("all", &results.iter().collect::<Vec<_>>());
    intervals(results);
}

fn intervals(results: &[Tried]) {
    let n = results.len();
    let within = |limit: f64| {
        results.iter().filter(|r| (1e6 * (r.closed.truth_m3 - r.case.wanted_m3)).abs() <= limit).count()
    };
    println!("\nin the loop within 0.5 mL: {} of {n}, within 1 mL: {}", within(0.5), within(1.0));
    let still: Vec<f64> =
        results.iter().filter_map(|r| Some(1e6 * (r.still_m3? - r.case.wanted_m3))).collect();
    println!("the same with a sensor that does not wander: {}", shown(&still));
    let holds = |r: &&Tried| {
        let [low, high] = r.closed.poured.interval_m3;
        (low..=high).contains(&r.closed.truth_m3)
    };
    let half = results.iter().map(|r| 1.96e6 * r.closed.poured.error_m3).sum::<f64>() / n as f64;
    println!(
        "what was poured lies in its 95 % interval: {} of {n}; half its width {half:.2} mL",
        results.iter().filter(holds).count()
    );
    let at_the_turn = |r: &&Tried| {
        let poured = &r.closed.poured;
        (r.closed.truth_m3 - poured.predicted_m3).abs() <= 1.96 * poured.predicted_error_m3
    };
    let error = results.iter().map(|r| 1.96e6 * r.closed.poured.predicted_error_m3).sum::<f64>() / n as f64;
    println!(
        "what was poured lies in the one at the turn back: {} of {n}; half its width {error:.2} mL",
        results.iter().filter(at_the_turn).count()
    );
    let felt: Vec<f64> =
        results.iter().map(|r| 1e6 * (r.closed.poured.volume_m3 - r.closed.truth_m3)).collect();
    println!("what was poured, as weighed: {}", shown(&felt));
    let volumes: Vec<f64> =
        results.iter().map(|r| 1e6 * (r.inside.volume_m3 - r.case.truth.volume_m3)).collect();
    println!("volume inside, felt before: {}", shown(&volumes));
    let share = |r: &Tried| (r.inside.viscosity_m2_s / r.case.truth.viscosity_m2_s).ln().abs();
    let refused = results.iter().filter(|r| r.inside.viscosity_m2_s == sense::REFUSED_M2_S).count();
    let worst = results.iter().map(share).fold(0.0, f64::max).exp();
    println!("viscosity felt before: to a factor of {worst:.2}, {refused} refused");
    for (k, liquid) in LIQUIDS.iter().enumerate() {
        let of: Vec<f64> =
            results.iter().filter(|r| r.case.liquid == k).map(|r| r.closed.poured.took_s).collect();
        let mean = of.iter().sum::<f64>() / of.len() as f64;
        println!("{:18} takes {mean:3.0} s in the mean", liquid.name);
    }
}
