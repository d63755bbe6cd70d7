//! Which impacts of a drop are rows of its run.

use std::ops::Range;

use super::drop::Drop;

/// The impacts of a drop that are rows of its run.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    /// All impacts that are rows.
    pub(super) heard: Range<usize>,
    /// Impacts of which more is known than when each microphone heard them.
    known: Range<usize>,
}

impl Rows {
    /// The rows of a drop whose microphones make `spare` arrivals more than place and time need: of the first and the last impact it may
    /// be known only when each microphone heard them.
    pub(super) fn of(drop: &Drop, spare: usize) -> Self {
        let known = drop.first()..drop.first() + drop.impacts();
        let all = drop.arrivals_s.len() == drop.times_s.len() && spare > 0;
        Self { heard: if all { 0..drop.times_s.len() } else { known.clone() }, known }
    }

    /// The number among the known ones of a row's impact; none where no more is known of it.
    pub(super) fn known(&self, row: usize) -> Option<usize> {
        let impact = self.heard.start + row;
        self.known.contains(&impact).then(|| impact - self.known.start)
    }
}
