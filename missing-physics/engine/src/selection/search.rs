//! The search for sets of mechanisms that explain the data.

use rayon::prelude::*;

use crate::data::Run;
use crate::estimate::profile::better_top;
use crate::fit::optimum::Fit;
use crate::fit::prediction::residuals;
use crate::model::PredictError;
use crate::noise::rule::NoiseRule;
use crate::problem::{Problem, RunRows};
use crate::selection::candidate::{Candidate, Guess, candidate, finish};
use crate::selection::parts::{BEAM, MOST, best_evidence, from_larger, likeliest, unknown_parts, worth};
use crate::selection::screening::{Promising, Screening};
use crate::selection::several_places::{MOST_MEMBERS, NEEDED, without_each};
use crate::statistics::median;

/// Sets within this log evidence of the best may become it once their best top is found.
const POLISHED: f64 = 6.0;
/// A parameter of the baseline's that changes by more than so many of its scales has gone far.
const FAR: f64 = 3.0;
/// A set that leaves less than this many sigmas of the data's rough part explains them to the noise.
const NOISE: f64 = 1.05;

/// What a search found.
pub(crate) struct Searched {
    /// The sets that could be fitted, the baseline first.
    pub(crate) all: Vec<Candidate>,
    /// Mechanisms that could not be fitted on their own, and why.
    pub(crate) unfitted: Vec<(usize, PredictError)>,
}

/// Tries sets of mechanisms: each alone, then the best ones with one more, to three at work, and to more where these are of three kinds; `None`
/// where `tell` stops it.
pub(crate) fn search(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    baseline: Candidate,
    allowed: &[usize],
    tell: &(dyn Fn(f64) -> bool + Sync),
) -> Option<Searched> {
    let mut all = vec![baseline];
    let mut unfitted = Vec::new();
    // Where there are many, most would be fitted for nothing.
    let mut screening = problem.knows_many().then(|| Screening::new(allowed));
    let mut layer: Vec<usize> = vec![0];
    // A mechanism that comes with another is two at work.
    let at_work = |c: &Candidate| problem.at_work(&c.set).len();
    for size in 1..=MOST {
        grow(problem, rule, &mut screening, &mut all, &mut unfitted, (&layer, allowed));
        if let (1, Some(screening)) = (size, &mut screening) {
            from_where_it_begins(problem, rule, screening, &mut all);
        }
        if !tell(size as f64 / MOST as f64) {
            return None;
        }
        let of_this_size = |c: &Candidate| at_work(c) == size && c.evidence.is_finite();
        let mut order: Vec<usize> = (0..all.len()).filter(|&i| of_this_size(&all[i])).collect();
        order.sort_by(|&a, &b| all[b].evidence.total_cmp(&all[a].evidence));
        let [larger, smaller] =
            [size, size - 1].map(|most| best_evidence(all.iter().filter(|c| at_work(c) <= most)));
        if size > 1 && larger <= smaller {
            break;
        }
        order.truncate(BEAM);
        if let Some(&best) = order.first().filter(|_| screening.is_some())
            && down_to_noise(problem, rule, &all[best])
        {
            // Nothing is left that another set could explain better with one more.
            order.retain(|&i| all[i].evidence > all[best].evidence - POLISHED);
        }
        layer = order;
    }
    if screening.is_some() {
        let known = all.len();
        all.extend(unknown_parts(problem, rule, &all));
        let found = likeliest(&all).filter(|&best| best >= known && at_work(&all[best]) < MOST);
        if let Some(best) = found.filter(|&best| !down_to_noise(problem, rule, &all[best])) {
            grow(problem, rule, &mut screening, &mut all, &mut unfitted, (&[best], allowed));
        }
    }
    if !widen(problem, rule, &mut screening, &mut all, &mut unfitted, (allowed, tell)) {
        return None;
    }
    from_larger(problem, rule, &mut all);
    // Beside a leftover no difference between neighbouring tops decides anything.
    let likeliest = all.iter().max_by(|a, b| a.evidence.total_cmp(&b.evidence));
    if screening.is_none() || likeliest.is_some_and(|best| down_to_noise(problem, rule, best)) {
        polish(problem, rule, &mut all);
    }
    Some(Searched { all, unfitted })
}

