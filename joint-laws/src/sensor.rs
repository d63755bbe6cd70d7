//! What a sensor does to the quantity that it reads.

use crate::Number;

/// Errors of a sensor; each is off at 0, the bounds where they are infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor<T> {
    /// Relative departure of the gain from 1.
    pub gain: T,
    /// Added to the reading.
    pub offset: T,
    /// Added to the reading for each second since the run began, 1/s.
    pub drift_per_s: T,
    /// Time constant of a first-order lag, s, at least 0; `None` without one.
    pub lag_s: Option<T>,
    /// The largest reading.
    pub upper: T,
    /// The smallest reading.
    pub lower: T,
}

impl<T: Number> Sensor<T> {
    /// A perfect sensor.
    pub fn perfect() -> Self {
        let zero = T::from(0.0);
        let (upper, lower) = (T::from(f64::INFINITY), T::from(f64::NEG_INFINITY));
        Self { gain: zero, offset: zero, drift_per_s: zero, lag_s: None, upper, lower }
    }

    /// Turns the true values at the times `t` (rising) of a run that began at a time into readings, in place.
    ///
    /// The lag takes the quantity for a cubic from row to row (Hermite's, with slopes by three rows). It begins between where the quantity
    /// stands (it was at rest before) and as far behind it as its first slope keeps a reading (it moved on like that), at the quarter that
    /// is nearest to what was `measured` while that lasts (NaN where nothing was); at the latter where nothing tells.
    pub fn read(&self, begin: f64, t: &[f64], measured: &[f64], values: &mut [T]) {
        if let Some(lag_s) = self.lag_s {
            self.lag(lag_s, begin, (t, measured), values);
        }
        for (value, t) in values.iter_mut().zip(t) {
            *value = self.within(*value, *t - begin);
        }
    }

    /// Makes values lag, from where the first readings say.
    fn lag(&self, lag_s: T, begin: f64, (t, measured): (&[f64], &[f64]), values: &mut [T]) {
        let behind = lagging(t, values, lag_s);
        if !(lag_s.re() > 0.0) {
            return;
        }
        // How much more is read where the quantity was at rest before.
        let more: Vec<T> = t
            .iter()
            .map(|at| (at - t[0]) / lag_s.re())
            .take_while(|lags| *lags < FADED)
            .zip(t)
            .map(|(_, at)| behind * (lag_s.recip() * (t[0] - at)).exp())
            .collect();
        let moved = moved_on(|part| {
            let rows = more.iter().zip(&*values).zip(t).zip(measured).filter(|(_, read)| read.is_finite());
            let miss = |(((more, value), t), read): (((&T, &T), &f64), &f64)| {
                (self.within(*value + *more * (1.0 - part), t - begin).re() - read).powi(2)
            };
            rows.map(miss).sum()
        });
        values.iter_mut().zip(&more).for_each(|(value, more)| *value += *more * (1.0 - moved));
    }

    fn within(&self, value: T, after_s: f64) -> T {
        self.value(value, after_s).within(self.lower, self.upper)
    }

    /// What becomes of a value some time after the run began: without the lag, and within the bounds.
    pub fn value(&self, value: T, after_s: f64) -> T {
        value * (self.gain + 1.0) + self.offset + self.drift_per_s * after_s
    }
}

/// By which part, in quarters, what was before a run's first row had moved on as it does then, and not stood still: the part by which the
/// first rows are missed least, all of it where they do not tell.
pub fn moved_on(missed: impl Fn(f64) -> f64) -> f64 {
    let parts = [1.0, 0.0, 0.25, 0.5, 0.75].into_iter();
    parts.min_by(|a, b| missed(*a).total_cmp(&missed(*b))).unwrap_or(1.0)
}

/// A lag's start has faded after so many time constants.
const FADED: f64 = 12.0;

/// A first-order lag of values that run along cubics from row to row, through each row with the slope of a parabola through its neighbours.
/// It is read first as if the quantity had moved on with its first slope before: how far behind, is returned.
fn lagging<T: Number>(t: &[f64], values: &mut [T], lag_s: T) -> T {
    let slopes = slopes(t, values);
    let (Some(&first), Some(&slope)) = (values.first(), slopes.first()) else { return T::from(0.0) };
    let behind = lag_s * slope;
    let mut reading = first - behind;
    let mut before = std::mem::replace(&mut values[0], reading);
    for i in 1..values.len() {
        let dt = t[i] - t[i - 1];
        let path = Cubic::new([before, values[i]], [slopes[i - 1] * dt, slopes[i] * dt]);
        if lag_s.re() > dt {
            // The fading weight is smooth in a row's time: quadrature to rounding, where what is exact would cancel.
            let rate = lag_s.recip() * dt;
            let nodes = QUADRATURE.iter().map(|[at, weight]| {
                let fades = (rate * (at - 1.0)).exp();
                fades * path.at(*at) * *weight
            });
            let sum = nodes.fold(T::from(0.0), |sum, term| sum + term);
            reading = reading * (-rate).exp() + sum * rate;
        } else {
            let tau = lag_s * dt.recip();
            let fades = if lag_s.re() > 0.0 { (-tau.recip()).exp() } else { T::from(0.0) };
            reading = path.steady(1.0, tau) + (reading - path.steady(0.0, tau)) * fades;
        }
        before = std::mem::replace(&mut values[i], reading);
    }
    behind
}

