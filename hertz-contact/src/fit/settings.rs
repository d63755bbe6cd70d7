//! What is fitted, and how.

use crate::indenter::Indenter;
use crate::law::{LawError, Layer};

/// Why there is no fit.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FitError {
    /// No curve was given.
    #[error("no curves")]
    Empty,
    /// The columns of a curve differ in length.
    #[error("curve {curve} has {expected} indentations, but a column of {got}")]
    Length {
        /// Index of the curve.
        curve: usize,
        /// Number of indentations.
        expected: usize,
        /// The other length.
        got: usize,
    },
    /// A number of a curve is not finite, or a sigma is not positive.
    #[error("sample {sample} of curve {curve}: {column} is {value}")]
    Value {
        /// Index of the curve.
        curve: usize,
        /// Index of the sample.
        sample: usize,
        /// Name of the column.
        column: &'static str,
        /// Its value.
        value: f64,
    },
    /// A curve has too few samples, in all or in contact.
    #[error("curve {curve} has {got} samples to go by, expected {expected}")]
    TooFew {
        /// Index of the curve.
        curve: usize,
        /// How many are needed.
        expected: usize,
        /// How many there are.
        got: usize,
    },
    /// All indentations of a curve are the same.
    #[error("curve {curve} stays at one indentation")]
    NotMoved {
        /// Index of the curve.
        curve: usize,
    },
    /// A straight line explains the curve as well as a contact does.
    #[error("curve {curve} shows no contact: it lowers the misfit by {improvement} variances of the noise")]
    NoContact {
        /// Index of the curve.
        curve: usize,
        /// What the contact lowers chi-squared by.
        improvement: f64,
    },
    /// A setting makes no sense.
    #[error(transparent)]
    Setting(#[from] LawError),
}

/// What the force is where nothing touches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Baseline {
    /// Zero.
    Zero,
    /// A constant, one for each curve.
    Offset,
    /// A straight line, one for each curve. Without samples ahead of the contact it is hardly told from a modulus.
    Tilt,
}

/// How much a residual counts, in standard deviations u of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// Least squares.
    Square,
    /// Huber's, linear beyond 1.345.
    Huber,
    /// Tukey's biweight, which leaves out what lies beyond 4.685.
    Tukey,
}

/// How the noise's size goes along a curve that brings no sigmas of its own; its scale is estimated always.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Noise {
    /// The same everywhere.
    White,
    /// `sigma^2 = sigma_0^2 + (r F)^2`, r estimated.
    Proportional,
}

/// Up to which indentation a curve is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// All of it.
    All,
    /// Up to an indentation in m from the contact point.
    UpTo(f64),
    /// The deepest that leaves no trend in the residuals, and not beyond where the law holds (`0.1 R`, and `0.1 H` of a
    /// layer): shortened in steps of a fifth, down to a fifth of the curve.
    Automatic,
}

/// A measured curve, in the order in which it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve<'a> {
    /// Indentation in m, from any zero.
    pub indentation_m: &'a [f64],
    /// Force in N.
    pub force_n: &'a [f64],
    /// Relative size of each sample's noise, if known.
    pub sigma_n: Option<&'a [f64]>,
}

/// A layer below the indenter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerBelow {
    /// What it rests on, and its Poisson's ratio.
    pub layer: Layer,
    /// One over its thickness, 1/m.
    pub inverse_thickness_per_m: f64,
}

/// How curves are fitted: one modulus for all of them, a contact point and a baseline for each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The indenter.
    pub indenter: Indenter,
    /// Poisson's ratio, above -1 and up to 0.5.
    pub poisson_ratio: f64,
    /// The layer that is indented; none for a half-space.
    pub layer: Option<LayerBelow>,
    /// The force where nothing touches.
    pub baseline: Baseline,
    /// How much a residual counts.
    pub loss: Loss,
    /// The noise.
    pub noise: Noise,
    /// How deep the curves are used.
    pub range: Range,
    /// Coverage of the intervals, between 0 and 1.
    pub level: f64,
}

impl Fit {
    /// A half-space, a constant baseline, Tukey's loss, white noise, all of the curve, 95 % intervals.
    pub fn new(indenter: Indenter, poisson_ratio: f64) -> Self {
        Self {
            indenter,
            poisson_ratio,
            layer: None,
            baseline: Baseline::Offset,
            loss: Loss::Tukey,
            noise: Noise::White,
            range: Range::All,
            level: 0.95,
        }
    }

    /// Whether the settings make sense.
    ///
    /// # Errors
    /// [`LawError`].
    pub fn check(&self) -> Result<(), LawError> {
        self.indenter.check()?;
        crate::law::poisson(self.poisson_ratio)?;
        if let Some(below) = self.layer {
            crate::law::zero_or_more("inverse_thickness_per_m", below.inverse_thickness_per_m)?;
        }
        if let Range::UpTo(depth_m) = self.range {
            crate::law::positive("depth_m", depth_m)?;
        }
        if self.level > 0.0 && self.level < 1.0 {
            return Ok(());
        }
        Err(LawError::OutOfRange { name: "level", value: self.level, low: 0.0, high: 1.0 })
    }
}
