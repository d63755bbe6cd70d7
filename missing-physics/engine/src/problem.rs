//! A model and a recording put together: which rows count, what starts where, what is whitened how.

use std::sync::OnceLock;

use rayon::prelude::*;

use crate::data::{Recording, Run};
use crate::model::{Model, Scope, Spec};
use crate::noise::family::Family;
use crate::noise::process::{Shape, Whitener, rough_sigma};
use crate::statistics::median;

/// A model and a recording, with everything about the rows that no fit changes.
pub(crate) struct Problem<'a> {
    pub(crate) model: &'a dyn Model,
    pub(crate) recording: Recording,
    /// The shapes of noise, by number.
    pub(crate) family: &'static Family,
    pub(crate) rows: Vec<RunRows>,
    /// Median step between rows, in the noise variable's unit.
    pub(crate) step: f64,
    /// Root mean square of the errors that accumulate over all rows of a channel for a unit step, in the channel's unit; `None` where the
    /// model knows of none.
    pub(crate) accumulated: Vec<Option<f64>>,
    /// Whether rows are so unevenly spaced that noise along the noise variable and noise from row to row differ.
    pub(crate) uneven: bool,
    pub(crate) slots: Vec<usize>,
    pub(crate) shared: ParameterTable,
    pub(crate) nuisance: ParameterTable,
    /// Where each run's nuisance parameters start.
    pub(crate) nuisance_start: Vec<Vec<f64>>,
}

/// The parameters of one scope, column by column.
pub(crate) struct ParameterTable {
    pub(crate) start: Vec<f64>,
    pub(crate) lower: Vec<f64>,
    pub(crate) upper: Vec<f64>,
    pub(crate) scale: Vec<f64>,
    /// Index into [`Spec::parameters`].
    pub(crate) index: Vec<usize>,
}

/// Models with more mechanisms than this know many.
const MANY: usize = 16;
/// The same where a program is asked, each of whose answers takes milliseconds.
const MANY_FOR_A_PROGRAM: usize = 8;

/// Whiteners of neighbouring shapes.
type Page = Box<[OnceLock<Whitener>]>;

/// Whiteners on a page.
const PAGE: usize = 64;

/// The measured rows of one run.
pub(crate) struct RunRows {
    /// For each channel, the rows that were measured.
    pub(crate) valid: Vec<Vec<usize>>,
    /// For each channel, the noise variable at those rows.
    pub(crate) positions: Vec<Vec<f64>>,
    /// For each channel and shape, made when first asked for, page by page: few of the many shapes ever are.
    whiteners: Vec<Vec<OnceLock<Page>>>,
}

impl ParameterTable {
    fn new(spec: &Spec, scope: Scope) -> Self {
        let index: Vec<usize> =
            (0..spec.parameters.len()).filter(|&i| spec.parameters[i].scope == scope).collect();
        let column =
            |f: fn(&crate::model::Parameter) -> f64| index.iter().map(|&i| f(&spec.parameters[i])).collect();
        Self {
            start: column(|p| p.start),
            lower: column(|p| p.lower),
            upper: column(|p| p.upper),
            scale: column(|p| p.scale.abs().max(f64::MIN_POSITIVE)),
            index,
        }
    }
}

/// Places to be filled.
fn empty<T>(count: usize) -> Vec<OnceLock<T>> {
    (0..count).map(|_| OnceLock::new()).collect()
}

