//! Variables along which a cause may act in an interval, and bins along them.

use crate::fit::optimum::Fit;
use crate::model::{LocalCauses, PredictError, Quantity};
use crate::problem::Problem;

/// Intervals have their ends at these quantiles of a variable.
const BINS: usize = 24;
/// So many values between the neighbours of an edge may be that edge.
const FINER: usize = 12;

/// A variable, and its value at each row of each run.
pub(crate) struct Along {
    pub(crate) quantity: Quantity,
    pub(crate) values: Vec<Vec<f64>>,
    /// What the baseline expects there, where a channel is the variable; the values else. The size of a cause goes along this: what was measured is
    /// the baseline and the residual, so that beside a baseline that can be scaled a part of it would leave nothing.
    pub(crate) expected: Vec<Vec<f64>>,
    /// Standard error of the values; zero where they are exact.
    pub(crate) error: f64,
}

impl Along {
    /// Whether it counts rows, as the number of an impact does.
    pub(crate) fn counts(&self) -> bool {
        self.quantity.unit.is_empty() && self.values.iter().flatten().all(|value| value.fract() == 0.0)
    }

    /// Values that are known to a standard error; what is expected is set by [`Self::expect`].
    fn new(quantity: Quantity, values: Vec<Vec<f64>>, error: f64) -> Self {
        Self { quantity, expected: values.clone(), values, error }
    }

    /// Takes the baseline's residuals, by run, channel after channel, in sigmas, off what is a channel: whatever has its readings to the bit
    /// (see [`LocalCauses::state`]).
    fn expect(&mut self, problem: &Problem<'_>, left: &[&[f64]], sigma: &[f64]) {
        let is_channel = |channel: &usize| {
            let mut runs = problem.rows.iter().zip(&problem.recording.runs).zip(&self.values);
            runs.all(|((rows, run), values)| {
                rows.valid[*channel]
                    .iter()
                    .all(|&i| values[i].to_bits() == run.outputs[*channel][i].to_bits())
            })
        };
        let Some(channel) = (0..problem.channels()).find(is_channel) else { return };
        for ((rows, expected), left) in problem.rows.iter().zip(&mut self.expected).zip(left) {
            let before: usize = rows.valid[..channel].iter().map(Vec::len).sum();
            let of_channel = rows.valid[channel].iter().zip(&left[before..]);
            of_channel.for_each(|(&i, left)| expected[i] -= left * sigma[channel]);
        }
    }
}

/// The variables along which an interval may lie: the inputs, in the order of the recording (the number of the row where there are none),
/// and what the model follows beside them. `left` is what the baseline leaves, by run, channel after channel, in sigmas.
pub(crate) fn variables(
    problem: &Problem<'_>,
    fit: &Fit,
    left: &[&[f64]],
    sigma: &[f64],
) -> Result<Vec<Along>, PredictError> {
    let recording = &problem.recording;
    let causes = problem.model.extensions().local_causes;
    let errors = causes.map(LocalCauses::variable_errors).unwrap_or_default();
    let input = |(v, quantity): (usize, &Quantity)| {
        let values = recording.runs.iter().map(|run| run.inputs[v].clone()).collect();
        Along::new(quantity.clone(), values, errors.get(v).copied().unwrap_or(0.0))
    };
    let mut all: Vec<Along> = recording.variables.iter().enumerate().map(input).collect();
    if all.is_empty() {
        let rows = recording.runs.iter().map(|run| (0..run.len()).map(|row| row as f64).collect());
        all.push(Along::new(Quantity::new("row", ""), rows.collect(), 0.0));
    }
    let Some(causes) = causes else { return Ok(all) };
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
    all.extend(followed.map(|(quantity, values)| Along::new(quantity, values, 0.0)));
    all.iter_mut().for_each(|along| along.expect(problem, left, sigma));
    Ok(all)
}

/// The values of a variable in the rows in which one of some channels was measured, rising.
fn measured(problem: &Problem<'_>, channels: std::ops::Range<usize>, along: &Along) -> Vec<f64> {
    let of_run = |(rows, values): (&crate::problem::RunRows, &Vec<f64>)| -> Vec<f64> {
        channels.clone().flat_map(|c| rows.valid[c].iter().map(|&i| values[i])).collect()
    };
    let mut values: Vec<f64> = problem.rows.iter().zip(&along.values).flat_map(of_run).collect();
    values.sort_by(f64::total_cmp);
    values
}

/// So many of rising values, with about as many between each two; fewer where some are equal.
fn quantiles(values: &[f64], count: usize) -> Vec<f64> {
    let mut some: Vec<f64> = (0..count).map(|k| values[k * values.len() / count]).collect();
    some.dedup();
    some
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
        let values = measured(problem, channels, along);
        let mut single = values.clone();
        single.dedup();
        let starts: Vec<f64> = if single.len() <= BINS { single } else { quantiles(&values, BINS) };
        (starts.len() > 1).then(|| Self::beginning_at(&starts, &values))
    }

    /// The same rows with more edges, where those of an interval may be: between the neighbours of each of its edges.
    pub(crate) fn finer(&self, problem: &Problem<'_>, along: &Along, (from, to): (usize, usize)) -> Self {
        let values = measured(problem, 0..problem.channels(), along);
        let mut starts = vec![values[0]];
        for edge in [from, to] {
            let low = edge.checked_sub(1).map_or(f64::NEG_INFINITY, |before| self.spans[before][0]);
            let high = self.spans.get(edge + 1).map_or(f64::INFINITY, |after| after[0]);
            let mut near: Vec<f64> = values.iter().copied().filter(|v| *v >= low && *v <= high).collect();
            near.dedup();
            starts.extend(if near.len() <= FINER { near } else { quantiles(&near, FINER) });
            starts.extend(self.spans.get(edge).map(|span| span[0]));
        }
        starts.sort_by(f64::total_cmp);
        starts.dedup();
        Self::beginning_at(&starts, &values)
    }

    /// The edges among those of [`Self::finer`] that lie between the neighbours of one of these.
    pub(crate) fn near(&self, edge: usize, finer: &Self) -> std::ops::RangeInclusive<usize> {
        let begin = |at: usize| self.spans.get(at).map_or(finer.len(), |span| finer.of(span[0]));
        begin(edge.saturating_sub(1))..=begin(edge + 1)
    }

    /// Bins that begin at rising values, the first one at the least; of rising values.
    fn beginning_at(starts: &[f64], values: &[f64]) -> Self {
        let mut bins = Self { inner: starts[1..].to_vec(), spans: Vec::new() };
        bins.spans = vec![[f64::INFINITY, f64::NEG_INFINITY]; starts.len()];
        for &x in values {
            let span = &mut bins.spans[bins.inner.partition_point(|start| *start <= x)];
            *span = [span[0].min(x), span[1].max(x)];
        }
        bins
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
