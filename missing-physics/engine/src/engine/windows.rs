//! What an answer says of windows, said of the runs that they are of.

use std::collections::HashMap;

use crate::data::Recording;
use crate::diagnosis::{Curves, Diagnosis, Location};
use crate::model::WindowedModel;

/// The run that a window is of, and how many of its rows come before the window.
struct Place<'a> {
    whole: &'a str,
    before: usize,
}

/// Puts the labels of whole runs in the place of their windows', and joins the curves; single windows that contradict the rest keep their
/// labels.
pub(super) fn join(diagnosis: &mut Diagnosis, recording: &Recording, model: &dyn WindowedModel) {
    let mut rows: HashMap<&str, usize> = HashMap::new();
    let mut places: HashMap<&str, Place<'_>> = HashMap::new();
    for window in &recording.runs {
        let whole = model.whole(window).unwrap_or(&window.label);
        let before = rows.entry(whole).or_default();
        places.insert(&window.label, Place { whole, before: *before });
        *before += window.len();
    }
    let whole = |label: &String| places.get(label.as_str()).map_or(label.clone(), |p| p.whole.to_owned());
    let in_place = |location: &mut Location| {
        location.runs = location.runs.iter().map(whole).collect();
        location.runs.dedup();
    };
    diagnosis.location.iter_mut().chain(&mut diagnosis.leftover).for_each(in_place);
    for outlier in &mut diagnosis.outliers {
        if let Some(place) = places.get(outlier.run.as_str()) {
            outlier.row += place.before;
            outlier.run = place.whole.to_owned();
        }
    }
    if let Some(contradiction) = &mut diagnosis.contradiction {
        let windows = |of: &String| recording.runs.iter().filter(|w| whole(&w.label) == *of).count();
        let among = |of: &String| contradiction.runs.iter().filter(|label| whole(label) == *of).count();
        let said = contradiction.runs.iter().map(|label| {
            let of = whole(label);
            if among(&of) == windows(&of) { of } else { label.clone() }
        });
        let mut said: Vec<String> = said.collect();
        said.dedup();
        contradiction.runs = said;
    }
    let mut joined: Vec<Curves> = Vec::new();
    for window in std::mem::take(&mut diagnosis.curves) {
        let run = whole(&window.run);
        match joined.last_mut().filter(|before| before.run == run) {
            Some(before) => append(before, window),
            None => joined.push(Curves { run, ..window }),
        }
    }
    diagnosis.curves = joined;
}

/// Appends the rows of a run's next window.
fn append(run: &mut Curves, window: Curves) {
    let Curves { inputs, measured, before, after, .. } = run;
    let parts = [
        (inputs, window.inputs),
        (measured, window.measured),
        (before, window.before),
        (after, window.after),
    ];
    for (columns, more) in parts {
        columns.iter_mut().zip(more).for_each(|(column, rows)| column.extend(rows));
    }
}
