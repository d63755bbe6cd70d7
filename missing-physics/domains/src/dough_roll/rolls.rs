//! A dough's rolls, as files and model know them.

use dough_mbrl::roll::Roll;

/// A roll with its place in the recording.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub(super) roll: Roll,
    pub(super) step: f64,
    /// Time, 0 where it was not recorded.
    pub(super) t_s: f64,
}

/// The rolls of a run, in order.
pub(super) type RunOfRolls = (String, Vec<Step>);

/// Channels: the three dimensions after a roll, and before it.
pub(super) const CHANNELS: [&str; 6] =
    ["next_length_m", "next_width_m", "next_height_m", "length_m", "width_m", "height_m"];
