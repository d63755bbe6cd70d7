//! The mechanisms that take away nearly all of the misfit where something else is left over.

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::adequacy::linearised::curves::Curves;
use crate::diagnosis::NEARLY_ALL;
use crate::fit::gauss_newton::{End, solve_until};
use crate::fit::optimum::{Fit, covariance};
use crate::fit::prediction::residuals_at;
use crate::leftover::fit::{given, with_leftover};
use crate::leftover::process::Process;
use crate::model::PredictError;
use crate::noise::rough::RoughNoise;
use crate::noise::rule::{NoiseRule, NoiseState};
use crate::problem::{Problem, Selection};
use crate::selection::candidate::Candidate;
use crate::selection::evidence::evidence;
use crate::selection::share::{Cut, Look, misfit, unseen_misfit};

/// Log Bayes factor by which each member of the set is needed, and by which the set leads its rivals.
const NEEDED: f64 = 5.0;
/// Wald's statistic at which a size that may have either sign is as large as its standard error: of a smaller one nothing is known.
const SIZE_KNOWN: f64 = 1.0;
/// What a set of several leaves must be so many times smaller than what it leaves without any one of them: one that takes away less may
/// be imitating the leftover. So must what a set leaves be with a cause in a part of the data.
pub(crate) const SMALLER: f64 = 3.0;
/// What an explanation may leave of the baseline's misfit of unseen data.
const LEAST: f64 = 0.5;
/// Noise alone moves a sum of squares by so many standard deviations at most.
const CHANCE: f64 = 3.0;
/// Blocks of rows whose means are looked at where the rows themselves show nothing, and the fewest such blocks of a channel.
const BLOCKS: [usize; 3] = [4, 16, 64];
const FEWEST_BLOCKS: usize = 16;
/// A rival takes away at least this part of the misfit.
const RIVAL_SHARE: f64 = 0.85;
/// Log Bayes factor of a leftover against one that is larger by a factor e, with eight directions open to a smooth leftover.
const OF_A_FACTOR: f64 = 4.0;
/// A set that leaves less than so many times what the chosen one leaves is not ruled out by that: its log Bayes factor is less than [`NEEDED`].
const RIVAL_MISFIT: f64 = 3.5;
/// Directions among smooth functions that a leftover may take.
const DIRECTIONS: f64 = 6.0;
/// Rivals that are said.
const MOST_RIVALS: usize = 6;
/// Sets that leave least of the data they are fitted to, of which that is the closest which leaves least of unseen data.
const CLOSE: usize = 3;

/// A set of mechanisms, fitted with a leftover in the model.
#[derive(Clone)]
pub(crate) struct Judged {
    pub(crate) candidate: Candidate,
    /// The same set fitted by ordinary least squares.
    pub(crate) least_squares: Candidate,
    process: Process,
    /// The part of the squared misfit that it takes away on unseen data.
    pub(crate) share: f64,
    /// How these were looked at.
    pub(crate) look: Look,
    misfit: f64,
}

/// The main cause, and others that do as well.
pub(crate) struct MainCause {
    pub(crate) chosen: Judged,
    pub(crate) rivals: Vec<Judged>,
}

/// What comes closest where nothing explains the data.
pub(crate) struct Closest {
    pub(crate) judged: Judged,
    /// The part of the squared misfit that it takes away on unseen data; none where that is lost in the noise.
    pub(crate) share: Option<f64>,
    /// Other sets that are as likely where no share is known.
    pub(crate) as_likely: Vec<Vec<usize>>,
}

impl From<Judged> for Closest {
    fn from(judged: Judged) -> Self {
        Self { share: Some(judged.share), as_likely: Vec::new(), judged }
    }
}

/// Candidates, judged by what they leave.
pub(crate) struct Judge<'a> {
    problem: &'a Problem<'a>,
    rule: NoiseRule,
    rough: RoughNoise,
    all: &'a [Candidate],
    /// By candidate.
    least_squares: Vec<Option<LeastSquares>>,
    /// By candidate, once it was asked for: with a leftover in the model.
    judged: Vec<OnceLock<Option<Judged>>>,
    look: Look,
    /// What the baseline leaves.
    base: f64,
}

/// A candidate's least-squares fit.
struct LeastSquares {
    fit: Fit,
    /// The misfit that it leaves of the data it is fitted to.
    seen: f64,
    /// The misfit that it leaves of unseen data, once it was asked for: it costs many fits.
    unseen: OnceLock<Option<f64>>,
}

