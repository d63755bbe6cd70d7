use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::life::Life;
use super::session::lock;

/// What goes wrong with a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct UrFaults {
    /// Bytes that are sent at once; zero is all.
    pub pieces: usize,
    /// Nothing is sent.
    pub silent: bool,
    /// The link is cut, and none is taken.
    pub cut: bool,
    /// Each so-manyth package of data is left out; zero is none.
    pub lose_every: u32,
    /// Each so-manyth package of data has a wrong recipe; zero is none.
    pub garble_every: u32,
    /// A text is sent before each so-manyth package of data; zero is none.
    pub text_every: u32,
    /// The arm is in a protective stop.
    pub protective_stop: bool,
    /// The newest version of the protocol that it knows; zero is 2.
    pub newest_version: u16,
}

/// Where the emulated tool is, and what it was told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UrWorld {
    /// The tool in the base frame: m, and a rotation vector in rad.
    pub tool_in_base: [f64; 6],
    /// Its speed, m/s and rad/s.
    pub speed: [f64; 6],
    /// Force (N) and torque (N m) on it.
    pub force: [f64; 6],
    /// Number of the last command, and of the last one that was carried out.
    pub numbers: [i32; 2],
    /// Whether the controller's own watch has stopped the program on it.
    pub watch_stopped: bool,
}

struct Shared {
    world: UrWorld,
    faults: UrFaults,
}

/// A controller of Universal Robots on loopback, with a program on it that follows registers, and an arm that is a point.
#[derive(Debug)]
pub struct UrEmulator {
    address: SocketAddr,
    shared: Arc<Mutex<Shared>>,
    _life: Life,
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.world.fmt(f)
    }
}

/// The registers that are written, and a session's recipes.
struct Session {
    stream: TcpStream,
    bytes: Vec<u8>,
    version: u16,
    fields: Vec<String>,
    inputs: Vec<String>,
    period: Duration,
    started: bool,
    sent: u32,
    next: Instant,
    /// Controller's time at the start of the stream, s.
    zero_s: f64,
    heard: Instant,
    doubles: [f64; 8],
    integers: [i32; 3],
}

impl UrEmulator {
    /// A controller whose tool is at `tool_in_base` (m, rotation vector in rad), with a program that runs.
    ///
    /// # Errors
    /// Those of a socket on loopback.
    pub fn start(tool_in_base: [f64; 6]) -> std::io::Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let world =
            UrWorld { tool_in_base, speed: [0.0; 6], force: [0.0; 6], numbers: [0; 2], watch_stopped: false };
        let shared = Arc::new(Mutex::new(Shared { world, faults: UrFaults::default() }));
        let theirs = Arc::clone(&shared);
        let life = Life::begin(move |ended| serve(&listener, &theirs, ended))?;
        Ok(Self { address, shared, _life: life })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Sets what goes wrong from now on.
    pub fn fail(&self, faults: UrFaults) {
        lock(&self.shared).faults = faults;
    }

    /// Loads the tool, N and N m.
    pub fn push(&self, force: [f64; 6]) {
        lock(&self.shared).world.force = force;
    }

    /// What is so at present.
    pub fn world(&self) -> UrWorld {
        lock(&self.shared).world
    }

    /// A look at the world for another emulator, whose thread has its own.
    pub fn eye(&self) -> impl Fn() -> UrWorld + Send + use<> {
        let shared = Arc::clone(&self.shared);
        move || lock(&shared).world
    }
}

fn serve(listener: &TcpListener, shared: &Mutex<Shared>, ended: &AtomicBool) {
    let begin = Instant::now();
    let mut session: Option<Session> = None;
    let mut last = Instant::now();
    while !ended.load(Ordering::Relaxed) {
        let faults = lock(shared).faults;
        if faults.cut {
            session = None;
        } else if let Ok((stream, _)) = listener.accept() {
            session = Session::new(stream);
        }
        let dt = last.elapsed().as_secs_f64();
        last = Instant::now();
        match &mut session {
            Some(live) => {
                follow(&mut lock(shared).world, live, dt, faults.protective_stop);
                if live.step(shared, &faults, begin).is_none() {
                    session = None;
                }
            }
            // Nobody writes the register that is watched.
            None => halt(&mut lock(shared).world),
        }
        std::thread::sleep(Duration::from_micros(500));
    }
}

fn halt(world: &mut UrWorld) {
    world.speed = [0.0; 6];
}