impl<'a> Problem<'a> {
    pub(crate) fn new(model: &'a dyn Model, recording: Recording) -> Self {
        let family = Family::get();
        let mut gaps = Vec::new();
        let mut rows = Vec::with_capacity(recording.runs.len());
        for run in &recording.runs {
            let along = noise_positions(&recording, run);
            gaps.extend(along.windows(2).map(|w| w[1] - w[0]).filter(|g| *g > 0.0));
            let valid: Vec<Vec<usize>> = run
                .outputs
                .iter()
                .map(|column| (0..column.len()).filter(|&i| column[i].is_finite()).collect())
                .collect();
            let positions = valid.iter().map(|ids| ids.iter().map(|&i| along[i]).collect()).collect();
            let whiteners = valid.iter().map(|_| empty(family.len().div_ceil(PAGE))).collect();
            rows.push(RunRows { valid, positions, whiteners });
        }
        let accumulated = (0..recording.channels.len())
            .map(|channel| {
                let of_run = |run: &Run| accumulated_errors(model, run, channel);
                let squares = recording.runs.iter().map(of_run).collect::<Option<Vec<_>>>()?;
                let squares: Vec<f64> =
                    squares.iter().flatten().map(|row| row.iter().map(|v| v * v).sum()).collect();
                let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
                (mean > 0.0).then(|| mean.sqrt())
            })
            .collect();
        let step = median(&mut gaps).unwrap_or(1.0);
        let odd = gaps.iter().filter(|g| (*g / step - 1.0).abs() > 0.2).count();
        let spec = model.spec();
        let nuisance = ParameterTable::new(spec, Scope::PerRun);
        let nuisance_start = recording
            .runs
            .iter()
            .map(|run| {
                let mut start = nuisance.start.clone();
                model.nuisance_start(run, &mut start);
                for (i, value) in start.iter_mut().enumerate() {
                    *value = if value.is_finite() {
                        value.clamp(nuisance.lower[i], nuisance.upper[i])
                    } else {
                        nuisance.start[i]
                    };
                }
                start
            })
            .collect();
        Self {
            slots: spec.slots(),
            shared: ParameterTable::new(spec, Scope::Shared),
            nuisance,
            nuisance_start,
            step,
            accumulated,
            uneven: 10 * odd > gaps.len(),
            family,
            rows,
            recording,
            model,
        }
    }

