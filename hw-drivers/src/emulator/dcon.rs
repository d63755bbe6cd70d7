use std::io::Write as _;
use std::net::{SocketAddr, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::life::Life;
use super::session::{Served, lock, receive, serve};

/// What goes wrong with the modules.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DconFaults {
    /// Answers come byte by byte.
    pub in_pieces: bool,
    /// No answer is given.
    pub silent: bool,
    /// The line is cut, and none is taken.
    pub cut: bool,
    /// Every question is refused.
    pub refuse: bool,
}

#[derive(Debug)]
struct Air {
    volts: f64,
    pressure_pa: f64,
    watch_s: f64,
    ended: bool,
    heard: Instant,
    faults: DconFaults,
}

/// An input module (address 1, 0 to 10 V for 0 to 200 kPa) and an output module (address 2) on loopback. At 5 V a valve is
/// closed, at 10 V it fills a chamber with 100 kPa a second, at 0 V it lets as much out.
#[derive(Debug)]
pub struct DconEmulator {
    address: SocketAddr,
    air: Arc<Mutex<Air>>,
    _life: Life,
}

impl Served for Air {
    fn advance(&mut self, dt: f64) {
        if self.watch_s > 0.0 && self.heard.elapsed().as_secs_f64() > self.watch_s {
            (self.ended, self.volts, self.watch_s) = (true, 5.0, 0.0);
        }
        self.pressure_pa = (self.pressure_pa + (self.volts - 5.0) / 5.0 * 1e5 * dt).clamp(0.0, 3e5);
    }

    fn is_cut(&self) -> bool {
        self.faults.cut
    }
}

impl Air {
    fn answer(&mut self, line: &str) -> Option<String> {
        if line == "~**" {
            self.heard = Instant::now();
            return None;
        }
        if self.faults.refuse {
            return Some(format!("?{}", line.get(1..3)?));
        }
        if line == "#010" {
            return Some(format!(">{:+07.3}", self.pressure_pa / 2e5 * 10.0));
        }
        if let Some(volts) = line.strip_prefix("#020") {
            if self.ended {
                return Some("!".into());
            }
            let volts = volts.parse::<f64>().ok().filter(|v| (0.0..=10.0).contains(v));
            return Some(match volts {
                Some(volts) => {
                    self.volts = volts;
                    ">".into()
                }
                None => "?02".into(),
            });
        }
        if line == "~021" {
            self.ended = false;
            return Some("!02".into());
        }
        let tenths = u8::from_str_radix(line.strip_prefix("~0231")?, 16).ok()?;
        (self.watch_s, self.heard) = (f64::from(tenths) / 10.0, Instant::now());
        Some("!02".into())
    }
}

impl DconEmulator {
    /// Modules with a chamber at no pressure.
    ///
    /// # Errors
    /// Those of a socket on loopback.
    pub fn start() -> std::io::Result<Self> {
        let air = Air {
            volts: 5.0,
            pressure_pa: 0.0,
            watch_s: 0.0,
            ended: false,
            heard: Instant::now(),
            faults: DconFaults::default(),
        };
        let air = Arc::new(Mutex::new(air));
        let (address, life) = serve(&air, Duration::from_micros(500), step)?;
        Ok(Self { address, air, _life: life })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sets what goes wrong from now on.
    pub fn fail(&self, faults: DconFaults) {
        lock(&self.air).faults = faults;
    }

    /// Volts of the output, and the pressure, Pa.
    pub fn now(&self) -> (f64, f64) {
        let air = lock(&self.air);
        (air.volts, air.pressure_pa)
    }
}

fn step(stream: &mut TcpStream, bytes: &mut Vec<u8>, air: &Mutex<Air>) -> Option<()> {
    receive(stream, bytes)?;
    while let Some(end) = bytes.iter().position(|b| *b == b'\r') {
        let line: Vec<u8> = bytes.drain(..=end).collect();
        let line = String::from_utf8_lossy(&line).trim().to_owned();
        let (answer, faults) = {
            let mut air = lock(air);
            (air.answer(&line), air.faults)
        };
        let Some(answer) = answer.filter(|_| !faults.silent) else { continue };
        let answer = format!("{answer}\r").into_bytes();
        for part in answer.chunks(if faults.in_pieces { 1 } else { answer.len() }) {
            stream.write_all(part).ok()?;
        }
    }
    Some(())
}
