//! Intervals by profile likelihood.

use crate::estimate::reach::{END, Z95};
use crate::fit::gauss_newton::{End, linearise, solve, solve_until, sum_of_squares};
use crate::fit::optimum::{Fit, covariance};
use crate::fit::step::{NormalEquations, Step};
use crate::problem::{Problem, Selection};
use crate::selection::candidate::Candidate;

/// How far about an estimate the profile of the likelihood is looked at, in standard errors: dry friction and jumps leave many tops.
const LOOK: [f64; 6] = [0.75, 1.5, 3.0, 6.0, 12.0, 24.0];
/// A top is a better one where the sum of squares is lower by this.
const BETTER: f64 = 0.05;
/// The same of a model that knows many mechanisms: less moves neither a choice nor an interval, and dry friction leaves many such tops.
const BETTER_OF_MANY: f64 = 0.5;

/// A sum of squares rises as the linearised model foresees where it does so to this part.
const AS_FORESEEN: f64 = 0.1;

/// A stair of the likelihood is looked at until this many treads in a row have a sum of squares that is higher by so much.
const UNLIKELY: f64 = 30.0;
const UNLIKELY_TREADS: usize = 3;

/// The likelihood of one free shared parameter, all others fitted at each of its values.
pub(crate) struct Profile<'a> {
    problem: &'a Problem<'a>,
    fit: &'a Fit,
    /// What is free with it, and beside it.
    all: &'a Selection,
    others: Selection,
    slot: usize,
    /// Where it stands among those that are free, and what the model is at the fit to first order, if that is of use.
    number: usize,
    linear: Option<&'a NormalEquations>,
}

/// The model at a candidate's fit to first order, where it knows so many mechanisms that profiles go by what that foresees.
pub(crate) fn at_fit(problem: &Problem<'_>, candidate: &Candidate) -> Option<NormalEquations> {
    let Candidate { selection, fit, .. } = candidate;
    let linear = || linearise(problem, selection, &fit.noise, &fit.shared, &fit.nuisance).ok();
    problem.knows_many().then(linear).flatten()
}

impl<'a> Profile<'a> {
    /// The profile of the `i`-th free shared parameter of a candidate, and the model [`at_fit`].
    pub(crate) fn new(
        problem: &'a Problem<'a>,
        candidate: &'a Candidate,
        linear: Option<&'a NormalEquations>,
        i: usize,
    ) -> Self {
        let mut others = candidate.selection.clone();
        let slot = others.shared.remove(i);
        others.added_shared.remove(i);
        Self { problem, fit: &candidate.fit, all: &candidate.selection, others, slot, number: i, linear }
    }

    /// The shared parameters with this one at a value, the others at the fit.
    fn moved(&self, value: f64) -> Vec<f64> {
        let mut shared = self.fit.shared.clone();
        shared[self.slot] = value;
        shared
    }

    /// Where all others go when the parameter is moved to a value, and by how much the sum of squares rises, as the linearised model
    /// foresees.
    fn foresee(&self, value: f64) -> Option<(Step, f64)> {
        let linear = self.linear?;
        let column = self.all.nuisance.len() + self.number;
        let moved = linear.moved(column, value - self.fit.shared[self.slot]);
        let shared = self.moved(value);
        let step = Step::new(self.problem, &self.others, &moved, (&shared, &self.fit.nuisance), 0.0);
        let rise = moved.chi2 - step.predicted - linear.chi2;
        Some((step, rise))
    }

    /// Whether the sum of squares rises as foreseen where that leads.
    fn rises_so(&self, step: &Step, rise: f64) -> bool {
        let (noise, at) = (&self.fit.noise, (&step.shared[..], &step.nuisance[..]));
        let there = sum_of_squares(self.problem, &self.others, noise, at.0, at.1);
        there.is_ok_and(|there| self.is_as_foreseen(there, rise))
    }

    /// Whether a sum of squares is as high as foreseen.
    fn is_as_foreseen(&self, there: f64, rise: f64) -> bool {
        self.linear.is_some_and(|linear| (there - linear.chi2 - rise).abs() <= AS_FORESEEN * rise)
    }

