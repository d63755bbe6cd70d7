use std::net::SocketAddr;
use std::time::{Duration, Instant};

use hw_drivers::DriverError;
use hw_drivers::ati::{NetFt, NetFtSettings};
use hw_drivers::dcon::{Gauge, GaugeSettings};
use hw_drivers::depth_folder::DepthFolder;
use hw_drivers::dynamixel::{Bus, ServoReader};
use hw_drivers::line::{Opener, serial, tcp};
use hw_drivers::robotiq::{Robotiq, RobotiqSettings};
use hw_drivers::ur::Rtde;
use hw_drivers::wav::WavMicrophones;
use hw_traits::camera::DepthCamera as _;
use hw_traits::force_torque::ForceTorque as _;
use hw_traits::gripper::Gripper as _;
use hw_traits::microphones::Microphones;
use hw_traits::picture::{Intrinsics, Picture};
use hw_traits::pneumatics::Pressure as _;

use crate::error::SourceError;
use crate::given::Given;

/// How long a device on a line may take to answer, s.
const TIMEOUT_S: f64 = 0.5;
/// Devices that answer when they are asked are asked so often.
const PERIOD: Duration = Duration::from_millis(10);
/// Instants of sound in one reading, s.
const BLOCK_S: f64 = 0.05;

/// What a device gives.
#[derive(Debug, Clone, PartialEq)]
pub enum Contents {
    /// A number for each column.
    Numbers(Vec<f64>),
    /// Samples from -1 to 1, channel after channel for each instant.
    Sound(Vec<f32>),
    /// Depths in m, NaN where none is seen.
    Depth(Picture<f32>),
}

/// A reading with its time on the device's clock.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Time on the device's clock, s.
    pub t_s: f64,
    /// What was read.
    pub contents: Contents,
}

/// What all readings of a source are.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// Numbers: the columns, with units.
    Numbers(Vec<String>),
    /// Sound of so many microphones, at so many samples a second of each.
    Sound {
        /// Microphones.
        channels: u16,
        /// Samples a second.
        rate_hz: u32,
    },
    /// Depth pictures.
    Depth {
        /// The camera's pinhole.
        intrinsics: Intrinsics,
        /// What a count of a stored picture is, m.
        unit_m: f64,
    },
}

/// Waits for a reading.
pub type Next = Box<dyn FnMut() -> Result<Reading, DriverError> + Send>;

/// A stream of readings that can be recorded.
pub struct Source {
    /// Its name: that of its file or topic.
    pub name: String,
    /// What its readings are.
    pub kind: Kind,
    /// Waits for a reading.
    pub next: Next,
}

fn words(of: &[&str]) -> Vec<String> {
    of.iter().map(|w| (*w).to_owned()).collect()
}

fn numbers(t_s: f64, numbers: Vec<f64>) -> Reading {
    Reading { t_s, contents: Contents::Numbers(numbers) }
}

/// A source by its kind and address, `KIND=ADDRESS` or `NAME:KIND=ADDRESS`, with what else it needs as in `dcon=192.0.2.3:4001?module=1&pa=200000`
/// (the README lists all). Nothing is moved, and nothing is set.
///
/// # Errors
/// [`SourceError`].
pub fn source(given: &str) -> Result<Source, SourceError> {
    let given = Given::parse(given)?;
    let name = given.name.clone();
    let (kind, next): (Kind, Next) = match given.kind.as_str() {
        "ati" => wrenches(&given)?,
        "ur" => arm(given.socket()?),
        "robotiq" => {
            let mut gripper = Robotiq::by_urcap(given.socket()?, RobotiqSettings::default())?;
            let mut paced = paced();
            let next = move || {
                paced();
                gripper.width_m().map(|w| numbers(w.t_s, vec![w.value]))
            };
            (Kind::Numbers(words(&["width_m"])), Box::new(next))
        }
        "dynamixel" => servo(&given)?,
        "dcon" => gauge(&given)?,
        "depth" => depth(&given)?,
        "wav" => {
            let file = WavMicrophones::open(&given.address)?;
            let begin = Instant::now();
            // A file is heard at its own pace.
            let wait = move |end_s: f64| {
                let due = Duration::try_from_secs_f64(end_s).unwrap_or_default();
                std::thread::sleep(due.saturating_sub(begin.elapsed()));
            };
            sound(file, wait)
        }
        #[cfg(feature = "cpal")]
        "microphones" => sound_card()?,
        _ => return Err(given.wrong()),
    };
    Ok(Source { name, kind, next })
}

