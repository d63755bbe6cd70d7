use argmin::core::{CostFunction, Error, Executor, State as _};
use argmin::solver::brent::BrentOpt;
use hw_traits::clock::Stamped;

use super::SignalError;

/// Streams that correlate less than this do not show the same motion.
const ALIKE: f64 = 0.5;
/// Trial shifts on each side of zero, in the coarse search.
const SHIFTS: i32 = 200;
/// To which a shift is found, s.
const TOLERANCE_S: f64 = 1e-9;

/// Times of one clock from times of another: `offset_s + rate t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockMap {
    /// The first clock's time where the second one's is 0, s.
    pub offset_s: f64,
    /// Seconds of the first clock in one of the second.
    pub rate: f64,
}

impl ClockMap {
    /// Both clocks agree.
    pub const SAME: Self = Self { offset_s: 0.0, rate: 1.0 };

    /// The first clock's time (s) at a time (s) of the second.
    pub fn at(&self, t_s: f64) -> f64 {
        self.offset_s + self.rate * t_s
    }
}

/// The map between two clocks from moments that both stamped (`[first, second]`, s), by least squares: offset and rate.
///
/// # Errors
/// [`SignalError::TooFew`] for less than two moments, [`SignalError::Value`] for one that is no number, [`SignalError::Range`] for
/// moments that are all one.
pub fn align(moments: &[[f64; 2]]) -> Result<ClockMap, SignalError> {
    if moments.len() < 2 {
        return Err(SignalError::TooFew { what: "moments", got: moments.len(), least: 2 });
    }
    for [a, b] in moments {
        if let Some(&got) = [a, b].into_iter().find(|v| !v.is_finite()) {
            return Err(SignalError::Value { stream: "moments", t_s: *a, got });
        }
    }
    let n = moments.len() as f64;
    let mean = |k: usize| moments.iter().map(|m| m[k]).sum::<f64>() / n;
    let (first, second) = (mean(0), mean(1));
    let spread: f64 = moments.iter().map(|m| (m[1] - second).powi(2)).sum();
    if spread == 0.0 {
        return Err(SignalError::Range { name: "moments", got: second, expected: "moments that differ" });
    }
    let rate = moments.iter().map(|m| (m[0] - first) * (m[1] - second)).sum::<f64>() / spread;
    Ok(ClockMap { offset_s: first - rate * second, rate })
}

/// The offset (s) by which the second stream's clock is behind the first one's, from a motion that both show: where their
/// correlation is largest, within `most_s` to either side. To a small part of the readings' spacing.
///
/// # Errors
/// [`SignalError`] for streams whose times do not rise, with less than ten readings, or that do not show the same motion.
pub fn align_at(
    first: &[Stamped<f64>],
    second: &[Stamped<f64>],
    most_s: f64,
) -> Result<ClockMap, SignalError> {
    if !(most_s > 0.0 && most_s.is_finite()) {
        return Err(SignalError::Range { name: "most_s", got: most_s, expected: "above 0" });
    }
    for (name, stream) in [("first", first), ("second", second)] {
        rising(name, stream)?;
    }
    let score = |shift: f64| correlation(first, second, shift);
    let grid = |k: i32| most_s * f64::from(k) / f64::from(SHIFTS);
    let best = (-SHIFTS..=SHIFTS).max_by(|a, b| score(grid(*a)).total_cmp(&score(grid(*b)))).unwrap_or(0);
    let solver =
        BrentOpt::new(grid(best - 1), grid(best + 1)).set_tolerance(f64::EPSILON.sqrt(), TOLERANCE_S);
    let found =
        Executor::new(Shifted { first, second }, solver).configure(|state| state.max_iters(100)).run();
    // Brent's method does not try the grid's own shift.
    let coarse = (grid(best), score(grid(best)));
    let fine = found.ok().and_then(|f| Some((*f.state().get_best_param()?, -f.state().get_best_cost())));
    let (offset_s, got) = fine.filter(|f| f.1 > coarse.1).unwrap_or(coarse);
    if !(got >= ALIKE) {
        return Err(SignalError::NotAlike { got, least: ALIKE });
    }
    Ok(ClockMap { offset_s, rate: 1.0 })
}

/// Two streams, the second to be shifted until they are alike.
struct Shifted<'a> {
    first: &'a [Stamped<f64>],
    second: &'a [Stamped<f64>],
}

impl CostFunction for Shifted<'_> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, shift: &f64) -> Result<f64, Error> {
        Ok(-correlation(self.first, self.second, *shift))
    }
}

fn rising(name: &'static str, stream: &[Stamped<f64>]) -> Result<(), SignalError> {
    if stream.len() < 10 {
        return Err(SignalError::TooFew { what: "readings", got: stream.len(), least: 10 });
    }
    for pair in stream.windows(2) {
        if !(pair[1].t_s > pair[0].t_s) {
            return Err(SignalError::Time { stream: name, before: pair[0].t_s, got: pair[1].t_s });
        }
    }
    match stream.iter().find(|s| !s.value.is_finite() || !s.t_s.is_finite()) {
        Some(bad) => Err(SignalError::Value { stream: name, t_s: bad.t_s, got: bad.value }),
        None => Ok(()),
    }
}

/// Correlation of the first stream with the second one shifted by `shift` s, where they overlap; -1 where too little does.
fn correlation(first: &[Stamped<f64>], second: &[Stamped<f64>], shift: f64) -> f64 {
    let mut sums = [0.0; 5];
    let (mut k, mut count) = (0, 0.0);
    for reading in first {
        let t = reading.t_s - shift;
        while k + 1 < second.len() && second[k + 1].t_s < t {
            k += 1;
        }
        let (Some(a), Some(b)) = (second.get(k), second.get(k + 1)) else { break };
        if t < a.t_s {
            continue;
        }
        let other = a.value + (b.value - a.value) * (t - a.t_s) / (b.t_s - a.t_s);
        for (sum, term) in sums.iter_mut().zip([
            reading.value,
            other,
            reading.value * reading.value,
            other * other,
            reading.value * other,
        ]) {
            *sum += term;
        }
        count += 1.0;
    }
    let [x, y, xx, yy, xy] = sums.map(|s| s / f64::max(count, 1.0));
    let scale = ((xx - x * x) * (yy - y * y)).sqrt();
    if count < 0.3 * first.len() as f64 || !(scale > 0.0) { -1.0 } else { (xy - x * y) / scale }
}
