//! A recorded rig: the same traits, answered from what was measured once.
//!
//! A [`Replay`] holds a list of poses in the order in which they were taken, each with the readings at it. A driver that was
//! written for hardware runs on it unchanged, as long as it asks for what was recorded: the angles in their order, and no more
//! readings than there are.

use crate::clock::{Clock, Stamped};
use crate::force_torque::{ForceTorque, Wrench};
use crate::rotary::Rotary;
use crate::{ErrorKind, ErrorType};

/// What was measured at one angle.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedPose {
    /// The angle, rad.
    pub angle_rad: f64,
    /// The readings, in the sensor's frame; their times rise.
    pub readings: Vec<Stamped<Wrench>>,
}

/// Plays a list of poses back; implements [`Rotary`], [`ForceTorque`] and [`Clock`].
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    poses: Vec<RecordedPose>,
    tolerance_rad: f64,
    /// The pose that was commanded last, and how many of its readings are used up.
    at: Option<(usize, usize)>,
    now_s: f64,
    offset: Wrench,
}

impl Replay {
    /// Plays `poses` back; a commanded angle may differ from the recorded one by `tolerance_rad`.
    pub fn new(poses: Vec<RecordedPose>, tolerance_rad: f64) -> Self {
        Self { poses, tolerance_rad, at: None, now_s: 0.0, offset: Wrench::default() }
    }

    /// Goes back to the beginning, as if nothing had been asked.
    pub fn rewind(&mut self) {
        (self.at, self.now_s, self.offset) = (None, 0.0, Wrench::default());
    }

    fn next_raw(&mut self) -> Result<Stamped<Wrench>, ErrorKind> {
        let (pose, used) = self.at.unwrap_or((0, 0));
        let reading =
            self.poses.get(pose).and_then(|p| p.readings.get(used)).ok_or(ErrorKind::EndOfRecording)?;
        self.at = Some((pose, used + 1));
        self.now_s = self.now_s.max(reading.t_s);
        Ok(*reading)
    }
}

impl ErrorType for Replay {
    type Error = ErrorKind;
}

impl Rotary for Replay {
    fn limits_rad(&self) -> (f64, f64) {
        let angles = self.poses.iter().map(|p| p.angle_rad);
        angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), a| {
            (low.min(a - self.tolerance_rad), high.max(a + self.tolerance_rad))
        })
    }

    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), ErrorKind> {
        let (low, high) = self.limits_rad();
        if !((low..=high).contains(&angle_rad) && rate_rad_s > 0.0) {
            return Err(ErrorKind::OutOfRange);
        }
        let next = self.at.map_or(0, |(pose, _)| pose + 1);
        let pose = self.poses.get(next).ok_or(ErrorKind::EndOfRecording)?;
        if (pose.angle_rad - angle_rad).abs() > self.tolerance_rad {
            return Err(ErrorKind::NotAsRecorded);
        }
        self.at = Some((next, 0));
        if let Some(first) = pose.readings.first() {
            self.now_s = self.now_s.max(first.t_s);
        }
        Ok(())
    }

    fn angle_rad(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        let (pose, _) = self.at.unwrap_or((0, 0));
        let pose = self.poses.get(pose).ok_or(ErrorKind::EndOfRecording)?;
        Ok(Stamped { t_s: self.now_s, value: pose.angle_rad })
    }

    fn settled(&mut self) -> Result<bool, ErrorKind> {
        Ok(true)
    }
}

impl ForceTorque for Replay {
    fn read(&mut self) -> Result<Stamped<Wrench>, ErrorKind> {
        let raw = self.next_raw()?;
        Ok(Stamped { t_s: raw.t_s, value: raw.value.plus(&self.offset) })
    }

    fn tare(&mut self, readings: usize) -> Result<(), ErrorKind> {
        let mut sum = Wrench::default();
        for _ in 0..readings.max(1) {
            sum = sum.plus(&self.next_raw()?.value);
        }
        self.offset = sum.scaled(-1.0 / readings.max(1) as f64);
        Ok(())
    }
}

/// Time is that of the last reading: waiting costs none.
impl Clock for Replay {
    fn now_s(&mut self) -> Result<f64, ErrorKind> {
        Ok(self.now_s)
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), ErrorKind> {
        if duration_s > 0.0 {
            self.now_s += duration_s;
        }
        Ok(())
    }
}