/// Waits out the rest of a period since the last call.
fn paced() -> impl FnMut() + Send {
    let mut last: Option<Instant> = None;
    move || {
        if let Some(last) = last {
            std::thread::sleep(PERIOD.saturating_sub(last.elapsed()));
        }
        last = Some(Instant::now());
    }
}

fn line(given: &Given) -> Result<Opener, SourceError> {
    if let Ok(address) = given.address.parse::<SocketAddr>() {
        return Ok(tcp(address, TIMEOUT_S));
    }
    let (path, baud) = given.address.rsplit_once('@').ok_or_else(|| given.wrong())?;
    Ok(serial(path, baud.parse().map_err(|_| given.wrong())?, TIMEOUT_S))
}

fn wrenches(given: &Given) -> Result<(Kind, Next), SourceError> {
    let usual = NetFtSettings::default();
    let settings = NetFtSettings {
        counts_per_n: given.number("counts_per_n", usual.counts_per_n)?,
        counts_per_nm: given.number("counts_per_nm", usual.counts_per_nm)?,
        // A sensor that is asked again begins anew: what it would still have sent is lost.
        timeout_s: TIMEOUT_S,
        ..usual
    };
    let mut sensor = NetFt::connect(given.socket()?, settings)?;
    let next = move || sensor.read().map(|r| numbers(r.t_s, r.value.components().to_vec()));
    Ok((Kind::Numbers(words(&WRENCH)), Box::new(next)))
}

const WRENCH: [&str; 6] =
    ["force_x_n", "force_y_n", "force_z_n", "torque_x_nm", "torque_y_nm", "torque_z_nm"];

/// A robot whose joints and tool are read; a link that broke is made anew.
fn arm(address: SocketAddr) -> (Kind, Next) {
    let fields = ["timestamp", "actual_q", "actual_TCP_pose", "actual_TCP_force"];
    let mut columns = Vec::new();
    columns.extend((0..6).map(|k| format!("joint_{k}_rad")));
    columns.extend(words(&["tool_x_m", "tool_y_m", "tool_z_m", "tool_rx_rad", "tool_ry_rad", "tool_rz_rad"]));
    columns.extend(words(&WRENCH));
    let mut link: Option<Rtde> = None;
    let next = move || {
        if link.is_none() {
            let mut opened = Rtde::connect(address, None, TIMEOUT_S)?;
            opened.outputs(&fields, 500.0)?;
            opened.start()?;
            link = Some(opened);
        }
        let gone = || DriverError::Link {
            device: format!("UR {address}"),
            what: "connect",
            error: std::io::ErrorKind::NotConnected,
        };
        let values = link.as_mut().ok_or_else(gone).and_then(Rtde::read);
        if values.is_err() {
            link = None;
        }
        let mut values = values?.into_iter().flat_map(|v| v.numbers);
        let t_s = values.next().unwrap_or(f64::NAN);
        Ok(numbers(t_s, values.collect()))
    };
    (Kind::Numbers(columns), Box::new(next))
}

fn servo(given: &Given) -> Result<(Kind, Next), SourceError> {
    let bus = Bus::new(&given.name, line(given)?, TIMEOUT_S)?;
    let unit = given.number("current_unit_a", 0.00269)?;
    let mut servo = ServoReader::new(bus, given.whole("id", 1)?, unit)?;
    let mut paced = paced();
    let next = move || {
        paced();
        let r = servo.reading()?;
        Ok(numbers(r.t_s, vec![r.value.angle_rad, r.value.speed_rad_s, r.value.current_a]))
    };
    Ok((Kind::Numbers(words(&["angle_rad", "speed_rad_s", "current_a"])), Box::new(next)))
}

