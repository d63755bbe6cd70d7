//! A simulated wrist that holds a container with liquid: turns, feels and keeps time like the rig of [Matl 2021], chapter 2.
//!
//! It shares no formula with the estimators: the liquid's centre of mass comes from columns summed one by one ([`Cavity`]), the
//! slosh is a pendulum that is integrated in time with the wrist's motion as its input (or, with a [`Surface`], three modes with the damping of their
//! own boundary layers, a dirty surface, a contact line that sticks, tension, and softening), a thick liquid's film is finite volumes on
//! the wall, and the sensor is an ATI Axia80 with noise and steps. A pour ([`FakePour`]) is finite volumes along the bottle and a weir of
//! strips at its lip. Time is simulated: waiting costs none. Same seed, same bits.

mod cavity;
mod film;
mod joint;
mod modes;
mod pouring;
mod sensor;
mod slosh;
mod wrist;

pub use cavity::{Box3, Cavity, Round};
pub use modes::Surface;
pub use pouring::{Disturbances, FakePour, OpenBottle, TruePour};
pub use sensor::{AXIA80, Sensor};
pub use wrist::{FakeWrist, Load};
