//! Pours chapter 3's campaign, or one of heights, through the runner of bayes-sim: resumable, in shards that merge.
//!
//! ```text
//! cargo run --release -p granular-infer --example pours -- grains 2000 SHARD OF FILE    prior over the grains, from 12 cm
//! cargo run --release -p granular-infer --example pours -- series 1684 SHARD OF FILE    the same, from three heights each
//! cargo run --release -p granular-infer --example pours -- cloths 1684 SHARD OF FILE     the same, each on a cloth of its own rolling friction
//! cargo run --release -p granular-infer --example pours -- heights 800 SHARD OF FILE     couscous from 1 to 13 cm
//! ```
//! A sixth argument is the number of grains (600). Run again with the same arguments it goes on where it was stopped. SHARD counts from 0.
#![allow(clippy::print_stdout, reason = "says how far it is")]

use std::error::Error;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use bayes_sim::campaign::{Campaign, Shard, Simulator};
use bayes_sim::prior::Prior;
use granular_infer::scene::{CLOTHS, COUSCOUS, FromHeights, OfGrain, SERIES_M, Scene, check_prior, prior};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [kind, count, index, of, file, grains @ ..] = arguments.as_slice() else {
        return Err("expected grains|series|cloths|heights COUNT SHARD OF FILE [GRAINS]".into());
    };
    let mut scene = Scene::default();
    if let [grains] = grains {
        scene.rig.count = grains.parse()?;
    }
    let (simulator, prior, seed): (Box<dyn Simulator>, Prior, u64) = match kind.as_str() {
        "grains" => (Box::new(FromHeights { scene, heights_m: vec![0.12], cloths: None }), prior()?, 1),
        "series" => {
            (Box::new(FromHeights { scene, heights_m: SERIES_M.to_vec(), cloths: None }), prior()?, 3)
        }
        "cloths" => {
            let heights_m = SERIES_M.to_vec();
            (Box::new(FromHeights { scene, heights_m, cloths: Some(CLOTHS) }), prior()?, 4)
        }
        "heights" => (Box::new(OfGrain { scene, grain: COUSCOUS }), Prior::uniform(&[[0.01, 0.13]])?, 2),
        other => return Err(format!("{other}: expected grains, series, cloths or heights").into()),
    };
    let campaign = Campaign { prior, x_dim: simulator.x_dim(), count: count.parse()?, seed };
    if kind != "heights" {
        check_prior(&campaign.prior)?;
    }
    let shard = Shard { index: index.parse()?, count: of.parse()? };
    let progress = |done: usize, all: usize| println!("{done} of {all}");
    let results =
        campaign.run(simulator.as_ref(), shard, Path::new(file), &progress, &AtomicBool::new(false))?;
    println!("{} pours, {} of them failed", results.records.len(), results.failures().count());
    Ok(())
}
