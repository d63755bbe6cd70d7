//! The proof as a whole: worlds drawn and sealed, diagnosed, opened and scored.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use missing_physics::observer::{Observer, Progress};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use worlds::concealed::{Hidden, Maker, makers};

use crate::arguments::ProveArguments;
use crate::error::ProveError;
use crate::files::{make_folder, write_json, write_whole};
use crate::score::Score;
use crate::world::World;
use crate::{key, page, table};

/// What is being proven.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Plan {
    format: u32,
    version: String,
    domains: Vec<String>,
    worlds: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    kind: Option<String>,
    seed: u64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    runs: Option<usize>,
    /// SHA-256 of the answers, before any diagnosis.
    seal: String,
}

/// The domains of which worlds can be drawn.
pub fn provable() -> Vec<&'static str> {
    known().map(|m| m.name()).collect()
}

/// The makers of worlds whose domain is compiled in.
fn known() -> impl Iterator<Item = &'static dyn Maker> {
    makers().iter().copied().filter(|m| missing_physics_domains::find(m.domain()).is_ok())
}

/// Draws the worlds, seals their answers, diagnoses each from its files, opens the seal and scores; goes on where a proof of the same
/// arguments was stopped. Returns the score as text; JSON and a page lie in the folder.
///
/// # Errors
/// [`ProveError`]: an unknown domain, another proof in the folder, a file that cannot be written, or a stop.
pub fn prove(arguments: &ProveArguments, observer: &dyn Observer) -> Result<String, ProveError> {
    let Proof { worlds, keys, plan, pool } = Proof::begin(arguments, observer)?;
    each(&pool, &worlds, "diagnosing", observer, World::diagnose)?;
    // Only now are the answers opened.
    write_whole(&arguments.folder.join("keys.jsonl"), keys.concat())?;
    each(&pool, &worlds, "fitting the truth", observer, World::fit_oracle)?;
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

/// Draws the worlds and seals their answers, as [`prove`] begins. Returns the worlds' names (`trajectory/0003`), for [`prove_world`].
///
/// # Errors
/// As [`prove`].
pub fn seal_worlds(arguments: &ProveArguments, observer: &dyn Observer) -> Result<Vec<String>, ProveError> {
    let proof = Proof::begin(arguments, observer)?;
    Ok(proof.worlds.iter().map(|world| world.name().to_owned()).collect())
}

/// Diagnoses one world, wherever that is: its files lie in a folder of its name in the proof's, where [`prove`] of the same arguments finds
/// its work done.
///
/// # Errors
/// As [`prove`], and [`ProveError::UnknownWorld`].
pub fn prove_world(arguments: &ProveArguments, name: &str) -> Result<(), ProveError> {
    let (chosen, kind) = asked(arguments)?;
    let unknown = || ProveError::UnknownWorld { name: name.to_owned() };
    let (domain, number) = name.split_once('/').ok_or_else(unknown)?;
    let number: usize = number.parse().map_err(|_| unknown())?;
    let maker = chosen.into_iter().find(|maker| maker.name() == domain).ok_or_else(unknown)?;
    if number >= arguments.worlds {
        return Err(unknown());
    }
    let world = World::new(maker, number, kind, arguments);
    world.diagnose()?;
    world.fit_oracle()
}

/// What makes the worlds that were asked for, and what they hide.
fn asked(arguments: &ProveArguments) -> Result<(Vec<&'static dyn Maker>, Option<Hidden>), ProveError> {
    let mut chosen: Vec<&'static dyn Maker> =
        known().filter(|m| arguments.domain.as_deref().is_none_or(|d| d == m.name())).collect();
    if chosen.is_empty() {
        let domain = arguments.domain.clone().unwrap_or_default();
        return Err(ProveError::UnknownDomain { domain, known: provable() });
    }
    if arguments.worlds == 0 {
        return Err(ProveError::NoWorlds);
    }
    if arguments.runs == Some(0) {
        return Err(ProveError::NoRuns);
    }
    let unknown = |kind: &String| ProveError::UnknownKind { kind: kind.clone() };
    let hidden = |wanted: &String| key::hidden(wanted).ok_or_else(|| unknown(wanted));
    let kind = arguments.kind.as_ref().map(hidden).transpose()?;
    // Worlds of another kind would stand in, which nobody asked for.
    let has = |maker: &&dyn Maker| kind.is_none_or(|kind| maker.kind(kind) == kind);
    chosen.retain(|maker| has(maker));
    if chosen.is_empty() {
        let [domain, kind] =
            [&arguments.domain, &arguments.kind].map(|asked| asked.clone().unwrap_or_default());
        let known = known().filter(|maker| has(maker)).map(Maker::name).collect();
        return Err(ProveError::NoneOfKind { domain, kind, known });
    }
    Ok((chosen, kind))
}

/// A proof that has begun: its worlds are drawn, their answers sealed, and the plan lies in its folder.
struct Proof {
    worlds: Vec<World>,
    keys: Vec<String>,
    plan: Plan,
    pool: rayon::ThreadPool,
}

impl Proof {
    fn begin(arguments: &ProveArguments, observer: &dyn Observer) -> Result<Self, ProveError> {
        let (chosen, kind) = asked(arguments)?;
        let threads = arguments.threads;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| ProveError::Threads { threads, error })?;
        let worlds: Vec<World> = chosen
            .iter()
            .flat_map(|&maker| (0..arguments.worlds).map(move |number| (maker, number)))
            .map(|(maker, number)| World::new(maker, number, kind, arguments))
            .collect();
        report(observer, "drawing the worlds", 0.0)?;
        let keys: Vec<String> =
            pool.install(|| worlds.par_iter().map(|w| key::to_json(w.name(), &w.draw().key)).collect());
        let plan = Plan {
            format: 1,
            version: env!("CARGO_PKG_VERSION").into(),
            domains: chosen.iter().map(|m| m.name().to_owned()).collect(),
            worlds: arguments.worlds,
            kind: arguments.kind.clone(),
            seed: arguments.seed,
            runs: arguments.runs,
            seal: seal(&keys),
        };
        begin(&arguments.folder, &plan)?;
        Ok(Self { worlds, keys, plan, pool })
    }
}

