//! Where the cause acts: one unknown more, active within an interval of a variable and in some runs only. Which unknown, which variable,
//! which interval and which runs is settled by likelihood ratio, less Schwarz's price of each size that is fitted (Schwarz 1978,
//! doi:10.1214/aos/1176344136) and the logarithm of how many such hypotheses were scanned.

use rayon::prelude::*;

use crate::fit::optimum::Fit;
use crate::locate::bins::{Along, Bins};
use crate::locate::projection::{Projection, dot};
use crate::locate::responses::{Asked, Effect, Form, Responses};
use crate::locate::unknowns::Unknown;
use crate::model::PredictError;
use crate::problem::Problem;

/// So many groups of neighbouring runs are told apart.
const GROUPS: usize = 40;
/// By how much a change that goes on to the last run is worth more than what is over before.
const STAYS: f64 = 1.0;
/// A subset of the runs is sought among so many at most.
const SUBSETS: usize = 64;

/// Any subset of the runs fits a little better than all of them: one in which alone a cause acts takes away so much more.
const SUBSET_GAIN: f64 = 1.6;
/// An offset of the readings has to be worth so much more than an unknown of which the model tells what it does.
const OFFSET_GAIN: f64 = 1.1;

/// An interval along a variable in which a cause acts.
pub(crate) struct Cause {
    pub(crate) unknown: usize,
    pub(crate) along: usize,
    pub(crate) bins: Bins,
    pub(crate) interval: (usize, usize),
    /// Whether it acts, by run.
    pub(crate) runs: Vec<bool>,
    /// Component, size, standard error.
    pub(crate) sizes: Vec<(usize, [f64; 2])>,
    /// By how much the sum of squares falls, less what was paid.
    pub(crate) worth: f64,
    /// By how much that of each channel falls.
    pub(crate) gains: Vec<f64>,
}

/// A hypothesis along one variable.
#[derive(Clone)]
struct Found {
    interval: (usize, usize),
    form: Form,
    runs: Vec<bool>,
    components: Vec<usize>,
    worth: f64,
}

/// The best hypotheses along one variable: in all runs or neighbouring ones, and in a subset of them.
#[derive(Clone, Default)]
struct Best {
    simple: Option<Found>,
    some_runs: Option<Found>,
}

/// What is scanned.
pub(crate) struct Scene<'a> {
    pub(crate) problem: &'a Problem<'a>,
    pub(crate) fit: &'a Fit,
    pub(crate) sigma: &'a [f64],
    pub(crate) projection: &'a Projection,
    pub(crate) variables: &'a [Along],
    pub(crate) unknowns: &'a [Unknown<'a>],
}

