//! All tests of the crate: one program, linked once.

mod forces;
mod geometry;
