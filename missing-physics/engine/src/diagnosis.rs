//! The answer: everything that a report, a machine or another program needs of a diagnosis.

use serde::{Deserialize, Serialize};

use crate::repaired::Repaired;

/// What the recording says of the baseline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// The baseline explains the data to within their noise.
    Adequate,
    /// The chosen mechanisms bring the model to within the noise.
    Explained,
    /// The chosen mechanisms are needed and take away nearly all of the misfit; a smaller one is left.
    Partly,
    /// Several sets of mechanisms fit equally well.
    Ambiguous,
    /// Something is wrong that no listed mechanism describes.
    Unexplained,
}

impl Verdict {
    /// The word of the answer's format.
    pub fn word(self) -> &'static str {
        match self {
            Self::Adequate => "adequate",
            Self::Explained => "explained",
            Self::Partly => "partly",
            Self::Ambiguous => "ambiguous",
            Self::Unexplained => "unexplained",
        }
    }
}

/// Where a channel's noise level comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseSource {
    /// A calibration that came with the recording.
    Calibration,
    /// Rows that were measured again under the same conditions.
    Replicates,
    /// The data themselves: what is left of them once everything smooth is taken away.
    Differences,
}

impl NoiseSource {
    /// The word of the answer's format.
    pub fn word(self) -> &'static str {
        match self {
            Self::Calibration => "calibration",
            Self::Replicates => "replicates",
            Self::Differences => "differences",
        }
    }
}

/// The noise of one channel under the model that the diagnosis ended with.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelNoise {
    /// Name of the channel.
    pub channel: String,
    /// One sigma of a reading, in the channel's unit, the correlated part included.
    pub sigma: f64,
    /// Where it comes from.
    pub source: NoiseSource,
    /// The part of the variance that is correlated from row to row, in [0, 1].
    pub correlated_share: f64,
    /// Correlation length of that part in rows; 0 for white noise.
    pub correlation_rows: f64,
    /// Correlation length of that part along the noise variable, in that variable's unit; 0 for white noise.
    pub correlation_length: f64,
    /// What scatters and adds up along a run, so that it makes that part.
    pub scatter: Option<Scatter>,
}

/// A scatter from step to step whose effect adds up along a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scatter {
    /// What scatters, in words ("the logarithm of the restitution").
    pub of: String,
    /// One sigma of a step, in the unit of what scatters.
    pub sigma: f64,
    /// Correlation of neighbouring steps, in [0, 1).
    pub memory: f64,
    /// One sigma of the white noise of a reading beside it, in the channel's unit.
    pub white: f64,
}

/// One test of a model's adequacy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TestOutcome {
    /// What was tested, for a person (`z_m depends on t_s`).
    pub name: String,
    /// The statistic.
    pub statistic: f64,
    /// Its own p-value, before multiplicity is accounted for.
    pub p_value: f64,
}

/// One unknown more that would take a misfit away, acting at a place alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AsIf {
    /// What it is, for a person, with its article (`a force`).
    pub what: String,
    /// How large each of its components is there on average, with intervals for noise on the scale of a few rows.
    pub sizes: Vec<Estimate>,
}

/// A place where the cause of a misfit acts, or, where no single cause is known that would take it away, where the baseline misses the
/// data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Location {
    /// Name of the channel.
    pub channel: String,
    /// Name of the variable along which the place is an interval.
    pub variable: Option<String>,
    /// Its unit; empty for a pure number.
    pub variable_unit: String,
    /// Start of the interval.
    pub from: Option<f64>,
    /// End of the interval.
    pub to: Option<f64>,
    /// Whether that is all that the variable takes in rows that were measured.
    pub whole_range: bool,
    /// Labels of the runs in which it shows.
    pub runs: Vec<String>,
    /// Share of the whole misfit that lies here, in [0, 1].
    pub share: f64,
    /// Mean residual there (measured less predicted), in the channel's unit.
    pub mean_residual: f64,
    /// Root mean square of the residual there, in the channel's unit.
    pub rms: f64,
    /// The residual of largest modulus there, in the channel's unit.
    pub largest_residual: f64,
    /// One sigma of the channel's noise on the scale of a few rows, in its unit.
    pub sigma: f64,
    /// Size of the misfit in standard errors.
    pub z: f64,
    /// What acts there, where the model tells of something that would take the misfit away; `None` for an offset of the readings.
    pub as_if: Option<AsIf>,
}

/// A parameter's estimate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// Name with its unit as a suffix.
    pub name: String,
    /// The unit alone.
    pub unit: String,
    /// Best value.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
}

