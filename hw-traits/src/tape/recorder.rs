use super::event::{Command, Event, Fact, Reading, Stream};
use crate::arm::{Arm, Pose};
use crate::camera::{Camera, DepthCamera};
use crate::clock::{Clock, Stamped};
use crate::force_torque::{ForceTorque, Wrench};
use crate::gripper::Gripper;
use crate::microphones::Microphones;
use crate::motor::{Motor, MotorReading};
use crate::picture::{Intrinsics, Picture};
use crate::pneumatics::{Pressure, Valve};
use crate::rotary::Rotary;
use crate::{Error, ErrorType};

/// A device, and one who is told of everything that passes.
///
/// It has each trait that the device has. Facts are recorded once, when the recorder is asked for the first reading or command.
#[derive(Debug, Clone)]
pub struct Recorder<D, S> {
    device: D,
    sink: S,
    recorded: [bool; 5],
}

impl<D, S: FnMut(Event)> Recorder<D, S> {
    /// Tells `sink` of all that passes to and from `device`.
    pub fn new(device: D, sink: S) -> Self {
        Self { device, sink, recorded: [false; 5] }
    }

    /// The device, and the sink.
    pub fn into_parts(self) -> (D, S) {
        (self.device, self.sink)
    }

    fn fact(&mut self, fact: Fact) {
        let number = match fact {
            Fact::LimitsRad(..) => 0,
            Fact::LimitsM(..) => 1,
            Fact::Microphones(..) => 2,
            Fact::Intrinsics(_) => 3,
            Fact::LimitNm(_) => 4,
        };
        if !std::mem::replace(&mut self.recorded[number], true) {
            (self.sink)(Event::Fact(fact));
        }
    }

    fn command<E: Error>(&mut self, command: Command, answer: Result<(), E>) -> Result<(), E> {
        let refused = answer.as_ref().err().map(Error::kind);
        (self.sink)(Event::Command { command, refused });
        answer
    }

    fn answer<T: Clone, E: Error>(
        &mut self,
        stream: Stream,
        answer: Result<T, E>,
        reading: impl FnOnce(T) -> Reading,
    ) -> Result<T, E> {
        (self.sink)(match &answer {
            Ok(value) => Event::Reading(reading(value.clone())),
            Err(error) => Event::Failed { stream, kind: error.kind() },
        });
        answer
    }
}

impl<D: ErrorType, S> ErrorType for Recorder<D, S> {
    type Error = D::Error;
}

impl<D: ForceTorque, S: FnMut(Event)> ForceTorque for Recorder<D, S> {
    fn read(&mut self) -> Result<Stamped<Wrench>, Self::Error> {
        let answer = self.device.read();
        self.answer(Stream::Wrench, answer, Reading::Wrench)
    }

    fn tare(&mut self, readings: usize) -> Result<(), Self::Error> {
        let answer = self.device.tare(readings);
        self.command(Command::Tare(readings), answer)
    }

    /// What is left out is not on the tape.
    fn skip(&mut self) -> Result<(), Self::Error> {
        self.device.skip()
    }
}

impl<D: Rotary, S: FnMut(Event)> Rotary for Recorder<D, S> {
    fn limits_rad(&self) -> (f64, f64) {
        self.device.limits_rad()
    }

    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), Self::Error> {
        let (low, high) = self.device.limits_rad();
        self.fact(Fact::LimitsRad(low, high));
        let answer = self.device.turn_to(angle_rad, rate_rad_s);
        self.command(Command::TurnTo(angle_rad, rate_rad_s), answer)
    }

    fn angle_rad(&mut self) -> Result<Stamped<f64>, Self::Error> {
        let answer = self.device.angle_rad();
        self.answer(Stream::Angle, answer, Reading::AngleRad)
    }

    fn settled(&mut self) -> Result<bool, Self::Error> {
        let answer = self.device.settled();
        self.answer(Stream::Settled, answer, Reading::Settled)
    }
}

impl<D: Gripper, S: FnMut(Event)> Gripper for Recorder<D, S> {
    fn limits_m(&self) -> (f64, f64) {
        self.device.limits_m()
    }

    fn open_to(&mut self, width_m: f64, speed_m_s: f64) -> Result<(), Self::Error> {
        let (low, high) = self.device.limits_m();
        self.fact(Fact::LimitsM(low, high));
        let answer = self.device.open_to(width_m, speed_m_s);
        self.command(Command::OpenTo(width_m, speed_m_s), answer)
    }

