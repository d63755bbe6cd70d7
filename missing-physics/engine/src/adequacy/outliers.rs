//! Wild readings: set aside before anything is judged, and listed.

use crate::adequacy::linearised::{JUMP, LAPSE, Linearised};
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
#[derive(Debug, Clone, PartialEq)]
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
    let (mut cleaned, mut outliers) = (recording.clone(), Vec::new());
    for _ in 0..ROUNDS {
        let found = wild_rows(&problem.with(cleaned.clone()), kept)?;
        if found.is_empty() {
            break;
        }
        for wild in found {
            cleaned.runs[wild.run].outputs[wild.channel][wild.row] = f64::NAN;
            outliers.push((wild.run, wild.channel, wild.row, wild.z));
        }
    }
    outliers.sort_by_key(|o| (o.0, o.1, o.2));
    let series = put_back_series(recording, &cleaned, &outliers);
    for &(run, channel, row, _) in &series {
        cleaned.runs[run].outputs[channel][row] = recording.runs[run].outputs[channel][row];
    }
    let listed = outliers
        .into_iter()
        .filter(|o| !series.contains(o))
        .map(|(run, channel, row, z)| Aside {
            place: (run, channel, row),
            reading: recording.runs[run].outputs[channel][row],
            z,
        })
        .collect();
    Ok((cleaned, listed))
}

/// Run, channel, row, robust sigmas.
type WildPlace = (usize, usize, usize, f64);

struct Wild {
    run: usize,
    channel: usize,
    row: usize,
    z: f64,
}

/// The wildest rows given all others, few at a time, but for those to be kept.
fn wild_rows(problem: &Problem<'_>, kept: &[Place]) -> Result<Vec<Wild>, PredictError> {
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
                    here.push(Wild { run, channel, row: problem.rows[run].valid[channel][k], z: *value });
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
fn is_lapse(recording: &Recording, series: &[WildPlace]) -> bool {
    let (Some(first), Some(last)) = (series.first(), series.last()) else { return false };
    let rows = recording.runs[first.0].len();
    let far = series.iter().all(|(.., z)| z.abs() > JUMP);
    far && series.len() * LAPSE <= rows && first.2 > 0 && last.2 + 1 < rows
}

/// Rows that stand in a series: what lasts is an effect, not an accident.
fn put_back_series(recording: &Recording, cleaned: &Recording, outliers: &[WildPlace]) -> Vec<WildPlace> {
    let mut series = Vec::new();
    let mut current: Vec<WildPlace> = Vec::new();
    let close = |current: &mut Vec<WildPlace>, series: &mut Vec<WildPlace>| {
        if current.len() >= NEIGHBOURS && !is_lapse(recording, current) {
            series.append(current);
        }
        current.clear();
    };
    for &place in outliers {
        let (run, channel, row, _) = place;
        let follows = current.last().is_some_and(|last| {
            let between = last.2 + 1..row;
            last.0 == run
                && last.1 == channel
                && between.into_iter().all(|i| !recording.runs[run].outputs[channel][i].is_finite())
        });
        if !follows {
            close(&mut current, &mut series);
        }
        current.push(place);
    }
    close(&mut current, &mut series);
    // A run that lost more than a tenth of its rows did not lose them by accident either.
    for (run, data) in recording.runs.iter().enumerate() {
        for channel in 0..recording.channels.len() {
            let count = |r: &Recording| r.runs[run].outputs[channel].iter().filter(|v| v.is_finite()).count();
            let (before, lost) = (count(recording), count(recording) - count(cleaned));
            if lost > 2 && lost * 10 > before && !data.is_empty() {
                let mine = outliers.iter().filter(|o| o.0 == run && o.1 == channel);
                series.extend(mine.filter(|o| !series.contains(o)).copied().collect::<Vec<_>>());
            }
        }
    }
    series
}
