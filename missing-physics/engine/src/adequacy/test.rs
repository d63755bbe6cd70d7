//! Is a model adequate? Several tests with one p-value, calibrated by a parametric bootstrap of the whole fit.

use rayon::prelude::*;

use crate::adequacy::linearised::{Linearised, Reading};
use crate::adequacy::null::draw;
use crate::adequacy::omnibus::{Law, Omnibus};
use crate::adequacy::tail::Null;
use crate::diagnosis::TestOutcome;
use crate::fit::optimum::Fit;
use crate::fit::prediction::residuals;
use crate::model::PredictError;
use crate::noise::rule::NoiseRule;
use crate::problem::{Problem, Selection};

/// What the tests say of a model.
#[derive(Debug, Clone)]
pub(crate) struct Adequacy {
    pub(crate) p_value: f64,
    pub(crate) p_floor: f64,
    pub(crate) tests: Vec<TestOutcome>,
}

/// Worlds in which is seen which shapes of noise are chosen at all.
const PILOTS: u64 = 12;
/// Worlds that are read together: as many as stay near the processor beside the columns that they are multiplied with.
const READ_TOGETHER: usize = 8;
/// A test that looks for nothing in particular must be this much surer than one that looks for a listed mechanism ...
const UNDIRECTED_WEIGHT: f64 = 3.0;
/// ... and one that looks for it in one run, one stretch or at one frequency only, so much.
const NARROW_WEIGHT: f64 = 10.0;

/// The least p value that so many replicates can show.
pub(crate) fn p_floor(replicates: usize) -> f64 {
    1.0 / (replicates as f64 + 1.0)
}

/// Tests a fitted model against the mechanisms `rivals`, smooth functions of every variable, serial correlation, shifts of
/// runs and of intervals, and the calibrated noise.
pub(crate) fn test(
    problem: &Problem<'_>,
    selection: &Selection,
    fit: &Fit,
    rivals: &[usize],
    rule: &NoiseRule,
    replicates: usize,
    seed: u64,
) -> Result<Adequacy, PredictError> {
    let observed = residuals(problem, fit)?;
    let floor = p_floor(replicates);
    if to_the_last_digit(problem, &observed) {
        return Ok(Adequacy { p_value: 1.0, p_floor: floor, tests: Vec::new() });
    }
    let mut linearised = Linearised::new(problem, selection, fit, rivals, rule)?;
    let truth = linearised.sharpen(&observed);
    let chosen = chosen_shapes(&linearised, &observed, |k| draw(problem, &truth, rule, seed ^ 0x5eed, k));
    linearised.play(&sorted(chosen.into_iter().chain(truth.iter().map(|&(shape, _)| shape)).chain([0])));

    let omnibus = Omnibus::new(problem, rule);
    let statistics = |(reading, data): (Reading, &[Vec<Vec<f64>>])| -> Vec<f64> {
        let left = linearised.residual(data, &reading);
        let undirected = omnibus.statistics(&linearised, &reading, &left);
        reading.gains.into_iter().chain(undirected).collect()
    };
    let seen = statistics((linearised.read(&observed), &observed));
    let null: Vec<Vec<f64>> = (0..replicates)
        .into_par_iter()
        .chunks(READ_TOGETHER)
        .flat_map_iter(|some| {
            let drawn = some.into_iter().map(|k| draw(problem, &truth, rule, seed, k as u64));
            let worlds: Vec<Vec<Vec<Vec<f64>>>> = drawn.collect();
            let worlds: Vec<&[Vec<Vec<f64>>]> = worlds.iter().map(Vec::as_slice).collect();
            let read = linearised.read_each(&worlds).into_iter().zip(worlds);
            read.map(statistics).collect::<Vec<_>>()
        })
        .collect();
    let undirected = omnibus.tests();
    let first = seen.len() - undirected.len();
    let nulls: Vec<Null> = (0..seen.len())
        .map(|t| {
            let law = t.checked_sub(first).map_or(Law::Sum, |omnibus| undirected[omnibus].law);
            Null::new(law, null.iter().map(|row| row[t]).collect())
        })
        .collect();
    let directed = linearised.mechanisms;
    let weight = |t: usize| match t.checked_sub(first) {
        Some(omnibus) if undirected[omnibus].narrow => NARROW_WEIGHT,
        _ if t < directed => 1.0,
        _ => UNDIRECTED_WEIGHT,
    };
    let smallest =
        |p: &dyn Fn(usize) -> f64| (0..seen.len()).map(|t| weight(t) * p(t)).fold(f64::INFINITY, f64::min);
    let observed_smallest = smallest(&|t| nulls[t].p(seen[t]));
    let as_small = |k: &usize| smallest(&|t| nulls[t].p_of_draw(*k)) <= observed_smallest;
    let below = (0..null.len()).filter(as_small).count();
    let names = linearised.alternatives.iter().map(|a| a.name.clone());
    let names = names.chain(undirected.iter().map(|test| test.name.clone()));
    let mut tests: Vec<TestOutcome> = names
        .zip(seen.iter().zip(&nulls))
        .map(|(name, (&statistic, null))| TestOutcome { name, statistic, p_value: null.p(statistic) })
        .collect();
    tests.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    Ok(Adequacy { p_value: (below as f64 + 1.0) * floor, p_floor: floor, tests })
}

/// Whether data are what the model predicts to within half of the last digit that they are printed with, or to within rounding: no test
/// has anything to look at then.
fn to_the_last_digit(problem: &Problem<'_>, observed: &[Vec<Vec<f64>>]) -> bool {
    /// Rounding, relative to the largest reading.
    const ROUNDING: f64 = 1e-9;
    /// How near to a whole number of digits a reading is.
    const WHOLE: f64 = 1e-3;
    (0..problem.channels()).all(|c| {
        let columns = problem.recording.runs.iter().flat_map(|run| &run.outputs[c]);
        let readings: Vec<f64> = columns.copied().filter(|v| v.is_finite()).collect();
        let largest = readings.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let digit = problem.recording.resolution.get(c).copied().unwrap_or(0.0);
        let printed =
            |v: &f64| ((v - readings[0]) / digit - ((v - readings[0]) / digit).round()).abs() < WHOLE;
        let digit = if digit > 0.0 && readings.iter().all(printed) { digit } else { 0.0 };
        let least = 0.5 * digit + ROUNDING * largest;
        observed.iter().flat_map(|run| &run[c]).all(|v| v.abs() <= least)
    })
}

/// Shapes of noise that pilot worlds choose, and these data: the others need not be tried again for each world.
fn chosen_shapes(
    linearised: &Linearised<'_>,
    observed: &[Vec<Vec<f64>>],
    world: impl Fn(u64) -> Vec<Vec<Vec<f64>>> + Sync,
) -> Vec<usize> {
    let mut noises: Vec<Vec<(usize, f64)>> =
        (0..PILOTS).into_par_iter().map(|k| linearised.noise(&world(k))).collect();
    noises.push(linearised.noise(observed));
    let in_play = linearised.in_play();
    noises.iter().flatten().map(|&(shape, _)| in_play[shape]).collect()
}

/// Numbers in order, each once.
fn sorted(numbers: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut numbers: Vec<usize> = numbers.collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}