fn gauge(given: &Given) -> Result<(Kind, Next), SourceError> {
    let settings = GaugeSettings {
        input: (given.whole("module", 1)?, given.whole("channel", 0)?),
        sensor: ([given.number("zero_v", 0.0)?, given.number("full_v", 10.0)?], given.needed("pa")?),
        timeout_s: TIMEOUT_S,
    };
    let mut gauge = Gauge::new(line(given)?, settings)?;
    let mut paced = paced();
    let next = move || {
        paced();
        gauge.pressure_pa().map(|p| numbers(p.t_s, vec![p.value]))
    };
    Ok((Kind::Numbers(words(&["pressure_pa"])), Box::new(next)))
}

fn depth(given: &Given) -> Result<(Kind, Next), SourceError> {
    let intrinsics = Intrinsics {
        fx: given.needed("fx")?,
        fy: given.needed("fy")?,
        cx: given.needed("cx")?,
        cy: given.needed("cy")?,
    };
    let unit_m = given.number("unit_m", 0.001)?;
    let mut camera = DepthFolder::new(&given.address, intrinsics, unit_m, TIMEOUT_S)?;
    let next = move || {
        let picture = camera.depth_m()?;
        Ok(Reading { t_s: picture.t_s, contents: Contents::Depth(picture.value) })
    };
    Ok((Kind::Depth { intrinsics, unit_m }, Box::new(next)))
}

/// Microphones, in blocks; `wait` is called with the time at which a block has been heard, s.
fn sound<M: Microphones<Error = DriverError> + Send + 'static>(
    mut microphones: M,
    mut wait: impl FnMut(f64) + Send + 'static,
) -> (Kind, Next) {
    let (channels, rate_hz) = (microphones.channels(), microphones.rate_hz());
    let instants = (BLOCK_S * rate_hz).ceil().max(1.0);
    let next = move || {
        let mut samples = vec![0.0; instants as usize * channels];
        let t_s = microphones.read(&mut samples)?;
        wait(t_s + instants / rate_hz);
        Ok(Reading { t_s, contents: Contents::Sound(samples) })
    };
    // The drivers' own types: sound cards and WAV files have no more.
    (Kind::Sound { channels: channels as u16, rate_hz: rate_hz as u32 }, Box::new(next))
}

/// A sound card stays on the thread that opened it, on some systems.
#[cfg(feature = "cpal")]
fn sound_card() -> Result<(Kind, Next), SourceError> {
    use std::sync::mpsc::sync_channel;

    use hw_drivers::sound_card::SoundCard;

    let (opened, kind) = sync_channel(1);
    let (sender, readings) = sync_channel(64);
    std::thread::spawn(move || {
        let card = match SoundCard::open(TIMEOUT_S) {
            Ok(card) => card,
            Err(error) => return drop(opened.send(Err(error))),
        };
        let (channels, rate_hz) = (card.channels(), card.rate_hz());
        let heard = opened.send(Ok(Kind::Sound { channels: channels as u16, rate_hz: rate_hz as u32 }));
        let (mut card, instants) = (card, (BLOCK_S * rate_hz).ceil().max(1.0) as usize);
        while heard.is_ok() {
            let mut samples = vec![0.0; instants * channels];
            let reading = card.read(&mut samples);
            let passed = reading.map(|t_s| Reading { t_s, contents: Contents::Sound(samples) });
            if sender.send(passed).is_err() {
                return;
            }
        }
    });
    let gone = || DriverError::Link {
        device: "microphones".into(),
        what: "listen",
        error: std::io::ErrorKind::NotConnected,
    };
    let kind = kind.recv().map_err(|_| gone())??;
    Ok((kind, Box::new(move || readings.recv().unwrap_or_else(|_| Err(gone())))))
}
