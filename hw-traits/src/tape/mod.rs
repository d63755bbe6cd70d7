//! Recording and replay of every device: what was asked and answered, in order.
//!
//! A [`Recorder`] stands before a device and hands each command and each answer on as an [`Event`]. A [`Playback`] answers from
//! such events. A program that ran with the first runs with the second, as long as it gives the same commands.

mod event;
#[cfg(feature = "tape-file")]
mod file;
mod playback;
mod recorder;

pub use event::{Command, Event, Fact, Reading, Stream};
#[cfg(feature = "tape-file")]
pub use file::{Tape, TapeError, read_tape, write_event};
pub use playback::Playback;
pub use recorder::Recorder;
