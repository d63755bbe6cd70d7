//! Simulators with chance in them, through summary statistics: Wood's synthetic likelihood (2010, doi:10.1038/nature09319).
//!
//! A stochastic simulator is run many times at the same parameters with the same random numbers; the mean of its statistics
//! is then a smooth prediction, and their covariance is the noise. [`Synthetic`] is the [`Model`] that does so: one row a run,
//! one channel a statistic.

use std::collections::HashMap;

use nalgebra::DMatrix;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::data::{Recording, Run};
use crate::linalg::{SemiCholesky, rank};
use crate::model::{Model, PredictError, Quantity, Scope, Spec, SpecError};

/// A simulator with chance in it, seen through statistics of what it makes.
pub trait Simulator: Sync {
    /// Parameters, mechanisms and candidate terms.
    fn spec(&self) -> &Spec;

    /// The statistics, in order.
    fn statistics(&self) -> &[Quantity];

    /// Simulates a run once and fills in its statistics.
    ///
    /// The number of draws taken from `rng` should depend little on the parameters, so that the same random numbers mean
    /// the same thing at neighbouring parameters.
    ///
    /// # Errors
    /// [`PredictError`] where the simulation has no answer at these parameters.
    fn simulate(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        rng: &mut dyn Rng,
        out: &mut [f64],
    ) -> Result<(), PredictError>;

    /// Shared parameters near the truth, where the statistics' covariance is taken; `None` for each one's `start`.
    fn reference(&self) -> Option<&[f64]> {
        None
    }
}

/// A [`Simulator`] as a model: mean statistics at common random numbers, made uncorrelated and of unit variance.
///
/// Channel `k` is statistic `k` less what the statistics before it say of it, in standard deviations of the simulator at the
/// baseline: so correlated statistics are not counted twice.
#[derive(Debug)]
pub struct Synthetic<S> {
    simulator: S,
    draws: usize,
    seed: u64,
    centre: Vec<f64>,
    factor: SemiCholesky,
    /// The runs with all their rows, by label: the engine sees one row of each.
    whole: HashMap<String, Run>,
}

/// Why a simulator cannot be put behind the engine.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SyntheticError {
    /// Too few draws for a covariance of so many statistics.
    #[error("{draws} draws are too few for {statistics} statistics, expected at least {expected}")]
    TooFewDraws {
        /// Draws asked for.
        draws: usize,
        /// Number of statistics.
        statistics: usize,
        /// Draws needed.
        expected: usize,
    },
    /// The simulator's specification makes no sense.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The observed runs have another number of statistics.
    #[error("run {run} has {got} statistics, expected {expected}")]
    Statistics {
        /// Label of the run.
        run: String,
        /// Statistics found.
        got: usize,
        /// Statistics expected.
        expected: usize,
    },
    /// The simulation failed.
    #[error(transparent)]
    Predict(#[from] PredictError),
}

impl<S: Simulator> Synthetic<S> {
    /// Puts a simulator behind the engine; `runs` are the observed ones, each with its known inputs and statistics.
    ///
    /// Returns the model and the recording to diagnose with it. `draws` simulations stand behind each prediction.
    ///
    /// # Errors
    /// [`SyntheticError`].
    pub fn new(
        simulator: S,
        runs: &[(Run, Vec<f64>)],
        draws: usize,
        seed: u64,
    ) -> Result<(Self, Recording), SyntheticError> {
        simulator.spec().check()?;
        let n = simulator.statistics().len();
        if draws < 10 * n.max(1) {
            return Err(SyntheticError::TooFewDraws { draws, statistics: n, expected: 10 * n.max(1) });
        }
        for (run, statistics) in runs {
            if statistics.len() != n {
                return Err(SyntheticError::Statistics {
                    run: run.label.clone(),
                    got: statistics.len(),
                    expected: n,
                });
            }
        }
        let mut model = Self {
            simulator,
            draws,
            seed,
            centre: vec![0.0; n],
            factor: SemiCholesky::new(DMatrix::identity(n, n), rank::COVARIANCE),
            whole: runs.iter().map(|(run, _)| (run.label.clone(), run.clone())).collect(),
        };
        let (centre, covariance) = model.moments(runs)?;
        model.factor = SemiCholesky::new(covariance, rank::COVARIANCE);
        model.centre = centre;
        let recording = model.recording(runs);
        Ok((model, recording))
    }

