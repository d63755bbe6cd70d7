//! All tests of the crate: one program, linked once.

mod forces;
mod grasp;
mod motion;
mod stiffness;
mod vision;
