//! All tests of the crate: one program, linked once.

mod ati;
mod dcon;
mod dynamixel;
mod files;
mod robotiq;
mod ur;
