use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use crate::error::{DriverError, within};

/// The largest package, bytes with its header: its length is 16 bits.
const LARGEST: usize = u16::MAX as usize;

/// The type of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are those of the guide")]
pub enum Type {
    Bool,
    Uint8,
    Uint32,
    Uint64,
    Int32,
    Double,
    Vector3d,
    Vector6d,
    Vector6Int32,
    Vector6Uint32,
}

/// The value of a field; vectors and whole numbers as doubles, which hold all of them but the largest 64-bit ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Value {
    /// Its numbers: one, three or six.
    pub numbers: Vec<f64>,
}

impl Type {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "BOOL" => Self::Bool,
            "UINT8" => Self::Uint8,
            "UINT32" => Self::Uint32,
            "UINT64" => Self::Uint64,
            "INT32" => Self::Int32,
            "DOUBLE" => Self::Double,
            "VECTOR3D" => Self::Vector3d,
            "VECTOR6D" => Self::Vector6d,
            "VECTOR6INT32" => Self::Vector6Int32,
            "VECTOR6UINT32" => Self::Vector6Uint32,
            _ => return None,
        })
    }

    /// How many numbers, and bytes of each.
    fn shape(self) -> (usize, usize) {
        match self {
            Self::Bool | Self::Uint8 => (1, 1),
            Self::Uint32 | Self::Int32 => (1, 4),
            Self::Uint64 | Self::Double => (1, 8),
            Self::Vector3d => (3, 8),
            Self::Vector6d => (6, 8),
            Self::Vector6Int32 | Self::Vector6Uint32 => (6, 4),
        }
    }

    fn number(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Self::Bool | Self::Uint8 => f64::from(*bytes.first()?),
            Self::Uint32 | Self::Vector6Uint32 => f64::from(u32::from_be_bytes(bytes.try_into().ok()?)),
            Self::Int32 | Self::Vector6Int32 => f64::from(i32::from_be_bytes(bytes.try_into().ok()?)),
            Self::Uint64 => u64::from_be_bytes(bytes.try_into().ok()?) as f64,
            Self::Double | Self::Vector3d | Self::Vector6d => f64::from_be_bytes(bytes.try_into().ok()?),
        })
    }

    fn write(self, number: f64, bytes: &mut Vec<u8>) {
        // Whole numbers are cut to their range by the cast.
        match self {
            Self::Bool | Self::Uint8 => bytes.push(number as u8),
            Self::Uint32 | Self::Vector6Uint32 => bytes.extend((number as u32).to_be_bytes()),
            Self::Int32 | Self::Vector6Int32 => bytes.extend((number as i32).to_be_bytes()),
            Self::Uint64 => bytes.extend((number as u64).to_be_bytes()),
            Self::Double | Self::Vector3d | Self::Vector6d => bytes.extend(number.to_be_bytes()),
        }
    }
}

/// A client of RTDE: recipes of outputs and inputs, packages of data.
#[derive(Debug)]
pub struct Rtde {
    device: String,
    stream: TcpStream,
    timeout: Duration,
    version: u16,
    received: Vec<u8>,
    outputs: (Option<u8>, Vec<Type>),
    inputs: (u8, Vec<Type>),
    /// The last text that the controller sent.
    text: Option<String>,
}

/// A package: its length with the header, its kind, what it holds.
fn packed(kind: u8, payload: &[u8]) -> Option<Vec<u8>> {
    let length = u16::try_from(payload.len() + 3).ok()?;
    let mut bytes = length.to_be_bytes().to_vec();
    bytes.push(kind);
    bytes.extend(payload);
    Some(bytes)
}

impl Rtde {
    /// Connects (port 30004 unless it is forwarded) and agrees on version 2, or 1 where the controller knows no other, or on
    /// `only` that one.
    ///
    /// # Errors
    /// [`DriverError::Link`], [`DriverError::Late`]; [`DriverError::Garbled`] where no version is agreed on.
    pub fn connect(address: SocketAddr, only: Option<u16>, timeout_s: f64) -> Result<Self, DriverError> {
        within("timeout in s", timeout_s, 1e-3, 10.0)?;
        let (device, timeout) = (format!("UR {address}"), Duration::from_secs_f64(timeout_s));
        let open = || -> std::io::Result<TcpStream> {
            let stream = TcpStream::connect_timeout(&address, timeout)?;
            stream.set_nodelay(true)?;
            stream.set_read_timeout(Some(timeout))?;
            stream.set_write_timeout(Some(timeout))?;
            Ok(stream)
        };
        let stream = open().map_err(|e| DriverError::of_io(&device, "connect", &e, timeout_s))?;
        let mut client = Self {
            device,
            stream,
            timeout,
            version: 1,
            received: Vec::new(),
            outputs: (None, Vec::new()),
            inputs: (0, Vec::new()),
            text: None,
        };
        let tried: Vec<u16> = only.map_or_else(|| vec![2, 1], |version| vec![version]);
        for version in &tried {
            client.send(b'V', &version.to_be_bytes())?;
            if client.answer(b'V')?.first() == Some(&1) {
                client.version = *version;
                return Ok(client);
            }
        }
        Err(client.garbled("a version that the controller accepts", format!("a refusal of {tried:?}")))
    }

