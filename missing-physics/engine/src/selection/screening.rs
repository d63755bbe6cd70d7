//! Which mechanisms are worth a fit beside others, by what the first steps of a fit gain: for models that know so many that fitting each
//! in every company would take too long.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::fit::gauss_newton::{End, descend, linearise};
use crate::fit::step::{NormalEquations, Step};
use crate::model::Scope;
use crate::noise::rule::NoiseState;
use crate::problem::{Problem, Selection};
use crate::selection::candidate::{Candidate, Guess};

/// Mechanisms that are fitted beside one set.
const KEPT: usize = 6;
/// Mechanisms that are followed some steps on, of those whose first step promises most: one step may promise what no fit keeps.
const FOLLOWED: usize = 14;
/// Starts of one mechanism that are followed, and looked at again where more than those were, that differ in its shape: of that a step promises
/// least reliably, the more so where a larger cause is missing.
const SHAPES: usize = 3;
/// So many steps.
const STEPS: usize = 4;
/// Mechanisms that are followed for longer, of those that fall short of what one step promises.
const LATE: usize = 3;
/// So many steps.
const STEPS_AGAIN: usize = 10;
/// Starts of a mechanism that are looked at again beside others: those that promised most beside nothing.
const STARTS: usize = 2;

/// A mechanism worth a fit, and where its fit begins.
pub(crate) struct Promising {
    pub(crate) mechanism: usize,
    pub(crate) start: Guess,
}

/// What one step from a start of a mechanism leaves, the mechanism by its number among those that are looked at, and the start by its number.
type Scored = (f64, usize, usize);

/// Mechanisms, each with the starts that are looked at.
pub(crate) struct Screening {
    looked_at: Vec<(usize, Vec<Guess>)>,
    /// The starts that each had beside the first set, once that was asked for.
    first: Option<Vec<Vec<Guess>>>,
}

impl Screening {
    /// Mechanisms, none of which has been looked at.
    pub(crate) fn new(mechanisms: &[usize]) -> Self {
        Self { looked_at: mechanisms.iter().map(|m| (*m, Vec::new())).collect(), first: None }
    }

    /// Takes in where mechanisms begin beside a set: those without any start near their off values, the first time; after that what begins
    /// elsewhere than beside the first set.
    fn begin(&mut self, parent: &Candidate, anew: impl Fn(usize) -> Vec<Guess>) {
        let Some(first) = &self.first else {
            let near_off = |starts: Vec<Guess>| if starts.is_empty() { vec![Guess::new()] } else { starts };
            self.looked_at.iter_mut().for_each(|(m, starts)| *starts = near_off(anew(*m)));
            self.first = Some(self.looked_at.iter().map(|(_, starts)| starts.clone()).collect());
            return;
        };
        for ((mechanism, starts), first) in self.looked_at.iter_mut().zip(first) {
            if !parent.set.contains(mechanism) {
                starts.extend(anew(*mechanism).into_iter().filter(|start| !first.contains(start)));
            }
        }
    }

    /// The mechanisms whose first steps beside a fitted set gain most, most gaining first; forgets starts that promise least. `anew` is where
    /// a mechanism begins by what that set leaves.
    pub(crate) fn promising(
        &mut self,
        problem: &Problem<'_>,
        parent: &Candidate,
        anew: impl Fn(usize) -> Vec<Guess>,
    ) -> Vec<Promising> {
        self.begin(parent, anew);
        let tried: Vec<(usize, usize)> = (0..self.looked_at.len())
            .filter(|&k| problem.may_join(&parent.set, self.looked_at[k].0))
            .flat_map(|k| (0..self.looked_at[k].1.len()).map(move |start| (k, start)))
            .collect();
        let mut scored: Vec<Scored> = Vec::new();
        let mut linearised: HashMap<(usize, usize), NormalEquations> = HashMap::new();
        let first_steps = tried.into_par_iter().map(|(k, start)| {
            let (mechanism, starts) = &self.looked_at[k];
            let (selection, shared) = with_one_more(problem, parent, *mechanism, &starts[start]);
            let at = (&shared[..], &parent.fit.nuisance[..]);
            (after_one_step(problem, &selection, &parent.fit.noise, at), k, start)
        });
        for (step, k, start) in first_steps.collect::<Vec<_>>() {
            scored.push((step.as_ref().map_or(f64::INFINITY, |(left, _)| *left), k, start));
            linearised.extend(step.map(|(_, linear)| ((k, start), linear)));
        }
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut first: Vec<(usize, usize)> = Vec::new();
        let mut mechanisms = 0;
        for &(_, k, start) in scored.iter().filter(|(left, ..)| left.is_finite()) {
            let shape = |start: usize| self.shape(problem, k, start);
            let others = || first.iter().filter(|(other, _)| *other == k);
            if others().next().is_none() {
                if mechanisms < FOLLOWED {
                    first.push((k, start));
                    mechanisms += 1;
                }
            } else if others().count() < SHAPES && others().all(|(_, other)| shape(*other) != shape(start)) {
                first.push((k, start));
            }
        }
        let known: Vec<_> = first.iter().filter_map(|at| Some((*at, linearised.remove(at)?))).collect();
        let followed = known.into_par_iter().filter_map(|((k, start), linear)| {
            let at = (self.looked_at[k].0, &self.looked_at[k].1[start][..]);
            follow(End::after(STEPS), problem, parent, at, linear)
        });
        let followed = best_of_each(followed.collect(), parent);
        let again = self.again(problem, parent, &scored, &first, &followed);
        self.forget(problem, &scored);
        let mut best = best_of_each(followed.into_iter().chain(again).collect(), parent);
        best.truncate(KEPT);
        best.into_iter().map(|(_, promising)| promising).collect()
    }

