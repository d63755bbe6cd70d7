use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::life::Life;

/// What goes wrong with a sensor's records; each number counts records, zero is never.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AtiFaults {
    /// Each so-manyth record is not sent.
    pub lose_every: u32,
    /// Each so-manyth record is sent after the next one.
    pub swap_every: u32,
    /// Each so-manyth record is sent twice.
    pub double_every: u32,
    /// Each so-manyth packet is cut in half.
    pub cut_every: u32,
    /// The status word of the records.
    pub status: u32,
    /// The sensor is without power: nothing is answered; afterwards it counts from zero and streams to nobody.
    pub dark: bool,
}

/// An ATI Net F/T sensor that streams on loopback: 1,000,000 counts a newton and a newton metre, 7000 samples a second.
#[derive(Debug)]
pub struct AtiEmulator {
    address: SocketAddr,
    faults: Arc<Mutex<AtiFaults>>,
    sent: Arc<Mutex<u64>>,
    _life: Life,
}

struct Sensor<L> {
    socket: UdpSocket,
    load: L,
    faults: Arc<Mutex<AtiFaults>>,
    total: Arc<Mutex<u64>>,
    rate_hz: f64,
    power: Instant,
    listener: Option<SocketAddr>,
    begin: Instant,
    rdt: u32,
    bias: [f64; 6],
    held: Option<[u8; 36]>,
}