    /// The fit of the others at a value.
    fn at(&self, value: f64) -> Option<Fit> {
        let (shared, nuisance) = match self.foresee(value) {
            Some((step, rise)) if self.rises_so(&step, rise) => (step.shared, step.nuisance),
            _ => (self.moved(value), self.fit.nuisance.clone()),
        };
        solve(self.problem, &self.others, &self.fit.noise, &shared, &nuisance).ok()
    }

    /// By how much a standard error is wider than that of the fit's own noise.
    fn wider(&self, error: f64) -> f64 {
        let there = solve(self.problem, self.all, &self.fit.noise, &self.fit.shared, &self.fit.nuisance);
        let variance = |fit: Fit| covariance(&fit.information)[(self.number, self.number)];
        let fitted = there.map_or(f64::NAN, |fit| variance(fit).sqrt());
        if fitted > 0.0 && fitted.is_finite() { error / fitted } else { 1.0 }
    }

    /// By how much the sum of squares is higher at a value than at the estimate.
    fn rise(&self, value: f64) -> Option<f64> {
        self.at(value).map(|f| f.chi2 - self.fit.chi2)
    }

    /// The top of the likelihood to which a fit climbs from a value, the parameter being free again; none where the sum of squares
    /// at the value is `most` or more, or as high as the linearised model foresees: from there the way leads back.
    fn top_from(&self, value: f64, most: f64) -> Option<Fit> {
        let foreseen = self.foresee(value);
        if foreseen.as_ref().is_some_and(|(step, rise)| self.rises_so(step, *rise)) {
            return None;
        }
        let start = (&self.moved(value)[..], &self.fit.nuisance[..]);
        let end = End::of(self.problem).below(most);
        let near = solve_until(end, self.problem, &self.others, &self.fit.noise, start).ok();
        let near = near.filter(|f| f.chi2 < most)?;
        if foreseen.is_some_and(|(_, rise)| self.is_as_foreseen(near.chi2, rise)) {
            return None;
        }
        solve(self.problem, self.all, &near.noise, &near.shared, &near.nuisance).ok()
    }

    fn bound(&self, side: f64) -> f64 {
        let table = &self.problem.shared;
        if side < 0.0 { table.lower[self.slot] } else { table.upper[self.slot] }
    }

