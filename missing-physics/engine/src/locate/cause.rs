//! Where the cause acts: one unknown more, active within an interval of a variable and in some runs only. Which unknown, which variable,
//! which interval and which runs is settled by likelihood ratio, less Schwarz's price of each size that is fitted (Schwarz 1978,
//! doi:10.1214/aos/1176344136) and the logarithm of how many such hypotheses were scanned.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit::optimum::Fit;
use crate::locate::bins::{Along, Bins};
use crate::locate::intervals::{Best, Found, Scan};
use crate::locate::membership::{Members, Rows};
use crate::locate::projection::{Projection, dot};
use crate::locate::responses::{Asked, Column, Form, Responses};
use crate::locate::unknowns::{Unknown, are_events};
use crate::model::PredictError;
use crate::problem::Problem;

/// Each channel by itself, with a smooth departure or noise of its own, has to be worth so much more than a single cause; so have single rows,
/// each with an amount of its own.
pub(crate) const SIMPLER: f64 = 1.2;
/// Any subset of the runs fits a little better than all of them: one in which alone a cause acts takes away so much more.
const SUBSET_GAIN: f64 = 1.6;
/// What acts at a place or a speed acts there in every run: one that acts at it in some runs only has to be worth so much more than one that
/// acts at some time.
const PLACE_GAIN: f64 = 1.5;
/// The number of an impact says which rows these are and not why a cause acts there in every run: such a hypothesis has to be worth so much
/// more than one along a speed or a place ...
const COUNT: f64 = 10.0;
/// ... and a part of what it is worth, since a likelihood so sharp is not known better.
const COUNT_PART: f64 = 0.05;
/// What is worth less than the best by this much cannot be told from it (twice a log Bayes factor, "not worth more than a bare mention":
/// Kass and Raftery 1995, doi:10.1080/01621459.1995.10476572): unknowns and variables count in the order in which the model and the
/// recording have them.
const UNTOLD: f64 = 2.0;
/// Nor what acts in one run and is worth less by this part of the best: neither a baseline nor a push that is even or bent is known that well.
const UNTOLD_PART: f64 = 0.003;
/// Nor what is straight or bent within its interval and is worth less by this part of the best: what truly acts has a shape of its own, to
/// which another variable that grows with the first may come nearer.
const SHAPE_PART: f64 = 0.01;
/// What is worth less than this part of the best, with edges that are far apart, cannot be the best with finer ones.
const NEAR: f64 = 0.9;

