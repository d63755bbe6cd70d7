//! The model that a diagnosis ended with, as a value: to be kept, and to predict runs that were not there.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::data::{Recording, RecordingError};
use crate::fit::columns::normal_of_run;
use crate::fit::gauss_newton::solve;
pub use crate::law::added::AddedLaw;
use crate::law::extended::Extended;
use crate::linalg::inverse;
use crate::model::{Model, PredictError, Quantity, Spec, SpecError};
use crate::noise::family::Family;
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};
use crate::selection::candidate::Candidate;

/// A model with its mechanisms on, and how well its parameters are known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Repaired {
    /// Identifiers of the mechanisms that are on; none for a baseline that was adequate.
    pub mechanisms: Vec<String>,
    /// The empirical law beside them, where one was found; its coefficients are the last of `parameters`, but for those of terms, which
    /// the full model has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<AddedLaw>,
    /// All shared parameters of the full model, in its order.
    pub parameters: Vec<Shared>,
    /// Which of them were fitted: indices into `parameters`.
    pub fitted: Vec<usize>,
    /// Covariance of the fitted ones, row by row, in their order.
    pub covariance: Vec<Vec<f64>>,
    /// Noise by channel.
    pub noise: Vec<KnownNoise>,
    /// Step between rows to which the noise's correlation refers, in the unit of the variable along which it runs.
    pub noise_step: f64,
}

/// A shared parameter and its value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shared {
    /// Name with its unit as a suffix.
    pub name: String,
    /// The value.
    pub value: f64,
}

/// The noise of a channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownNoise {
    /// Name of the channel.
    pub channel: String,
    /// One sigma of a reading.
    pub sigma: f64,
    /// Number of its correlation among the shapes that the engine knows; 0 is white.
    pub shape: usize,
}

/// Why a repaired model cannot predict a recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RepairedError {
    /// The model was written for another simulation.
    #[error("the model knows the {what} {got}, this simulation has {expected}")]
    Other {
        /// What differs (`channels`, `parameters`, `mechanism`).
        what: &'static str,
        /// What the model has.
        got: String,
        /// What the simulation has.
        expected: String,
    },
    /// Sizes, signs or numbers that no diagnosis writes.
    #[error("the model is damaged: {0}")]
    Damaged(&'static str),
    /// A run with too few measured values for its nuisance parameters.
    #[error("run {run} has {got} measured values, expected at least {expected} to tell how it began")]
    NotStarted {
        /// Label of the run.
        run: String,
        /// Measured values in it.
        got: usize,
        /// Its nuisance parameters.
        expected: usize,
    },
    /// The simulation's specification makes no sense.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The recording is not sound.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The simulation gave no prediction.
    #[error(transparent)]
    Predict(#[from] PredictError),
}

/// What the model says of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictedRun {
    /// Label of the run.
    pub label: String,
    /// Simulated channels, one column each.
    pub channels: Vec<Vec<f64>>,
    /// One sigma of each simulated value: what is not known of the shared parameters and of the run's nuisance ones.
    pub sigma: Vec<Vec<f64>>,
}

impl Repaired {
    pub(crate) fn of(problem: &Problem<'_>, model: &Candidate) -> Self {
        let spec = problem.spec();
        let (fit, selection) = (&model.fit, &model.selection);
        let covariance = inverse(&fit.information);
        let shared = problem.shared.index.iter().zip(&fit.shared);
        Self {
            mechanisms: model.set.iter().map(|&m| spec.mechanisms[m].id.clone()).collect(),
            law: None,
            parameters: shared
                .map(|(&i, &value)| Shared { name: spec.parameters[i].name.clone(), value })
                .collect(),
            fitted: selection.shared.clone(),
            covariance: covariance.row_iter().map(|row| row.iter().copied().collect()).collect(),
            noise: (0..problem.channels())
                .map(|c| KnownNoise {
                    channel: problem.recording.channels[c].name.clone(),
                    sigma: fit.noise.sigma[c],
                    shape: fit.noise.shape[c],
                })
                .collect(),
            noise_step: problem.step,
        }
    }

