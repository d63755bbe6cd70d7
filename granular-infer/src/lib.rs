#![doc = include_str!("../README.md")]

pub mod camera;
pub mod campaign;
pub mod columns;
pub mod dem;
pub mod emulator;
#[cfg(feature = "fake")]
pub mod fake;
mod order;
pub mod posterior;
pub mod scene;
pub mod seeing;
pub mod shard;
pub mod shipped;
pub mod statistics;
pub mod summary;
pub mod tasks;
pub mod view;
