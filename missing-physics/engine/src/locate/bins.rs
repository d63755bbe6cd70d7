//! Variables along which a cause may act in an interval, and bins along them.

use crate::fit::optimum::Fit;
use crate::model::{PredictError, Quantity};
use crate::problem::Problem;

/// Intervals have their ends at these quantiles of a variable.
const BINS: usize = 24;

/// A variable, and its value at each row of each run.
pub(crate) struct Along {
    pub(crate) quantity: Quantity,
    pub(crate) values: Vec<Vec<f64>>,
}

/// The variables along which an interval may lie: the inputs, in the order of the recording (the number of the row where there are none),
/// and what the model follows beside them.
pub(crate) fn variables(problem: &Problem<'_>, fit: &Fit) -> Result<Vec<Along>, PredictError> {
    let recording = &problem.recording;
    let input = |(v, quantity): (usize, &Quantity)| Along {
        quantity: quantity.clone(),
        values: recording.runs.iter().map(|run| run.inputs[v].clone()).collect(),
    };
    let mut all: Vec<Along> = recording.variables.iter().enumerate().map(input).collect();
    if all.is_empty() {
        let rows = recording.runs.iter().map(|run| (0..run.len()).map(|row| row as f64).collect());
        all.push(Along { quantity: Quantity::new("row", ""), values: rows.collect() });
    }
    let Some(causes) = problem.model.extensions().local_causes else { return Ok(all) };
    let states = causes.states();
    let mut values = vec![Vec::new(); states.len()];
    for (run, nuisance) in recording.runs.iter().zip(&fit.nuisance) {
        let of_run = causes.state(run, &fit.shared, nuisance)?;
        values.iter_mut().zip(of_run).for_each(|(all, run)| all.push(run));
    }
    let whole = |values: &Vec<Vec<f64>>| {
        let mut rows = values.iter().zip(&recording.runs);
        values.len() == recording.runs.len()
            && rows.all(|(v, run)| v.len() == run.len() && v.iter().all(|x| x.is_finite()))
    };
    let followed = states.into_iter().zip(values).filter(|(_, values)| whole(values));
    all.extend(followed.map(|(quantity, values)| Along { quantity, values }));
    Ok(all)
}

/// Bins with about as many measured rows each, one for each value where there are few.
#[derive(Debug, Clone)]
pub(crate) struct Bins {
    /// Where one bin ends and the next begins.
    inner: Vec<f64>,
    /// The least and the largest value in each.
    pub(crate) spans: Vec<[f64; 2]>,
}

impl Bins {
    /// Of the rows in which one of some channels was measured; `None` where a variable has one value only.
    pub(crate) fn new(
        problem: &Problem<'_>,
        channels: std::ops::Range<usize>,
        along: &Along,
    ) -> Option<Self> {
        let of_run = |(rows, values): (&crate::problem::RunRows, &Vec<f64>)| -> Vec<f64> {
            let measured = channels.clone().flat_map(|c| rows.valid[c].iter());
            measured.map(|&i| values[i]).collect()
        };
        let mut values: Vec<f64> = problem.rows.iter().zip(&along.values).flat_map(of_run).collect();
        values.sort_by(f64::total_cmp);
        let mut single = values.clone();
        single.dedup();
        let starts: Vec<f64> = if single.len() <= BINS {
            single
        } else {
            let mut starts: Vec<f64> = (0..BINS).map(|k| values[k * values.len() / BINS]).collect();
            starts.dedup();
            starts
        };
        if starts.len() < 2 {
            return None;
        }
        let mut bins = Self { inner: starts[1..].to_vec(), spans: Vec::new() };
        bins.spans = vec![[f64::INFINITY, f64::NEG_INFINITY]; starts.len()];
        for x in values {
            let span = &mut bins.spans[bins.inner.partition_point(|start| *start <= x)];
            *span = [span[0].min(x), span[1].max(x)];
        }
        Some(bins)
    }

    pub(crate) fn len(&self) -> usize {
        self.spans.len()
    }

    /// The bin of a value.
    pub(crate) fn of(&self, value: f64) -> usize {
        self.inner.partition_point(|start| *start <= value)
    }

    /// A value from -1 at the least to 1 at the largest.
    pub(crate) fn along(&self, x: f64) -> f64 {
        let (low, high) = (self.spans[0][0], self.spans[self.len() - 1][1]);
        2.0 * (x - low) / (high - low) - 1.0
    }

    /// The edge at which a bin begins (the last one: at which all end), from -1 to 1.
    pub(crate) fn edge(&self, at: usize) -> f64 {
        match at.checked_sub(1).map(|k| self.inner.get(k)) {
            None => -1.0,
            Some(Some(inner)) => self.along(*inner),
            Some(None) => 1.0,
        }
    }
}
