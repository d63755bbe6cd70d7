//! Smooth functions of the inputs and of the prediction itself: what a residual may depend on when nothing is known.

use crate::fit::optimum::Fit;
use crate::linalg::legendre;
use crate::model::PredictError;
use crate::problem::Problem;

/// Degree of the polynomial in a variable that the adequacy test looks for.
pub(crate) const DEGREE: usize = 5;

/// Range of a prediction, in sigmas, below which it counts as constant.
const LEAST_RANGE: f64 = 0.1;

/// The variables of which a residual may be a smooth function: the inputs, and the channel's own prediction.
pub(crate) struct Curves {
    names: Vec<String>,
    channels: Vec<String>,
    /// `[variable][run][row]`: inputs, then predictions of each channel, scaled to [-1, 1]; `None` where constant.
    scaled: Vec<Option<Vec<Vec<f64>>>>,
}

impl Curves {
    pub(crate) fn new(problem: &Problem<'_>, fit: &Fit) -> Result<Self, PredictError> {
        let recording = &problem.recording;
        let inputs = recording.variables.len();
        let mut columns: Vec<Vec<Vec<f64>>> =
            (0..inputs).map(|v| recording.runs.iter().map(|run| run.inputs[v].clone()).collect()).collect();
        let mut predictions = vec![Vec::new(); problem.channels()];
        for (run, data) in recording.runs.iter().enumerate() {
            let n = data.len();
            let mut out = vec![0.0; n * problem.channels()];
            problem.model.predict(data, &fit.shared, &fit.nuisance[run], &mut out)?;
            for (c, p) in predictions.iter_mut().enumerate() {
                p.push(out[c * n..(c + 1) * n].to_vec());
            }
        }
        columns.extend(predictions);
        // A prediction that moves by less than the noise is no variable, and what moves it may be the noise itself.
        let least = |v: usize| v.checked_sub(inputs).map_or(0.0, |c| LEAST_RANGE * fit.noise.sigma[c]);
        let scaled = columns
            .into_iter()
            .enumerate()
            .map(|(v, runs)| {
                let (low, high) = runs
                    .iter()
                    .flatten()
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
                let clean =
                    problem.model.extensions().errors.is_none_or(|errors| errors.prediction_is_clean());
                let shown = v < inputs || clean;
                let moves = shown && high - low > least(v).max(1e-12 * high.abs().max(low.abs()));
                (moves && (high - low).is_finite()).then(|| {
                    runs.into_iter()
                        .map(|r| r.into_iter().map(|v| 2.0 * (v - low) / (high - low) - 1.0).collect())
                        .collect()
                })
            })
            .collect();
        Ok(Self {
            names: recording.variables.iter().map(|v| v.name.clone()).collect(),
            channels: recording.channels.iter().map(|c| c.name.clone()).collect(),
            scaled,
        })
    }

    /// Indices of the variables that count for a channel.
    pub(crate) fn of(&self, channel: usize) -> Vec<usize> {
        let inputs = self.names.len();
        (0..inputs).chain([inputs + channel]).filter(|&v| self.scaled[v].is_some()).collect()
    }

    pub(super) fn names(&self, channel: usize) -> Vec<String> {
        let label = |v: usize| match self.names.get(v) {
            Some(name) => name.clone(),
            None => format!("the predicted {}", self.channels[v - self.names.len()]),
        };
        self.of(channel).into_iter().map(label).collect()
    }

    pub(super) fn offset(&self, channel: usize) -> usize {
        (0..channel).map(|c| self.of(c).len()).sum()
    }

    pub(super) fn total(&self) -> usize {
        self.offset(self.channels.len())
    }

    /// Fills in Legendre polynomials of degrees 1 to [`DEGREE`] of the channel's variables.
    pub(super) fn fill(&self, problem: &Problem<'_>, run: usize, channel: usize, columns: &mut [Vec<f64>]) {
        for (k, v) in self.of(channel).into_iter().enumerate() {
            let first = (self.offset(channel) + k) * DEGREE;
            let polynomials = self.polynomials(problem, run, channel, v, DEGREE);
            for (column, values) in columns[first..].iter_mut().zip(polynomials.into_iter().skip(1)) {
                *column = values;
            }
        }
    }

    /// Legendre polynomials of degrees 0 to `degree` of a variable at a channel's measured rows.
    pub(crate) fn polynomials(
        &self,
        problem: &Problem<'_>,
        run: usize,
        channel: usize,
        variable: usize,
        degree: usize,
    ) -> Vec<Vec<f64>> {
        let valid = &problem.rows[run].valid[channel];
        let Some(values) = &self.scaled[variable] else { return vec![vec![0.0; valid.len()]; degree + 1] };
        let x: Vec<f64> = valid.iter().map(|&i| values[run][i]).collect();
        legendre(&x, degree)
    }
}
