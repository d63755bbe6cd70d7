//! Where the cause acts: one unknown more within an interval, or at single rows; and where no such thing is known, for each channel the
//! interval of a variable without which the baseline would hold.

use crate::diagnosis::{AsIf, Estimate, Location};
use crate::fit::columns::whitened_columns;
use crate::fit::optimum::Fit;
use crate::locate::bins::{Along, Bins, variables};
use crate::locate::cause::{Cause, SIMPLER, Scene};
use crate::locate::membership::Members;
use crate::locate::projection::Projection;
use crate::locate::scan::{Interval, Scan};
use crate::locate::single::{Event, Events, events};
use crate::locate::unknowns::{Unknown, unknowns};
use crate::model::{PredictError, Quantity};
use crate::noise::rough::RoughNoise;
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};

/// Standard errors in half an interval of 95 %.
const CI95: f64 = 1.96;

/// What is looked at: a baseline's columns, beside which unknowns act along variables.
struct Ground<'a> {
    /// By run: of nuisance parameters, of shared ones, and what the baseline leaves.
    columns: Vec<Vec<Vec<f64>>>,
    /// How many nuisance and shared parameters there are.
    sizes: (usize, usize),
    variables: Vec<Along>,
    projection: Projection,
    unknowns: Vec<Unknown<'a>>,
}

impl<'a> Ground<'a> {
    fn new(
        problem: &Problem<'a>,
        selection: &Selection,
        baseline: &Fit,
        sigma: &[f64],
    ) -> Result<Self, PredictError> {
        let noise = NoiseState { shape: vec![0; sigma.len()], sigma: sigma.to_vec() };
        let columns: Vec<Vec<Vec<f64>>> = (0..problem.rows.len())
            .map(|r| whitened_columns(problem, selection, &noise, r, &baseline.shared, &baseline.nuisance[r]))
            .collect::<Result<_, _>>()?;
        let sizes = (selection.nuisance.len(), selection.shared.len());
        let projection = Projection::new(&columns, sizes);
        let left: Vec<&[f64]> = columns.iter().filter_map(|run| run.last().map(Vec::as_slice)).collect();
        let variables = variables(problem, baseline, &left, sigma)?;
        let unknowns = unknowns(problem);
        Ok(Self { columns, sizes, variables, projection, unknowns })
    }

    /// The single cause that is worth most.
    fn cause(&self, problem: &Problem<'_>, fit: &Fit, sigma: &[f64]) -> Result<Option<Cause>, PredictError> {
        let Self { variables, projection, unknowns, .. } = self;
        Scene { problem, fit, sigma, projection, variables, unknowns }.best()
    }
}

/// A cause that acts in a part of the data only: by how much the sum of squares falls, and what its place and its size cost of that.
pub(crate) struct LocalCause {
    pub(crate) gain: f64,
    pub(crate) price: f64,
}

/// The single cause that is worth most, where it acts in a part of the data only and the model knows what it does.
pub(crate) fn local_cause(
    problem: &Problem<'_>,
    selection: &Selection,
    baseline: &Fit,
    sigma: &[f64],
) -> Result<Option<LocalCause>, PredictError> {
    if problem.model.extensions().local_causes.is_none() {
        return Ok(None);
    }
    let ground = Ground::new(problem, selection, baseline, sigma)?;
    let cause = ground.cause(problem, baseline, sigma)?;
    let cause = cause.filter(|cause| !cause.everywhere && ground.unknowns[cause.unknown].is_model_s());
    Ok(cause.map(|cause| LocalCause { gain: cause.gains.iter().sum(), price: cause.price }))
}