impl Scene<'_> {
    /// The hypothesis that is worth most; `None` where none can be had.
    pub(crate) fn best(&self) -> Result<Option<Cause>, PredictError> {
        let pairs: Vec<(usize, usize)> = (0..self.unknowns.len())
            .flat_map(|unknown| (0..self.variables.len()).map(move |along| (unknown, along)))
            .collect();
        let found: Vec<Option<(Bins, Best)>> = pairs
            .par_iter()
            .map(|&(unknown, along)| self.best_along(unknown, along))
            .collect::<Result<_, PredictError>>()?;
        let mut best: Option<(f64, usize, usize, Bins, Found)> = None;
        for kind in [|b: &Best| b.simple.clone(), |b: &Best| b.some_runs.clone()] {
            let before = best.as_ref().map(|b| b.0);
            for (&(unknown, along), (bins, here)) in
                pairs.iter().zip(&found).filter_map(|(pair, found)| Some((pair, found.as_ref()?)))
            {
                let Some(here) = kind(here) else { continue };
                let told = if self.unknowns[unknown].is_model_s() { 1.0 } else { OFFSET_GAIN };
                let beside = before.map_or(1.0, |_| SUBSET_GAIN);
                let worth = here.worth / told / beside;
                if best.as_ref().is_none_or(|b| worth > b.0 + 1e-9) {
                    best = Some((worth, unknown, along, bins.clone(), here));
                }
            }
        }
        best.map(|(_, unknown, along, bins, found)| self.cause(unknown, along, bins, found)).transpose()
    }

    fn asked<'a>(&'a self, unknown: usize, along: usize, component: usize, bins: &'a Bins) -> Asked<'a> {
        Asked {
            problem: self.problem,
            fit: self.fit,
            sigma: self.sigma,
            unknown: &self.unknowns[unknown],
            component,
            along: &self.variables[along],
            bins,
        }
    }

    /// The best hypothesis of an unknown along a variable.
    fn best_along(&self, unknown: usize, along: usize) -> Result<Option<(Bins, Best)>, PredictError> {
        let Some(bins) = Bins::new(self.problem, 0..self.problem.channels(), &self.variables[along]) else {
            return Ok(None);
        };
        let components = self.unknowns[unknown].told.components.len();
        let responses = (0..components)
            .map(|c| Responses::new(&self.asked(unknown, along, c, &bins), self.projection))
            .collect::<Result<Vec<_>, _>>()?;
        let scan = Scan {
            bins: &bins,
            responses: &responses,
            runs: self.problem.rows.len(),
            alone: self.unknowns[unknown].runs_are_alone(),
            rows: self.projection.rows,
        };
        let best = scan.best();
        Ok(Some((bins, best)))
    }

    /// A hypothesis with its sizes, and what it is worth to each channel.
    fn cause(&self, unknown: usize, along: usize, bins: Bins, found: Found) -> Result<Cause, PredictError> {
        let mut after = self.projection.residual.clone();
        let mut sizes = Vec::new();
        for &component in &found.components {
            let asked = self.asked(unknown, along, component, &bins);
            let (column, mean) = asked.column(found.interval, found.form, &found.runs)?;
            let column = self.projection.rest(column);
            let square: f64 = column.iter().map(|run| dot(run, run)).sum();
            let product: f64 = column.iter().zip(&after).map(|(c, r)| dot(c, r)).sum();
            if square > 0.0 {
                let size = product / square;
                let moved = after.iter_mut().zip(&column);
                moved.for_each(|(a, c)| a.iter_mut().zip(c).for_each(|(a, c)| *a -= size * c));
                sizes.push((component, [mean * size, mean.abs() / square.sqrt()]));
            }
        }
        let gains = gains(self.problem, &self.projection.residual, &after);
        let Found { interval, runs, worth, .. } = found;
        Ok(Cause { unknown, along, bins, interval, runs, sizes, worth, gains })
    }
}

/// By how much the sum of squares of each channel falls.
pub(crate) fn gains(problem: &Problem<'_>, before: &[Vec<f64>], after: &[Vec<f64>]) -> Vec<f64> {
    let mut gains = vec![0.0; problem.channels()];
    for ((rows, before), after) in problem.rows.iter().zip(before).zip(after) {
        let channels = rows.valid.iter().enumerate().flat_map(|(c, valid)| valid.iter().map(move |_| c));
        channels.zip(before.iter().zip(after)).for_each(|(c, (b, a))| gains[c] += b * b - a * a);
    }
    gains
}

/// The intervals along one variable, for all components of an unknown.
struct Scan<'a> {
    bins: &'a Bins,
    responses: &'a [Responses],
    runs: usize,
    /// Whether what acts in a run shows in that run alone.
    alone: bool,
    rows: f64,
}