impl AtiEmulator {
    /// A sensor that feels `load` (N and N m) at a time since its power came on (s), and sends `rate_hz` records a second.
    ///
    /// # Errors
    /// Those of a socket on loopback.
    pub fn start(rate_hz: f64, load: impl FnMut(f64) -> [f64; 6] + Send + 'static) -> std::io::Result<Self> {
        let socket = UdpSocket::bind("127.0.0.1:0")?;
        socket.set_nonblocking(true)?;
        let address = socket.local_addr()?;
        let (faults, sent) = (Arc::default(), Arc::default());
        let mut sensor = Sensor {
            socket,
            load,
            faults: Arc::clone(&faults),
            total: Arc::clone(&sent),
            rate_hz,
            power: Instant::now(),
            listener: None,
            begin: Instant::now(),
            rdt: 0,
            bias: [0.0; 6],
            held: None,
        };
        let life = Life::begin(move |ended| {
            while !ended.load(Ordering::Relaxed) {
                sensor.step();
            }
        })?;
        Ok(Self { address, faults, sent, _life: life })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sets what goes wrong from now on.
    pub fn fail(&self, faults: AtiFaults) {
        *self.faults.lock().unwrap_or_else(PoisonError::into_inner) = faults;
    }

    /// Records that it has made so far, sent or not.
    pub fn records(&self) -> u64 {
        *self.sent.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn every(count: u32, number: u32) -> bool {
    count > 0 && number.is_multiple_of(count)
}

impl<L: FnMut(f64) -> [f64; 6]> Sensor<L> {
    fn step(&mut self) {
        let faults = *self.faults.lock().unwrap_or_else(PoisonError::into_inner);
        let mut request = [0; 64];
        let heard = self.socket.recv_from(&mut request);
        if faults.dark {
            (self.listener, self.power, self.held) = (None, Instant::now(), None);
            std::thread::sleep(Duration::from_millis(1));
            return;
        }
        if let Ok((8, from)) = heard {
            self.obey(&request, from);
        }
        let Some(listener) = self.listener else {
            std::thread::sleep(Duration::from_micros(500));
            return;
        };
        let due = (self.begin.elapsed().as_secs_f64() * self.rate_hz) as u32;
        while self.rdt < due {
            self.rdt += 1;
            self.send(&faults, listener);
        }
        std::thread::sleep(Duration::from_secs_f64((0.5 / self.rate_hz).min(1e-3)));
    }

    fn obey(&mut self, request: &[u8], from: SocketAddr) {
        if request[..2] != [0x12, 0x34] {
            return;
        }
        match request[3] {
            0 => self.listener = None,
            2 | 3 => (self.listener, self.begin, self.rdt) = (Some(from), Instant::now(), 0),
            0x42 => self.bias = (self.load)(self.power.elapsed().as_secs_f64()),
            _ => {}
        }
    }

    fn send(&mut self, faults: &AtiFaults, listener: SocketAddr) {
        // A record's number says when it was sampled, so that times are even, whenever it is sent.
        let t_s = self.begin.duration_since(self.power).as_secs_f64() + f64::from(self.rdt) / self.rate_hz;
        let felt = (self.load)(t_s);
        *self.total.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        let sample = (t_s * 7000.0) as u32;
        let mut bytes = [0; 36];
        bytes[0..4].copy_from_slice(&self.rdt.to_be_bytes());
        bytes[4..8].copy_from_slice(&sample.to_be_bytes());
        bytes[8..12].copy_from_slice(&faults.status.to_be_bytes());
        for (k, (felt, bias)) in felt.iter().zip(self.bias).enumerate() {
            let counts = ((felt - bias) * 1e6) as i32;
            bytes[12 + 4 * k..16 + 4 * k].copy_from_slice(&counts.to_be_bytes());
        }
        let number = self.rdt;
        // What the line does not take is lost, as on a line.
        let send = |bytes: &[u8]| drop(self.socket.send_to(bytes, listener));
        if every(faults.lose_every, number) {
            return;
        }
        if every(faults.swap_every, number) && self.held.is_none() {
            self.held = Some(bytes);
            return;
        }
        send(if every(faults.cut_every, number) { &bytes[..18] } else { &bytes });
        if every(faults.double_every, number) {
            send(&bytes);
        }
        if let Some(held) = self.held.take() {
            send(&held);
        }
    }
}

/// The sensor's pages: what it is set to, and a rate that can be set.
#[derive(Debug)]
pub struct AtiPages {
    address: SocketAddr,
    _life: Life,
}

impl AtiPages {
    /// Serves `netftapi2.xml` and `comm.cgi` on loopback.
    ///
    /// # Errors
    /// Those of a socket on loopback.
    pub fn start() -> std::io::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let life = Life::begin(move |ended: &AtomicBool| {
            let mut rate = String::from("7000");
            while !ended.load(Ordering::Relaxed) {
                let Ok((mut stream, _)) = listener.accept() else {
                    std::thread::sleep(Duration::from_millis(1));
                    continue;
                };
                let (mut asked, mut bytes) = (String::new(), [0; 512]);
                let _ = stream.set_nonblocking(false);
                let _ = stream.set_read_timeout(Some(Duration::from_millis(200)));
                while !asked.contains("\r\n\r\n") {
                    match stream.read(&mut bytes) {
                        Ok(count) if count > 0 => asked.push_str(&String::from_utf8_lossy(&bytes[..count])),
                        _ => break,
                    }
                }
                let path = asked.split(' ').nth(1).unwrap_or_default();
                let answer = if let Some(wanted) = path.strip_prefix("/comm.cgi?comrdtrate=") {
                    wanted.clone_into(&mut rate);
                    "HTTP/1.0 302 Found\r\n\r\n".to_owned()
                } else if path == "/netftapi2.xml" {
                    format!(
                        "HTTP/1.0 200 OK\r\n\r\n<?xml version=\"1.0\"?><netft><scfgfu>N</scfgfu><scfgtu>Nm</scfgtu>\
                         <cfgcpf>1000000</cfgcpf><cfgcpt>500000</cfgcpt><comrdtrate>{rate}</comrdtrate></netft>"
                    )
                } else {
                    "HTTP/1.0 404 Not Found\r\n\r\n".to_owned()
                };
                // A reader that has gone away has its answer.
                let _ = stream.write_all(answer.as_bytes());
            }
        })?;
        Ok(Self { address, _life: life })
    }

    /// Where they are served.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}
