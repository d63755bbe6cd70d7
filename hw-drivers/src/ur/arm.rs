use std::io::Write as _;
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use hw_traits::ErrorType;
use hw_traits::arm::{Arm, Pose};
use hw_traits::clock::Stamped;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::rtde::{Rtde, Value};
use crate::dead_man::{DeadMan, Machine};
use crate::error::{DriverError, within};

/// What is read, in the order of [`State`].
const OUTPUTS: [&str; 8] = [
    "timestamp",
    "actual_q",
    "actual_qd",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "actual_TCP_force",
    "safety_mode",
    "output_int_register_0",
];
const INPUTS: [&str; 11] = [
    "input_double_register_0",
    "input_double_register_1",
    "input_double_register_2",
    "input_double_register_3",
    "input_double_register_4",
    "input_double_register_5",
    "input_double_register_6",
    "input_double_register_7",
    "input_int_register_0",
    "input_int_register_1",
    "input_int_register_2",
];
/// Safety modes in which the arm may move: normal and reduced.
const MAY_MOVE: [f64; 2] = [1.0, 2.0];
/// Below these speeds it stands, m/s and rad/s.
const STANDS: f64 = 1e-3;
/// Poses this close need no time, m and rad.
const SAME: f64 = 1e-9;

/// What an arm may do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UrLimits {
    /// Lowest and highest place of the tool in the base frame, m.
    pub place_m: [[f64; 2]; 3],
    /// Fastest motion of the tool, m/s.
    pub speed_m_s: f64,
    /// Fastest turn of the tool, rad/s.
    pub speed_rad_s: f64,
    /// Largest force on the tool, N: a larger one stops it.
    pub force_n: f64,
}

/// How an arm is spoken to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UrSettings {
    /// What it may do.
    pub limits: UrLimits,
    /// The one version of the protocol that is tried; 2, then 1, without.
    pub version: Option<u16>,
    /// Readings a second, up to 500 (125 with version 1, whatever is asked for).
    pub rate_hz: f64,
    /// How long an answer may take, s.
    pub timeout_s: f64,
    /// The longest time between readings while it moves, s.
    pub patience_s: f64,
}

/// A reading of an arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Joint angles, rad.
    pub joints_rad: [f64; 6],
    /// Joint speeds, rad/s.
    pub joint_speeds_rad_s: [f64; 6],
    /// The tool in the base frame: m, and a rotation vector in rad.
    pub tool_in_base: [f64; 6],
    /// Its speed: m/s and rad/s.
    pub tool_speed: [f64; 6],
    /// Force (N) and torque (N m) on the tool, along the base's axes.
    pub tool_force: [f64; 6],
}

/// A command to an arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// To a pose (m, rotation vector in rad), at speeds in m/s and rad/s.
    Pose([f64; 6], f64, f64),
    /// At a speed, m/s and rad/s.
    Speed([f64; 6]),
}

/// The arm behind RTDE.
pub struct Controller {
    address: SocketAddr,
    settings: UrSettings,
    link: Option<Rtde>,
    beat: i32,
    number: i32,
    /// Registers of the command that holds.
    registers: [f64; 8],
    kind: f64,
    newest: Option<State>,
}

/// A Universal Robots arm, under the dead-man's rule.
pub struct UrArm {
    machine: DeadMan<Controller>,
    limits: UrLimits,
}

