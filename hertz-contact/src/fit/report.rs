//! What a fit found.

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Young's modulus E in Pa.
    pub modulus_pa: f64,
    /// Its interval, by profile likelihood; an end that the data leave open is infinite or zero.
    pub modulus_interval_pa: (f64, f64),
    /// What was found for each curve.
    pub curves: Vec<CurveReport>,
    /// By what factor intervals are wider because residuals next to each other resemble each other (1: they do not).
    pub widened: f64,
    /// Whether weights, modulus and contact points came to rest; what is reported is the best so far.
    pub converged: bool,
}

/// How many samples of a curve were used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleCounts {
    /// Samples used.
    pub used: usize,
    /// Of them in contact.
    pub in_contact: usize,
    /// Of them left out or down-weighted by half or more.
    pub outliers: usize,
}

/// What was found for a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveReport {
    /// Contact point in m on the curve's own scale.
    pub contact_m: f64,
    /// Its interval; an end that the data leave open is infinite.
    pub contact_interval_m: (f64, f64),
    /// Force in N of the baseline at zero indentation of the curve's own scale.
    pub offset_n: f64,
    /// Slope in N/m of the baseline.
    pub tilt_n_m: f64,
    /// Standard deviation in N of the noise without force (relative to the curve's own sigmas if it has them).
    pub sigma_n: f64,
    /// The noise's part r that is proportional to the force.
    pub proportional: f64,
    /// Deepest indentation in m from the contact point that was used.
    pub depth_m: f64,
    /// Samples used.
    pub samples: SampleCounts,
    /// Correlation of residuals that follow each other.
    pub autocorrelation: f64,
    /// What to beware of.
    pub flags: Flags,
}

/// What to beware of in a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Flags {
    /// Fewer than three samples lie ahead of the contact point: it is extrapolated.
    pub contact_unseen: bool,
    /// The contact point's interval is open or as wide as half the depth.
    pub contact_undetermined: bool,
    /// The residuals have a trend: the law does not describe the curve over this range, or the noise has a memory.
    pub misfit: bool,
    /// The range is beyond where the law holds.
    pub beyond_law: bool,
    /// The force comes in steps larger than its noise: where nothing touches all samples are rounded alike. The intervals
    /// allow for half a step of that.
    pub coarse_reading: bool,
}