/// A set without one of its members.
fn without(set: &[usize], member: usize) -> Vec<usize> {
    set.iter().copied().filter(|m| *m != member).collect()
}

impl<'a> Judge<'a> {
    /// Fits the wanted candidates and the baseline by ordinary least squares, to be judged beside a noise on the scale of a few rows.
    pub(crate) fn new(
        problem: &'a Problem<'a>,
        rule: &NoiseRule,
        all: &'a [Candidate],
        rough: &RoughNoise,
        wanted: impl Fn(&Candidate) -> bool + Sync,
    ) -> Self {
        let white = NoiseState { shape: vec![0; problem.channels()], sigma: rough.slow() };
        let rows = rough.all_rows(problem);
        let least_squares = |c: &Candidate| -> Option<LeastSquares> {
            (c.evidence.is_finite() && (c.set.is_empty() || wanted(c))).then_some(())?;
            let start = (&c.fit.shared[..], &c.fit.nuisance[..]);
            let fit = solve_until(End::of(problem).roughly(), problem, &c.selection, &white, start).ok()?;
            let seen = (fit.chi2 - rows).max(0.0);
            Some(LeastSquares { fit, seen, unseen: OnceLock::new() })
        };
        let least_squares: Vec<Option<LeastSquares>> = all.par_iter().map(least_squares).collect();
        let judged = all.iter().map(|_| OnceLock::new()).collect();
        let rule = rule.beside_a_leftover();
        let rough = rough.clone();
        let look = Look { cut: Cut::Fifths, block: 1 };
        Self { problem, rule, rough, all, least_squares, judged, look, base: 0.0 }.with_base()
    }

    /// The same judge; where row by row the baseline's misfit is lost in the noise, one that looks at blocks of rows, the shortest in which it is
    /// not, if there are any.
    pub(crate) fn against_noise(self) -> Self {
        let longest =
            (0..self.problem.channels()).map(|c| self.problem.count(c)).min().unwrap_or(0) / FEWEST_BLOCKS;
        let blocks = BLOCKS.into_iter().filter(|block| *block <= longest);
        let mut looks = blocks.map(|block| Look { block, ..self.look });
        if self.base > self.misfit_of_noise() {
            return self;
        }
        looks
            .find_map(|look| Some(self.looking(look)).filter(|judge| judge.base > judge.misfit_of_noise()))
            .unwrap_or(self)
    }

    /// A judge by unseen data that lie close to those seen; of a single run only, since of several the others show what each one does.
    pub(crate) fn near(&self) -> Option<Self> {
        (self.problem.recording.runs.len() == 1).then_some(())?;
        Some(self.looking(Look { cut: Cut::Hundredths, ..self.look }))
    }

    /// The same fits, judged by another look at the data.
    fn looking(&self, look: Look) -> Self {
        let again = |known: &Option<LeastSquares>| {
            let LeastSquares { fit, seen, .. } = known.as_ref()?;
            let seen = if look.block == self.look.block { *seen } else { self.seen(fit, look.block)? };
            Some(LeastSquares { fit: fit.clone(), seen, unseen: OnceLock::new() })
        };
        let judge = Self {
            problem: self.problem,
            rule: self.rule.clone(),
            rough: self.rough.clone(),
            all: self.all,
            least_squares: self.least_squares.par_iter().map(again).collect(),
            judged: self.all.iter().map(|_| OnceLock::new()).collect(),
            look,
            base: 0.0,
        };
        judge.with_base()
    }

    /// What a fit leaves of the data it is fitted to, in blocks of so many rows.
    fn seen(&self, fit: &Fit, block: usize) -> Option<f64> {
        let left = residuals_at(self.problem, &fit.shared, &fit.nuisance).ok()?;
        Some(misfit(&left, &fit.noise, &self.rough, block).max(0.0))
    }

    fn with_base(mut self) -> Self {
        self.base = self.misfit(&[]).unwrap_or(0.0);
        self
    }

    /// The part of the squared misfit beyond the noise that a set takes away on unseen data.
    pub(crate) fn share(&self, set: &[usize]) -> Option<f64> {
        self.share_beside(set, &[])
    }

    /// The part of what some members of a set leave that all of them take away.
    pub(crate) fn share_beside(&self, set: &[usize], members: &[usize]) -> Option<f64> {
        let (left, base) = (self.misfit(set)?, self.misfit(members).unwrap_or(self.base));
        Some(if base > 0.0 { 1.0 - left / base } else { 1.0 })
    }

