//! `prove`: worlds in which effects are concealed, diagnosed from their files alone, and scored against sealed answers.
//!
//! Everything is kept in a folder as it is made, so that a proof that was stopped, however rudely, goes on where it was:
//!
//! ```text
//! proof/plan.json                      what is being proven, and the seal of its answers
//! proof/<domain>/0000/recording/       the files of a world: all that a diagnosis sees
//! proof/<domain>/0000/answer.json      the diagnosis; report.html for a person
//! proof/<domain>/0000/outcome.json     what is scored of it
//! proof/<domain>/0000/told.json        what somebody who was told the truth would find
//! proof/keys.jsonl                     the answers, written when all diagnoses are there
//! proof/score.json  proof/score.html   the score
//! ```

mod key;
mod page;
mod score;
mod table;
mod world;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use missing_physics::observer::{Observer, Progress};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use worlds::concealed::{Maker, makers};

pub use score::{DomainScore, Part, Score};

/// Why a proof cannot go on; its text is one line.
#[derive(Debug, thiserror::Error)]
pub enum ProveError {
    /// A world's recording cannot be read.
    #[error(transparent)]
    Read(#[from] missing_physics_domains::recording::ReadError),
    /// Something else, in words.
    #[error("{0}")]
    Other(String),
}

fn write_whole(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), ProveError> {
    missing_physics_report::write_whole(path, contents)
        .map_err(|e| ProveError::Other(format!("{}: {e}", path.display())))
}
use world::World;

/// What `prove` is asked for.
#[derive(Debug, Clone)]
pub struct ProveArguments {
    /// One domain; all that can be proven without it.
    pub domain: Option<String>,
    /// Worlds of each domain.
    pub worlds: usize,
    /// Seed of the worlds.
    pub seed: u64,
    /// The folder of the proof.
    pub folder: PathBuf,
    /// Number of threads; 0 for all cores.
    pub threads: usize,
}

/// What is being proven.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Plan {
    format: u32,
    version: String,
    domains: Vec<String>,
    worlds: usize,
    seed: u64,
    /// SHA-256 of the answers, before any diagnosis.
    seal: String,
}

/// The domains of which worlds can be drawn.
pub fn provable() -> Vec<&'static str> {
    makers().iter().map(|m| m.name()).collect()
}

/// Draws the worlds, seals their answers, diagnoses each from its files, opens the seal and scores; goes on where a proof of the same
/// arguments was stopped. Returns the score as text; JSON and a page lie in the folder.
///
/// # Errors
/// [`ProveError`]: an unknown domain, another proof in the folder, a file that cannot be written, or a stop.
pub fn prove(arguments: &ProveArguments, observer: &dyn Observer) -> Result<String, ProveError> {
    let chosen: Vec<&'static dyn Maker> = makers()
        .iter()
        .copied()
        .filter(|m| arguments.domain.as_deref().is_none_or(|d| d == m.name()))
        .collect();
    if chosen.is_empty() {
        let asked =
            missing_physics_domains::recording::quoted(arguments.domain.as_deref().unwrap_or_default());
        let known = provable().join(", ");
        return Err(ProveError::Other(format!("no worlds of the domain {asked}, expected one of: {known}")));
    }
    if arguments.worlds == 0 {
        return Err(ProveError::Other("0 worlds prove nothing, expected at least 1".into()));
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(arguments.threads)
        .build()
        .map_err(|e| ProveError::Other(format!("{} threads cannot be had: {e}", arguments.threads)))?;
    let worlds: Vec<World> = chosen
        .iter()
        .flat_map(|&maker| (0..arguments.worlds).map(move |number| (maker, number)))
        .map(|(maker, number)| World::new(maker, number, arguments.seed, &arguments.folder))
        .collect();
    let tell = |stage: &str, done: f64| {
        if observer.progress(Progress { stage, done }) {
            Ok(())
        } else {
            Err(ProveError::Other("stopped; the same command goes on".into()))
        }
    };
    tell("drawing the worlds", 0.0)?;
    let keys: Vec<String> =
        pool.install(|| worlds.par_iter().map(|w| key::to_json(w.name(), &w.draw().key)).collect());
    let plan = Plan {
        format: 1,
        version: env!("CARGO_PKG_VERSION").into(),
        domains: chosen.iter().map(|m| m.name().to_owned()).collect(),
        worlds: arguments.worlds,
        seed: arguments.seed,
        seal: seal(&keys),
    };
    begin(&arguments.folder, &plan)?;
    each(&pool, &worlds, "diagnosing", observer, World::diagnose)?;
    // Only now are the answers opened.
    write_whole(&arguments.folder.join("keys.jsonl"), keys.concat())?;
    each(&pool, &worlds, "fitting the truth", observer, World::tell_truth)?;
    let judged = worlds.iter().map(World::judged).collect::<Result<Vec<_>, _>>()?;
    let score = Score::of(&plan.domains, &judged);
    let folder = &arguments.folder;
    write_whole(&folder.join("score.json"), score.to_json(&plan.seal, plan.seed, plan.worlds))?;
    write_whole(&folder.join("score.html"), page::page(&score, &judged, &plan.seal, plan.seed))?;
    Ok(format!(
        "{} worlds of each domain, seed {}; answers sealed as {}\n\n{}\n{}: ten worlds with their reports, the matrix and the power curves\n",
        plan.worlds,
        plan.seed,
        &plan.seal[..16],
        table::table(&score),
        folder.join("score.html").display()
    ))
}

fn seal(keys: &[String]) -> String {
    let mut hash = Sha256::new();
    keys.iter().for_each(|key| hash.update(key));
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Writes the plan, or finds that this very proof has begun before.
fn begin(folder: &Path, plan: &Plan) -> Result<(), ProveError> {
    let fail = |e: std::io::Error| ProveError::Other(format!("{}: {e}", folder.display()));
    std::fs::create_dir_all(folder).map_err(fail)?;
    let path = folder.join("plan.json");
    if !path.exists() {
        // Numbers, texts and lists always serialise.
        return write_whole(&path, &(serde_json::to_string_pretty(plan).unwrap_or_default() + "\n"));
    }
    let text = missing_physics_domains::recording::read_text(&path)?;
    match serde_json::from_str::<Plan>(&text) {
        Ok(before) if before == *plan => Ok(()),
        _ => Err(ProveError::Other(format!(
            "{}: another proof (other domains, worlds, seed or version), expected a new folder or the same arguments",
            folder.display()
        ))),
    }
}

/// Does a piece of work on every world, in parallel; each world keeps what it has done.
fn each(
    pool: &rayon::ThreadPool,
    worlds: &[World],
    stage: &str,
    observer: &dyn Observer,
    work: impl Fn(&World) -> Result<(), ProveError> + Sync,
) -> Result<(), ProveError> {
    let done = AtomicUsize::new(0);
    pool.install(|| {
        worlds.par_iter().try_for_each(|world| {
            work(world)?;
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            let text = format!("{stage}: {done} of {}", worlds.len());
            let progress = Progress { stage: &text, done: done as f64 / worlds.len() as f64 };
            if observer.progress(progress) {
                Ok(())
            } else {
                Err(ProveError::Other("stopped; the same command goes on".into()))
            }
        })
    })
}
