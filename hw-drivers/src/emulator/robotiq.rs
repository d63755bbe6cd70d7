use std::io::Write as _;
use std::net::{SocketAddr, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::life::Life;
use super::session::{Served, lock, receive, serve};

/// How a gripper is spoken to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RobotiqProtocol {
    /// The URCap's lines of text.
    UrCap,
    /// Modbus frames with a checksum.
    Rtu,
    /// Modbus frames with a header.
    Tcp,
}

/// What goes wrong with a gripper.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RobotiqFaults {
    /// Answers come byte by byte.
    pub in_pieces: bool,
    /// No answer is given.
    pub silent: bool,
    /// The line is cut, and none is taken.
    pub cut: bool,
    /// Answers have a wrong byte.
    pub garbled: bool,
    /// The fault register.
    pub fault: u8,
    /// Something lies between the fingers: they do not close beyond so many counts; zero is nothing.
    pub object_at: u8,
}

#[derive(Debug, Clone, Copy, Default)]
struct Hand {
    activated: bool,
    going: bool,
    goal: f64,
    speed: f64,
    force: u8,
    place: f64,
    held: u8,
    faults: RobotiqFaults,
}

/// A two-finger gripper on loopback: 54 counts a second at speed 0 (20 mm/s of a 2F-85), 406 at 255.
#[derive(Debug)]
pub struct RobotiqEmulator {
    address: SocketAddr,
    hand: Arc<Mutex<Hand>>,
    _life: Life,
}

impl Served for Hand {
    fn advance(&mut self, dt: f64) {
        if !(self.activated && self.going) {
            return;
        }
        let counts_per_s = 54.0 + (406.0 - 54.0) * self.speed / 255.0;
        let step = (self.goal - self.place).clamp(-counts_per_s * dt, counts_per_s * dt);
        let stopped_at = f64::from(self.faults.object_at);
        let closing = step > 0.0;
        self.place += step;
        self.held = 0;
        if closing && stopped_at > 0.0 && self.place >= stopped_at {
            (self.place, self.held) = (stopped_at, 2);
        } else if self.place == self.goal {
            self.held = 3;
        }
    }

    fn is_cut(&self) -> bool {
        self.faults.cut
    }
}

impl Hand {
    fn set(&mut self, action: u8, position: u8, speed: u8, force: u8) {
        self.activated = action & 1 != 0;
        self.going = action & 8 != 0;
        (self.goal, self.speed, self.force) = (f64::from(position), f64::from(speed), force);
        if self.going {
            self.held = if self.place == self.goal { 3 } else { 0 };
        }
    }

    fn status(&self) -> u8 {
        let state = if self.activated { 3 } else { 0 };
        u8::from(self.activated) | u8::from(self.going) << 3 | state << 4 | self.held << 6
    }
}