    /// A set's least-squares fit.
    pub(crate) fn least_squares(&self, set: &[usize]) -> Option<&Fit> {
        Some(&self.least_squares[self.at(set)?].as_ref()?.fit)
    }

    fn misfit(&self, set: &[usize]) -> Option<f64> {
        self.unseen(self.at(set)?)
    }

    /// The misfit that a candidate leaves of unseen data.
    fn unseen(&self, at: usize) -> Option<f64> {
        let LeastSquares { fit, unseen, .. } = self.least_squares[at].as_ref()?;
        let selection = &self.all[at].selection;
        let misfit = || unseen_misfit(self.problem, selection, fit, &self.rough, self.look).ok();
        *unseen.get_or_init(misfit)
    }

    /// Whether a candidate leaves at most so much of unseen data; what leaves more of the data it was fitted to does not.
    fn leaves_at_most(&self, at: usize, limit: f64) -> bool {
        self.least_squares[at].as_ref().is_some_and(|p| p.seen <= limit)
            && self.unseen(at).is_some_and(|misfit| misfit <= limit)
    }

    /// Whether a set leaves at least so much of unseen data, or is not known.
    fn leaves_at_least(&self, set: &[usize], limit: f64) -> bool {
        let Some(at) = self.at(set) else { return true };
        let Some(least_squares) = &self.least_squares[at] else { return true };
        least_squares.seen >= limit || self.unseen(at).is_none_or(|misfit| misfit >= limit)
    }

    /// Where a set stands among the candidates.
    fn at(&self, set: &[usize]) -> Option<usize> {
        self.all.iter().position(|c| c.set == set)
    }

    /// The smallest set that takes away nearly all and is needed as a whole; larger ones only where they take away most of what that leaves.
    /// None where the baseline predicts unseen data within their noise: there is no misfit to take away.
    pub(crate) fn main_cause(&self) -> Option<MainCause> {
        if self.base <= self.misfit_of_noise() {
            return None;
        }
        let mut found: Option<Judged> = None;
        for size in 1..=self.all.iter().map(|c| c.set.len()).max()? {
            let limit = match &found {
                None => (1.0 - NEARLY_ALL) * self.base,
                Some(smaller) => smaller.misfit / SMALLER,
            };
            let beyond = |c: &Candidate| {
                found.as_ref().is_none_or(|f| f.candidate.set.iter().all(|m| c.set.contains(m)))
            };
            let wanted: Vec<usize> = (0..self.all.len())
                .into_par_iter()
                .filter(|&i| self.all[i].set.len() == size && beyond(&self.all[i]))
                .filter(|&i| self.leaves_at_most(i, limit) && self.each_helps(i))
                .collect();
            let needed = |i: usize| {
                self.judged(i).filter(|j| {
                    let acts = if found.is_none() { self.each_sign_known(j) } else { self.each_acts(j) };
                    acts && self.needed(i, j) && self.beats_its_parts(j)
                })
            };
            let judged: Vec<Judged> = wanted.into_par_iter().filter_map(needed).collect();
            let evidence = |j: &Judged| j.candidate.evidence;
            let most = judged.iter().map(evidence).fold(f64::NEG_INFINITY, f64::max);
            // Where the evidence beside a leftover does not decide, unseen data have a say.
            let left = |j: &Judged| j.misfit + self.rough.whole_spread(self.problem, self.look.block);
            let worth = |j: &Judged| evidence(j) - OF_A_FACTOR * left(j).ln();
            let as_likely = judged.into_iter().filter(|j| evidence(j) > most - NEEDED);
            match as_likely.max_by(|a, b| worth(a).total_cmp(&worth(b))) {
                Some(best) => found = Some(best),
                None if found.is_some() => break,
                None => {}
            }
        }
        let chosen = found?;
        Some(MainCause { rivals: self.rivals(&chosen), chosen })
    }

    /// The sets that take away nearly all of the misfit of the data they are fitted to, at most so many: small ones before larger ones, and of one
    /// size those that leave least.
    pub(crate) fn nearly_all(&self, most: usize) -> Vec<usize> {
        let limit = (1.0 - NEARLY_ALL) * self.baseline_seen();
        let mut order: Vec<(f64, usize)> = (0..self.all.len())
            .filter(|&i| !self.all[i].set.is_empty() && self.all[i].ruled_out.is_none())
            .filter_map(|i| self.least_squares[i].as_ref().map(|least_squares| (least_squares.seen, i)))
            .filter(|(seen, _)| *seen <= limit)
            .collect();
        order.sort_by(|a, b| {
            let size = |i: usize| self.all[i].set.len();
            size(a.1).cmp(&size(b.1)).then(a.0.total_cmp(&b.0))
        });
        order.into_iter().map(|(_, i)| i).take(most).collect()
    }

