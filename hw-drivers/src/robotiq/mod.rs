//! Robotiq two-finger grippers: by the socket of the URCap, by Modbus RTU on a serial line, by Modbus TCP.
//!
//! Source: Robotiq, 2F-85 and 2F-140 instruction manual, "Control" (registers, their bits, scales, and Modbus RTU with example
//! frames); for the socket, the maker's forum, <https://dof.robotiq.com/discussion/2420>, which names the variables and port 63352.

mod modbus;
mod urcap;

use std::net::SocketAddr;
use std::time::Instant;

use hw_traits::ErrorType;
use hw_traits::clock::Stamped;
use hw_traits::gripper::Gripper;

use crate::dead_man::{DeadMan, Machine};
use crate::error::{DriverError, within};
use crate::line::{Opener, tcp};
use modbus::Modbus;
use urcap::UrCap;

/// What a gripper is, and how it may be used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotiqSettings {
    /// Opening of the fingers at position 0, m: 0.085 of a 2F-85.
    pub stroke_m: f64,
    /// Position (counts) at which the fingers touch; measured once, 226 to 230 of most 2F-85.
    pub closed_counts: u8,
    /// Slowest and fastest motion, m/s: 0.020 and 0.150 of a 2F-85.
    pub speeds_m_s: [f64; 2],
    /// Smallest and largest force, N: 20 and 235 of a 2F-85.
    pub forces_n: [f64; 2],
    /// The force that is put up with, N.
    pub force_n: f64,
    /// How long an answer may take, s.
    pub timeout_s: f64,
    /// The longest time between readings while it moves, s.
    pub patience_s: f64,
}

impl Default for RobotiqSettings {
    /// A 2F-85 at its smallest force.
    fn default() -> Self {
        Self {
            stroke_m: 0.085,
            closed_counts: 230,
            speeds_m_s: [0.020, 0.150],
            forces_n: [20.0, 235.0],
            force_n: 20.0,
            timeout_s: 0.2,
            patience_s: 0.5,
        }
    }
}

/// Registers that are written: activate, go, position, speed, force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Request {
    activate: bool,
    go: bool,
    position: u8,
    speed: u8,
    force: u8,
}

/// Registers that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Answer {
    /// 3 is activated.
    status: u8,
    /// 0 moving, 1 and 2 held up by an object, 3 at the position.
    object: u8,
    fault: u8,
    /// The position that was asked for last.
    echo: u8,
    position: u8,
}

/// Registers behind some line.
trait Registers: Send {
    fn write(&mut self, request: &Request) -> Result<(), DriverError>;
    fn read(&mut self) -> Result<Answer, DriverError>;
    fn device(&self) -> &str;
}

/// The gripper behind its registers.
pub struct Hand {
    registers: Box<dyn Registers>,
    settings: RobotiqSettings,
    begin: Instant,
    goal: Option<u8>,
    position: u8,
}

/// A Robotiq two-finger gripper, under the dead-man's rule.
pub struct Robotiq {
    machine: DeadMan<Hand>,
    stroke_m: f64,
}

impl RobotiqSettings {
    fn counts_of(&self, width_m: f64) -> u8 {
        let counts = f64::from(self.closed_counts) * (1.0 - width_m / self.stroke_m);
        counts.round().clamp(0.0, f64::from(self.closed_counts)) as u8
    }

    fn width_of(&self, counts: u8) -> f64 {
        self.stroke_m * (1.0 - f64::from(counts) / f64::from(self.closed_counts)).max(0.0)
    }

    /// A share of a range as 0 to 255, rounded down.
    fn share(value: f64, [low, high]: [f64; 2]) -> u8 {
        (255.0 * (value - low) / (high - low)).clamp(0.0, 255.0) as u8
    }
}

/// What the manual says of a fault code.
fn words_of(fault: u8) -> &'static str {
    match fault {
        0x05 => "an action waits for the activation",
        0x07 => "the activation bit has to be set first",
        0x08 => "it is too hot",
        0x09 => "no communication for a second",
        0x0A => "below its supply voltage",
        0x0B => "it is releasing automatically",
        0x0C => "an internal fault",
        0x0D => "the activation failed",
        0x0E => "too much current",
        0x0F => "it has released automatically",
        _ => "a fault that the manual does not list",
    }
}

impl Hand {
    /// Reads, and refuses an answer with a fault of which the gripper does not recover by itself.
    fn answer(&mut self) -> Result<Answer, DriverError> {
        let answer = self.registers.read()?;
        self.position = answer.position;
        if matches!(answer.fault, 0x08 | 0x0A..=0x0F) {
            let device = self.registers.device().to_owned();
            return Err(DriverError::Device {
                device,
                words: words_of(answer.fault),
                code: answer.fault.into(),
            });
        }
        Ok(answer)
    }

    /// Activates a gripper that is not; it then opens and closes once.
    fn activate(&mut self, patience_s: f64) -> Result<(), DriverError> {
        let begin = Instant::now();
        if self.answer()?.status != 3 {
            let mut request = Request { activate: false, go: false, position: 0, speed: 0, force: 0 };
            self.registers.write(&request)?;
            request.activate = true;
            self.registers.write(&request)?;
        }
        while self.answer()?.status != 3 {
            if begin.elapsed().as_secs_f64() > patience_s {
                let device = self.registers.device().to_owned();
                return Err(DriverError::Late { device, waited_s: patience_s });
            }
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        Ok(())
    }
}

impl Machine for Hand {
    /// Opening, m.
    type State = f64;
    /// Opening (m) and speed (m/s).
    type Command = (f64, f64);

