use hw_traits::ErrorKind;

/// What went wrong with a device.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DriverError {
    /// The link broke, or could not be made.
    #[error("{device}: {what}: {error}")]
    Link {
        /// The device, with its address.
        device: String,
        /// What was tried.
        what: &'static str,
        /// What the system says.
        error: std::io::ErrorKind,
    },
    /// Nothing came within the time that a reading may take.
    #[error("{device}: no answer within {waited_s} s")]
    Late {
        /// The device, with its address.
        device: String,
        /// How long it was waited, s.
        waited_s: f64,
    },
    /// What came is not what the protocol says.
    #[error("{device}: expected {expected}, received {received}")]
    Garbled {
        /// The device, with its address.
        device: String,
        /// What the protocol says.
        expected: &'static str,
        /// What came.
        received: String,
    },
    /// A command or a setting is outside its limits; nothing was sent.
    #[error("{what} is {value}, expected {low} to {high}")]
    Limit {
        /// What, with its unit.
        what: &'static str,
        /// What was wanted.
        value: f64,
        /// The smallest.
        low: f64,
        /// The largest.
        high: f64,
    },
    /// A command was refused since nothing has been read for too long; nothing was sent.
    #[error("the last reading is {age_s} s old, a command wants one of at most {patience_s} s")]
    Stale {
        /// Age of the last reading, s; infinite before the first.
        age_s: f64,
        /// The oldest that may be, s.
        patience_s: f64,
    },
    /// A reading beyond the sensor's range.
    #[error("{device}: beyond its range (status {status:#010x})")]
    Saturated {
        /// The device, with its address.
        device: String,
        /// The device's status word.
        status: u32,
    },
    /// The device was stopped by the dead-man's rule, and wants to be cleared.
    #[error("stopped: {why}")]
    Stopped {
        /// Why.
        why: String,
    },
    /// The device says that something is wrong with it.
    #[error("{device}: {words} (code {code:#x})")]
    Device {
        /// The device, with its address.
        device: String,
        /// What its manual says of the code.
        words: &'static str,
        /// The code.
        code: u32,
    },
    /// A file that is not what it should be.
    #[error("{file}: {words}")]
    File {
        /// The file.
        file: String,
        /// What is wrong.
        words: String,
    },
    /// A recording is at its end.
    #[error("the recording has ended")]
    End,
}

impl hw_traits::Error for DriverError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Link { .. } | Self::Garbled { .. } => ErrorKind::Link,
            Self::Late { .. } => ErrorKind::Timeout,
            Self::Limit { .. } => ErrorKind::OutOfRange,
            Self::Stale { .. } => ErrorKind::Stale,
            Self::Saturated { .. } => ErrorKind::Saturated,
            Self::Stopped { .. } => ErrorKind::Stopped,
            Self::End => ErrorKind::EndOfRecording,
            Self::Device { .. } | Self::File { .. } => ErrorKind::Other,
        }
    }
}

impl DriverError {
    /// The error of a call of the system: late where a time ran out.
    pub(crate) fn of_io(device: &str, what: &'static str, error: &std::io::Error, waited_s: f64) -> Self {
        let device = device.to_owned();
        match error.kind() {
            std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut => Self::Late { device, waited_s },
            error => Self::Link { device, what, error },
        }
    }
}

/// Whether a number is within its limits; NaN is not.
pub(crate) fn within(what: &'static str, value: f64, low: f64, high: f64) -> Result<(), DriverError> {
    if value >= low && value <= high { Ok(()) } else { Err(DriverError::Limit { what, value, low, high }) }
}
