use std::collections::BTreeMap;
use std::collections::VecDeque;

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
use crate::{ErrorKind, ErrorType};

/// Answers from a list of [`Event`]s; it has every trait.
///
/// * A command has to be the next recorded one, to within a tolerance of each number; another is an error of the kind
///   [`ErrorKind::NotAsRecorded`], and one after the last of the kind [`ErrorKind::EndOfRecording`].
/// * A question is answered by the readings between the last command and the next, in their order. Readings that come once
///   (wrench, pressure, a motor's, pictures, sound) then end, with [`ErrorKind::EndOfRecording`]; of states (pose, angle, width, settled)
///   the last one stays.
/// * Sound is a stream of samples: a buffer may have any length, as long as no samples were lost within it.
/// * Time is that of the last reading that was played, and what was slept since.
#[derive(Debug, Clone, PartialEq)]
pub struct Playback {
    facts: Vec<Fact>,
    /// Events between commands; each part but the first begins with its command.
    parts: VecDeque<Part>,
    now: Part,
    states: BTreeMap<Stream, Reading>,
    sound: Option<(f64, VecDeque<f32>)>,
    tolerance: f64,
    now_s: f64,
}

#[derive(Debug, Clone, PartialEq, Default)]
struct Part {
    command: Option<(Command, Option<ErrorKind>)>,
    queues: BTreeMap<Stream, VecDeque<Result<Reading, ErrorKind>>>,
}

impl Playback {
    /// Plays `events` back; each number of a command may differ from the recorded one by `tolerance`, in that number's unit.
    pub fn new(events: impl IntoIterator<Item = Event>, tolerance: f64) -> Self {
        let (mut facts, mut parts) = (Vec::new(), VecDeque::from([Part::default()]));
        for event in events {
            match event {
                Event::Fact(fact) => facts.push(fact),
                Event::Command { command, refused } => {
                    parts.push_back(Part { command: Some((command, refused)), queues: BTreeMap::new() });
                }
                Event::Reading(reading) => push(&mut parts, reading.stream(), Ok(reading)),
                Event::Failed { stream, kind } => push(&mut parts, stream, Err(kind)),
            }
        }
        let now = parts.pop_front().unwrap_or_default();
        Self { facts, parts, now, states: BTreeMap::new(), sound: None, tolerance, now_s: 0.0 }
    }

    /// Whether every recorded command has been given.
    pub fn has_ended(&self) -> bool {
        self.parts.is_empty()
    }

    fn command(&mut self, command: Command) -> Result<(), ErrorKind> {
        let next = self.parts.front().ok_or(ErrorKind::EndOfRecording)?;
        let (recorded, refused) = next.command.ok_or(ErrorKind::Other)?;
        if !recorded.is_like(&command, self.tolerance) {
            return Err(ErrorKind::NotAsRecorded);
        }
        self.now = self.parts.pop_front().unwrap_or_default();
        self.sound = None;
        // A command makes another state, if it was heard.
        if refused.is_none() {
            self.states.clear();
        }
        refused.map_or(Ok(()), Err)
    }

    fn next(&mut self, stream: Stream) -> Result<Reading, ErrorKind> {
        let Some(answer) = self.now.queues.get_mut(&stream).and_then(VecDeque::pop_front) else {
            let last = self.states.get(&stream).filter(|_| !stream.comes_once());
            return last.cloned().ok_or(ErrorKind::EndOfRecording);
        };
        let reading = answer?;
        if let Some(t_s) = reading.time_s().filter(|t_s| *t_s > self.now_s) {
            self.now_s = t_s;
        }
        if !stream.comes_once() {
            self.states.insert(stream, reading.clone());
        }
        Ok(reading)
    }

    fn settled(&mut self) -> Result<bool, ErrorKind> {
        match self.next(Stream::Settled)? {
            Reading::Settled(settled) => Ok(settled),
            _ => Err(ErrorKind::Other),
        }
    }

    fn samples(&mut self) -> Result<Stamped<Vec<f32>>, ErrorKind> {
        match self.next(Stream::Sound)? {
            Reading::Samples(samples) => Ok(samples),
            _ => Err(ErrorKind::Other),
        }
    }

    fn microphones(&self) -> (usize, f64) {
        let wanted = |fact: &Fact| match fact {
            Fact::Microphones(channels, rate_hz) => Some((*channels, *rate_hz)),
            _ => None,
        };
        self.facts.iter().find_map(wanted).unwrap_or((1, 1.0))
    }
}

fn push(parts: &mut VecDeque<Part>, stream: Stream, answer: Result<Reading, ErrorKind>) {
    if let Some(part) = parts.back_mut() {
        part.queues.entry(stream).or_default().push_back(answer);
    }
}

impl ErrorType for Playback {
    type Error = ErrorKind;
}

/// A question whose answer is one kind of reading.
macro_rules! ask {
    ($self:ident, $stream:ident, $reading:ident) => {
        match $self.next(Stream::$stream)? {
            Reading::$reading(value) => Ok(value),
            _ => Err(ErrorKind::Other),
        }
    };
}

impl ForceTorque for Playback {
    fn read(&mut self) -> Result<Stamped<Wrench>, ErrorKind> {
        ask!(self, Wrench, Wrench)
    }

    fn tare(&mut self, readings: usize) -> Result<(), ErrorKind> {
        self.command(Command::Tare(readings))
    }
}

