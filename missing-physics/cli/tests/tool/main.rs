//! The tool, as a program that is run: one program of tests, linked once.

mod accelerometer;
mod astray;
mod bad_recordings;
mod browser;
mod chromium;
mod clock;
mod custom;
mod drops;
mod figures;
mod import;
mod located;
mod long_work;
mod machines;
mod next_experiment;
mod outputs;
mod pages;
mod plane;
mod prove;
mod recorded;
mod repair;
mod report;
mod simulated;
mod templates;
mod unlisted;
mod watch;
