//! The time between a recording's rows, and how late anything in it may be.

use missing_physics::data::Run;

/// A delay or a lag is at most so many rows, and this part of the longest run.
const LONGEST_ROWS: f64 = 100.0;
const LONGEST_PART: f64 = 0.2;

/// The times of a recording whose first input is the time, s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clock {
    /// Median time between two rows, s; 0 where no run has two.
    pub(crate) step_s: f64,
    /// The longest run, s.
    pub(crate) duration_s: f64,
}

impl Clock {
    pub(crate) fn of(runs: &[Run]) -> Self {
        let mut steps: Vec<f64> =
            runs.iter().flat_map(|run| run.inputs[0].windows(2).map(|w| w[1] - w[0])).collect();
        steps.sort_by(f64::total_cmp);
        let spans = runs.iter().map(|run| run.inputs[0].last().unwrap_or(&0.0) - run.inputs[0][0]);
        Self {
            step_s: steps.get(steps.len() / 2).copied().unwrap_or(0.0),
            duration_s: spans.fold(0.0, f64::max),
        }
    }

    /// The longest delay or lag, s.
    pub(crate) fn longest_s(&self) -> f64 {
        (LONGEST_PART * self.duration_s).min(LONGEST_ROWS * self.step_s)
    }
}