impl Scan<'_> {
    fn best(&self) -> Best {
        let mut best = Best::default();
        let n = self.bins.len();
        let intervals = (n * (n + 1) / 2) as f64;
        for interval in (0..n).flat_map(|from| (from + 1..=n).map(move |to| (from, to))) {
            for form in Form::ALL {
                let effects: Vec<Vec<Effect>> =
                    self.responses.iter().map(|r| r.by_run(self.bins, interval, form)).collect();
                let whole = interval == (0, n) && form == Form::Even;
                let scanned = if whole { 0.0 } else { 2.0 * (3.0 * intervals).ln() };
                self.all_runs(&effects, interval, form, scanned, &mut best.simple);
                if self.alone && self.runs > 1 && form == Form::Even {
                    self.neighbouring_runs(&effects, interval, scanned, &mut best.simple);
                    self.some_runs(&effects, interval, scanned, &mut best.some_runs);
                }
            }
        }
        best
    }

    /// The best of each component alone and of all together, in some runs.
    fn judge(
        &self,
        effects: &[Effect],
        (interval, form): ((usize, usize), Form),
        scanned: f64,
        best: &mut Option<Found>,
        runs: impl Fn() -> Vec<bool>,
    ) {
        let price = self.rows.ln();
        let gains: Vec<f64> = effects.iter().map(Effect::gain).collect();
        let mut better = |worth: f64, components: Vec<usize>| {
            if worth.is_finite() && best.as_ref().is_none_or(|b| worth > b.worth) {
                *best = Some(Found { interval, form, runs: runs(), components, worth });
            }
        };
        gains.iter().enumerate().for_each(|(c, gain)| better(gain - price - scanned, vec![c]));
        if gains.len() > 1 {
            let together = gains.iter().sum::<f64>() - gains.len() as f64 * price - scanned;
            better(together, (0..gains.len()).collect());
        }
    }

    fn all_runs(
        &self,
        effects: &[Vec<Effect>],
        interval: (usize, usize),
        form: Form,
        scanned: f64,
        best: &mut Option<Found>,
    ) {
        let sum = |runs: &Vec<Effect>| {
            runs.iter().fold(Effect::default(), |mut sum, run| {
                sum.add(run, 1.0);
                sum
            })
        };
        let sums: Vec<Effect> = effects.iter().map(sum).collect();
        self.judge(&sums, (interval, form), scanned, best, || vec![true; self.runs]);
    }

    /// From one run to another one, in their order.
    fn neighbouring_runs(
        &self,
        effects: &[Vec<Effect>],
        interval: (usize, usize),
        scanned: f64,
        best: &mut Option<Found>,
    ) {
        let groups = self.runs.min(GROUPS);
        let begin = |group: usize| group * self.runs / groups;
        let scanned = scanned + 2.0 * ((groups * (groups + 1) / 2) as f64).ln();
        for from in 0..groups {
            let mut sums = vec![Effect::default(); effects.len()];
            for to in from + 1..=groups {
                for (sum, effects) in sums.iter_mut().zip(effects) {
                    effects[begin(to - 1)..begin(to)].iter().for_each(|e| sum.add(e, 1.0));
                }
                if (from, to) != (0, groups) {
                    // A change that goes on has another side that fits as well, the runs before it.
                    let scanned = if to == groups { scanned - STAYS } else { scanned };
                    let runs = || (0..self.runs).map(|r| r >= begin(from) && r < begin(to)).collect();
                    self.judge(&sums, (interval, Form::Even), scanned, best, runs);
                }
            }
        }
    }

    /// Those runs in which a component alone has the larger size.
    fn some_runs(
        &self,
        effects: &[Vec<Effect>],
        interval: (usize, usize),
        scanned: f64,
        best: &mut Option<Found>,
    ) {
        if self.runs > SUBSETS || self.runs < 3 {
            return;
        }
        for (component, effects) in effects.iter().enumerate() {
            let mut order: Vec<usize> =
                (0..self.runs).filter(|&r| effects[r].size()[0].is_finite()).collect();
            order.sort_by(|&a, &b| effects[b].size()[0].total_cmp(&effects[a].size()[0]));
            for reversed in [false, true] {
                if reversed {
                    order.reverse();
                }
                let mut sum = Effect::default();
                let mut ways = 0.0;
                for (k, &run) in order.iter().enumerate().take(self.runs / 2) {
                    sum.add(&effects[run], 1.0);
                    // The number of ways to choose so many of the runs, and that number itself.
                    ways += (((self.runs - k) as f64) / (k + 1) as f64).ln();
                    let price = self.rows.ln() + scanned + 2.0 * (ways + (self.runs as f64).ln());
                    let worth = sum.gain() - price;
                    if best.as_ref().is_none_or(|b| worth > b.worth) {
                        let mut runs = vec![false; self.runs];
                        order[..=k].iter().for_each(|&r| runs[r] = true);
                        let (form, components) = (Form::Even, vec![component]);
                        *best = Some(Found { interval, form, runs, components, worth });
                    }
                }
            }
        }
    }
}
