//! All tests of the crate: one program, linked once.

mod chance;
mod clouds;
mod dynamics;
mod fake;
mod planning;
