use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use hw_drivers::DriverError;
use hw_drivers::ati::{NetFt, NetFtSettings, settings_of};
use hw_drivers::emulator::{AtiEmulator, UrEmulator};
use hw_drivers::ur::{SCRIPT, UrArm, UrLimits, UrSettings, UrWrist, send_script};
use hw_traits::clock::{Clock, Stamped, SystemClock};
use hw_traits::force_torque::{ForceTorque, Wrench};
use hw_traits::rotary::Rotary;
use hw_traits::{ErrorKind, ErrorType};

use super::Outcome;
use super::world::{Truth, World};

const ATI_PORT: u16 = 49152;
const UR_PORT: u16 = 30004;
const PROGRAM_PORT: u16 = 30002;
const PAGES_PORT: u16 = 80;
/// Answers of pages and of the controller's program port, s.
const TIMEOUT_S: f64 = 1.0;
/// A program on the controller runs after so long.
const STARTED: Duration = Duration::from_millis(500);
/// The wrist's range, rad.
const LIMITS_RAD: (f64, f64) = (-0.01, 2.4);
/// What the arm may do: the tool turns in its place.
const SETTINGS: UrSettings = UrSettings {
    limits: UrLimits {
        place_m: [[-1.5, 1.5], [-1.5, 1.5], [-0.5, 1.5]],
        speed_m_s: 0.05,
        speed_rad_s: 1.5,
        force_n: 100.0,
    },
    version: None,
    rate_hz: 500.0,
    timeout_s: 0.5,
    patience_s: 0.5,
};

/// Where the devices are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Addresses {
    ati: SocketAddr,
    ur: SocketAddr,
    /// Whether the sensor's own pages say what a count is; 1,000,000 are a newton and a newton metre otherwise.
    pages: bool,
}

impl Addresses {
    /// From words: `ati=192.0.2.1,ur=192.0.2.2`, each with a port if it is not the maker's. A sensor with a port of its own is not asked for its
    /// pages.
    ///
    /// # Errors
    /// Words that are no such addresses.
    pub fn parse(words: &str) -> Outcome<Self> {
        let (mut ati, mut ur) = (None, None);
        for word in words.split(',') {
            let expected = || format!("{word:?}, expected ati=ADDRESS or ur=ADDRESS");
            let (kind, address) = word.split_once('=').ok_or_else(expected)?;
            let with = |port| address.parse().map(|ip: IpAddr| SocketAddr::new(ip, port));
            match kind {
                "ati" => {
                    ati = Some((
                        address.parse().or_else(|_| with(ATI_PORT)).map_err(|_| expected())?,
                        with(0).is_ok(),
                    ))
                }
                "ur" => ur = Some(address.parse().or_else(|_| with(UR_PORT)).map_err(|_| expected())?),
                _ => return Err(expected().into()),
            }
        }
        let ((ati, pages), ur) = ati.zip(ur).ok_or("expected both ati=ADDRESS and ur=ADDRESS")?;
        Ok(Self { ati, ur, pages })
    }
}

/// As [`Addresses::parse`] reads them.
impl std::fmt::Display for Addresses {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "ati={},ur={}", self.ati, self.ur)
    }
}

/// A sensor at the wrist of an arm that turns its tool in its place, and this computer's clock.
pub struct Devices {
    wrist: UrWrist,
    sensor: NetFt,
    clock: SystemClock,
}

impl Devices {
    /// Connects; nothing moves. `send_program` has the controller run [`SCRIPT`], which is otherwise started on its panel.
    ///
    /// # Errors
    /// The devices'.
    pub fn connect(at: &Addresses, send_program: bool) -> Outcome<Self> {
        let settings = if at.pages {
            settings_of(SocketAddr::new(at.ati.ip(), PAGES_PORT), TIMEOUT_S)?.0
        } else {
            NetFtSettings::default()
        };
        let sensor = NetFt::connect(at.ati, settings)?;
        let arm = UrArm::connect(at.ur, SETTINGS)?;
        if send_program {
            // After the connection: the program's watch wants to hear from it at once.
            send_script(SocketAddr::new(at.ur.ip(), PROGRAM_PORT), SCRIPT, TIMEOUT_S)?;
            std::thread::sleep(STARTED);
        }
        Ok(Self { wrist: UrWrist::new(arm, LIMITS_RAD)?, sensor, clock: SystemClock::default() })
    }

    /// Records of the sensor that never came.
    pub fn lost(&self) -> u64 {
        self.sensor.losses().lost
    }
}

impl ErrorType for Devices {
    type Error = DriverError;
}

impl Rotary for Devices {
    fn limits_rad(&self) -> (f64, f64) {
        self.wrist.limits_rad()
    }

    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), DriverError> {
        self.wrist.turn_to(angle_rad, rate_rad_s)
    }

    fn angle_rad(&mut self) -> Result<Stamped<f64>, DriverError> {
        self.wrist.angle_rad()
    }

    fn settled(&mut self) -> Result<bool, DriverError> {
        self.wrist.settled()
    }
}

impl ForceTorque for Devices {
    fn read(&mut self) -> Result<Stamped<Wrench>, DriverError> {
        self.sensor.read()
    }

    fn tare(&mut self, readings: usize) -> Result<(), DriverError> {
        self.sensor.tare(readings)
    }

    fn skip(&mut self) -> Result<(), DriverError> {
        self.sensor.skip()
    }
}

impl Clock for Devices {
    fn now_s(&mut self) -> Result<f64, DriverError> {
        self.clock.now_s().map_err(|never| match never {})
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), DriverError> {
        self.clock.sleep_s(duration_s).map_err(|never| match never {})
    }
}

/// An emulated sensor and an emulated robot on 127.0.0.1: the sensor feels the world's bottle at the tilt that the robot's tool has.
pub struct Loopback {
    robot: UrEmulator,
    sensor: AtiEmulator,
    world: Arc<Mutex<World>>,
}

impl Loopback {
    /// Starts both.
    ///
    /// # Errors
    /// Those of sockets on loopback.
    pub fn start(seed: u64) -> Outcome<Self> {
        let robot = UrEmulator::start([0.3, 0.1, 0.4, 0.0, 0.0, 0.0])?;
        let world = World::new(seed).map_err(|e| e.to_string())?;
        let world = Arc::new(Mutex::new(world));
        let (theirs, eye) = (Arc::clone(&world), robot.eye());
        let sensor = AtiEmulator::start(1000.0, move |_| {
            // The tool turns about its own z, which begins along the base's.
            let tilt_rad = eye().tool_in_base[5];
            let felt = theirs.lock().unwrap_or_else(PoisonError::into_inner).felt(tilt_rad);
            // Beyond its range a sensor reads its range.
            let largest = |_: ErrorKind| [500.0, 500.0, 500.0, 20.0, 20.0, 20.0];
            felt.map_or_else(largest, |wrench| wrench.components())
        })?;
        Ok(Self { robot, sensor, world })
    }

    /// Where they listen.
    pub fn addresses(&self) -> Addresses {
        Addresses { ati: self.sensor.address(), ur: self.robot.address(), pages: false }
    }

    /// What the programme has to find.
    pub fn truth(&self) -> Truth {
        self.world.lock().unwrap_or_else(PoisonError::into_inner).truth()
    }
}
