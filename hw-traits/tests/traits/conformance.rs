//! A device of every kind passes the contracts, its recording passes them too, and each broken promise is found.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::cell::RefCell;
use std::rc::Rc;

use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::{Camera, DepthCamera};
use hw_traits::clock::{Clock, Stamped};
use hw_traits::conformance::{self as contract, Broken};
use hw_traits::force_torque::{ForceTorque, Wrench};
use hw_traits::gripper::Gripper;
use hw_traits::microphones::Microphones;
use hw_traits::motor::{Motor, MotorReading};
use hw_traits::picture::{Intrinsics, Picture};
use hw_traits::pneumatics::{Pressure, Valve};
use hw_traits::rotary::Rotary;
use hw_traits::tape::{Event, Playback, Recorder, Stream};
use hw_traits::{ErrorKind, ErrorType, Severity};

/// What a device does wrong.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    Nothing,
    TimeStands,
    TakesEverything,
    NeverArrives,
    ArrivesElsewhere,
    ForgetsTheTare,
    NoDepth,
    Powerless,
    TwiceHeard,
    Sleepless,
}

/// One axis that creeps to its goal, a sensor, pictures and sound.
struct Device {
    fault: Fault,
    now_s: f64,
    place: f64,
    goal: f64,
    tared: f64,
    torque_nm: f64,
    heard: usize,
}

impl Device {
    fn new(fault: Fault) -> Self {
        Self { fault, now_s: 1.0, place: 0.2, goal: 0.2, tared: 0.0, torque_nm: 0.0, heard: 0 }
    }

    fn at<T>(&mut self, value: T) -> Result<Stamped<T>, ErrorKind> {
        if self.fault != Fault::TimeStands {
            self.now_s += 1e-3;
        }
        Ok(Stamped { t_s: self.now_s, value })
    }

    fn go(&mut self, goal: f64, speed: f64) -> Result<(), ErrorKind> {
        if self.fault != Fault::TakesEverything && !((0.0..=1.0).contains(&goal) && speed > 0.0) {
            return Err(ErrorKind::OutOfRange);
        }
        self.goal = if self.fault == Fault::ArrivesElsewhere { 0.5 * goal } else { goal };
        Ok(())
    }

    fn arrived(&mut self) -> Result<bool, ErrorKind> {
        if self.fault != Fault::NeverArrives {
            self.place += (self.goal - self.place).clamp(-0.1, 0.1);
        }
        Ok(self.place == self.goal)
    }
}

impl ErrorType for Device {
    type Error = ErrorKind;
}
impl ForceTorque for Device {
    fn read(&mut self) -> Result<Stamped<Wrench>, ErrorKind> {
        let value = Wrench { force_n: [0.0, 0.0, -7.0 - self.tared], ..Wrench::default() };
        self.at(value)
    }
    fn tare(&mut self, _: usize) -> Result<(), ErrorKind> {
        self.tared = if self.fault == Fault::ForgetsTheTare { 0.0 } else { -7.0 };
        Ok(())
    }
}
impl Rotary for Device {
    fn limits_rad(&self) -> (f64, f64) {
        (0.0, 1.0)
    }
    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), ErrorKind> {
        self.go(angle_rad, rate_rad_s)
    }
    fn angle_rad(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        self.at(self.place)
    }
    fn settled(&mut self) -> Result<bool, ErrorKind> {
        self.arrived()
    }
}
impl Gripper for Device {
    fn limits_m(&self) -> (f64, f64) {
        (0.0, 1.0)
    }
    fn open_to(&mut self, width_m: f64, speed_m_s: f64) -> Result<(), ErrorKind> {
        self.go(width_m, speed_m_s)
    }
    fn width_m(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        self.at(self.place)
    }
    fn settled(&mut self) -> Result<bool, ErrorKind> {
        self.arrived()
    }
}
impl Arm for Device {
    fn move_to(&mut self, tool_in_base: Pose, deadline_s: f64) -> Result<(), ErrorKind> {
        let turned = (tool_in_base.rotation_xyzw.iter().map(|q| q * q).sum::<f64>() - 1.0).abs() > 1e-6;
        self.go(if turned { f64::NAN } else { tool_in_base.position_m[0] }, deadline_s)
    }
    fn pose(&mut self) -> Result<Stamped<Pose>, ErrorKind> {
        self.at(Pose { position_m: [self.place, 0.0, 0.0], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] })
    }
    fn settled(&mut self) -> Result<bool, ErrorKind> {
        self.arrived()
    }
}
impl Motor for Device {
    fn limit_nm(&self) -> f64 {
        2.0
    }
    fn drive(&mut self, torque_nm: f64) -> Result<(), ErrorKind> {
        if torque_nm.is_nan() || torque_nm.abs() > 2.0 {
            return Err(ErrorKind::OutOfRange);
        }
        self.torque_nm = if self.fault == Fault::Powerless { 0.0 } else { torque_nm };
        Ok(())
    }
    fn read(&mut self) -> Result<Stamped<MotorReading>, ErrorKind> {
        self.at(MotorReading { angle_rad: self.place, torque_nm: self.torque_nm })
    }
}
impl Pressure for Device {
    fn pressure_pa(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        self.at(1e3)
    }
}
impl Valve for Device {
    fn open(&mut self, fraction: f64) -> Result<(), ErrorKind> {
        self.go(0.5 * (fraction + 1.0), 1.0)
    }
}
impl Camera for Device {
    fn picture(&mut self) -> Result<Stamped<Picture<u8>>, ErrorKind> {
        self.at(Picture::new(2, vec![1, 2, 3, 4]).unwrap())
    }
}
impl DepthCamera for Device {
    fn intrinsics(&self) -> Intrinsics {
        Intrinsics { fx: 600.0, fy: 600.0, cx: 1.0, cy: 1.0 }
    }
    fn depth_m(&mut self) -> Result<Stamped<Picture<f32>>, ErrorKind> {
        let blind = if self.fault == Fault::NoDepth { 0.0 } else { f32::NAN };
        self.at(Picture::new(2, vec![0.5, blind]).unwrap())
    }
}
impl Microphones for Device {
    fn channels(&self) -> usize {
        2
    }
    fn rate_hz(&self) -> f64 {
        100.0
    }
    fn read(&mut self, interleaved: &mut [f32]) -> Result<f64, ErrorKind> {
        let instants = interleaved.len() / 2;
        if instants == 0 {
            return Err(ErrorKind::OutOfRange);
        }
        for (k, sample) in interleaved.iter_mut().enumerate() {
            *sample = (self.heard * 2 + k) as f32 / 1000.0;
        }
        let begin_s = self.heard as f64 / 100.0;
        if self.fault != Fault::TwiceHeard {
            self.heard += instants;
        }
        Ok(begin_s)
    }
}
impl Clock for Device {
    fn now_s(&mut self) -> Result<f64, ErrorKind> {
        Ok(self.now_s)
    }
    fn sleep_s(&mut self, duration_s: f64) -> Result<(), ErrorKind> {
        if duration_s > 0.0 && self.fault != Fault::Sleepless {
            self.now_s += duration_s;
        }
        Ok(())
    }
}

