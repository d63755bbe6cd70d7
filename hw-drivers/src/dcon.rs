//! A pressure sensor, and a valve or a pressure regulator, on analogue modules of the DCON protocol (ICP DAS I-7000, M-7000, tM).
//!
//! Source: ICP DAS, I-7017 and I-7021 user's manuals: `#AAN` reads an analogue input in volts, `#AAN(data)` sets an analogue
//! output, `~**` says that the host is there, `~AA3EVV` sets the module's own watch of the host, `~AA1` clears it; answers begin
//! with `>` (data), `!` (done; of an output: the watch has ended it), `?` (refused). Frames end with a carriage return, and have no
//! checksum unless the module is set to one.

use std::time::{Duration, Instant};

use hw_traits::ErrorType;
use hw_traits::clock::Stamped;
use hw_traits::pneumatics::{Pressure, Valve};

use crate::dead_man::{DeadMan, Machine};
use crate::error::{DriverError, within};
use crate::line::{Line, Opener};

/// What the output module drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outlet {
    /// A proportional valve: volts that let the chamber out, that close, and that let the supply in with full section.
    Valve([f64; 3]),
    /// A pressure regulator: volts at no pressure and at the largest, and that pressure, Pa.
    Regulator([f64; 2], f64),
}

/// What is on which module, and what may be done with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PneumaticsSettings {
    /// Address and channel of the pressure sensor.
    pub input: (u8, u8),
    /// Volts of the sensor at no pressure and at its largest, and that pressure, Pa.
    pub sensor: ([f64; 2], f64),
    /// Address and channel of the output.
    pub output: (u8, u8),
    /// What it drives.
    pub outlet: Outlet,
    /// The largest pressure that is allowed, Pa: a larger one stops.
    pub largest_pa: f64,
    /// How long an answer may take, s.
    pub timeout_s: f64,
    /// The longest time between readings while the valve is open, s, 0.1 to 10; the module's own watch of the host is set to it as well.
    pub patience_s: f64,
}

/// A command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Air {
    /// Opening of a valve, -1 to 1.
    Open(f64),
    /// Pressure of a regulator, Pa.
    Pressure(f64),
}

/// A pressure sensor on its module.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaugeSettings {
    /// Address and channel of the pressure sensor.
    pub input: (u8, u8),
    /// Volts of the sensor at no pressure and at its largest, and that pressure, Pa.
    pub sensor: ([f64; 2], f64),
    /// How long an answer may take, s.
    pub timeout_s: f64,
}

/// A pressure sensor alone: nothing is set. Times are this computer's.
pub struct Gauge {
    line: Line,
    settings: GaugeSettings,
    begin: Instant,
    last_s: f64,
}

/// The modules on their line.
pub struct Modules {
    gauge: Gauge,
    settings: PneumaticsSettings,
    closed: bool,
}

/// A chamber of air: its pressure, and the valve or regulator that fills it, under the dead-man's rule.
pub struct Pneumatics {
    machine: DeadMan<Modules>,
}

impl Gauge {
    /// Asks nothing yet.
    ///
    /// # Errors
    /// [`DriverError::Limit`] for settings that are none.
    pub fn new(open: Opener, settings: GaugeSettings) -> Result<Self, DriverError> {
        let ([zero, full], most_pa) = settings.sensor;
        within("scale of the sensor in V", (full - zero).abs(), 0.1, 20.0)?;
        within("largest pressure of the sensor in Pa", most_pa, 1.0, 1e8)?;
        let line = Line::new("DCON".into(), open, settings.timeout_s)?;
        Ok(Self { line, settings, begin: Instant::now(), last_s: 0.0 })
    }

    fn ask(&mut self, question: &str) -> Result<String, DriverError> {
        let whole = |bytes: &[u8]| bytes.iter().position(|b| *b == b'\r').map(|at| at + 1);
        let answer = self.line.ask(format!("{question}\r").as_bytes(), whole)?;
        Ok(String::from_utf8_lossy(&answer).trim().to_owned())
    }

