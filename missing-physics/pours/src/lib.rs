#![doc = include_str!("../README.md")]

/// The pours of one rig (1,000 grains of 4 mm), compressed by gzip.
pub const CAMPAIGN: &[u8] = include_bytes!("../campaign.bin.gz");
