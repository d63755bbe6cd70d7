//! A pouring rig: a funnel on an arm, a gate, a depth camera over cloth and a clock behind the traits of `hw-traits`. Time passes
//! only while somebody sleeps on the clock or waits for a picture.
//!
//! Its grains may be clumps, cohesive or of mixed size, and what they are is known to the rig alone.

mod devices;
mod grains;

pub use devices::{FakeError, FakeRig};
pub use grains::{FakeGrains, Kind};
