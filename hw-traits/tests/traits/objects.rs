//! A device behind a reference, a box or a trait object is a device.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::{Camera, DepthCamera};
use hw_traits::clock::{Clock, Stamped};
use hw_traits::force_torque::{ForceTorque, Wrench};
use hw_traits::gripper::Gripper;
use hw_traits::microphones::Microphones;
use hw_traits::motor::{Motor, MotorReading};
use hw_traits::picture::{Intrinsics, Picture};
use hw_traits::pneumatics::{Pressure, Valve};
use hw_traits::programme::{TiltProgramme, run};
use hw_traits::replay::{RecordedPose, Replay};
use hw_traits::rotary::Rotary;
use hw_traits::{ErrorKind, ErrorType};

const PINHOLE: Intrinsics = Intrinsics { fx: 600.0, fy: 601.0, cx: 320.0, cy: 240.0 };

/// A device of every kind. Each command is remembered as it came, each answer is a number of its own.
#[derive(Default)]
struct Rig {
    commands: Vec<(&'static str, f64, f64)>,
}

fn at<T>(value: T) -> Result<Stamped<T>, ErrorKind> {
    Ok(Stamped { t_s: 0.5, value })
}

impl Rig {
    fn command(&mut self, name: &'static str, one: f64, other: f64) -> Result<(), ErrorKind> {
        self.commands.push((name, one, other));
        Ok(())
    }
}

impl ErrorType for Rig {
    type Error = ErrorKind;
}

impl Arm for Rig {
    fn move_to(&mut self, tool_in_base: Pose, deadline_s: f64) -> Result<(), ErrorKind> {
        self.command("move_to", tool_in_base.position_m[0], deadline_s)
    }
    fn pose(&mut self) -> Result<Stamped<Pose>, ErrorKind> {
        at(Pose { position_m: [1.0; 3], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] })
    }
    fn settled(&mut self) -> Result<bool, ErrorKind> {
        Ok(true)
    }
}

impl Camera for Rig {
    fn picture(&mut self) -> Result<Stamped<Picture<u8>>, ErrorKind> {
        at(Picture::new(1, vec![2]).unwrap())
    }
}

impl DepthCamera for Rig {
    fn intrinsics(&self) -> Intrinsics {
        PINHOLE
    }
    fn depth_m(&mut self) -> Result<Stamped<Picture<f32>>, ErrorKind> {
        at(Picture::new(1, vec![3.0]).unwrap())
    }
}

impl Clock for Rig {
    fn now_s(&mut self) -> Result<f64, ErrorKind> {
        Ok(4.0)
    }
    fn sleep_s(&mut self, duration_s: f64) -> Result<(), ErrorKind> {
        self.command("sleep_s", duration_s, 0.0)
    }
}

impl ForceTorque for Rig {
    fn read(&mut self) -> Result<Stamped<Wrench>, ErrorKind> {
        at(Wrench { force_n: [5.0; 3], torque_nm: [0.0; 3] })
    }
    fn tare(&mut self, readings: usize) -> Result<(), ErrorKind> {
        self.command("tare", readings as f64, 0.0)
    }
}

impl Gripper for Rig {
    fn limits_m(&self) -> (f64, f64) {
        (0.0, 6.0)
    }
    fn open_to(&mut self, width_m: f64, speed_m_s: f64) -> Result<(), ErrorKind> {
        self.command("open_to", width_m, speed_m_s)
    }
    fn width_m(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        at(7.0)
    }
    fn settled(&mut self) -> Result<bool, ErrorKind> {
        Ok(false)
    }
}

impl Microphones for Rig {
    fn channels(&self) -> usize {
        8
    }
    fn rate_hz(&self) -> f64 {
        9.0
    }
    fn read(&mut self, interleaved: &mut [f32]) -> Result<f64, ErrorKind> {
        interleaved.fill(10.0);
        Ok(11.0)
    }
}

impl Motor for Rig {
    fn limit_nm(&self) -> f64 {
        15.0
    }
    fn drive(&mut self, torque_nm: f64) -> Result<(), ErrorKind> {
        self.command("drive", torque_nm, 0.0)
    }
    fn read(&mut self) -> Result<Stamped<MotorReading>, ErrorKind> {
        at(MotorReading { angle_rad: 16.0, torque_nm: 17.0 })
    }
}

impl Pressure for Rig {
    fn pressure_pa(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        at(12.0)
    }
}

impl Valve for Rig {
    fn open(&mut self, fraction: f64) -> Result<(), ErrorKind> {
        self.command("open", fraction, 0.0)
    }
}

impl Rotary for Rig {
    fn limits_rad(&self) -> (f64, f64) {
        (0.0, 13.0)
    }
    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), ErrorKind> {
        self.command("turn_to", angle_rad, rate_rad_s)
    }
    fn angle_rad(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        at(14.0)
    }
    fn settled(&mut self) -> Result<bool, ErrorKind> {
        Err(ErrorKind::Link)
    }
}

