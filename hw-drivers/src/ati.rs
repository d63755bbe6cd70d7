//! ATI Net F/T and Ethernet Axia: force and torque by Raw Data Transfer over UDP.
//!
//! Source: ATI Industrial Automation, Network Force/Torque Sensor System, 9620-05-Net FT, section 10 (requests, records,
//! sequence numbers) and section 9 (`netftapi2.xml`, `comm.cgi`); Ethernet Axia, 9610-05, section 4.8 (status word).

use std::collections::VecDeque;
use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs, UdpSocket};
use std::time::{Duration, Instant};

use hw_traits::ErrorType;
use hw_traits::clock::Stamped;
use hw_traits::force_torque::{ForceTorque, Wrench};

use crate::error::{DriverError, within};

/// Bytes of a record.
const RECORD: usize = 36;
/// The first word of a request.
const HEADER: u16 = 0x1234;
const STOP: u16 = 0x0000;
const START: u16 = 0x0002;
const BIAS: u16 = 0x0042;
/// Bits of the status word: any error; gage out of range; force or torque out of range.
const ANY_ERROR: u32 = 1 << 31;
const OUT_OF_RANGE: u32 = 1 << 27 | 1 << 30;
/// A record may come so much later than a newer one, s; what is older is from before a restart of the sensor.
const LATEST_S: f64 = 2.0;
/// Packets that one call looks at before it says that none was a new reading.
const PACKETS: usize = 1_000;

/// What the sensor's own pages say of it, or its paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetFtSettings {
    /// Counts of a newton (`cfgcpf`, for a calibration in N).
    pub counts_per_n: f64,
    /// Counts of a newton metre (`cfgcpt`, for a calibration in N m).
    pub counts_per_nm: f64,
    /// The sensor's own samples a second, which its sequence number counts: 7000 (Net F/T), as set on an Axia.
    pub sample_rate_hz: f64,
    /// How long a reading may take, 0.001 to 10 s.
    pub timeout_s: f64,
}

impl Default for NetFtSettings {
    fn default() -> Self {
        Self { counts_per_n: 1e6, counts_per_nm: 1e6, sample_rate_hz: 7000.0, timeout_s: 0.1 }
    }
}

/// What has happened to records on their way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Losses {
    /// Records that never came, by the sequence numbers of those that did.
    pub lost: u64,
    /// Records that came after a newer one, or twice, and were left out.
    pub late: u64,
    /// Packets that are no records.
    pub garbled: u64,
    /// Times that the stream had to be asked for again.
    pub restarts: u64,
}

#[derive(Debug, Clone, Copy)]
struct Record {
    rdt: u32,
    ft: u32,
    status: u32,
    counts: [i32; 6],
}

/// A Net F/T sensor.
#[derive(Debug)]
pub struct NetFt {
    device: String,
    socket: UdpSocket,
    settings: NetFtSettings,
    waiting: VecDeque<Record>,
    /// Sequence numbers of the newest record.
    last: Option<(u32, u32)>,
    /// Time of the newest record, s, and when it came.
    t_s: f64,
    arrived: Instant,
    offset: Wrench,
    losses: Losses,
}

impl NetFt {
    /// Asks a sensor (port 49152 unless it was set otherwise) to stream.
    ///
    /// # Errors
    /// [`DriverError::Limit`] for settings that are none, [`DriverError::Link`] for an address that leads nowhere.
    pub fn connect(address: impl ToSocketAddrs, settings: NetFtSettings) -> Result<Self, DriverError> {
        within("counts per N", settings.counts_per_n, f64::MIN_POSITIVE, 1e12)?;
        within("counts per N m", settings.counts_per_nm, f64::MIN_POSITIVE, 1e12)?;
        within("sample rate in Hz", settings.sample_rate_hz, 1.0, 1e6)?;
        within("timeout in s", settings.timeout_s, 1e-3, 10.0)?;
        let device = "Net F/T".to_owned();
        let link = |what| {
            let device = device.clone();
            move |e: std::io::Error| DriverError::of_io(&device, what, &e, 0.0)
        };
        let socket = UdpSocket::bind("0.0.0.0:0").map_err(link("open a socket"))?;
        socket.connect(address).map_err(link("find the address"))?;
        let timeout = Duration::from_secs_f64(settings.timeout_s);
        socket.set_read_timeout(Some(timeout)).map_err(link("set a time-out"))?;
        let device = socket.peer_addr().map_or(device.clone(), |a| format!("{device} {a}"));
        let mut sensor = Self {
            device,
            socket,
            settings,
            waiting: VecDeque::new(),
            last: None,
            t_s: 0.0,
            arrived: Instant::now(),
            offset: Wrench::default(),
            losses: Losses::default(),
        };
        sensor.request(START)?;
        Ok(sensor)
    }

    /// What has been lost so far.
    pub fn losses(&self) -> Losses {
        self.losses
    }

