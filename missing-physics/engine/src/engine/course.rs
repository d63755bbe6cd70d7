//! The way from a fitted baseline to an answer.

use crate::adequacy::test::{self, Adequacy};
use crate::answer::Answer;
use crate::diagnosis::{ChannelFit, Confusion, Diagnosis, Verdict};
use crate::engine::begin::{Begun, rough_sigmas};
use crate::engine::input::{DiagnoseError, Options};
use crate::experiment;
use crate::fit::prediction::predictions;
use crate::law::search::find;
use crate::locate::locations::locate;
use crate::model::{Experiment, PredictError};
use crate::observer::{Observer, Progress};
use crate::selection::candidate::{Candidate, candidate};
use crate::selection::confusion::confusion;
use crate::selection::held_out::{HeldOut, held_out};
use crate::selection::ranking::{Best, Ranking, clearly};
use crate::selection::search::search;

/// Tells the observer of a step; an error where it stops the work.
pub(super) fn tell(observer: &dyn Observer, stage: &str, done: f64) -> Result<(), DiagnoseError> {
    if observer.progress(Progress { stage, done }) { Ok(()) } else { Err(DiagnoseError::Stopped) }
}

/// The way from a fitted baseline to an answer.
pub(super) struct Course<'a> {
    pub(super) begun: &'a Begun<'a>,
    pub(super) least_squares: &'a Candidate,
    pub(super) experiments: &'a [Experiment],
    pub(super) options: &'a Options,
    pub(super) observer: &'a dyn Observer,
}