    fn refuse(&mut self, expected: &'static str, answer: &str) -> DriverError {
        self.line.hang_up();
        self.line.garbled(expected, answer)
    }
}

impl ErrorType for Gauge {
    type Error = DriverError;
}

impl Pressure for Gauge {
    fn pressure_pa(&mut self) -> Result<Stamped<f64>, DriverError> {
        let (address, channel) = self.settings.input;
        let answer = self.ask(&format!("#{address:02X}{channel:X}"))?;
        let volts = answer.strip_prefix('>').and_then(|volts| volts.parse::<f64>().ok());
        let Some(volts) = volts else { return Err(self.refuse("> and volts", &answer)) };
        let ([zero, full], most_pa) = self.settings.sensor;
        let share = (volts - zero) / (full - zero);
        // Half a percent beyond its scale it still measures.
        if !(-0.005..=1.005).contains(&share) {
            return Err(DriverError::Saturated { device: self.line.device.clone(), status: 0 });
        }
        // Two readings of one time cannot be: the clock is finer than the line.
        self.last_s = self.begin.elapsed().as_secs_f64().max(self.last_s + 1e-9);
        Ok(Stamped { t_s: self.last_s, value: share * most_pa })
    }
}

impl Modules {
    /// A command whose answer is `!AA`.
    fn done(&mut self, question: &str) -> Result<(), DriverError> {
        let answer = self.gauge.ask(question)?;
        if answer.starts_with('!') {
            Ok(())
        } else {
            Err(self.gauge.refuse("! and the module's address", &answer))
        }
    }

    /// The module's own watch, and its safe value, which is set in it beforehand (`~AA5`).
    fn watch(&mut self) -> Result<(), DriverError> {
        let address = self.settings.output.0;
        let tenths = (10.0 * self.settings.patience_s).ceil().clamp(1.0, 255.0) as u8;
        self.done(&format!("~{address:02X}1"))?;
        self.done(&format!("~{address:02X}31{tenths:02X}"))
    }

    fn volts(&self, command: &Air) -> f64 {
        match (self.settings.outlet, *command) {
            (Outlet::Valve([out, shut, full]), Air::Open(f)) => {
                if f >= 0.0 {
                    shut + f * (full - shut)
                } else {
                    shut - f * (out - shut)
                }
            }
            (Outlet::Regulator([zero, full], most_pa), Air::Pressure(pa)) => {
                zero + pa / most_pa * (full - zero)
            }
            (Outlet::Valve([_, shut, _]), _) => shut,
            (Outlet::Regulator([zero, _], _), _) => zero,
        }
    }

    fn shut(&self) -> Air {
        match self.settings.outlet {
            Outlet::Valve(_) => Air::Open(0.0),
            Outlet::Regulator(..) => Air::Pressure(0.0),
        }
    }

    fn set(&mut self, command: &Air) -> Result<(), DriverError> {
        let ((address, channel), volts) = (self.settings.output, self.volts(command));
        let answer = self.gauge.ask(&format!("#{address:02X}{channel:X}{volts:+07.3}"))?;
        match answer.chars().next() {
            Some('>') => Ok(()),
            Some('!') => {
                self.watch()?;
                let words = "the module's own watch has set the output to its safe value";
                Err(DriverError::Device { device: self.gauge.line.device.clone(), words, code: 1 })
            }
            _ => Err(self.gauge.refuse("> for an output that is set", &answer)),
        }
    }
}

impl Machine for Modules {
    /// Pressure, Pa.
    type State = f64;
    type Command = Air;

