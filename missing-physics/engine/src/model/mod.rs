//! What the engine asks of a simulation: its parameters, its mechanisms and its prediction of a run.

mod builder;
mod check;
mod error;
mod extensions;
mod simulation;
mod spec;

pub use crate::quantity::Quantity;
pub use builder::{ParameterRef, SpecBuilder, UNBOUNDED};
pub use check::SpecError;
pub use error::{LARGEST_PREDICTION, PredictError};
pub use extensions::{
    ErrorModel, Extensions, ExternalProgram, JointLimits, LocalCauses, LocalUnknown, MultimodalModel,
    WindowedModel,
};
pub use simulation::{Experiment, Model, Pair, difference_points, finite_differences};
pub use spec::{
    Derived, DerivedPerRun, FEWEST_RUNS_THAT_DIFFER, Mechanism, OfParameters, OfRun, Over, Parameter, Scope,
    Spec, Term,
};
