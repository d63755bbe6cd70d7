use std::f64::consts::{PI, TAU};
use std::time::Duration;

use hw_traits::ErrorType;
use hw_traits::clock::Stamped;
use hw_traits::rotary::Rotary;

use super::packet::Bus;
use crate::dead_man::{DeadMan, Machine};
use crate::error::{DriverError, within};

/// Addresses of the control table of the X series.
const OPERATING_MODE: u16 = 11;
const TORQUE_ENABLE: u16 = 64;
const BUS_WATCHDOG: u16 = 98;
const GOAL_CURRENT: u16 = 102;
const GOAL_VELOCITY: u16 = 104;
const PROFILE_VELOCITY: u16 = 112;
const GOAL_POSITION: u16 = 116;
/// From the tick in ms (2 bytes) to the position (132, 4 bytes).
const PRESENT: u16 = 120;
const PRESENT_BYTES: u16 = 16;
/// Counts of a turn, and the position that is an angle of zero.
const COUNTS: f64 = 4096.0;
const MIDDLE: f64 = 2048.0;
/// A unit of speed, rad/s: 0.229 turns a minute.
const SPEED: f64 = 0.229 * TAU / 60.0;
/// The tick turns over after 32768 ms.
const TICKS: i32 = 32_768;
/// A unit of the bus watchdog, s.
const WATCHDOG_S: f64 = 0.020;

/// What a servo is told to keep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// A position within a turn.
    Position,
    /// A speed.
    Velocity,
    /// A current, which stands for a torque.
    Current,
}

impl Mode {
    fn number(self) -> u8 {
        match self {
            Self::Current => 0,
            Self::Velocity => 1,
            Self::Position => 3,
        }
    }
}

/// What a servo is, and what it may do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoSettings {
    /// Its number on the line.
    pub id: u8,
    /// What it is told to keep.
    pub mode: Mode,
    /// Smallest and largest angle, rad, within -pi to pi.
    pub limits_rad: (f64, f64),
    /// Fastest turn, rad/s, at most 24.
    pub speed_rad_s: f64,
    /// Largest current, A.
    pub current_a: f64,
    /// A unit of current, A: 0.00269 of an XM430, 0.001 of an XL330. An XL430 has none: 1000 units are its whole load.
    pub current_unit_a: f64,
    /// Angle by which it may miss a goal, rad.
    pub tolerance_rad: f64,
    /// The longest time between readings while it moves, s, 0.02 to 2.5; the servo's own watch of its line is set to it as well.
    pub patience_s: f64,
}

/// A reading of a servo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Angle, rad.
    pub angle_rad: f64,
    /// Speed, rad/s.
    pub speed_rad_s: f64,
    /// Current, A.
    pub current_a: f64,
}

/// A command to a servo, of its mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ServoCommand {
    /// To an angle (rad), at a speed of at most so many rad/s.
    Turn(f64, f64),
    /// At a speed, rad/s.
    Speed(f64),
    /// With a current, A.
    Current(f64),
}

/// The servo behind its registers.
pub struct Joint {
    bus: Bus,
    settings: ServoSettings,
    goal: Option<f64>,
    stopped: bool,
    angle_rad: f64,
    present: Present,
}

/// The servo's clock: its last tick (ms) and that tick's time, s.
#[derive(Debug, Clone, Copy, Default)]
struct Present {
    tick: Option<(i32, f64)>,
}

/// A servo that is read alone: nothing is set, and its torque stays as it is.
pub struct ServoReader {
    bus: Bus,
    id: u8,
    current_unit_a: f64,
    present: Present,
}

/// A servo, under the dead-man's rule.
pub struct Servo {
    machine: DeadMan<Joint>,
    settings: ServoSettings,
}

fn words<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..at + N)?.try_into().ok()
}

fn goal_of(angle_rad: f64) -> i32 {
    (MIDDLE + angle_rad * COUNTS / TAU).round().clamp(0.0, COUNTS - 1.0) as i32
}

impl Present {
    fn read(&mut self, bus: &mut Bus, id: u8, current_unit_a: f64) -> Result<Stamped<Reading>, DriverError> {
        let bytes = bus.read(id, PRESENT, PRESENT_BYTES)?;
        let read = || {
            let tick = i32::from(u16::from_le_bytes(words(&bytes, 0)?));
            let current = f64::from(i16::from_le_bytes(words(&bytes, 6)?)) * current_unit_a;
            let speed = f64::from(i32::from_le_bytes(words(&bytes, 8)?)) * SPEED;
            let angle = (f64::from(i32::from_le_bytes(words(&bytes, 12)?)) - MIDDLE) * TAU / COUNTS;
            Some((tick, Reading { angle_rad: angle, speed_rad_s: speed, current_a: current }))
        };
        let Some((tick, value)) = read() else {
            let (device, received) = (bus.device(), format!("{bytes:?}"));
            return Err(DriverError::Garbled { device, expected: "16 bytes", received });
        };
        let t_s = match self.tick {
            Some((before, t_s)) => t_s + f64::from((tick - before).rem_euclid(TICKS)) * 1e-3,
            None => f64::from(tick) * 1e-3,
        };
        self.tick = Some((tick, t_s));
        Ok(Stamped { t_s, value })
    }
}

