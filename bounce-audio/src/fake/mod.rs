//! A simulated court behind hw-traits: a ball that is thrown, a room that echoes, microphones, and an arm with a paddle.
//!
//! None of it is what the estimators assume. The room sums image sources, the localiser correlates phases; the ball has drag, a
//! restitution that falls with speed, and asperities whose slopes turn it, where the drop model has a parabola and a direction's
//! distribution; the arm is late and has limits.

mod arm;
mod ball;
mod court;
mod error;
pub mod knock;
mod panel;
mod room;

pub use arm::{ArmLimits, PaddleArm};
pub use ball::{FakeBall, Flown, Touchdown};
pub use court::{Court, CourtSettings, FakeError, Toss, Verdict};
pub use error::RoomError;
pub use panel::Panel;
pub use room::{Burst, Room};
