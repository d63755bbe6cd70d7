//! What happens in a world and what its sensors read of it, without noise: a plain method of its own for each.

pub(crate) mod bisection;
pub mod bounce;
pub mod dough;
pub mod flight;
pub mod indentation;
mod layer;
pub mod machine;
pub mod pendulum;
mod quadrature;
pub(crate) mod runge_kutta;
pub mod slosh;
pub mod sound;
pub mod tilt;
