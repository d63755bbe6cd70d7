//! What may act at some rows only: the unknowns that a model tells the effect of, and an offset of each reading.

use crate::fit::optimum::Fit;
use crate::model::{LocalCauses, LocalUnknown, PredictError};
use crate::problem::Problem;

/// Runs of more rows than this have no rows of which each is an event.
const EVENTS: usize = 40;
/// All runs of more rows than this together have none either.
const ROWS: usize = 6000;

/// An unknown, and how to ask for its effect.
pub(crate) struct Unknown<'a> {
    pub(crate) described: LocalUnknown,
    /// The model's number of it; an offset of the readings where there is none.
    model: Option<(&'a dyn LocalCauses, usize)>,
}

/// Whether rows are events: few in each run, and not too many in all.
pub(crate) fn are_events(problem: &Problem<'_>) -> bool {
    let lengths = || problem.recording.runs.iter().map(|run| run.len());
    lengths().max().unwrap_or(0) <= EVENTS && lengths().sum::<usize>() <= ROWS
}

/// The model's unknowns, and an offset of the readings.
pub(crate) fn unknowns<'a>(problem: &Problem<'a>) -> Vec<Unknown<'a>> {
    let of_model = problem.model.extensions().local_causes.into_iter().flat_map(|causes| {
        let described = causes.unknowns().into_iter().enumerate();
        described.map(move |(k, described)| Unknown { described, model: Some((causes, k)) })
    });
    let offset = LocalUnknown::new("an offset", problem.recording.channels.clone());
    of_model.chain([Unknown { described: offset, model: None }]).collect()
}

impl Unknown<'_> {
    /// Whether the model tells its effect.
    pub(crate) fn is_model_s(&self) -> bool {
        self.model.is_some()
    }

    /// Whether what acts in a run shows in that run alone.
    pub(crate) fn runs_are_alone(&self) -> bool {
        self.model.is_none_or(|(causes, _)| causes.runs_are_alone())
    }

    /// What a component of the given size at each row does to the measured rows, by run, channel after channel, in sigmas.
    pub(crate) fn response(
        &self,
        problem: &Problem<'_>,
        fit: &Fit,
        sigma: &[f64],
        component: usize,
        amounts: Vec<Vec<f64>>,
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        let mut all = self.responses(problem, fit, sigma, component, &[amounts])?;
        Ok(all.pop().unwrap_or_default())
    }

    /// [`Self::response`] to several choices of sizes, `[choice][run][row]`.
    pub(crate) fn responses(
        &self,
        problem: &Problem<'_>,
        fit: &Fit,
        sigma: &[f64],
        component: usize,
        amounts: &[Vec<Vec<f64>>],
    ) -> Result<Vec<Vec<Vec<f64>>>, PredictError> {
        let runs = &problem.recording.runs;
        let moved = match self.model {
            Some((causes, unknown)) => {
                causes.responses((unknown, component), runs, &fit.shared, &fit.nuisance, amounts)?
            }
            None => {
                let of_run = |amounts: &Vec<f64>| {
                    let n = amounts.len();
                    let mut moved = vec![0.0; problem.channels() * n];
                    moved[component * n..(component + 1) * n].copy_from_slice(amounts);
                    moved
                };
                amounts.iter().map(|amounts| amounts.iter().map(of_run).collect()).collect()
            }
        };
        let white = |(run, moved): (usize, &Vec<f64>)| -> Vec<f64> {
            let channel = |channel: usize| {
                let picked = problem.pick(run, channel, moved);
                picked.into_iter().map(move |v| v / sigma[channel])
            };
            (0..problem.channels()).flat_map(channel).collect()
        };
        Ok(moved.iter().map(|moved| moved.iter().enumerate().map(white).collect()).collect())
    }

    /// What a unit of a component at each single row does to its run, `[run][row]`.
    pub(crate) fn at_each_row(
        &self,
        problem: &Problem<'_>,
        fit: &Fit,
        sigma: &[f64],
        component: usize,
    ) -> Result<Vec<Vec<Vec<f64>>>, PredictError> {
        let runs = &problem.recording.runs;
        let longest = runs.iter().map(|run| run.len()).max().unwrap_or(0);
        let mut columns = vec![Vec::new(); runs.len()];
        for row in 0..longest {
            let only = |n: usize| (0..n).map(|i| f64::from(u8::from(i == row))).collect();
            let amounts: Vec<Vec<f64>> = runs.iter().map(|run| only(run.len())).collect();
            let moved = self.response(problem, fit, sigma, component, amounts)?;
            for ((all, moved), run) in columns.iter_mut().zip(moved).zip(runs) {
                if row < run.len() {
                    all.push(moved);
                }
            }
        }
        Ok(columns)
    }
}