/// The program on the controller, for `dt` seconds.
fn follow(world: &mut UrWorld, session: &Session, dt: f64, protective_stop: bool) {
    let [_, number, kind] = session.integers;
    world.numbers[0] = number;
    if session.heard.elapsed() > Duration::from_millis(100) && kind != 0 {
        world.watch_stopped = true;
    }
    if protective_stop || world.watch_stopped || kind == 0 {
        halt(world);
        if kind == 0 {
            (world.numbers[1], world.watch_stopped) = (number, false);
        }
        return;
    }
    let registers = session.doubles;
    if kind == 2 {
        world.speed.copy_from_slice(&registers[..6]);
    } else if world.numbers[1] == number {
        halt(world);
    } else {
        // Straight in place and in the rotation vector, which is a turn about one axis where poses share it.
        let way: Vec<f64> = world.tool_in_base.iter().zip(&registers).map(|(now, goal)| goal - now).collect();
        let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let (m, rad) = (size(&way[..3]), size(&way[3..]));
        let mut part: f64 = 1.0;
        for (left, most) in [(m, registers[6] * dt), (rad, registers[7] * dt)] {
            if left > most {
                part = part.min(most / left);
            }
        }
        let tool = world.tool_in_base.iter_mut().zip(&mut world.speed);
        for ((place, speed), way) in tool.zip(&way) {
            *speed = if dt > 0.0 { way * part / dt } else { 0.0 };
            *place += way * part;
        }
        if part >= 1.0 {
            world.numbers[1] = number;
        }
        return;
    }
    for (place, speed) in world.tool_in_base.iter_mut().zip(world.speed) {
        *place += speed * dt;
    }
}

fn type_of(field: &str) -> &'static str {
    match field {
        "timestamp" => "DOUBLE",
        "actual_q" | "actual_qd" | "actual_TCP_pose" | "actual_TCP_speed" | "actual_TCP_force" => "VECTOR6D",
        "safety_mode" | "output_int_register_0" => "INT32",
        _ if field.starts_with("input_double_register_") => "DOUBLE",
        _ if field.starts_with("input_int_register_") => "INT32",
        _ => "NOT_FOUND",
    }
}

impl Session {
    fn new(stream: TcpStream) -> Option<Self> {
        stream.set_nonblocking(true).ok()?;
        stream.set_nodelay(true).ok()?;
        Some(Self {
            stream,
            bytes: Vec::new(),
            version: 1,
            fields: Vec::new(),
            inputs: Vec::new(),
            period: Duration::from_millis(8),
            started: false,
            sent: 0,
            next: Instant::now(),
            zero_s: 0.0,
            heard: Instant::now(),
            doubles: [0.0; 8],
            integers: [0; 3],
        })
    }

    /// Reads, answers and streams; none where the client has gone.
    fn step(&mut self, shared: &Mutex<Shared>, faults: &UrFaults, begin: Instant) -> Option<()> {
        let mut bytes = [0; 4096];
        match self.stream.read(&mut bytes) {
            Ok(0) => return None,
            Ok(count) => self.bytes.extend(&bytes[..count]),
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            Err(_) => return None,
        }
        while self.bytes.len() >= 3 {
            let length = usize::from(u16::from_be_bytes([self.bytes[0], self.bytes[1]]));
            if self.bytes.len() < length.max(3) {
                break;
            }
            let package: Vec<u8> = self.bytes.drain(..length.max(3)).collect();
            self.obey(package[2], &package[3..], faults, begin)?;
        }
        if self.started && !faults.silent && Instant::now() >= self.next {
            self.next += self.period;
            self.sent += 1;
            if faults.text_every > 0 && self.sent.is_multiple_of(faults.text_every) {
                let text = b"\x05hello\x02me\x03";
                self.send(b'M', if self.version >= 2 { text } else { b"\x03hello" }, faults)?;
            }
            if faults.lose_every > 0 && self.sent.is_multiple_of(faults.lose_every) {
                return Some(());
            }
            let data = self.data(&lock(shared).world, faults);
            self.send(b'U', &data, faults)?;
        }
        Some(())
    }

