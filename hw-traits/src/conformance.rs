//! The contracts of the traits as tests that a device runs: a fake, a replay or a driver.
//!
//! Each function asks a device for what its trait promises and returns the first promise that it broke. Devices that move are
//! moved, within the range that the caller names. Between a command and the next look at the device `wait` is called, with the
//! device and a duration in s: hardware sleeps there, a fake lets its time pass.
//!
//! A device with a dead-man's rule wants a reading before each command; these functions read before they command.

use std::fmt::Debug;

use crate::arm::{Arm, Pose};
use crate::camera::{Camera, DepthCamera};
use crate::clock::{Clock, Stamped};
use crate::force_torque::ForceTorque;
use crate::gripper::Gripper;
use crate::microphones::Microphones;
use crate::motor::Motor;
use crate::picture::Picture;
use crate::pneumatics::{Pressure, Valve};
use crate::rotary::Rotary;
use crate::{Error, ErrorKind};

/// A promise that a device broke.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{promise}: expected {expected}, received {received}")]
pub struct Broken {
    /// What is promised.
    pub promise: &'static str,
    /// What was expected.
    pub expected: String,
    /// What came.
    pub received: String,
}

/// How often a device that moves is looked at before it counts as stuck, and how long the wait between is, s.
const LOOKS: usize = 2_000;
const LOOK_S: f64 = 0.01;

fn hold(promise: &'static str, kept: bool, expected: impl Debug, received: impl Debug) -> Result<(), Broken> {
    if kept {
        return Ok(());
    }
    Err(Broken { promise, expected: format!("{expected:?}"), received: format!("{received:?}") })
}

fn answered<T, E: Error>(promise: &'static str, answer: Result<T, E>) -> Result<T, Broken> {
    answer.map_err(|e| Broken {
        promise,
        expected: "an answer".into(),
        received: format!("{e:?} ({})", e.kind()),
    })
}

fn refused<E: Error>(promise: &'static str, answer: Result<(), E>) -> Result<(), Broken> {
    let kind = answer.as_ref().err().map(Error::kind);
    hold(promise, kind == Some(ErrorKind::OutOfRange), Some(ErrorKind::OutOfRange), kind)
}

/// Readings that come once, and whose times rise strictly.
fn stream<T, E: Error>(
    count: usize,
    mut next: impl FnMut() -> Result<Stamped<T>, E>,
    mut sound: impl FnMut(&T) -> Result<(), Broken>,
) -> Result<(), Broken> {
    let mut before = f64::NEG_INFINITY;
    for _ in 0..count.max(2) {
        let reading = answered("a reading comes", next())?;
        let rises = reading.t_s > before && reading.t_s.is_finite();
        hold("times rise strictly", rises, format!("above {before}"), reading.t_s)?;
        before = reading.t_s;
        sound(&reading.value)?;
    }
    Ok(())
}

/// [`ForceTorque`]: `readings` readings, a tare, and as many again under the same load, whose mean is within `tolerance` (N, N m) of zero.
///
/// # Errors
/// The first promise that was broken.
pub fn force_torque<D: ForceTorque + ?Sized>(
    device: &mut D,
    readings: usize,
    tolerance: f64,
) -> Result<(), Broken> {
    let finite = |w: &crate::force_torque::Wrench| {
        hold("components are numbers", w.components().iter().all(|v| v.is_finite()), "finite", w)
    };
    stream(readings, || device.read(), finite)?;
    answered("a steady load is taken as zero", device.tare(readings))?;
    let mut sum = [0.0; 6];
    let sum_up = |w: &crate::force_torque::Wrench| {
        sum.iter_mut().zip(w.components()).for_each(|(s, v)| *s += v);
        Ok(())
    };
    stream(readings, || device.read(), sum_up)?;
    let mean = sum.map(|s| s / readings.max(2) as f64);
    hold("after a tare the load is zero", mean.iter().all(|m| m.abs() <= tolerance), tolerance, mean)
}

