//! A tape as a file: one CBOR item an event, one after the other (RFC 8742), so that a file that was cut short holds what came before.

use std::io::{BufRead, Write};

use super::Event;

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Tape {
    /// The events, in order.
    pub events: Vec<Event>,
    /// Whether the file ends within an event: whoever wrote it was killed.
    pub cut: bool,
}

/// Why a tape cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum TapeError {
    /// The file cannot be written or read.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// What is there is no event.
    #[error("event {number} (from 0) is none: {why}")]
    NoEvent {
        /// Its number.
        number: usize,
        /// What was expected.
        why: String,
    },
}

/// Writes an event after those before it.
///
/// # Errors
/// [`TapeError::Io`].
pub fn write_event(event: &Event, mut to: impl Write) -> Result<(), TapeError> {
    ciborium::into_writer(event, &mut to).map_err(|e| match e {
        ciborium::ser::Error::Io(error) => TapeError::Io(error),
        ciborium::ser::Error::Value(why) => TapeError::Io(std::io::Error::other(why)),
    })
}

/// Reads a file of events.
///
/// # Errors
/// [`TapeError`]; a last event that is cut short is none.
pub fn read_tape(mut from: impl BufRead) -> Result<Tape, TapeError> {
    use ciborium::de::Error;
    let mut events = Vec::new();
    while !from.fill_buf()?.is_empty() {
        match ciborium::from_reader(&mut from) {
            Ok(event) => events.push(event),
            Err(Error::Io(e)) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
                return Ok(Tape { events, cut: true });
            }
            Err(Error::Io(error)) => return Err(error.into()),
            Err(error) => return Err(TapeError::NoEvent { number: events.len(), why: error.to_string() }),
        }
    }
    Ok(Tape { events, cut: false })
}