    fn admissible(&self, command: &Air) -> Result<(), DriverError> {
        match (self.settings.outlet, *command) {
            (Outlet::Valve(_), Air::Open(f)) => within("opening of the valve", f, -1.0, 1.0),
            (Outlet::Regulator(_, most_pa), Air::Pressure(pa)) => {
                within("pressure in Pa", pa, 0.0, most_pa.min(self.settings.largest_pa))
            }
            (Outlet::Valve(_), Air::Pressure(pa)) => {
                within("pressure of what has none, in Pa", pa, f64::NAN, f64::NAN)
            }
            (Outlet::Regulator(..), Air::Open(f)) => {
                within("opening of what has none", f, f64::NAN, f64::NAN)
            }
        }
    }

    fn beyond(&self, pressure_pa: &f64) -> Option<String> {
        within("pressure in Pa", *pressure_pa, f64::NEG_INFINITY, self.settings.largest_pa)
            .err()
            .map(|l| l.to_string())
    }

    fn look(&mut self) -> Result<(Stamped<f64>, bool), DriverError> {
        self.gauge.line.tell(b"~**\r")?;
        self.gauge.pressure_pa().map(|pressure| (pressure, self.closed))
    }

    fn send(&mut self, command: &Air) -> Result<(), DriverError> {
        self.closed = *command == self.shut();
        self.set(command)
    }

    fn stop(&mut self) -> Result<(), DriverError> {
        self.closed = true;
        self.set(&self.shut())
    }

    /// The module's own watch goes on while the outlet is closed and nobody asks.
    fn beat_every(&self) -> Option<Duration> {
        Some(Duration::from_secs_f64(0.25 * self.settings.patience_s))
    }

    fn beat(&mut self) {
        if self.gauge.line.is_open() {
            // It has no answer; a line that broke shows at the next reading.
            let _ = self.gauge.line.tell(b"~**\r");
        }
    }
}

impl Pneumatics {
    /// Closes the outlet, and sets the module's own watch.
    ///
    /// # Errors
    /// [`DriverError::Limit`] for settings that are none; the line's and the modules'.
    pub fn new(open: Opener, settings: PneumaticsSettings) -> Result<Self, DriverError> {
        let PneumaticsSettings { input, sensor, timeout_s, .. } = settings;
        let gauge = Gauge::new(open, GaugeSettings { input, sensor, timeout_s })?;
        within("largest pressure in Pa", settings.largest_pa, 1.0, sensor.1)?;
        within("patience in s", settings.patience_s, 0.1, 10.0)?;
        let volts = match settings.outlet {
            Outlet::Valve(volts) => volts.to_vec(),
            Outlet::Regulator(volts, most_pa) => {
                within("largest pressure of the regulator in Pa", most_pa, 1.0, 1e8)?;
                volts.to_vec()
            }
        };
        volts.into_iter().try_for_each(|v| within("output in V", v, -10.0, 10.0))?;
        let mut modules = Modules { gauge, settings, closed: true };
        modules.watch()?;
        modules.stop()?;
        Ok(Self { machine: DeadMan::new(modules, settings.patience_s)? })
    }

    /// Sets a regulator's pressure, Pa.
    ///
    /// # Errors
    /// As a command under the dead-man's rule.
    pub fn regulate(&mut self, pressure_pa: f64) -> Result<(), DriverError> {
        self.machine.command(&Air::Pressure(pressure_pa))
    }

    /// Why the dead-man's rule stopped it, if it did.
    pub fn stopped(&self) -> Option<String> {
        self.machine.stopped()
    }

    /// Lets it take commands again.
    pub fn clear(&mut self) {
        self.machine.clear();
    }
}

impl ErrorType for Pneumatics {
    type Error = DriverError;
}

impl Pressure for Pneumatics {
    fn pressure_pa(&mut self) -> Result<Stamped<f64>, DriverError> {
        self.machine.look().map(|(pressure, _)| pressure)
    }
}

impl Valve for Pneumatics {
    fn open(&mut self, fraction: f64) -> Result<(), DriverError> {
        self.machine.command(&Air::Open(fraction))
    }
}
