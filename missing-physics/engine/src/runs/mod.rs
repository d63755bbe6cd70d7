//! Runs that do not agree: by how much parameters differ from run to run, and which runs contradict the rest.

pub(crate) mod contradicting;
pub(crate) mod spread;
