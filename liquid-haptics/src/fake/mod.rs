//! A simulated wrist that holds a container with liquid: turns, feels and keeps time like the rig of [Matl 2021], chapter 2.
//!
//! It shares no formula with the estimators: the liquid's centre of mass comes from columns summed one by one ([`Cavity`]), the
//! slosh is a pendulum that is integrated in time with the wrist's motion as its input, a thick liquid's film is finite volumes on
//! the wall, and the sensor is an ATI Axia80 with noise and steps. Time is simulated: waiting costs none. Same seed, same bits.

mod cavity;
mod film;
mod sensor;
mod slosh;
mod wrist;

pub use cavity::{Box3, Cavity, Round};
pub use sensor::{AXIA80, Sensor};
pub use wrist::{FakeWrist, Load};