/// Goes on from the likeliest set of three with mechanisms of its kinds at other places (friction in each joint of an arm), one at a time, as long
/// as each is clearly needed; then without those that were needed only until others came. Whether it was not stopped.
fn widen(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    screening: &mut Option<Screening>,
    all: &mut Vec<Candidate>,
    unfitted: &mut Vec<(usize, PredictError)>,
    (allowed, tell): (&[usize], &(dyn Fn(f64) -> bool + Sync)),
) -> bool {
    let Some(mut best) = likeliest(all).filter(|_| screening.is_some()) else { return true };
    if problem.at_work(&all[best].set).len() < MOST {
        return true;
    }
    let three = best;
    while all[best].set.len() < MOST_MEMBERS && !down_to_noise(problem, rule, &all[best]) {
        let known = all.len();
        grow(problem, rule, screening, all, unfitted, (&[best], allowed));
        let Some(better) = likeliest(all).filter(|&i| i >= known) else { break };
        if worth(&all[better]) < worth(&all[best]) + NEEDED {
            break;
        }
        best = better;
        if !tell(1.0) {
            return false;
        }
    }
    while best != three {
        let known = all.len();
        all.extend(without_each(problem, rule, all, best));
        let Some(better) = likeliest(all).filter(|&i| i >= known) else { break };
        best = better;
    }
    true
}

/// Fits the sets of a layer with one more mechanism each.
fn grow(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    screening: &mut Option<Screening>,
    all: &mut Vec<Candidate>,
    unfitted: &mut Vec<(usize, PredictError)>,
    (layer, allowed): (&[usize], &[usize]),
) {
    let wanted = match screening {
        Some(screening) => screened(problem, screening, all, layer),
        None => larger(problem, all, layer, allowed),
    };
    let fitted: Vec<Result<Candidate, PredictError>> =
        wanted.par_iter().map(|wanted| fitted(problem, rule, all, wanted)).collect();
    for (Wanted { set, .. }, fitted) in wanted.into_iter().zip(fitted) {
        match (fitted, &set[..]) {
            (Ok(fitted), _) => all.push(fitted),
            (Err(why), &[alone]) => unfitted.push((alone, why)),
            (Err(_), _) => {}
        }
    }
}

/// Fits single mechanisms from where the model begins as well, if the baseline's fit ended far from there: without what is missing it may
/// have settled where nothing makes sense.
fn from_where_it_begins(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    screening: &mut Screening,
    all: &mut Vec<Candidate>,
) {
    let baseline = &all[0];
    let (ends, begins) = (&baseline.fit.shared, &problem.shared.start);
    let far = |&slot: &usize| (ends[slot] - begins[slot]).abs() > FAR * problem.shared.scale[slot];
    if !baseline.selection.shared.iter().any(far) || down_to_noise(problem, rule, baseline) {
        return;
    }
    let nuisance = problem.nuisance_start.clone();
    let fit = Fit { shared: begins.clone(), nuisance, ..baseline.fit.clone() };
    let begun = Candidate { fit, ..baseline.clone() };
    let promising = screening.promising(problem, &begun, starts_beside(problem, &begun));
    let fitted = |Promising { mechanism, start }: &Promising| {
        candidate(problem, rule, &[*mechanism], &[], &begun.fit, std::slice::from_ref(start)).ok()
    };
    for better in promising.par_iter().filter_map(fitted).collect::<Vec<_>>() {
        match all.iter().position(|c| c.set == better.set) {
            None => all.push(better),
            Some(k) if better.fit.log_likelihood > all[k].fit.log_likelihood => {
                all[k] = better.in_place_of(all[k].clone(), problem, rule);
            }
            Some(_) => {}
        }
    }
}

