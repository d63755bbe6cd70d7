//! All tests of the crate: one program, linked once.

mod common;
mod cup;
mod drop;
mod filter;
mod flight;
mod hear;
mod integrator;
mod listen;
mod localise;
mod material;
mod place;
mod posterior;
mod practice;
mod track;
mod wav;