    /// Predicts every row of a recording, measured or not (NaN where a channel was not measured).
    ///
    /// The shared parameters stay as they were found; each run's nuisance ones (where it began) are fitted to its measured rows.
    ///
    /// # Errors
    /// [`RepairedError`].
    pub fn predict(
        &self,
        model: &dyn Model,
        recording: &Recording,
    ) -> Result<Vec<PredictedRun>, RepairedError> {
        model.spec().check()?;
        recording.check()?;
        let sigma: Vec<f64> = self.noise.iter().map(|n| n.sigma).collect();
        let again = |law: &AddedLaw| {
            let unknown =
                || RepairedError::Damaged("its law is of a channel or variable that the recording has not");
            Extended::again(model, recording, law, &sigma).ok_or_else(unknown)
        };
        let added = self.law.as_ref().filter(|law| !matches!(law, AddedLaw::Terms { .. }));
        let extended = added.map(again).transpose()?;
        let model = extended.as_ref().map_or(model, |extended| extended as &dyn Model);
        let mut problem = Problem::new(model, recording.clone());
        problem.step = self.noise_step;
        let selection = self.matching(&problem)?;
        let noise = NoiseState { shape: self.noise.iter().map(|n| n.shape).collect(), sigma };
        let unknown = selection.nuisance.len();
        for (run, rows) in recording.runs.iter().zip(&problem.rows) {
            let got = rows.valid.iter().map(Vec::len).sum();
            if got < unknown {
                return Err(RepairedError::NotStarted { run: run.label.clone(), got, expected: unknown });
            }
        }
        let shared = self.shared(&problem);
        let still = selection.without_shared();
        let nuisance = solve(&problem, &still, &noise, &shared, &problem.nuisance_start)?.nuisance;
        (0..recording.runs.len())
            .map(|run| self.predict_run(&problem, &selection, &noise, run, &shared, &nuisance[run]))
            .collect()
    }

    /// Values of the shared parameters. What only mechanisms that are off have is where it makes no difference in this recording, which need
    /// not be where it made none in the recording that was diagnosed (a sensor's bounds lie beyond all readings).
    fn shared(&self, problem: &Problem<'_>) -> Vec<f64> {
        let spec = problem.spec();
        let has = |on: bool, parameter: usize| {
            let mut mechanisms = spec.mechanisms.iter().filter(|m| self.mechanisms.contains(&m.id) == on);
            mechanisms.any(|m| m.parameters.contains(&parameter))
        };
        let value = |(slot, (&index, found)): (usize, (&usize, &Shared))| {
            // What was freed beside the mechanisms that are on (a companion) was found as well.
            let off = has(false, index) && !has(true, index) && !self.fitted.contains(&slot);
            if off { spec.parameters[index].start } else { found.value }
        };
        problem.shared.index.iter().zip(&self.parameters).enumerate().map(value).collect()
    }

