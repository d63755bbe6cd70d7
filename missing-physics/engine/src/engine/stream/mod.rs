//! Runs that arrive one by one: has anything changed since the reference, and from which run on?
//!
//! A [`Watch`] begins with a recording of runs in which all was well, the reference. Each later run is predicted from all that came
//! before it, with the baseline's parameters and the size of the noise not known but learned, and the evidence that something has
//! changed is an *e-value*: it may be looked at after each run, and exceeds `1/alpha` without a change with a probability of at
//! most `alpha`, over all looks together. What it assumes stands at [`Watch`].

mod change;
mod evidence;
mod run;

use crate::data::{Recording, Run};
use crate::engine::begin::begin;
use crate::engine::input::{DiagnoseError, Options};
use crate::model::Model;
pub use change::What;
use evidence::{Change, Evidence};
use run::Setting;

/// Watches runs as they come.
///
/// The false alarms are at most `alpha` under these assumptions: noise is normal, with the correlations and the ratio between
/// channels' sizes that the reference shows (its size is learned with each run); the baseline is linear in its parameters about
/// the reference's fit, as far as they are uncertain; a run's own parameters are anything, and tell nothing of the next run's.
/// Runs that scatter by more than that, and wild readings, are changes.
pub struct Watch<'a> {
    setting: Setting<'a>,
    evidence: Evidence,
    names: Vec<What>,
    labels: Vec<String>,
    reference: usize,
    alpha: f64,
    alarm: Option<usize>,
}

/// A change, as the runs so far show it.
#[derive(Debug, Clone, PartialEq)]
pub struct Changed {
    /// The run that is most probably the first one, by its number among all runs, the reference included, from 0, and its label.
    pub first: (usize, String),
    /// The first and last run that may be the first one (95 %).
    pub between: (usize, usize),
    /// What changed, by how probable it is; all sum to one.
    pub what: Vec<(What, f64)>,
    /// Change of the parameter (of a mechanism: its parameters, of a curve: its coefficients) that is most probable, with standard errors.
    pub by: Vec<(f64, f64)>,
}

/// What a run adds.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    /// Number of the run among all, the reference included, from 0.
    pub run: usize,
    /// The e-value so far.
    pub e_value: f64,
    /// Whether it has ever reached `1/alpha`, and at which run.
    pub alarm: Option<usize>,
    /// What has changed, were there a change.
    pub changed: Option<Changed>,
}

impl<'a> Watch<'a> {
    /// Begins with runs in which all was well; false alarms are at most `alpha`, in (0, 0.5), over all runs that ever come.
    ///
    /// # Errors
    /// [`DiagnoseError`] as for a diagnosis of the reference.
    pub fn new(model: &'a dyn Model, reference: &Recording, alpha: f64) -> Result<Self, DiagnoseError> {
        if !(alpha > 0.0 && alpha < 0.5) {
            let expected = "a number between 0 and 0.5";
            return Err(DiagnoseError::Option { name: "alpha", value: alpha, expected });
        }
        let begun = begin(model, reference, &Options { alpha, ..Options::default() }, &[])?;
        let (setting, names, directions) = Setting::new(begun.problem, &begun.baseline.fit);
        let grams = (0..setting.reference_runs()).map(|run| setting.reference_gram(run));
        let grams = grams.collect::<Result<Vec<_>, _>>()?;
        let (evidence, kept) = Evidence::new(&grams, setting.shared(), &directions);
        let names = kept.into_iter().map(|d| names[d].clone()).collect();
        let labels: Vec<String> = reference.runs.iter().map(|run| run.label.clone()).collect();
        let reference = labels.len();
        Ok(Self { setting, evidence, names, labels, reference, alpha, alarm: None })
    }

    /// Takes the next run.
    ///
    /// # Errors
    /// [`DiagnoseError`] for a run that is not sound, or that the baseline does not predict; it is then as if it had not come.
    pub fn add(&mut self, run: &Run) -> Result<Look, DiagnoseError> {
        let gram = self.setting.gram(run)?;
        self.evidence.add(&gram);
        self.labels.push(run.label.clone());
        let run = self.labels.len() - 1;
        let (log_e, change) = self.evidence.weigh();
        if self.alarm.is_none() && log_e >= -self.alpha.ln() {
            self.alarm = Some(run);
        }
        let changed = change.map(|change| self.say(change));
        Ok(Look { run, e_value: log_e.exp(), alarm: self.alarm, changed })
    }

    fn say(&self, change: Change) -> Changed {
        let most =
            |values: &[f64]| (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(0);
        let first = most(&change.onset);
        // The most probable runs that hold 95 %.
        let mut order: Vec<usize> = (0..change.onset.len()).collect();
        order.sort_by(|a, b| change.onset[*b].total_cmp(&change.onset[*a]));
        let mut held = 0.0;
        order.retain(|k| {
            let wanted = held < 0.95;
            held += change.onset[*k];
            wanted
        });
        let between =
            (order.iter().min().copied().unwrap_or(first), order.iter().max().copied().unwrap_or(first));
        let best = most(&change.direction);
        let mut what: Vec<(What, f64)> = self.names.iter().cloned().zip(change.direction).collect();
        what.sort_by(|a, b| b.1.total_cmp(&a.1));
        let number = |k: usize| self.reference + k;
        Changed {
            first: (number(first), self.labels.get(number(first)).cloned().unwrap_or_default()),
            between: (number(between.0), number(between.1)),
            what,
            by: change.sizes.get(best).cloned().unwrap_or_default(),
        }
    }
}