/// Whether a set leaves no more than the noise.
fn down_to_noise(problem: &Problem<'_>, rule: &NoiseRule, candidate: &Candidate) -> bool {
    let Ok(left) = residuals(problem, &candidate.fit) else { return false };
    (0..problem.channels()).all(|c| {
        let rough = rule.fixed_sigma[c].or_else(|| median(&mut problem.rough_sigmas(c)));
        let squares: f64 = left.iter().flat_map(|run| &run[c]).map(|v| v * v).sum();
        let rms = (squares / problem.count(c).max(1) as f64).sqrt();
        rough.is_some_and(|rough| rms < NOISE * rough.max(rule.floor[c]))
    })
}

/// The sets of a layer with one more mechanism each, every set once, and where its parent stands.
fn larger(problem: &Problem<'_>, all: &[Candidate], layer: &[usize], allowed: &[usize]) -> Vec<Wanted> {
    let mut wanted = Vec::new();
    for &parent in layer {
        for &m in allowed {
            want(problem, &mut wanted, all, parent, m, None);
        }
    }
    wanted
}

/// The sets of a layer with one more mechanism each that promises anything there.
fn screened(
    problem: &Problem<'_>,
    screening: &mut Screening,
    all: &[Candidate],
    layer: &[usize],
) -> Vec<Wanted> {
    let mut wanted = Vec::new();
    for &parent in layer {
        let starts = starts_beside(problem, &all[parent]);
        for promising in screening.promising(problem, &all[parent], starts) {
            want(problem, &mut wanted, all, parent, promising.mechanism, Some(promising.start));
        }
    }
    wanted
}

/// A set that is to be fitted, where its parent stands, and where to begin its new mechanism if that is known.
struct Wanted {
    set: Vec<usize>,
    parent: usize,
    start: Option<Guess>,
}

/// Adds a parent's set with one more mechanism, unless it has that, or the set is wanted or fitted already, by this name or another.
fn want(
    problem: &Problem<'_>,
    wanted: &mut Vec<Wanted>,
    all: &[Candidate],
    parent: usize,
    mechanism: usize,
    start: Option<Guess>,
) {
    let mut set = all[parent].set.clone();
    if !problem.may_join(&set, mechanism) {
        return;
    }
    set.push(mechanism);
    set.sort_unstable();
    if !problem.is_among(&set, all.iter().map(|c| &c.set).chain(wanted.iter().map(|w| &w.set))) {
        wanted.push(Wanted { set, parent, start });
    }
}

/// A set fitted from its parent's fit, and where it has several mechanisms from the fits of each of them alone too, unless it is known
/// where the new one begins beside the others.
fn fitted(
    problem: &Problem<'_>,
    rule: &NoiseRule,
    all: &[Candidate],
    Wanted { set, parent, start }: &Wanted,
) -> Result<Candidate, PredictError> {
    let parent = &all[*parent];
    let guesses = start.clone().map_or_else(|| guesses(problem, parent, set), |start| vec![start]);
    let found = candidate(problem, rule, set, &[], &parent.fit, &guesses);
    if set.len() == 1 || start.is_some() {
        return found;
    }
    let other = candidate(problem, rule, set, &[], &parent.fit, &[hints(problem, all, set)]);
    match (found, other) {
        (Ok(found), Ok(other)) if other.fit.log_likelihood > found.fit.log_likelihood + 1e-6 => {
            Ok(other.in_place_of(found, problem, rule))
        }
        (found, other) => found.or(other),
    }
}

/// Looks for better tops of the likelihood of the sets that are likeliest, and takes them.
fn polish(problem: &Problem<'_>, rule: &NoiseRule, all: &mut [Candidate]) {
    let best = best_evidence(all.iter());
    let close = |c: &&mut Candidate| !c.set.is_empty() && worth(c) > best - POLISHED;
    let mut likely: Vec<&mut Candidate> = all.iter_mut().filter(close).collect();
    likely.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    likely.truncate(BEAM);
    likely.par_iter_mut().for_each(|c| {
        for _ in 0..BEAM {
            let Some(top) = better_top(problem, c) else { break };
            match candidate(problem, rule, &c.set, &[], &top, &[vec![]]) {
                Ok(better) if better.evidence > c.evidence => {
                    **c = better.in_place_of(c.clone(), problem, rule);
                }
                _ => break,
            }
        }
        finish(problem, rule, c);
    });
}

