//! Discrete elements: spheres that touch, roll, slide and come to rest.

mod cells;
mod clump;
mod contact;
mod energy;
mod error;
mod fill;
mod forces;
mod frame;
mod funnel;
mod grains;
mod heap;
mod material;
mod mesh;
mod neighbours;
mod pour;
mod simulation;
mod vector;
mod wall;

pub use clump::{Clump, Placed};
pub use energy::Energy;
pub use error::DemError;
pub use frame::WallMotion;
pub use funnel::Funnel;
pub use heap::{Heap, heap};
pub use material::{Coefficients, Law, stable_step_s};
pub use mesh::{Mesh, MeshError};
pub use neighbours::Counters;
pub use pour::{Pour, Poured};
pub use simulation::{MAX_GRAINS, Rest, Setup, Simulation};
pub use wall::{Shape, Wall};