impl ServoReader {
    /// A servo of a number on a line; a unit of its current is `current_unit_a` A.
    ///
    /// # Errors
    /// [`DriverError::Limit`] for a number or unit that is none.
    pub fn new(bus: Bus, id: u8, current_unit_a: f64) -> Result<Self, DriverError> {
        within("number of the servo", f64::from(id), 0.0, 252.0)?;
        within("unit of current in A", current_unit_a, f64::MIN_POSITIVE, 1.0)?;
        Ok(Self { bus, id, current_unit_a, present: Present::default() })
    }

    /// Angle, speed and current.
    ///
    /// # Errors
    /// The line's and the servo's.
    pub fn reading(&mut self) -> Result<Stamped<Reading>, DriverError> {
        self.present.read(&mut self.bus, self.id, self.current_unit_a)
    }
}

impl Joint {
    fn write(&mut self, address: u16, bytes: &[u8]) -> Result<(), DriverError> {
        self.bus.write(self.settings.id, address, bytes)
    }

    /// Mode, watch and torque; also after the servo was without power.
    fn begin(&mut self) -> Result<(), DriverError> {
        let mode = self.settings.mode.number();
        self.write(TORQUE_ENABLE, &[0])?;
        self.write(OPERATING_MODE, &[mode])?;
        self.write(BUS_WATCHDOG, &[0])?;
        let watch = (self.settings.patience_s / WATCHDOG_S).ceil().clamp(1.0, 127.0) as u8;
        self.write(TORQUE_ENABLE, &[1])?;
        self.write(BUS_WATCHDOG, &[watch])
    }

    /// A servo whose own watch has stopped it takes no goal before it is reset.
    fn rearm(&mut self) -> Result<(), DriverError> {
        let watch = self.bus.read(self.settings.id, BUS_WATCHDOG, 1)?;
        if watch.first() == Some(&0xFF) || watch.first() == Some(&0) {
            self.begin()?;
        }
        Ok(())
    }

    fn hold(&mut self, command: &ServoCommand) -> Result<(), DriverError> {
        match *command {
            ServoCommand::Turn(angle_rad, rate_rad_s) => {
                // A profile of zero is no limit: the slowest is one unit.
                let profile = (rate_rad_s.min(self.settings.speed_rad_s) / SPEED).floor().max(1.0) as i32;
                self.write(PROFILE_VELOCITY, &profile.to_le_bytes())?;
                self.write(GOAL_POSITION, &goal_of(angle_rad).to_le_bytes())
            }
            ServoCommand::Speed(rad_s) => self.write(GOAL_VELOCITY, &((rad_s / SPEED) as i32).to_le_bytes()),
            ServoCommand::Current(a) => {
                let units = (a / self.settings.current_unit_a) as i16;
                self.write(GOAL_CURRENT, &units.to_le_bytes())
            }
        }
    }
}

impl Machine for Joint {
    type State = Reading;
    type Command = ServoCommand;

    fn admissible(&self, command: &ServoCommand) -> Result<(), DriverError> {
        let ServoSettings { limits_rad, speed_rad_s, current_a, mode, .. } = self.settings;
        let asked = match command {
            ServoCommand::Turn(angle_rad, rate_rad_s) => {
                within("angle in rad", *angle_rad, limits_rad.0, limits_rad.1)?;
                // One unit is the slowest that it knows.
                within("rate in rad/s", *rate_rad_s, SPEED, f64::MAX)?;
                Mode::Position
            }
            ServoCommand::Speed(rad_s) => {
                within("speed in rad/s", *rad_s, -speed_rad_s, speed_rad_s)?;
                Mode::Velocity
            }
            ServoCommand::Current(a) => {
                within("current in A", *a, -current_a, current_a)?;
                Mode::Current
            }
        };
        let (wanted, set) = (f64::from(asked.number()), f64::from(mode.number()));
        within("operating mode of the command", wanted, set, set)
    }

    fn beyond(&self, state: &Reading) -> Option<String> {
        let ServoSettings { limits_rad, speed_rad_s, current_a, tolerance_rad: more, .. } = self.settings;
        let checked = within("angle in rad", state.angle_rad, limits_rad.0 - more, limits_rad.1 + more)
            .and_then(|()| within("speed in rad/s", state.speed_rad_s.abs(), 0.0, 1.2 * speed_rad_s))
            .and_then(|()| within("current in A", state.current_a.abs(), 0.0, 1.2 * current_a));
        checked.err().map(|limit| limit.to_string())
    }

