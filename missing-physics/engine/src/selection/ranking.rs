//! Sets of mechanisms in order: how probable each is, which is preferred, which explain as well, and how they predict what they have
//! not seen.

use rayon::prelude::*;

use crate::adequacy::test::Adequacy;
use crate::model::PredictError;
use crate::problem::Problem;
use crate::selection::candidate::{Candidate, nested};
use crate::selection::held_out::{HeldOut, held_out};

/// Rivals within this log evidence of the best fit equally well (odds of 20 to 1).
const RIVAL_GAP: f64 = 3.0;
/// A richer set must beat an adequate simpler one by this log evidence.
const EARNED: f64 = 3.0;
/// A mechanism less probable than this is not asked how it predicts unseen data, where there are many.
const IMPROBABLE: f64 = 1e-6;
/// Rivals that are told apart by simulation.
const MOST_RIVALS: usize = 6;

/// Candidates, compared.
pub(crate) struct Ranking {
    all: Vec<Candidate>,
    /// The physical ones by falling evidence: where they stand, and how probable each is.
    physical: Vec<(usize, f64)>,
    /// How the baseline predicts what it has not seen, where correlated noise costs it nothing.
    base: HeldOut,
    scores: Vec<Option<HeldOut>>,
}

/// The set that is preferred.
pub(crate) struct Best {
    /// Where it stands.
    pub(crate) at: usize,
    /// p-value of the set's adequacy.
    pub(crate) p_value: f64,
    /// A simpler set that is hardly less likely, doubted but not clearly rejected: where it stands, and its p value.
    pub(crate) doubted: Option<(usize, f64)>,
    /// Sets that are as likely but clearly rejected: where they stand.
    pub(crate) rejected: Vec<usize>,
}

/// At or below this p value a set that has been selected to fit is clearly rejected: a fifth of the level for the baseline.
pub(crate) fn clearly(alpha: f64) -> f64 {
    alpha / 5.0
}

/// How probable each of several sets is, by their log evidence.
pub(crate) fn probabilities(evidence: &[f64]) -> Vec<f64> {
    let most = evidence.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = evidence.iter().map(|e| (e - most).exp()).collect();
    let total: f64 = weights.iter().sum();
    weights.into_iter().map(|w| w / total).collect()
}

impl Ranking {
    pub(crate) fn new(all: Vec<Candidate>, base: HeldOut) -> Self {
        let mut order: Vec<usize> =
            (0..all.len()).filter(|&i| all[i].ruled_out.is_none() && all[i].evidence.is_finite()).collect();
        order.sort_by(|&a, &b| all[b].evidence.total_cmp(&all[a].evidence));
        let evidence: Vec<f64> = order.iter().map(|&i| all[i].evidence).collect();
        let physical = order.into_iter().zip(probabilities(&evidence)).collect();
        Self { all, physical, base, scores: Vec::new() }
    }

    /// The same with some of the candidates alone: those that are `wanted`, in the order of [`Self::all`].
    pub(crate) fn only(self, wanted: &[bool]) -> Self {
        let kept = self.all.into_iter().zip(wanted).filter(|(_, wanted)| **wanted);
        Self::new(kept.map(|(candidate, _)| candidate).collect(), self.base)
    }

    pub(crate) fn all(&self) -> &[Candidate] {
        &self.all
    }

    pub(crate) fn at(&self, at: usize) -> &Candidate {
        &self.all[at]
    }

    pub(crate) fn base(&self) -> &HeldOut {
        &self.base
    }

    /// The physical sets, likeliest first, with their probabilities.
    pub(crate) fn physical(&self) -> impl Iterator<Item = (&Candidate, f64)> {
        self.physical.iter().map(|&(i, probability)| (&self.all[i], probability))
    }

    /// The candidate with just this set.
    pub(crate) fn of(&self, set: &[usize]) -> Option<&Candidate> {
        self.all.iter().find(|c| c.set == set)
    }

    /// How this set predicts what it has not seen, where that was asked.
    pub(crate) fn score_of(&self, set: &[usize]) -> Option<&HeldOut> {
        let at = self.all.iter().position(|c| c.set == set)?;
        self.scores.get(at)?.as_ref()
    }

