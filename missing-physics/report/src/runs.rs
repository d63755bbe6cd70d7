//! Which runs and channels miss most.

use missing_physics::diagnosis::{Curves, Diagnosis, Location};

/// How far a run is off, in sigmas of a reading: root mean squares over its channels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Misfit {
    /// Index among the curves.
    pub(super) run: usize,
    /// Under the baseline.
    pub(super) before: f64,
    /// Under the final model.
    pub(super) after: f64,
}

/// The runs, those that miss most first.
pub(super) fn by_misfit(d: &Diagnosis) -> Vec<Misfit> {
    let mut runs: Vec<Misfit> = (0..d.curves.len()).map(|run| misfit(d, run)).collect();
    runs.sort_by(|a, b| b.before.total_cmp(&a.before));
    runs
}

fn misfit(d: &Diagnosis, run: usize) -> Misfit {
    let curves = &d.curves[run];
    let rms = |fit: &[Vec<f64>]| {
        let (mut sum, mut count) = (0.0, 0_usize);
        for c in 0..d.channels.len() {
            let sigma = sigma(d, c).unwrap_or(1.0);
            for left in residuals(curves, fit, c).filter(|v| v.is_finite()) {
                sum += (left / sigma).powi(2);
                count += 1;
            }
        }
        (sum / count.max(1) as f64).sqrt()
    };
    Misfit { run, before: rms(&curves.before), after: rms(&curves.after) }
}

/// Measured less predicted; NaN where nothing was measured.
pub(super) fn residuals<'a>(
    curves: &'a Curves,
    fit: &'a [Vec<f64>],
    c: usize,
) -> impl Iterator<Item = f64> + 'a {
    curves.measured[c].iter().zip(&fit[c]).map(|(m, p)| m - p)
}

/// One sigma of a channel's noise, if it is known and above zero.
pub(super) fn sigma(d: &Diagnosis, c: usize) -> Option<f64> {
    sigma_of(d, &d.channels[c].0)
}

/// The same of a channel by name; beside a leftover that of the noise alone, since the channel's errors hold the leftover as well.
pub(super) fn sigma_of(d: &Diagnosis, channel: &str) -> Option<f64> {
    let left = d.leftover.iter().find(|place| place.channel == channel).map(|place| place.sigma);
    let noise = || d.noise.iter().find(|n| n.channel == channel).map(|n| n.sigma);
    left.or_else(noise).filter(|s| s.is_finite() && *s > 0.0)
}

/// The channels, those that miss first.
pub(super) fn channels(d: &Diagnosis) -> Vec<usize> {
    let mut order: Vec<usize> = (0..d.channels.len()).collect();
    let rank =
        |c: &usize| d.location.iter().position(|l| l.channel == d.channels[*c].0).unwrap_or(usize::MAX);
    order.sort_by_key(rank);
    order
}

/// Where a channel misses.
pub(super) fn place(d: &Diagnosis, c: usize) -> Option<&Location> {
    d.location.iter().find(|l| l.channel == d.channels[c].0)
}

/// The variable along which a channel is drawn: that of its place, else the first.
pub(super) fn axis(d: &Diagnosis, c: usize) -> usize {
    let named = place(d, c).and_then(|l| l.variable.as_ref());
    named.and_then(|name| d.variables.iter().position(|(n, _)| n == name)).unwrap_or(0)
}

/// The rows that miss, along the variable of their place; nothing where these are all or nearly all rows there are.
pub(super) fn interval(d: &Diagnosis, c: usize) -> Option<(f64, f64)> {
    /// An interval over more of the range than this says no more than that the channel misses.
    const NEARLY_ALL: f64 = 0.95;
    let place = place(d, c)?;
    let (from, to) = (place.from?, place.to?);
    d.variables.iter().position(|(n, _)| Some(n) == place.variable.as_ref())?;
    let column = d.curves.iter().filter_map(|run| run.inputs.get(axis(d, c))).flatten();
    let (low, high) = column
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    (to.min(high) - from.max(low) < NEARLY_ALL * (high - low)).then_some((from, to))
}

/// Whether a run is one of those in which a channel misses.
pub(super) fn located(d: &Diagnosis, c: usize, run: &str) -> bool {
    place(d, c).is_some_and(|l| l.runs.is_empty() || l.runs.iter().any(|r| r == run))
}

/// Whether most runs are too short for a curve, so that they are drawn together.
pub(super) fn together(d: &Diagnosis) -> bool {
    let mut rows: Vec<usize> = d.curves.iter().map(|run| run.measured.first().map_or(0, Vec::len)).collect();
    rows.sort_unstable();
    rows.len() > 1 && rows[rows.len() / 2] <= 2
}

/// The values of an axis in a run: of a variable, or the numbers of its rows.
pub(super) fn along(curves: &Curves, variable: usize) -> Vec<f64> {
    let rows = || (0..curves.measured.first().map_or(0, Vec::len)).map(|i| i as f64).collect();
    curves.inputs.get(variable).cloned().unwrap_or_else(rows)
}

/// Numbers of the runs in which a report shows them: the one that misses most where it misses most, then the others, those that miss
/// most first.
pub fn shown(d: &Diagnosis) -> Vec<usize> {
    let first = worst(d);
    let others = by_misfit(d).into_iter().map(|m| m.run).filter(|run| Some(*run) != first);
    first.into_iter().chain(others).collect()
}

/// The run that misses most in the channel that misses most, of those that the place names.
pub(super) fn worst(d: &Diagnosis) -> Option<usize> {
    let &c = channels(d).first()?;
    let size = |run: &Curves| {
        let mut count = 0_usize;
        let squares: f64 = residuals(run, &run.before, c)
            .filter(|v| v.is_finite())
            .map(|v| {
                count += 1;
                v * v
            })
            .sum();
        squares / count.max(1) as f64
    };
    let any = d.curves.iter().any(|run| located(d, c, &run.run));
    let named = (0..d.curves.len()).filter(|&r| !any || located(d, c, &d.curves[r].run));
    named.max_by(|&a, &b| size(&d.curves[a]).total_cmp(&size(&d.curves[b])))
}