trait Everything:
    ForceTorque + Rotary + Gripper + Arm + Pressure + Valve + Camera + DepthCamera + Microphones + Motor + Clock
{
}
impl<
    T: ForceTorque
        + Rotary
        + Gripper
        + Arm
        + Pressure
        + Valve
        + Camera
        + DepthCamera
        + Microphones
        + Motor
        + Clock,
> Everything for T
{
}

fn contracts<D: Everything>(device: &mut D) -> Result<(), Broken> {
    let goal = Pose { position_m: [0.7, 0.0, 0.0], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
    contract::force_torque(device, 5, 1e-9)?;
    contract::rotary(device, &[0.9, 0.1], 1.0, 1e-9, |_, _| ())?;
    contract::gripper(device, &[0.4], 1.0, 1e-9, |_, _| ())?;
    contract::arm(device, &[goal], 1.0, 1e-9, |_, _| ())?;
    contract::motor(device, &[1.5, -2.0], 3, 1e-9)?;
    contract::pressure(device, 3)?;
    contract::valve(device, |d| drop(d.pressure_pa()))?;
    contract::camera(device, 3)?;
    contract::depth_camera(device, 3)?;
    contract::microphones(device, 3, 4)?;
    contract::clock(device, 0.5)
}

fn recorded(fault: Fault) -> (Result<(), Broken>, Vec<Event>) {
    let events = Rc::new(RefCell::new(Vec::new()));
    let sink = events.clone();
    let mut recorder = Recorder::new(Device::new(fault), move |event| sink.borrow_mut().push(event));
    let kept = contracts(&mut recorder);
    drop(recorder);
    (kept, events.take())
}

#[test]
fn a_device_keeps_its_promises_and_so_does_its_recording() {
    assert_eq!(contracts(&mut Device::new(Fault::Nothing)), Ok(()));
    let (kept, events) = recorded(Fault::Nothing);
    assert_eq!(kept, Ok(()));
    let mut playback = Playback::new(events, 1e-9);
    assert_eq!(contracts(&mut playback), Ok(()));
    assert!(playback.has_ended());
    assert_eq!(Gripper::open_to(&mut playback, 0.5, 1.0), Err(ErrorKind::EndOfRecording));
}

#[test]
fn each_broken_promise_is_found_on_the_device_and_on_its_recording() {
    for (fault, promise) in [
        (Fault::TimeStands, "times rise strictly"),
        (Fault::TakesEverything, "a wrong command is refused"),
        (Fault::NeverArrives, "a command within the limits is carried out"),
        (Fault::ArrivesElsewhere, "the place that was commanded is reached"),
        (Fault::ForgetsTheTare, "after a tare the load is zero"),
        (Fault::Powerless, "the torque that was commanded acts"),
        (Fault::NoDepth, "a depth is above zero, or NaN"),
        (Fault::TwiceHeard, "no sample comes twice"),
        (Fault::Sleepless, "time has risen by at least the wait"),
    ] {
        let (kept, events) = recorded(fault);
        assert_eq!(kept.unwrap_err().promise, promise);
        // Waiting is not on a recording.
        if fault != Fault::Sleepless {
            assert_eq!(contracts(&mut Playback::new(events, 1e-9)).unwrap_err().promise, promise);
        }
    }
}

#[test]
fn a_playback_wants_the_recorded_commands_and_gives_each_reading_once() {
    let events = Rc::new(RefCell::new(Vec::new()));
    let sink = events.clone();
    let mut device = Recorder::new(Device::new(Fault::Nothing), move |event| sink.borrow_mut().push(event));
    ForceTorque::read(&mut device).unwrap();
    device.turn_to(0.5, 1.0).unwrap();
    while !Rotary::settled(&mut device).unwrap() {}
    let reached = device.angle_rad().unwrap();
    drop(device);
    let mut events = events.take();
    events.push(Event::Failed { stream: Stream::Wrench, kind: ErrorKind::Saturated });

    let mut playback = Playback::new(events, 0.01);
    assert_eq!(playback.limits_rad(), (0.0, 1.0));
    assert_eq!(playback.angle_rad().map(|a| a.value), Err(ErrorKind::EndOfRecording));
    assert_eq!(ForceTorque::read(&mut playback).unwrap().value.force_n[2], -7.0);
    assert_eq!(ForceTorque::read(&mut playback).map(|r| r.t_s), Err(ErrorKind::EndOfRecording));
    assert_eq!(playback.turn_to(0.6, 1.0), Err(ErrorKind::NotAsRecorded));
    assert_eq!(playback.open(0.5), Err(ErrorKind::NotAsRecorded));
    playback.turn_to(0.505, 1.0).unwrap();
    let looks = (0..10).take_while(|_| !Rotary::settled(&mut playback).unwrap()).count();
    assert_eq!(looks, 2);
    assert_eq!((playback.angle_rad(), playback.angle_rad()), (Ok(reached), Ok(reached)));
    assert_eq!(playback.now_s(), Ok(reached.t_s));
    assert_eq!(ForceTorque::read(&mut playback).map(|r| r.t_s), Err(ErrorKind::Saturated));
}

#[test]
fn sound_is_played_in_buffers_of_any_length_and_gaps_stay() {
    let samples = |t_s: f64, first: f32| {
        let value = (0..8).map(|k| first + k as f32 / 100.0).collect();
        Event::Reading(hw_traits::tape::Reading::Samples(Stamped { t_s, value }))
    };
    let facts = Event::Fact(hw_traits::tape::Fact::Microphones(2, 100.0));
    let mut playback = Playback::new([facts, samples(0.0, 0.0), samples(0.04, 0.08), samples(1.0, 0.5)], 0.0);
    let mut buffer = [0.0; 6];
    assert_eq!(Microphones::read(&mut playback, &mut buffer), Ok(0.0));
    assert_eq!(Microphones::read(&mut playback, &mut buffer), Ok(0.03));
    assert!((buffer[5] - 0.11).abs() < 1e-6);
    // Two instants are left before the gap: they fill no buffer of three.
    assert_eq!(Microphones::read(&mut playback, &mut buffer), Ok(1.0));
    assert_eq!(Microphones::read(&mut playback, &mut buffer), Err(ErrorKind::EndOfRecording));
}

#[test]
fn every_kind_of_error_says_what_can_be_done() {
    use ErrorKind as K;
    for kind in [K::Link, K::Timeout, K::Stale] {
        assert_eq!(kind.severity(), Severity::Transient);
    }
    for kind in [K::OutOfRange, K::Saturated] {
        assert_eq!(kind.severity(), Severity::Limit);
    }
    for kind in [K::Stopped, K::EndOfRecording, K::NotAsRecorded, K::Other] {
        assert_eq!(kind.severity(), Severity::Fatal);
    }
}

/// Through a file, a recording still keeps its promises; a file that ends within an event holds those before it.
#[cfg(feature = "tape-file")]
#[test]
fn a_tape_is_the_same_from_a_file_and_a_file_that_is_cut_holds_what_came_before() {
    use hw_traits::tape::{TapeError, read_tape, write_event};
    let (_, events) = recorded(Fault::Nothing);
    let mut bytes = Vec::new();
    events.iter().for_each(|event| write_event(event, &mut bytes).unwrap());
    let tape = read_tape(&bytes[..]).unwrap();
    // NaN (commands that were refused, depths that are missing) equals nothing, so words are compared.
    assert_eq!(format!("{:?}", tape.events), format!("{events:?}"));
    assert!(!tape.cut);
    assert_eq!(contracts(&mut Playback::new(tape.events, 1e-9)), Ok(()));
    let cut = read_tape(&bytes[..bytes.len() - 1]).unwrap();
    assert!(cut.cut && cut.events.len() == events.len() - 1);
    assert!(matches!(read_tape(&b"\x01"[..]), Err(TapeError::NoEvent { number: 0, .. })));
}
