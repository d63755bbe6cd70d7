use crate::forward::forward;

/// What kind of thing went wrong, in terms that a driver can act on without knowing the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[cfg_attr(feature = "tape-file", derive(serde::Serialize, serde::Deserialize))]
pub enum ErrorKind {
    /// The device does not answer, or the link to it broke; trying again may help.
    Link,
    /// The device answered too late for the value to be of use; trying again may help.
    Timeout,
    /// A command is outside what the device can do; the same command will fail again.
    OutOfRange,
    /// A command was refused since the last reading of what it moves is too old; read, and command again.
    Stale,
    /// A reading is beyond the sensor's range: its value says nothing.
    Saturated,
    /// The device stopped for safety, and moves again only after somebody has cleared it.
    Stopped,
    /// A recording that is played back has no more to give.
    EndOfRecording,
    /// A recording that is played back was made with other commands.
    NotAsRecorded,
    /// Anything else.
    Other,
}

impl std::fmt::Display for ErrorKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Link => "the device does not answer",
            Self::Timeout => "the device answered too late",
            Self::OutOfRange => "the command is outside the device's range",
            Self::Stale => "the last reading is too old for a command",
            Self::Saturated => "the reading is beyond the sensor's range",
            Self::Stopped => "the device has stopped for safety",
            Self::EndOfRecording => "the recording has ended",
            Self::NotAsRecorded => "the recording was made with other commands",
            Self::Other => "something else went wrong",
        })
    }
}

/// What a program can do about an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Severity {
    /// The same call may succeed the next time.
    Transient,
    /// The same call fails again: a command or a load is beyond what the device can do.
    Limit,
    /// Nothing more comes before somebody has looked at the device or the recording.
    Fatal,
}

impl ErrorKind {
    /// What a program can do about it.
    pub fn severity(self) -> Severity {
        match self {
            Self::Link | Self::Timeout | Self::Stale => Severity::Transient,
            Self::OutOfRange | Self::Saturated => Severity::Limit,
            Self::Stopped | Self::EndOfRecording | Self::NotAsRecorded | Self::Other => Severity::Fatal,
        }
    }
}

/// An error of a device.
///
/// Drivers keep their own error types, with all that they know; generic code asks for the [`ErrorKind`].
pub trait Error: std::fmt::Debug {
    /// The kind of this error. Of several that apply, the one that comes first in [`ErrorKind`].
    fn kind(&self) -> ErrorKind;
}

impl Error for ErrorKind {
    fn kind(&self) -> ErrorKind {
        *self
    }
}

/// A device that cannot fail.
impl Error for std::convert::Infallible {
    fn kind(&self) -> ErrorKind {
        match *self {}
    }
}

/// The error type of a device, one for all the traits that it implements.
pub trait ErrorType {
    /// The error.
    type Error: Error;
}

forward!(ErrorType {
    type Error = T::Error;
});