impl RobotiqEmulator {
    /// A gripper that is open and not activated.
    ///
    /// # Errors
    /// Those of a socket on loopback.
    pub fn start(protocol: RobotiqProtocol) -> std::io::Result<Self> {
        let hand = Arc::new(Mutex::new(Hand::default()));
        let answers = move |stream: &mut TcpStream, bytes: &mut Vec<u8>, hand: &Mutex<Hand>| {
            step(stream, bytes, hand, protocol)
        };
        let (address, life) = serve(&hand, Duration::from_micros(500), answers)?;
        Ok(Self { address, hand, _life: life })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sets what goes wrong from now on.
    pub fn fail(&self, faults: RobotiqFaults) {
        lock(&self.hand).faults = faults;
    }

    /// Position (counts), whether it goes to a position, and the force register.
    pub fn now(&self) -> (f64, bool, u8) {
        let hand = lock(&self.hand);
        (hand.place, hand.going, hand.force)
    }
}

fn step(
    stream: &mut TcpStream,
    bytes: &mut Vec<u8>,
    hand: &Mutex<Hand>,
    protocol: RobotiqProtocol,
) -> Option<()> {
    let faults = lock(hand).faults;
    receive(stream, bytes)?;
    let answered = match protocol {
        RobotiqProtocol::UrCap => text(bytes, hand),
        RobotiqProtocol::Rtu => rtu(bytes, hand),
        RobotiqProtocol::Tcp => header(bytes, hand),
    };
    let Some(mut answer) = answered.filter(|_| !faults.silent) else { return Some(()) };
    if faults.garbled
        && let Some(byte) = answer.get_mut(2)
    {
        *byte ^= 0x15;
    }
    for part in answer.chunks(if faults.in_pieces { 1 } else { answer.len().max(1) }) {
        stream.write_all(part).ok()?;
        if faults.in_pieces {
            std::thread::sleep(Duration::from_micros(100));
        }
    }
    Some(())
}

fn text(bytes: &mut Vec<u8>, hand: &Mutex<Hand>) -> Option<Vec<u8>> {
    let end = bytes.iter().position(|b| *b == b'\n')?;
    let line: Vec<u8> = bytes.drain(..=end).collect();
    let line = String::from_utf8_lossy(&line).into_owned();
    let words: Vec<&str> = line.split_whitespace().collect();
    let mut hand = lock(hand);
    if let ["GET", name] = words[..] {
        let status = hand.status();
        let value = match name {
            "STA" => status >> 4 & 3,
            "OBJ" => status >> 6,
            "FLT" => hand.faults.fault,
            "PRE" => hand.goal as u8,
            "POS" => hand.place as u8,
            _ => return Some(b"?\n".to_vec()),
        };
        return Some(format!("{name} {value}\n").into_bytes());
    }
    let mut action = hand.status() & 9;
    let (mut position, mut speed, mut force) = (hand.goal as u8, hand.speed as u8, hand.force);
    for pair in words.get(1..)?.chunks(2) {
        let value: u8 = pair.get(1)?.parse().ok()?;
        match pair[0] {
            "ACT" => action = action & 8 | value,
            "GTO" => action = action & 1 | value << 3,
            "POS" => position = value,
            "SPE" => speed = value,
            "FOR" => force = value,
            _ => return Some(b"?\n".to_vec()),
        }
    }
    hand.set(action, position, speed, force);
    Some(b"ack".to_vec())
}

/// What a function answers: the bytes between unit and checksum.
fn function(unit: u8, body: &[u8], hand: &Mutex<Hand>) -> Option<Vec<u8>> {
    let mut hand = lock(hand);
    match body {
        [0x10, 0x03, 0xE8, 0, 3, 6, action, _, _, position, speed, force] => {
            hand.set(*action, *position, *speed, *force);
            Some(vec![unit, 0x10, 0x03, 0xE8, 0, 3])
        }
        [0x03, 0x07, 0xD0, 0, 3] => {
            let (status, fault) = (hand.status(), hand.faults.fault);
            Some(vec![unit, 3, 6, status, 0, fault, hand.goal as u8, hand.place as u8, 0])
        }
        [code, ..] => Some(vec![unit, code | 0x80, 2]),
        [] => None,
    }
}

/// The checksum of Modbus, bit by bit.
fn checksum(bytes: &[u8]) -> [u8; 2] {
    let mut sum = 0xFFFFu16;
    for byte in bytes {
        sum ^= u16::from(*byte);
        for _ in 0..8 {
            sum = if sum & 1 == 1 { sum >> 1 ^ 0xA001 } else { sum >> 1 };
        }
    }
    sum.to_le_bytes()
}

fn rtu(bytes: &mut Vec<u8>, hand: &Mutex<Hand>) -> Option<Vec<u8>> {
    let length = match bytes.get(1)? {
        0x10 => 9 + usize::from(*bytes.get(6)?),
        _ => 8,
    };
    if bytes.len() < length {
        return None;
    }
    let frame: Vec<u8> = bytes.drain(..length).collect();
    let (body, sum) = frame.split_at(length - 2);
    if checksum(body) != sum {
        return None;
    }
    let mut answer = function(body[0], &body[1..], hand)?;
    answer.extend(checksum(&answer));
    Some(answer)
}

fn header(bytes: &mut Vec<u8>, hand: &Mutex<Hand>) -> Option<Vec<u8>> {
    let length = 6 + usize::from(*bytes.get(5)?);
    if bytes.len() < length {
        return None;
    }
    let frame: Vec<u8> = bytes.drain(..length).collect();
    let answer = function(*frame.get(6)?, &frame[7..], hand)?;
    let mut whole = vec![frame[0], frame[1], 0, 0, 0, u8::try_from(answer.len()).ok()?];
    whole.extend(answer);
    Some(whole)
}
