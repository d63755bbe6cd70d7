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
    /// The lag takes the quantity for a straight line from row to row, and begins in the steady state of the first.
    pub fn read(&self, begin: f64, t: &[f64], values: &mut [T]) {
        if let Some(lag_s) = self.lag_s {
            lagging(t, values, lag_s);
        }
        for (value, t) in values.iter_mut().zip(t) {
            let read = *value * (self.gain + 1.0) + self.offset + self.drift_per_s * (*t - begin);
            *value = read.within(self.lower, self.upper);
        }
    }
}

/// A first-order lag of values that run straight from row to row.
fn lagging<T: Number>(t: &[f64], values: &mut [T], lag_s: T) {
    let Some(mut before) = values.first().copied() else { return };
    let slope = |a: T, b: T, dt: f64| (b - a) / dt;
    let first = if values.len() > 1 { slope(values[0], values[1], t[1] - t[0]) } else { T::from(0.0) };
    // How far the reading is from the steady state of the line that it follows.
    let mut reading = before - lag_s * first;
    values[0] = reading;
    for i in 1..values.len() {
        let (now, dt) = (values[i], t[i] - t[i - 1]);
        let steep = slope(before, now, dt);
        let left = reading - before + lag_s * steep;
        let fades = if lag_s.re() > 0.0 { (lag_s.recip() * -dt).exp() } else { T::from(0.0) };
        reading = now - lag_s * steep + left * fades;
        values[i] = reading;
        before = now;
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
        Sensor { lag_s: Some(0.25), gain: 0.1, offset: -1.0, ..Sensor::perfect() }.read(0.0, &t, &mut values);
        for (value, t) in values.iter().zip(&t) {
            assert_relative_eq!(*value, 1.1 * 3.0 * (t - 0.25) - 1.0, epsilon = 1e-12);
        }
    }

    #[test]
    fn a_sensor_saturates_and_drifts() {
        let t = [10.0, 11.0, 12.0];
        let mut values = [0.0, 1.0, 2.0];
        Sensor { drift_per_s: 0.5, upper: 1.2, ..Sensor::perfect() }.read(10.0, &t, &mut values);
        assert_eq!(values, [0.0, 1.2, 1.2]);
    }
}
