//! The engine's builder of specifications, by the short names that the domains use.

pub(super) use missing_physics::model::{ParameterRef as At, SpecBuilder as Builder, UNBOUNDED as ANY};
