//! Which liquid it is: a linear support vector machine on features of the viscosity ([Matl 2021], section 2.6).
//!
//! One machine for each pair of liquids (smartcore's solver, LASVM), features standardised, votes counted; equal votes go to the larger
//! margin. [`cross_validate`] says how well it does on liquids that it has not seen.

mod folds;
mod svm;

pub use folds::{Confusion, cross_validate};
pub use svm::Classifier;

/// Why there is no classifier.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ClassifyError {
    /// There is too little to learn from.
    #[error("{got} {what}, expected {least} or more")]
    TooFew {
        /// What is counted.
        what: &'static str,
        /// How many came.
        got: usize,
        /// How many are needed.
        least: usize,
    },
    /// Rows of features differ in length, or from the number of labels.
    #[error("row {row} (counted from 0) has {got} features, expected {expected}")]
    Length {
        /// Which row.
        row: usize,
        /// How many came.
        got: usize,
        /// How many were expected.
        expected: usize,
    },
    /// There are not as many labels as rows.
    #[error("{labels} labels for {rows} rows, expected as many of each")]
    Labels {
        /// How many labels came.
        labels: usize,
        /// How many rows.
        rows: usize,
    },
    /// A feature is no number.
    #[error("feature {column} of row {row} (both counted from 0) is {got}, expected a number")]
    Feature {
        /// Which row.
        row: usize,
        /// Which feature.
        column: usize,
        /// What came.
        got: f64,
    },
    /// The penalty is outside its range.
    #[error("a penalty of {got}, expected above 0")]
    Penalty {
        /// What came.
        got: f64,
    },
    /// The solver failed.
    #[error("the solver failed: {0}")]
    Solver(String),
}