impl Course<'_> {
    fn tell(&self, stage: &str, done: f64) -> Result<(), DiagnoseError> {
        tell(self.observer, stage, done)
    }

    /// Is a candidate adequate?
    fn test(&self, candidate: &Candidate, stream: u64) -> Result<Adequacy, PredictError> {
        let Begun { problem, rule, .. } = self.begun;
        let rivals: Vec<usize> =
            (0..problem.spec().mechanisms.len()).filter(|m| !candidate.set.contains(m)).collect();
        let seed = self.options.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ stream;
        let replicates = self.options.replicates;
        test::test(problem, &candidate.selection, &candidate.fit, &rivals, rule, replicates, seed)
    }

    /// The whole way.
    pub(super) fn run(&self) -> Result<Diagnosis, DiagnoseError> {
        let Begun { problem, rule, baseline, .. } = self.begun;
        self.tell("adequacy of the baseline", 0.0)?;
        let adequacy = self.test(baseline, 1)?;
        self.tell("adequacy of the baseline", 1.0)?;
        let answer = Answer {
            problem,
            rule,
            baseline,
            least_squares: &self.least_squares.fit,
            outliers: &self.begun.outliers,
        };
        if adequacy.p_value > self.options.alpha {
            return Ok(answer.skeleton(&adequacy, Verdict::Adequate, baseline, self.before(&answer)?)?);
        }
        let mut ranking = self.compare()?;
        self.tell("adequacy of the best explanation", 0.0)?;
        let best = ranking.best(self.options.alpha, |c, stream| self.test(c, stream))?;
        self.tell("predicting unseen data", 0.0)?;
        ranking.score(problem, best.as_ref());
        // The chosen set has been selected to fit: only a clear failure speaks against it.
        let fails = |best: &Best| best.p_value <= clearly(self.options.alpha);
        let explained = best.as_ref().filter(|b| !fails(b) && ranking.gains(b.at));

        let ended_with = explained.map_or(baseline, |b| ranking.at(b.at));
        let mut diagnosis =
            answer.skeleton(&adequacy, Verdict::Unexplained, ended_with, self.before(&answer)?)?;
        diagnosis.mechanisms = answer.mechanisms(&ranking, best.as_ref());
        diagnosis.sets = answer.sets(&ranking, best.as_ref());
        let sigma = match explained {
            Some(_) => ended_with.fit.noise.sigma.clone(),
            None => rough_sigmas(problem, rule, &baseline.fit),
        };
        diagnosis.location = locate(problem, &baseline.selection, &self.least_squares.fit, &sigma)?;
        if let Some(chosen) = explained {
            diagnosis.final_p_value = Some(chosen.p_value);
            self.explained(&mut diagnosis, &answer, &ranking, chosen)?;
        } else {
            if let Some(closest) = &best {
                diagnosis.remarks.push(answer.closest(&ranking, closest, fails(closest)));
            }
            self.unexplained(&mut diagnosis, &answer, ranking.base())?;
        }
        self.tell("done", 1.0)?;
        Ok(diagnosis)
    }

    /// Errors of the plain simulation.
    fn before(&self, answer: &Answer<'_>) -> Result<Vec<ChannelFit>, PredictError> {
        answer.errors(&self.least_squares.fit, &held_out(&self.begun.problem, self.least_squares)?)
    }

    /// Every set of mechanisms worth looking at, fitted.
    fn compare(&self) -> Result<Ranking, DiagnoseError> {
        const STAGE: &str = "comparing mechanisms";
        let Begun { problem, rule, baseline, .. } = self.begun;
        self.tell(STAGE, 0.0)?;
        let competing = rule.competing();
        let among = candidate(problem, &competing, &[], &[], &baseline.fit, &[])?;
        let everything: Vec<usize> = (0..problem.spec().mechanisms.len()).collect();
        let progress = |done| self.observer.progress(Progress { stage: STAGE, done });
        let all = search(problem, &competing, among, &everything, &progress).ok_or(DiagnoseError::Stopped)?;
        Ok(Ranking::new(all, held_out(problem, baseline)?))
    }

    /// A set explains the data: does another as well, and what would tell them apart?
    fn explained(
        &self,
        diagnosis: &mut Diagnosis,
        answer: &Answer<'_>,
        ranking: &Ranking,
        best: &Best,
    ) -> Result<(), DiagnoseError> {
        let problem = &self.begun.problem;
        let chosen = ranking.at(best.at);
        diagnosis.chosen = answer.ids(&chosen.set);
        let after = predictions(problem, &chosen.fit)?;
        if let Some(score) = ranking.score_of(&chosen.set) {
            diagnosis.after = answer.errors_of(&after, score);
        }
        draw(diagnosis, &after);
        diagnosis.undetermined.extend(answer.open_numbers(chosen));
        self.tell("telling the rivals apart", 0.0)?;
        let rivals = ranking.rivals(best);
        if rivals.len() == 1 {
            diagnosis.verdict = Verdict::Explained;
            return Ok(());
        }
        diagnosis.verdict = Verdict::Ambiguous;
        let mut sets: Vec<Vec<String>> = rivals.iter().map(|c| answer.ids(&c.set)).collect();
        let matrix = confusion(problem, &self.begun.rule.competing(), &rivals, 100, self.options.seed)?;
        diagnosis.confusion = Some(Confusion { sets: sets.clone(), matrix });
        diagnosis.confused_with = sets.split_off(1);
        self.tell("choosing the next experiment", 0.0)?;
        diagnosis.next_experiment = experiment::best(problem, &rivals, self.experiments);
        let names: Vec<String> = rivals.iter().map(|c| answer.names(&c.set)).collect();
        diagnosis.undetermined.push(format!("{} cannot be told apart in these data", listed(&names)));
        if let Some((simpler, p_value)) = best.doubted {
            let names = answer.names(&ranking.at(simpler).set);
            diagnosis
                .undetermined
                .push(format!("{names} alone is hardly less likely and fits doubtfully (p = {p_value})"));
        }
        if diagnosis.next_experiment.is_none() {
            diagnosis.undetermined.push("no experiment in the rig's range would separate them".into());
        }
        Ok(())
    }

    /// Nothing on the list explains the data: is there a law in what is left?
    fn unexplained(
        &self,
        diagnosis: &mut Diagnosis,
        answer: &Answer<'_>,
        base: &HeldOut,
    ) -> Result<(), DiagnoseError> {
        let Begun { problem, rule, baseline, .. } = self.begun;
        self.tell("looking for a law in the residual", 0.0)?;
        if let Some(found) = find(problem, &rule.competing(), baseline, base)? {
            diagnosis.after = answer.errors_of(&found.predictions, &found.held_out);
            draw(diagnosis, &found.predictions);
            diagnosis.noise = answer.noise(&found.fit);
            diagnosis.law = Some(found.law);
        }
        Ok(())
    }
}

/// Puts what a fit predicts into the curves.
fn draw(diagnosis: &mut Diagnosis, predictions: &[Vec<Vec<f64>>]) {
    for (curves, after) in diagnosis.curves.iter_mut().zip(predictions) {
        curves.after.clone_from(after);
    }
}

fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} and {last}", most.join(", ")),
    }
}