    fn width_m(&mut self) -> Result<Stamped<f64>, Self::Error> {
        let answer = self.device.width_m();
        self.answer(Stream::Width, answer, Reading::WidthM)
    }

    fn settled(&mut self) -> Result<bool, Self::Error> {
        let answer = self.device.settled();
        self.answer(Stream::Settled, answer, Reading::Settled)
    }
}

impl<D: Arm, S: FnMut(Event)> Arm for Recorder<D, S> {
    fn move_to(&mut self, tool_in_base: Pose, deadline_s: f64) -> Result<(), Self::Error> {
        let answer = self.device.move_to(tool_in_base, deadline_s);
        self.command(Command::MoveTo(tool_in_base, deadline_s), answer)
    }

    fn pose(&mut self) -> Result<Stamped<Pose>, Self::Error> {
        let answer = self.device.pose();
        self.answer(Stream::Pose, answer, Reading::Pose)
    }

    fn settled(&mut self) -> Result<bool, Self::Error> {
        let answer = self.device.settled();
        self.answer(Stream::Settled, answer, Reading::Settled)
    }
}

impl<D: Pressure, S: FnMut(Event)> Pressure for Recorder<D, S> {
    fn pressure_pa(&mut self) -> Result<Stamped<f64>, Self::Error> {
        let answer = self.device.pressure_pa();
        self.answer(Stream::Pressure, answer, Reading::PressurePa)
    }
}

impl<D: Valve, S: FnMut(Event)> Valve for Recorder<D, S> {
    fn open(&mut self, fraction: f64) -> Result<(), Self::Error> {
        let answer = self.device.open(fraction);
        self.command(Command::Open(fraction), answer)
    }
}

impl<D: Camera, S: FnMut(Event)> Camera for Recorder<D, S> {
    fn picture(&mut self) -> Result<Stamped<Picture<u8>>, Self::Error> {
        let answer = self.device.picture();
        self.answer(Stream::Grey, answer, Reading::Grey)
    }
}

impl<D: DepthCamera, S: FnMut(Event)> DepthCamera for Recorder<D, S> {
    fn intrinsics(&self) -> Intrinsics {
        self.device.intrinsics()
    }

    fn depth_m(&mut self) -> Result<Stamped<Picture<f32>>, Self::Error> {
        let intrinsics = self.device.intrinsics();
        self.fact(Fact::Intrinsics(intrinsics));
        let answer = self.device.depth_m();
        self.answer(Stream::Depth, answer, Reading::DepthM)
    }
}

impl<D: Microphones, S: FnMut(Event)> Microphones for Recorder<D, S> {
    fn channels(&self) -> usize {
        self.device.channels()
    }

    fn rate_hz(&self) -> f64 {
        self.device.rate_hz()
    }

    fn read(&mut self, interleaved: &mut [f32]) -> Result<f64, Self::Error> {
        let (channels, rate_hz) = (self.device.channels(), self.device.rate_hz());
        self.fact(Fact::Microphones(channels, rate_hz));
        let answer = self.device.read(interleaved);
        let whole = interleaved.len() / channels.max(1) * channels;
        let samples = &interleaved[..whole];
        self.answer(Stream::Sound, answer, |t_s| Reading::Samples(Stamped { t_s, value: samples.to_vec() }))
    }
}

impl<D: Motor, S: FnMut(Event)> Motor for Recorder<D, S> {
    fn limit_nm(&self) -> f64 {
        self.device.limit_nm()
    }

    fn drive(&mut self, torque_nm: f64) -> Result<(), Self::Error> {
        let limit_nm = self.device.limit_nm();
        self.fact(Fact::LimitNm(limit_nm));
        let answer = self.device.drive(torque_nm);
        self.command(Command::Drive(torque_nm), answer)
    }

    fn read(&mut self) -> Result<Stamped<MotorReading>, Self::Error> {
        let answer = self.device.read();
        self.answer(Stream::Motor, answer, Reading::Motor)
    }
}

/// Time is passed on and not told of: what is read has its own.
impl<D: Clock, S> Clock for Recorder<D, S> {
    fn now_s(&mut self) -> Result<f64, Self::Error> {
        self.device.now_s()
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), Self::Error> {
        self.device.sleep_s(duration_s)
    }
}
