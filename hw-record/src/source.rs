use std::net::SocketAddr;

use hw_drivers::DriverError;
use hw_drivers::ati::{NetFt, NetFtSettings};
use hw_drivers::robotiq::{Robotiq, RobotiqSettings};
use hw_drivers::ur::Rtde;
use hw_traits::force_torque::ForceTorque as _;
use hw_traits::gripper::Gripper as _;

/// Waits for a reading: the time on the device's clock (s), and a number for each column.
pub type Next = Box<dyn FnMut() -> Result<(f64, Vec<f64>), DriverError> + Send>;

/// A stream of readings that can be recorded.
pub struct Source {
    /// Its name: that of its file.
    pub name: String,
    /// Its columns, with units.
    pub columns: Vec<String>,
    /// Waits for a reading: the time on the device's clock (s), and a number for each column.
    pub next: Next,
}

/// Why there is no such source.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// It is not written as it should be.
    #[error("{given:?}, expected KIND=ADDRESS:PORT with a KIND of ati, ur, robotiq")]
    Words {
        /// What was given.
        given: String,
    },
    /// The device cannot be reached.
    #[error(transparent)]
    Device(#[from] DriverError),
}

fn words(of: &[&str]) -> Vec<String> {
    of.iter().map(|w| (*w).to_owned()).collect()
}

/// A source by its kind and address: `ati=192.0.2.1:49152`, `ur=192.0.2.2:30004`, `robotiq=192.0.2.2:63352`. Nothing is moved.
///
/// # Errors
/// [`SourceError`].
pub fn source(given: &str) -> Result<Source, SourceError> {
    let wrong = || SourceError::Words { given: given.to_owned() };
    let (kind, address) = given.split_once('=').ok_or_else(wrong)?;
    let address: SocketAddr = address.parse().map_err(|_| wrong())?;
    match kind {
        "ati" => {
            let mut sensor = NetFt::connect(address, NetFtSettings::default())?;
            let columns =
                words(&["force_x_n", "force_y_n", "force_z_n", "torque_x_nm", "torque_y_nm", "torque_z_nm"]);
            let next = move || sensor.read().map(|r| (r.t_s, r.value.components().to_vec()));
            Ok(Source { name: kind.into(), columns, next: Box::new(next) })
        }
        "ur" => Ok(arm(address)),
        "robotiq" => {
            let mut gripper = Robotiq::by_urcap(address, RobotiqSettings::default())?;
            let next = move || gripper.width_m().map(|w| (w.t_s, vec![w.value]));
            Ok(Source { name: kind.into(), columns: words(&["width_m"]), next: Box::new(next) })
        }
        _ => Err(wrong()),
    }
}

/// A robot whose joints and tool are read; a link that broke is made anew.
fn arm(address: SocketAddr) -> Source {
    let fields = ["timestamp", "actual_q", "actual_TCP_pose", "actual_TCP_force"];
    let mut columns = Vec::new();
    columns.extend((0..6).map(|k| format!("joint_{k}_rad")));
    columns.extend(words(&["tool_x_m", "tool_y_m", "tool_z_m", "tool_rx_rad", "tool_ry_rad", "tool_rz_rad"]));
    columns.extend(words(&[
        "force_x_n",
        "force_y_n",
        "force_z_n",
        "torque_x_nm",
        "torque_y_nm",
        "torque_z_nm",
    ]));
    let mut link: Option<Rtde> = None;
    let next = move || {
        if link.is_none() {
            let mut opened = Rtde::connect(address, None, 0.5)?;
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
        let mut numbers = values?.into_iter().flat_map(|v| v.numbers);
        let t_s = numbers.next().unwrap_or(f64::NAN);
        Ok((t_s, numbers.collect()))
    };
    Source { name: "ur".into(), columns, next: Box::new(next) }
}
