//! What compared sets of mechanisms say of the data.

use crate::adequacy::outliers::Place;
use crate::adequacy::test::p_floor;
use crate::answer::Answer;
use crate::engine::begin::Begun;
use crate::engine::course::{Compared, Conclusion, Course};
use crate::engine::input::DiagnoseError;
use crate::engine::local::BesideLocal;
use crate::model::PredictError;
use crate::noise::rough::RoughNoise;
use crate::selection::candidate::{Candidate, nested};
use crate::selection::main_cause::{Judge, Judged, MainCause};
use crate::selection::ranking::{Best, Ranking, clearly};
use crate::selection::share::Cut;

impl Course<'_> {
    /// What the sets say: one that explains the data, a main cause beside a leftover or beside a cause in a part of the data, or neither.
    pub(super) fn conclusion<'c>(&'c self, compared: &'c Compared) -> Result<Conclusion<'c>, DiagnoseError> {
        let Begun { problem, rule, baseline, .. } = self.begun;
        let Compared { ranking, best, white, rough, .. } = compared;
        let all = ranking.all();
        let explained = self.explains(ranking, best.as_ref());
        let sound = explained.and_then(|best| self.sound(ranking, ranking.at(best.at), (white, rough)));
        let (judge, cause) = match sound {
            // What explains the data doubtfully is weighed against less of it beside a leftover.
            Some(judge) => {
                (judge, explained.and_then(|best| self.less_beside_a_leftover(ranking, best, rough)))
            }
            None => {
                self.tell("what the closest explanation leaves", 0.0)?;
                let judge = Judge::new(problem, rule, all, rough, |c| self.alike(c)).against_noise();
                let cause = judge.main_cause();
                (judge, cause)
            }
        };
        if cause.is_none() && explained.is_none() {
            if let Some((judge, best)) = self.differing_runs(compared) {
                return Ok(Conclusion { judge, near: None, cause, explained: Some(best), replaced: None });
            }
            let near = judge.near();
            let beside = BesideLocal { problem, baseline, all, judge: &judge, noise: rough };
            let cause = beside.main_cause()?.or_else(|| near.as_ref()?.main_cause());
            return Ok(Conclusion { judge, near, cause, explained, replaced: None });
        }
        // What takes away nearly all of the misfit has something beside it, which an interval may well fit as well; but so may noise that
        // accumulates.
        let chosen = explained.map(|best| ranking.at(best.at));
        let chosen = chosen.filter(|chosen| cause.is_none() && !chosen.accumulates(problem));
        let beside = BesideLocal { problem, baseline, all, judge: &judge, noise: rough };
        let members = chosen.map(|set| beside.members(set)).transpose()?.flatten();
        let Some(members) = members else {
            return Ok(Conclusion { judge, near: None, cause, explained, replaced: None });
        };
        let judge = Judge::new(problem, rule, all, rough, |c| c.set.len() <= members && self.alike(c));
        let beside = BesideLocal { problem, baseline, all, judge: &judge, noise: rough };
        let cause = beside.main_cause()?.or_else(|| judge.main_cause());
        Ok(Conclusion { judge, near: None, cause, explained: None, replaced: chosen })
    }

    /// The preferred set, where something in it differs from run to run and it takes away nearly all, each member most of what is left without
    /// it; with a judge of its parts.
    fn differing_runs<'c>(&'c self, compared: &'c Compared) -> Option<(Judge<'c>, &'c Best)> {
        let Compared { ranking, best, rough, .. } = compared;
        let best = best.as_ref()?;
        // What is rejected as clearly as can be is another thing, which differing runs and a mechanism imitate.
        if best.p_value <= (0.1 * clearly(self.options.alpha)).max(1.5 * p_floor(self.options.replicates)) {
            return None;
        }
        let chosen = ranking.at(best.at);
        let judge = (!self.alike(chosen)).then(|| self.judge_of_parts(ranking, chosen, rough))?;
        judge.takes_nearly_all(&chosen.set).then_some((judge, best))
    }

    /// A judge of a set's parts.
    fn judge_of_parts<'c>(
        &'c self,
        ranking: &'c Ranking,
        whole: &Candidate,
        rough: &RoughNoise,
    ) -> Judge<'c> {
        let part = |c: &Candidate| c.set.iter().all(|m| whole.set.contains(m));
        Judge::new(&self.begun.problem, &self.begun.rule, ranking.all(), rough, part)
    }

    /// A judge of a set's parts, where the set holds: noise that is correlated as long as the runs are is no noise, and a member without
    /// which unseen data are predicted better is imitating something else.
    pub(super) fn sound<'c>(
        &'c self,
        ranking: &'c Ranking,
        chosen: &Candidate,
        (white, rough): (&[f64], &RoughNoise),
    ) -> Option<Judge<'c>> {
        let judge = || self.judge_of_parts(ranking, chosen, rough);
        (!chosen.slow(&self.begun.problem, white)).then(judge).filter(|j| j.holds(&chosen.set))
    }

    /// Where a set explains the data doubtfully: the main cause, if that lacks some of its members, since these take away too little of
    /// what is left without them; or is that set, where it has derivatives.
    fn less_beside_a_leftover(
        &self,
        ranking: &Ranking,
        best: &Best,
        rough: &RoughNoise,
    ) -> Option<MainCause> {
        let Begun { problem, rule, .. } = self.begun;
        let chosen = ranking.at(best.at);
        if best.p_value > self.options.alpha {
            return None;
        }
        // Beside a leftover intervals follow from derivatives, which a threshold between two jumps has not.
        let modes = problem.model.extensions().modes;
        let smooth =
            chosen.selection.added().all(|slot| modes.is_none_or(|modes| modes.jumps(slot).is_empty()));
        let cause = Judge::new(problem, rule, ranking.all(), rough, |c| self.alike(c)).main_cause();
        cause.filter(|cause| {
            let less = &cause.chosen.candidate;
            less.set.len() < chosen.set.len() && nested(less, chosen) || smooth && less.set == chosen.set
        })
    }

    /// Readings that were set aside, and that a conclusion's fit of all others foretells.
    pub(super) fn foretold(
        &self,
        compared: &Compared,
        conclusion: &Conclusion<'_>,
    ) -> Result<Vec<Place>, PredictError> {
        let explained = || conclusion.explained.map(|best| compared.ranking.at(best.at));
        let by = conclusion.cause.as_ref().map(|cause| &cause.chosen.candidate).or_else(explained);
        by.map_or_else(|| Ok(Vec::new()), |by| self.begun.foretold(&by.fit))
    }

    /// What is said of a main cause that was found by pieces of a single run, where whole fifths left out show less of it.
    pub(super) fn seen_near_by(answer: &Answer<'_>, judge: &Judge<'_>, cause: &MainCause) -> Option<String> {
        let Judged { candidate, look, .. } = &cause.chosen;
        let far = judge.share(&candidate.set).filter(|_| look.cut == Cut::Hundredths)?;
        Some(format!(
            "{}: named by hundredths of the run, every fifth of them left out; of whole fifths left out, where what dies away lies in one of \
             them, {:.0} % of the misfit",
            answer.names(&candidate.set),
            (100.0 * far).floor()
        ))
    }
}
