//! Hypotheses along one variable: in which interval, in what form and in which runs an unknown acts.

use crate::locate::bins::Bins;
use crate::locate::membership::{Members, Rows};
use crate::locate::responses::{Effect, Form, Responses};

/// So many groups of neighbouring runs are told apart.
const GROUPS: usize = 40;
/// By how much a change that goes on to the last run, or to the end of the variable, is worth more than what is over before.
pub(crate) const STAYS: f64 = 1.0;
/// Likelihoods that differ by this part of their sum are the same: as they are where the same readings are moved, but for rounding.
const EVEN: f64 = 1e-3;
/// Two ways to the same likelihood differ by this part of it at most.
const ROUNDING: f64 = 1e-6;
/// A subset of the runs is sought among so many at most.
const SUBSETS: usize = 64;

/// A hypothesis along one variable.
#[derive(Clone)]
pub(crate) struct Found {
    pub(crate) bins: Bins,
    pub(crate) interval: (usize, usize),
    pub(crate) form: Form,
    pub(crate) runs: Vec<bool>,
    pub(crate) components: Vec<usize>,
    /// The rows at which it acts, where those are not all that were measured within the interval.
    pub(crate) members: Option<Members>,
    /// By how much the sum of squares falls, and what of that is paid.
    pub(crate) gain: f64,
    pub(crate) price: f64,
}

impl Found {
    pub(crate) fn worth(&self) -> f64 {
        self.gain - self.price
    }

    /// Whether it acts alike all along the variable.
    pub(crate) fn all_along(&self) -> bool {
        self.members.is_none() && self.form == Form::Even && self.interval == (0, self.bins.len())
    }
}

/// The best hypotheses along one variable: in all runs or neighbouring ones, and in a subset of them.
#[derive(Clone, Default)]
pub(crate) struct Best {
    pub(crate) simple: Option<Found>,
    pub(crate) some_runs: Option<Found>,
}

/// Whether an interval begins somewhere within so many bins and ends where they do.
pub(crate) fn goes_on((from, to): (usize, usize), bins: usize) -> bool {
    from > 0 && to == bins
}

/// An effect in several runs.
fn total(runs: impl Iterator<Item = Effect>) -> Effect {
    runs.fold(Effect::default(), |mut sum, run| {
        sum.add(&run);
        sum
    })
}

/// The intervals along one variable, for all components of an unknown.
pub(crate) struct Scan<'a> {
    pub(crate) bins: &'a Bins,
    pub(crate) responses: &'a [Responses],
    pub(crate) runs: usize,
    /// Whether what acts in a run shows in that run alone.
    pub(crate) alone: bool,
    pub(crate) rows: f64,
    /// The sum of squares of all that is left.
    pub(crate) whole: f64,
    /// The largest plausible size.
    pub(crate) largest: f64,
}

