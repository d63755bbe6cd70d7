//! The engine, on models of its tests: one program, linked once.

mod bad_input;
mod bounds;
mod common;
mod doubted;
mod false_alarms;
mod integer_parameters;
mod intervals;
mod jumps;
mod laws;
mod local_causes;
mod many_mechanisms;
mod modes;
mod next_experiment;
mod noise;
mod power;
mod runs;
mod serialized;
mod short_runs;
mod single_run;
mod stochastic;
mod stream;
