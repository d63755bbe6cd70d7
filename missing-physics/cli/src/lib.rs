//! The `missing-physics` tool: reads recordings, diagnoses them, writes reports.
//!
//! [`commands`] are what the command line calls; they put together what the other crates do: `missing-physics-domains` reads a
//! recording and makes its model, `missing-physics` diagnoses, `missing-physics-report` renders, `missing-physics-prove` proves.

pub mod commands;