impl Scan<'_> {
    /// The best hypotheses.
    pub(crate) fn best(&self) -> Best {
        let mut best = Best::default();
        let n = self.bins.len();
        for interval in (0..n).flat_map(|from| (from + 1..=n).map(move |to| (from, to))) {
            for form in Form::ALL {
                let effects: Vec<Vec<Effect>> =
                    self.responses.iter().map(|r| r.by_run(self.bins, interval, form)).collect();
                let scanned = self.scanned(interval, form);
                self.all_runs(&effects, interval, form, scanned, &mut best.simple);
                if self.alone && self.runs > 1 && form == Form::Even {
                    self.neighbouring_runs(&effects, interval, scanned, &mut best.simple);
                    self.some_runs(&effects, interval, scanned, &mut best.some_runs);
                }
            }
        }
        best
    }

    /// What is paid for where one of the intervals begins and ends, and for its form.
    fn scanned(&self, interval: (usize, usize), form: Form) -> f64 {
        let n = self.bins.len();
        if interval == (0, n) && form == Form::Even {
            return 0.0;
        }
        let intervals = (n * (n + 1) / 2) as f64;
        let scanned = 2.0 * (Form::ALL.len() as f64 * intervals).ln();
        // A shift from somewhere on has another side that fits as well where each run has a level of its own: what was before.
        if goes_on(interval, n) { scanned - STAYS } else { scanned }
    }

    /// The best hypothesis of a component in all runs, where the variable was measured with an error: of the intervals that begin at each
    /// edge the one that fits best as it was measured, with the rows and edges that are the most probable near it.
    pub(crate) fn with_errors(&self, component: usize, rows: &Rows) -> Option<Found> {
        let n = self.bins.len();
        let as_measured = |interval: (usize, usize)| {
            total(self.responses[component].by_run(self.bins, interval, Form::Even).into_iter()).gain()
        };
        let best_from = |from: usize| {
            let judged =
                (from + 1..=n).filter(|to| (from, *to) != (0, n)).map(|to| (as_measured((from, to)), to));
            judged.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, to)| (from, to))
        };
        let found = (0..n).filter_map(best_from).filter_map(|(from, to)| {
            let [low, high] = [self.bins.spans[from][0], self.bins.spans[to - 1][1]];
            let (gain, members) = rows.near(low, high)?;
            let price = self.rows.ln() + self.scanned((from, to), Form::Even);
            Some(Found {
                bins: self.bins.clone(),
                interval: (from, to),
                form: Form::Even,
                runs: vec![true; self.runs],
                components: vec![component],
                members: Some(members),
                gain,
                price,
            })
        });
        found.max_by(|a, b| a.worth().total_cmp(&b.worth()))
    }

    /// By how much an effect lowers the sum of squares; `-infinity` where it is not plausibly so large.
    fn gain(&self, effect: &Effect, interval: (usize, usize), form: Form) -> f64 {
        let plausible =
            self.largest.is_infinite() || effect.largest(form, self.bins, interval) <= self.largest;
        if plausible { effect.gain() } else { f64::NEG_INFINITY }
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
        let price = form.sizes() as f64 * self.rows.ln();
        let gains: Vec<f64> = effects.iter().map(|e| self.gain(e, interval, form)).collect();
        let mut better = |gain: f64, price: f64, components: Vec<usize>| {
            // What takes away more than there is takes it by rounding.
            let sound = gain.is_finite() && gain <= self.whole * (1.0 + EVEN);
            if best.as_ref().is_none_or(|b| gain - price > b.worth()) && sound {
                let bins = self.bins.clone();
                let members = None;
                *best = Some(Found { bins, interval, form, runs: runs(), components, members, gain, price });
            }
        };
        gains.iter().enumerate().for_each(|(c, gain)| better(*gain, price + scanned, vec![c]));
        if gains.len() > 1 {
            let all = gains.len();
            better(gains.iter().sum(), all as f64 * price + scanned, (0..all).collect());
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
        let sums: Vec<Effect> = effects.iter().map(|runs| total(runs.iter().cloned())).collect();
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
                    effects[begin(to - 1)..begin(to)].iter().for_each(|e| sum.add(e));
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
            let mut order: Vec<usize> = (0..self.runs).filter(|&r| effects[r].size().is_finite()).collect();
            order.sort_by(|&a, &b| effects[b].size().total_cmp(&effects[a].size()));
            for reversed in [false, true] {
                if reversed {
                    order.reverse();
                }
                let mut sum = Effect::default();
                let mut ways = 0.0;
                for (k, &run) in order.iter().enumerate().take(self.runs / 2) {
                    sum.add(&effects[run]);
                    // The number of ways to choose so many of the runs, and that number itself.
                    ways += (((self.runs - k) as f64) / (k + 1) as f64).ln();
                    let price = self.rows.ln() + scanned + 2.0 * (ways + (self.runs as f64).ln());
                    if sum.size().abs() > self.largest {
                        continue;
                    }
                    let gain = sum.gain();
                    if best.as_ref().is_none_or(|b| gain - price > b.worth()) {
                        let mut runs = vec![false; self.runs];
                        order[..=k].iter().for_each(|&r| runs[r] = true);
                        let (form, components, bins) = (Form::Even, vec![component], self.bins.clone());
                        let members = None;
                        *best = Some(Found { bins, interval, form, runs, components, members, gain, price });
                    }
                }
            }
        }
    }

    /// A hypothesis found with fewer edges, of the components that are scanned here, with its edges anywhere between their neighbours
    /// there: each where it is as likely to be before as behind.
    pub(crate) fn finer(&self, found: Found) -> Found {
        let forms = if found.runs.contains(&false) { &Form::ALL[..1] } else { &Form::ALL[..] };
        let price = |form: Form| {
            let sizes = self.responses.len() as f64 * (form.sizes() as f64 - found.form.sizes() as f64);
            found.price + sizes * self.rows.ln()
        };
        let worth = |interval: (usize, usize), form: Form| {
            let of_component = |r: &Responses| {
                let runs = r.by_run(self.bins, interval, form).into_iter().zip(&found.runs);
                let all = total(runs.filter(|(_, acts)| **acts).map(|(effect, _)| effect));
                self.gain(&all, interval, form)
            };
            self.responses.iter().map(of_component).sum::<f64>() - price(form)
        };
        let [from, to] = [found.interval.0, found.interval.1].map(|edge| found.bins.near(edge, self.bins));
        let intervals = from.flat_map(|from| to.clone().map(move |to| (from, to))).filter(|(f, t)| f < t);
        let judged: Vec<Edges> = intervals
            .flat_map(|interval| forms.iter().map(move |&form| (interval, form)))
            .map(|(interval, form)| Edges { interval, form, worth: worth(interval, form) })
            .filter(|edges| edges.worth.is_finite())
            .collect();
        // What acts all along has no edges to be found, unless others are better by more than rounding.
        let all_along = found.interval == (0, found.bins.len());
        let rounding = ROUNDING * found.worth().abs() * if all_along { 1.0 } else { -1.0 };
        let better = |best: &&Edges| best.worth >= found.worth() + rounding;
        let Some(best) = likeliest(judged.iter()).filter(better) else { return found };
        // Edges that may be anywhere are worth what they are on average, not what the best of them is.
        let likelihoods = judged.iter().map(|e| (0.5 * (e.worth - best.worth)).exp());
        let average = best.worth + 2.0 * (likelihoods.sum::<f64>() / judged.len() as f64).ln();
        let from = middle(&judged, |e| e.interval.0, -EVEN);
        let to = middle(&judged, |e| e.interval.1, EVEN);
        let middle = likeliest(judged.iter().filter(|e| e.interval == (from, to))).unwrap_or(best);
        let middle = widest(&judged, middle);
        let price = price(middle.form);
        let (interval, form, gain) = (middle.interval, middle.form, average.max(found.worth()) + price);
        Found { bins: self.bins.clone(), interval, form, gain, price, ..found }
    }
}