fn seal(keys: &[String]) -> String {
    let mut hash = Sha256::new();
    keys.iter().for_each(|key| hash.update(key));
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Writes the plan, or finds that this very proof has begun before.
fn begin(folder: &Path, plan: &Plan) -> Result<(), ProveError> {
    make_folder(folder)?;
    let path = folder.join("plan.json");
    if !path.exists() {
        return write_json(&path, plan);
    }
    let text = missing_physics_domains::recording::read_text(&path)?;
    match serde_json::from_str::<Plan>(&text) {
        Ok(before) if before == *plan => Ok(()),
        _ => Err(ProveError::OtherProof { folder: folder.into() }),
    }
}

/// Does a piece of work on every world, in parallel; each world keeps what it has done. The observer is told of one at a time.
fn each<W: Sync>(
    pool: &rayon::ThreadPool,
    worlds: &[W],
    stage: &str,
    observer: &dyn Observer,
    work: impl Fn(&W) -> Result<(), ProveError> + Sync,
) -> Result<(), ProveError> {
    let done = Mutex::new(0);
    pool.install(|| {
        worlds.par_iter().try_for_each(|world| {
            work(world)?;
            let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
            *done += 1;
            let text = format!("{stage}: {done} of {}", worlds.len());
            report(observer, &text, f64::from(*done) / worlds.len() as f64)
        })
    })
}

/// Tells the observer how far the proof is, unless it asks for a stop.
fn report(observer: &dyn Observer, stage: &str, done: f64) -> Result<(), ProveError> {
    if observer.progress(Progress { stage, done }) { Ok(()) } else { Err(ProveError::Stopped) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    /// Counts calls that overlap, and those that go back.
    #[derive(Default)]
    struct Strict {
        busy: AtomicBool,
        overlapped: AtomicBool,
        last: Mutex<f64>,
    }

    impl Observer for Strict {
        fn progress(&self, progress: Progress<'_>) -> bool {
            if self.busy.swap(true, Ordering::SeqCst) {
                self.overlapped.store(true, Ordering::SeqCst);
            }
            std::thread::sleep(std::time::Duration::from_millis(2));
            let mut last = self.last.lock().unwrap();
            assert!(progress.done > *last);
            *last = progress.done;
            self.busy.store(false, Ordering::SeqCst);
            true
        }
    }

    #[test]
    fn the_observer_is_told_of_one_world_at_a_time() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
        let strict = Strict::default();
        each(&pool, &[(); 64], "nothing", &strict, |()| Ok(())).unwrap();
        assert!(!strict.overlapped.load(Ordering::SeqCst));
        assert_eq!(*strict.last.lock().unwrap(), 1.0);
    }
}
