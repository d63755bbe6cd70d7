//! A line of bytes to a device: TCP, a serial port, or anything that reads and writes.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use crate::error::{DriverError, within};

/// What carries bytes both ways; a read has to end within some time-out, with `WouldBlock` or `TimedOut`.
pub trait Port: Read + Write + Send {}
impl<P: Read + Write + Send> Port for P {}

/// Opens a line, and opens it again where it broke.
pub type Opener = Box<dyn FnMut() -> std::io::Result<Box<dyn Port>> + Send>;

/// Opens TCP connections; no read waits longer than `timeout_s`.
pub fn tcp(address: SocketAddr, timeout_s: f64) -> Opener {
    let timeout = Duration::try_from_secs_f64(timeout_s).unwrap_or(Duration::from_secs(1));
    Box::new(move || {
        let stream = TcpStream::connect_timeout(&address, timeout)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(timeout))?;
        stream.set_write_timeout(Some(timeout))?;
        Ok(Box::new(stream))
    })
}

/// Opens a serial port of this computer (`/dev/ttyUSB0`, `COM3`), 8 data bits, no parity, 1 stop bit; no read waits longer than `timeout_s`.
#[cfg(feature = "serial")]
pub fn serial(path: &str, baud: u32, timeout_s: f64) -> Opener {
    let path = path.to_owned();
    let timeout = Duration::try_from_secs_f64(timeout_s).unwrap_or(Duration::from_secs(1));
    Box::new(move || {
        let mut port = serial2::SerialPort::open(&path, baud)?;
        port.set_read_timeout(timeout)?;
        port.set_write_timeout(timeout)?;
        Ok(Box::new(port))
    })
}

/// Questions and answers on a line.
pub(crate) struct Line {
    pub(crate) device: String,
    open: Opener,
    port: Option<Box<dyn Port>>,
    timeout: Duration,
}

impl Line {
    pub(crate) fn new(device: String, open: Opener, timeout_s: f64) -> Result<Self, DriverError> {
        within("timeout in s", timeout_s, 1e-3, 10.0)?;
        Ok(Self { device, open, port: None, timeout: Duration::from_secs_f64(timeout_s) })
    }

    /// Sends a question and waits until `complete` finds an answer's end in what has come; what came before the question is left out.
    ///
    /// A line that broke is closed, and opened by the next question; so is one whose answer was late, since the answer may still come.
    pub(crate) fn ask(
        &mut self,
        question: &[u8],
        complete: impl FnMut(&[u8]) -> Option<usize>,
    ) -> Result<Vec<u8>, DriverError> {
        let answer = self.try_ask(question, complete);
        if answer.is_err() {
            self.port = None;
        }
        let waited_s = self.timeout.as_secs_f64();
        answer.map_err(|e| DriverError::of_io(&self.device, "ask", &e, waited_s))
    }

    /// Sends what has no answer.
    #[cfg(feature = "dcon")]
    pub(crate) fn tell(&mut self, words: &[u8]) -> Result<(), DriverError> {
        self.ask(words, |_| Some(0)).map(drop)
    }

    fn try_ask(
        &mut self,
        question: &[u8],
        mut complete: impl FnMut(&[u8]) -> Option<usize>,
    ) -> std::io::Result<Vec<u8>> {
        let port = match &mut self.port {
            Some(port) => port,
            none => none.insert((self.open)()?),
        };
        port.write_all(question)?;
        port.flush()?;
        let (begin, mut received, mut bytes) = (Instant::now(), Vec::new(), [0; 512]);
        loop {
            if let Some(end) = complete(&received) {
                received.truncate(end);
                return Ok(received);
            }
            if begin.elapsed() >= self.timeout || received.len() > 1 << 16 {
                return Err(ErrorKind::TimedOut.into());
            }
            match port.read(&mut bytes) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => received.extend(&bytes[..count]),
                Err(e)
                    if [ErrorKind::WouldBlock, ErrorKind::TimedOut, ErrorKind::Interrupted]
                        .contains(&e.kind()) => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// Whether it is open: a beat is no reason to open it.
    #[cfg(any(feature = "dcon", feature = "dynamixel"))]
    pub(crate) fn is_open(&self) -> bool {
        self.port.is_some()
    }

    #[cfg(any(feature = "dcon", feature = "dynamixel", feature = "robotiq"))]
    /// Closes the line; the next question opens it.
    pub(crate) fn hang_up(&mut self) {
        self.port = None;
    }

    pub(crate) fn garbled(&self, expected: &'static str, received: impl std::fmt::Debug) -> DriverError {
        DriverError::Garbled { device: self.device.clone(), expected, received: format!("{received:?}") }
    }
}
