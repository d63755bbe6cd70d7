//! An oscillation of one frequency in what is left: a machine near by, an arm that rings, a step that comes back.

use std::sync::Arc;

use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftPlanner};

/// The highest of powers; 0 of none.
pub(super) fn highest(powers: &[f64]) -> f64 {
    powers.iter().copied().fold(0.0, f64::max)
}

/// Looks for an oscillation of one frequency, in rows, that all runs share, whatever its phase in each (Fisher 1929,
/// doi:10.1098/rspa.1929.0151).
pub(super) struct Lines {
    transform: Arc<dyn Fft<f64>>,
}

impl Lines {
    /// Runs shorter than this have no frequencies to speak of.
    const SHORTEST: usize = 8;

    /// For runs of so many rows at most; `None` where those are too few.
    pub(super) fn new(longest: usize) -> Option<Self> {
        let length = longest.next_power_of_two();
        (longest >= Self::SHORTEST).then(|| Self { transform: FftPlanner::new().plan_fft_forward(length) })
    }

    /// No power at any frequency.
    pub(super) fn nothing(&self) -> Vec<f64> {
        vec![0.0; self.transform.len() / 2 + 1]
    }

    /// The power at each frequency, summed over runs, in units of the mean square of all rows (whose sum of squares is `total`); none at zero.
    pub(super) fn powers(&self, runs: &[&[f64]], total: f64) -> Vec<f64> {
        let length = self.transform.len();
        let mut power = self.nothing();
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
        let unit = if total > 0.0 { rows as f64 / total } else { 0.0 };
        power.iter_mut().for_each(|power| *power *= unit);
        power
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// Of runs of different length and phase the power stands at their frequency, what alternates from row to row included.
    #[test]
    fn the_highest_power_is_that_of_the_oscillation() {
        for (cycles_per_row, bin) in [(0.125, 32), (0.5, 128)] {
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
            let whole: f64 = if bin == 128 { 600.0 } else { 300.0 };
            approx::assert_relative_eq!(most, whole, max_relative = 0.05);
        }
        assert!(Lines::new(7).is_none());
    }
}