/// Finds where the cause acts beside a noise, largest share first.
pub(crate) fn locate(
    problem: &Problem<'_>,
    selection: &Selection,
    baseline: &Fit,
    noise: &RoughNoise,
) -> Result<Vec<Location>, PredictError> {
    let sigma = &noise.slow();
    let ground = Ground::new(problem, selection, baseline, sigma)?;
    let Ground { columns, sizes, variables, projection, unknowns } = &ground;
    let of_readings: Vec<(usize, &Along, Scan, Interval)> = (0..problem.channels())
        .filter_map(|channel| {
            let (along, scan, best) = best_interval(problem, columns, *sizes, channel, variables)?;
            (best.gain > 0.0).then_some((channel, along, scan, best))
        })
        .collect();
    let worth = of_readings.iter().map(|(.., interval)| interval.worth).sum::<f64>();
    let cause = ground.cause(problem, baseline, sigma)?;
    let cause = cause.filter(|cause| worth <= SIMPLER * cause.worth);
    let events = events(problem, baseline, sigma, projection, unknowns)?;
    let places = Places { problem, columns, unit: sigma, noise };
    let found = match (cause, events) {
        (cause, Some(events))
            if {
                // What acts at single rows only says more than an amount, so that it need not be worth quite as much.
                let only = unknowns[events.unknown].described.at_single_rows;
                let simpler = if only { SIMPLER.recip() } else { SIMPLER };
                events.worth > simpler * cause.as_ref().map_or(worth / SIMPLER, |cause| cause.worth)
            } =>
        {
            places.of_events(&unknowns[events.unknown], &variables[0], &events)
        }
        (Some(cause), _) => {
            let along = &variables[cause.along];
            let span = places.one_stretch(along, &cause);
            places.of_cause(&unknowns[cause.unknown], along, &cause, span.map(|span| (&variables[0], span)))
        }
        (None, _) => {
            let of_channel =
                |(channel, along, scan, Interval { gain, bins, .. }): &(usize, &Along, Scan, Interval)| {
                    let coefficients = scan.outside(*bins).1;
                    let within = Within { along, bins: &scan.bins, interval: *bins, members: None };
                    let runs = places.runs_that_miss(*channel, &within, &coefficients);
                    (*gain, places.of_rows(*channel, &within, &runs, *gain))
                };
            of_readings.iter().map(of_channel).collect()
        }
    };
    let found = if found.is_empty() { places.throughout(variables) } else { found };
    Ok(leading(found))
}

/// The interval of a channel that is worth most, over all variables.
fn best_interval<'a>(
    problem: &Problem<'_>,
    columns: &[Vec<Vec<f64>>],
    sizes: (usize, usize),
    channel: usize,
    variables: &'a [Along],
) -> Option<(&'a Along, Scan, Interval)> {
    let mut best: Option<(&Along, Scan, Interval)> = None;
    for along in variables {
        let Some(scan) = Scan::new(problem, columns, sizes, channel, along) else { continue };
        if let Some(here) = scan.best()
            && best.as_ref().is_none_or(|(.., b)| here.worth > b.worth + 1e-9)
        {
            best = Some((along, scan, here));
        }
    }
    best
}

/// The locations that are more than noise, by falling gain, with their shares of the whole; the first one in any case.
fn leading(mut found: Vec<(f64, Location)>) -> Vec<Location> {
    let total: f64 = found.iter().map(|(gain, _)| gain).sum();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    // With some 300 intervals a variable and a few variables, noise alone reaches a gain of about 20.
    let largest = found.first().map_or(0.0, |f| f.0);
    found
        .into_iter()
        .filter(|(gain, _)| *gain >= 25.0 || *gain == largest)
        .map(|(gain, mut location)| {
            location.share = gain / total;
            location
        })
        .collect()
}

/// An interval of bins along a variable.
struct Within<'a> {
    along: &'a Along,
    bins: &'a Bins,
    interval: (usize, usize),
    /// Its rows, where those are not all that were measured within it.
    members: Option<&'a Members>,
}

impl Within<'_> {
    fn holds(&self, run: usize, row: usize) -> bool {
        if let Some(members) = self.members {
            return members.acts[run][row];
        }
        let bin = self.bins.of(self.along.values[run][row]);
        bin >= self.interval.0 && bin < self.interval.1
    }

    /// Where it begins and ends, as far as there are rows: halfway between the last row outside and the first one inside, where the variable
    /// may have any value.
    fn edges(&self) -> [Option<f64>; 2] {
        if let Some(Members { from, to, .. }) = self.members {
            let [low, high] = [self.bins.spans[0][0], self.bins.spans[self.bins.len() - 1][1]];
            return [Some(from.max(low)), Some(to.min(high))];
        }
        let span = |at: Option<usize>| at.and_then(|at| self.bins.spans.get(at));
        let halfway = |inside: f64, outside: Option<f64>| match outside {
            Some(outside) if !self.along.counts() => 0.5 * (inside + outside),
            _ => inside,
        };
        let (from, to) = self.interval;
        let before = span(from.checked_sub(1)).map(|span| span[1]);
        let after = span(Some(to)).map(|span| span[0]);
        [
            span(Some(from)).map(|span| halfway(span[0], before)),
            span(to.checked_sub(1)).map(|span| halfway(span[1], after)),
        ]
    }
}

impl Cause {
    fn within<'a>(&'a self, along: &'a Along) -> Within<'a> {
        Within { along, bins: &self.bins, interval: self.interval, members: self.members.as_ref() }
    }
}