    fn predict_run(
        &self,
        problem: &Problem<'_>,
        selection: &Selection,
        noise: &NoiseState,
        run: usize,
        shared: &[f64],
        nuisance: &[f64],
    ) -> Result<PredictedRun, RepairedError> {
        let data = &problem.recording.runs[run];
        let (n_shared, n_nuisance) = (selection.shared.len(), selection.nuisance.len());
        let rows = problem.channels() * data.len();
        let (mut out, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * (n_shared + n_nuisance)]);
        problem.model.jacobian(
            data,
            shared,
            nuisance,
            &selection.shared,
            &selection.nuisance,
            &mut out,
            &mut jacobian,
        )?;
        let jacobian = DMatrix::from_vec(rows, n_shared + n_nuisance, jacobian);
        // The run's nuisance parameters follow the shared ones: d own / d shared = -A^-1 B of its normal equations.
        let normal = normal_of_run(problem, selection, noise, run, shared, nuisance)?;
        let nuisance_covariance = inverse(&normal.view((0, 0), (n_nuisance, n_nuisance)).into_owned());
        let follow = -(&nuisance_covariance * normal.view((0, n_nuisance), (n_nuisance, n_shared)));
        let covariance = DMatrix::from_fn(n_shared, n_shared, |i, j| self.covariance[i][j]);
        let by_nuisance = jacobian.columns(n_shared, n_nuisance).into_owned();
        let by_shared = jacobian.columns(0, n_shared) + &by_nuisance * follow;
        let quadratic = |by: &DMatrix<f64>, of: &DMatrix<f64>| -> DVector<f64> {
            let product = by * of;
            DVector::from_iterator(rows, (0..rows).map(|r| product.row(r).dot(&by.row(r))))
        };
        let variance = quadratic(&by_nuisance, &nuisance_covariance) + quadratic(&by_shared, &covariance);
        let sigma: Vec<f64> = variance.iter().map(|v| v.max(0.0).sqrt()).collect();
        let columns = |all: &[f64]| all.chunks(data.len().max(1)).map(<[f64]>::to_vec).collect();
        Ok(PredictedRun { label: data.label.clone(), channels: columns(&out), sigma: columns(&sigma) })
    }

    /// The simulation's candidate terms that the law is made of.
    fn terms(&self, spec: &Spec) -> Result<Vec<usize>, RepairedError> {
        let Some(AddedLaw::Terms { coefficients }) = &self.law else { return Ok(Vec::new()) };
        let named = |name: &String| {
            let known = spec.terms.iter().position(|t| spec.parameters[t.parameter].name == *name);
            known.ok_or(RepairedError::Damaged("its law has a term that the simulation has not"))
        };
        coefficients.iter().map(named).collect()
    }

    /// What is free with the model's mechanisms on, if the model is one of this simulation's.
    fn matching(&self, problem: &Problem<'_>) -> Result<Selection, RepairedError> {
        let spec = problem.spec();
        let differ = |what, got: Vec<&str>, expected: Vec<&str>| {
            if got == expected {
                return Ok(());
            }
            Err(RepairedError::Other { what, got: got.join(", "), expected: expected.join(", ") })
        };
        fn names(list: &[Quantity]) -> Vec<&str> {
            list.iter().map(|q| q.name.as_str()).collect()
        }
        let channels = self.noise.iter().map(|n| n.channel.as_str()).collect();
        differ("channels", channels, names(&problem.recording.channels))?;
        let known = problem.shared.index.iter().map(|&i| spec.parameters[i].name.as_str()).collect();
        differ("parameters", self.parameters.iter().map(|p| p.name.as_str()).collect(), known)?;
        let set = self
            .mechanisms
            .iter()
            .map(|id| {
                spec.mechanisms.iter().position(|m| m.id == *id).ok_or_else(|| RepairedError::Other {
                    what: "mechanism",
                    got: id.clone(),
                    expected: spec.mechanisms.iter().map(|m| m.id.as_str()).collect::<Vec<_>>().join(", "),
                })
            })
            .collect::<Result<Vec<usize>, _>>()?;
        let selection = problem.select(&set, &self.terms(spec)?);
        let n = self.fitted.len();
        let finite = |v: &f64| v.is_finite();
        if self.fitted != selection.shared {
            return Err(RepairedError::Damaged("its fitted parameters are not those of its mechanisms"));
        }
        if self.covariance.len() != n || self.covariance.iter().any(|r| r.len() != n || !r.iter().all(finite))
        {
            return Err(RepairedError::Damaged("its covariance is not a square of finite numbers"));
        }
        if !self.parameters.iter().all(|p| p.value.is_finite()) || !(self.noise_step > 0.0) {
            return Err(RepairedError::Damaged("a parameter or step that is no number"));
        }
        let shapes = Family::get().len();
        if self.noise.iter().any(|n| !(n.sigma > 0.0 && n.sigma.is_finite()) || n.shape >= shapes) {
            return Err(RepairedError::Damaged("noise that is not above zero, or of no known shape"));
        }
        Ok(selection)
    }
}