fn size(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn rotation(vector: &[f64]) -> UnitQuaternion<f64> {
    let at = |k: usize| vector.get(k).copied().unwrap_or(0.0);
    UnitQuaternion::from_scaled_axis(Vector3::new(at(0), at(1), at(2)))
}

/// Way and turn between two poses, m and rad.
fn apart(a: &[f64; 6], b: &[f64; 6]) -> (f64, f64) {
    (size(&[a[0] - b[0], a[1] - b[1], a[2] - b[2]]), rotation(&a[3..]).angle_to(&rotation(&b[3..])))
}

fn check_place(limits: &UrLimits, place: &[f64]) -> Result<(), DriverError> {
    let names = ["place along x in m", "place along y in m", "place along z in m"];
    let axes = names.into_iter().zip(place).zip(limits.place_m);
    axes.into_iter().try_for_each(|((what, value), [low, high])| within(what, *value, low, high))
}

impl Controller {
    fn link(&mut self) -> Result<&mut Rtde, DriverError> {
        if self.link.is_none() {
            let settings = self.settings;
            let mut link = Rtde::connect(self.address, settings.version, settings.timeout_s)?;
            link.outputs(&OUTPUTS, settings.rate_hz)?;
            link.inputs(&INPUTS)?;
            link.start()?;
            self.link = Some(link);
        }
        let device = format!("UR {}", self.address);
        let gone = DriverError::Link { device, what: "connect", error: std::io::ErrorKind::NotConnected };
        self.link.as_mut().ok_or(gone)
    }

    fn write(&mut self) -> Result<(), DriverError> {
        self.beat = self.beat.wrapping_add(1);
        let mut numbers = self.registers.to_vec();
        numbers.extend([f64::from(self.beat), f64::from(self.number), self.kind]);
        self.on_link(|link| link.write(&numbers))
    }

    /// Asks on the link; one that broke is made anew by the next call.
    fn on_link<T>(
        &mut self,
        ask: impl FnOnce(&mut Rtde) -> Result<T, DriverError>,
    ) -> Result<T, DriverError> {
        let answer = self.link().and_then(ask);
        if matches!(answer, Err(DriverError::Link { .. } | DriverError::Garbled { .. })) {
            self.link = None;
        }
        answer
    }

    fn state(&self, values: &[Value]) -> Option<(f64, State, f64, f64)> {
        let six = |k: usize| -> Option<[f64; 6]> { values.get(k)?.numbers.clone().try_into().ok() };
        let one = |k: usize| values.get(k)?.numbers.first().copied();
        let state = State {
            joints_rad: six(1)?,
            joint_speeds_rad_s: six(2)?,
            tool_in_base: six(3)?,
            tool_speed: six(4)?,
            tool_force: six(5)?,
        };
        Some((one(0)?, state, one(6)?, one(7)?))
    }
}

impl Machine for Controller {
    type State = State;
    type Command = Motion;

    fn admissible(&self, command: &Motion) -> Result<(), DriverError> {
        let limits = &self.settings.limits;
        match command {
            Motion::Pose(pose, m_s, rad_s) => {
                check_place(limits, &pose[..3])?;
                within("turn in rad", size(&pose[3..]), 0.0, 2.0 * std::f64::consts::PI)?;
                within("speed in m/s", *m_s, 0.0, limits.speed_m_s)?;
                within("speed in rad/s", *rad_s, 0.0, limits.speed_rad_s)
            }
            Motion::Speed(speed) => {
                within("speed in m/s", size(&speed[..3]), 0.0, limits.speed_m_s)?;
                within("speed in rad/s", size(&speed[3..]), 0.0, limits.speed_rad_s)
            }
        }
    }

    fn beyond(&self, state: &State) -> Option<String> {
        let limits = &self.settings.limits;
        let checked = check_place(limits, &state.tool_in_base[..3])
            .and_then(|()| within("force in N", size(&state.tool_force[..3]), 0.0, limits.force_n));
        checked.err().map(|limit| limit.to_string())
    }

    fn look(&mut self) -> Result<(Stamped<State>, bool), DriverError> {
        // The beat keeps the controller's own watch content.
        self.write()?;
        let values = self.on_link(Rtde::newest)?;
        let device = format!("UR {}", self.address);
        let Some((t_s, state, safety, done)) = self.state(&values) else {
            return Err(DriverError::Garbled {
                device,
                expected: "the fields of the recipe",
                received: "others".into(),
            });
        };
        if !MAY_MOVE.contains(&safety) {
            let why = format!("{device}: safety mode {safety} (protective or emergency stop)");
            return Err(DriverError::Stopped { why });
        }
        self.newest = Some(state);
        let stands = size(&state.tool_speed) < STANDS;
        let settled = stands && (self.kind == 0.0 || (self.kind == 1.0 && done == f64::from(self.number)));
        Ok((Stamped { t_s, value: state }, settled))
    }

    fn send(&mut self, command: &Motion) -> Result<(), DriverError> {
        self.number = self.number.wrapping_add(1).max(1);
        match command {
            Motion::Pose(pose, m_s, rad_s) => {
                let [a, b, c, d, e, f] = *pose;
                (self.registers, self.kind) = ([a, b, c, d, e, f, *m_s, *rad_s], 1.0);
            }
            Motion::Speed([a, b, c, d, e, f]) => {
                (self.registers, self.kind) = ([*a, *b, *c, *d, *e, *f, 0.0, 0.0], 2.0);
            }
        }
        self.write()
    }

    fn stop(&mut self) -> Result<(), DriverError> {
        self.number = self.number.wrapping_add(1).max(1);
        (self.registers, self.kind) = ([0.0; 8], 0.0);
        self.write()
    }

    /// The controller's watch wants ten a second, also while the arm stands and nobody asks.
    fn beat_every(&self) -> Option<Duration> {
        Some(Duration::from_millis(25))
    }

    /// No link is made for it; what the controller sent meanwhile does not pile up.
    fn beat(&mut self) {
        if self.link.is_some() && self.write().is_ok() {
            let _ = self.on_link(Rtde::skim);
        }
    }
}

impl UrArm {
    /// Connects (port 30004). [`super::SCRIPT`] has to run on the controller before the arm moves.
    ///
    /// # Errors
    /// [`DriverError::Limit`] for settings that are none; those of the link.
    pub fn connect(address: SocketAddr, settings: UrSettings) -> Result<Self, DriverError> {
        let limits = settings.limits;
        for [low, high] in limits.place_m {
            within("limits of place in m", high - low, f64::MIN_POSITIVE, 10.0)?;
        }
        within("fastest motion in m/s", limits.speed_m_s, f64::MIN_POSITIVE, 5.0)?;
        within("fastest turn in rad/s", limits.speed_rad_s, f64::MIN_POSITIVE, 10.0)?;
        within("largest force in N", limits.force_n, f64::MIN_POSITIVE, 1e4)?;
        within("readings in Hz", settings.rate_hz, 1.0, 500.0)?;
        let mut controller = Controller {
            address,
            settings,
            link: None,
            beat: 0,
            number: 0,
            registers: [0.0; 8],
            kind: 0.0,
            newest: None,
        };
        // What an earlier program commanded does not hold.
        controller.stop()?;
        Ok(Self { machine: DeadMan::new(controller, settings.patience_s)?, limits })
    }

    /// Everything that is read, and whether the last command has been carried out; needed before each command.
    ///
    /// # Errors
    /// The device's; [`DriverError::Stopped`] in a protective stop, and for a reading beyond the limits.
    pub fn state(&mut self) -> Result<(Stamped<State>, bool), DriverError> {
        self.machine.look()
    }

    /// Moves at a speed, m/s and rad/s along the base's axes, until the next command; readings have to go on.
    ///
    /// # Errors
    /// As a command under the dead-man's rule.
    pub fn move_at(&mut self, speed: [f64; 6]) -> Result<(), DriverError> {
        self.machine.command(&Motion::Speed(speed))
    }

    /// Moves to a pose (m, rotation vector in rad) at speeds in m/s and rad/s.
    ///
    /// # Errors
    /// As a command under the dead-man's rule.
    pub fn move_at_most(
        &mut self,
        pose: [f64; 6],
        speed_m_s: f64,
        speed_rad_s: f64,
    ) -> Result<(), DriverError> {
        self.machine.command(&Motion::Pose(pose, speed_m_s, speed_rad_s))
    }

    /// Stops now.
    ///
    /// # Errors
    /// The link's.
    pub fn stop(&mut self) -> Result<(), DriverError> {
        self.machine.stop()
    }

    /// Why the dead-man's rule stopped it, if it did.
    pub fn stopped(&self) -> Option<String> {
        self.machine.stopped()
    }

    /// Lets a stopped arm take commands again.
    pub fn clear(&mut self) {
        self.machine.clear();
    }

    /// The version of the protocol that was agreed on.
    pub fn version(&self) -> Option<u16> {
        self.machine.with(|controller| controller.link.as_ref().map(Rtde::version))
    }

    pub(super) fn limits(&self) -> UrLimits {
        self.limits
    }
}

/// A pose as the controller has it: m, and a rotation vector in rad.
pub(super) fn of_pose(pose: &Pose) -> Result<[f64; 6], DriverError> {
    let [x, y, z, w] = pose.rotation_xyzw;
    within("length of the quaternion", size(&pose.rotation_xyzw), 1.0 - 1e-6, 1.0 + 1e-6)?;
    let turned = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).scaled_axis();
    let [a, b, c] = pose.position_m;
    Ok([a, b, c, turned[0], turned[1], turned[2]])
}