impl Rotary for Playback {
    /// Of a recording that has none, everything.
    fn limits_rad(&self) -> (f64, f64) {
        let wanted = |fact: &Fact| match fact {
            Fact::LimitsRad(low, high) => Some((*low, *high)),
            _ => None,
        };
        self.facts.iter().find_map(wanted).unwrap_or((f64::NEG_INFINITY, f64::INFINITY))
    }

    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), ErrorKind> {
        self.command(Command::TurnTo(angle_rad, rate_rad_s))
    }

    fn angle_rad(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        ask!(self, Angle, AngleRad)
    }

    fn settled(&mut self) -> Result<bool, ErrorKind> {
        self.settled()
    }
}

impl Gripper for Playback {
    /// Of a recording that has none, everything.
    fn limits_m(&self) -> (f64, f64) {
        let wanted = |fact: &Fact| match fact {
            Fact::LimitsM(low, high) => Some((*low, *high)),
            _ => None,
        };
        self.facts.iter().find_map(wanted).unwrap_or((f64::NEG_INFINITY, f64::INFINITY))
    }

    fn open_to(&mut self, width_m: f64, speed_m_s: f64) -> Result<(), ErrorKind> {
        self.command(Command::OpenTo(width_m, speed_m_s))
    }

    fn width_m(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        ask!(self, Width, WidthM)
    }

    fn settled(&mut self) -> Result<bool, ErrorKind> {
        self.settled()
    }
}

impl Arm for Playback {
    fn move_to(&mut self, tool_in_base: Pose, deadline_s: f64) -> Result<(), ErrorKind> {
        self.command(Command::MoveTo(tool_in_base, deadline_s))
    }

    fn pose(&mut self) -> Result<Stamped<Pose>, ErrorKind> {
        ask!(self, Pose, Pose)
    }

    fn settled(&mut self) -> Result<bool, ErrorKind> {
        self.settled()
    }
}

impl Pressure for Playback {
    fn pressure_pa(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        ask!(self, Pressure, PressurePa)
    }
}

impl Valve for Playback {
    fn open(&mut self, fraction: f64) -> Result<(), ErrorKind> {
        self.command(Command::Open(fraction))
    }
}

impl Camera for Playback {
    fn picture(&mut self) -> Result<Stamped<Picture<u8>>, ErrorKind> {
        ask!(self, Grey, Grey)
    }
}

impl DepthCamera for Playback {
    /// Of a recording that has none, a pinhole of no size.
    fn intrinsics(&self) -> Intrinsics {
        let wanted = |fact: &Fact| match fact {
            Fact::Intrinsics(intrinsics) => Some(*intrinsics),
            _ => None,
        };
        self.facts.iter().find_map(wanted).unwrap_or(Intrinsics { fx: 0.0, fy: 0.0, cx: 0.0, cy: 0.0 })
    }

    fn depth_m(&mut self) -> Result<Stamped<Picture<f32>>, ErrorKind> {
        ask!(self, Depth, DepthM)
    }
}

impl Motor for Playback {
    /// Of a recording that has none, none.
    fn limit_nm(&self) -> f64 {
        let wanted = |fact: &Fact| match fact {
            Fact::LimitNm(limit_nm) => Some(*limit_nm),
            _ => None,
        };
        self.facts.iter().find_map(wanted).unwrap_or(f64::INFINITY)
    }

    fn drive(&mut self, torque_nm: f64) -> Result<(), ErrorKind> {
        self.command(Command::Drive(torque_nm))
    }

    fn read(&mut self) -> Result<Stamped<MotorReading>, ErrorKind> {
        ask!(self, Motor, Motor)
    }
}

impl Microphones for Playback {
    fn channels(&self) -> usize {
        self.microphones().0
    }

    fn rate_hz(&self) -> f64 {
        self.microphones().1
    }

    fn read(&mut self, interleaved: &mut [f32]) -> Result<f64, ErrorKind> {
        let (channels, rate_hz) = self.microphones();
        let wanted = interleaved.len() / channels.max(1) * channels;
        if wanted == 0 {
            // Whether such a read is on the recording or not.
            let queue = self.now.queues.get_mut(&Stream::Sound);
            if let Some(queue) = queue.filter(|q| q.front() == Some(&Err(ErrorKind::OutOfRange))) {
                queue.pop_front();
            }
            return Err(ErrorKind::OutOfRange);
        }
        let step = |samples: usize| (samples / channels.max(1)) as f64 / rate_hz;
        let (mut begin_s, mut waiting) = self.sound.take().unwrap_or_default();
        while waiting.len() < wanted {
            let more = match self.samples() {
                Ok(more) => more,
                Err(kind) => {
                    self.sound = Some((begin_s, waiting));
                    return Err(kind);
                }
            };
            if waiting.is_empty() || (more.t_s - begin_s - step(waiting.len())).abs() > 0.5 / rate_hz {
                // After a gap a new stretch begins; what was left before it does not fill a buffer.
                (begin_s, waiting) = (more.t_s, VecDeque::new());
            }
            waiting.extend(more.value);
        }
        for (out, sample) in interleaved.iter_mut().zip(waiting.drain(..wanted)) {
            *out = sample;
        }
        self.sound = Some((begin_s + step(wanted), waiting));
        Ok(begin_s)
    }
}

impl Clock for Playback {
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