    fn data(&self, world: &UrWorld, faults: &UrFaults) -> Vec<u8> {
        let mut data = Vec::new();
        if self.version >= 2 {
            let wrong = faults.garble_every > 0 && self.sent.is_multiple_of(faults.garble_every);
            data.push(if wrong { 99 } else { 7 });
        }
        for field in &self.fields {
            let six: [f64; 6] = match field.as_str() {
                "timestamp" => {
                    // A controller's own steps are even, whenever they are sent.
                    let t_s = self.zero_s + f64::from(self.sent) * self.period.as_secs_f64();
                    data.extend(t_s.to_be_bytes());
                    continue;
                }
                "safety_mode" => {
                    data.extend(if faults.protective_stop { 3i32 } else { 1 }.to_be_bytes());
                    continue;
                }
                "output_int_register_0" => {
                    data.extend(world.numbers[1].to_be_bytes());
                    continue;
                }
                "actual_TCP_pose" => world.tool_in_base,
                "actual_TCP_speed" => world.speed,
                "actual_TCP_force" => world.force,
                "actual_q" => [0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
                _ => [0.0; 6],
            };
            data.extend(six.iter().flat_map(|v| v.to_be_bytes()));
        }
        data
    }

    fn obey(&mut self, kind: u8, payload: &[u8], faults: &UrFaults, begin: Instant) -> Option<()> {
        let text =
            |bytes: &[u8]| String::from_utf8_lossy(bytes).split(',').map(str::to_owned).collect::<Vec<_>>();
        let types =
            |names: &[String]| names.iter().map(|n| type_of(n)).collect::<Vec<_>>().join(",").into_bytes();
        match kind {
            b'V' => {
                let wanted = u16::from_be_bytes([*payload.first()?, *payload.get(1)?]);
                let newest = if faults.newest_version == 0 { 2 } else { faults.newest_version };
                let known = (1..=newest).contains(&wanted);
                self.version = if known { wanted } else { self.version };
                self.send(b'V', &[u8::from(known)], faults)
            }
            b'O' => {
                let mut names = payload;
                let mut answer = Vec::new();
                if self.version >= 2 {
                    let rate = f64::from_be_bytes(payload.get(..8)?.try_into().ok()?);
                    self.period = Duration::from_secs_f64(1.0 / rate.clamp(1.0, 500.0));
                    names = &payload[8..];
                    answer.push(7);
                }
                self.fields = text(names);
                answer.extend(types(&self.fields));
                self.send(b'O', &answer, faults)
            }
            b'I' => {
                self.inputs = text(payload);
                let mut answer = vec![3];
                answer.extend(types(&self.inputs));
                self.send(b'I', &answer, faults)
            }
            b'S' => {
                (self.started, self.next) = (true, Instant::now());
                self.zero_s = begin.elapsed().as_secs_f64();
                self.send(b'S', &[1], faults)
            }
            b'U' => self.write(payload),
            _ => Some(()),
        }
    }

    fn write(&mut self, payload: &[u8]) -> Option<()> {
        if *payload.first()? != 3 {
            return Some(());
        }
        let mut at = 1;
        for name in &self.inputs {
            let number: usize = name.rsplit('_').next()?.parse().ok()?;
            if type_of(name) == "DOUBLE" {
                *self.doubles.get_mut(number)? =
                    f64::from_be_bytes(payload.get(at..at + 8)?.try_into().ok()?);
                at += 8;
            } else {
                *self.integers.get_mut(number)? =
                    i32::from_be_bytes(payload.get(at..at + 4)?.try_into().ok()?);
                at += 4;
            }
        }
        self.heard = Instant::now();
        Some(())
    }

    fn send(&mut self, kind: u8, payload: &[u8], faults: &UrFaults) -> Option<()> {
        let length = u16::try_from(payload.len() + 3).ok()?;
        let mut bytes = length.to_be_bytes().to_vec();
        bytes.push(kind);
        bytes.extend(payload);
        let piece = if faults.pieces == 0 { bytes.len() } else { faults.pieces };
        for part in bytes.chunks(piece) {
            let mut left = part;
            let begin = Instant::now();
            while !left.is_empty() {
                match self.stream.write(left) {
                    Ok(count) => left = &left[count..],
                    Err(e)
                        if e.kind() == ErrorKind::WouldBlock && begin.elapsed() < Duration::from_secs(1) =>
                    {
                        std::thread::sleep(Duration::from_micros(100));
                    }
                    Err(_) => return None,
                }
            }
            if piece < bytes.len() {
                std::thread::sleep(Duration::from_micros(50));
            }
        }
        Some(())
    }
}