    /// Takes the present load as zero in the sensor itself, for all who listen to it; [`ForceTorque::tare`] does it here.
    ///
    /// # Errors
    /// [`DriverError::Link`]. The sensor does not answer: the next readings show it.
    pub fn bias(&mut self) -> Result<(), DriverError> {
        self.request(BIAS)
    }

    fn request(&mut self, command: u16) -> Result<(), DriverError> {
        let mut bytes = [0; 8];
        bytes[..2].copy_from_slice(&HEADER.to_be_bytes());
        bytes[2..4].copy_from_slice(&command.to_be_bytes());
        let sent = self.socket.send(&bytes);
        sent.map(drop).map_err(|e| DriverError::of_io(&self.device, "send a request", &e, 0.0))
    }

    /// Waits for a packet and takes the records in it.
    fn receive(&mut self) -> Result<(), DriverError> {
        let mut packet = [0; 2048];
        let waited_s = self.settings.timeout_s;
        match self.socket.recv(&mut packet) {
            Ok(bytes) => self.take(&packet[..bytes]),
            Err(error) => {
                // The sensor may have been without power, or the request may be lost.
                self.losses.restarts += 1;
                // What was received says more than whether it can be asked again.
                let _ = self.request(START);
                return Err(DriverError::of_io(&self.device, "receive", &error, waited_s));
            }
        }
        Ok(())
    }

    /// Takes the records of a packet.
    fn take(&mut self, packet: &[u8]) {
        if packet.is_empty() || !packet.len().is_multiple_of(RECORD) {
            self.losses.garbled += 1;
        } else {
            self.waiting.extend(packet.chunks_exact(RECORD).filter_map(record));
        }
    }

    /// The time of a record, s; none for one that is older than the newest.
    fn date(&mut self, record: &Record) -> Option<f64> {
        let rate = self.settings.sample_rate_hz;
        if let Some((rdt, ft)) = self.last {
            let step = i64::from(record.ft.wrapping_sub(ft).cast_signed());
            let samples = step as f64;
            if step <= 0 && samples >= -LATEST_S * rate {
                self.losses.late += 1;
                // One that was counted as lost has come after all.
                self.losses.lost = self.losses.lost.saturating_sub(u64::from(step < 0));
                return None;
            }
            if step > 0 {
                self.t_s += samples / rate;
                let missing = record.rdt.wrapping_sub(rdt).wrapping_sub(1);
                // A stream that was asked for again counts from one.
                self.losses.lost += if missing.cast_signed() > 0 { u64::from(missing) } else { 0 };
            } else {
                // The sensor has counted from zero again: how long it was away is known from here alone.
                self.t_s += self.arrived.elapsed().as_secs_f64().max(1.0 / rate);
            }
        } else {
            self.t_s = f64::from(record.ft) / rate;
        }
        self.last = Some((record.rdt, record.ft));
        self.arrived = Instant::now();
        Some(self.t_s)
    }

    fn raw(&mut self) -> Result<Stamped<Wrench>, DriverError> {
        for _ in 0..PACKETS {
            let Some(record) = self.waiting.pop_front() else {
                self.receive()?;
                continue;
            };
            let Some(t_s) = self.date(&record) else { continue };
            let (device, status) = (self.device.clone(), record.status);
            if status & OUT_OF_RANGE != 0 {
                return Err(DriverError::Saturated { device, status });
            }
            if status & ANY_ERROR != 0 {
                let words = "the sensor reports an error of its own";
                return Err(DriverError::Device { device, words, code: status });
            }
            let [a, b, c, d, e, f] = record.counts.map(f64::from);
            let (n, nm) = (self.settings.counts_per_n, self.settings.counts_per_nm);
            let value = Wrench { force_n: [a / n, b / n, c / n], torque_nm: [d / nm, e / nm, f / nm] };
            return Ok(Stamped { t_s, value });
        }
        let device = self.device.clone();
        let received = format!("{PACKETS} without one");
        Err(DriverError::Garbled { device, expected: "packets with new records", received })
    }
}

fn record(bytes: &[u8]) -> Option<Record> {
    let word = |k: usize| bytes.get(4 * k..4 * k + 4)?.try_into().ok().map(u32::from_be_bytes);
    let count = |k: usize| word(k).map(u32::cast_signed);
    let counts = [count(3)?, count(4)?, count(5)?, count(6)?, count(7)?, count(8)?];
    Some(Record { rdt: word(0)?, ft: word(1)?, status: word(2)?, counts })
}

impl ErrorType for NetFt {
    type Error = DriverError;
}

/// Signs are the sensor's: the load on its tool side.
impl ForceTorque for NetFt {
    fn read(&mut self) -> Result<Stamped<Wrench>, DriverError> {
        let raw = self.raw()?;
        Ok(Stamped { t_s: raw.t_s, value: raw.value.plus(&self.offset) })
    }

