use hw_traits::{ErrorKind, ErrorType};

use super::PourError;

/// Why a closed-loop pour ended without the wanted volume; the wrist has been sent upright.
#[derive(Debug, thiserror::Error)]
pub enum ClosedLoopError<E: std::fmt::Debug> {
    /// A number of the plan is outside its range.
    #[error("{name} is {got}, expected {expected}")]
    Plan {
        /// What it is.
        name: &'static str,
        /// What came.
        got: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// The container and what is wanted of it do not go together: [`PourError::NotPourable`] and its kin.
    #[error(transparent)]
    Pour(#[from] PourError),
    /// A force was beyond the sensor's range.
    #[error("a force is beyond the sensor's range after {poured_m3} m^3, expected readings within it")]
    Saturated {
        /// What had been poured, m^3.
        poured_m3: f64,
    },
    /// A reading is no number.
    #[error("a reading at {t_s} s is no number")]
    NotFinite {
        /// Its time, s.
        t_s: f64,
    },
    /// The sensor or the joint gave no answer, several times in a row.
    #[error("no answer after {poured_m3} m^3, {tries} tries: {answer:?}")]
    Lost {
        /// What had been poured, m^3.
        poured_m3: f64,
        /// How often it was asked.
        tries: usize,
        /// The last answer.
        answer: E,
    },
    /// Times of readings do not rise.
    #[error("a reading at {t_s} s follows one at {before_s} s, expected a later one")]
    Time {
        /// The time, s.
        t_s: f64,
        /// The time before, s.
        before_s: f64,
    },
    /// At the steepest tilt nothing has left: the container is empty, closed, or the lip is elsewhere.
    #[error("nothing flows at {tilt_rad} rad, where {inside_m3} m^3 were said to be inside")]
    NothingFlows {
        /// The tilt reached, rad.
        tilt_rad: f64,
        /// What was said to be inside, m^3.
        inside_m3: f64,
    },
    /// The flow ended before the wanted volume had left, however far the wrist turned.
    #[error("the flow ended after {poured_m3} m^3 of the wanted {wanted_m3} m^3")]
    RanDry {
        /// What had been poured, m^3.
        poured_m3: f64,
        /// What was wanted, m^3.
        wanted_m3: f64,
    },
    /// The pour took longer than its patience.
    #[error("{poured_m3} m^3 had been poured when the patience of {patience_s} s ended")]
    TimeOut {
        /// What had been poured, m^3.
        poured_m3: f64,
        /// The patience, s.
        patience_s: f64,
    },
}

/// What became of a device's error.
pub(super) fn of_device<D: ErrorType>(
    error: D::Error,
    tries: usize,
    poured_m3: f64,
) -> ClosedLoopError<D::Error> {
    match hw_traits::Error::kind(&error) {
        ErrorKind::Saturated => ClosedLoopError::Saturated { poured_m3 },
        _ => ClosedLoopError::Lost { poured_m3, tries, answer: error },
    }
}
