//! A simulated rig behind hw-traits: membrane, object, depth camera, gripper, arm.
//!
//! The membrane is not what the estimators assume: the obstacle problem `T_x w_xx + T_y w_yy = 0`, `w >= object`, solved on a grid
//! by projected relaxation, with tensions from the stretch (Neo-Hookean) and from the deflection. Forces are the sum of its
//! reactions; there is no modulus in it.

mod camera;
mod lump;
mod membrane;
mod object;
mod rig;

pub use camera::DepthEye;
pub use lump::Lump;
pub use membrane::{Membrane, Sheet};
pub use object::Shape;
pub use rig::{FakeError, Filling, Rig};
