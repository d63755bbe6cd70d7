//! What differs from run to run without anyone wanting it: no mechanism, and left over by those that have names.

use crate::adequacy::test::Adequacy;
use crate::answer::Answer;
use crate::diagnosis::{ChannelFit, Diagnosis, Verdict};
use crate::engine::course::{Compared, Course, draw};
use crate::engine::input::DiagnoseError;
use crate::fit::prediction::predictions;
use crate::locate::locations::locate;
use crate::model::{FEWEST_RUNS_THAT_DIFFER, PredictError};
use crate::selection::candidate::Candidate;
use crate::selection::main_cause::Judge;
use crate::selection::ranking::{Best, Ranking, clearly};

/// Mechanisms that are said to be open beside what differs from run to run.
const MOST_OPEN: usize = 3;

impl Course<'_> {
    /// What is asked for, and what may differ from run to run where there are enough runs to say so.
    pub(super) fn wanted(&self) -> Vec<usize> {
        let problem = &self.begun.problem;
        let mut wanted = problem.spec().asked();
        if problem.rows.len() >= FEWEST_RUNS_THAT_DIFFER {
            wanted.extend(problem.spec().between_runs());
        }
        wanted
    }

    /// Whether a set takes the runs for alike.
    pub(super) fn alike(&self, candidate: &Candidate) -> bool {
        let mechanisms = &self.begun.problem.spec().mechanisms;
        candidate.set.iter().all(|&m| !mechanisms[m].between_runs)
    }

    /// A set explains the data with something that differs from run to run: that is left over by those of its members that have names.
    pub(super) fn runs_that_differ(
        &self,
        answer: &Answer<'_>,
        adequacy: &Adequacy,
        before: Vec<ChannelFit>,
        Compared { ranking, rough, .. }: &Compared,
        chosen: &Best,
        judge: &Judge<'_>,
    ) -> Result<Diagnosis, DiagnoseError> {
        let problem = &self.begun.problem;
        let whole = ranking.at(chosen.at);
        let (differing, named): (Vec<usize>, Vec<usize>) =
            whole.set.iter().partition(|&&m| problem.spec().mechanisms[m].between_runs);
        let verdict = if named.is_empty() { Verdict::Unexplained } else { Verdict::Partly };
        let mut diagnosis = answer.skeleton(adequacy, verdict, whole, before)?;
        diagnosis.mechanisms = answer.mechanisms(ranking, Some(chosen))?;
        let after = predictions(problem, &whole.fit)?;
        if let Some(score) = ranking.score_of(&whole.set) {
            diagnosis.after = answer.errors_of(&after, score);
        }
        draw(&mut diagnosis, &after);
        diagnosis.run_differences =
            differing.iter().flat_map(|&m| answer.run_differences(whole, m)).collect();
        if named.is_empty() {
            let open = |more: usize| {
                let more = ranking.at(more).set.iter().copied();
                let named: Vec<usize> = more.filter(|m| !differing.contains(m)).collect();
                format!("whether {} acts as well cannot be told beside that", answer.names(&named))
            };
            diagnosis.undetermined.extend(ranking.as_likely_with_more(chosen.at).take(MOST_OPEN).map(open));
            return Ok(diagnosis);
        }
        diagnosis.chosen = answer.ids(&named);
        diagnosis.explained_share = judge.share_beside(&whole.set, &differing);
        if let Some(alone) = ranking.of(&named) {
            let fit = judge.least_squares(&named).unwrap_or(&alone.fit);
            diagnosis.leftover = locate(problem, &alone.selection, fit, rough)?;
        }
        if ranking.of(&differing).is_some_and(|alone| alone.evidence > whole.evidence) {
            let names = answer.names(&differing);
            diagnosis
                .undetermined
                .push(format!("{names}, by much the same in all runs, would do as well alone"));
        }
        let rivals = ranking.rivals(chosen).into_iter().filter(|rival| self.scatters(rival));
        let rivals = rivals.map(|rival| answer.ids(&rival.set));
        for rival in rivals.filter(|rival| !rival.is_empty()) {
            if rival != diagnosis.chosen && !diagnosis.confused_with.contains(&rival) {
                diagnosis.confused_with.push(rival);
            }
        }
        Ok(diagnosis)
    }

    /// The preferred set; in its place one with a mechanism more that is hardly less likely, where what differs from run to run would be much
    /// the same in all runs: that is no difference.
    pub(super) fn around_nothing(&self, ranking: &Ranking, best: Best) -> Result<Best, PredictError> {
        if self.scatters(ranking.at(best.at)) {
            return Ok(best);
        }
        let mut more = ranking.as_likely_with_more(best.at);
        let Some(at) = more.find(|&at| self.scatters(ranking.at(at))) else { return Ok(best) };
        let p_value = self.test(ranking.at(at), 3)?.p_value;
        let holds = p_value > clearly(self.options.alpha);
        Ok(if holds { Best { at, p_value, doubted: None, ..best } } else { best })
    }

    /// Whether what differs from run to run scatters about nothing, where a set has such a thing.
    fn scatters(&self, candidate: &Candidate) -> bool {
        /// Mean in standard deviations: that of what leaks away steadily is at most 1.7, of what changes after the first of five runs 2.
        const LOPSIDED: f64 = 3.0;
        let problem = &self.begun.problem;
        let mechanisms = candidate.set.iter().map(|&m| &problem.spec().mechanisms[m]);
        let mut parameters = mechanisms.filter(|m| m.between_runs).flat_map(|m| &m.parameters);
        parameters.all(|&p| {
            let values = candidate.fit.nuisance.iter().map(|run| run[problem.slots[p]]);
            let runs = problem.rows.len() as f64;
            let mean = values.clone().sum::<f64>() / runs;
            let variance = values.map(|v| (v - mean).powi(2)).sum::<f64>() / runs;
            mean * mean <= LOPSIDED * LOPSIDED * variance
        })
    }
}
