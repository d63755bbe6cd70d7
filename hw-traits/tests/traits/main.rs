//! All tests of the crate: one program, linked once.

mod conformance;
mod objects;
mod picture;
mod replay;
