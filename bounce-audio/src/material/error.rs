use crate::onset::OnsetError;
use thiserror::Error;

/// Why nothing is said of a material.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MaterialError {
    /// The sound cannot be searched.
    #[error(transparent)]
    Onset(#[from] OnsetError),
    /// No impact is heard.
    #[error("no impact is heard in {seconds:.2} s of sound: record nearer, or drop from higher")]
    Silent {
        /// Length of the sound, s.
        seconds: f64,
    },
    /// Impacts are heard, and none of them alone for long enough.
    #[error(
        "none of {heard} impacts is followed by {needed_s} s without another: record the whole drop, on a larger table"
    )]
    Crowded {
        /// How many were heard.
        heard: usize,
        /// How long one has to be alone, s.
        needed_s: f64,
    },
    /// Most impacts, or all that are alone, reach the end of the microphone's range.
    #[error("{clipped} of {heard} sounds are clipped: lower the gain")]
    Clipped {
        /// How many are.
        clipped: usize,
        /// How many were heard.
        heard: usize,
    },
    /// Sounds that are no part of one ball's chain of flights.
    #[error(
        "{left_out} of {heard} sounds are as loud as the impacts and do not fit one ball whose flights shorten steadily: drop one ball alone"
    )]
    SeveralBalls {
        /// Sounds that do not fit.
        left_out: usize,
        /// Sounds that were heard.
        heard: usize,
    },
    /// The impacts are hardly louder than the noise.
    #[error("impacts are {got_db:.0} dB above the noise, expected {least_db:.0} or more: record nearer")]
    Quiet {
        /// Least ratio, dB.
        least_db: f64,
        /// Ratio found, dB.
        got_db: f64,
    },
    /// The sample rate leaves too little of the spectrum.
    #[error("a sample rate of {got} Hz, expected {least} Hz or more")]
    Rate {
        /// Least rate, Hz.
        least: f64,
        /// Rate stated, Hz.
        got: f64,
    },
    /// A stated size is none.
    #[error("{what} is {got}, expected {expected}")]
    Value {
        /// Which one.
        what: &'static str,
        /// What is taken.
        expected: &'static str,
        /// The value stated.
        got: f64,
    },
    /// Nothing of what was observed belongs to the senses that were asked.
    #[error("nothing was observed by the senses that are asked for: {senses}")]
    Blind {
        /// The senses, in words.
        senses: String,
    },
    /// There are too few drops of a material to learn from.
    #[error("{got} drops of material {material} (counted from 0) to {purpose}, expected {least} or more")]
    TooFew {
        /// Which material.
        material: usize,
        /// What they are for.
        purpose: &'static str,
        /// How many are needed.
        least: usize,
        /// How many came.
        got: usize,
    },
    /// A label, a prior or a posterior is not one of as many materials as were learned.
    #[error("{what} for {got} materials, expected {expected}")]
    Materials {
        /// What is stated.
        what: &'static str,
        /// How many materials were learned.
        expected: usize,
        /// How many came.
        got: usize,
    },
    /// Drops that were learned from do not say what a feature is like.
    #[error(
        "feature {feature} (counted from 0) is the same in all drops, or missing in one: learn from complete, different drops"
    )]
    Flat {
        /// Which feature.
        feature: usize,
    },
}
