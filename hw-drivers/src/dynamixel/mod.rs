//! Dynamixel servos: protocol 2.0 over any line that reads and writes, and one servo of the X series as a joint.
//!
//! Source: Robotis, DYNAMIXEL Protocol 2.0, <https://emanual.robotis.com/docs/en/dxl/protocol2/>, its CRC,
//! <https://emanual.robotis.com/docs/en/dxl/crc/>, and the control table of the X series,
//! <https://emanual.robotis.com/docs/en/dxl/x/xl430-w250/>.
//!
//! The servos of an SO-101 (Feetech STS3215) speak another protocol; an arm of that build with X-series servos speaks this one.

mod packet;
mod servo;

pub use packet::Bus;
pub use servo::{Joint, Mode, Reading, Servo, ServoCommand, ServoReader, ServoSettings};
