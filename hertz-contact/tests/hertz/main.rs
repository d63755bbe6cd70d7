//! All tests of the crate: one program, linked once.

mod fit;
mod laws;
mod layer;
mod measured;
mod viscoelastic;
