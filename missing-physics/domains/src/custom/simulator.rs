//! What predicts a recording of the domain `custom`: a program that is started, or a function of the program that diagnoses.

use super::answer::Failure;
use super::machine::JointForce;

/// Questions to a simulator: one run, at some sets of parameters.
#[derive(Debug, Clone, Copy)]
pub struct Questions<'a> {
    /// Label of the run.
    pub run: &'a str,
    /// Names of the parameters.
    pub parameters: &'a [&'a str],
    /// Sets of their values, each in the order of their names; at least one.
    pub sets: &'a [Vec<f64>],
    /// Names of the inputs, and the run's columns of them.
    pub inputs: &'a [(&'a str, &'a [f64])],
    /// Names of the joints on which something may act beside what the simulator knows.
    pub joints: &'a [String],
    /// For each set of parameters, what acts on each of them.
    pub forces: &'a [Vec<JointForce>],
    /// Names of the channels.
    pub channels: &'a [String],
    /// Number of rows of the run.
    pub rows: usize,
}

/// A simulator that is asked for predictions, from any thread.
pub trait Simulator: std::fmt::Debug + Send + Sync {
    /// Predicts all channels of a run at each set of parameters: channels one after the other, as many rows of each.
    ///
    /// # Errors
    /// [`Failure`]; it stands for all sets that were asked for.
    fn predict(&self, questions: &Questions<'_>) -> Result<Vec<Vec<f64>>, Failure>;

    /// Whether many sets at once cost less than one after another.
    fn batches(&self) -> bool {
        false
    }

    /// Why there will be no prediction any more, where there will be none.
    fn fault(&self) -> Option<String>;

    /// Ends it for a reason; what it was ended for first is the failure.
    fn give_up(&self, why: String) -> Failure;
}
