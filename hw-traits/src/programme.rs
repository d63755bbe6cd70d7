//! The tilt programme: turn, wait, read, at one angle after the other, on any rig.

use crate::clock::Clock;
use crate::force_torque::{ForceTorque, Wrench};
use crate::rotary::Rotary;
use crate::{Error, ErrorKind};

/// What to do at which angles.
#[derive(Debug, Clone, PartialEq)]
pub struct TiltProgramme {
    /// The angles in rad, in order.
    pub angles_rad: Vec<f64>,
    /// The fastest that the wrist may turn, rad/s.
    pub rate_rad_s: f64,
    /// How long to wait after the wrist stands still, s.
    pub settle_s: f64,
    /// The longest time to wait for the wrist, s.
    pub patience_s: f64,
    /// Readings at each pose, at least 1.
    pub readings: usize,
}

/// What was felt at one pose, in the sensor's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeltPose {
    /// The measured angle, rad.
    pub angle_rad: f64,
    /// Mean wrench over the readings.
    pub wrench: Wrench,
    /// Standard error of each component of that mean, forces first; NaN of a single reading.
    pub standard_error: [f64; 6],
    /// How many readings were averaged.
    pub readings: usize,
}

/// Where and why a programme ended early; what was felt until then is kept.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("pose {pose} at {angle_rad} rad: {kind}")]
pub struct ProgrammeError {
    /// Number of the pose, from 0.
    pub pose: usize,
    /// The pose's commanded angle, rad.
    pub angle_rad: f64,
    /// What went wrong.
    pub kind: ErrorKind,
    /// The poses before it.
    pub felt: Vec<FeltPose>,
}

/// Runs a programme on a rig that turns, feels and keeps time.
///
/// # Errors
/// [`ProgrammeError`] at the first device error; [`ErrorKind::Timeout`] where the wrist does not settle within the patience.
pub fn run<R: Rotary + ForceTorque + Clock + ?Sized>(
    rig: &mut R,
    programme: &TiltProgramme,
) -> Result<Vec<FeltPose>, ProgrammeError> {
    let mut felt = Vec::with_capacity(programme.angles_rad.len());
    for (pose, &angle_rad) in programme.angles_rad.iter().enumerate() {
        match feel(rig, programme, angle_rad) {
            Ok(one) => felt.push(one),
            Err(kind) => return Err(ProgrammeError { pose, angle_rad, kind, felt }),
        }
    }
    Ok(felt)
}

fn feel<R: Rotary + ForceTorque + Clock + ?Sized>(
    rig: &mut R,
    programme: &TiltProgramme,
    angle_rad: f64,
) -> Result<FeltPose, ErrorKind> {
    rig.turn_to(angle_rad, programme.rate_rad_s).map_err(|e| e.kind())?;
    let begin = rig.now_s().map_err(|e| e.kind())?;
    while !rig.settled().map_err(|e| e.kind())? {
        if rig.now_s().map_err(|e| e.kind())? - begin > programme.patience_s {
            return Err(ErrorKind::Timeout);
        }
        rig.sleep_s(0.01).map_err(|e| e.kind())?;
    }
    rig.sleep_s(programme.settle_s).map_err(|e| e.kind())?;
    rig.skip().map_err(|e| e.kind())?;
    let count = programme.readings.max(1);
    let (mut mean, mut squares) = ([0.0; 6], [0.0; 6]);
    for n in 1..=count {
        let reading = rig.read().map_err(|e| e.kind())?.value.components();
        // Welford 1962, doi:10.1080/00401706.1962.10490022.
        for ((mean, square), value) in mean.iter_mut().zip(&mut squares).zip(reading) {
            let off = value - *mean;
            *mean += off / n as f64;
            *square += off * (value - *mean);
        }
    }
    let n = count as f64;
    let [a, b, c, d, e, f] = mean;
    Ok(FeltPose {
        angle_rad: rig.angle_rad().map_err(|e| e.kind())?.value,
        wrench: Wrench { force_n: [a, b, c], torque_nm: [d, e, f] },
        standard_error: squares.map(|s| if count > 1 { (s / (n - 1.0) / n).sqrt() } else { f64::NAN }),
        readings: count,
    })
}
