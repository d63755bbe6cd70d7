//! What a diagnosis says, put together from fits.

use crate::adequacy::test::Adequacy;
use crate::data::Run;
use crate::diagnosis::{
    ChannelFit, ChannelNoise, Closest, Curves, Diagnosis, Estimate, MechanismReport, NoiseSource, Outlier,
    RunDifference, RunSpread, RunValue, Scatter, SetReport, Verdict,
};
use crate::estimate::estimates::{estimates, of_mechanism};
use crate::estimate::open_noise::with_open_noise;
use crate::fit::optimum::Fit;
use crate::fit::prediction::predictions;
use crate::law::describe::number;
use crate::model::{Mechanism, PredictError};
use crate::noise::process::Shape;
use crate::noise::rule::NoiseRule;
use crate::problem::Problem;
use crate::repaired::Repaired;
use crate::runs::spread::spread;
use crate::selection::candidate::Candidate;
use crate::selection::held_out::HeldOut;
use crate::selection::main_cause::{self, MainCause};
use crate::selection::ranking::{Best, Ranking, probabilities};

/// Sets that are listed.
const LISTED_SETS: usize = 12;

/// What the parts of a diagnosis are made from.
pub(crate) struct Answer<'a> {
    pub(crate) problem: &'a Problem<'a>,
    pub(crate) rule: &'a NoiseRule,
    pub(crate) baseline: &'a Candidate,
    /// The baseline by plain least squares.
    pub(crate) least_squares: &'a Fit,
    pub(crate) outliers: Vec<Outlier>,
}

