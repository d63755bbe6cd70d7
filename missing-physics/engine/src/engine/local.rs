//! Whether the data speak for a cause that acts in a part of them only, rather than for mechanisms, which act everywhere.

use statrs::function::factorial::ln_binomial;

use crate::locate::locations::local_cause;
use crate::model::PredictError;
use crate::noise::rough::RoughNoise;
use crate::problem::Problem;
use crate::selection::candidate::Candidate;
use crate::selection::main_cause::{Judge, MainCause, SMALLER};

/// Twice the log Bayes factor from which on a local cause is preferred (Kass and Raftery 1995, doi:10.1080/01621459.1995.10476572, "very
/// strong").
const CLEAR: f64 = 10.0;

/// Sets beside which a local cause is sought: the smallest first, and of one size those that leave least.
const CLOSE: usize = 12;

/// Sets of mechanisms with the best single cause that acts within an interval, or in some runs, beside them.
///
/// All are judged by what they leave in units of the noise, less Schwarz's price of each size that is fitted and the logarithm of the number
/// of hypotheses of its kind. What is left beyond noise is noise of its size as well: it counts by its logarithm.
pub(super) struct BesideLocal<'a> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) baseline: &'a Candidate,
    pub(super) all: &'a [Candidate],
    pub(super) judge: &'a Judge<'a>,
    pub(super) noise: &'a RoughNoise,
}

/// A set, and what it leaves with a local cause beside it.
struct Weighed {
    at: usize,
    /// The price included.
    left: f64,
    /// What the set leaves beyond noise alone is so many times larger.
    smaller: f64,
}

impl BesideLocal<'_> {
    fn rows(&self) -> f64 {
        self.noise.all_rows(self.problem)
    }

    fn counted(&self, squares: f64) -> f64 {
        let rows = self.rows();
        if squares > rows { rows * (1.0 + (squares / rows).ln()) } else { squares }
    }

    fn price(&self, candidate: &Candidate) -> f64 {
        let sizes = candidate.selection.shared.len().saturating_sub(self.baseline.selection.shared.len());
        let mechanisms = self.problem.spec().mechanisms.len() as u64;
        sizes as f64 * self.rows().ln() + 2.0 * ln_binomial(mechanisms, candidate.set.len() as u64)
    }

    /// A set with its best local cause; `None` where there is none.
    fn weighed(&self, at: usize) -> Result<Option<Weighed>, PredictError> {
        let set = &self.all[at];
        let Some(fit) = self.judge.least_squares(&set.set) else { return Ok(None) };
        let local = local_cause(self.problem, &set.selection, fit, &self.noise.slow())?;
        Ok(local.map(|local| {
            let after = (fit.chi2 - local.gain).max(1.0);
            let beyond = |squares: f64| (squares - self.rows()).max(0.0);
            let smaller = beyond(fit.chi2) / beyond(after);
            Weighed { at, left: self.counted(after) + self.price(set) + local.price, smaller }
        }))
    }

    fn parts(&self, set: &[usize]) -> impl Iterator<Item = usize> {
        (0..self.all.len()).filter(move |&i| {
            let part = &self.all[i].set;
            part.len() < set.len() && part.iter().all(|m| set.contains(m))
        })
    }

    /// How many members of a set are left, where one unknown more that acts within an interval, or in some runs, takes away clearly more beside
    /// those than the others do; `None` where none does.
    pub(super) fn members(&self, set: &Candidate) -> Result<Option<usize>, PredictError> {
        let Some(fit) = self.judge.least_squares(&set.set) else { return Ok(None) };
        let most = self.counted(fit.chi2) + self.price(set) - CLEAR;
        let parts: Vec<Weighed> =
            self.parts(&set.set).filter_map(|at| self.weighed(at).transpose()).collect::<Result<_, _>>()?;
        let best = parts.iter().filter(|w| w.left < most).min_by(|a, b| a.left.total_cmp(&b.left));
        Ok(best.map(|w| self.all[w.at].set.len()))
    }

    /// The part of a set that leaves least, of those whose every member acts with errors that allow for what is left: one that does not may be
    /// imitating that.
    fn acting_part(&self, set: &[usize], close: &[usize]) -> Option<usize> {
        let part = |&at: &usize| {
            let part = &self.all[at].set;
            part.len() < set.len() && part.iter().all(|m| set.contains(m)) && self.acts(at)
        };
        let left =
            |at: usize| self.judge.least_squares(&self.all[at].set).map_or(f64::INFINITY, |fit| fit.chi2);
        close.iter().copied().filter(part).min_by(|&a, &b| left(a).total_cmp(&left(b)))
    }

    /// Whether each member of a set of several acts beside what is left.
    fn acts(&self, at: usize) -> bool {
        self.all[at].set.len() < 2 || self.judge.acts(at)
    }

    /// The main cause where what it leaves is a cause in a part of the data: each member of the set is clearly needed beside that.
    ///
    /// Such a cause drags the estimates of all runs in which it acts, so that the share that is asked for is of the data that are fitted. Of
    /// a single run nothing is said: no other shows what holds without the local cause.
    pub(super) fn main_cause(&self) -> Result<Option<MainCause>, PredictError> {
        if self.problem.rows.len() < 2 {
            return Ok(None);
        }
        let close: Vec<usize> = self.judge.nearly_all(CLOSE);
        let weigh = |at: usize| self.weighed(at).transpose();
        let weighed: Vec<Weighed> = close.iter().copied().filter_map(weigh).collect::<Result<_, _>>()?;
        let Some(mut chosen) = weighed.iter().min_by(|a, b| a.left.total_cmp(&b.left)) else {
            return Ok(None);
        };
        // Of sets that are nearly as likely, the smallest that is a part of the likeliest.
        let likeliest = &self.all[chosen.at].set;
        for w in &weighed {
            let set = &self.all[w.at].set;
            let smaller =
                set.len() < self.all[chosen.at].set.len() && set.iter().all(|m| likeliest.contains(m));
            if smaller && w.left < chosen.left + CLEAR {
                chosen = w;
            }
        }
        // Where the baseline leaves hardly more than noise, a part of it is taken away by many a pair.
        if self
            .judge
            .least_squares(&[])
            .is_some_and(|nothing| self.counted(nothing.chi2) < chosen.left + CLEAR)
        {
            return Ok(None);
        }
        // What a local cause does not take away most of has another reason; and what predicts runs left out worse than nothing does is at work in none.
        let worse = self.judge.share(&self.all[chosen.at].set).is_none_or(|share| share <= 0.0);
        if chosen.smaller < SMALLER || worse {
            return Ok(None);
        }
        if !self.acts(chosen.at) {
            let part = self.acting_part(&self.all[chosen.at].set, &close);
            return Ok(part.and_then(|at| self.judge.named(at, &[])));
        }
        let as_likely = |w: &Weighed| w.left < chosen.left + CLEAR;
        for part in self.parts(&self.all[chosen.at].set) {
            let needless = match weighed.iter().find(|w| w.at == part) {
                Some(known) => as_likely(known),
                None => self.weighed(part)?.as_ref().is_some_and(as_likely),
            };
            if needless {
                return Ok(None);
            }
        }
        let members = self.all[chosen.at].set.len();
        let rivals: Vec<usize> = (weighed.iter())
            .filter(|w| w.at != chosen.at && self.all[w.at].set.len() <= members && as_likely(w))
            .map(|w| w.at)
            .collect();
        Ok(self.judge.named(chosen.at, &rivals))
    }
}