/// An interval along a variable in which a cause acts.
pub(crate) struct Cause {
    pub(crate) unknown: usize,
    pub(crate) along: usize,
    pub(crate) bins: Bins,
    pub(crate) interval: (usize, usize),
    /// Whether it acts, by run.
    pub(crate) runs: Vec<bool>,
    /// The rows at which it acts, where those are not all that were measured within the interval.
    pub(crate) members: Option<Members>,
    /// Component, size, standard error.
    pub(crate) sizes: Vec<(usize, [f64; 2])>,
    /// By how much the sum of squares falls, less what was paid.
    pub(crate) worth: f64,
    /// What was paid.
    pub(crate) price: f64,
    /// Whether it acts alike at all rows of all runs: then it is no local one.
    pub(crate) everywhere: bool,
    /// By how much that of each channel falls.
    pub(crate) gains: Vec<f64>,
    /// By how much that of each run falls: it rises where the cause would act and does not.
    pub(crate) of_runs: Vec<f64>,
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
        let within = |unknown: &usize| !self.unknowns[*unknown].described.at_single_rows;
        let pairs: Vec<(usize, usize)> = (0..self.unknowns.len())
            .filter(within)
            .flat_map(|unknown| (0..self.variables.len()).map(move |along| (unknown, along)))
            .collect();
        let found: Vec<Best> = pairs
            .par_iter()
            .map(|&(unknown, along)| self.best_along(unknown, along))
            .collect::<Result<_, PredictError>>()?;
        let mut judged: Vec<(f64, usize, usize, Found)> = Vec::new();
        for kind in [|b: &Best| b.simple.clone(), |b: &Best| b.some_runs.clone()] {
            let beside = if judged.is_empty() { 1.0 } else { SUBSET_GAIN };
            let of_kind = || pairs.iter().zip(&found).filter_map(|(pair, best)| Some((*pair, kind(best)?)));
            let worth = |along: usize, found: &Found| self.weighed(along, found);
            let most = of_kind().map(|((_, along), f)| worth(along, &f)).fold(f64::NEG_INFINITY, f64::max);
            let enough = most - (1.0 - NEAR) * most.abs();
            let near: Vec<_> = of_kind().filter(|((_, along), f)| worth(*along, f) >= enough).collect();
            let finer = near.into_par_iter().map(|((unknown, along), found)| {
                let finer = self.finer(unknown, along, found)?;
                Ok((worth(along, &finer) / beside, unknown, along, finer))
            });
            judged.extend(finer.collect::<Result<Vec<_>, PredictError>>()?);
        }
        let Some(&(most, of, _, ref best)) = judged.iter().max_by(|a, b| a.0.total_cmp(&b.0)) else {
            return Ok(None);
        };
        let within = best.interval != (0, best.bins.len());
        let shape = if within { best.form } else { Form::Even };
        let untold = |unknown: usize, found: &Found| {
            let once = found.runs.iter().filter(|acts| **acts).count() == 1;
            let shaped = unknown == of && ![shape, found.form].contains(&Form::Even);
            let part = if shaped {
                SHAPE_PART
            } else if once {
                UNTOLD_PART
            } else {
                0.0
            };
            UNTOLD.max(part * most)
        };
        let first =
            judged.into_iter().find(|(worth, unknown, _, found)| *worth >= most - untold(*unknown, found));
        first.map(|(_, unknown, along, found)| self.cause(unknown, along, found)).transpose()
    }

    /// What a hypothesis is worth, less where it acts in an unlikely way.
    fn weighed(&self, along: usize, found: &Found) -> f64 {
        let worth = found.worth();
        if found.all_along() {
            return worth;
        }
        match found.runs.contains(&false) {
            true if along > 0 => worth / PLACE_GAIN,
            false if self.variables[along].counts() => worth - COUNT - COUNT_PART * worth.abs(),
            _ => worth,
        }
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

    /// The best hypotheses of an unknown along a variable.
    fn best_along(&self, unknown: usize, along: usize) -> Result<Best, PredictError> {
        let Some(bins) = Bins::new(self.problem, 0..self.problem.channels(), &self.variables[along]) else {
            return Ok(Best::default());
        };
        let components = 0..self.unknowns[unknown].described.components.len();
        let responses = components
            .map(|c| Responses::new(&self.asked(unknown, along, c, &bins), self.projection))
            .collect::<Result<Vec<_>, _>>()?;
        let scan = self.scan(unknown, &bins, &responses);
        let mut best = scan.best();
        for component in 0..responses.len() {
            let beside = self.with_errors((unknown, component), along, &scan)?;
            if let Some(found) = beside
                && best.simple.as_ref().is_none_or(|b| found.worth() > b.worth())
            {
                best.simple = Some(found);
            }
        }
        Ok(best)
    }

    /// The best hypothesis of a component along a variable that was measured with an error; `None` where it was not.
    fn with_errors(
        &self,
        (unknown, component): (usize, usize),
        along: usize,
        scan: &Scan<'_>,
    ) -> Result<Option<Found>, PredictError> {
        let (variable, of) = (&self.variables[along], &self.unknowns[unknown]);
        // The rows that are likeliest are judged whatever size they ask for.
        let alone = of.is_model_s() && of.runs_are_alone() && of.described.largest.is_infinite();
        if variable.error <= 0.0 || !alone || !are_events(self.problem) {
            return Ok(None);
        }
        let columns = of.at_each_row(self.problem, self.fit, self.sigma, component)?;
        let rows = Rows::new(self.projection, &columns, &variable.values, variable.error);
        Ok(scan.with_errors(component, &rows))
    }

    fn scan<'a>(&self, unknown: usize, bins: &'a Bins, responses: &'a [Responses]) -> Scan<'a> {
        Scan {
            bins,
            responses,
            runs: self.problem.rows.len(),
            alone: self.unknowns[unknown].runs_are_alone(),
            rows: self.projection.rows,
            whole: self.projection.residual.iter().map(|run| dot(run, run)).sum(),
            largest: self.unknowns[unknown].described.largest,
        }
    }

    /// The same hypothesis with edges that may be anywhere near those it has: each where it is as likely to be before as behind.
    fn finer(&self, unknown: usize, along: usize, found: Found) -> Result<Found, PredictError> {
        if found.members.is_some() || found.all_along() {
            return Ok(found);
        }
        let bins = found.bins.finer(self.problem, &self.variables[along], found.interval);
        let responses = (found.components.iter())
            .map(|&c| Responses::new(&self.asked(unknown, along, c, &bins), self.projection))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(self.scan(unknown, &bins, &responses).finer(found))
    }

    /// A hypothesis with its sizes, and what it is worth to each channel.
    fn cause(&self, unknown: usize, along: usize, found: Found) -> Result<Cause, PredictError> {
        let mut columns: Vec<(usize, Column)> = Vec::new();
        for &component in &found.components {
            let asked = self.asked(unknown, along, component, &found.bins);
            let beside = |Column { moved, mean }| Column { moved: self.projection.rest(moved), mean };
            let sizes = match &found.members {
                Some(members) => vec![asked.at_rows(&members.acts)?],
                None => asked.columns(found.interval, found.form, &found.runs)?,
            };
            columns.extend(sizes.into_iter().map(|column| (component, beside(column))));
        }
        let product = |a: &[Vec<f64>], b: &[Vec<f64>]| a.iter().zip(b).map(|(a, b)| dot(a, b)).sum::<f64>();
        let inverse = loop {
            let n = columns.len();
            let square = DMatrix::from_fn(n, n, |i, j| product(&columns[i].1.moved, &columns[j].1.moved));
            match square.cholesky() {
                Some(factor) => break factor.inverse(),
                // What the others say already.
                None => drop(columns.pop()),
            }
        };
        let residual = &self.projection.residual;
        let products =
            DVector::from_iterator(columns.len(), columns.iter().map(|c| product(&c.1.moved, residual)));
        let fitted = &inverse * products;
        let mut after = residual.clone();
        for ((_, column), size) in columns.iter().zip(fitted.iter()) {
            let rows = after.iter_mut().flatten().zip(column.moved.iter().flatten());
            rows.for_each(|(left, c)| *left -= size * c);
        }
        let sizes = (found.components.iter())
            .map(|&component| {
                let of_it = columns.iter().map(|(of, c)| if *of == component { c.mean } else { 0.0 });
                let means = DVector::from_iterator(columns.len(), of_it);
                (component, [means.dot(&fitted), means.dot(&(&inverse * &means)).sqrt()])
            })
            .collect();
        let gains = gains(self.problem, &self.projection.residual, &after);
        let square = |run: &Vec<f64>| dot(run, run);
        let of_runs =
            residual.iter().zip(&after).map(|(before, after)| square(before) - square(after)).collect();
        let worth = found.worth();
        let everywhere = found.all_along() && !found.runs.contains(&false);
        let Found { bins, interval, runs, price, members, .. } = found;
        Ok(Cause {
            unknown,
            along,
            bins,
            interval,
            runs,
            members,
            sizes,
            worth,
            price,
            everywhere,
            gains,
            of_runs,
        })
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