    /// What the baseline leaves of the data it is fitted to.
    fn baseline_seen(&self) -> f64 {
        self.at(&[])
            .and_then(|i| self.least_squares[i].as_ref())
            .map_or(0.0, |least_squares| least_squares.seen)
    }

    /// A set as the main cause with its rivals, each with the share that it takes away of the data it is fitted to; `None` where it is no
    /// explanation beside a leftover.
    pub(crate) fn named(&self, at: usize, rivals: &[usize]) -> Option<MainCause> {
        let base = self.baseline_seen();
        let of_seen = |at: usize| {
            let seen = self.least_squares[at].as_ref()?.seen;
            Some(Judged { share: 1.0 - seen / base, ..self.judged(at)? })
        };
        let rivals = rivals.iter().filter_map(|&i| of_seen(i)).take(MOST_RIVALS).collect();
        Some(MainCause { chosen: of_seen(at)?, rivals })
    }

    /// Whether a candidate is an explanation beside a leftover, each member of which acts there.
    pub(crate) fn acts(&self, at: usize) -> bool {
        self.judged(at).is_some_and(|judged| self.each_acts(&judged))
    }

    /// The set that leaves least of unseen data, of those that take away more than noise alone may and whose members each take away most of what is
    /// left without them; where the baseline predicts unseen data within their noise, the likeliest set.
    pub(crate) fn closest(&self) -> Option<Closest> {
        if self.base <= self.misfit_of_noise() {
            return self.likeliest();
        }
        let mut order: Vec<(f64, usize)> = (0..self.all.len())
            .filter(|&i| !self.all[i].set.is_empty() && self.all[i].ruled_out.is_none())
            .filter_map(|i| self.least_squares[i].as_ref().map(|least_squares| (least_squares.seen, i)))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let shown = self.base - self.rough.whole_spread(self.problem, self.look.block);
        let helps = |&(_, i): &(f64, usize)| {
            let misfit = self.unseen(i).filter(|misfit| *misfit < shown)?;
            self.each_helps(i).then_some((misfit, i))
        };
        let mut close: Vec<(f64, usize)> = order.iter().filter_map(helps).take(CLOSE).collect();
        close.sort_by(|a, b| a.0.total_cmp(&b.0));
        let known = |judged: &Judged| self.each_sign_known(judged);
        close.into_iter().find_map(|(_, i)| self.judged(i).filter(known)).map(Closest::from)
    }

    /// The likeliest set without a leftover, the smallest of those that are as likely, where it is clearly likelier than the baseline. What part of
    /// the misfit it takes away is not known.
    fn likeliest(&self) -> Option<Closest> {
        let least = self.all[self.at(&[])?].evidence + NEEDED;
        let mut likely: Vec<usize> = (0..self.all.len())
            .filter(|&i| !self.all[i].set.is_empty() && self.all[i].ruled_out.is_none())
            .filter(|&i| self.least_squares[i].is_some() && self.all[i].evidence >= least)
            .collect();
        likely.sort_by(|&a, &b| self.all[b].evidence.total_cmp(&self.all[a].evidence));
        let as_likely = self.all[*likely.first()?].evidence - NEEDED;
        likely.retain(|&i| self.all[i].evidence >= as_likely);
        let members = likely.iter().map(|&i| self.all[i].set.len()).min()?;
        likely.retain(|&i| self.all[i].set.len() == members);
        let known = |judged: &Judged| self.each_sign_known(judged);
        let mut judged = likely.into_iter().filter_map(|i| self.judged(i).filter(known));
        let first = judged.next()?;
        let others = judged.map(|judged| judged.candidate.set).take(MOST_RIVALS).collect();
        Some(Closest { judged: first, share: None, as_likely: others })
    }

    /// The misfit that noise alone may leave.
    fn misfit_of_noise(&self) -> f64 {
        CHANCE * self.rough.whole_spread(self.problem, self.look.block)
    }

    /// Whether a set leaves nothing but noise of unseen data; or takes away most of the baseline's misfit there, and predicts them no worse than it
    /// does without any one member.
    pub(crate) fn holds(&self, set: &[usize]) -> bool {
        let Some(left) = self.misfit(set).filter(|left| *left > self.misfit_of_noise()) else { return true };
        left <= LEAST * self.base && set.iter().all(|m| self.leaves_at_least(&without(set, *m), left))
    }