/// Edges that are tried.
struct Edges {
    interval: (usize, usize),
    form: Form,
    worth: f64,
}

/// What acts where it moves no reading, as a force does at the last row, may act there or not: the widest interval that is as likely as one.
fn widest<'a>(judged: &'a [Edges], one: &'a Edges) -> &'a Edges {
    let (from, to) = one.interval;
    let same = |e: &&Edges| {
        let holds = e.interval.0 <= from && e.interval.1 >= to && e.form == one.form;
        holds && (e.worth - one.worth).abs() <= ROUNDING * one.worth.abs()
    };
    judged.iter().filter(same).max_by_key(|e| e.interval.1 - e.interval.0).unwrap_or(one)
}

fn likeliest<'a>(edges: impl Iterator<Item = &'a Edges>) -> Option<&'a Edges> {
    edges.max_by(|a, b| a.worth.total_cmp(&b.worth))
}

/// The edge before which there is half of the likelihood, and a small part more.
fn middle(judged: &[Edges], edge: impl Fn(&Edges) -> usize, more: f64) -> usize {
    let most = likeliest(judged.iter()).map_or(0.0, |best| best.worth);
    let mut weights: Vec<(usize, f64)> =
        judged.iter().map(|e| (edge(e), (0.5 * (e.worth - most)).exp())).collect();
    weights.sort_by_key(|weight| weight.0);
    let mut left = (0.5 + more) * weights.iter().map(|weight| weight.1).sum::<f64>();
    let passed = |weight: &&(usize, f64)| {
        left -= weight.1;
        left <= 0.0
    };
    weights.iter().find(passed).map_or(0, |weight| weight.0)
}
