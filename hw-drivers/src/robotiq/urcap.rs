use super::{Answer, Registers, Request};
use crate::error::DriverError;
use crate::line::{Line, Opener};

/// Lines of text: `SET POS 100 SPE 255` is answered `ack`, `GET POS` by `POS 100`.
pub(super) struct UrCap {
    line: Line,
}

/// The end of an answer: `ack` has no end of line, others may have none either.
fn is_ack(bytes: &[u8]) -> Option<usize> {
    (bytes.len() >= 3).then_some(bytes.len())
}

impl UrCap {
    pub(super) fn new(device: String, open: Opener, timeout_s: f64) -> Result<Self, DriverError> {
        Ok(Self { line: Line::new(device, open, timeout_s)? })
    }

    fn get(&mut self, name: &'static str) -> Result<u8, DriverError> {
        let whole = |bytes: &[u8]| bytes.iter().position(|b| *b == b'\n').map(|at| at + 1);
        let answer = self.line.ask(format!("GET {name}\n").as_bytes(), whole)?;
        let answer = String::from_utf8_lossy(&answer).trim().to_owned();
        let value = answer.strip_prefix(name).and_then(|rest| rest.trim().parse().ok());
        value.ok_or_else(|| {
            self.line.hang_up();
            self.line.garbled("a variable and its value", &answer)
        })
    }
}

impl Registers for UrCap {
    fn write(&mut self, request: &Request) -> Result<(), DriverError> {
        let Request { activate, go, position, speed, force } = request;
        let (activate, go) = (u8::from(*activate), u8::from(*go));
        let words = format!("SET ACT {activate} GTO {go} POS {position} SPE {speed} FOR {force}\n");
        let answer = self.line.ask(words.as_bytes(), is_ack)?;
        if answer.starts_with(b"ack") {
            return Ok(());
        }
        self.line.hang_up();
        Err(self.line.garbled("ack", String::from_utf8_lossy(&answer)))
    }

    fn read(&mut self) -> Result<Answer, DriverError> {
        // The echo before the object: an object that is older than the echo would speak of an earlier command.
        let (echo, object) = (self.get("PRE")?, self.get("OBJ")?);
        let (status, fault, position) = (self.get("STA")?, self.get("FLT")?, self.get("POS")?);
        Ok(Answer { status, object, fault, echo, position })
    }

    fn device(&self) -> &str {
        &self.line.device
    }
}