    fn admissible(&self, (width_m, speed_m_s): &(f64, f64)) -> Result<(), DriverError> {
        within("opening in m", *width_m, 0.0, self.settings.stroke_m)?;
        // Faster than it can is as fast as it can; slower than it can is not.
        within("speed in m/s", *speed_m_s, self.settings.speeds_m_s[0], f64::MAX)
    }

    fn beyond(&self, _: &f64) -> Option<String> {
        // Place and force end in the gripper itself.
        None
    }

    fn look(&mut self) -> Result<(Stamped<f64>, bool), DriverError> {
        let answer = self.answer()?;
        let heard = self.goal.is_none_or(|goal| goal == answer.echo);
        let settled = self.goal.is_none() || (heard && answer.object != 0);
        let value = self.settings.width_of(answer.position);
        Ok((Stamped { t_s: self.begin.elapsed().as_secs_f64(), value }, settled))
    }

    fn send(&mut self, (width_m, speed_m_s): &(f64, f64)) -> Result<(), DriverError> {
        let settings = &self.settings;
        let position = settings.counts_of(*width_m);
        let speed = RobotiqSettings::share(*speed_m_s, settings.speeds_m_s);
        let force = RobotiqSettings::share(settings.force_n, settings.forces_n);
        self.registers.write(&Request { activate: true, go: true, position, speed, force })?;
        self.goal = Some(position);
        Ok(())
    }

    fn stop(&mut self) -> Result<(), DriverError> {
        let position = self.position;
        self.registers.write(&Request { activate: true, go: false, position, speed: 0, force: 0 })?;
        self.goal = None;
        Ok(())
    }
}

impl Robotiq {
    /// A gripper by the socket of the URCap on a controller (port 63352).
    ///
    /// # Errors
    /// [`DriverError::Limit`] for settings that are none; those of the line, and of the activation.
    pub fn by_urcap(address: SocketAddr, settings: RobotiqSettings) -> Result<Self, DriverError> {
        let open = tcp(address, settings.timeout_s);
        Self::new(Box::new(UrCap::new(format!("Robotiq {address}"), open, settings.timeout_s)?), settings)
    }

    /// A gripper by Modbus TCP (port 502), behind a unit's number: 9 unless it was set otherwise.
    ///
    /// # Errors
    /// As [`Robotiq::by_urcap`].
    pub fn by_modbus_tcp(
        address: SocketAddr,
        unit: u8,
        settings: RobotiqSettings,
    ) -> Result<Self, DriverError> {
        let open = tcp(address, settings.timeout_s);
        let registers = Modbus::new(format!("Robotiq {address}"), open, unit, false, settings.timeout_s)?;
        Self::new(Box::new(registers), settings)
    }

    /// A gripper by Modbus RTU on any line (115200 baud, 8 data bits, no parity, 1 stop bit), as unit 9 unless it was set otherwise.
    ///
    /// # Errors
    /// As [`Robotiq::by_urcap`].
    pub fn by_modbus_rtu(open: Opener, unit: u8, settings: RobotiqSettings) -> Result<Self, DriverError> {
        let registers = Modbus::new("Robotiq".into(), open, unit, true, settings.timeout_s)?;
        Self::new(Box::new(registers), settings)
    }

    fn new(registers: Box<dyn Registers>, settings: RobotiqSettings) -> Result<Self, DriverError> {
        within("stroke in m", settings.stroke_m, 1e-3, 1.0)?;
        within("counts when closed", f64::from(settings.closed_counts), 1.0, 255.0)?;
        let ([slow, fast], [weak, strong]) = (settings.speeds_m_s, settings.forces_n);
        within("slowest motion in m/s", slow, 0.0, f64::MAX)?;
        within("fastest motion in m/s", fast, slow.max(f64::MIN_POSITIVE), f64::MAX)?;
        within("force in N", settings.force_n, weak, strong)?;
        let mut hand = Hand { registers, settings, begin: Instant::now(), goal: None, position: 0 };
        hand.activate(10.0)?;
        Ok(Self { machine: DeadMan::new(hand, settings.patience_s)?, stroke_m: settings.stroke_m })
    }

    /// Stops now.
    ///
    /// # Errors
    /// The line's.
    pub fn stop(&mut self) -> Result<(), DriverError> {
        self.machine.stop()
    }

    /// Why the dead-man's rule stopped it, if it did.
    pub fn stopped(&self) -> Option<String> {
        self.machine.stopped()
    }

    /// Lets a stopped gripper take commands again.
    pub fn clear(&mut self) {
        self.machine.clear();
    }
}

impl ErrorType for Robotiq {
    type Error = DriverError;
}

/// Times are this computer's: the gripper has no clock.
impl Gripper for Robotiq {
    fn limits_m(&self) -> (f64, f64) {
        (0.0, self.stroke_m)
    }

    fn open_to(&mut self, width_m: f64, speed_m_s: f64) -> Result<(), DriverError> {
        self.machine.command(&(width_m, speed_m_s))
    }

    fn width_m(&mut self) -> Result<Stamped<f64>, DriverError> {
        self.machine.look().map(|(width, _)| width)
    }

    fn settled(&mut self) -> Result<bool, DriverError> {
        self.machine.settled()
    }
}