/// [`Pressure`]: `readings` readings.
///
/// # Errors
/// The first promise that was broken.
pub fn pressure<D: Pressure + ?Sized>(device: &mut D, readings: usize) -> Result<(), Broken> {
    stream(readings, || device.pressure_pa(), |p| hold("a pressure is a number", p.is_finite(), "finite", p))
}

/// [`Valve`]: wrong commands, then closed. `read` is called before each command, for a device that wants a fresh reading.
///
/// # Errors
/// The first promise that was broken.
pub fn valve<D: Valve + ?Sized>(device: &mut D, mut read: impl FnMut(&mut D)) -> Result<(), Broken> {
    for wrong in [f64::NAN, 1.001, -1.001, f64::INFINITY] {
        read(device);
        refused("an opening outside -1 to 1 is refused", device.open(wrong))?;
    }
    for right in [0.0, 0.25, -0.25, 0.0] {
        read(device);
        answered("an opening within -1 to 1 is taken", device.open(right))?;
    }
    Ok(())
}

/// [`Motor`]: wrong commands, then each of `torques_nm`, which is read to within `tolerance_nm` after `readings` readings; zero at the end.
///
/// # Errors
/// The first promise that was broken.
pub fn motor<D: Motor + ?Sized>(
    device: &mut D,
    torques_nm: &[f64],
    readings: usize,
    tolerance_nm: f64,
) -> Result<(), Broken> {
    let limit_nm = device.limit_nm();
    hold("a limit is above zero", limit_nm > 0.0, "above zero", limit_nm)?;
    for wrong in [f64::NAN, 1.001 * limit_nm, -1.001 * limit_nm, f64::INFINITY] {
        answered("a reading comes", device.read())?;
        refused("a torque beyond the limit is refused", device.drive(wrong))?;
    }
    for &torque_nm in torques_nm.iter().chain(&[0.0]) {
        answered("a reading comes", device.read())?;
        answered("a torque within the limit is taken", device.drive(torque_nm))?;
        let mut last_nm = f64::NAN;
        let sound = |r: &crate::motor::MotorReading| {
            last_nm = r.torque_nm;
            let finite = r.angle_rad.is_finite() && r.torque_nm.is_finite();
            hold("an angle and a torque are numbers", finite, "finite", r)
        };
        stream(readings, || device.read(), sound)?;
        let acts = (last_nm - torque_nm).abs() <= tolerance_nm;
        hold("the torque that was commanded acts", acts, torque_nm, last_nm)?;
    }
    Ok(())
}

/// What a device with one axis is asked for, whatever it is called.
struct Axis<'a, D: ?Sized, E> {
    limits: fn(&D) -> (f64, f64),
    command: fn(&mut D, f64, f64) -> Result<(), E>,
    place: fn(&mut D) -> Result<Stamped<f64>, E>,
    settled: fn(&mut D) -> Result<bool, E>,
    wait: &'a mut dyn FnMut(&mut D, f64),
}