impl ErrorType for UrArm {
    type Error = DriverError;
}

impl Arm for UrArm {
    fn move_to(&mut self, tool_in_base: Pose, deadline_s: f64) -> Result<(), DriverError> {
        let pose = of_pose(&tool_in_base)?;
        check_place(&self.limits, &pose[..3])?;
        within("deadline in s", deadline_s, f64::MIN_POSITIVE, f64::MAX)?;
        let (way, turn) = match self.machine.with(|c| c.newest) {
            Some(state) => apart(&state.tool_in_base, &pose),
            None => (0.0, 0.0),
        };
        let (m_s, rad_s) = (way / deadline_s, turn / deadline_s);
        if m_s > self.limits.speed_m_s || rad_s > self.limits.speed_rad_s {
            let waited_s = deadline_s;
            return Err(DriverError::Late {
                device: "the arm would arrive after the deadline".into(),
                waited_s,
            });
        }
        // The controller takes a part of what is left with each step: a little faster arrives in time.
        let faster = |wanted: f64, most: f64| (1.05 * wanted).clamp(SAME, most);
        let (m_s, rad_s) = (faster(m_s, self.limits.speed_m_s), faster(rad_s, self.limits.speed_rad_s));
        self.machine.command(&Motion::Pose(pose, m_s, rad_s))
    }

