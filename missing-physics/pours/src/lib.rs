//! Pours of grains, simulated with `granular-infer`, from which the domain `grain-pour` of `missing-physics-domains` learns its emulator.
//!
//! A crate of its own, so that who does not diagnose pours does not download them.

/// The pours of one rig (1,000 grains of 4 mm), compressed by gzip: the shards of `granular-infer`'s example `campaign`, one after the
/// other, as `granular_infer::shard::read` reads them.
pub const CAMPAIGN: &[u8] = include_bytes!("../campaign.bin.gz");
