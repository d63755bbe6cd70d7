//! One world of a proof: drawn, diagnosed, judged.

use std::path::{Path, PathBuf};
use std::time::Instant;

use missing_physics::data::Recording;
use missing_physics::diagnosis::Diagnosis;
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use missing_physics::oracle::{Oracle, oracle, oracle_of_leftover};
use serde::{Deserialize, Serialize};
use worlds::concealed::{Concealed, Hidden, Key, Maker};

use missing_physics_domains as domains;
use missing_physics_report::{self as report, ReportContext};

use crate::arguments::ProveArguments;
use crate::error::ProveError;
use crate::files::{make_folder, read_json, write_json, write_whole};

/// Kinds of worlds, in the order in which they take turns: 30 % nothing, 20 % one, 10 % each of two, unlisted, leftover, imitated, local.
const TURNS: [Hidden; 20] = {
    use Hidden::{Imitated as I, Leftover as L, Local as P, Nothing as N, One as O, Two as T, Unlisted as U};
    [N, O, L, U, O, N, T, I, O, P, N, L, N, U, O, I, T, N, P, N]
};

/// The file of what an oracle finds in a world.
const ORACLE: &str = "oracle.json";
/// The folders of a world's recording, and of the same without what is left over beside a listed mechanism.
const RECORDING: &str = "recording";
const WITHOUT_LEFTOVER: &str = "without_leftover";
/// Far beyond any threshold, and a number in JSON.
const MOST: f64 = 1e9;

/// One world.
pub(super) struct World {
    maker: &'static dyn Maker,
    hidden: Hidden,
    seed: u64,
    runs: Option<usize>,
    name: String,
    folder: PathBuf,
}

/// What is scored of a diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Outcome {
    pub(super) verdict: String,
    pub(super) p_value: f64,
    pub(super) chosen: Vec<String>,
    pub(super) confused_with: Vec<Vec<String>>,
    pub(super) estimates: Vec<Estimated>,
    pub(super) places: Vec<Located>,
    /// Labels of all runs.
    pub(super) runs: Vec<String>,
    pub(super) heldout_rmse: Vec<Option<f64>>,
    pub(super) seconds: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Estimated {
    pub(super) mechanism: String,
    pub(super) name: String,
    pub(super) ci95: [f64; 2],
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Located {
    pub(super) variable: Option<String>,
    pub(super) from: Option<f64>,
    pub(super) to: Option<f64>,
    /// Least and largest value of the variable in the recording; none of one that the model follows.
    pub(super) extent: Option<[f64; 2]>,
    pub(super) runs: Vec<String>,
}

/// What somebody who knows the truth finds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OracleFit {
    pub(super) likelihood_ratio: f64,
    pub(super) p_value: f64,
    pub(super) decisive: f64,
    pub(super) heldout_rmse: Vec<Option<f64>>,
    /// Log Bayes factor of what is left over beside the listed mechanism, of its true shape and a free size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) leftover: Option<f64>,
}

/// A world with everything that is known of it.
#[derive(Debug, Clone)]
pub(super) struct Judged {
    pub(super) domain: &'static str,
    pub(super) name: String,
    pub(super) key: Key,
    pub(super) outcome: Outcome,
    /// Where listed mechanisms are at work.
    pub(super) oracle: Option<OracleFit>,
}

