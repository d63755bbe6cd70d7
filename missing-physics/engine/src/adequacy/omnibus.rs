//! Tests that look for nothing in particular: serial correlation, shifts of runs and of intervals, single frequencies, the size of the
//! residual, single runs that miss.

use std::sync::Arc;

use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftPlanner};

use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::statistics::median;

/// A test that looks for nothing in particular.
pub(crate) struct OmnibusTest {
    pub(crate) name: String,
    /// Whether its statistic stays at a floor in most worlds, so that its null distribution is counted.
    pub(crate) rare: bool,
}

/// Tests that look for nothing in particular.
pub(crate) struct Omnibus<'a> {
    problem: &'a Problem<'a>,
    rule: &'a NoiseRule,
    lines: Option<Lines>,
}

impl<'a> Omnibus<'a> {
    /// The tests of a problem's channels, whose noise is known as the rule says.
    pub(crate) fn new(problem: &'a Problem<'a>, rule: &'a NoiseRule) -> Self {
        let longest = problem.rows.iter().flat_map(|run| &run.valid).map(Vec::len).max().unwrap_or(0);
        Self { problem, rule, lines: Lines::new(longest) }
    }

    /// The tests, in the order of [`Self::statistics`].
    pub(crate) fn tests(&self) -> Vec<OmnibusTest> {
        let mut tests = Vec::new();
        for (c, channel) in self.problem.recording.channels.iter().enumerate() {
            let mut test = |what: &str, rare: bool| {
                tests.push(OmnibusTest { name: format!("{}: {what}", channel.name), rare });
            };
            test("neighbouring rows (8 lags)", false);
            test("neighbouring rows (24 lags)", false);
            test("shifts between runs", false);
            test("shifts of intervals of rows", false);
            test("a shift within one run", false);
            test("neighbouring rows of one stretch", false);
            test("one frequency", false);
            test("a run that misses by far more than the others", true);
            if self.rule.fixed_sigma[c].is_some() {
                test("size against the known noise", false);
            }
        }
        tests
    }

    /// Statistics of a residual and the same whitened, `[run][channel]`.
    pub(crate) fn statistics(&self, left: &[Vec<Vec<f64>>], white: &[Vec<Vec<f64>>]) -> Vec<f64> {
        let mut statistics = Vec::new();
        for c in 0..self.problem.channels() {
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
            statistics.push(shift_in_a_run(&runs));
            statistics.push(correlated_stretch(&runs));
            statistics.push(self.lines.as_ref().map_or(0.0, |lines| lines.highest(&runs, total)));
            statistics.push(odd_run(left, c));
            if self.rule.fixed_sigma[c].is_some() {
                statistics.push(total / rows.max(1) as f64);
            }
        }
        statistics
    }
}

/// Looks for an oscillation of one frequency, in rows, that all runs share, whatever its phase in each (Fisher 1929,
/// doi:10.1098/rspa.1929.0151).
struct Lines {
    transform: Arc<dyn Fft<f64>>,
}

impl Lines {
    /// Runs shorter than this have no frequencies to speak of.
    const SHORTEST: usize = 24;

    fn new(longest: usize) -> Option<Self> {
        let length = longest.next_power_of_two();
        (longest >= Self::SHORTEST).then(|| Self { transform: FftPlanner::new().plan_fft_forward(length) })
    }

    /// The largest power at one frequency, summed over runs, in units of the mean square of all rows.
    fn highest(&self, runs: &[&[f64]], total: f64) -> f64 {
        let length = self.transform.len();
        let mut power = vec![0.0; length / 2];
        let mut scratch = vec![Complex64::default(); self.transform.get_inplace_scratch_len()];
        let mut both = vec![Complex64::default(); length];
        // Two runs are transformed together: one is the real part, the other the imaginary one.
        for pair in runs.chunks(2) {
            both.fill(Complex64::default());
            let [first, second] = [pair[0], pair.get(1).copied().unwrap_or_default()];
            both.iter_mut().zip(first).for_each(|(z, v)| z.re = *v);
            both.iter_mut().zip(second).for_each(|(z, v)| z.im = *v);
            self.transform.process_with_scratch(&mut both, &mut scratch);
            for (k, power) in power.iter_mut().enumerate().skip(1) {
                let (a, b) = (both[k], both[length - k].conj());
                let [one, other] = [a + b, a - b].map(|z| 0.25 * z.norm_sqr());
                *power += one / first.len().max(1) as f64 + other / second.len().max(1) as f64;
            }
        }
        let rows: usize = runs.iter().map(|r| r.len()).sum();
        if total > 0.0 { power.into_iter().fold(0.0, f64::max) * rows as f64 / total } else { 0.0 }
    }
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

/// The largest standardised sum over an interval of rows of a single run, of lengths that double and at steps of a quarter of a length: what
/// acts in one run alone is too faint in what all runs share.
fn shift_in_a_run(runs: &[&[f64]]) -> f64 {
    const SHORTEST: usize = 4;
    let mut best: f64 = 0.0;
    for run in runs {
        let mut before = 0.0;
        let up_to = |v: &f64| {
            before += v;
            before
        };
        let sums: Vec<f64> = std::iter::once(0.0).chain(run.iter().map(up_to)).collect();
        let lengths = std::iter::successors(Some(SHORTEST), |l| Some(2 * l)).take_while(|l| *l <= run.len());
        for length in lengths {
            for from in (0..=run.len() - length).step_by(length / 4) {
                best = best.max((sums[from + length] - sums[from]).abs() / (length as f64).sqrt());
            }
        }
    }
    best
}

/// The largest correlation of neighbouring rows within a stretch of a run, as [`portmanteau`] has it of all rows, over stretches of an
/// eighth of the run that overlap by half; in units of the stretch's own squares, so that rows that are noisier do not count.
fn correlated_stretch(runs: &[&[f64]]) -> f64 {
    const STRETCHES: usize = 8;
    const SHORTEST: usize = 24;
    const LAGS: usize = 8;
    let mut best: f64 = 0.0;
    for run in runs {
        let length = run.len().div_ceil(STRETCHES).max(SHORTEST);
        if length > run.len() {
            continue;
        }
        for from in (0..=run.len() - length).step_by(length / 2) {
            let stretch = &run[from..from + length];
            let squares = stretch.iter().map(|v| v * v).sum();
            best = best.max(portmanteau(&[stretch], squares, length, LAGS));
        }
    }
    best
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