    /// The same model on other rows of the same recording.
    pub(crate) fn with(&self, recording: Recording) -> Problem<'a> {
        let mut other = Problem::new(self.model, recording);
        other.step = self.step;
        other.accumulated.clone_from(&self.accumulated);
        other
    }

    /// The same model on some of the runs.
    pub(crate) fn of_runs(&self, runs: &[usize]) -> Problem<'a> {
        let mut recording = self.recording.clone();
        recording.runs = runs.iter().map(|&r| self.recording.runs[r].clone()).collect();
        self.with(recording)
    }

    pub(crate) fn spec(&self) -> &Spec {
        self.model.spec()
    }

    /// What is asked of each run, by run: runs at the same time where that takes long enough to be worth it.
    pub(crate) fn by_run<T: Send, E: Send>(
        &self,
        of_run: impl Fn(usize) -> Result<T, E> + Sync + Send,
    ) -> Result<Vec<T>, E> {
        let runs = 0..self.rows.len();
        if self.knows_many() && runs.len() > 1 {
            runs.into_par_iter().map(of_run).collect()
        } else {
            runs.map(of_run).collect()
        }
    }

    /// Whether the model knows so many mechanisms that what is tried for them has to be cheap.
    pub(crate) fn knows_many(&self) -> bool {
        let most = if self.model.extensions().program.is_some() { MANY_FOR_A_PROGRAM } else { MANY };
        self.spec().mechanisms.len() > most
    }

    pub(crate) fn channels(&self) -> usize {
        self.recording.channels.len()
    }

    /// Measured values of a channel.
    pub(crate) fn count(&self, channel: usize) -> usize {
        self.rows.iter().map(|r| r.valid[channel].len()).sum()
    }

    /// Sigma of a channel's rough part in each run that is long enough to show it: what is left once everything smooth is taken away.
    pub(crate) fn rough_sigmas(&self, channel: usize) -> Vec<f64> {
        let of_run = |(rows, run): (&RunRows, &Run)| {
            let column = &run.outputs[channel];
            let values: Vec<f64> = rows.valid[channel].iter().map(|&i| column[i]).collect();
            rough_sigma(&rows.positions[channel], &values)
        };
        self.rows.iter().zip(&self.recording.runs).filter_map(of_run).collect()
    }

    /// Measured values, and unknowns of the baseline and its noise.
    pub(crate) fn size(&self) -> (usize, usize) {
        let selection = self.select(&[], &[]);
        let rows: usize = (0..self.channels()).map(|c| self.count(c)).sum();
        (rows, selection.shared.len() + selection.nuisance.len() * self.rows.len() + self.channels())
    }

    /// The whitener of a channel's measured rows in a run, under a shape of noise.
    pub(crate) fn whitener(&self, run: usize, channel: usize, shape: usize) -> &Whitener {
        let rows = &self.rows[run];
        let page = rows.whiteners[channel][shape / PAGE].get_or_init(|| empty(PAGE).into_boxed_slice());
        page[shape % PAGE].get_or_init(|| {
            let shape = self.family.shape(shape);
            if shape.accumulated > 0.0 {
                self.accumulating(run, channel, shape)
            } else if shape.by_row {
                let numbers: Vec<f64> = rows.valid[channel].iter().map(|&i| i as f64).collect();
                Whitener::new(&numbers, 1.0, shape)
            } else {
                Whitener::new(&rows.positions[channel], self.step, shape)
            }
        })
    }

    /// The whitener of errors that accumulate, so many times the white ones; of white ones alone where the model says nothing of a run.
    fn accumulating(&self, run: usize, channel: usize, shape: Shape) -> Whitener {
        let rows = &self.rows[run].valid[channel];
        let known = accumulated_errors(self.model, &self.recording.runs[run], channel);
        let (Some(errors), Some(unit)) = (known, self.accumulated[channel]) else {
            return Whitener::new(&self.rows[run].positions[channel], self.step, Shape::WHITE);
        };
        let scaled = |&i: &usize| errors[i].iter().map(|v| shape.accumulated * v / unit).collect();
        Whitener::of_accumulated(&rows.iter().map(scaled).collect::<Vec<Vec<f64>>>(), shape.memory)
    }

    /// Picks the measured rows of a channel out of a column over all rows.
    pub(crate) fn pick(&self, run: usize, channel: usize, column: &[f64]) -> Vec<f64> {
        let n = self.recording.runs[run].len();
        self.rows[run].valid[channel].iter().map(|&i| column[channel * n + i]).collect()
    }

    /// Slots of the whole numbers that belong to the mechanisms `set`.
    pub(crate) fn integer_slots(&self, set: &[usize]) -> Vec<usize> {
        set.iter()
            .flat_map(|&m| &self.spec().mechanisms[m].integer_parameters)
            .map(|&p| self.slots[p])
            .collect()
    }

    /// The mechanisms that are at work with those of `set` on: these, and others all of whose parameters they free as companions (moving
    /// air acts through drag). Sets with the same ones at work are one model.
    pub(crate) fn at_work(&self, set: &[usize]) -> Vec<usize> {
        let spec = self.spec();
        let freed = self.freed(set);
        let companions = |m: usize| spec.mechanisms[m].companions.iter();
        let brought = |parameters: &[usize]| {
            !parameters.is_empty()
                && parameters.iter().all(|p| freed[*p] && set.iter().any(|&o| companions(o).any(|c| c == p)))
        };
        (0..spec.mechanisms.len())
            .filter(|m| set.contains(m) || brought(&spec.mechanisms[*m].parameters))
            .collect()
    }

    /// Whether a set is one model with any of `others`.
    pub(crate) fn is_among<'s>(
        &self,
        set: &[usize],
        mut others: impl Iterator<Item = &'s Vec<usize>>,
    ) -> bool {
        let at_work = self.at_work(set);
        others.any(|other| self.at_work(other) == at_work)
    }

    /// Which parameters (index into [`Spec::parameters`]) are free with the mechanisms `set` on.
    fn freed(&self, set: &[usize]) -> Vec<bool> {
        let spec = self.spec();
        let mut free = self.of_baseline();
        for &m in set {
            let mechanism = &spec.mechanisms[m];
            mechanism.parameters.iter().for_each(|&p| free[p] = true);
            let needless =
                set.iter().any(|&o| o != m && mechanism.companions_unless.contains(&spec.mechanisms[o].id));
            if !needless {
                mechanism.companions.iter().for_each(|&p| free[p] = true);
            }
        }
        free
    }

    /// Which parameters are free in the baseline.
    fn of_baseline(&self) -> Vec<bool> {
        let spec = self.spec();
        let mut free: Vec<bool> = vec![true; spec.parameters.len()];
        for m in &spec.mechanisms {
            for &p in m.parameters.iter().chain(&m.companions) {
                free[p] = false;
            }
        }
        for t in &spec.terms {
            free[t.parameter] = false;
        }
        free
    }

    /// The free parameters with the mechanisms `set` (indices into [`Spec::mechanisms`]) and terms `terms` on.
    pub(crate) fn select(&self, set: &[usize], terms: &[usize]) -> Selection {
        let spec = self.spec();
        let baseline = self.of_baseline();
        let mut free = self.freed(set);
        for &place in spec.mechanisms.iter().flat_map(|m| &m.integer_parameters) {
            free[place] = false;
        }
        for &t in terms {
            free[spec.terms[t].parameter] = true;
        }
        let pick = |scope: Scope| -> (Vec<usize>, Vec<bool>) {
            (0..free.len())
                .filter(|&p| free[p] && spec.parameters[p].scope == scope)
                .map(|p| (self.slots[p], !baseline[p]))
                .unzip()
        };
        let (shared, added_shared) = pick(Scope::Shared);
        let (nuisance, added_nuisance) = pick(Scope::PerRun);
        Selection { shared, nuisance, added_shared, added_nuisance }
    }
}