impl World {
    pub(super) fn new(
        maker: &'static dyn Maker,
        number: usize,
        kind: Option<Hidden>,
        arguments: &ProveArguments,
    ) -> Self {
        let ProveArguments { seed, runs, folder, .. } = arguments;
        let name = format!("{}/{number:04}", maker.name());
        // FNV-1a of the name, so that a domain's worlds do not depend on which others are asked for.
        let hash =
            name.bytes().fold(0xcbf2_9ce4_8422_2325 ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15), |h, b| {
                (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
            });
        let folder = folder.join(&name);
        let hidden = kind.unwrap_or(TURNS[number % TURNS.len()]);
        Self { maker, hidden, seed: hash, runs: *runs, name, folder }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn draw(&self) -> Concealed {
        self.shortened(self.maker.conceal(self.hidden, self.seed))
    }

    /// The world without what is left over beside a listed mechanism; `None` of one that has nothing of the kind.
    fn without_leftover(&self) -> Option<Concealed> {
        self.maker.without_leftover(self.hidden, self.seed).map(|drawn| self.shortened(drawn))
    }

    fn shortened(&self, drawn: Concealed) -> Concealed {
        match self.runs {
            Some(runs) => drawn.first_runs(runs),
            None => drawn,
        }
    }

    /// Writes the recording and diagnoses it from its files, unless that has been done.
    pub(super) fn diagnose(&self) -> Result<(), ProveError> {
        let path = self.folder.join("outcome.json");
        if read_json::<Outcome>(&path).is_some() {
            return Ok(());
        }
        let recording = self.folder.join(RECORDING);
        write_files(&recording, &self.draw())?;
        let begin = Instant::now();
        let (domain, loaded) = domains::load(&recording)?;
        let options = self.options();
        let found = diagnose(&*loaded.model, &loaded.recording, &loaded.experiments, &options, &Silent)
            .map_err(|error| ProveError::Diagnose { recording: recording.clone(), error })?;
        let seconds = begin.elapsed().as_secs_f64();
        let context = ReportContext {
            domain: domain.id().into(),
            recording: format!("{}/recording", self.name),
            title: self.name.clone(),
            citations: vec![domains::THESIS.into()],
            words: domain.words(),
            additions: loaded.additions,
            ..ReportContext::default()
        };
        write_whole(&self.folder.join("answer.json"), report::json(&found, &context))?;
        write_whole(&self.folder.join("report.html"), report::html(&found, &context))?;
        write_json(&path, &Outcome::of(&found, &loaded.recording, seconds))
    }

    /// Fits what is truly at work, unless that has been done.
    pub(super) fn fit_oracle(&self) -> Result<(), ProveError> {
        let truth = self.draw().key.mechanisms;
        let path = self.folder.join(ORACLE);
        if truth.is_empty() || read_json::<OracleFit>(&path).is_some() {
            return Ok(());
        }
        let recording = self.folder.join(RECORDING);
        let (_, loaded) = domains::load(&recording)?;
        let (model, options) = (&*loaded.model, self.options());
        let failed = |error| ProveError::Diagnose { recording: recording.clone(), error };
        let found = oracle(model, &loaded.recording, &truth, &options).map_err(failed)?;
        let mut found = OracleFit::of(&found);
        if let Some(without) = self.without_leftover() {
            let folder = self.folder.join(WITHOUT_LEFTOVER);
            write_files(&folder, &without)?;
            let (_, without) = domains::load(&folder)?;
            let both = (&loaded.recording, &without.recording);
            let leftover = oracle_of_leftover(model, both, &truth, &options).map_err(failed)?;
            found.leftover = leftover.map(|left| left.decisive.clamp(-MOST, MOST));
        }
        write_json(&path, &found)
    }

    pub(super) fn judged(&self) -> Result<Judged, ProveError> {
        let missing = |file| ProveError::Missing { folder: self.folder.clone(), file };
        let key = self.draw().key;
        let oracle = read_json::<OracleFit>(&self.folder.join(ORACLE));
        if oracle.is_none() && !key.mechanisms.is_empty() {
            return Err(missing(ORACLE));
        }
        let outcome = read_json(&self.folder.join("outcome.json")).ok_or_else(|| missing("outcome.json"))?;
        Ok(Judged { domain: self.maker.name(), name: self.name.clone(), key, outcome, oracle })
    }

    fn options(&self) -> Options {
        Options { seed: self.seed, ..Options::default() }
    }
}

impl Outcome {
    fn of(d: &Diagnosis, recording: &Recording, seconds: f64) -> Self {
        let estimates = d.mechanisms.iter().filter(|m| d.chosen.contains(&m.id)).flat_map(|m| {
            m.parameters.iter().filter(|p| p.ci95.iter().all(|v| v.is_finite())).map(|p| Estimated {
                mechanism: m.id.clone(),
                name: p.name.clone(),
                ci95: p.ci95,
            })
        });
        Self {
            verdict: d.verdict.word().into(),
            p_value: d.p_value,
            chosen: d.chosen.clone(),
            confused_with: d.confused_with.clone(),
            estimates: estimates.collect(),
            places: d
                .location
                .iter()
                .map(|l| Located {
                    variable: l.variable.clone(),
                    from: l.from,
                    to: l.to,
                    extent: l.variable.as_deref().and_then(|v| extent(recording, v)),
                    runs: l.runs.clone(),
                })
                .collect(),
            runs: recording.runs.iter().map(|run| run.label.clone()).collect(),
            heldout_rmse: d.after.iter().map(|f| finite(f.heldout_rmse)).collect(),
            seconds,
        }
    }
}

impl OracleFit {
    fn of(t: &Oracle) -> Self {
        Self {
            likelihood_ratio: t.likelihood_ratio.clamp(0.0, MOST),
            p_value: t.p_value.clamp(0.0, 1.0),
            decisive: if t.decisive.is_nan() { -MOST } else { t.decisive.clamp(-MOST, MOST) },
            heldout_rmse: t.heldout_rmse.iter().map(|v| finite(*v)).collect(),
            leftover: None,
        }
    }
}

/// Writes the files of a world's recording.
fn write_files(folder: &Path, world: &Concealed) -> Result<(), ProveError> {
    make_folder(folder)?;
    world.files.iter().try_for_each(|(name, contents)| write_whole(&folder.join(name), contents))
}

/// The least and the largest value of a variable over a recording.
fn extent(recording: &Recording, variable: &str) -> Option<[f64; 2]> {
    let at = recording.variables.iter().position(|v| v.name == variable)?;
    let values = recording.runs.iter().flat_map(|r| &r.inputs[at]);
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    (high - low).is_finite().then_some([low, high])
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