/// Makes places of intervals and rows.
struct Places<'a> {
    problem: &'a Problem<'a>,
    /// What the fitted baseline leaves is the last of each run's columns.
    columns: &'a [Vec<Vec<f64>>],
    /// The unit of these, by channel.
    unit: &'a [f64],
    noise: &'a RoughNoise,
}

impl Places<'_> {
    /// Rows of a channel with their numbers among all of the run's readings.
    fn rows(&self, run: usize, channel: usize) -> impl Iterator<Item = (usize, usize)> {
        let valid = &self.problem.rows[run].valid;
        let start: usize = valid[..channel].iter().map(Vec::len).sum();
        valid[channel].iter().enumerate().map(move |(k, &row)| (start + k, row))
    }

    /// The runs whose rows there miss a baseline that is fitted to the others, by each run's coefficients of its columns.
    fn runs_that_miss(&self, channel: usize, within: &Within<'_>, coefficients: &[Vec<f64>]) -> Vec<bool> {
        let misses = |(run, x): (usize, &Vec<f64>)| {
            let columns = &self.columns[run];
            let missed = |at: usize| {
                let fitted: f64 = x.iter().zip(columns).map(|(x, c)| x * c[at]).sum();
                columns.last().map_or(0.0, |c| c[at]) - fitted
            };
            let rows = self.rows(run, channel).filter(|&(_, row)| within.holds(run, row));
            let (sum, n) = rows.fold((0.0_f64, 0.0_f64), |(s, n), (at, _)| (s + missed(at).powi(2), n + 1.0));
            // A run shows the misfit where its rows exceed the noise at 1 in 1,000.
            n > 0.0 && sum > self.noise.rows(channel, n as usize) + 3.1 * self.noise.spread(channel, n) + 3.0
        };
        coefficients.iter().enumerate().map(misses).collect()
    }

    /// What the fitted baseline misses in an interval of some runs (of all, where it shows in none alone).
    fn of_rows(&self, channel: usize, within: &Within<'_>, runs: &[bool], gain: f64) -> Location {
        let none = !runs.contains(&true);
        let mut residuals: Vec<f64> = Vec::new();
        for run in (0..runs.len()).filter(|&r| runs[r] || none) {
            let rows = self.rows(run, channel).filter(|&(_, row)| within.holds(run, row));
            let left = self.columns[run].last();
            residuals.extend(rows.map(|(at, _)| left.map_or(0.0, |c| c[at]) * self.unit[channel]));
        }
        let label = |r: usize| self.problem.recording.runs[r].label.clone();
        let mean = residuals.iter().sum::<f64>() / residuals.len().max(1) as f64;
        // Of all rows that a fit with an offset was made to, rounding alone is left of it.
        let mean = if mean.abs() > 1e-9 * self.unit[channel] { mean } else { 0.0 };
        let square = residuals.iter().map(|v| v * v).sum::<f64>() / residuals.len().max(1) as f64;
        let larger = |a: f64, v: f64| if v.abs() > a.abs() { v } else { a };
        let [from, to] = within.edges();
        Location {
            channel: self.problem.recording.channels[channel].name.clone(),
            variable: Some(within.along.quantity.name.clone()),
            variable_unit: within.along.quantity.unit.clone(),
            from,
            to,
            whole_range: within.members.is_none() && within.interval == (0, within.bins.len()),
            runs: (0..runs.len()).filter(|&r| runs[r]).map(label).collect(),
            share: 0.0,
            mean_residual: mean,
            rms: square.sqrt(),
            largest_residual: residuals.into_iter().fold(0.0, larger),
            sigma: self.noise.sigma[channel],
            z: gain.max(0.0).sqrt(),
            as_if: None,
        }
    }

    /// All rows of the channel that the baseline misses most, where no interval says more.
    fn throughout(&self, variables: &[Along]) -> Vec<(f64, Location)> {
        let (problem, runs) = (self.problem, vec![false; self.problem.rows.len()]);
        let whole = |channel: usize| {
            let along = variables.first()?;
            let bins = Bins::new(problem, channel..channel + 1, along)?;
            let within = Within { along, bins: &bins, interval: (0, bins.len()), members: None };
            let mut place = self.of_rows(channel, &within, &runs, 0.0);
            place.z = place.rms / place.sigma;
            Some((place.z * place.z, place))
        };
        let most = (0..problem.channels()).filter_map(whole).max_by(|a, b| a.0.total_cmp(&b.0));
        most.into_iter().collect()
    }

    /// Where a cause acts in one of several runs, and there in neighbouring rows only: from when to when. What happens once has a time
    /// rather than a place.
    fn one_stretch(&self, along: &Along, cause: &Cause) -> Option<[f64; 2]> {
        let recording = &self.problem.recording;
        let time = recording
            .noise_along
            .filter(|k| *k == 0 && along.quantity.name != recording.variables[0].name)?;
        let within = cause.within(along);
        let acts = |run: &usize| {
            cause.runs[*run] && (0..along.values[*run].len()).any(|row| within.holds(*run, row))
        };
        let mut runs = (0..cause.runs.len()).filter(acts);
        let (run, None) = (runs.next()?, runs.next()) else { return None };
        if cause.runs.len() < 2 {
            return None;
        }
        let rows: Vec<usize> = (0..along.values[run].len()).filter(|&row| within.holds(run, row)).collect();
        let (first, last) = (*rows.first()?, *rows.last()?);
        let times = &recording.runs[run].inputs[time];
        (last - first + 1 == rows.len()).then(|| [times[first], times[last]])
    }

    /// A place for each channel that a cause makes better.
    ///
    /// `stretch` is said in place of the interval: another variable, and from where to where.
    fn of_cause(
        &self,
        unknown: &Unknown<'_>,
        along: &Along,
        cause: &Cause,
        stretch: Option<(&Along, [f64; 2])>,
    ) -> Vec<(f64, Location)> {
        let within = cause.within(along);
        let touched = |run: usize| (0..along.values[run].len()).any(|row| within.holds(run, row));
        // A run shows a cause where it comes to its place and its readings fit better with it.
        let shows = |run: usize| cause.runs[run] && touched(run) && cause.of_runs[run] > 0.0;
        let runs: Vec<bool> = (0..cause.runs.len()).map(shows).collect();
        // A size that may as well be nothing says nothing.
        let known = cause.sizes.iter().any(|(_, [size, error])| size.abs() > CI95 * error);
        let as_if = (known && unknown.is_model_s()).then(|| AsIf {
            what: unknown.described.name.clone(),
            sizes: cause.sizes.iter().map(|(c, size)| estimate(unknown, *c, *size)).collect(),
        });
        let gaining = cause.gains.iter().enumerate().filter(|(_, gain)| **gain > 0.0);
        gaining
            .map(|(channel, &gain)| {
                let mut place = self.of_rows(channel, &within, &runs, gain);
                if let Some((along, [from, to])) = stretch {
                    place.variable = Some(along.quantity.name.clone());
                    place.variable_unit = along.quantity.unit.clone();
                    (place.from, place.to, place.whole_range) = (Some(from), Some(to), false);
                }
                (gain, Location { as_if: as_if.clone(), ..place })
            })
            .collect()
    }

    /// A place for each row at which something acts, in the channel that shows it best.
    fn of_events(&self, unknown: &Unknown<'_>, along: &Along, events: &Events) -> Vec<(f64, Location)> {
        let place = |event: &Event| {
            let best = (0..event.gains.len()).max_by(|&a, &b| event.gains[a].total_cmp(&event.gains[b]))?;
            let at = along.values[event.run][event.row];
            let residual = self
                .rows(event.run, best)
                .find(|&(_, row)| row == event.row)
                .and_then(|(k, _)| Some(self.columns[event.run].last()?[k] * self.unit[best]))?;
            let gain: f64 = event.gains.iter().sum();
            let location = Location {
                channel: self.problem.recording.channels[best].name.clone(),
                variable: Some(along.quantity.name.clone()),
                variable_unit: along.quantity.unit.clone(),
                from: Some(at),
                to: Some(at),
                whole_range: false,
                runs: vec![self.problem.recording.runs[event.run].label.clone()],
                share: 0.0,
                mean_residual: residual,
                rms: residual.abs(),
                largest_residual: residual,
                sigma: self.noise.sigma[best],
                z: gain.max(0.0).sqrt(),
                as_if: Some(AsIf {
                    what: unknown.described.name.clone(),
                    sizes: vec![estimate(unknown, event.component, event.size)],
                }),
            };
            Some((gain, location))
        };
        events.rows.iter().filter_map(place).collect()
    }
}

/// A size with its interval.
fn estimate(unknown: &Unknown<'_>, component: usize, [value, error]: [f64; 2]) -> Estimate {
    let Quantity { name, unit } = unknown.described.components[component].clone();
    Estimate { name, unit, value, ci95: [value - CI95 * error, value + CI95 * error] }
}
