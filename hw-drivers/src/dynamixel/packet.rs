use crc::{CRC_16_UMTS, Crc};

use crate::error::DriverError;
use crate::line::{Line, Opener};

/// Polynomial 0x8005 from zero, not reflected: the maker's table.
const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_UMTS);
const BEGIN: [u8; 4] = [0xFF, 0xFF, 0xFD, 0x00];
const PING: u8 = 0x01;
const READ: u8 = 0x02;
const WRITE: u8 = 0x03;
const STATUS: u8 = 0x55;

/// Servos on one line, by number.
pub struct Bus {
    line: Line,
}

/// A packet: an instruction or a status with what belongs to it.
fn packet(id: u8, instruction: u8, parameters: &[u8]) -> Vec<u8> {
    let mut body = vec![instruction];
    for byte in parameters {
        body.push(*byte);
        // Within a packet its own beginning is broken by another 0xFD.
        if body.ends_with(&BEGIN[..3]) {
            body.push(0xFD);
        }
    }
    let mut bytes = BEGIN.to_vec();
    bytes.push(id);
    // Parameters are at most a few hundred bytes here.
    bytes.extend(u16::try_from(body.len() + 2).unwrap_or(u16::MAX).to_le_bytes());
    bytes.extend(body);
    bytes.extend(CRC.checksum(&bytes).to_le_bytes());
    bytes
}

/// Where the first whole packet begins and ends; noise before it is skipped.
fn find(bytes: &[u8]) -> Option<(usize, usize)> {
    let begin = bytes.windows(4).position(|w| w == BEGIN)?;
    let (low, high) = (bytes.get(begin + 5)?, bytes.get(begin + 6)?);
    let end = begin + 7 + usize::from(u16::from_le_bytes([*low, *high]));
    (bytes.len() >= end).then_some((begin, end))
}

/// What the manual says of a status packet's error.
fn words_of(error: u8) -> &'static str {
    match error & 0x7F {
        0 => "a hardware error: see its register Hardware Error Status",
        1 => "it could not carry the instruction out",
        2 => "it does not know the instruction",
        3 => "the packet was damaged on its way",
        4 => "a value is outside its range",
        5 => "a value is shorter than its register",
        6 => "a value is outside the limits that are set in it",
        7 => "the register cannot be written now",
        _ => "an error that the manual does not list",
    }
}

impl Bus {
    /// A line with servos.
    ///
    /// # Errors
    /// [`DriverError::Limit`] for a time-out that is none.
    pub fn new(name: &str, open: Opener, timeout_s: f64) -> Result<Self, DriverError> {
        Ok(Self { line: Line::new(format!("Dynamixel {name}"), open, timeout_s)? })
    }

    /// Model and firmware of a servo.
    ///
    /// # Errors
    /// The line's and the servo's.
    pub fn ping(&mut self, id: u8) -> Result<(u16, u8), DriverError> {
        match self.ask(id, PING, &[])?[..] {
            [low, high, firmware] => Ok((u16::from_le_bytes([low, high]), firmware)),
            ref other => Err(self.line.garbled("model and firmware", other)),
        }
    }

    /// Reads registers from an address on.
    ///
    /// # Errors
    /// The line's and the servo's.
    pub fn read(&mut self, id: u8, address: u16, count: u16) -> Result<Vec<u8>, DriverError> {
        let [[a, b], [c, d]] = [address.to_le_bytes(), count.to_le_bytes()];
        let answer = self.ask(id, READ, &[a, b, c, d])?;
        if answer.len() == usize::from(count) {
            return Ok(answer);
        }
        Err(self.line.garbled("as many bytes as were asked for", answer))
    }

    /// Writes registers from an address on.
    ///
    /// # Errors
    /// The line's and the servo's.
    pub fn write(&mut self, id: u8, address: u16, bytes: &[u8]) -> Result<(), DriverError> {
        let parameters = [&address.to_le_bytes()[..], bytes].concat();
        self.ask(id, WRITE, &parameters).map(drop)
    }

    pub(super) fn is_open(&self) -> bool {
        self.line.is_open()
    }

    pub(super) fn device(&self) -> String {
        self.line.device.clone()
    }

    fn ask(&mut self, id: u8, instruction: u8, parameters: &[u8]) -> Result<Vec<u8>, DriverError> {
        let question = packet(id, instruction, parameters);
        let echo = question.clone();
        // A line of one wire hears itself: its own question is no answer.
        let mut place = (0, 0);
        let answer = self.line.ask(&question, |bytes| {
            let skipped = if bytes.starts_with(&echo) { echo.len() } else { 0 };
            let (begin, end) = find(bytes.get(skipped..)?)?;
            place = (begin + skipped, end + skipped);
            Some(place.1)
        })?;
        let answer = answer.get(place.0..place.1).unwrap_or_default();
        let Some((body, sum)) = answer.split_last_chunk::<2>() else {
            return Err(self.refuse("a packet", answer));
        };
        if CRC.checksum(body).to_le_bytes() != *sum {
            return Err(self.refuse("a packet with its checksum", answer));
        }
        let [_, _, _, _, from, _, _, STATUS, error, parameters @ ..] = body else {
            return Err(self.refuse("a status packet", answer));
        };
        if *from != id {
            return Err(self.refuse("a status of the servo that was asked", answer));
        }
        if *error != 0 {
            let (device, words) = (format!("{} servo {id}", self.line.device), words_of(*error));
            return Err(DriverError::Device { device, words, code: u32::from(*error) });
        }
        let mut plain: Vec<u8> = Vec::with_capacity(parameters.len());
        let mut stuffed = false;
        for byte in parameters {
            if !stuffed {
                plain.push(*byte);
            }
            stuffed = !stuffed && plain.ends_with(&BEGIN[..3]);
        }
        Ok(plain)
    }

    fn refuse(&mut self, expected: &'static str, received: &[u8]) -> DriverError {
        self.line.hang_up();
        self.line.garbled(expected, received)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The packets that the maker prints: Ping, Read and Write of Protocol 2.0.
    #[test]
    fn packets_are_those_of_the_maker() {
        assert_eq!(packet(1, PING, &[]), [0xFF, 0xFF, 0xFD, 0, 1, 3, 0, 1, 0x19, 0x4E]);
        let read = [0xFF, 0xFF, 0xFD, 0, 1, 7, 0, 2, 0x84, 0, 4, 0, 0x1D, 0x15];
        assert_eq!(packet(1, READ, &[0x84, 0, 4, 0]), read);
        let write = [0xFF, 0xFF, 0xFD, 0, 1, 9, 0, 3, 0x74, 0, 0, 2, 0, 0, 0xCA, 0x89];
        assert_eq!(packet(1, WRITE, &[0x74, 0, 0, 2, 0, 0]), write);
    }

    #[test]
    fn a_packet_never_holds_its_own_beginning() {
        let bytes = packet(1, WRITE, &[0xFF, 0xFF, 0xFD, 0xFF, 0xFF, 0xFD]);
        assert_eq!(bytes[8..16], [0xFF, 0xFF, 0xFD, 0xFD, 0xFF, 0xFF, 0xFD, 0xFD]);
        assert_eq!(find(&bytes), Some((0, bytes.len())));
        let noisy = [&[0xFF, 0xFF, 0x00][..], &bytes].concat();
        assert_eq!(find(&noisy), Some((3, noisy.len())));
        assert_eq!(find(&noisy[..noisy.len() - 1]), None);
    }
}
