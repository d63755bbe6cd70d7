//! A bottle that is felt by the simulated wrist: a slow turn for mass and volume, a swing for the viscosity.

use std::f64::consts::PI;

use hw_traits::ErrorKind;
use hw_traits::clock::Clock;
use hw_traits::force_torque::ForceTorque;
use hw_traits::programme::{FeltPose, ProgrammeError, TiltProgramme, run};
use hw_traits::rotary::Rotary;
use liquid_haptics::fake::FakeWrist;
use liquid_haptics::volume::SettledPose;
use liquid_haptics::wrench::{PlanarWrench, world_from_body};

/// The slow turn of a closed bottle: 19 poses, half a second of readings at each.
///
/// # Errors
/// [`ProgrammeError`].
pub fn sweep(wrist: &mut FakeWrist) -> Result<Vec<SettledPose>, ProgrammeError> {
    let programme = TiltProgramme {
        angles_rad: (0..19).map(|k| f64::from(10 * k).to_radians()).collect(),
        rate_rad_s: 0.3,
        settle_s: 20.0,
        patience_s: 10.0,
        readings: 4000,
    };
    let pose = |p: &FeltPose| SettledPose {
        tilt_rad: p.angle_rad,
        wrench: PlanarWrench::from(&world_from_body(&p.wrench, p.angle_rad)),
    };
    Ok(run(wrist, &programme)?.iter().map(pose).collect())
}

/// What a swing from the side to upright lets be felt.
#[derive(Debug, Clone)]
pub struct Swing {
    /// How long the wrist turned, s.
    pub turn_s: f64,
    /// Times since it stands upright (s), and the torques about the joint (N m), each a mean of 78 readings.
    pub times_s: Vec<f64>,
    /// The torques.
    pub torques_nm: Vec<f64>,
}

/// Lies on the side for 20 s, swings upright at once, and feels for 20 s.
///
/// # Errors
/// Those of the wrist.
pub fn swing(wrist: &mut FakeWrist) -> Result<Swing, ErrorKind> {
    let mut turn = |angle: f64, rate: f64, wait_s: f64| -> Result<f64, ErrorKind> {
        wrist.turn_to(angle, rate)?;
        let begin = wrist.now_s()?;
        while !wrist.settled()? {
            wrist.sleep_s(1e-3)?;
        }
        let took = wrist.now_s()? - begin;
        wrist.sleep_s(wait_s)?;
        Ok(took)
    };
    turn(0.5 * PI, 1.0, 20.0)?;
    let turn_s = turn(0.0, PI, 0.0)?;
    let begin = wrist.now_s()?;
    let (mut times_s, mut torques_nm) = (Vec::new(), Vec::new());
    for _ in 0..2000 {
        let (mut t, mut y) = (0.0, 0.0);
        for _ in 0..78 {
            let reading = wrist.read()?;
            t += (reading.t_s - begin) / 78.0;
            y += reading.value.torque_nm[2] / 78.0;
        }
        times_s.push(t);
        torques_nm.push(y);
    }
    Ok(Swing { turn_s, times_s, torques_nm })
}
