//! Readings of a swing: what they have to be, and averages of them.

use super::{FusionError, Swing};

/// Averages of readings: times, torques, and how many readings each is of.
pub(super) struct Rows {
    pub(super) t_s: Vec<f64>,
    pub(super) torque: Vec<f64>,
    pub(super) count: Vec<f64>,
}

/// Readings that are numbers, as many as times that rise.
pub(super) fn check(swing: &Swing<'_>) -> Result<(), FusionError> {
    const LEAST: usize = 20;
    let (times, torques) = (swing.t_s.len(), swing.tau_z_nm.len());
    if times != torques {
        return Err(FusionError::Lengths { times, torques });
    }
    if times < LEAST {
        return Err(FusionError::TooFew { what: "readings", got: times, least: LEAST });
    }
    for (index, got) in swing.tau_z_nm.iter().copied().enumerate() {
        if !got.is_finite() {
            return Err(FusionError::Value { what: "torque", index, got, expected: "a number" });
        }
    }
    for (index, got) in swing.t_s.iter().copied().enumerate() {
        let rises = if index == 0 { got >= 0.0 } else { got > swing.t_s[index - 1] };
        if !(rises && got.is_finite()) {
            let expected = "0 or more, and more than the one before";
            return Err(FusionError::Value { what: "time", index, got, expected });
        }
    }
    let got = swing.head_start_s;
    if got >= 0.0 && got.is_finite() {
        Ok(())
    } else {
        Err(FusionError::Range { name: "head_start_s", got, expected: "0 or more" })
    }
}

impl Rows {
    /// Averages over bins whose width (s) depends on the time.
    pub(super) fn averaged(swing: &Swing<'_>, width: impl Fn(f64) -> f64) -> Self {
        let mut rows = Self { t_s: Vec::new(), torque: Vec::new(), count: Vec::new() };
        let (mut sums, mut begin) = ([0.0; 3], swing.t_s[0]);
        for (t, y) in swing.t_s.iter().zip(swing.tau_z_nm) {
            if sums[0] > 0.0 && t - begin >= width(begin) {
                rows.push(sums);
                (sums, begin) = ([0.0; 3], *t);
            }
            sums = [sums[0] + 1.0, sums[1] + t, sums[2] + y];
        }
        rows.push(sums);
        rows
    }

    fn push(&mut self, [count, t, y]: [f64; 3]) {
        self.t_s.push(t / count);
        self.torque.push(y / count);
        self.count.push(count);
    }

    /// Columns over the rows' noise (N m a reading).
    pub(super) fn scaled(&self, column: Vec<f64>, noise: f64) -> Vec<f64> {
        column.into_iter().zip(&self.count).map(|(value, count)| value * count.sqrt() / noise).collect()
    }

    /// Half of the readings' range, N m: about what an amplitude may be.
    pub(super) fn reach(&self) -> f64 {
        let most = self.torque.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let least = self.torque.iter().copied().fold(f64::INFINITY, f64::min);
        (0.5 * (most - least)).max(f64::MIN_POSITIVE)
    }
}
