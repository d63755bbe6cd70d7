//! Wild readings: set aside before anything is judged, and listed.

use crate::adequacy::linearised::{JUMP, Linearised, longest_lapse};
use crate::data::Recording;
use crate::fit::alternate::fit;
use crate::fit::prediction::residuals;
use crate::model::PredictError;
use crate::noise::rule::noise_rule;
use crate::problem::Problem;

/// A row further than this many robust sigmas from what all other rows say of it is wild.
const ROW_LIMIT: f64 = 5.5;
/// Rows are set aside in rounds, the wildest first: they hide one another.
const ROUNDS: usize = 5;
/// As many wild rows one after the other are no accident, unless they are a lapse of the sensor.
const NEIGHBOURS: usize = 3;

/// Run, channel, row.
pub(crate) type Place = (usize, usize, usize);

/// A reading that was set aside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Aside {
    pub(crate) place: Place,
    pub(crate) reading: f64,
    /// Robust sigmas from what all other rows say of it.
    pub(crate) z: f64,
}

/// The recording without its wild rows (NaN in their place) but for those to be kept, and the wild readings, by run, channel and row.
///
/// # Errors
/// [`PredictError`] where the simulation has no answer.
pub(crate) fn set_aside(
    problem: &Problem<'_>,
    kept: &[Place],
) -> Result<(Recording, Vec<Aside>), PredictError> {
    let recording = &problem.recording;
    let (mut cleaned, mut aside) = (recording.clone(), Vec::new());
    for _ in 0..ROUNDS {
        let found = wild_rows(&problem.with(cleaned.clone()), kept)?;
        if found.is_empty() {
            break;
        }
        for Aside { place: (run, channel, row), .. } in &found {
            cleaned.runs[*run].outputs[*channel][*row] = f64::NAN;
        }
        aside.extend(found);
    }
    aside.sort_by_key(|wild| wild.place);
    let series = put_back_series(recording, &cleaned, &aside);
    for &Aside { place: (run, channel, row), reading, .. } in &series {
        cleaned.runs[run].outputs[channel][row] = reading;
    }
    aside.retain(|wild| !series.contains(wild));
    Ok((cleaned, aside))
}

/// The wildest rows given all others, few at a time, but for those to be kept.
fn wild_rows(problem: &Problem<'_>, kept: &[Place]) -> Result<Vec<Aside>, PredictError> {
    let rule = noise_rule(problem);
    let selection = problem.select(&[], &[]);
    let start = fit(problem, &selection, &rule, (&problem.shared.start, &problem.nuisance_start), None)?;
    let everything = problem.spec().asked();
    let linearised = Linearised::new(problem, &selection, &start, &everything, &rule)?;
    let mut scores = linearised.row_scores(&residuals(problem, &start)?);
    for &(run, channel, row) in kept {
        if let Ok(k) = problem.rows[run].valid[channel].binary_search(&row) {
            scores[run][channel][k] = 0.0;
        }
    }
    let mut found = Vec::new();
    for channel in 0..problem.channels() {
        let all: usize = problem.count(channel);
        let wildest = scores.iter().flat_map(|run| &run[channel]).fold(0.0, |most: f64, z| most.max(z.abs()));
        let limit = ROW_LIMIT.max(0.5 * wildest);
        let mut here = Vec::new();
        for (run, of_run) in scores.iter().enumerate() {
            let z = &of_run[channel];
            for (k, value) in z.iter().enumerate() {
                let around = &z[k.saturating_sub(1)..(k + 2).min(z.len())];
                if value.abs() > limit && around.iter().all(|other| other.abs() <= value.abs()) {
                    let row = problem.rows[run].valid[channel][k];
                    let reading = problem.recording.runs[run].outputs[channel][row];
                    here.push(Aside { place: (run, channel, row), reading, z: *value });
                }
            }
        }
        if here.len() * 20 <= all {
            found.append(&mut here);
        }
    }
    Ok(found)
}

/// Whether a series of wild rows is a lapse of the sensor: short, far away, and within its run.
fn is_lapse(recording: &Recording, series: &[Aside]) -> bool {
    let (Some(first), Some(last)) = (series.first(), series.last()) else { return false };
    let rows = recording.runs[first.place.0].len();
    let far = series.iter().all(|wild| wild.z.abs() > JUMP);
    far && series.len() <= longest_lapse(rows) && first.place.2 > 0 && last.place.2 + 1 < rows
}

/// Rows that stand in a series: what lasts is an effect, not an accident.
fn put_back_series(recording: &Recording, cleaned: &Recording, aside: &[Aside]) -> Vec<Aside> {
    let mut series = Vec::new();
    let mut current: Vec<Aside> = Vec::new();
    let close = |current: &mut Vec<Aside>, series: &mut Vec<Aside>| {
        if current.len() >= NEIGHBOURS && !is_lapse(recording, current) {
            series.append(current);
        }
        current.clear();
    };
    for &wild in aside {
        let (run, channel, row) = wild.place;
        let follows = current.last().is_some_and(|last| {
            let between = last.place.2 + 1..row;
            last.place.0 == run
                && last.place.1 == channel
                && between.into_iter().all(|i| !recording.runs[run].outputs[channel][i].is_finite())
        });
        if !follows {
            close(&mut current, &mut series);
        }
        current.push(wild);
    }
    close(&mut current, &mut series);
    // A run that lost more than a tenth of its rows did not lose them by accident either.
    for (run, data) in recording.runs.iter().enumerate() {
        for channel in 0..recording.channels.len() {
            let count = |r: &Recording| r.runs[run].outputs[channel].iter().filter(|v| v.is_finite()).count();
            let (before, lost) = (count(recording), count(recording) - count(cleaned));
            if lost > 2 && lost * 10 > before && !data.is_empty() {
                let mine = aside.iter().filter(|o| o.place.0 == run && o.place.1 == channel);
                series.extend(mine.filter(|o| !series.contains(o)).copied().collect::<Vec<_>>());
            }
        }
    }
    series
}