    /// The version that was agreed on.
    pub fn version(&self) -> u16 {
        self.version
    }

    /// The last text that the controller sent, once.
    pub fn take_text(&mut self) -> Option<String> {
        self.text.take()
    }

    /// Asks for outputs at a rate; version 1 has the controller's own rate of 125 Hz. The types of the fields are returned.
    ///
    /// # Errors
    /// The link's; [`DriverError::Garbled`] where the controller does not know a field.
    pub fn outputs(&mut self, fields: &[&str], rate_hz: f64) -> Result<Vec<Type>, DriverError> {
        let mut payload = Vec::new();
        if self.version >= 2 {
            payload.extend(rate_hz.to_be_bytes());
        }
        payload.extend(fields.join(",").as_bytes());
        self.send(b'O', &payload)?;
        let answer = self.answer(b'O')?;
        let (recipe, types) = match answer.split_first() {
            Some((recipe, types)) if self.version >= 2 => (Some(*recipe), types.to_vec()),
            _ => (None, answer),
        };
        let types = self.types(fields, &types)?;
        self.outputs = (recipe, types.clone());
        Ok(types)
    }

    /// Announces inputs.
    ///
    /// # Errors
    /// As [`Rtde::outputs`]; also where another client has an input in use.
    pub fn inputs(&mut self, fields: &[&str]) -> Result<Vec<Type>, DriverError> {
        self.send(b'I', fields.join(",").as_bytes())?;
        let answer = self.answer(b'I')?;
        let (recipe, types) =
            answer.split_first().ok_or_else(|| self.garbled("a recipe", "nothing".into()))?;
        let types = self.types(fields, types)?;
        self.inputs = (*recipe, types.clone());
        Ok(types)
    }

    /// Starts the stream of outputs.
    ///
    /// # Errors
    /// The link's; [`DriverError::Garbled`] where the controller refuses.
    pub fn start(&mut self) -> Result<(), DriverError> {
        self.send(b'S', &[])?;
        match self.answer(b'S')?.first() {
            Some(1) => Ok(()),
            other => Err(self.garbled("a start that is accepted", format!("{other:?}"))),
        }
    }

    /// Sends inputs: the numbers of all announced fields, one after the other.
    ///
    /// # Errors
    /// The link's; [`DriverError::Limit`] for another count of numbers.
    pub fn write(&mut self, numbers: &[f64]) -> Result<(), DriverError> {
        let wanted: usize = self.inputs.1.iter().map(|t| t.shape().0).sum();
        within("count of input numbers", numbers.len() as f64, wanted as f64, wanted as f64)?;
        let mut payload = vec![self.inputs.0];
        let mut numbers = numbers.iter();
        for kind in &self.inputs.1 {
            for number in numbers.by_ref().take(kind.shape().0) {
                kind.write(*number, &mut payload);
            }
        }
        self.send(b'U', &payload)
    }

    /// Waits for the next package of outputs.
    ///
    /// # Errors
    /// The link's; [`DriverError::Garbled`] for a package of another recipe or length.
    pub fn read(&mut self) -> Result<Vec<Value>, DriverError> {
        let payload = self.answer(b'U')?;
        self.values(&payload)
    }

    /// As [`Rtde::read`], but of what has come the newest, whatever waits.
    ///
    /// # Errors
    /// As [`Rtde::read`].
    pub fn newest(&mut self) -> Result<Vec<Value>, DriverError> {
        self.skim()?;
        let payload = self.answer(b'U')?;
        self.values(&payload)
    }

    /// Takes what has come, without waiting, and keeps the newest package of outputs alone.
    pub(super) fn skim(&mut self) -> Result<(), DriverError> {
        self.take_what_is_there()?;
        let mut newest = None;
        while let Some((kind, payload)) = self.package()? {
            match kind {
                b'U' => newest = Some(payload),
                _ => self.keep_text(kind, &payload),
            }
        }
        if let Some(payload) = newest {
            // What follows is a piece of the next one.
            let rest = std::mem::take(&mut self.received);
            self.received = packed(b'U', &payload).unwrap_or_default();
            self.received.extend(rest);
        }
        Ok(())
    }