/// The same, for the rig itself, for a reference to it, for a box of it, and for trait objects.
macro_rules! everywhere {
    ($Trait:ident, |$device:ident| $body:block, $commands:expr) => {{
        fn ask<D: $Trait + ErrorType<Error = ErrorKind>>(mut $device: D) $body
        let mut rig = Rig::default();
        ask(&mut rig);
        ask::<&mut dyn $Trait<Error = ErrorKind>>(&mut rig);
        ask(Box::new(&mut rig));
        ask(Box::new(&mut rig) as Box<dyn $Trait<Error = ErrorKind> + '_>);
        let expected: &[(&str, f64, f64)] = $commands;
        assert_eq!(rig.commands, [expected, expected, expected, expected].concat());
        let owned: Box<dyn $Trait<Error = ErrorKind> + Send> = Box::new(Rig::default());
        ask(owned);
    }};
}

#[test]
fn every_trait_is_object_safe_and_its_objects_are_devices() {
    everywhere!(
        Arm,
        |d| {
            let pose = d.pose().unwrap().value;
            assert_eq!(pose.position_m, [1.0; 3]);
            d.move_to(pose, 2.0).unwrap();
            assert_eq!(d.settled(), Ok(true));
        },
        &[("move_to", 1.0, 2.0)]
    );
    everywhere!(Camera, |d| { assert_eq!(d.picture().unwrap().value.data(), [2]) }, &[]);
    everywhere!(
        DepthCamera,
        |d| {
            assert_eq!(d.intrinsics(), PINHOLE);
            assert_eq!(d.depth_m().unwrap().value.data(), [3.0]);
        },
        &[]
    );
    everywhere!(
        Clock,
        |d| {
            assert_eq!(d.now_s(), Ok(4.0));
            d.sleep_s(0.25).unwrap();
        },
        &[("sleep_s", 0.25, 0.0)]
    );
    everywhere!(
        ForceTorque,
        |d| {
            d.tare(6).unwrap();
            assert_eq!(d.read().unwrap().value.force_n, [5.0; 3]);
        },
        &[("tare", 6.0, 0.0)]
    );
    everywhere!(
        Gripper,
        |d| {
            assert_eq!((d.limits_m(), d.width_m().unwrap().value), ((0.0, 6.0), 7.0));
            d.open_to(0.1, 0.2).unwrap();
            assert_eq!(d.settled(), Ok(false));
        },
        &[("open_to", 0.1, 0.2)]
    );
    everywhere!(
        Microphones,
        |d| {
            let mut samples = [0.0; 8];
            assert_eq!((d.channels(), d.rate_hz(), d.read(&mut samples)), (8, 9.0, Ok(11.0)));
            assert_eq!(samples, [10.0; 8]);
        },
        &[]
    );
    everywhere!(
        Motor,
        |d| {
            let said = d.read().unwrap().value;
            assert_eq!((d.limit_nm(), said.angle_rad, said.torque_nm), (15.0, 16.0, 17.0));
            d.drive(-0.5).unwrap();
        },
        &[("drive", -0.5, 0.0)]
    );
    everywhere!(Pressure, |d| { assert_eq!(d.pressure_pa().unwrap().value, 12.0) }, &[]);
    everywhere!(Valve, |d| { d.open(-0.5).unwrap() }, &[("open", -0.5, 0.0)]);
    everywhere!(
        Rotary,
        |d| {
            assert_eq!((d.limits_rad(), d.angle_rad().unwrap().value), ((0.0, 13.0), 14.0));
            d.turn_to(0.3, 0.4).unwrap();
            assert_eq!(d.settled(), Err(ErrorKind::Link));
        },
        &[("turn_to", 0.3, 0.4)]
    );
}

/// Several traits in one object, as a program has them that chooses its rig as it runs.
trait Wrist: Rotary + ForceTorque + Clock {}
impl<T: Rotary + ForceTorque + Clock> Wrist for T {}

#[test]
fn a_driver_runs_on_a_rig_that_is_chosen_as_the_program_runs() {
    let readings = (0..3).map(|i| Stamped { t_s: f64::from(i), value: Wrench::default() }).collect();
    let recording = Replay::new(vec![RecordedPose { angle_rad: 0.2, readings }], 1e-3);
    let programme =
        TiltProgramme { angles_rad: vec![0.2], rate_rad_s: 1.0, settle_s: 0.0, patience_s: 1.0, readings: 3 };
    let mut rig: Box<dyn Wrist<Error = ErrorKind>> = Box::new(recording.clone());
    assert_eq!(run(&mut rig, &programme).unwrap().len(), 1);
    let mut unboxed = recording;
    let object: &mut dyn Wrist<Error = ErrorKind> = &mut unboxed;
    assert_eq!(run(object, &programme).unwrap().len(), 1);
}