    /// Mechanisms of which one step promises more than the last of those that are kept has reached, but which have not reached that themselves:
    /// followed for longer, and from the start that promises most of those that were not followed.
    fn again(
        &self,
        problem: &Problem<'_>,
        parent: &Candidate,
        scored: &[Scored],
        first: &[(usize, usize)],
        followed: &[(f64, Promising)],
    ) -> Vec<(f64, Promising)> {
        let least = followed.get(KEPT - 1).map_or(parent.fit.chi2 - 1.0, |(left, _)| *left);
        let reached = |k: usize| followed.iter().find(|(_, p)| p.mechanism == self.looked_at[k].0);
        let mut late: Vec<usize> = Vec::new();
        for &(_, k, _) in scored.iter().filter(|(left, ..)| *left < least) {
            if !late.contains(&k) && late.len() < LATE && reached(k).is_none_or(|(left, _)| *left > least) {
                late.push(k);
            }
        }
        let starts = |k: usize| {
            let other = scored.iter().find(|(_, of, start)| *of == k && !first.contains(&(k, *start)));
            let other = other.map(|(_, _, start)| self.looked_at[k].1[*start].clone());
            let on = reached(k).map(|(_, promising)| promising.start.clone());
            other.into_iter().chain(on).map(move |start| (self.looked_at[k].0, start))
        };
        let starts: Vec<(usize, Guess)> = late.into_iter().flat_map(starts).collect();
        let follow = |(mechanism, start): (usize, Guess)| {
            let (selection, shared) = with_one_more(problem, parent, mechanism, &start);
            let at = (&shared[..], &parent.fit.nuisance[..]);
            let (_, linear) = after_one_step(problem, &selection, &parent.fit.noise, at)?;
            follow(End::after(STEPS_AGAIN), problem, parent, (mechanism, &start), linear)
        };
        starts.into_par_iter().filter_map(follow).collect()
    }

    /// The shape that a mechanism has at one of its starts; all starts are alike of one that has none.
    fn shape(&self, problem: &Problem<'_>, k: usize, start: usize) -> Guess {
        let (mechanism, starts) = &self.looked_at[k];
        let shape = &problem.spec().mechanisms[*mechanism].shape_parameters;
        let of_shape = |slot: usize| shape.iter().any(|&p| problem.slots[p] == slot);
        starts[start].iter().copied().filter(|(slot, _)| of_shape(*slot)).collect()
    }

    fn forget(&mut self, problem: &Problem<'_>, scored: &[Scored]) {
        for k in 0..self.looked_at.len() {
            let mut kept: Vec<Guess> = Vec::new();
            let mut shapes: Vec<Guess> = Vec::new();
            for &(_, _, start) in scored.iter().filter(|s| s.1 == k) {
                let shape = self.shape(problem, k, start);
                let new = !shapes.contains(&shape) && shapes.len() < SHAPES;
                if kept.len() < STARTS || new {
                    kept.push(self.looked_at[k].1[start].clone());
                }
                if new {
                    shapes.push(shape);
                }
            }
            if !kept.is_empty() && self.looked_at[k].1.len() > STARTS {
                self.looked_at[k].1 = kept;
            }
        }
    }
}

/// The sum of squares that is left after one step from a point, as the linearised model has it, and that model.
pub(crate) fn after_one_step(
    problem: &Problem<'_>,
    selection: &Selection,
    noise: &NoiseState,
    at: (&[f64], &[Vec<f64>]),
) -> Option<(f64, NormalEquations)> {
    let linear = linearise(problem, selection, noise, at.0, at.1).ok()?;
    let step = Step::new(problem, selection, &linear, at, 0.0);
    let left = linear.chi2 - step.predicted;
    left.is_finite().then_some((left, linear))
}

/// A set with one mechanism more, and the shared parameters where that begins.
fn with_one_more(
    problem: &Problem<'_>,
    parent: &Candidate,
    mechanism: usize,
    start: &[(usize, f64)],
) -> (Selection, Vec<f64>) {
    let set: Vec<usize> = parent.set.iter().copied().chain([mechanism]).collect();
    let mut shared = parent.fit.shared.clone();
    start.iter().for_each(|&(slot, value)| shared[slot] = value);
    (problem.select(&set, &[]), shared)
}

/// Of each mechanism where it leaves least, less than its parent does; the least first.
fn best_of_each(mut followed: Vec<(f64, Promising)>, parent: &Candidate) -> Vec<(f64, Promising)> {
    followed.retain(|(left, _)| *left < parent.fit.chi2 - 1.0);
    followed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut seen = Vec::new();
    followed.retain(|(_, promising)| {
        let new = !seen.contains(&promising.mechanism);
        seen.push(promising.mechanism);
        new
    });
    followed
}

/// The sum of squares that is left after some steps from a start, and where they lead the mechanism.
fn follow(
    end: End,
    problem: &Problem<'_>,
    parent: &Candidate,
    (mechanism, start): (usize, &[(usize, f64)]),
    linear: NormalEquations,
) -> Option<(f64, Promising)> {
    let (selection, shared) = with_one_more(problem, parent, mechanism, start);
    let at = (&shared[..], &parent.fit.nuisance[..]);
    let fit = descend(end.roughly(), problem, &selection, &parent.fit.noise, at, linear);
    let of = &problem.spec().mechanisms[mechanism];
    let shared = |p: &&usize| problem.spec().parameters[**p].scope == Scope::Shared;
    let slots = of.parameters.iter().chain(&of.companions).filter(shared).map(|&p| problem.slots[p]);
    // Whole numbers stay where the start has them.
    let start: Guess = slots.map(|slot| (slot, fit.shared[slot])).collect();
    fit.chi2.is_finite().then_some((fit.chi2, Promising { mechanism, start }))
}
