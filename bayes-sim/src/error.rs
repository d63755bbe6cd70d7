//! What can be wrong with data, settings and files.

use std::path::PathBuf;

/// Why something could not be done; one variant a rule.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A row has another length than the others, or than the model was trained on.
    #[error("{what}: expected {expected} numbers, got {got}")]
    Length {
        /// Which row.
        what: &'static str,
        /// How many numbers it should have.
        expected: usize,
        /// How many came.
        got: usize,
    },
    /// A number is NaN or infinite.
    #[error("{what}: row {row}, column {column} is {value}; leave such rows out")]
    NotFinite {
        /// Which table.
        what: &'static str,
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
        /// What came.
        value: f64,
    },
    /// A parameter lies outside the prior.
    #[error("row {row}: parameter {parameter} = {value} is outside its prior {prior}")]
    OutsidePrior {
        /// Row, from 0.
        row: usize,
        /// Parameter, from 0.
        parameter: usize,
        /// What came.
        value: f64,
        /// The prior of this parameter.
        prior: String,
    },
    /// A prior that is none: bounds the wrong way round, or not positive where a logarithm is taken.
    #[error(
        "parameter {parameter}: {prior} is not a prior; bounds have to rise, and be above 0 for a logarithm"
    )]
    Prior {
        /// Parameter, from 0.
        parameter: usize,
        /// What came.
        prior: String,
    },
    /// Correlations that are none, or of flat parameters.
    #[error("this is no correlation of a prior: {reason}")]
    Correlation {
        /// What is wrong.
        reason: String,
    },
    /// Too few simulations to learn from.
    #[error("{got} rows are too few: at least {least} are needed")]
    TooFew {
        /// The least number.
        least: usize,
        /// How many came.
        got: usize,
    },
    /// A setting out of its range.
    #[error("{name} = {value}: has to be {rule}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// What came.
        value: f64,
        /// Its range.
        rule: &'static str,
    },
    /// Training gave no finite loss.
    #[error("training diverged: no member of the ensemble has a finite validation loss")]
    Diverged,
    /// A covariance that is not positive definite.
    #[error("component {component}: the covariance is not positive definite")]
    NotPositiveDefinite {
        /// Component, from 0.
        component: usize,
    },
    /// Indices of a marginal or a conditional that do not exist or come twice.
    #[error("indices {indices:?} have to be different and below {dim}")]
    Indices {
        /// What came.
        indices: Vec<usize>,
        /// Number of dimensions.
        dim: usize,
    },
    /// Two things that should share a prior or a space do not.
    #[error("{what} differ: {left} and {right}")]
    Mismatch {
        /// Which property.
        what: &'static str,
        /// Length of the first.
        left: String,
        /// Length of the second.
        right: String,
    },
    /// A product of posteriors that cannot be normalised: the data agree less than the prior divided out.
    #[error(
        "the product of {count} posteriors divided by the prior has no finite integral; use a flat prior or fewer"
    )]
    ImproperProduct {
        /// How many posteriors.
        count: usize,
    },
    /// A file could not be read or written.
    #[error("{path}: {source}")]
    Io {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file of another kind or version, or damaged.
    #[error("{path}: {reason}")]
    Format {
        /// Which file.
        path: PathBuf,
        /// What is wrong, and where.
        reason: String,
    },
}

impl Error {
    pub(crate) fn io(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Error + '_ {
        move |source| Error::Io { path: path.to_owned(), source }
    }
}
