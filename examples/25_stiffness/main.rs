//! How stiff an object is, felt by a fingertip whose own stiffness is set by air: pressures that are chosen, matched, and fixed.
//!
//! `cargo run --release -p examples --example 25_stiffness` (eight objects on 25 rigs each; `--small`: four on three) writes `stiffness.svg` in the temporary
//! folder: presses, what the likelihood becomes from press to press, and how the intervals narrow.
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

mod feel;
mod picture;

use std::error::Error;

use rayon::prelude::*;
use softcell::fake::{Errors, Object, Palpator};
use softcell::stiffness::{Bound, Instrument, Palpation, Press, Reading};

use feel::{Felt, OBJECTS, PRESSES, Policy, WANTED};

pub(crate) type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

fn main() -> Outcome<()> {
    let small = examples::small();
    let rigs: u64 = if small { 3 } else { 25 };
    let objects: Vec<usize> = (0..OBJECTS.len()).filter(|k| !small || k % 2 == 0).collect();
    println!(
        "presses until the 95 % interval is within a factor of {WANTED} from end to end, at most {PRESSES}: median, and how many of {rigs} rigs get there\n"
    );
    print!("{:22} {:>8} {:>24}", "", "true", "felt, by chosen presses");
    for policy in Policy::ALL {
        print!(" {:>11}", policy.name());
    }
    println!("   holds");
    let mut all = Vec::new();
    for &k in &objects {
        let felt: Outcome<Vec<Vec<Felt>>> = (0..rigs)
            .into_par_iter()
            .map(|rig| feel::on_rig(k, 1000 * k as u64 + rig, &Policy::ALL, PRESSES))
            .collect();
        let felt = felt?;
        row(k, &felt);
        all.extend(felt);
    }
    totals(&all);
    refused()?;
    println!("\npicture: {}", picture::draw(small)?.display());
    Ok(())
}

/// A modulus or a bound in kPa.
fn shown(bound: &Bound) -> String {
    match bound {
        Bound::Within { value, low, high } => format!("{} ({} to {})", kpa(*value), kpa(*low), kpa(*high)),
        Bound::AtLeast(low) => format!("at least {}", kpa(*low)),
        Bound::AtMost(high) => format!("at most {}", kpa(*high)),
    }
}

fn kpa(modulus_pa: f64) -> String {
    let e = 1e-3 * modulus_pa;
    if e < 10.0 {
        format!("{e:.2}")
    } else if e < 100.0 {
        format!("{e:.1}")
    } else {
        format!("{e:.0}")
    }
}

fn row(object: usize, felt: &[Vec<Felt>]) {
    let kind = &OBJECTS[object];
    let first = felt.first().and_then(|f| f.first()).map_or(String::new(), |f| shown(&f.bound));
    print!("{:22} {:>8} {first:>24}", kind.name, kpa(kind.modulus_pa));
    let mut holds = 0;
    for k in 0..Policy::ALL.len() {
        let mut presses: Vec<usize> = felt.iter().map(|f| f[k].presses).collect();
        let there = felt.iter().filter(|f| f[k].there).count();
        holds += felt.iter().filter(|f| f[k].holds()).count();
        presses.sort_unstable();
        let median = presses[presses.len() / 2];
        let shown = if 2 * there > felt.len() { format!("{median}, {there}") } else { format!("-, {there}") };
        print!(" {shown:>11}");
    }
    println!("   {holds} of {}", felt.len() * Policy::ALL.len());
}

fn totals(all: &[Vec<Felt>]) {
    println!(
        "\nthe true modulus lies in the 95 % interval, or beyond the 95 % bound, when the last press is done:"
    );
    for (k, policy) in Policy::ALL.iter().enumerate() {
        let of: Vec<&Felt> = all.iter().map(|f| &f[k]).collect();
        let holds = of.iter().filter(|f| f.holds()).count();
        let one_sided = of.iter().filter(|f| !matches!(f.bound, Bound::Within { .. })).count();
        // Errors of the logarithm over the standard deviation that the interval says.
        let errors: Vec<f64> = of.iter().filter_map(|f| f.error()).collect();
        let square = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
        let refused: usize = of.iter().map(|f| f.refused).sum();
        let presses: usize = of.iter().map(|f| f.presses).sum();
        println!(
            "  {:11} {holds} of {} ({one_sided} bounds on one side); errors are {:.2} of what is said; {presses} presses, {refused} of them refused",
            policy.name(),
            of.len(),
            square.sqrt()
        );
    }
}

/// What is no press on one elastic object.
fn refused() -> Outcome<()> {
    let mut rig = Palpator::new(Errors::matl_2021(), 5).ok_or("no tip")?;
    let tip = feel::calibrated(&mut rig)?;
    let mut palpation = Palpation::new(tip, Instrument::matl_2021())?;
    let gel = Object { modulus_pa: 20e3, radius_m: f64::INFINITY, dent: 0.0 };
    let press = |rig: &mut Palpator, object: &Object| rig.press(object, 1e3).ok_or("no contact to be solved");
    let good = press(&mut rig, &gel)?;
    let dough = press(&mut rig, &Object { dent: 0.5, ..gel })?;
    let far = |r: &Reading| Reading { contact_m: 0.0, ..*r };
    let air = Press {
        loading: good.loading.iter().map(far).collect(),
        unloading: good.unloading.iter().map(far).collect(),
        ..good.clone()
    };
    rig.drag_m = 2e-3;
    let dragged = press(&mut rig, &gel)?;
    rig.drag_m = 0.0;
    let firm = Press { pressure_pa: 20e3, ..good.clone() };
    println!("\nrefused:");
    for (what, wrong) in
        [("a dough", &dough), ("nothing there", &air), ("a drag", &dragged), ("20 kPa of air", &firm)]
    {
        match palpation.add(wrong) {
            Ok(()) => println!("  {what}: taken"),
            Err(e) => println!("  {what}: {e}"),
        }
    }
    palpation.add(&good)?;
    palpation.add(&press(&mut rig, &Object { modulus_pa: 100e3, ..gel })?)?;
    match palpation.estimate() {
        Ok(e) => println!("  two objects as one: {}", shown(&e.modulus_pa)),
        Err(e) => println!("  two objects as one: {e}"),
    }
    Ok(())
}