    fn pose(&mut self) -> Result<Stamped<Pose>, DriverError> {
        let (state, _) = self.machine.look()?;
        let [a, b, c, d, e, f] = state.value.tool_in_base;
        let q = rotation(&[d, e, f]).into_inner();
        let rotation_xyzw = [q.i, q.j, q.k, q.w];
        Ok(Stamped { t_s: state.t_s, value: Pose { position_m: [a, b, c], rotation_xyzw } })
    }

    fn settled(&mut self) -> Result<bool, DriverError> {
        self.machine.settled()
    }
}

/// Sends a program to a controller (port 30002), which runs it.
///
/// # Errors
/// [`DriverError::Link`] or [`DriverError::Late`].
pub fn send_script(address: SocketAddr, script: &str, timeout_s: f64) -> Result<(), DriverError> {
    within("timeout in s", timeout_s, 1e-3, 10.0)?;
    let timeout = Duration::from_secs_f64(timeout_s);
    let send = || -> std::io::Result<()> {
        let mut stream = TcpStream::connect_timeout(&address, timeout)?;
        stream.set_write_timeout(Some(timeout))?;
        stream.write_all(script.as_bytes())
    };
    send().map_err(|e| DriverError::of_io(&format!("UR {address}"), "send a program", &e, timeout_s))
}
