//! The way from a fitted baseline to an answer.

use crate::adequacy::outliers::Place;
use crate::adequacy::test::{self, Adequacy};
use crate::answer::Answer;
use crate::diagnosis::{ChannelFit, Confusion, Diagnosis, Law, Verdict, listed};
use crate::engine::begin::{Begun, rough_sigmas};
use crate::engine::input::{DiagnoseError, Options};
use crate::estimate::limits::limits;
use crate::experiment;
use crate::fit::prediction::{predictions, residuals};
use crate::law::found::{Found, LEAST_GAIN, improves};
use crate::law::search::find;
use crate::law::sparse::{selected, sparse};
use crate::locate::locations::locate;
use crate::model::{Experiment, PredictError};
use crate::noise::rough::RoughNoise;
use crate::observer::{Observer, Progress};
use crate::problem::Problem;
use crate::runs::contradicting::{Contradicting, contradicting};
use crate::selection::candidate::{Candidate, candidate};
use crate::selection::confusion::confusion;
use crate::selection::held_out::held_out;
use crate::selection::main_cause::{Judge, MainCause};
use crate::selection::ranking::{Best, Ranking, clearly};
use crate::selection::search::{Searched, search};

/// The random numbers of a law's test.
const OF_LAW: u64 = 1 << 32;

/// Tells the observer of a step; an error where it stops the work.
pub(super) fn tell(observer: &dyn Observer, stage: &str, done: f64) -> Result<(), DiagnoseError> {
    if observer.progress(Progress { stage, done }) { Ok(()) } else { Err(DiagnoseError::Stopped) }
}

/// An answer, and runs that contradict the others by it.
pub(super) struct Outcome {
    pub(super) diagnosis: Diagnosis,
    pub(super) contradicting: Option<Contradicting>,
}

/// Where a course ends.
pub(super) enum End {
    Answer(Box<Outcome>),
    /// Before the answer is put together, at readings that were set aside and that its fit of all others foretells.
    Foretold(Vec<Place>),
}

/// Sets of mechanisms, compared.
pub(super) struct Compared {
    pub(super) ranking: Ranking,
    /// Mechanisms that could not be fitted, with the reason.
    unfitted: Vec<(usize, PredictError)>,
    pub(super) best: Option<Best>,
    /// Sigmas of the white noise, by channel.
    pub(super) white: Vec<f64>,
    /// The noise beside which sets are judged: white, or with a correlation over a few rows.
    pub(super) rough: RoughNoise,
}

/// What sets of mechanisms say of the data.
pub(super) struct Conclusion<'a> {
    pub(super) judge: Judge<'a>,
    /// A judge of a single run by data close to those seen, where the other names nothing.
    pub(super) near: Option<Judge<'a>>,
    pub(super) cause: Option<MainCause>,
    pub(super) explained: Option<&'a Best>,
    /// What would explain the data, where less of it beside a cause in a part of them says clearly more.
    pub(super) replaced: Option<&'a Candidate>,
}

/// The way from a fitted baseline to an answer.
pub(super) struct Course<'a> {
    pub(super) begun: &'a Begun<'a>,
    pub(super) least_squares: &'a Candidate,
    pub(super) experiments: &'a [Experiment],
    pub(super) options: &'a Options,
    pub(super) observer: &'a dyn Observer,
    /// Whether the recording may be diagnosed again with readings that were set aside.
    pub(super) may_keep: bool,
}