impl<D: ?Sized, E: Error> Axis<'_, D, E> {
    fn settle(&mut self, device: &mut D) -> Result<(), Broken> {
        for _ in 0..LOOKS {
            if answered("a device says whether it has settled", (self.settled)(device))? {
                return Ok(());
            }
            (self.wait)(device, LOOK_S);
        }
        hold("a command within the limits is carried out", false, "settled", "still moving")
    }

    fn check(&mut self, device: &mut D, goals: &[f64], speed: f64, tolerance: f64) -> Result<(), Broken> {
        let (low, high) = (self.limits)(device);
        hold("limits are in order", low < high, "low below high", (low, high))?;
        let wrong = [
            (f64::NAN, speed),
            (low - 1.0, speed),
            (high + 1.0, speed),
            (f64::INFINITY, speed),
            (goals.first().copied().unwrap_or(low), 0.0),
            (goals.first().copied().unwrap_or(low), -speed),
            (goals.first().copied().unwrap_or(low), f64::NAN),
        ];
        let before = answered("a place is measured", (self.place)(device))?.value;
        for (goal, speed) in wrong {
            answered("a place is measured", (self.place)(device))?;
            refused("a wrong command is refused", (self.command)(device, goal, speed))?;
        }
        (self.wait)(device, LOOK_S);
        let after = answered("a place is measured", (self.place)(device))?.value;
        let still = (after - before).abs() <= 2.0 * tolerance;
        hold("nothing moves after a refusal", still, before, after)?;
        for &goal in goals {
            answered("a place is measured", (self.place)(device))?;
            answered("a command within the limits is taken", (self.command)(device, goal, speed))?;
            self.settle(device)?;
            let place = answered("a place is measured", (self.place)(device))?.value;
            hold("the place that was commanded is reached", (place - goal).abs() <= tolerance, goal, place)?;
        }
        Ok(())
    }
}

/// [`Rotary`]: wrong commands, then each of `goals_rad` at `rate_rad_s`; angles are right to `tolerance_rad`.
///
/// # Errors
/// The first promise that was broken.
pub fn rotary<D: Rotary + ?Sized>(
    device: &mut D,
    goals_rad: &[f64],
    rate_rad_s: f64,
    tolerance_rad: f64,
    mut wait: impl FnMut(&mut D, f64),
) -> Result<(), Broken> {
    let (limits, settled) = (D::limits_rad, D::settled);
    let mut axis = Axis { limits, command: D::turn_to, place: D::angle_rad, settled, wait: &mut wait };
    axis.check(device, goals_rad, rate_rad_s, tolerance_rad)
}

/// [`Gripper`]: wrong commands, then each of `goals_m` at `speed_m_s`, with nothing between the fingers; widths are right to `tolerance_m`.
///
/// # Errors
/// The first promise that was broken.
pub fn gripper<D: Gripper + ?Sized>(
    device: &mut D,
    goals_m: &[f64],
    speed_m_s: f64,
    tolerance_m: f64,
    mut wait: impl FnMut(&mut D, f64),
) -> Result<(), Broken> {
    let (limits, settled) = (D::limits_m, D::settled);
    let mut axis = Axis { limits, command: D::open_to, place: D::width_m, settled, wait: &mut wait };
    axis.check(device, goals_m, speed_m_s, tolerance_m)
}

/// [`Arm`]: wrong commands, then each of `goals` within `deadline_s`; positions are right to `tolerance_m`.
///
/// # Errors
/// The first promise that was broken.
pub fn arm<D: Arm + ?Sized>(
    device: &mut D,
    goals: &[Pose],
    deadline_s: f64,
    tolerance_m: f64,
    mut wait: impl FnMut(&mut D, f64),
) -> Result<(), Broken> {
    let before = answered("a pose is measured", device.pose())?.value;
    let far = Pose { position_m: [1e3, 0.0, 0.0], ..before };
    let nowhere = Pose { position_m: [f64::NAN, 0.0, 0.0], ..before };
    let turned = Pose { rotation_xyzw: [0.0, 0.0, 0.0, 2.0], ..before };
    for (pose, deadline_s) in
        [(far, deadline_s), (nowhere, -1.0), (turned, deadline_s), (before, 0.0), (before, f64::NAN)]
    {
        answered("a pose is measured", device.pose())?;
        refused("a wrong command is refused", device.move_to(pose, deadline_s))?;
    }
    for goal in goals {
        answered("a pose is measured", device.pose())?;
        answered("a command within reach is taken", device.move_to(*goal, deadline_s))?;
        let mut looks = 0;
        while !answered("an arm says whether it has settled", device.settled())? {
            looks += 1;
            hold("a command within reach is carried out", looks < LOOKS, "settled", "still moving")?;
            wait(device, LOOK_S);
        }
        let pose = answered("a pose is measured", device.pose())?.value;
        let off = pose.position_m.iter().zip(goal.position_m).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        hold("the pose that was commanded is reached", off <= tolerance_m, goal.position_m, pose.position_m)?;
    }
    Ok(())
}

