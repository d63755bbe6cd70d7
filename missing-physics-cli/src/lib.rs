//! The `missing-physics` tool: reads recordings, diagnoses them, writes reports.
//!
//! The only place that knows both the engine and the domains. [`recording`] reads files, [`domains`] turns them into a
//! model and data, [`report`] renders the answer, [`commands`] are what the command line calls.

pub mod commands;
pub mod domains;
pub mod prove;
pub mod recording;
pub mod repair;
pub mod report;
