//! Pours a shard of a campaign: `cargo run --release -p granular-infer --example campaign -- FIRST LAST FILE [STEP]`.
//!
//! 1,000 grains of 4 mm and 1,300 kg/m3 through the funnel of the recordings. A file that is there is gone on with. Shards of one
//! campaign merge with `cat`. A step of 2 from an odd number leaves out the rods, which take ten times as long.
#![allow(
    clippy::print_stdout,
    clippy::approx_constant,
    reason = "says how far it is; the angle is as recordings state it"
)]

use std::path::Path;

use granular_infer::campaign::{Ranges, Rig};
use granular_infer::shard;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (numbers, file, step) = match arguments.as_slice() {
        [first, last, file] => ([first, last], file, 1),
        [first, last, file, step] => ([first, last], file, step.parse::<usize>()?.max(1)),
        _ => return Err("expected FIRST LAST FILE [STEP]".into()),
    };
    let (first, last): (u32, u32) = (numbers[0].parse()?, numbers[1].parse()?);
    let rig = Rig {
        count: 1000,
        diameter_m: 4e-3,
        mass_kg: 4.356e-5,
        outlet_radius_m: 0.014,
        cone_half_angle_rad: 0.7854,
        tube_radius_m: 0.04,
    };
    let mut bytes = if Path::new(file).exists() { std::fs::read(file)? } else { Vec::new() };
    let there: Vec<u32> = shard::read(&bytes, &rig)?.iter().map(|record| record.0).collect();
    let pours: Vec<u32> = (first..last).step_by(step).filter(|pour| !there.contains(pour)).collect();
    for (done, &pour) in pours.iter().enumerate() {
        let conditions = Ranges::default().draw(1, u64::from(pour));
        match rig.pour(&conditions, u64::from(pour)) {
            Ok(grains) => shard::append(&mut bytes, pour, &rig, &grains),
            Err(error) => println!("pour {pour}: {error}, at {conditions:?}"),
        }
        if (done + 1) % 20 == 0 || done + 1 == pours.len() {
            // What was poured is on disk, should this end early.
            std::fs::write(file, &bytes)?;
            println!("{} of {}", done + 1, pours.len());
        }
    }
    Ok(())
}
