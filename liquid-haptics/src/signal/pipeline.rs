use std::collections::VecDeque;

use hw_traits::clock::Stamped;
use hw_traits::force_torque::Wrench;

use super::SignalError;
use super::align::ClockMap;
use super::fir::{Decimator, Smoother};
use crate::wrench::world_from_body;

/// What a pipeline does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PipelineSettings {
    /// The sensor's clock from the joint's.
    pub sensor_from_joint: ClockMap,
    /// How many readings of the sensor become one, 1 or more.
    pub factor: usize,
    /// What the sensor reads of no load, in its own frame.
    pub offset: Wrench,
    /// Standard deviation of the smoothing in readings that are left (0: none; [Matl 2021]: 5).
    pub smoothing: f64,
}

/// Wrench and tilt at one time of the sensor's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aligned {
    /// The time, s.
    pub t_s: f64,
    /// Tilt, rad.
    pub tilt_rad: f64,
    /// The wrench in the world's frame.
    pub wrench_in_world: Wrench,
}

/// Takes the readings of a sensor and of a joint as they come and gives wrenches in the world's frame.
///
/// Readings of the sensor outside the joint's times have no tilt and are left out. Either stream may run ahead; what has no partner
/// yet is held.
#[derive(Debug, Clone, PartialEq)]
pub struct Pipeline {
    settings: PipelineSettings,
    decimator: Decimator,
    smoother: Smoother,
    waiting: VecDeque<(f64, [f64; 6])>,
    angles: VecDeque<(f64, f64)>,
    tilts: VecDeque<f64>,
    last_wrench_s: f64,
    last_angle_s: f64,
}

impl Pipeline {
    /// A pipeline that has seen nothing.
    ///
    /// # Errors
    /// [`SignalError::Range`].
    pub fn new(settings: PipelineSettings) -> Result<Self, SignalError> {
        let ClockMap { offset_s, rate } = settings.sensor_from_joint;
        if !(rate > 0.0 && rate.is_finite() && offset_s.is_finite()) {
            return Err(SignalError::Range {
                name: "sensor_from_joint",
                got: rate,
                expected: "a rate above 0",
            });
        }
        if let Some(&got) = settings.offset.components().iter().find(|c| !c.is_finite()) {
            return Err(SignalError::Range { name: "offset", got, expected: "numbers" });
        }
        Ok(Self {
            decimator: Decimator::new(settings.factor)?,
            smoother: Smoother::new(settings.smoothing)?,
            settings,
            waiting: VecDeque::new(),
            angles: VecDeque::new(),
            tilts: VecDeque::new(),
            last_wrench_s: f64::NEG_INFINITY,
            last_angle_s: f64::NEG_INFINITY,
        })
    }

    /// Takes a reading of the sensor, in its own frame and on its own clock; what is ready is appended to `out`.
    ///
    /// # Errors
    /// [`SignalError::Time`] and [`SignalError::Value`]; the reading then is as if it had not come.
    pub fn wrench(&mut self, reading: &Stamped<Wrench>, out: &mut Vec<Aligned>) -> Result<(), SignalError> {
        let values = reading.value.components();
        accept("sensor", reading.t_s, self.last_wrench_s, &values)?;
        self.last_wrench_s = reading.t_s;
        self.waiting.extend(self.decimator.push(reading.t_s, values));
        self.match_up(out);
        Ok(())
    }

    /// Takes a reading of the joint (rad), on its own clock; what is ready is appended to `out`.
    ///
    /// # Errors
    /// As [`Pipeline::wrench`].
    pub fn angle(&mut self, reading: &Stamped<f64>, out: &mut Vec<Aligned>) -> Result<(), SignalError> {
        accept("joint", reading.t_s, self.last_angle_s, &[reading.value])?;
        self.last_angle_s = reading.t_s;
        self.angles.push_back((self.settings.sensor_from_joint.at(reading.t_s), reading.value));
        self.match_up(out);
        Ok(())
    }

    /// Ends both streams: appends what the smoothing still holds.
    pub fn finish(mut self, out: &mut Vec<Aligned>) {
        while let Some(smooth) = self.smoother.finish() {
            self.give(smooth, out);
        }
    }

    /// Pairs what is waiting with angles before and after it.
    fn match_up(&mut self, out: &mut Vec<Aligned>) {
        while let Some(&(t, values)) = self.waiting.front() {
            while self.angles.len() > 1 && self.angles[1].0 < t {
                self.angles.pop_front();
            }
            let Some(&(before, from)) = self.angles.front() else { return };
            if t < before {
                self.waiting.pop_front();
                continue;
            }
            let tilt = match self.angles.get(1) {
                Some(&(after, to)) => from + (to - from) * (t - before) / (after - before),
                None if t == before => from,
                None => return,
            };
            self.waiting.pop_front();
            let mut free = values;
            for (value, offset) in free.iter_mut().zip(self.settings.offset.components()) {
                *value -= offset;
            }
            let world = world_from_body(&wrench_of(free), tilt);
            self.tilts.push_back(tilt);
            if let Some(smooth) = self.smoother.push(t, world.components()) {
                self.give(smooth, out);
            }
        }
    }

    fn give(&mut self, (t_s, channels): (f64, [f64; 6]), out: &mut Vec<Aligned>) {
        if let Some(tilt_rad) = self.tilts.pop_front() {
            out.push(Aligned { t_s, tilt_rad, wrench_in_world: wrench_of(channels) });
        }
    }
}

/// A whole recording at once; the same bits as a [`Pipeline`] that is fed it.
///
/// # Errors
/// As [`Pipeline`].
pub fn batch(
    settings: PipelineSettings,
    sensor: &[Stamped<Wrench>],
    joint: &[Stamped<f64>],
) -> Result<Vec<Aligned>, SignalError> {
    let mut pipeline = Pipeline::new(settings)?;
    let mut out = Vec::with_capacity(sensor.len() / settings.factor.max(1));
    for reading in joint {
        pipeline.angle(reading, &mut out)?;
    }
    for reading in sensor {
        pipeline.wrench(reading, &mut out)?;
    }
    pipeline.finish(&mut out);
    Ok(out)
}

fn wrench_of([a, b, c, d, e, f]: [f64; 6]) -> Wrench {
    Wrench { force_n: [a, b, c], torque_nm: [d, e, f] }
}

fn accept(stream: &'static str, t_s: f64, before: f64, values: &[f64]) -> Result<(), SignalError> {
    if !(t_s > before && t_s.is_finite()) {
        return Err(SignalError::Time { stream, before, got: t_s });
    }
    match values.iter().find(|v| !v.is_finite()) {
        Some(&got) => Err(SignalError::Value { stream, t_s, got }),
        None => Ok(()),
    }
}
