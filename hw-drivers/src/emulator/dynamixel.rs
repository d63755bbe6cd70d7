use std::io::Write as _;
use std::net::{SocketAddr, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::life::Life;
use super::session::{Served, lock, receive, serve};

/// What goes wrong with a servo.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DynamixelFaults {
    /// Answers come byte by byte.
    pub in_pieces: bool,
    /// The line hears itself: each question comes back before its answer.
    pub echo: bool,
    /// Noise before each answer.
    pub noise: bool,
    /// No answer is given.
    pub silent: bool,
    /// The line is cut, and none is taken.
    pub cut: bool,
    /// Answers have a wrong bit.
    pub garbled: bool,
    /// The error of each status packet.
    pub error: u8,
    /// A load that stands for a current, in the servo's units.
    pub current: i16,
}

struct Servo {
    table: [u8; 200],
    place: f64,
    heard: Instant,
    power: Instant,
    faults: DynamixelFaults,
}

/// A servo of the X series, number 1, on a line that is a TCP connection on loopback.
pub struct DynamixelEmulator {
    address: SocketAddr,
    servo: Arc<Mutex<Servo>>,
    _life: Life,
}

/// The checksum of protocol 2.0, bit by bit.
fn checksum(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0u16, |sum, byte| {
        (0..8).fold(
            sum ^ u16::from(*byte) << 8,
            |sum, _| {
                if sum & 0x8000 == 0 { sum << 1 } else { sum << 1 ^ 0x8005 }
            },
        )
    })
}

impl Served for Servo {
    fn advance(&mut self, dt: f64) {
        let watch = self.table[98];
        if (1..=127).contains(&watch) && self.heard.elapsed().as_secs_f64() > 0.02 * f64::from(watch) {
            self.table[98] = 0xFF;
        }
        let on = self.table[64] == 1 && self.table[98] != 0xFF;
        // A unit of speed is 0.229 turns a minute, of place a 4096th of a turn.
        let unit = 0.229 / 60.0 * 4096.0;
        let speed = match (on, self.table[11]) {
            (true, 3) => {
                let most = f64::from(self.long(112)).max(1.0) * unit;
                let way = f64::from(self.long(116)) - self.place;
                let step = way.clamp(-most * dt, most * dt);
                self.place += step;
                if dt > 0.0 { step / dt / unit } else { 0.0 }
            }
            (true, 1) => {
                let speed = f64::from(self.long(104));
                self.place += speed * unit * dt;
                speed
            }
            _ => 0.0,
        };
        let tick = (self.power.elapsed().as_millis() % 32_768) as u16;
        let (place, current) = (self.place.round() as i32, self.faults.current);
        self.put(120, &tick.to_le_bytes());
        self.put(126, &current.to_le_bytes());
        self.put(128, &(speed.round() as i32).to_le_bytes());
        self.put(132, &place.to_le_bytes());
    }

    fn is_cut(&self) -> bool {
        self.faults.cut
    }
}

impl Servo {
    fn long(&self, at: usize) -> i32 {
        i32::from_le_bytes([self.table[at], self.table[at + 1], self.table[at + 2], self.table[at + 3]])
    }

    fn put(&mut self, at: usize, bytes: &[u8]) {
        self.table[at..at + bytes.len()].copy_from_slice(bytes);
    }

    /// The status packet to an instruction.
    fn obey(&mut self, packet: &[u8]) -> Option<Vec<u8>> {
        let (body, sum) = packet.split_at(packet.len() - 2);
        if checksum(body).to_le_bytes() != sum || packet[4] != 1 {
            return None;
        }
        self.heard = Instant::now();
        let mut plain = body[8..].to_vec();
        while let Some(at) = plain.windows(4).position(|w| w == [0xFF, 0xFF, 0xFD, 0xFD]) {
            plain.remove(at + 3);
        }
        let mut error = self.faults.error;
        let at = |k: usize| plain.get(k).map(|b| usize::from(*b));
        let mut parameters = Vec::new();
        match packet[7] {
            1 => parameters.extend([0x06, 0x04, 0x26]),
            2 => {
                let (from, count) = (at(0)? + 256 * at(1)?, at(2)? + 256 * at(3)?);
                parameters.extend(self.table.get(from..from + count)?);
            }
            3 => {
                let from = at(0)? + 256 * at(1)?;
                let stopped = self.table[98] == 0xFF && matches!(from, 100..=119);
                if stopped || (from == 11 && self.table[64] == 1) {
                    error = 7;
                } else if from + plain.len() - 2 <= self.table.len() {
                    self.put(from, &plain[2..]);
                }
                if from == 64 && self.table[11] == 3 {
                    let place = (self.place.round() as i32).to_le_bytes();
                    self.put(116, &place);
                }
            }
            _ => error = 2,
        }
        let mut answer = vec![0xFF, 0xFF, 0xFD, 0, 1, 0, 0, 0x55, error];
        for byte in parameters {
            answer.push(byte);
            if answer.ends_with(&[0xFF, 0xFF, 0xFD]) {
                answer.push(0xFD);
            }
        }
        let length = (answer.len() - 5) as u16;
        answer[5..7].copy_from_slice(&length.to_le_bytes());
        answer.extend(checksum(&answer).to_le_bytes());
        Some(answer)
    }
}

impl DynamixelEmulator {
    /// A servo in the middle of its turn.
    ///
    /// # Errors
    /// Those of a socket on loopback.
    pub fn start() -> std::io::Result<Self> {
        let now = Instant::now();
        let faults = DynamixelFaults::default();
        let servo = Servo { table: [0; 200], place: 2048.0, heard: now, power: now, faults };
        let servo = Arc::new(Mutex::new(servo));
        let (address, life) = serve(&servo, Duration::from_micros(300), step)?;
        Ok(Self { address, servo, _life: life })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sets what goes wrong from now on.
    pub fn fail(&self, faults: DynamixelFaults) {
        lock(&self.servo).faults = faults;
    }

    /// Position in counts, speed in units of the servo.
    pub fn now(&self) -> (f64, i32) {
        let servo = lock(&self.servo);
        (servo.place, servo.long(128))
    }
}

fn step(stream: &mut TcpStream, bytes: &mut Vec<u8>, servo: &Mutex<Servo>) -> Option<()> {
    receive(stream, bytes)?;
    let length = match bytes.get(5..7) {
        Some([low, high]) => 7 + usize::from(*low) + 256 * usize::from(*high),
        _ => return Some(()),
    };
    if bytes.len() < length || length < 10 {
        return Some(());
    }
    let packet: Vec<u8> = bytes.drain(..length).collect();
    let (faults, answer) = {
        let mut servo = lock(servo);
        let answer = servo.obey(&packet);
        (servo.faults, answer)
    };
    let Some(mut answer) = answer.filter(|_| !faults.silent) else { return Some(()) };
    if faults.garbled
        && let Some(byte) = answer.last_mut()
    {
        *byte ^= 4;
    }
    let mut whole = if faults.echo { packet } else { Vec::new() };
    if faults.noise {
        whole.extend([0x00, 0xFF, 0xFF, 0x00]);
    }
    whole.extend(answer);
    for part in whole.chunks(if faults.in_pieces { 1 } else { whole.len() }) {
        stream.write_all(part).ok()?;
        if faults.in_pieces {
            std::thread::sleep(Duration::from_micros(50));
        }
    }
    Some(())
}
