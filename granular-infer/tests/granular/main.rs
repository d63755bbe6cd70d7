//! All tests of the crate: one program, linked once.

mod bulk;
mod clumps;
mod common;
mod dem;
mod emulator;
mod fill;
mod peer;
mod posterior;
mod rig;
mod seeing;
mod summary;
mod walls;