    /// The likeliest set, or a simpler one that is adequate and hardly less likely. Where the likeliest is clearly rejected, one that
    /// is adequate and hardly less likely takes its place. The baseline has been rejected: it is no candidate any more, however cheap
    /// it is. `test` takes a candidate and the number of a random stream.
    pub(crate) fn best(
        &self,
        alpha: f64,
        test: impl Fn(&Candidate, u64) -> Result<Adequacy, PredictError>,
    ) -> Result<Option<Best>, PredictError> {
        let standing: Vec<usize> =
            self.physical.iter().map(|p| p.0).filter(|&i| !self.all[i].set.is_empty()).collect();
        let Some(&first) = standing.first() else { return Ok(None) };
        let tested = test(&self.all[first], 2)?;
        let (mut at, mut p_value) = (first, tested.p_value);
        let mut rejected = Vec::new();
        if p_value <= clearly(alpha) {
            let near = |i: &&usize| self.all[**i].evidence > self.all[first].evidence - RIVAL_GAP;
            for &other in standing[1..].iter().take_while(near).take(MOST_RIVALS - 1) {
                let p = test(&self.all[other], 4)?.p_value;
                if p > alpha {
                    (at, p_value) = (other, p);
                    rejected.push(first);
                    break;
                }
                if p <= clearly(alpha) {
                    rejected.push(other);
                }
            }
        }
        let mut doubted = None;
        while let Some(&simpler) = standing.iter().find(|&&i| self.simpler(i, at) && !rejected.contains(&i)) {
            let p = test(&self.all[simpler], 3)?.p_value;
            if p <= alpha && p < p_value {
                doubted = (p > clearly(alpha)).then_some((simpler, p));
                break;
            }
            (at, p_value) = (simpler, p);
        }
        Ok(Some(Best { at, p_value, doubted, rejected }))
    }

    /// Is one a part of the other with fewer unknowns, and hardly less likely?
    fn simpler(&self, small: usize, large: usize) -> bool {
        let [small, large] = [small, large].map(|i| &self.all[i]);
        let unknowns = |c: &Candidate| c.selection.shared.len() + c.selection.nuisance.len();
        unknowns(small) < unknowns(large) && nested(small, large) && small.evidence > large.evidence - EARNED
    }

    /// Lets the single mechanisms and the preferred set predict what they have not seen; of a model that knows many, those that are
    /// probable or in that set.
    pub(crate) fn score(&mut self, problem: &Problem<'_>, best: Option<&Best>) {
        let chosen = best.map(|b| &self.all[b.at].set);
        let probable = |i: usize| {
            let in_chosen = chosen.is_some_and(|chosen| self.all[i].set.iter().all(|m| chosen.contains(m)));
            in_chosen || self.physical.iter().any(|&(k, probability)| k == i && probability > IMPROBABLE)
        };
        let single = |i: usize| self.all[i].set.len() <= 1 && (!problem.knows_many() || probable(i));
        let wanted =
            |i: usize| (single(i) || best.is_some_and(|b| b.at == i)) && self.all[i].evidence.is_finite();
        self.scores = (0..self.all.len())
            .into_par_iter()
            .map(|i| if wanted(i) { held_out(problem, &self.all[i]).ok() } else { None })
            .collect();
    }

    /// By how much it predicts what it has not seen better than the baseline by the same rule of noise, as a log score.
    pub(crate) fn gain(&self, set: &[usize]) -> Option<f64> {
        let baseline = self.score_of(&[]).unwrap_or(&self.base);
        self.score_of(set).map(|s| s.log_score - baseline.log_score)
    }

    /// Does it predict what it has not seen better than the baseline? One that may take its own misfit for correlated noise, which costs
    /// those that compete, is the harder measure; what is likelier by [`EARNED`] is spared it.
    pub(crate) fn gains(&self, at: usize) -> bool {
        let set = &self.all[at].set;
        let likelier = self.of(&[]).is_none_or(|none| self.all[at].evidence > none.evidence + EARNED);
        self.score_of(set).is_some_and(|s| s.log_score > self.base.log_score)
            || likelier && self.gain(set).is_some_and(|gain| gain > 0.0)
    }

    /// Where sets stand that hold all of one and more, and are hardly less likely: the likeliest first.
    pub(crate) fn as_likely_with_more(&self, at: usize) -> impl Iterator<Item = usize> {
        let less = &self.all[at];
        self.physical.iter().map(|p| p.0).filter(move |&i| {
            let more = &self.all[i];
            more.set.len() > less.set.len() && nested(less, more) && more.evidence > less.evidence - RIVAL_GAP
        })
    }

    /// The chosen set, a simpler one that is only doubted, and those that explain as well and are no more, and no less, of the same.
    pub(crate) fn rivals(&self, best: &Best) -> Vec<&Candidate> {
        let chosen = self.at(best.at);
        let as_well = |c: &&Candidate| {
            c.set != chosen.set
                && !c.set.is_empty()
                && c.evidence > chosen.evidence - RIVAL_GAP
                && !nested(chosen, c)
                && !nested(c, chosen)
        };
        let standing = self.physical.iter().filter(|p| !best.rejected.contains(&p.0)).map(|p| &self.all[p.0]);
        let all: Vec<&Candidate> = std::iter::once(chosen).chain(standing.filter(as_well)).collect();
        // One that only adds to another is no further answer.
        let adds = |c: &Candidate| {
            all.iter().any(|o| o.set != c.set && nested(o, c) && o.evidence > c.evidence - EARNED)
        };
        let mut rivals: Vec<&Candidate> = all.iter().copied().filter(|c| !adds(c)).collect();
        rivals.splice(1..1, best.doubted.map(|(at, _)| self.at(at)));
        rivals.truncate(MOST_RIVALS);
        rivals
    }
}
