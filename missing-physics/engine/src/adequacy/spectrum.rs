//! An oscillation of one frequency in what is left: a machine near by, an arm that rings, a step that comes back.

use std::sync::Arc;

use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftPlanner};

/// The highest of powers; 0 of none.
pub(super) fn highest(powers: &[f64]) -> f64 {
    powers.iter().copied().fold(0.0, f64::max)
}

/// A part of each run, in quarters, and a transform that holds it with room to spare: between two frequencies of the bare length a tone would
/// lose up to 60 % of its power, with half of the length more a third at most (Harris 1978, doi:10.1109/PROC.1978.10837: scalloping).
struct Window {
    from: usize,
    to: usize,
    /// The lowest frequency: one cycle in the rows of the longest run.
    lowest: usize,
    transform: Arc<dyn Fft<f64>>,
}

impl Window {
    /// The rows of a run that lie in it.
    fn of<'a>(&self, run: &'a [f64]) -> &'a [f64] {
        let quarter = |quarter: usize| quarter * run.len() / 4;
        &run[quarter(self.from)..quarter(self.to)]
    }

    /// Frequencies from zero to one cycle in two rows.
    fn frequencies(&self) -> usize {
        self.transform.len() / 2 + 1
    }
}

/// Looks for an oscillation of one frequency, in rows, that all runs share, whatever its phase in each (Fisher 1929,
/// doi:10.1098/rspa.1929.0151), all along them or in a half: what starts on the way has half of its power in the whole.
pub(super) struct Lines {
    windows: Vec<Window>,
}

impl Lines {
    /// Windows shorter than this have no frequencies to speak of.
    const SHORTEST: usize = 8;

    /// For runs of so many rows at most; `None` where those are too few.
    pub(super) fn new(longest: usize) -> Option<Self> {
        let mut planner = FftPlanner::new();
        let mut window = |(from, to): (usize, usize)| {
            let rows = longest * (to - from) / 4;
            let length = (rows + rows / 2).next_power_of_two();
            let lowest = length.div_ceil(rows.max(1));
            (rows >= Self::SHORTEST).then(|| Window {
                from,
                to,
                lowest,
                transform: planner.plan_fft_forward(length),
            })
        };
        let windows: Vec<Window> =
            [(0, 4), (0, 2), (1, 3), (2, 4)].into_iter().filter_map(&mut window).collect();
        (!windows.is_empty()).then_some(Self { windows })
    }

    /// No power at any frequency of any window.
    pub(super) fn nothing(&self) -> Vec<f64> {
        vec![0.0; self.windows.iter().map(Window::frequencies).sum()]
    }

    /// The power at each frequency, window after window, summed over runs, in units of the mean square of all rows (whose sum of squares is
    /// `total`); none below one cycle in a window.
    pub(super) fn powers(&self, runs: &[&[f64]], total: f64) -> Vec<f64> {
        let rows: usize = runs.iter().map(|r| r.len()).sum();
        let unit = if total > 0.0 { rows as f64 / total } else { 0.0 };
        let mut all = self.nothing();
        let mut left = all.as_mut_slice();
        for window in &self.windows {
            let (power, others) = left.split_at_mut(window.frequencies());
            add_powers(window, runs, power);
            power.iter_mut().for_each(|power| *power *= unit);
            left = others;
        }
        all
    }
}

/// Adds the power that runs have at each frequency of a window.
fn add_powers(window: &Window, runs: &[&[f64]], power: &mut [f64]) {
    let length = window.transform.len();
    let mut scratch = vec![Complex64::default(); window.transform.get_inplace_scratch_len()];
    let mut both = vec![Complex64::default(); length];
    // Two runs are transformed together: one is the real part, the other the imaginary one.
    for pair in runs.chunks(2) {
        both.fill(Complex64::default());
        let [first, second] = [pair[0], pair.get(1).copied().unwrap_or_default()].map(|run| window.of(run));
        both.iter_mut().zip(first).for_each(|(z, v)| z.re = *v);
        both.iter_mut().zip(second).for_each(|(z, v)| z.im = *v);
        window.transform.process_with_scratch(&mut both, &mut scratch);
        for (k, power) in power.iter_mut().enumerate().skip(window.lowest) {
            let (a, b) = (both[k], both[length - k].conj());
            let [one, other] = [a + b, a - b].map(|z| 0.25 * z.norm_sqr());
            *power += one / first.len().max(1) as f64 + other / second.len().max(1) as f64;
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// Of runs of different length and phase the power stands at their frequency, what alternates from row to row included.
    #[test]
    fn the_highest_power_is_that_of_the_oscillation() {
        for (cycles_per_row, bin) in [(0.125, 64), (0.5, 256)] {
            let run = |rows: usize, phase: f64| -> Vec<f64> {
                let at = |i: usize| (std::f64::consts::TAU * cycles_per_row * i as f64 + phase).cos();
                (0..rows).map(at).collect()
            };
            let runs = [run(256, 0.1), run(200, 0.4), run(144, -0.2)];
            let slices: Vec<&[f64]> = runs.iter().map(Vec::as_slice).collect();
            let total = runs.iter().flatten().map(|v| v * v).sum();
            let powers = Lines::new(256).unwrap().powers(&slices, total);
            let most = highest(&powers);
            assert_eq!(powers.iter().position(|power| *power == most), Some(bin));
            // Of a pure tone, half of the rows; of what alternates, all.
            let whole: f64 = if bin == 256 { 600.0 } else { 300.0 };
            approx::assert_relative_eq!(most, whole, max_relative = 0.05);
        }
        assert!(Lines::new(7).is_none());
    }

    /// What starts halfway has its power in the second half of the runs, twice that of the whole, between two frequencies as well.
    #[test]
    fn what_starts_on_the_way_shows_in_its_half() {
        for cycles in [0.1, 0.1 + 0.5 / 256.0] {
            let at = |i: usize| if i < 128 { 0.0 } else { (std::f64::consts::TAU * cycles * i as f64).cos() };
            let run: Vec<f64> = (0..256).map(at).collect();
            let total = run.iter().map(|v| v * v).sum();
            let powers = Lines::new(256).unwrap().powers(&[&run], total);
            let whole = highest(&powers[..257]);
            let last = highest(&powers[powers.len() - 129..]);
            assert!(highest(&powers) <= last && last > 1.7 * whole, "{whole} {last}");
            // A pure tone of 128 rows, in units of the mean square of 256.
            assert!((0.65..1.01).contains(&(last / 128.0)), "{last}");
        }
    }
}