    fn look(&mut self) -> Result<(Stamped<Reading>, bool), DriverError> {
        let reading = self.present.read(&mut self.bus, self.settings.id, self.settings.current_unit_a)?;
        let value = reading.value;
        self.angle_rad = value.angle_rad;
        let stands = value.speed_rad_s.abs() < 2.0 * SPEED;
        let there = match self.goal {
            Some(goal) => (value.angle_rad - goal).abs() <= self.settings.tolerance_rad,
            None => self.stopped,
        };
        Ok((reading, stands && there))
    }

    fn send(&mut self, command: &ServoCommand) -> Result<(), DriverError> {
        self.rearm()?;
        self.hold(command)?;
        self.stopped = matches!(command, ServoCommand::Speed(0.0) | ServoCommand::Current(0.0));
        self.goal = match command {
            ServoCommand::Turn(angle_rad, _) => Some(*angle_rad),
            _ => None,
        };
        Ok(())
    }

    fn stop(&mut self) -> Result<(), DriverError> {
        let command = match self.settings.mode {
            Mode::Position => ServoCommand::Turn(self.angle_rad, self.settings.speed_rad_s),
            Mode::Velocity => ServoCommand::Speed(0.0),
            Mode::Current => ServoCommand::Current(0.0),
        };
        self.rearm()?;
        self.hold(&command)?;
        (self.goal, self.stopped) = (None, true);
        Ok(())
    }

    /// The servo's own watch goes on while it stands and nobody asks; a servo that it has stopped is without torque for a moment.
    fn beat_every(&self) -> Option<Duration> {
        Some(Duration::from_secs_f64(0.25 * self.settings.patience_s))
    }

    fn beat(&mut self) {
        if self.bus.is_open() {
            // Any question is one that the watch hears.
            let _ = self.bus.read(self.settings.id, BUS_WATCHDOG, 1);
        }
    }
}

impl Servo {
    /// Sets the mode, the servo's own watch of its line, and switches the torque on.
    ///
    /// # Errors
    /// [`DriverError::Limit`] for settings that are none; the line's and the servo's.
    pub fn new(bus: Bus, settings: ServoSettings) -> Result<Self, DriverError> {
        within("number of the servo", f64::from(settings.id), 0.0, 252.0)?;
        within("smallest angle in rad", settings.limits_rad.0, -PI, PI)?;
        within("largest angle in rad", settings.limits_rad.1, settings.limits_rad.0, PI)?;
        within("fastest turn in rad/s", settings.speed_rad_s, SPEED, 24.0)?;
        within("largest current in A", settings.current_a, f64::MIN_POSITIVE, 30.0)?;
        within("unit of current in A", settings.current_unit_a, f64::MIN_POSITIVE, 1.0)?;
        within("tolerance in rad", settings.tolerance_rad, TAU / COUNTS, 1.0)?;
        within("patience in s", settings.patience_s, WATCHDOG_S, 2.5)?;
        let mut joint =
            Joint { bus, settings, goal: None, stopped: true, angle_rad: 0.0, present: Present::default() };
        joint.begin()?;
        Ok(Self { machine: DeadMan::new(joint, settings.patience_s)?, settings })
    }

    /// Angle, speed and current.
    ///
    /// # Errors
    /// The line's and the servo's; [`DriverError::Stopped`] for a reading beyond the limits.
    pub fn reading(&mut self) -> Result<Stamped<Reading>, DriverError> {
        self.machine.look().map(|(reading, _)| reading)
    }

    /// Commands what belongs to its mode.
    ///
    /// # Errors
    /// As a command under the dead-man's rule.
    pub fn command(&mut self, command: ServoCommand) -> Result<(), DriverError> {
        self.machine.command(&command)
    }

    /// Stops now: where it is, at a speed of zero, or without current.
    ///
    /// # Errors
    /// The line's and the servo's.
    pub fn stop(&mut self) -> Result<(), DriverError> {
        self.machine.stop()
    }

    /// Why the dead-man's rule stopped it, if it did.
    pub fn stopped(&self) -> Option<String> {
        self.machine.stopped()
    }

    /// Lets a stopped servo take commands again.
    pub fn clear(&mut self) {
        self.machine.clear();
    }
}

impl ErrorType for Servo {
    type Error = DriverError;
}

/// For the mode [`Mode::Position`].
impl Rotary for Servo {
    fn limits_rad(&self) -> (f64, f64) {
        self.settings.limits_rad
    }

    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), DriverError> {
        self.machine.command(&ServoCommand::Turn(angle_rad, rate_rad_s))
    }

    fn angle_rad(&mut self) -> Result<Stamped<f64>, DriverError> {
        self.machine.look().map(|(r, _)| Stamped { t_s: r.t_s, value: r.value.angle_rad })
    }

    fn settled(&mut self) -> Result<bool, DriverError> {
        self.machine.settled()
    }
}