impl Course<'_> {
    pub(super) fn tell(&self, stage: &str, done: f64) -> Result<(), DiagnoseError> {
        tell(self.observer, stage, done)
    }

    /// Is a candidate adequate?
    pub(super) fn test(&self, candidate: &Candidate, stream: u64) -> Result<Adequacy, PredictError> {
        let Begun { problem, rule, .. } = self.begun;
        let mut rivals = problem.spec().asked();
        rivals.retain(|m| !candidate.set.contains(m));
        let seed = self.options.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ stream;
        let replicates = self.options.replicates;
        test::test(problem, &candidate.selection, &candidate.fit, &rivals, rule, replicates, seed)
    }

    /// Sigmas of the white noise, and the noise on the scale of a few rows. Runs too short to show theirs have that of the likeliest fit: that of
    /// the baseline would be its misfit.
    fn small_scale_noise(&self, ranking: &Ranking) -> Result<(Vec<f64>, RoughNoise), DiagnoseError> {
        let Begun { problem, rule, baseline, .. } = self.begun;
        let sound = ranking.all().iter().filter(|c| c.ruled_out.is_none());
        let likeliest = sound.max_by(|a, b| a.evidence.total_cmp(&b.evidence)).unwrap_or(baseline);
        let white = rough_sigmas(problem, rule, &likeliest.fit);
        let rough = RoughNoise::new(problem, rule, &likeliest.fit, &white)?;
        Ok((white, rough))
    }

    /// The whole way.
    pub(super) fn run(&self) -> Result<End, DiagnoseError> {
        let Begun { problem, rule, baseline, .. } = self.begun;
        self.tell("adequacy of the baseline", 0.0)?;
        let adequacy = self.test(baseline, 1)?;
        self.tell("adequacy of the baseline", 1.0)?;
        let answer = Answer {
            problem,
            rule,
            baseline,
            least_squares: &self.least_squares.fit,
            outliers: self.begun.outliers(),
        };
        if adequacy.p_value > self.options.alpha {
            let mut diagnosis =
                answer.skeleton(&adequacy, Verdict::Adequate, baseline, self.before(&answer)?)?;
            diagnosis.limits = limits(problem, rule, baseline);
            return Ok(End::Answer(Box::new(Outcome { diagnosis, contradicting: None })));
        }
        let compared = self.compared()?;
        let before = self.before(&answer)?;
        let conclusion = self.conclusion(&compared)?;
        if self.may_keep {
            let foretold = self.foretold(&compared, &conclusion)?;
            if !foretold.is_empty() {
                return Ok(End::Foretold(foretold));
            }
        }
        let outcome = self.outcome(&answer, &adequacy, before, &compared, conclusion)?;
        Ok(End::Answer(Box::new(outcome)))
    }

    /// Every set worth looking at, the preferred one, and the noise beside which they are judged.
    fn compared(&self) -> Result<Compared, DiagnoseError> {
        let (mut ranking, unfitted) = self.compare(&self.wanted())?;
        let mut best = self.best(&mut ranking)?;
        let (white, rough) = self.small_scale_noise(&ranking)?;
        if self.explains(&ranking, best.as_ref()).is_none()
            && let Some((other, clear)) = self.unasked(&white, &rough)?
        {
            (ranking, best) = (other, Some(clear));
        }
        Ok(Compared { ranking, unfitted, best, white, rough })
    }

    /// The answer that follows from a conclusion.
    fn outcome(
        &self,
        answer: &Answer<'_>,
        adequacy: &Adequacy,
        before: Vec<ChannelFit>,
        compared: &Compared,
        conclusion: Conclusion<'_>,
    ) -> Result<Outcome, DiagnoseError> {
        let Begun { problem, baseline, .. } = self.begun;
        let Compared { ranking, unfitted, best, white, rough } = compared;
        let Conclusion { judge, near, cause, explained, replaced } = conclusion;
        let mut noise = rough.clone();
        let instead =
            cause.as_ref().map(|cause| self.law_instead(ranking, cause, white)).transpose()?.flatten();
        let (mut diagnosis, misses) = match (cause, explained, instead) {
            (Some(cause), _, Some(law)) => {
                let mut diagnosis = answer.skeleton(adequacy, Verdict::Unexplained, baseline, before)?;
                diagnosis.mechanisms = answer.mechanisms(ranking, best.as_ref())?;
                diagnosis.closest = Some(answer.closest(&cause.chosen.clone().into()));
                tell_law(&mut diagnosis, answer, law, baseline);
                (diagnosis, Some(cause.chosen.least_squares))
            }
            (Some(cause), _, None) => {
                let mut diagnosis = self.partly(answer, adequacy, before, ranking, &cause, rough)?;
                diagnosis.remarks.extend(Self::seen_near_by(answer, &judge, &cause));
                (diagnosis, Some(cause.chosen.least_squares))
            }
            (None, Some(chosen), _) if !self.alike(ranking.at(chosen.at)) => {
                let diagnosis = self.runs_that_differ(answer, adequacy, before, compared, chosen, &judge)?;
                (diagnosis, None)
            }
            (None, Some(chosen), _) => {
                noise = RoughNoise::white(ranking.at(chosen.at).fit.noise.sigma.clone());
                (self.explained(answer, adequacy, before, ranking, chosen, &judge)?, None)
            }
            (None, None, _) => {
                let mut diagnosis = answer.skeleton(adequacy, Verdict::Unexplained, baseline, before)?;
                diagnosis.mechanisms = answer.mechanisms(ranking, best.as_ref())?;
                let closest = near.as_ref().unwrap_or(&judge).closest();
                diagnosis.closest = closest.as_ref().map(|closest| answer.closest(closest));
                let misses = closest.map_or_else(|| self.least_squares.clone(), |c| c.judged.least_squares);
                self.unexplained(&mut diagnosis, answer, ranking, &misses.set, white)?;
                (diagnosis, Some(misses))
            }
        };
        let judged = misses.map(|model| contradicting(problem, &model.selection, &model.fit, white));
        let contradicting = judged.transpose()?.flatten();
        diagnosis.remarks.extend(replaced.map(|set| {
            let names = answer.names(&set.set);
            format!("{names} would act everywhere; less of it and one unknown in a part of the data say clearly more")
        }));
        diagnosis.remarks.extend(answer.unfitted(unfitted));
        if problem.rows.len() == 1 && !diagnosis.chosen.is_empty() {
            diagnosis.remarks.push("one run alone: whether another needs the same was not tested".into());
        }
        diagnosis.sets = answer.sets(ranking, best.as_ref());
        diagnosis.location = locate(problem, &baseline.selection, &self.least_squares.fit, &noise)?;
        Ok(Outcome { diagnosis, contradicting })
    }

    /// Errors of the baseline.
    fn before(&self, answer: &Answer<'_>) -> Result<Vec<ChannelFit>, PredictError> {
        answer.errors(&self.least_squares.fit, &held_out(&self.begun.problem, self.least_squares)?)
    }

    /// The set that is preferred, and how it and others predict what they have not seen.
    fn best(&self, ranking: &mut Ranking) -> Result<Option<Best>, DiagnoseError> {
        self.tell("adequacy of the best explanation", 0.0)?;
        let best = ranking.best(self.options.alpha, |c, stream| self.test(c, stream))?;
        let best = best.map(|best| self.around_nothing(ranking, best)).transpose()?;
        self.tell("predicting unseen data", 0.0)?;
        ranking.score(&self.begun.problem, best.as_ref());
        Ok(best)
    }

    /// The preferred set, where it explains the data: it has been selected to fit, so that only a clear failure speaks against it.
    pub(super) fn explains<'b>(&self, ranking: &Ranking, best: Option<&'b Best>) -> Option<&'b Best> {
        best.filter(|b| b.p_value > clearly(self.options.alpha) && ranking.gains(b.at))
    }

    /// Where nothing that was asked for explains the data: what nobody has asked for, if it explains them and they are clear.
    fn unasked(&self, white: &[f64], rough: &RoughNoise) -> Result<Option<(Ranking, Best)>, DiagnoseError> {
        let Begun { problem, .. } = self.begun;
        let mechanisms = &problem.spec().mechanisms;
        if mechanisms.iter().all(|m| !m.unasked) {
            return Ok(None);
        }
        let everything = problem.spec().named();
        let (ranking, _) = self.compare(&everything)?;
        let clear = clear_cases(problem, ranking.all(), white)?;
        let mut ranking = ranking.only(&clear);
        let best = self.best(&mut ranking)?;
        let holds = self.explains(&ranking, best.as_ref()).is_some_and(|best| {
            let chosen = ranking.at(best.at);
            chosen.set.iter().any(|&m| mechanisms[m].unasked)
                && self.sound(&ranking, chosen, (white, rough)).is_some()
        });
        Ok(best.filter(|_| holds).map(|best| (ranking, best)))
    }

    /// Every set of `mechanisms` worth looking at, fitted; and mechanisms that could not be, with the reason.
    fn compare(&self, mechanisms: &[usize]) -> Result<(Ranking, Vec<(usize, PredictError)>), DiagnoseError> {
        const STAGE: &str = "comparing mechanisms";
        let Begun { problem, rule, baseline, .. } = self.begun;
        self.tell(STAGE, 0.0)?;
        let competing = rule.competing();
        let among = candidate(problem, &competing, &[], &[], &baseline.fit, &[])?;
        let progress = |done| self.observer.progress(Progress { stage: STAGE, done });
        let Searched { all, unfitted } =
            search(problem, &competing, among, mechanisms, &progress).ok_or(DiagnoseError::Stopped)?;
        Ok((Ranking::new(all, held_out(problem, baseline)?), unfitted))
    }

    /// A set takes away nearly all of the misfit, and something is left.
    fn partly(
        &self,
        answer: &Answer<'_>,
        adequacy: &Adequacy,
        before: Vec<ChannelFit>,
        ranking: &Ranking,
        cause: &MainCause,
        noise: &RoughNoise,
    ) -> Result<Diagnosis, DiagnoseError> {
        let problem = &self.begun.problem;
        let chosen = &cause.chosen.candidate;
        let mut diagnosis = answer.skeleton(adequacy, Verdict::Partly, chosen, before)?;
        diagnosis.mechanisms = answer.mechanisms_beside_a_leftover(ranking, cause)?;
        diagnosis.chosen = answer.ids(&chosen.set);
        diagnosis.explained_share = Some(cause.chosen.share);
        diagnosis.leftover = locate(problem, &chosen.selection, &chosen.fit, noise)?;
        let after = predictions(problem, &chosen.fit)?;
        diagnosis.after = answer.errors_of(&after, &held_out(problem, &cause.chosen.least_squares)?);
        draw(&mut diagnosis, &after);
        diagnosis.confused_with = cause.rivals.iter().map(|r| answer.ids(&r.candidate.set)).collect();
        if !cause.rivals.is_empty() {
            let sets: Vec<&Candidate> =
                std::iter::once(chosen).chain(cause.rivals.iter().map(|r| &r.candidate)).collect();
            let names: Vec<String> = sets.iter().map(|c| answer.names(&c.set)).collect();
            let line = format!("{} cannot be told apart beside what they leave", listed(&names));
            diagnosis.undetermined.push(line);
            self.tell("choosing the next experiment", 0.0)?;
            diagnosis.next_experiment = experiment::best(problem, &sets, self.experiments);
        }
        Ok(diagnosis)
    }

    /// A set explains the data: does another as well, and what would tell them apart?
    fn explained(
        &self,
        answer: &Answer<'_>,
        adequacy: &Adequacy,
        before: Vec<ChannelFit>,
        ranking: &Ranking,
        best: &Best,
        judge: &Judge<'_>,
    ) -> Result<Diagnosis, DiagnoseError> {
        let problem = &self.begun.problem;
        let chosen = ranking.at(best.at);
        let mut diagnosis = answer.skeleton(adequacy, Verdict::Explained, chosen, before)?;
        diagnosis.mechanisms = answer.mechanisms(ranking, Some(best))?;
        diagnosis.final_p_value = Some(best.p_value);
        diagnosis.chosen = answer.ids(&chosen.set);
        diagnosis.explained_share = judge.share(&chosen.set);
        let after = predictions(problem, &chosen.fit)?;
        // Beside noise that accumulates a fit minimises what each step adds, and not the sum that its errors are of.
        let by_its_sum = judge.least_squares(&chosen.set).filter(|_| chosen.accumulates(problem));
        if let Some(fit) = by_its_sum {
            let summed = Candidate { fit: fit.clone(), ..chosen.clone() };
            diagnosis.after = answer.errors(fit, &held_out(problem, &summed)?)?;
        } else if let Some(score) = ranking.score_of(&chosen.set) {
            diagnosis.after = answer.errors_of(&after, score);
        }
        draw(&mut diagnosis, &after);
        diagnosis.undetermined.extend(answer.open_numbers(chosen));
        self.tell("telling the rivals apart", 0.0)?;
        // Runs that differ are no mechanism: what they would do as well is said, and doubts no name.
        let (rivals, differ): (Vec<&Candidate>, Vec<&Candidate>) =
            ranking.rivals(best).into_iter().partition(|rival| !answer.ids(&rival.set).is_empty());
        let as_well = |rival: &&Candidate| format!("{} would do as well", answer.names(&rival.set));
        diagnosis.undetermined.extend(differ.iter().map(as_well));
        if rivals.len() == 1 {
            return Ok(diagnosis);
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
        Ok(diagnosis)
    }

    /// Nothing on the list explains the data: is there a law in what is left, beside the closest set where that predicts unseen data
    /// better than the baseline?
    fn unexplained(
        &self,
        diagnosis: &mut Diagnosis,
        answer: &Answer<'_>,
        ranking: &Ranking,
        closest: &[usize],
        white: &[f64],
    ) -> Result<(), DiagnoseError> {
        let Begun { problem, rule, baseline, .. } = self.begun;
        self.tell("looking for a law in the residual", 0.0)?;
        let repair = ranking.of(closest).filter(|c| !c.set.is_empty());
        let score = repair.and_then(|repair| held_out(problem, repair).ok());
        let repair = repair.zip(score.as_ref()).filter(|(_, score)| improves(ranking.base(), score));
        let (start, seen) = repair.unwrap_or((baseline, ranking.base()));
        let competing = rule.competing();
        let mut found = find(problem, &competing, start, seen)?.map(|found| (found, start));
        if !start.set.is_empty() {
            // Mechanisms that imitate what is there leave a law of what they miss; a law beside none of them may say more.
            let alone = sparse(problem, &competing, baseline, ranking.base())?;
            let score = found.as_ref().map_or(f64::NEG_INFINITY, |(found, _)| found.held_out.log_score);
            let better = |alone: &Found| improves(seen, &alone.held_out) && alone.held_out.log_score > score;
            found = alone.filter(better).map(|alone| (alone, baseline)).or(found);
        }
        if let Some((mut found, beside)) = found {
            if let Some(with_law) = &found.of_terms {
                found.law.p_value = self.left_by_law(with_law, white);
            }
            tell_law(diagnosis, answer, found, beside);
        }
        Ok(())
    }

    /// The p value of a model with a law; none where its noise is a slow error, or where alternatives near by predict nothing, as where what is
    /// simulated runs away under the law.
    fn left_by_law(&self, with_law: &Candidate, white: &[f64]) -> Option<f64> {
        let tested = || self.test(with_law, OF_LAW).ok();
        (!with_law.slow(&self.begun.problem, white)).then(tested)?.map(|test| test.p_value)
    }

    /// A law of candidate terms, no more of them than a main cause has members, that leaves nothing where that cause leaves something: then the
    /// cause imitates what nobody has listed.
    fn law_instead(
        &self,
        ranking: &Ranking,
        cause: &MainCause,
        white: &[f64],
    ) -> Result<Option<Found>, DiagnoseError> {
        let Begun { problem, rule, baseline, .. } = self.begun;
        let (base, competing, members) = (ranking.base(), rule.competing(), cause.chosen.candidate.set.len());
        let law = selected(problem, &competing, baseline, base, members);
        let Some(law) = law.filter(|law| improves(base, &law.score)) else { return Ok(None) };
        // Where noise that is slow stands in for what a law leaves, its score says little, and its errors say all.
        let with_cause = held_out(problem, &cause.chosen.least_squares)?;
        let nearer = law.score.rmse.iter().zip(&with_cause.rmse).all(|(law, cause)| law < cause);
        if !nearer || law.score.log_score <= with_cause.log_score + LEAST_GAIN {
            return Ok(None);
        }
        let Some(p_value) = self.left_by_law(&law.fitted, white) else { return Ok(None) };
        if p_value <= clearly(self.options.alpha) {
            return Ok(None);
        }
        let mut found = law.told(problem, &competing, base)?;
        found.law.p_value = Some(p_value);
        Ok(Some(found))
    }
}