    /// Whether a set takes away nearly all of the misfit of unseen data, and each member most of what is left without it.
    pub(crate) fn takes_nearly_all(&self, set: &[usize]) -> bool {
        self.share(set).is_some_and(|share| share >= NEARLY_ALL)
            && self.at(set).is_some_and(|at| self.each_helps(at))
    }

    /// Whether each member of a set takes away most of what is left without it.
    fn each_helps(&self, at: usize) -> bool {
        let set = &self.all[at].set;
        let Some(left) = self.unseen(at) else { return false };
        set.len() == 1 || set.iter().all(|m| self.leaves_at_least(&without(set, *m), SMALLER * left))
    }

    /// A candidate fitted with a leftover; none where it is no explanation then.
    fn judged(&self, at: usize) -> Option<Judged> {
        self.judged[at].get_or_init(|| self.beside_a_leftover(at)).clone()
    }

    fn beside_a_leftover(&self, at: usize) -> Option<Judged> {
        let (least_squares, misfit) = (&self.least_squares[at].as_ref()?.fit, self.unseen(at)?);
        let of = &self.all[at];
        let (fit, process) = with_leftover(self.problem, &self.rule, &of.selection, least_squares).ok()?;
        let (mut worth, ruled_out) = evidence(self.problem, &of.set, &[], &of.selection, &fit);
        worth += process.log_prior(self.problem);
        // At a bound a mechanism is the limit of another one, or of nothing.
        let bounded = of.selection.added().any(|slot| least_squares.at_bound.contains(&slot));
        let sound = worth.is_finite() && ruled_out.is_none() && !bounded;
        let fit = self.widened(&of.selection, least_squares, fit);
        let candidate =
            Candidate { fit, alternative_modes: Vec::new(), evidence: worth, ruled_out, ..of.clone() };
        let least_squares =
            Candidate { fit: least_squares.clone(), alternative_modes: Vec::new(), ..of.clone() };
        let (share, look) = (1.0 - misfit / self.base, self.look);
        sound.then_some(Judged { candidate, least_squares, process, share, look, misfit })
    }

    /// The least-squares fit with errors that allow for a leftover: those beside the leftover that the residual shows, or, along the parameters' own
    /// effect, where no residual shows it, those of a leftover that has [`DIRECTIONS`] directions open, whichever are larger; and what
    /// the two fits differ by.
    fn widened(&self, selection: &Selection, least_squares: &Fit, beside: Fit) -> Fit {
        let problem = self.problem;
        let fitted = selection.shared.len() + selection.nuisance.len() * problem.rows.len();
        let beyond = (least_squares.chi2 - (self.rough.all_rows(problem) - fitted as f64).max(0.0)).max(0.0);
        let white = covariance(&least_squares.information);
        let mut wide = covariance(&beside.information);
        let n = wide.nrows();
        let factors: Vec<f64> = (0..n)
            .map(|i| ((1.0 + beyond / DIRECTIONS) * white[(i, i)] / wide[(i, i)]).max(1.0).sqrt())
            .collect();
        let moved = |i: usize| beside.shared[selection.shared[i]] - least_squares.shared[selection.shared[i]];
        wide = DMatrix::from_fn(n, n, |i, j| factors[i] * factors[j] * wide[(i, j)] + moved(i) * moved(j));
        let information = match wide.cholesky().map(|factor| factor.inverse()) {
            Some(information) if information.iter().all(|v| v.is_finite()) => information,
            _ => beside.information,
        };
        let (shared, nuisance) = (least_squares.shared.clone(), least_squares.nuisance.clone());
        Fit { information, shared, nuisance, ..beside }
    }

    /// Whether each member is needed beside the leftover that the whole set has: a leftover that may be as large as what the member does
    /// would stand in for it.
    fn needed(&self, at: usize, judged: &Judged) -> bool {
        let whole = &self.all[at];
        let Ok(curves) = Curves::new(self.problem, &judged.candidate.fit) else { return false };
        let with = judged.candidate.evidence - judged.process.log_prior(self.problem);
        whole.set.iter().all(|m| {
            let set = without(&whole.set, *m);
            let near = self.at(&set).and_then(|i| self.least_squares[i].as_ref());
            let Some(LeastSquares { fit: near, .. }) = near else { return true };
            let selection = self.problem.select(&set, &[]);
            let refitted = || -> Result<f64, PredictError> {
                let fit = given(self.problem, &selection, &curves, &judged.process, near)?;
                Ok(evidence(self.problem, &set, &[], &selection, &fit).0)
            };
            refitted().is_ok_and(|alone| with > alone + NEEDED)
        })
    }