/// What is said of one mechanism.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MechanismReport {
    /// Identifier.
    pub id: String,
    /// Name for a person.
    pub name: String,
    /// Equation.
    pub equation: String,
    /// Reference.
    pub reference: String,
    /// Probability that it is at work, given these data and the listed mechanisms.
    pub probability: f64,
    /// Its parameters, from the best set that holds it (alone, where it is in none of the leading sets).
    pub parameters: Vec<Estimate>,
    /// Gain in log score on runs that the fit has not seen, over the baseline by the same rule of noise.
    pub heldout_log_score_gain: f64,
    /// Root mean square error on such runs, by channel.
    pub heldout_rmse: Vec<(String, f64)>,
    /// Why it is no explanation, where it is none (`at its bound`, `negative drag`).
    pub ruled_out: Option<String>,
}

/// What is said of one set of mechanisms.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SetReport {
    /// Identifiers; empty for the baseline.
    pub ids: Vec<String>,
    /// Probability among all sets that were tried.
    pub probability: f64,
    /// p-value of the set's adequacy, where it was tested.
    pub p_value: Option<f64>,
    /// Gain in log score on unseen runs, over the baseline by the same rule of noise.
    pub heldout_log_score_gain: Option<f64>,
    /// Why it is no explanation, where it is none.
    pub ruled_out: Option<String>,
}

/// Errors of one channel under one model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelFit {
    /// Name of the channel.
    pub channel: String,
    /// Root mean square residual of the fit to all runs.
    pub rmse: f64,
    /// Root mean square residual on runs that the fit has not seen.
    pub heldout_rmse: f64,
}

/// The set of mechanisms that comes closest where none explains the data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Closest {
    /// Identifiers.
    pub ids: Vec<String>,
    /// The part of the squared misfit beyond the noise that it takes away on unseen data; none where that is lost in the noise, though the set
    /// is clearly likelier than the baseline.
    pub share: Option<f64>,
    /// Other sets that are as likely, where no share is known.
    pub as_likely: Vec<Vec<String>>,
    /// Its parameters, as they are if it is at work and what it leaves is smooth.
    pub parameters: Vec<Estimate>,
}

/// By how much a parameter differs from run to run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunSpread {
    /// Name of the parameter, with its unit as a suffix.
    pub parameter: String,
    /// The unit alone.
    pub unit: String,
    /// Its common value.
    pub value: f64,
    /// Standard deviation between runs beyond what their noise explains; the parameter's interval allows for it.
    pub standard_deviation: f64,
}

/// The part of the squared misfit beyond the noise that a main cause takes away on unseen data, at least.
pub const NEARLY_ALL: f64 = 0.9;

/// What is left over because the runs are not alike, in a quantity that was taken to be the same in all of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunDifference {
    /// What it is, for a person, with its article.
    pub name: String,
    /// Name of the quantity, with its unit as a suffix.
    pub parameter: String,
    /// The unit alone.
    pub unit: String,
    /// In each run.
    pub by_run: Vec<RunValue>,
}

/// A run's value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunValue {
    /// Label of the run.
    pub run: String,
    /// The value.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// A few runs that contradict the others, and the answer without them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contradiction {
    /// Labels of the runs.
    pub runs: Vec<String>,
    /// The part of the squared misfit beyond the noise that lies in them, of a model fitted to the others.
    pub share: f64,
    /// The verdict without them.
    pub verdict: Verdict,
    /// The set chosen without them.
    pub chosen: Vec<String>,
    /// Other sets that fit equally well without them.
    pub confused_with: Vec<Vec<String>>,
    /// The chosen set's parameters without them.
    pub parameters: Vec<Estimate>,
}

/// What these data would have shown of a mechanism that they do not show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limit {
    /// Identifier of the mechanism.
    pub id: String,
    /// Name of its parameter, with the unit as a suffix.
    pub parameter: String,
    /// The unit alone.
    pub unit: String,
    /// A size (modulus) above this is excluded at 95 %.
    pub upper: f64,
}

/// How often data from one rival are taken for another's, by simulation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Confusion {
    /// The rival sets.
    pub sets: Vec<Vec<String>>,
    /// `matrix[i][j]`: the share of data simulated from set `i` for which set `j` is chosen.
    pub matrix: Vec<Vec<f64>>,
}

/// The empirical law found in the residual of an unexplained recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Law {
    /// The whole law, in plain text.
    pub formula: String,
    /// `sparse` (a few terms), `power` (another exponent), `periodic` (an oscillation) or `smooth` (an empirical curve, no formula).
    pub kind: &'static str,
    /// Identifiers of the mechanisms on top of which it stands.
    pub beside: Vec<String>,
    /// Channel or quantity that it adds to, with its unit.
    pub adds_to: (String, String),
    /// Variables in it, with their units.
    pub variables: Vec<(String, String)>,
    /// Its coefficients.
    pub coefficients: Vec<Estimate>,
    /// Root mean square error on unseen data by channel: name, without the law, with it.
    pub heldout_rmse: Vec<(String, f64, f64)>,
    /// Gain in log score on unseen data.
    pub heldout_log_score_gain: f64,
    /// p-value of the model with the law, of a few terms: whether it leaves no more than the noise.
    pub p_value: Option<f64>,
}