    /// Values about the estimate on one side, within its bounds, from near to far.
    fn looks(&self, side: f64, error: f64) -> impl Iterator<Item = f64> + use<'_> {
        let bound = self.bound(side);
        let values = LOOK.map(|k| self.fit.shared[self.slot] + side * k * error);
        values.into_iter().filter(move |value| (value - bound) * side < 0.0)
    }

    /// The 95 % interval of a parameter at whose values predictions jump: the likelihood is a stair, whose treads weigh what they are wide
    /// (a posterior of an even prior). `None` where nothing jumps.
    pub(crate) fn between(&self, jumps: &[f64]) -> Option<[f64; 2]> {
        let [lowest, highest] = [jumps.first()?, jumps.last()?].map(|end| *end);
        let ends = [self.bound(-1.0).min(lowest), self.bound(1.0).max(highest)];
        let edges: Vec<f64> = ends[..1].iter().chain(jumps).chain(&ends[1..]).copied().collect();
        let treads: Vec<[f64; 2]> = edges.windows(2).map(|w| [w[0], w[1]]).filter(|t| t[1] > t[0]).collect();
        let here = treads.iter().position(|t| self.fit.shared[self.slot] <= t[1])?;
        let mut rises = vec![f64::INFINITY; treads.len()];
        let (down, up): (Vec<usize>, Vec<usize>) =
            ((0..here).rev().collect(), (here..treads.len()).collect());
        for side in [up, down] {
            let mut unlikely = 0;
            for at in side {
                rises[at] = self.rise(0.5 * (treads[at][0] + treads[at][1])).unwrap_or(f64::INFINITY);
                unlikely = if rises[at] > UNLIKELY { unlikely + 1 } else { 0 };
                if unlikely == UNLIKELY_TREADS {
                    break;
                }
            }
        }
        let least = rises.iter().copied().fold(f64::INFINITY, f64::min);
        let masses: Vec<f64> = treads
            .iter()
            .zip(&rises)
            .map(|(t, rise)| (t[1] - t[0]) * (-0.5 * (rise - least)).exp())
            .collect();
        let all: f64 = masses.iter().sum();
        let holding = |part: f64| {
            let mut below = 0.0;
            let mut sums = masses.iter().map(|mass| {
                below += mass;
                below
            });
            sums.position(|sum| sum >= part * all)
        };
        // Within a tread all values are alike: whole treads.
        Some([treads[holding(1.0 - END)?][0], treads[holding(END)?][1]])
    }

    /// The 95 % interval, where the quadratic one of this half width, so many standard errors, misleads.
    pub(crate) fn interval(&self, half: f64, reach: f64) -> [f64; 2] {
        let most = (reach * self.wider(half / reach)).powi(2);
        let end = |side: f64| {
            let near = self.end(side, half, most);
            let far = self.end_beyond(side, half, half / reach, most);
            far.filter(|far| (far - near) * side > 0.0).unwrap_or(near)
        };
        rayon::join(|| end(-1.0), || end(1.0)).into()
    }

    /// Where the sum of squares has risen by `most` on one side; the search begins at the distance `half`.
    fn end(&self, side: f64, half: f64, most: f64) -> f64 {
        let bound = self.bound(side);
        let mut end = self.fit.shared[self.slot] + side * half;
        let mut distance = half;
        for _ in 0..8 {
            let value = self.fit.shared[self.slot] + side * distance;
            if !(value - bound).is_finite() && bound.is_finite() || (value - bound) * side >= 0.0 {
                return bound;
            }
            let Some(risen) = self.rise(value).filter(|r| *r > 0.0) else { break };
            end = value;
            if (risen - most).abs() < 0.05 * most {
                break;
            }
            // Along a profile that is nearly a parabola the distance goes with the square root of the rise.
            distance *= (most / risen).sqrt().clamp(0.5, 2.0);
        }
        end
    }

    /// The end of the interval about other tops beyond the first fall, if one is as likely as the interval's own end.
    fn end_beyond(&self, side: f64, half: f64, error: f64, most: f64) -> Option<f64> {
        let (bound, quadratic) = (self.bound(side), self.fit.shared[self.slot] + side * half);
        // A top within reach of values that are as unlikely as that would be a needle.
        let most_there = if self.linear.is_some() { self.fit.chi2 + UNLIKELY } else { f64::INFINITY };
        let end = |value: f64| {
            let top = self.top_from(value, most_there)?;
            let (at, risen) = (top.shared[self.slot], top.chi2 - self.fit.chi2);
            let reach = at + side * half * (1.0 - risen / most).min(1.0).sqrt();
            (risen < most).then_some(if (reach - bound) * side < 0.0 { reach } else { bound })
        };
        let ends = self.looks(side, error).filter(|value| (value - quadratic) * side > 0.0).filter_map(end);
        ends.reduce(|far, end| if (end - far) * side > 0.0 { end } else { far })
    }
}

/// A better top of the likelihood than a candidate's own, if there is one where its mechanisms' parameters are a few standard errors
/// to many away.
pub(crate) fn better_top(problem: &Problem<'_>, candidate: &Candidate) -> Option<Fit> {
    let selection = &candidate.selection;
    let covariance = covariance(&candidate.fit.information);
    let linear = at_fit(problem, candidate);
    let better = if linear.is_some() { BETTER_OF_MANY } else { BETTER };
    let mut best: Option<Fit> = None;
    for i in (0..selection.shared.len()).filter(|&i| selection.added_shared[i]) {
        let error = covariance[(i, i)].max(0.0).sqrt();
        if !(error > 0.0 && error.is_finite()) {
            continue;
        }
        let profile = Profile::new(problem, candidate, linear.as_ref(), i);
        for value in [-1.0, 1.0].into_iter().flat_map(|side| profile.looks(side, error)) {
            let least = best.as_ref().map_or(candidate.fit.chi2, |b| b.chi2) - better;
            if let Some(top) = profile.top_from(value, least + Z95 * Z95).filter(|f| f.chi2 < least) {
                best = Some(top);
            }
        }
    }
    best
}
