//! A six-axis sensor: noise, drift and steps.

use hw_traits::force_torque::{ForceTorque, Wrench};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A sensor's noise and range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Readings a second.
    pub rate_hz: f64,
    /// Step of a force, and the standard deviation of its noise from reading to reading, N.
    pub force_step_n: f64,
    /// Step of a torque, and the standard deviation of its noise from reading to reading, N m.
    pub torque_step_nm: f64,
    /// Largest force, N.
    pub force_range_n: f64,
    /// Largest torque, N m.
    pub torque_range_nm: f64,
    /// Standard deviation of a slow wander of every axis, in steps; its memory is [`Sensor::wander_s`].
    pub wander_steps: f64,
    /// How long the wander remembers, s.
    pub wander_s: f64,
}

/// The ATI Axia80 of [Matl 2021], section 2.5 (7812 Hz), range 500 N and 20 N m, resolution 0.1 N and 0.005 N m.
///
/// The resolution is the data sheet's class, taken here as step *and* as noise of a raw reading (the maker's manuals give no noise
/// density); the wander is an assumption: a fiftieth of a step over half a minute, which no averaging over one pose removes.
pub const AXIA80: Sensor = Sensor {
    rate_hz: 7812.0,
    force_step_n: 0.1,
    torque_step_nm: 0.005,
    force_range_n: 500.0,
    torque_range_nm: 20.0,
    wander_steps: 0.02,
    wander_s: 30.0,
};

/// What has to be added to the readings of a sensor whose offset is zero, so that their mean over so many, one at least, is zero.
pub(super) fn tared<S: ForceTorque>(sensor: &mut S, readings: usize) -> Result<Wrench, S::Error> {
    let count = readings.max(1);
    let mut sum = Wrench::default();
    for _ in 0..count {
        sum = sum.plus(&sensor.read()?.value);
    }
    Ok(sum.scaled(-1.0 / count as f64))
}

/// The state of a sensor's noise.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    wander: [f64; 6],
}

impl Noise {
    pub(super) fn new() -> Self {
        Self { wander: [0.0; 6] }
    }

    /// What is read of a wrench; `None` where an axis is beyond its range.
    pub(super) fn read(&mut self, sensor: &Sensor, truth: &Wrench, rng: &mut ChaCha8Rng) -> Option<Wrench> {
        let lag_one = (-1.0 / (sensor.rate_hz * sensor.wander_s)).exp();
        let kick = sensor.wander_steps * (1.0 - lag_one * lag_one).sqrt();
        let mut values = truth.components();
        for (axis, (value, wander)) in values.iter_mut().zip(&mut self.wander).enumerate() {
            let (step, range) = if axis < 3 {
                (sensor.force_step_n, sensor.force_range_n)
            } else {
                (sensor.torque_step_nm, sensor.torque_range_nm)
            };
            let mut draw = || Distribution::<f64>::sample(&StandardNormal, rng);
            *wander = lag_one * *wander + kick * draw();
            let noisy = *value + step * (draw() + *wander);
            if noisy.abs() > range {
                return None;
            }
            *value = (noisy / step).round() * step;
        }
        let [a, b, c, d, e, f] = values;
        Some(Wrench { force_n: [a, b, c], torque_nm: [d, e, f] })
    }
}
