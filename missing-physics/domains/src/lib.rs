#![doc = include_str!("../README.md")]
#[cfg(feature = "bounce")]
pub mod bounce;
#[cfg(feature = "custom")]
pub mod custom;
mod domain;
#[cfg(feature = "dough-roll")]
pub mod dough_roll;
#[cfg(any(feature = "indentation", feature = "trajectory"))]
mod dual;
#[cfg(any(feature = "bounce", feature = "grain-pour", feature = "liquid-tilt"))]
#[cfg_attr(
    not(all(feature = "bounce", feature = "grain-pour", feature = "liquid-tilt")),
    allow(dead_code, reason = "no domain draws all of it")
)]
mod figures;
#[cfg(feature = "grain-pour")]
pub mod grain_pour;
#[cfg(feature = "indentation")]
pub mod indentation;
#[cfg(feature = "liquid-tilt")]
pub mod liquid_tilt;
#[cfg(any(feature = "custom", feature = "motion"))]
mod mechanics;
#[cfg(any(feature = "custom", feature = "dough-roll", feature = "liquid-tilt"))]
mod memo;
#[cfg(feature = "motion")]
pub mod motion;
#[cfg(any(
    feature = "bounce",
    feature = "custom",
    feature = "dough-roll",
    feature = "indentation",
    feature = "liquid-tilt",
    feature = "slosh",
    feature = "trajectory"
))]
mod plausible;
#[cfg(any(
    feature = "bounce",
    feature = "custom",
    feature = "dough-roll",
    feature = "grain-pour",
    feature = "indentation",
    feature = "liquid-tilt",
    feature = "motion",
    feature = "slosh",
    feature = "trajectory"
))]
mod reading;
pub mod recording;
mod registry;
pub mod repair;
#[cfg(feature = "slosh")]
pub mod slosh;
#[cfg(feature = "trajectory")]
pub mod trajectory;

pub use domain::{CheckedRecording, Contents, Domain, Loaded, RunContents, THESIS, Template};
pub use registry::{
    UnknownDomain, all, check, check_source, find, load, load_source, load_watched, load_with_gaps,
};
