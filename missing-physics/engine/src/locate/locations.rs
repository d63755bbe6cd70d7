//! Where the baseline misses: for each channel the interval of a variable without which the baseline would hold.

use crate::diagnosis::Location;
use crate::fit::columns::whitened_columns;
use crate::fit::optimum::Fit;
use crate::locate::bins::{bin, value, variable_name, variables};
use crate::locate::departure::{self, Departure, Left};
use crate::locate::scan::{Interval, Scan};
use crate::model::PredictError;
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};

/// A later variable has to hold so much more of the misfit than an earlier one.
const EARLIER: f64 = 1.2;

/// Finds the places where the baseline misses, largest share first.
pub(crate) fn locate(
    problem: &Problem<'_>,
    selection: &Selection,
    baseline: &Fit,
    sigma: &[f64],
) -> Result<Vec<Location>, PredictError> {
    let noise = NoiseState { shape: vec![0; sigma.len()], sigma: sigma.to_vec() };
    let columns: Vec<Vec<Vec<f64>>> = (0..problem.rows.len())
        .map(|r| whitened_columns(problem, selection, &noise, r, &baseline.shared, &baseline.nuisance[r]))
        .collect::<Result<_, _>>()?;
    let sizes = (selection.nuisance.len(), selection.shared.len());
    let mut found: Vec<(f64, Location)> = Vec::new();
    let mut worth = 0.0;
    for channel in 0..problem.channels() {
        let best = best_interval(problem, &columns, sizes, channel);
        if let Some((scan, Interval { gain, bins, worth: here })) = best.filter(|(_, b)| b.gain > 0.0) {
            let (Scan { variable, edges, .. }, (_, coefficients)) = (&scan, scan.outside(bins));
            let scanned = Scanned { variable: *variable, edges, bins, coefficients: &coefficients };
            found.push((gain, place(problem, &columns, sigma, channel, &scanned, gain)));
            worth += here;
        }
    }
    let left = Left { columns: &columns, sizes, shared: &baseline.shared, sigma };
    // One departure of the law is more natural than one of each channel by itself.
    if let Some(departure) = departure::best(problem, &left, EARLIER)?
        && worth <= EARLIER * departure.worth
    {
        let Departure { variable, edges, bins, gains, baseline, .. } = departure;
        let scanned = Scanned { variable, edges: &edges, bins, coefficients: &baseline };
        let gaining = gains.into_iter().enumerate().filter(|(_, gain)| *gain > 0.0);
        found = gaining.map(|(c, gain)| (gain, place(problem, &columns, sigma, c, &scanned, gain))).collect();
    }
    Ok(leading(found))
}

/// The interval of a channel that is worth most, over all variables.
fn best_interval(
    problem: &Problem<'_>,
    columns: &[Vec<Vec<f64>>],
    sizes: (usize, usize),
    channel: usize,
) -> Option<(Scan, Interval)> {
    let mut best: Option<(Scan, Interval)> = None;
    for variable in variables(problem) {
        let Some(scan) = Scan::new(problem, columns, sizes, channel, variable) else { continue };
        // An earlier variable is the more natural one to name.
        if let Some(here) = scan.best()
            && best.as_ref().is_none_or(|(_, b)| here.worth > EARLIER * b.worth + 1e-9)
        {
            best = Some((scan, here));
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

/// Bins along a variable, and the coefficients of each run's columns at which the baseline is right outside.
struct Scanned<'a> {
    variable: Option<usize>,
    edges: &'a [f64],
    bins: (usize, usize),
    coefficients: &'a [Vec<f64>],
}

/// An interval as a place: what the fitted baseline misses in its rows. The runs in which it shows are those whose rows there miss a
/// baseline that is fitted to the others.
fn place(
    problem: &Problem<'_>,
    columns: &[Vec<Vec<f64>>],
    sigma: &[f64],
    channel: usize,
    scanned: &Scanned<'_>,
    gain: f64,
) -> Location {
    let &Scanned { variable, edges, bins: (from, to), coefficients } = scanned;
    let (mut residuals, mut fitted_out): (Vec<f64>, Vec<(usize, f64)>) = (Vec::new(), Vec::new());
    for (r, x) in coefficients.iter().enumerate() {
        let start: usize = (0..channel).map(|c| problem.rows[r].valid[c].len()).sum();
        for (k, &i) in problem.rows[r].valid[channel].iter().enumerate() {
            let b = bin(value(problem, variable, r, i), edges);
            if b >= from && b < to {
                let fitted: f64 = x.iter().zip(&columns[r]).map(|(x, c)| x * c[start + k]).sum();
                let measured = columns[r].last().map_or(0.0, |c| c[start + k]);
                residuals.push(measured * sigma[channel]);
                fitted_out.push((r, measured - fitted));
            }
        }
    }
    let squares = |r: usize| -> (f64, f64) {
        let of_run = fitted_out.iter().filter(|(run, _)| r == *run);
        of_run.fold((0.0, 0.0), |(s, n), (_, v)| (s + v * v, n + 1.0))
    };
    // A run shows the misfit where its rows exceed the noise at 1 in 1,000.
    let runs = (0..problem.rows.len())
        .filter(|&r| {
            let (sum, n) = squares(r);
            n > 0.0 && sum > n + 3.1 * (2.0 * n).sqrt() + 3.0
        })
        .map(|r| problem.recording.runs[r].label.clone())
        .collect();
    let mean = residuals.iter().sum::<f64>() / residuals.len().max(1) as f64;
    let largest = residuals.iter().copied().fold(0.0, |a: f64, v| if v.abs() > a.abs() { v } else { a });
    Location {
        channel: problem.recording.channels[channel].name.clone(),
        variable: Some(variable_name(problem, variable)),
        from: edges.get(from).copied(),
        to: edges.get(to).copied(),
        runs,
        share: 0.0,
        mean_residual: mean,
        rms: (residuals.iter().map(|v| v * v).sum::<f64>() / residuals.len().max(1) as f64).sqrt(),
        largest_residual: largest,
        sigma: sigma[channel],
        z: gain.sqrt(),
    }
}
