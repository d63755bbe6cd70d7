//! Progress and cancellation.

/// A step of the work, as told to an [`Observer`].
#[derive(Debug, Clone, PartialEq)]
pub struct Progress<'a> {
    /// What is being done, for a person (`adequacy of the baseline`).
    pub stage: &'a str,
    /// How much of the stage is done, in [0, 1].
    pub done: f64,
}

/// Watches a piece of work and may stop it. One call at a time, between pieces of work; from one thread in a diagnosis, from any of
/// the pool's where many recordings are diagnosed at once.
pub trait Observer: Sync {
    /// Takes note of the progress; `false` stops the work.
    fn progress(&self, progress: Progress<'_>) -> bool;
}

/// Watches nothing and never stops.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Observer for Silent {
    fn progress(&self, _: Progress<'_>) -> bool {
        true
    }
}