impl Answer<'_> {
    /// Identifiers of the members of a set that have names.
    pub(crate) fn ids(&self, set: &[usize]) -> Vec<String> {
        let mechanisms = set.iter().map(|&m| &self.problem.spec().mechanisms[m]);
        mechanisms.filter(|m| !m.between_runs).map(|m| m.id.clone()).collect()
    }

    pub(crate) fn names(&self, set: &[usize]) -> String {
        let names: Vec<String> =
            set.iter().map(|&m| self.problem.spec().mechanisms[m].name.clone()).collect();
        names.join(" with ")
    }

    pub(crate) fn skeleton(
        &self,
        adequacy: &Adequacy,
        verdict: Verdict,
        model: &Candidate,
        before: Vec<ChannelFit>,
    ) -> Result<Diagnosis, PredictError> {
        let with_leftover = verdict == Verdict::Partly;
        let recording = &self.problem.recording;
        let pairs =
            |list: &[crate::model::Quantity]| list.iter().map(|q| (q.name.clone(), q.unit.clone())).collect();
        let free: Vec<usize> =
            self.baseline.selection.shared.iter().map(|&slot| self.problem.shared.index[slot]).collect();
        // A leftover in the model leaves the noise open by itself.
        let open = if with_leftover { None } else { with_open_noise(self.problem, self.rule, model) };
        let (reported, between_runs) = self.allowing_for_runs(open.as_ref().unwrap_or(model))?;
        Ok(Diagnosis {
            verdict,
            p_value: adequacy.p_value,
            p_floor: adequacy.p_floor,
            tests: adequacy.tests.clone(),
            channels: pairs(&recording.channels),
            variables: pairs(&recording.variables),
            baseline: self.problem.spec().baseline.clone(),
            baseline_parameters: estimates(self.problem, self.baseline, &free, &[], self.rule, false),
            noise: self.noise(&model.fit),
            location: Vec::new(),
            mechanisms: Vec::new(),
            sets: Vec::new(),
            chosen: Vec::new(),
            confused_with: Vec::new(),
            confusion: None,
            explained_share: None,
            leftover: Vec::new(),
            closest: None,
            limits: Vec::new(),
            between_runs,
            run_differences: Vec::new(),
            contradiction: None,
            final_p_value: None,
            after: before.clone(),
            before,
            law: None,
            next_experiment: None,
            undetermined: Vec::new(),
            outliers: self.outliers.clone(),
            remarks: self.remarks(),
            repaired: Repaired::of(self.problem, &reported),
            curves: self.curves()?,
        })
    }

    /// A candidate whose intervals allow for runs that differ, and by how much they do.
    fn allowing_for_runs(&self, model: &Candidate) -> Result<(Candidate, Vec<RunSpread>), PredictError> {
        let found = spread(self.problem, model)?;
        let widened = found.as_ref().map_or_else(|| model.clone(), |found| found.widened(model));
        Ok((widened, found.map_or_else(Vec::new, |found| found.report(self.problem, model))))
    }

    fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if !self.baseline.fit.converged {
            remarks.push("the baseline's fit did not converge; its best estimate is used".to_owned());
        }
        let (rows, unknowns) = self.problem.size();
        if rows < 3 * unknowns {
            remarks.push(format!(
                "few data: {rows} measured values for {unknowns} unknowns: an effect has to be large to show, and what does not show is not ruled out"
            ));
        }
        remarks.extend(self.at_bounds());
        remarks
    }

    /// Which parameters of the simulation alone ended at a bound that somebody set: what they may be is narrower than what the data ask for.
    fn at_bounds(&self) -> Option<String> {
        let (table, fit) = (&self.problem.shared, &self.baseline.fit);
        let of_baseline = self.baseline.selection.shared.iter().filter(|slot| fit.at_bound.contains(slot));
        let said = of_baseline.filter(|slot| fit.shared[**slot] != 0.0).map(|&slot| {
            let parameter = &self.problem.spec().parameters[table.index[slot]];
            format!("{} = {} {}", parameter.name, number(fit.shared[slot]), parameter.unit)
                .trim_end()
                .to_owned()
        });
        let all: Vec<String> = said.collect();
        (!all.is_empty())
            .then(|| format!("at a bound, beyond which the data ask for more: {}", all.join(", ")))
    }

    /// The data beside the plain simulation.
    fn curves(&self) -> Result<Vec<Curves>, PredictError> {
        let curves = |(run, before): (&Run, Vec<Vec<f64>>)| Curves {
            run: run.label.clone(),
            inputs: run.inputs.clone(),
            measured: run.outputs.clone(),
            after: before.clone(),
            before,
        };
        let before = predictions(self.problem, self.least_squares)?;
        Ok(self.problem.recording.runs.iter().zip(before).map(curves).collect())
    }

    pub(crate) fn noise(&self, fit: &Fit) -> Vec<ChannelNoise> {
        let recording = &self.problem.recording;
        (0..self.problem.channels())
            .map(|c| {
                let shape = self.problem.family.shape(fit.noise.shape[c]);
                // Errors that accumulate are correlated over the whole run.
                let rows = self.problem.count(c) as f64 / self.problem.rows.len().max(1) as f64;
                let (share, length) = shape.correlation(rows);
                ChannelNoise {
                    channel: recording.channels[c].name.clone(),
                    sigma: fit.noise.sigma[c] * shape.accumulated.hypot(1.0),
                    source: match (self.rule.fixed_sigma[c], recording.calibration.get(c)) {
                        (None, _) => NoiseSource::Differences,
                        (Some(_), Some(Some(_))) => NoiseSource::Calibration,
                        (Some(_), _) => NoiseSource::Replicates,
                    },
                    correlated_share: share,
                    correlation_rows: length,
                    correlation_length: length * self.problem.step,
                    scatter: self.scatter(c, &shape, fit.noise.sigma[c]),
                }
            })
            .collect()
    }

    /// What scatters and adds up in a channel, beside white noise of one sigma.
    fn scatter(&self, channel: usize, shape: &Shape, white: f64) -> Option<Scatter> {
        let errors = self.problem.model.extensions().errors?;
        let unit = self.problem.accumulated[channel].filter(|_| shape.accumulated > 0.0)?;
        let sigma = white * shape.accumulated / unit;
        Some(Scatter { of: errors.step().to_owned(), sigma, memory: shape.memory, white })
    }

    pub(crate) fn errors(&self, fit: &Fit, score: &HeldOut) -> Result<Vec<ChannelFit>, PredictError> {
        Ok(self.errors_of(&predictions(self.problem, fit)?, score))
    }

    pub(crate) fn errors_of(&self, predictions: &[Vec<Vec<f64>>], score: &HeldOut) -> Vec<ChannelFit> {
        let recording = &self.problem.recording;
        (0..self.problem.channels())
            .map(|c| {
                let squares = recording.runs.iter().zip(predictions).flat_map(|(run, predicted)| {
                    run.outputs[c]
                        .iter()
                        .zip(&predicted[c])
                        .map(|(m, p)| (m - p).powi(2))
                        .filter(|v| v.is_finite())
                });
                let (sum, n) = squares.fold((0.0, 0usize), |(s, n), v| (s + v, n + 1));
                ChannelFit {
                    channel: recording.channels[c].name.clone(),
                    rmse: (sum / n.max(1) as f64).sqrt(),
                    heldout_rmse: score.rmse[c],
                }
            })
            .collect()
    }

    /// Whole numbers (which sensor, which row) that the data do not tell from the likeliest.
    pub(crate) fn open_numbers(&self, chosen: &Candidate) -> Vec<String> {
        let name = |slot: usize| &self.problem.spec().parameters[self.problem.shared.index[slot]].name;
        let open = |slot: usize| {
            let best = chosen.fit.shared[slot];
            let mut others: Vec<f64> =
                chosen.alternative_modes.iter().map(|e| e.shared[slot]).filter(|v| *v != best).collect();
            others.sort_by(f64::total_cmp);
            others.dedup();
            let others: Vec<String> = others.iter().map(f64::to_string).collect();
            let text = || {
                format!("{}: {best} is the likeliest, {} is possible too", name(slot), others.join(" or "))
            };
            (!others.is_empty()).then(text)
        };
        self.problem.integer_slots(&chosen.set).into_iter().filter_map(open).collect()
    }

    /// What differs from run to run by a member of a set that stands for that: its values.
    pub(crate) fn run_differences(&self, model: &Candidate, mechanism: usize) -> Vec<RunDifference> {
        let spec = self.problem.spec();
        let of = &spec.mechanisms[mechanism];
        let values = |&p: &usize| {
            let slot = self.problem.slots[p];
            let at = model.selection.nuisance.iter().position(|&free| free == slot);
            let of_run = |(r, run): (usize, &Run)| RunValue {
                run: run.label.clone(),
                value: model.fit.nuisance[r][slot],
                standard_error: at.map_or(f64::NAN, |at| model.fit.nuisance_errors[r].error[at]),
            };
            let by_run = self.problem.recording.runs.iter().enumerate().map(of_run).collect();
            let quantity = &spec.parameters[p];
            let (parameter, unit) = (quantity.name.clone(), quantity.unit.clone());
            RunDifference { name: of.name.clone(), parameter, unit, by_run }
        };
        of.parameters.iter().map(values).collect()
    }

    /// The closest explanation, with what its parameters would be.
    pub(crate) fn closest(&self, closest: &main_cause::Closest) -> Closest {
        let judged = &closest.judged;
        let spec = self.problem.spec();
        let of = |&m: &usize| {
            let mechanism = &spec.mechanisms[m];
            self.without_open(
                mechanism,
                of_mechanism(self.problem, &judged.candidate, mechanism, self.rule, false),
            )
        };
        Closest {
            ids: self.ids(&judged.candidate.set),
            share: closest.share,
            as_likely: closest.as_likely.iter().map(|set| self.ids(set)).collect(),
            parameters: judged.candidate.set.iter().flat_map(of).collect(),
        }
    }

    /// Which mechanisms could not be fitted, and why.
    pub(crate) fn unfitted(&self, unfitted: &[(usize, PredictError)]) -> Vec<String> {
        let words = |(m, why): &(usize, PredictError)| {
            format!("{} could not be fitted: {why}", self.problem.spec().mechanisms[*m].name)
        };
        unfitted.iter().map(words).collect()
    }

    /// Every mechanism that the data can speak of, likeliest first.
    pub(crate) fn mechanisms(
        &self,
        ranking: &Ranking,
        best: Option<&Best>,
    ) -> Result<Vec<MechanismReport>, PredictError> {
        let sets: Vec<(&Candidate, f64)> = ranking.physical().collect();
        let Some(best) = best else { return Ok(self.reports(ranking, &[], &sets, false)) };
        let chosen = ranking.at(best.at);
        let open = with_open_noise(self.problem, self.rule, chosen);
        let (reported, between_runs) = self.allowing_for_runs(open.as_ref().unwrap_or(chosen))?;
        let rivals = ranking.rivals(best).into_iter().filter(|c| c.set != chosen.set);
        let answer: Vec<&Candidate> = std::iter::once(&reported).chain(rivals).collect();
        Ok(self.reports(ranking, &answer, &sets, between_runs.is_empty()))
    }

    /// The same where a leftover is in the model: of all sets, the main cause and its rivals count.
    pub(crate) fn mechanisms_beside_a_leftover(
        &self,
        ranking: &Ranking,
        cause: &MainCause,
    ) -> Result<Vec<MechanismReport>, PredictError> {
        let all = || std::iter::once(&cause.chosen).chain(&cause.rivals).map(|judged| &judged.candidate);
        let evidence: Vec<f64> = all().map(|c| c.evidence).collect();
        let sets: Vec<(&Candidate, f64)> = all().zip(probabilities(&evidence)).collect();
        let (reported, _) = self.allowing_for_runs(&cause.chosen.candidate)?;
        Ok(self.reports(ranking, &[&reported], &sets, false))
    }

    /// Every mechanism: as it is in the answer, the preferred set and then its rivals, else in the likeliest set that has it.
    fn reports(
        &self,
        ranking: &Ranking,
        answer: &[&Candidate],
        sets: &[(&Candidate, f64)],
        profile: bool,
    ) -> Vec<MechanismReport> {
        let mut reports: Vec<MechanismReport> = (self.problem.spec().named().into_iter())
            .filter_map(|m| self.mechanism(m, ranking, answer, sets, profile))
            .collect();
        reports.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        reports
    }

    fn mechanism(
        &self,
        m: usize,
        ranking: &Ranking,
        answer: &[&Candidate],
        sets: &[(&Candidate, f64)],
        profile: bool,
    ) -> Option<MechanismReport> {
        let mechanism = &self.problem.spec().mechanisms[m];
        let alone = ranking.of(&[m]);
        // Beside one that brings it along as a companion a mechanism is at work without being a member.
        let holds = |c: &&Candidate| self.problem.at_work(&c.set).contains(&m);
        let holder = answer.iter().copied().chain(sets.iter().map(|p| p.0)).find(holds).or(alone)?;
        let scored = if ranking.score_of(&holder.set).is_some() { &holder.set[..] } else { &[m] };
        let score = ranking.score_of(scored);
        let profile = profile && answer.first().is_some_and(|best| best.set == holder.set);
        let holding = sets.iter().filter(|(c, _)| holds(c));
        let channels = &self.problem.recording.channels;
        Some(MechanismReport {
            id: mechanism.id.clone(),
            name: mechanism.name.clone(),
            equation: mechanism.equation.clone(),
            reference: mechanism.reference.clone(),
            probability: holding.map(|(_, p)| p).sum::<f64>().min(1.0),
            parameters: self
                .without_open(mechanism, of_mechanism(self.problem, holder, mechanism, self.rule, profile)),
            heldout_log_score_gain: ranking.gain(scored).unwrap_or(f64::NAN),
            heldout_rmse: score.map_or(Vec::new(), |s| {
                channels.iter().zip(&s.rmse).map(|(c, v)| (c.name.clone(), *v)).collect()
            }),
            ruled_out: alone.and_then(|c| c.ruled_out.clone()),
        })
    }

    /// Estimates of a mechanism without the parameters that may be open and are.
    fn without_open(&self, mechanism: &Mechanism, mut estimates: Vec<Estimate>) -> Vec<Estimate> {
        let may = |name: &str| {
            mechanism.may_be_open.iter().any(|&p| self.problem.spec().parameters[p].name == name)
        };
        estimates.retain(|e| e.ci95.iter().all(|v| v.is_finite()) || !may(&e.name));
        estimates
    }

    /// The leading sets, likeliest first.
    pub(crate) fn sets(&self, ranking: &Ranking, best: Option<&Best>) -> Vec<SetReport> {
        let tested = |b: &Best| [Some((b.at, b.p_value)), b.doubted].into_iter().flatten();
        let set = |(c, probability): (&Candidate, f64)| SetReport {
            ids: self.ids(&c.set),
            probability,
            p_value: best.and_then(|b| tested(b).find(|&(at, _)| ranking.at(at).set == c.set)).map(|t| t.1),
            heldout_log_score_gain: ranking.gain(&c.set),
            ruled_out: None,
        };
        ranking.physical().take(LISTED_SETS).map(set).collect()
    }
}
