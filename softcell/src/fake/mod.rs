//! A simulated tip, behind hw-traits: dome, contact, pictures, air, and a box that is held against a wall.
//!
//! None of it is what the estimators assume: the skin moves as an elastic half-space under Mindlin's and Reissner and Sagoci's
//! tractions, not as a Gaussian bump; the force has membrane terms beside Hertz's.

mod air;
mod bench;
mod contact;
mod dome;
mod palpation;
mod render;
mod touch;

pub use air::Air;
pub use bench::{Bench, FakeError};
pub use contact::{Contact, Object, Rings, SoftTip};
pub use dome::Dome;
pub use palpation::{Errors, Palpator};
pub use render::Eye;
pub use touch::Touch;
