//! Tests that look for nothing in particular: serial correlation, shifts of runs and of intervals, the size of the residual, single
//! runs that miss.

use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::statistics::median;

/// A test that looks for nothing in particular.
pub(crate) struct OmnibusTest {
    pub(crate) name: String,
    /// Whether its statistic stays at a floor in most worlds, so that its null distribution is counted.
    pub(crate) rare: bool,
}

/// The tests, in the order of [`omnibus`].
pub(crate) fn omnibus_tests(problem: &Problem<'_>, rule: &NoiseRule) -> Vec<OmnibusTest> {
    let mut tests = Vec::new();
    for (c, channel) in problem.recording.channels.iter().enumerate() {
        let mut test = |what: &str, rare: bool| {
            tests.push(OmnibusTest { name: format!("{}: {what}", channel.name), rare });
        };
        test("neighbouring rows (8 lags)", false);
        test("neighbouring rows (24 lags)", false);
        test("shifts between runs", false);
        test("shifts of intervals of rows", false);
        test("a run that misses by far more than the others", true);
        if rule.fixed_sigma[c].is_some() {
            test("size against the known noise", false);
        }
    }
    tests
}

/// Statistics that look for nothing in particular, of a residual and the same whitened, `[run][channel]`.
pub(crate) fn omnibus(
    problem: &Problem<'_>,
    left: &[Vec<Vec<f64>>],
    white: &[Vec<Vec<f64>>],
    rule: &NoiseRule,
) -> Vec<f64> {
    let mut statistics = Vec::new();
    for c in 0..problem.channels() {
        let runs: Vec<&[f64]> = white.iter().map(|row| row[c].as_slice()).collect();
        let total: f64 = runs.iter().flat_map(|r| r.iter()).map(|v| v * v).sum();
        let rows: usize = runs.iter().map(|r| r.len()).sum();
        for lags in [8, 24] {
            statistics.push(portmanteau(&runs, total, rows, lags));
        }
        statistics.push(
            runs.iter()
                .filter(|r| !r.is_empty())
                .map(|r| r.iter().sum::<f64>().powi(2) / r.len() as f64)
                .sum(),
        );
        statistics.push(scan(&runs));
        statistics.push(odd_run(left, c));
        if rule.fixed_sigma[c].is_some() {
            statistics.push(total / rows.max(1) as f64);
        }
    }
    statistics
}

/// The largest mean square of a run over the runs' median, and no less than a floor: noise may well differ from run to run by less.
fn odd_run(left: &[Vec<Vec<f64>>], channel: usize) -> f64 {
    const FLOOR: f64 = 3.0;
    /// Shorter runs, or fewer, say nothing of how large noise is.
    const FEWEST: (usize, usize) = (4, 8);
    let long = left.iter().map(|run| &run[channel]).filter(|r| r.len() >= FEWEST.1);
    let mut means: Vec<f64> = long.map(|r| r.iter().map(|v| v * v).sum::<f64>() / r.len() as f64).collect();
    let largest = means.iter().copied().fold(0.0, f64::max);
    match median(&mut means) {
        Some(usual) if means.len() >= FEWEST.0 && usual > 0.0 => (largest / usual).max(FLOOR),
        _ => FLOOR,
    }
}

/// Ljung and Box 1978 (doi:10.1093/biomet/65.2.297), correlations pooled over runs.
fn portmanteau(runs: &[&[f64]], total: f64, rows: usize, lags: usize) -> f64 {
    let n = rows as f64;
    (1..=lags)
        .map(|lag| {
            let pairs: usize = runs.iter().map(|r| r.len().saturating_sub(lag)).sum();
            if pairs < 4 || total <= 0.0 {
                return 0.0;
            }
            let sum: f64 =
                runs.iter().map(|r| r.iter().zip(r.iter().skip(lag)).map(|(a, b)| a * b).sum::<f64>()).sum();
            n * n * (sum / total).powi(2) / pairs as f64
        })
        .sum()
}

/// The largest standardised sum over an interval of relative position that all runs share.
fn scan(runs: &[&[f64]]) -> f64 {
    const BINS: usize = 16;
    let mut sums = [0.0; BINS + 1];
    let mut counts = [0.0; BINS + 1];
    for run in runs {
        for (i, v) in run.iter().enumerate() {
            let bin = i * BINS / run.len();
            sums[bin + 1] += v;
            counts[bin + 1] += 1.0;
        }
    }
    for i in 0..BINS {
        sums[i + 1] += sums[i];
        counts[i + 1] += counts[i];
    }
    let mut best: f64 = 0.0;
    for i in 0..BINS {
        for j in i + 1..=BINS {
            let n: f64 = counts[j] - counts[i];
            if n > 0.0 {
                best = best.max((sums[j] - sums[i]).abs() / n.sqrt());
            }
        }
    }
    best
}