    /// Whether each member of a set acts, by Wald's statistic of its strengths.
    fn each_acts(&self, judged: &Judged) -> bool {
        self.each_departs(judged, 2.0 * NEEDED, |_| true)
    }

    /// Whether the sign is known of each strength that may have either. Of one that has a single sign, such as a stop's stiffness, evidence alone
    /// says whether it is there: an error as large as the stiffness is one of a stop that may be harder.
    fn each_sign_known(&self, judged: &Judged) -> bool {
        let table = &self.problem.shared;
        let open =
            |slot: usize| table.lower[slot] < table.start[slot] && table.start[slot] < table.upper[slot];
        self.each_departs(judged, SIZE_KNOWN, open)
    }

    /// Whether Wald's statistic of each member's strengths among those `asked`, against where the member is off and with errors that allow for the
    /// leftover, is above `least`.
    fn each_departs(&self, judged: &Judged, least: f64, asked: impl Fn(usize) -> bool) -> bool {
        let Candidate { set, selection, fit, .. } = &judged.candidate;
        let covariance = covariance(&fit.information);
        let table = &self.problem.shared;
        let departs = |m: &usize| {
            let mechanism = &self.problem.spec().mechanisms[*m];
            let strength = |i: &usize| {
                let slot = selection.shared[*i];
                let parameter = &table.index[slot];
                let of_it = mechanism.parameters.contains(parameter);
                of_it && !mechanism.shape_parameters.contains(parameter) && asked(slot)
            };
            let known = |i: &usize| covariance[(*i, *i)].is_finite();
            let at: Vec<usize> = (0..selection.shared.len()).filter(strength).filter(known).collect();
            let departure = |&i: &usize| fit.shared[selection.shared[i]] - table.start[selection.shared[i]];
            let departure = DVector::from_iterator(at.len(), at.iter().map(departure));
            let of_it = covariance.select_rows(&at).select_columns(&at);
            at.is_empty() || of_it.cholesky().is_none_or(|c| departure.dot(&c.solve(&departure)) > least)
        };
        set.iter().all(departs)
    }

    /// Whether a set of several is likelier than it is without any one member and with a leftover in that one's place.
    fn beats_its_parts(&self, judged: &Judged) -> bool {
        let set = &judged.candidate.set;
        set.len() == 1
            || set.iter().all(|m| {
                let part = self.at(&without(set, *m)).and_then(|i| self.judged(i));
                part.is_none_or(|w| judged.candidate.evidence > w.candidate.evidence + NEEDED)
            })
    }

    /// Sets that lack a member of the chosen one and do as well with a leftover of their own.
    fn rivals(&self, chosen: &Judged) -> Vec<Judged> {
        let set = &chosen.candidate.set;
        let enough = (1.0 - RIVAL_SHARE) * self.base;
        let other = |&i: &usize| {
            let rival = &self.all[i].set;
            rival.len() <= set.len()
                && !rival.is_empty()
                && !rival.iter().all(|m| set.contains(m))
                && self.leaves_at_most(i, enough)
                && self.each_helps(i)
        };
        let others: Vec<usize> = (0..self.all.len()).into_par_iter().filter(other).collect();
        let rivals: Vec<Judged> = others
            .into_par_iter()
            .filter_map(|i| self.judged(i))
            .filter(|j| {
                j.candidate.evidence > chosen.candidate.evidence - NEEDED
                    || j.misfit < RIVAL_MISFIT * chosen.misfit
            })
            .collect();
        // One that only adds to another, or to the chosen one, is no further answer.
        let at_work = |judged: &Judged| self.problem.at_work(&judged.candidate.set);
        let adds = |judged: &Judged| {
            let set = at_work(judged);
            let part = |other: &Judged| {
                let less = at_work(other);
                less.len() < set.len() && less.iter().all(|m| set.contains(m))
            };
            std::iter::once(chosen).chain(&rivals).any(part) && !self.each_acts(judged)
        };
        let mut rivals: Vec<Judged> = rivals.iter().filter(|judged| !adds(judged)).cloned().collect();
        rivals.sort_by(|a, b| b.candidate.evidence.total_cmp(&a.candidate.evidence));
        rivals.truncate(MOST_RIVALS);
        rivals
    }
}
