//! A rig with a dough that is physics: an arm, a gripper with a band between its fingers, a depth camera and a clock behind the
//! traits of `hw-traits`. Time passes only while somebody sleeps on the clock.
//!
//! What is in it: slices of constant volume that flow where the band presses harder than they bear ([`DoughKind`]), springback, a
//! friction limit beyond which the band slides over the dough, water that dries, dough that sticks to the band. Nothing of it is a
//! polynomial of length, width and height, and these three are not all of the dough's state.

mod body;
mod camera;
mod hand;
mod kind;
mod rig;

pub use self::camera::Eye;
pub use self::kind::{DoughKind, Effects};
pub use self::rig::{FakeError, FakeRig};
