//! Models that know the density of their data: through the score, the likelihood's gradient at the baseline.
//!
//! Near the baseline the score carries all that the data say of the parameters (Rao 1948, doi:10.1017/S0305004100023987). So a
//! model with a likelihood becomes a [`Simulator`] whose statistics are the scores of a run, and [`Synthetic`] puts it before
//! the engine.

use rand::Rng;

use crate::data::{Recording, Run};
use crate::model::{PredictError, Quantity, Scope, Spec};
use crate::synthetic::{Simulator, Synthetic, SyntheticError};

/// A stochastic model whose data have a density. Its parameters are all shared.
pub trait Likelihood: Sync {
    /// Parameters, mechanisms and candidate terms; all of [`Scope::Shared`].
    fn spec(&self) -> &Spec;

    /// The log density of a run's measurements.
    ///
    /// # Errors
    /// [`PredictError`] where the model has no answer at these parameters.
    fn log_density(&self, run: &Run, shared: &[f64]) -> Result<f64, PredictError>;

    /// Replaces a run's measurements by simulated ones.
    ///
    /// # Errors
    /// As [`Likelihood::log_density`].
    fn draw(&self, run: &mut Run, shared: &[f64], rng: &mut dyn Rng) -> Result<(), PredictError>;
}

/// A [`Likelihood`] seen through its scores at a reference point.
#[derive(Debug)]
pub struct Scores<L> {
    likelihood: L,
    reference: Vec<f64>,
    statistics: Vec<Quantity>,
}

impl<L: Likelihood> Scores<L> {
    /// Puts a model with a likelihood behind the engine: the reference is the baseline's maximum of the likelihood.
    ///
    /// Returns the model and the recording to diagnose with it, as [`Synthetic::new`] does.
    ///
    /// # Errors
    /// [`SyntheticError`]; a parameter that is not shared is a [`PredictError`].
    pub fn put(
        likelihood: L,
        runs: &[Run],
        draws: usize,
        seed: u64,
    ) -> Result<(Synthetic<Self>, Recording), SyntheticError> {
        let spec = likelihood.spec();
        spec.check()?;
        if let Some(nuisance) = spec.parameters.iter().find(|p| p.scope != Scope::Shared) {
            let reason = format!("parameter {} is of each run, expected shared ones", nuisance.name);
            return Err(PredictError { run: "(all)".into(), reason }.into());
        }
        let statistics =
            spec.parameters.iter().map(|p| Quantity::new(format!("score of {}", p.name), "")).collect();
        let reference = spec.parameters.iter().map(|p| p.start).collect();
        let mut scores = Self { likelihood, reference, statistics };
        scores.reference = scores.maximum(runs)?;
        let observed = runs
            .iter()
            .map(|run| Ok((run.clone(), scores.score(run)?)))
            .collect::<Result<Vec<_>, PredictError>>()?;
        Synthetic::new(scores, &observed, draws, seed)
    }

    fn step(&self, i: usize) -> f64 {
        1e-4 * self.likelihood.spec().parameters[i].scale
    }

    /// The derivative of a run's log density at `shared` along parameter `i`, one-sided at a bound.
    fn slope(&self, run: &Run, shared: &[f64], i: usize) -> Result<f64, PredictError> {
        let p = &self.likelihood.spec().parameters[i];
        let (mut high, mut low) = (shared.to_vec(), shared.to_vec());
        high[i] = (shared[i] + self.step(i)).min(p.upper);
        low[i] = (shared[i] - self.step(i)).max(p.lower);
        let rise = self.likelihood.log_density(run, &high)? - self.likelihood.log_density(run, &low)?;
        Ok(rise / (high[i] - low[i]))
    }

    fn score(&self, run: &Run) -> Result<Vec<f64>, PredictError> {
        (0..self.reference.len()).map(|i| self.slope(run, &self.reference, i)).collect()
    }

    /// Coordinate-wise Newton steps on the baseline's parameters, halved where they do not climb.
    fn maximum(&self, runs: &[Run]) -> Result<Vec<f64>, PredictError> {
        let spec = self.likelihood.spec();
        let added = |i: &usize| {
            spec.mechanisms.iter().any(|m| m.parameters.contains(i) || m.companions.contains(i))
                || spec.terms.iter().any(|t| t.parameter == *i)
        };
        let free: Vec<usize> = (0..spec.parameters.len()).filter(|i| !added(i)).collect();
        let total = |x: &[f64]| -> Result<f64, PredictError> {
            runs.iter().map(|run| self.likelihood.log_density(run, x)).sum()
        };
        let mut x = self.reference.clone();
        let mut value = total(&x)?;
        for _ in 0..200 {
            let before = value;
            for &i in &free {
                let p = &spec.parameters[i];
                let h = 10.0 * self.step(i);
                let at = |d: f64| {
                    let mut y = x.clone();
                    y[i] = (x[i] + d).clamp(p.lower, p.upper);
                    total(&y).map(|v| (y, v))
                };
                let (up, down) = (at(h)?.1, at(-h)?.1);
                let (slope, bend) = ((up - down) / (2.0 * h), (up - 2.0 * value + down) / (h * h));
                let mut step = if bend < 0.0 { -slope / bend } else { slope.signum() * p.scale };
                for _ in 0..30 {
                    if let Ok((y, v)) = at(step)
                        && v > value
                    {
                        (x, value) = (y, v);
                        break;
                    }
                    step *= 0.5;
                }
            }
            if value - before < 1e-8 {
                break;
            }
        }
        Ok(x)
    }
}

impl<L: Likelihood> Simulator for Scores<L> {
    fn spec(&self) -> &Spec {
        self.likelihood.spec()
    }

    fn statistics(&self) -> &[Quantity] {
        &self.statistics
    }

    fn simulate(
        &self,
        run: &Run,
        shared: &[f64],
        _nuisance: &[f64],
        rng: &mut dyn Rng,
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        let mut drawn = run.clone();
        self.likelihood.draw(&mut drawn, shared, rng)?;
        out.copy_from_slice(&self.score(&drawn)?);
        Ok(())
    }

    fn reference(&self) -> Option<&[f64]> {
        Some(&self.reference)
    }
}
