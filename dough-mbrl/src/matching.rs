//! Dynamics of a dough that is not known, from those of doughs that are: interpolated by stiffness ([Matl 2021], eq. 7.2).

use crate::predictor::{LearnError, Prediction, Predictor, Refit};
use crate::roll::{Action, Roll, State};

/// A dough whose stiffness and dynamics are known.
#[derive(Debug, Clone)]
pub struct Known<M> {
    /// Its stiffness, N/m.
    pub stiffness_n_m: f64,
    /// Its dynamics.
    pub dynamics: M,
}

/// Known dynamics by stiffness, mixed for one stiffness.
#[derive(Debug, Clone)]
pub struct Matched<M> {
    low: M,
    high: M,
    share: f64,
}

/// Why nothing was matched.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MatchError {
    /// Too few doughs.
    #[error("{known} known doughs: at least 2 of different stiffness are needed")]
    TooFew {
        /// Doughs that came.
        known: usize,
    },
    /// Stiffnesses that are none, or the same twice.
    #[error("a stiffness of {stiffness_n_m} N/m: expected above 0, finite, and none twice")]
    Stiffness {
        /// The value.
        stiffness_n_m: f64,
    },
}

impl<M: Clone> Matched<M> {
    /// Mixes the two known doughs between whose stiffness (N/m) that of the unknown one lies; outside all, the nearest one counts.
    ///
    /// # Errors
    /// [`MatchError`].
    pub fn new(known: &[Known<M>], stiffness_n_m: f64) -> Result<Self, MatchError> {
        let mut sorted: Vec<&Known<M>> = known.iter().collect();
        sorted.sort_by(|a, b| a.stiffness_n_m.total_cmp(&b.stiffness_n_m));
        let bad = |s: f64| !(s > 0.0 && s.is_finite());
        if let Some(&s) = known.iter().map(|k| &k.stiffness_n_m).chain([&stiffness_n_m]).find(|s| bad(**s)) {
            return Err(MatchError::Stiffness { stiffness_n_m: s });
        }
        if let Some(twice) = sorted.windows(2).find(|w| w[0].stiffness_n_m == w[1].stiffness_n_m) {
            return Err(MatchError::Stiffness { stiffness_n_m: twice[0].stiffness_n_m });
        }
        let pair = sorted
            .windows(2)
            .find(|w| stiffness_n_m <= w[1].stiffness_n_m)
            .or_else(|| sorted.windows(2).last());
        let Some([low, high]) = pair else { return Err(MatchError::TooFew { known: known.len() }) };
        let share =
            ((stiffness_n_m - low.stiffness_n_m) / (high.stiffness_n_m - low.stiffness_n_m)).clamp(0.0, 1.0);
        Ok(Self { low: low.dynamics.clone(), high: high.dynamics.clone(), share })
    }
}

impl<M> Matched<M> {
    /// Share of the stiffer dough, in [0, 1]: beta of [Matl 2021].
    pub fn share(&self) -> f64 {
        self.share
    }
}

impl<M: Predictor> Predictor for Matched<M> {
    fn next(&self, state: &State, action: &Action) -> State {
        let (a, b) = (self.low.next(state, action), self.high.next(state, action));
        std::array::from_fn(|k| (1.0 - self.share) * a[k] + self.share * b[k])
    }

    /// As unsure as its parts, and as they differ.
    fn predict(&self, state: &State, action: &Action) -> [Prediction; 3] {
        let (a, b) = (self.low.predict(state, action), self.high.predict(state, action));
        let (p, q) = (1.0 - self.share, self.share);
        std::array::from_fn(|k| {
            let mean = p * a[k].mean + q * b[k].mean;
            let apart = p * q * (a[k].mean - b[k].mean).powi(2);
            Prediction { mean, sigma: (p * a[k].sigma.powi(2) + q * b[k].sigma.powi(2) + apart).sqrt() }
        })
    }
}

/// New rolls are learned by both.
impl<M: Refit> Refit for Matched<M> {
    fn add(&mut self, roll: &Roll, weight: f64) -> Result<(), LearnError> {
        self.low.add(roll, weight)?;
        self.high.add(roll, weight)
    }

    fn refit(&mut self) -> Result<(), LearnError> {
        self.low.refit()?;
        self.high.refit()
    }

    fn distance_m(&self, state: &State) -> f64 {
        self.low.distance_m(state).min(self.high.distance_m(state))
    }
}
