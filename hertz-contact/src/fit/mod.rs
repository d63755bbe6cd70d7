//! The modulus behind measured curves whose contact point is unknown.
//!
//! `F = E phi(delta - delta_0) + offset + tilt delta`, with `phi` of [`crate::law::Elastic`] or [`crate::law::Layered`]. The
//! modulus and the baseline enter linearly and are eliminated (variable projection: Golub and Pereyra 1973,
//! doi:10.1137/0710036), so that the contact point is what is searched: over a grid first, since its valley has side valleys,
//! then by its derivative.

mod curve;
mod interval;
mod report;
mod robust;
mod run;
mod settings;
mod solve;
mod state;

pub use self::report::{CurveReport, Flags, Report, SampleCounts};
pub use self::settings::{Baseline, Curve, Fit, FitError, LayerBelow, Loss, Noise, Range};
pub use self::solve::Workspace;
