//! Tests that look for nothing in particular: serial correlation, shifts of runs and of intervals, single frequencies, the size of the
//! residual, single runs that miss.

use crate::adequacy::linearised::{Linearised, Reading, ScoredNoise};
use crate::adequacy::spectrum::{Lines, highest};
use crate::linalg::dot;
use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::statistics::median;

/// Lags up to which neighbouring rows are compared.
const LAGS: [usize; 2] = [8, 24];

/// A test that looks for nothing in particular.
pub(crate) struct OmnibusTest {
    pub(crate) name: String,
    pub(crate) law: Law,
    /// Whether it looks in one run, one stretch or at one frequency only.
    pub(crate) narrow: bool,
}

/// What kind of number a statistic is, which says how its null distribution is continued beyond the draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Law {
    /// A sum of squares.
    Sum,
    /// The largest of many squares.
    Largest,
    /// At a floor in most worlds: counted.
    Rare,
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
            let mut test = |what: &str, law: Law, narrow: bool| {
                tests.push(OmnibusTest { name: format!("{}: {what}", channel.name), law, narrow });
            };
            for lags in LAGS {
                test(&format!("neighbouring rows ({lags} lags)"), Law::Sum, false);
            }
            test("shifts between runs", Law::Sum, false);
            test("shifts of intervals of rows", Law::Largest, false);
            test("a shift within one run", Law::Largest, true);
            test("neighbouring rows of one stretch", Law::Largest, true);
            test("one frequency", Law::Largest, true);
            test("a run that misses by far more than the others", Law::Rare, false);
            if self.rule.fixed_sigma[c].is_some() {
                test("size against the known noise", Law::Sum, false);
            }
        }
        if self.problem.channels() > 1 {
            let name = "all channels: one frequency".into();
            tests.push(OmnibusTest { name, law: Law::Largest, narrow: true });
        }
        tests
    }

    /// Statistics of the residual (`[run][channel]`) that a model leaves of data, as they are read.
    pub(crate) fn statistics(
        &self,
        linearised: &Linearised<'_>,
        reading: &Reading,
        left: &[Vec<Vec<f64>>],
    ) -> Vec<f64> {
        let mut statistics = Vec::new();
        let mut spectrum = self.lines.as_ref().map(Lines::nothing).unwrap_or_default();
        for c in 0..self.problem.channels() {
            let white = linearised.whitened(left, c, reading.noise[c]);
            let runs: Vec<&[f64]> = white.iter().map(Vec::as_slice).collect();
            let total: f64 = runs.iter().map(|r| dot(r, r)).sum();
            let rows: usize = runs.iter().map(|r| r.len()).sum();
            let of_lags = of_lags(&runs, total, rows, LAGS[1]);
            statistics.extend(LAGS.map(|lags| of_lags[..lags].iter().sum::<f64>()));
            statistics.push(
                runs.iter()
                    .filter(|r| !r.is_empty())
                    .map(|r| r.iter().sum::<f64>().powi(2) / r.len() as f64)
                    .sum(),
            );
            statistics.push(scan(&runs));
            let noises = under_each(linearised, &reading.noises[c], left, c);
            statistics.push(shift_beside_noise(&noises));
            statistics.push(correlated_stretch(&runs));
            let of_channel = self.lines.as_ref().map(|lines| powers_beside_noise(lines, &noises));
            let of_channel = of_channel.unwrap_or_default();
            statistics.push(highest(&of_channel));
            spectrum.iter_mut().zip(of_channel).for_each(|(all, power)| *all += power);
            statistics.push(odd_run(left, c));
            if self.rule.fixed_sigma[c].is_some() {
                statistics.push(total / rows.max(1) as f64);
            }
        }
        if self.problem.channels() > 1 {
            statistics.push(highest(&spectrum));
        }
        statistics
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

/// What each lag adds to Ljung and Box's statistic (1978, doi:10.1093/biomet/65.2.297), correlations pooled over runs.
fn of_lags(runs: &[&[f64]], total: f64, rows: usize, lags: usize) -> Vec<f64> {
    let n = rows as f64;
    (1..=lags)
        .map(|lag| {
            let pairs: usize = runs.iter().map(|r| r.len().saturating_sub(lag)).sum();
            if pairs < 4 || total <= 0.0 {
                return 0.0;
            }
            let pairs_of = |r: &&[f64]| r.get(lag..).map_or(0.0, |later| dot(&r[..later.len()], later));
            n * n * (runs.iter().map(pairs_of).sum::<f64>() / total).powi(2) / pairs as f64
        })
        .collect()
}

/// A channel's residual under one of the noises that it may have.
struct UnderNoise {
    /// By run.
    white: Vec<Vec<f64>>,
    /// By how much the noise is less likely than the likeliest, as a logarithm.
    behind: f64,
}

impl UnderNoise {
    fn runs(&self) -> Vec<&[f64]> {
        self.white.iter().map(Vec::as_slice).collect()
    }
}

/// A channel's residual under each noise that it may have: one that is correlated over a good part of a run, or that swings, would take an effect
/// for its own.
fn under_each(
    linearised: &Linearised<'_>,
    noises: &[ScoredNoise],
    left: &[Vec<Vec<f64>>],
    channel: usize,
) -> Vec<UnderNoise> {
    let best = noises.iter().map(|noise| noise.score).fold(f64::NEG_INFINITY, f64::max);
    let under = |noise: &ScoredNoise| UnderNoise {
        white: linearised.whitened(left, channel, (noise.shape, noise.sigma)),
        behind: best - noise.score,
    };
    noises.iter().map(under).collect()
}

/// Twice the gain in log likelihood of a shift within one run, the noise free beside it.
fn shift_beside_noise(noises: &[UnderNoise]) -> f64 {
    let gain = |noise: &UnderNoise| shift_in_a_run(&noise.runs()) - 2.0 * noise.behind;
    noises.iter().map(gain).fold(0.0, f64::max)
}

/// The gain in log likelihood of an oscillation of each frequency, the noise free beside it.
fn powers_beside_noise(lines: &Lines, noises: &[UnderNoise]) -> Vec<f64> {
    let mut best = lines.nothing();
    for noise in noises {
        let runs = noise.runs();
        let total = runs.iter().map(|run| dot(run, run)).sum();
        let powers = lines.powers(&runs, total);
        best.iter_mut().zip(powers).for_each(|(best, power)| *best = best.max(power - noise.behind));
    }
    best
}

/// The square of the largest standardised difference between an interval of rows of a single run and the rest of that run: from a row on,
/// or of lengths that double and at steps of a quarter of a length. What acts in one run alone is too faint in what all runs share, and a zero
/// that is free in each run has taken the mean away (Page 1955, doi:10.1093/biomet/42.3-4.523).
fn shift_in_a_run(runs: &[&[f64]]) -> f64 {
    const SHORTEST: usize = 4;
    /// Rows from which on a shift is looked for.
    const CHANGES: usize = 128;
    let mut best: f64 = 0.0;
    for run in runs {
        let mut before = 0.0;
        let up_to = |v: &f64| {
            before += v;
            before
        };
        let sums: Vec<f64> = std::iter::once(0.0).chain(run.iter().map(up_to)).collect();
        let (rows, total) = (run.len(), sums[run.len()]);
        let part = |length: usize| length as f64 / rows as f64;
        // What an interval of a length has more than its part of the whole, squared; and the variance of that.
        let excess = |from: usize, to: usize| (sums[to] - sums[from] - part(to - from) * total).powi(2);
        let variance = |length: usize| length as f64 * (1.0 - part(length));
        // A run may have no value of this channel.
        let step = rows.div_ceil(CHANGES).max(1);
        for from in (SHORTEST..(rows + 1).saturating_sub(SHORTEST)).step_by(step) {
            best = best.max(excess(from, rows) / variance(rows - from));
        }
        let lengths = std::iter::successors(Some(SHORTEST), |l| Some(2 * l)).take_while(|l| 2 * l <= rows);
        for length in lengths {
            // Differences of sums a length apart, at steps of a quarter of it.
            let (usual, step) = (part(length) * total, length / 4);
            let begins = sums[..=rows - length].iter().step_by(step);
            let differences = sums[length..].iter().step_by(step).zip(begins).map(|(end, begin)| end - begin);
            let largest = differences.fold(0.0, |largest: f64, difference| {
                let excess = (difference - usual).abs();
                if excess > largest { excess } else { largest }
            });
            best = best.max(largest * largest / variance(length));
        }
    }
    best
}

/// The root of the largest correlation of neighbouring rows within a stretch of a run, as [`of_lags`] has it of all rows (a sum of fourth
/// powers, whose root falls off as squares do), over stretches of an
/// eighth of the run that overlap by half; in units of the stretch's own squares, so that rows that are noisier do not count.
fn correlated_stretch(runs: &[&[f64]]) -> f64 {
    const STRETCHES: usize = 8;
    const SHORTEST: usize = 24;
    let mut best: f64 = 0.0;
    for run in runs {
        let length = run.len().div_ceil(STRETCHES).max(SHORTEST);
        if length > run.len() {
            continue;
        }
        for from in (0..=run.len() - length).step_by(length / 2) {
            let stretch = &run[from..from + length];
            let of_lags = of_lags(&[stretch], dot(stretch, stretch), length, LAGS[0]);
            best = best.max(of_lags.iter().sum());
        }
    }
    best.sqrt()
}

/// The square of the largest standardised sum over an interval of relative position that all runs share.
fn scan(runs: &[&[f64]]) -> f64 {
    const BINS: usize = 16;
    let mut sums = [0.0; BINS + 1];
    let mut counts = [0.0; BINS + 1];
    for run in runs {
        // The first row of a bin: row i belongs to the bin floor(i BINS / rows).
        let first = |bin: usize| (bin * run.len()).div_ceil(BINS);
        for bin in 0..BINS {
            let rows = &run[first(bin)..first(bin + 1)];
            sums[bin + 1] += rows.iter().sum::<f64>();
            counts[bin + 1] += rows.len() as f64;
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
                best = best.max((sums[j] - sums[i]).powi(2) / n);
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    fn noise(runs: usize, rows: usize) -> Vec<Vec<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        (0..runs).map(|_| (0..rows).map(|_| StandardNormal.sample(&mut rng)).collect()).collect()
    }

    fn slices(runs: &[Vec<f64>]) -> Vec<&[f64]> {
        runs.iter().map(Vec::as_slice).collect()
    }

    /// A shift of half a sigma in a fifth of one run of six is seen there, and is hardly seen in all of them together.
    #[test]
    fn a_shift_within_one_run_is_seen_in_that_run() {
        let still = noise(6, 1000);
        let mut shifted = still.clone();
        shifted[3][600..800].iter_mut().for_each(|v| *v += 0.5);
        assert!(shift_in_a_run(&slices(&still)) < 4.5f64.powi(2));
        assert!(shift_in_a_run(&slices(&shifted)) > 6.0f64.powi(2));
        assert!(scan(&slices(&shifted)) < 4.5f64.powi(2));
    }

    /// A run without a value of the channel, or with too few for a shift, adds nothing.
    #[test]
    fn runs_without_values_add_nothing() {
        let full = noise(2, 50);
        for rows in [0, 1, 7] {
            let beside = [full[0].as_slice(), &full[1][..rows]];
            assert_eq!(shift_in_a_run(&beside), shift_in_a_run(&beside[..1]));
            assert!(shift_in_a_run(&beside[1..]) <= 0.0);
        }
    }

    /// A shift from three fifths of a run on, whose mean a free zero takes away: all that is left of it counts.
    #[test]
    fn a_shift_beside_a_free_zero_loses_nothing() {
        let mut shifted = noise(6, 1000);
        let before = shift_in_a_run(&slices(&shifted));
        for (row, v) in shifted[3].iter_mut().enumerate() {
            *v += 0.5 * if row < 600 { -0.4 } else { 0.6 };
        }
        // Half a sigma between 600 and 400 rows: 7.7 sigmas.
        let seen = shift_in_a_run(&slices(&shifted)).sqrt();
        assert!(before < 4.5f64.powi(2) && (6.2..9.2).contains(&seen), "{before} {seen}");
    }

    /// Rows that hang together in a tenth of one run are seen there, noisier ones are not.
    #[test]
    fn rows_that_hang_together_in_one_stretch_are_seen_there() {
        let still = noise(6, 1000);
        let (mut louder, mut together) = (still.clone(), still.clone());
        louder[2][300..400].iter_mut().for_each(|v| *v *= 5.0);
        together[2][300..400].iter_mut().enumerate().for_each(|(i, v)| *v += 1.5 * (0.7 * i as f64).sin());
        let [quiet, louder, together] = [&still, &louder, &together].map(|r| correlated_stretch(&slices(r)));
        assert!(quiet < 6.0 && together > 9.0, "{quiet} {together}");
        assert!(louder < 6.0, "{louder}");
    }
}