fn same_size<T>(size: &mut Option<(usize, usize)>, picture: &Picture<T>) -> Result<(), Broken> {
    let now = (picture.width(), picture.height());
    let first = *size.get_or_insert(now);
    hold("pictures have one size", first == now, first, now)
}

/// [`Camera`]: `pictures` pictures.
///
/// # Errors
/// The first promise that was broken.
pub fn camera<D: Camera + ?Sized>(device: &mut D, pictures: usize) -> Result<(), Broken> {
    let mut size = None;
    stream(pictures, || device.picture(), |p| same_size(&mut size, p))
}

/// [`DepthCamera`]: `pictures` pictures.
///
/// # Errors
/// The first promise that was broken.
pub fn depth_camera<D: DepthCamera + ?Sized>(device: &mut D, pictures: usize) -> Result<(), Broken> {
    let pinhole = device.intrinsics();
    hold("focal lengths are above zero", pinhole.fx > 0.0 && pinhole.fy > 0.0, "above zero", pinhole)?;
    let mut size = None;
    let sound = |picture: &Picture<f32>| {
        let wrong = picture.data().iter().find(|d| !(d.is_nan() || (**d > 0.0 && d.is_finite())));
        hold("a depth is above zero, or NaN", wrong.is_none(), "above zero or NaN", wrong)?;
        same_size(&mut size, picture)
    };
    stream(pictures, || device.depth_m(), sound)
}

/// [`Microphones`]: `buffers` buffers of `instants` instants.
///
/// # Errors
/// The first promise that was broken.
pub fn microphones<D: Microphones + ?Sized>(
    device: &mut D,
    buffers: usize,
    instants: usize,
) -> Result<(), Broken> {
    let (channels, rate_hz) = (device.channels(), device.rate_hz());
    hold("there is a microphone", channels >= 1, "at least 1", channels)?;
    hold("a rate is above zero", rate_hz > 0.0 && rate_hz.is_finite(), "above zero", rate_hz)?;
    let kind = device.read(&mut vec![0.0; channels - 1]).err().map(|e| e.kind());
    let promise = "a buffer without room for an instant is refused";
    hold(promise, kind == Some(ErrorKind::OutOfRange), Some(ErrorKind::OutOfRange), kind)?;
    let (mut end_s, mut buffer) = (f64::NEG_INFINITY, vec![f32::NAN; channels * instants.max(1)]);
    for _ in 0..buffers.max(2) {
        buffer.fill(f32::NAN);
        let begin_s = answered("a buffer is filled", device.read(&mut buffer))?;
        let later = begin_s >= end_s - 0.5 / rate_hz;
        hold("no sample comes twice", later, format!("not before {end_s}"), begin_s)?;
        end_s = begin_s + instants.max(1) as f64 / rate_hz;
        let wrong = buffer.iter().find(|s| !(-1.0..=1.0).contains(*s));
        hold("samples lie between -1 and 1", wrong.is_none(), "-1 to 1", wrong)?;
    }
    Ok(())
}

/// [`Clock`]: durations that are none, then one of `duration_s`.
///
/// # Errors
/// The first promise that was broken.
pub fn clock<D: Clock + ?Sized>(device: &mut D, duration_s: f64) -> Result<(), Broken> {
    let before = answered("a clock tells the time", device.now_s())?;
    for none in [0.0, -1.0, f64::NAN] {
        answered("a wait that is none returns", device.sleep_s(none))?;
    }
    answered("a clock waits", device.sleep_s(duration_s))?;
    let after = answered("a clock tells the time", device.now_s())?;
    let risen = after - before >= duration_s * (1.0 - 1e-12);
    hold("time has risen by at least the wait", risen, duration_s, after - before)
}