/// Where the model says to begin each mechanism, by what a fitted set leaves.
fn starts_beside<'a>(problem: &'a Problem<'_>, parent: &Candidate) -> impl Fn(usize) -> Vec<Guess> + 'a {
    let left = problem.model.extensions().modes.and_then(|modes| {
        let left = residuals(problem, &parent.fit).ok()?;
        Some((modes, over_all_rows(problem, left)))
    });
    let slot = |p: usize| problem.shared.index.iter().position(|&i| i == p);
    move |mechanism| {
        let Some((modes, left)) = &left else { return Vec::new() };
        let starts = modes.starts(mechanism, &problem.recording.runs, left).into_iter();
        let of_it =
            |start: Vec<(usize, f64)>| start.into_iter().filter_map(|(p, v)| Some((slot(p)?, v))).collect();
        distinct(starts.map(of_it))
    }
}

/// Starts that say anything, each once.
fn distinct(starts: impl Iterator<Item = Guess>) -> Vec<Guess> {
    let mut distinct: Vec<Guess> = Vec::new();
    for start in starts.filter(|start| !start.is_empty()) {
        if !distinct.contains(&start) {
            distinct.push(start);
        }
    }
    distinct
}

/// Where the model says to begin the mechanism that a set has and its parent has not, with all whole numbers that it knows for those
/// of the others: what was the best of them alone need not be so in company.
fn guesses(problem: &Problem<'_>, parent: &Candidate, set: &[usize]) -> Vec<Guess> {
    let starts_of = starts_beside(problem, parent);
    let mut all: Vec<Guess> = Vec::new();
    for &mechanism in set {
        let integers = problem.integer_slots(&[mechanism]);
        let new = !parent.set.contains(&mechanism);
        if !new && integers.is_empty() {
            continue;
        }
        let of_it =
            |start: Guess| start.into_iter().filter(|(slot, _)| new || integers.contains(slot)).collect();
        let starts = distinct(starts_of(mechanism).into_iter().map(of_it));
        if all.is_empty() {
            all = starts;
        } else if !starts.is_empty() {
            all = all.iter().flat_map(|a| starts.iter().map(|b| [&a[..], b].concat())).collect();
        }
    }
    all
}

/// Values of the measured rows, `[run][channel]`, as columns over all rows: NaN where nothing was measured.
fn over_all_rows(problem: &Problem<'_>, values: Vec<Vec<Vec<f64>>>) -> Vec<Vec<Vec<f64>>> {
    let of_run = |((channels, rows), run): ((Vec<Vec<f64>>, &RunRows), &Run)| {
        let spread = |(values, valid): (Vec<f64>, &Vec<usize>)| {
            let mut column = vec![f64::NAN; run.len()];
            valid.iter().zip(values).for_each(|(&i, v)| column[i] = v);
            column
        };
        channels.into_iter().zip(&rows.valid).map(spread).collect()
    };
    values.into_iter().zip(&problem.rows).zip(&problem.recording.runs).map(of_run).collect()
}

/// Values of a set's parameters from the fits of its members alone.
fn hints(problem: &Problem<'_>, all: &[Candidate], set: &[usize]) -> Guess {
    let mut hints = Vec::new();
    for &m in set {
        let Some(single) = all.iter().find(|c| c.set == [m]) else { continue };
        let mechanism = &problem.spec().mechanisms[m];
        for &p in mechanism.parameters.iter().chain(&mechanism.companions) {
            if let Some(slot) = problem.shared.index.iter().position(|&i| i == p) {
                hints.push((slot, single.fit.shared[slot]));
            }
        }
    }
    hints
}