/// What a unit of each of a run's random steps adds to each of its rows, as the model says; `None` where it says nothing, or of other
/// rows than there are.
fn accumulated_errors(model: &dyn Model, run: &Run, channel: usize) -> Option<Vec<Vec<f64>>> {
    let errors = model.extensions().errors?.accumulated(run, channel)?;
    let steps = errors.first().map_or(0, Vec::len);
    let sound = |row: &Vec<f64>| row.len() == steps && row.iter().all(|v| v.is_finite());
    (errors.len() == run.len() && errors.iter().all(sound)).then_some(errors)
}

/// The noise variable of a run: the recording's, or the number of the row.
pub(crate) fn noise_positions(recording: &Recording, run: &Run) -> Vec<f64> {
    match recording.noise_along.and_then(|v| run.inputs.get(v)) {
        Some(column) => column.clone(),
        None => (0..run.len()).map(|i| i as f64).collect(),
    }
}

/// Which parameters a fit may move.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Selection {
    /// Slots among the shared parameters.
    pub(crate) shared: Vec<usize>,
    /// Slots among the runs' nuisance parameters.
    pub(crate) nuisance: Vec<usize>,
    /// Which of `shared` a mechanism or term added to the baseline.
    pub(crate) added_shared: Vec<bool>,
    /// Which of `nuisance` a mechanism or term added to the baseline.
    pub(crate) added_nuisance: Vec<bool>,
}

impl Selection {
    /// The nuisance parameters alone.
    pub(crate) fn without_shared(&self) -> Self {
        Self { shared: Vec::new(), added_shared: Vec::new(), ..self.clone() }
    }

    /// Slots among the shared parameters that a mechanism or term added to the baseline.
    pub(crate) fn added(&self) -> impl Iterator<Item = usize> {
        self.shared.iter().zip(&self.added_shared).filter(|(_, added)| **added).map(|(&slot, _)| slot)
    }
}