    fn tare(&mut self, readings: usize) -> Result<(), DriverError> {
        let count = readings.max(1);
        let mut sum = Wrench::default();
        for _ in 0..count {
            sum = sum.plus(&self.raw()?.value);
        }
        self.offset = sum.scaled(-1.0 / count as f64);
        Ok(())
    }

    /// What the computer keeps of a stream that is not read is a quarter of a second at 1 kHz, and the oldest of it.
    fn skip(&mut self) -> Result<(), DriverError> {
        let failed = |device: &str, e: std::io::Error| DriverError::of_io(device, "receive", &e, 0.0);
        self.socket.set_nonblocking(true).map_err(|e| failed(&self.device, e))?;
        let mut packet = [0; 2048];
        while let Ok(bytes) = self.socket.recv(&mut packet) {
            self.take(&packet[..bytes]);
        }
        self.socket.set_nonblocking(false).map_err(|e| failed(&self.device, e))?;
        while let Some(record) = self.waiting.pop_front() {
            // Its number still counts: what is lost is counted by it.
            let _ = self.date(&record);
        }
        Ok(())
    }
}

impl Drop for NetFt {
    fn drop(&mut self) {
        // A sensor that hears no stop goes on; nobody listens.
        let _ = self.request(STOP);
    }
}

/// Reads `netftapi2.xml` of a sensor (port 80): counts, and the rate of its records in Hz.
///
/// # Errors
/// [`DriverError::Link`], [`DriverError::Late`], or [`DriverError::Garbled`] where a number is missing or its units are not N and N m.
pub fn settings_of(web: SocketAddr, timeout_s: f64) -> Result<(NetFtSettings, f64), DriverError> {
    within("timeout in s", timeout_s, 1e-3, 10.0)?;
    let page = get(web, "/netftapi2.xml", timeout_s)?;
    let text = |tag: &str| {
        let begin = page.find(&format!("<{tag}>"))? + tag.len() + 2;
        let rest = page.get(begin..)?;
        rest.get(..rest.find('<')?).map(str::trim)
    };
    let device = || format!("Net F/T {web}");
    let number = |tag: &str, expected: &'static str| {
        let value = text(tag).and_then(|t| t.parse().ok()).filter(|v: &f64| *v > 0.0);
        let received = text(tag).unwrap_or("nothing").to_owned();
        value.ok_or_else(|| DriverError::Garbled { device: device(), expected, received })
    };
    for (tag, unit, expected) in [
        ("scfgfu", "N", "<scfgfu>N</scfgfu>, forces in N"),
        ("scfgtu", "Nm", "<scfgtu>Nm</scfgtu>, torques in N m"),
    ] {
        if let Some(found) = text(tag).filter(|found| *found != unit) {
            return Err(DriverError::Garbled { device: device(), expected, received: found.to_owned() });
        }
    }
    let counts_per_n = number("cfgcpf", "<cfgcpf>, counts of a force")?;
    let counts_per_nm = number("cfgcpt", "<cfgcpt>, counts of a torque")?;
    let rate_hz = number("comrdtrate", "<comrdtrate>, the rate of records")?;
    Ok((NetFtSettings { counts_per_n, counts_per_nm, timeout_s, ..NetFtSettings::default() }, rate_hz))
}

/// Sets how many records a second a sensor sends (`comm.cgi`, port 80), 1 to 7000.
///
/// # Errors
/// [`DriverError::Limit`] for another rate; [`DriverError::Link`] or [`DriverError::Late`].
pub fn set_rate(web: SocketAddr, rate_hz: u32, timeout_s: f64) -> Result<(), DriverError> {
    within("rate in Hz", f64::from(rate_hz), 1.0, 7000.0)?;
    within("timeout in s", timeout_s, 1e-3, 10.0)?;
    get(web, &format!("/comm.cgi?comrdtrate={rate_hz}"), timeout_s).map(drop)
}

/// A page of the sensor, by HTTP 1.0.
fn get(web: SocketAddr, path: &str, timeout_s: f64) -> Result<String, DriverError> {
    let device = format!("Net F/T {web}");
    let timeout = Duration::from_secs_f64(timeout_s);
    let ask = || -> std::io::Result<String> {
        let mut stream = TcpStream::connect_timeout(&web, timeout)?;
        stream.set_read_timeout(Some(timeout))?;
        stream.write_all(format!("GET {path} HTTP/1.0\r\nHost: {}\r\n\r\n", web.ip()).as_bytes())?;
        let mut page = Vec::new();
        stream.take(1 << 20).read_to_end(&mut page)?;
        Ok(String::from_utf8_lossy(&page).into_owned())
    };
    let page = ask().map_err(|e| DriverError::of_io(&device, "ask for a page", &e, timeout_s))?;
    let first = page.lines().next().unwrap_or_default().to_owned();
    if first.split(' ').nth(1).is_some_and(|code| code.starts_with('2') || code.starts_with('3')) {
        return Ok(page);
    }
    Err(DriverError::Garbled { device, expected: "a page (HTTP 200)", received: first })
}