/// Nodes from 0 to 1 and weights of Gauss-Legendre quadrature with five nodes.
const QUADRATURE: [[f64; 2]; 5] = [
    [0.046_910_077_030_668_004, 0.118_463_442_528_094_54],
    [0.230_765_344_947_158_45, 0.239_314_335_249_683_23],
    [0.5, 0.284_444_444_444_444_44],
    [0.769_234_655_052_841_5, 0.239_314_335_249_683_23],
    [0.953_089_922_969_332, 0.118_463_442_528_094_54],
];

/// Slopes of values at each row: of the parabola through a row and its neighbours, at the ends that of the last one.
fn slopes<T: Number>(t: &[f64], values: &[T]) -> Vec<T> {
    let n = values.len();
    let secant = |i: usize| (values[i + 1] - values[i]) / (t[i + 1] - t[i]);
    match n {
        0 => Vec::new(),
        1 => vec![T::from(0.0)],
        2 => vec![secant(0); 2],
        _ => (0..n)
            .map(|i| {
                let k = i.clamp(1, n - 2);
                let bend = (secant(k) - secant(k - 1)) / (t[k + 1] - t[k - 1]);
                secant(k - 1) + bend * (t[i] - t[k - 1] + t[i] - t[k])
            })
            .collect(),
    }
}

/// A cubic from 0 to 1 by its coefficients, the constant first.
struct Cubic<T>([T; 4]);

impl<T: Number> Cubic<T> {
    /// By its values and slopes at both ends.
    fn new([from, to]: [T; 2], [leaves, arrives]: [T; 2]) -> Self {
        let rise = to - from;
        Self([from, leaves, rise * 3.0 - leaves * 2.0 - arrives, leaves + arrives - rise * 2.0])
    }

    fn at(&self, s: f64) -> T {
        let [a, b, c, d] = self.0;
        a + (b + (c + d * s) * s) * s
    }

    /// What a first-order lag of `tau` reads in the steady state: `p - tau p' + tau^2 p'' - tau^3 p'''`.
    fn steady(&self, s: f64, tau: T) -> T {
        let [_, b, c, d] = self.0;
        let first = b + (c * 2.0 + d * (3.0 * s)) * s;
        let second = c * 2.0 + d * (6.0 * s);
        self.at(s) - tau * (first - tau * (second - tau * d * 6.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_ramp_is_read_late_by_the_lag() {
        let t: Vec<f64> = (0..50).map(|i| 0.1 * f64::from(i)).collect();
        let mut values: Vec<f64> = t.iter().map(|t| 3.0 * t).collect();
        Sensor { lag_s: Some(0.25), gain: 0.1, offset: -1.0, ..Sensor::perfect() }.read(
            0.0,
            &t,
            &[],
            &mut values,
        );
        for (value, t) in values.iter().zip(&t) {
            assert_relative_eq!(*value, 1.1 * 3.0 * (t - 0.25) - 1.0, epsilon = 1e-12);
        }
    }

    /// A wave of 25 rows a period, against what a first-order lag makes of it once its start has faded: smaller by `1 / sqrt(1 + (w tau)^2)`
    /// and later in phase by `atan(w tau)`; lags shorter than a row and longer than a period.
    #[test]
    fn a_wave_is_read_smaller_and_late_by_the_lag() {
        let (rate, dt) = (2.0_f64, 0.04 * std::f64::consts::PI);
        for (lag, faded) in [(0.02, 40), (0.1, 60), (0.126, 60), (0.5, 120), (5.0, 1500)] {
            let t: Vec<f64> = (0..2000).map(|i| dt * f64::from(i)).collect();
            let mut values: Vec<f64> = t.iter().map(|t| (rate * t).sin()).collect();
            Sensor { lag_s: Some(lag), ..Sensor::perfect() }.read(0.0, &t, &[], &mut values);
            let gain = (1.0 + (rate * lag).powi(2)).sqrt().recip();
            for (value, t) in values.iter().zip(&t).skip(faded) {
                let expected = gain * (rate * t - (rate * lag).atan()).sin();
                assert!((value - expected).abs() < 6e-4 * gain, "{lag} {t} {value} {expected}");
            }
        }
    }

    /// A ramp that begins at rest: the reading begins where the quantity stands, if the first readings say so, whichever of them there are.
    #[test]
    fn a_lag_begins_where_the_first_readings_say() {
        let t: Vec<f64> = (0..50).map(|i| 0.1 * f64::from(i)).collect();
        let read = |settled: f64| t.iter().map(move |t| 2.0 * (t - 0.25) + settled * 0.5 * (-t / 0.25).exp());
        for (settled, wrong_by) in [(0.0, 0.0), (1.0, 0.04), (0.75, 0.02), (0.75, -0.02)] {
            let mut measured: Vec<f64> = read(settled).map(|value| value + wrong_by).collect();
            measured[1] = f64::NAN;
            let mut values: Vec<f64> = t.iter().map(|t| 2.0 * t).collect();
            Sensor { lag_s: Some(0.25), ..Sensor::perfect() }.read(0.0, &t, &measured, &mut values);
            for (value, expected) in values.iter().zip(read(settled)) {
                assert_relative_eq!(*value, expected, epsilon = 1e-5);
            }
        }
    }

    #[test]
    fn a_sensor_saturates_and_drifts() {
        let t = [10.0, 11.0, 12.0];
        let mut values = [0.0, 1.0, 2.0];
        Sensor { drift_per_s: 0.5, upper: 1.2, ..Sensor::perfect() }.read(10.0, &t, &[], &mut values);
        assert_eq!(values, [0.0, 1.2, 1.2]);
    }
}