/// The action that separates the rivals best.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NextExperiment {
    /// Settings, by name with unit.
    pub action: Vec<(String, f64)>,
    /// The action in words.
    pub words: String,
    /// What is set in each row of its runs, by the names of the recording's variables: when to measure, what to command.
    #[serde(skip)]
    pub inputs: Vec<Vec<(String, Vec<f64>)>>,
    /// Identifiers of the mechanisms that it tells apart.
    pub separates: Vec<String>,
    /// Expected log Bayes factor for the true rival against the nearest other.
    pub expected_log_bayes_factor: f64,
}

/// A row that was set aside because its neighbours contradict it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outlier {
    /// Label of the run.
    pub run: String,
    /// Row in the run, from 0.
    pub row: usize,
    /// Name of the channel.
    pub channel: String,
    /// Distance from what its neighbours say, in robust sigmas.
    pub z: f64,
}

/// Data and fits of one run, for drawing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curves {
    /// Label of the run.
    pub run: String,
    /// Known inputs, one column a variable.
    pub inputs: Vec<Vec<f64>>,
    /// Measurements, one column a channel (NaN where missing).
    pub measured: Vec<Vec<f64>>,
    /// The baseline's fit, one column a channel.
    pub before: Vec<Vec<f64>>,
    /// The final model's fit, one column a channel; equal to `before` where nothing was added.
    pub after: Vec<Vec<f64>>,
}

/// A whole diagnosis. It is [`Serialize`] as it stands; the format of the tool's answers is the report's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Diagnosis {
    /// The verdict.
    pub verdict: Verdict,
    /// p-value of the baseline's adequacy.
    pub p_value: f64,
    /// The smallest p-value that the bootstrap could give; `p_value` at this floor means "below".
    pub p_floor: f64,
    /// The tests that made up the p-value.
    pub tests: Vec<TestOutcome>,
    /// Names and units of channels.
    pub channels: Vec<(String, String)>,
    /// Names and units of known inputs.
    pub variables: Vec<(String, String)>,
    /// What the baseline is.
    pub baseline: String,
    /// The shared parameters of the baseline.
    pub baseline_parameters: Vec<Estimate>,
    /// Noise by channel.
    pub noise: Vec<ChannelNoise>,
    /// Where the baseline misses; empty only for [`Verdict::Adequate`].
    pub location: Vec<Location>,
    /// Every mechanism that these data can speak of, likeliest first.
    pub mechanisms: Vec<MechanismReport>,
    /// The leading sets of mechanisms, likeliest first.
    pub sets: Vec<SetReport>,
    /// The chosen set.
    pub chosen: Vec<String>,
    /// Other sets that fit equally well.
    pub confused_with: Vec<Vec<String>>,
    /// How the rivals are confused, by simulation.
    pub confusion: Option<Confusion>,
    /// The part of the squared misfit beyond the noise that the chosen mechanisms take away on unseen data, where some were chosen.
    pub explained_share: Option<f64>,
    /// What the chosen mechanisms leave, by place, for [`Verdict::Partly`].
    pub leftover: Vec<Location>,
    /// The set that comes closest, for [`Verdict::Unexplained`].
    pub closest: Option<Closest>,
    /// The size of each mechanism that would have shown, for [`Verdict::Adequate`].
    pub limits: Vec<Limit>,
    /// Parameters of the chosen mechanisms that differ from run to run.
    pub between_runs: Vec<RunSpread>,
    /// What the runs differ by that no mechanism names.
    pub run_differences: Vec<RunDifference>,
    /// Runs that contradict the others, where there are a few and the others have a better answer.
    pub contradiction: Option<Contradiction>,
    /// p-value of the final model's adequacy, where one was chosen.
    pub final_p_value: Option<f64>,
    /// Errors of the baseline.
    pub before: Vec<ChannelFit>,
    /// Errors of the final model.
    pub after: Vec<ChannelFit>,
    /// The law found where nothing listed explains the data.
    pub law: Option<Law>,
    /// The experiment to do next.
    pub next_experiment: Option<NextExperiment>,
    /// What these data cannot determine, one sentence each.
    pub undetermined: Vec<String>,
    /// Rows set aside.
    pub outliers: Vec<Outlier>,
    /// Remarks: non-convergence, few rows, strong correlation.
    pub remarks: Vec<String>,
    /// The model that the diagnosis ended with: the chosen mechanisms on, or the baseline.
    pub repaired: Repaired,
    /// Data and fits, for drawing.
    pub curves: Vec<Curves>,
}

/// Names in one phrase: "a, b and c"; "a; b and c" where a name has a comma of its own.
pub fn listed(names: &[String]) -> String {
    let between = if names.iter().any(|name| name.contains(", ")) { "; " } else { ", " };
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} and {last}", most.join(between)),
    }
}