/// Says a law, beside a set of mechanisms.
fn tell_law(diagnosis: &mut Diagnosis, answer: &Answer<'_>, found: Found, beside: &Candidate) {
    diagnosis.after = answer.errors_of(&found.predictions, &found.held_out);
    draw(diagnosis, &found.predictions);
    diagnosis.noise = answer.noise(&found.fit);
    diagnosis.repaired = found.repaired;
    diagnosis.law = Some(Law { beside: answer.ids(&beside.set), ..found.law });
}

/// Which sets stand whoever asked for their members: each that nobody has asked for takes away so much that a cause which is like it to
/// a thirtieth would be told apart from it.
fn clear_cases(problem: &Problem<'_>, all: &[Candidate], white: &[f64]) -> Result<Vec<bool>, PredictError> {
    /// Misfit that is taken away, in sigmas.
    const CLEAR: f64 = 100.0;
    let squares = |candidate: &Candidate| -> Result<f64, PredictError> {
        let left = residuals(problem, &candidate.fit)?;
        let of_channel = |(column, sigma): (&Vec<f64>, &f64)| {
            column.iter().filter(|v| v.is_finite()).map(|v| (v / sigma).powi(2)).sum::<f64>()
        };
        Ok(left.iter().flat_map(|run| run.iter().zip(white)).map(of_channel).sum())
    };
    let squares = all.iter().map(squares).collect::<Result<Vec<f64>, _>>()?;
    let mechanisms = &problem.spec().mechanisms;
    let clear = |(candidate, left): (&Candidate, &f64)| {
        candidate.set.iter().filter(|&&m| mechanisms[m].unasked).all(|&m| {
            let without: Vec<usize> = candidate.set.iter().copied().filter(|&other| other != m).collect();
            let before = all.iter().position(|c| c.set == without);
            before.is_some_and(|before| squares[before] - left > CLEAR * CLEAR)
        })
    };
    Ok(all.iter().zip(&squares).map(clear).collect())
}

/// Puts what a fit predicts into the curves.
pub(super) fn draw(diagnosis: &mut Diagnosis, predictions: &[Vec<Vec<f64>>]) {
    for (curves, after) in diagnosis.curves.iter_mut().zip(predictions) {
        curves.after.clone_from(after);
    }
}
