//! From raw streams to wrenches in the world's frame: [Matl 2021], section 2.5, step by step or all at once.
//!
//! Sensor and joint have clocks of their own. The order is that of [Matl 2021]: the joint's times are brought to the sensor's clock
//! ([`align`]), the wrench is low-passed and thinned ([`Decimator`]), the joint's angle is interpolated to the times that are left, the
//! offset is taken off, the wrench is turned into the world's frame, and smoothed ([`Smoother`]). A [`Pipeline`] takes readings as
//! they come; [`batch`] is the same code fed a recording, so that both give the same bits.

mod align;
mod error;
mod fir;
mod pipeline;

pub use align::{ClockMap, align, align_at};
pub use error::SignalError;
pub use fir::{Decimator, Smoother, low_pass};
pub use pipeline::{Aligned, Pipeline, PipelineSettings, batch};