    fn values(&self, payload: &[u8]) -> Result<Vec<Value>, DriverError> {
        let (recipe, types) = &self.outputs;
        let mut bytes = payload;
        if let Some(expected) = recipe {
            let (got, rest) = payload.split_first().unwrap_or((&0, &[]));
            if got != expected {
                return Err(self.garbled("the recipe that was agreed on", format!("recipe {got}")));
            }
            bytes = rest;
        }
        let wanted: usize = types.iter().map(|t| t.shape().0 * t.shape().1).sum();
        if bytes.len() != wanted {
            return Err(self.garbled("data of the length of the recipe", format!("{} bytes", bytes.len())));
        }
        let mut values = Vec::with_capacity(types.len());
        for kind in types {
            let (count, size) = kind.shape();
            let (mine, rest) = bytes.split_at(count * size);
            bytes = rest;
            values.push(Value { numbers: mine.chunks_exact(size).filter_map(|b| kind.number(b)).collect() });
        }
        Ok(values)
    }

    fn types(&self, fields: &[&str], answer: &[u8]) -> Result<Vec<Type>, DriverError> {
        let answer = String::from_utf8_lossy(answer);
        let types: Vec<Option<Type>> = answer.split(',').map(Type::named).collect();
        if types.len() == fields.len()
            && let Some(types) = types.into_iter().collect()
        {
            return Ok(types);
        }
        Err(self.garbled("a type for each field", format!("{answer:?} for {fields:?}")))
    }

    fn garbled(&self, expected: &'static str, received: String) -> DriverError {
        DriverError::Garbled { device: self.device.clone(), expected, received }
    }

    fn send(&mut self, kind: u8, payload: &[u8]) -> Result<(), DriverError> {
        let bytes = packed(kind, payload)
            .ok_or_else(|| self.garbled("a payload of 16 bits", format!("{} bytes", payload.len())))?;
        let waited_s = self.timeout.as_secs_f64();
        let sent = self.stream.write_all(&bytes);
        sent.map_err(|e| DriverError::of_io(&self.device, "send", &e, waited_s))
    }

    /// The next package of a kind; texts are kept, data that nobody asked for are left.
    fn answer(&mut self, wanted: u8) -> Result<Vec<u8>, DriverError> {
        let begin = Instant::now();
        let waited_s = self.timeout.as_secs_f64();
        while begin.elapsed() < self.timeout {
            while let Some((kind, payload)) = self.package()? {
                if kind == wanted {
                    return Ok(payload);
                }
                self.keep_text(kind, &payload);
            }
            self.receive()?;
        }
        Err(DriverError::Late { device: self.device.clone(), waited_s })
    }

    fn receive(&mut self) -> Result<(), DriverError> {
        let mut bytes = [0; 4096];
        let waited_s = self.timeout.as_secs_f64();
        let lost =
            |error: &std::io::Error, device: &str| DriverError::of_io(device, "receive", error, waited_s);
        match self.stream.read(&mut bytes) {
            Ok(0) => Err(lost(&std::io::ErrorKind::ConnectionAborted.into(), &self.device)),
            Ok(count) => {
                self.received.extend(&bytes[..count]);
                Ok(())
            }
            Err(error) => Err(lost(&error, &self.device)),
        }
    }

    /// Takes what has come, without waiting.
    fn take_what_is_there(&mut self) -> Result<(), DriverError> {
        let failed = |device: &str, e: std::io::Error| DriverError::of_io(device, "receive", &e, 0.0);
        self.stream.set_nonblocking(true).map_err(|e| failed(&self.device, e))?;
        let taken = loop {
            match self.receive() {
                Ok(()) => {}
                ended => break ended,
            }
        };
        self.stream.set_nonblocking(false).map_err(|e| failed(&self.device, e))?;
        match taken {
            Err(DriverError::Late { .. }) => Ok(()),
            other => other,
        }
    }

    /// A whole package that has been received.
    fn package(&mut self) -> Result<Option<(u8, Vec<u8>)>, DriverError> {
        let [high, low, kind, ..] = self.received[..] else { return Ok(None) };
        let length = usize::from(u16::from_be_bytes([high, low]));
        if !(3..=LARGEST).contains(&length) {
            self.received.clear();
            return Err(self.garbled("a package of at least 3 bytes", format!("{length} bytes")));
        }
        if self.received.len() < length {
            return Ok(None);
        }
        let rest = self.received.split_off(length);
        let package = std::mem::replace(&mut self.received, rest);
        Ok(Some((kind, package[3..].to_vec())))
    }

    fn keep_text(&mut self, kind: u8, payload: &[u8]) {
        if kind != b'M' {
            return;
        }
        // Version 1: type and text; version 2: length and text, length and source, level.
        let text = match payload.split_first() {
            Some((length, rest)) if self.version >= 2 => rest.get(..usize::from(*length)).unwrap_or(rest),
            Some((_, rest)) => rest,
            None => payload,
        };
        self.text = Some(String::from_utf8_lossy(text).into_owned());
    }
}
