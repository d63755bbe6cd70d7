use rmodbus::ModbusProto;
use rmodbus::client::ModbusRequest;

use super::{Answer, Registers, Request};
use crate::error::DriverError;
use crate::line::{Line, Opener};

/// First register that is written, and that is read.
const WRITTEN: u16 = 0x03E8;
const READ: u16 = 0x07D0;

/// Registers by Modbus, in frames of RTU or of TCP.
pub(super) struct Modbus {
    line: Line,
    unit: u8,
    rtu: bool,
    transaction: u16,
}

impl Modbus {
    pub(super) fn new(
        device: String,
        open: Opener,
        unit: u8,
        rtu: bool,
        timeout_s: f64,
    ) -> Result<Self, DriverError> {
        Ok(Self { line: Line::new(device, open, timeout_s)?, unit, rtu, transaction: 0 })
    }

    fn begin(&mut self) -> ModbusRequest {
        self.transaction = self.transaction.wrapping_add(1);
        if self.rtu {
            ModbusRequest::new(self.unit, ModbusProto::Rtu)
        } else {
            ModbusRequest::new_tcp_udp(self.unit, self.transaction)
        }
    }

    fn ask(&mut self, question: &[u8]) -> Result<Vec<u8>, DriverError> {
        let proto = if self.rtu { ModbusProto::Rtu } else { ModbusProto::TcpUdp };
        let enough = if self.rtu { 5 } else { 9 };
        self.line.ask(question, |bytes| {
            // Of what is no frame all is taken; the check refuses it.
            let length = (bytes.len() >= enough)
                .then(|| rmodbus::guess_response_frame_len(bytes, proto).map_or(bytes.len(), usize::from))?;
            (bytes.len() >= length).then_some(length)
        })
    }

    fn refuse(&mut self, error: rmodbus::ErrorKind, answer: &[u8]) -> DriverError {
        self.line.hang_up();
        self.line.garbled("an answer of Modbus to this question", (error, answer))
    }
}

impl Registers for Modbus {
    fn write(&mut self, request: &Request) -> Result<(), DriverError> {
        let Request { activate, go, position, speed, force } = *request;
        let action = u16::from(activate) | u16::from(go) << 3;
        let registers = [action << 8, u16::from(position), u16::from(speed) << 8 | u16::from(force)];
        let (mut frame, mut question) = (self.begin(), Vec::new());
        frame
            .generate_set_holdings_bulk(WRITTEN, &registers, &mut question)
            .map_err(|e| self.line.garbled("a question of Modbus", e))?;
        let answer = self.ask(&question)?;
        frame.parse_ok(&answer).map_err(|e| self.refuse(e, &answer))
    }

    fn read(&mut self) -> Result<Answer, DriverError> {
        let (mut frame, mut question) = (self.begin(), Vec::new());
        frame
            .generate_get_holdings(READ, 3, &mut question)
            .map_err(|e| self.line.garbled("a question of Modbus", e))?;
        let answer = self.ask(&question)?;
        let mut registers: Vec<u16> = Vec::new();
        frame.parse_u16(&answer, &mut registers).map_err(|e| self.refuse(e, &answer))?;
        let [first, second, third] = registers[..] else {
            self.line.hang_up();
            return Err(self.line.garbled("three registers", registers));
        };
        let ([status, _], [fault, echo], [position, _]) =
            (first.to_be_bytes(), second.to_be_bytes(), third.to_be_bytes());
        let (object, status) = (status >> 6 & 3, status >> 4 & 3);
        Ok(Answer { status, object, fault: fault & 0x0F, echo, position })
    }

    fn device(&self) -> &str {
        &self.line.device
    }
}
