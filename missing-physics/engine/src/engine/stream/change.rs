//! What may change, and by which columns it would show.

use super::evidence::Direction;
use crate::problem::{Problem, Selection};

/// Order of the smooth curves over a run's rows that are looked for in each channel, where no mechanism says what changed.
pub(super) const CURVES: usize = 6;

/// What may have changed.
#[derive(Debug, Clone, PartialEq)]
pub enum What {
    /// A parameter of the baseline has another value.
    Parameter {
        /// Its name.
        name: String,
        /// Its unit.
        unit: String,
        /// Its value in the reference.
        before: f64,
    },
    /// A mechanism is on.
    Mechanism {
        /// Its identifier.
        id: String,
        /// Its name for a person.
        name: String,
    },
    /// A channel follows another smooth curve over a run's rows.
    Curve {
        /// The channel.
        channel: String,
    },
}

/// The names and columns of what may change.
pub(super) fn directions(problem: &Problem<'_>, wide: &Selection, shared: &[f64]) -> Vec<(What, Direction)> {
    let spec = problem.spec();
    let place = |slot: usize| wide.shared.iter().position(|s| *s == slot);
    let baseline = problem.select(&[], &[]);
    let mut all = Vec::new();
    for &slot in &baseline.shared {
        let info = &spec.parameters[problem.shared.index[slot]];
        let (name, unit) = (info.name.clone(), info.unit.clone());
        if let Some(column) = place(slot) {
            let what = What::Parameter { name, unit, before: shared[slot] };
            all.push((what, Direction { columns: vec![column] }));
        }
    }
    for (m, mechanism) in spec.mechanisms.iter().enumerate() {
        let with = problem.select(&[m], &[]);
        // What each run has of its own says nothing of a change.
        if with.added_nuisance.contains(&true) {
            continue;
        }
        let columns: Vec<usize> = with.added().filter_map(place).collect();
        let what = What::Mechanism { id: mechanism.id.clone(), name: mechanism.name.clone() };
        all.push((what, Direction { columns }));
    }
    for (c, channel) in problem.recording.channels.iter().enumerate() {
        let first = wide.shared.len() + c * CURVES;
        let what = What::Curve { channel: channel.name.clone() };
        all.push((what, Direction { columns: (first..first + CURVES).collect() }));
    }
    all
}