    /// Mean and covariance of the statistics at the reference parameters, over all runs.
    fn moments(&self, runs: &[(Run, Vec<f64>)]) -> Result<(Vec<f64>, DMatrix<f64>), PredictError> {
        let n = self.centre.len();
        let start = |scope: Scope| -> Vec<f64> {
            self.simulator.spec().parameters.iter().filter(|p| p.scope == scope).map(|p| p.start).collect()
        };
        let nuisance = start(Scope::PerRun);
        let shared = self.simulator.reference().map_or_else(|| start(Scope::Shared), <[f64]>::to_vec);
        let (mut covariance, mut centre) = (DMatrix::zeros(n, n), vec![0.0; n]);
        for (run, _) in runs {
            let drawn = self.draw(run, &shared, &nuisance)?;
            let count = drawn.len() as f64;
            let mean: Vec<f64> = (0..n).map(|k| drawn.iter().map(|d| d[k]).sum::<f64>() / count).collect();
            for d in &drawn {
                for i in 0..n {
                    for j in 0..=i {
                        let product = (d[i] - mean[i]) * (d[j] - mean[j]);
                        covariance[(i, j)] += product / ((count - 1.0) * runs.len() as f64);
                    }
                }
            }
            centre.iter_mut().zip(&mean).for_each(|(c, m)| *c += m / runs.len() as f64);
        }
        // The prediction is itself a mean of draws and has their error.
        covariance *= 1.0 + 1.0 / self.draws as f64;
        Ok((centre, covariance))
    }

    /// The observed runs as the engine sees them.
    fn recording(&self, runs: &[(Run, Vec<f64>)]) -> Recording {
        let n = self.centre.len();
        let channels = self
            .simulator
            .statistics()
            .iter()
            .map(|q| Quantity::new(format!("{} (given those before it)", q.name), "sigma"))
            .collect();
        let inputs = runs.first().map_or(0, |(r, _)| r.inputs.len());
        Recording {
            channels,
            variables: (0..inputs).map(|i| Quantity::new(format!("input_{i}"), "")).collect(),
            runs: runs
                .iter()
                .map(|(run, statistics)| Run {
                    // One row a run: of an input that varies within a run the first value stands for it.
                    inputs: run.inputs.iter().map(|c| c.first().copied().into_iter().collect()).collect(),
                    outputs: self.standardised(statistics).into_iter().map(|v| vec![v]).collect(),
                    ..run.clone()
                })
                .collect(),
            noise_along: None,
            calibration: vec![Some(1.0); n],
            resolution: vec![0.0; n],
        }
    }

    /// The simulator.
    pub fn simulator(&self) -> &S {
        &self.simulator
    }

    fn draw(&self, run: &Run, shared: &[f64], nuisance: &[f64]) -> Result<Vec<Vec<f64>>, PredictError> {
        (0..self.draws as u64)
            .map(|k| {
                let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
                rng.set_stream(k);
                let mut out = vec![0.0; self.centre.len()];
                self.simulator.simulate(run, shared, nuisance, &mut rng, &mut out)?;
                Ok(out)
            })
            .collect()
    }

    fn standardised(&self, statistics: &[f64]) -> Vec<f64> {
        let mut left: Vec<f64> = statistics.iter().zip(&self.centre).map(|(s, c)| s - c).collect();
        self.factor.forward(&mut left);
        left
    }
}

impl<S: Simulator> Model for Synthetic<S> {
    fn spec(&self) -> &Spec {
        self.simulator.spec()
    }

    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        let drawn = self.draw(self.whole.get(&run.label).unwrap_or(run), shared, nuisance)?;
        let n = self.centre.len();
        let mean: Vec<f64> =
            (0..n).map(|k| drawn.iter().map(|d| d[k]).sum::<f64>() / drawn.len() as f64).collect();
        out.copy_from_slice(&self.standardised(&mean));
        Ok(())
    }
}
