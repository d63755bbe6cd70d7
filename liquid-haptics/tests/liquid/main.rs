//! All tests of the crate: one program, linked once.

mod classify;
mod closed_loop;
mod common;
mod cylinder;
mod fake;
mod fusion;
mod mass;
mod measured_slosh;
mod mesh;
mod pour;
mod signal;
mod verdict;
mod viscosity;
mod volume;
