//! Thousands of simulations: in parallel, resumable, in shards that merge.
//!
//! A campaign's file is text: a line that says which campaign it is, then a line a simulation, `index,theta...,x...`, or
//! `index,theta...,failed,reason`. Numbers are written so that reading gives the same bits.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::points::Points;
use crate::prior::Prior;
use crate::simulations::Simulations;

/// Why a simulation gave nothing; recorded with its parameters, and skipped.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct SimulationFailure {
    /// In words.
    pub reason: String,
}

/// Something that turns parameters into features, with chance in it or not.
pub trait Simulator: Sync {
    /// Numbers a simulation gives.
    fn x_dim(&self) -> usize;

    /// Simulates once. All chance has to come from `rng`, which is this draw's own.
    ///
    /// # Errors
    /// [`SimulationFailure`] for a simulation that gives nothing. One that gives NaN, infinity or the wrong number of features
    /// is recorded as failed as well.
    fn simulate(&self, theta: &[f64], rng: &mut ChaCha8Rng) -> Result<Vec<f64>, SimulationFailure>;
}

/// Part `index` of `count` parts of a campaign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// From 0, below `count`.
    pub index: usize,
    /// At least 1.
    pub count: usize,
}

impl Shard {
    /// The whole campaign.
    pub const WHOLE: Self = Self { index: 0, count: 1 };
}

/// What is simulated. Draw `i` has its own seed, whichever shard or thread runs it, and when.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Campaign {
    /// Where parameters are drawn from.
    pub prior: Prior,
    /// Numbers a simulation gives.
    pub x_dim: usize,
    /// Simulations, all shards together.
    pub count: usize,
    /// Seed of the whole.
    pub seed: u64,
}

/// One simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Number of the draw in the campaign, from 0.
    pub index: usize,
    /// Parameters of the draw.
    pub theta: Vec<f64>,
    /// Its features, or why it failed.
    pub outcome: Result<Vec<f64>, SimulationFailure>,
}

/// Records of a campaign, by index.
#[derive(Debug, Clone, PartialEq)]
pub struct Results {
    /// What was simulated.
    pub campaign: Campaign,
    /// By index; those not yet run are missing.
    pub records: BTreeMap<usize, Record>,
}

/// First line of a campaign's file.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Header {
    format: String,
    version: u32,
    campaign: Campaign,
}

const FORMAT: &str = "bayes-sim campaign";
const VERSION: u32 = 1;
/// Most draws between two writes and two looks at the stop flag.
const CHUNK: usize = 256;
/// After draws that took less than this, in s, twice as many come between two writes.
const SOON_S: f64 = 2.5;

impl Campaign {
    /// The parameters and the generator of draw `index`.
    fn draw(&self, index: usize) -> (Vec<f64>, ChaCha8Rng) {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(index as u64);
        let theta = self.prior.sample(&mut rng);
        (theta, rng)
    }

    fn simulate(&self, simulator: &dyn Simulator, index: usize) -> Record {
        let (theta, mut rng) = self.draw(index);
        let outcome = simulator.simulate(&theta, &mut rng).and_then(|x| {
            let fault = if x.len() != self.x_dim {
                Some(format!("{} features instead of {}", x.len(), self.x_dim))
            } else {
                x.iter().position(|v| !v.is_finite()).map(|j| format!("feature {j} is {}", x[j]))
            };
            fault.map_or(Ok(x), |reason| Err(SimulationFailure { reason }))
        });
        Record { index, theta, outcome }
    }

    /// Runs what is missing of a shard and appends it to the file, which is made if it is not there. `progress` is told every few
    /// seconds (after a draw for each thread, where draws take longer) how many are done, of how many; once `stop` is true, the run ends there and a later call goes on.
    ///
    /// # Errors
    /// [`Error::Setting`] for a shard that does not exist; [`Error::Mismatch`] if the file holds another campaign or the
    /// simulator gives another number of features; [`Error::Io`], [`Error::Format`].
    pub fn run(
        &self,
        simulator: &dyn Simulator,
        shard: Shard,
        path: &Path,
        progress: &dyn Fn(usize, usize),
        stop: &AtomicBool,
    ) -> Result<Results, Error> {
        if shard.index >= shard.count {
            return Err(Error::Setting {
                name: "shard",
                value: shard.index as f64,
                rule: "below their number",
            });
        }
        if simulator.x_dim() != self.x_dim {
            return Err(Error::Mismatch {
                what: "numbers of features",
                left: self.x_dim.to_string(),
                right: simulator.x_dim().to_string(),
            });
        }
        let mut results = if path.exists() { self.resume(path)? } else { self.create(path)? };
        let wanted = (0..self.count).filter(|i| i % shard.count == shard.index);
        let missing: Vec<usize> = wanted.clone().filter(|i| !results.records.contains_key(i)).collect();
        let total = wanted.count();
        let mut done = total - missing.len();
        progress(done, total);
        let file = OpenOptions::new().append(true).open(path).map_err(Error::io(path))?;
        let mut writer = BufWriter::new(file);
        let (mut left, mut size) = (missing.as_slice(), rayon::current_num_threads());
        while !left.is_empty() && !stop.load(Ordering::Relaxed) {
            let (chunk, rest) = left.split_at(size.min(left.len()));
            left = rest;
            let begin = Instant::now();
            let records: Vec<Record> = chunk.par_iter().map(|&i| self.simulate(simulator, i)).collect();
            for record in records {
                writeln!(writer, "{}", record.line()).map_err(Error::io(path))?;
                results.records.insert(record.index, record);
            }
            writer.flush().map_err(Error::io(path))?;
            done += chunk.len();
            progress(done, total);
            if begin.elapsed().as_secs_f64() < SOON_S {
                size = (2 * size).min(CHUNK);
            }
        }
        Ok(results)
    }

    fn create(&self, path: &Path) -> Result<Results, Error> {
        let header = Header { format: FORMAT.to_owned(), version: VERSION, campaign: self.clone() };
        let line = serde_json::to_string(&header)
            .map_err(|e| Error::Format { path: path.to_owned(), reason: e.to_string() })?;
        std::fs::write(path, line + "\n").map_err(Error::io(path))?;
        Ok(Results { campaign: self.clone(), records: BTreeMap::new() })
    }

    /// Reads what is there; a last line that was cut off in writing is taken away.
    fn resume(&self, path: &Path) -> Result<Results, Error> {
        let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(Error::io(path))?;
        let mut text = String::new();
        file.read_to_string(&mut text).map_err(Error::io(path))?;
        let whole = text.rfind('\n').map_or(0, |i| i + 1);
        if whole == 0 {
            return self.create(path);
        }
        if whole < text.len() {
            file.set_len(whole as u64).map_err(Error::io(path))?;
            file.seek(SeekFrom::End(0)).map_err(Error::io(path))?;
        }
        let results = Results::parse(&text[..whole], path)?;
        same_campaign(self, &results.campaign)?;
        Ok(results)
    }
}

fn same_campaign(a: &Campaign, b: &Campaign) -> Result<(), Error> {
    if a == b {
        return Ok(());
    }
    Err(Error::Mismatch { what: "campaigns", left: format!("{a:?}"), right: format!("{b:?}") })
}

impl Record {
    fn line(&self) -> String {
        let numbers = |v: &[f64]| v.iter().map(|n| format!(",{n}")).collect::<String>();
        let end = match &self.outcome {
            Ok(x) => numbers(x),
            Err(failure) => format!(",failed,{}", failure.reason.replace(['\n', '\r'], " ")),
        };
        format!("{}{}{end}", self.index, numbers(&self.theta))
    }

    fn parse(line: &str, campaign: &Campaign) -> Option<Self> {
        let d = campaign.prior.dim();
        let mut fields = line.splitn(d + 2, ',');
        let index = fields.next()?.parse().ok().filter(|i| *i < campaign.count)?;
        let theta = (0..d).map(|_| fields.next()?.parse().ok()).collect::<Option<Vec<f64>>>()?;
        let rest = fields.next()?;
        let outcome = match rest.strip_prefix("failed,") {
            Some(reason) => Err(SimulationFailure { reason: reason.to_owned() }),
            None => {
                let x: Vec<f64> = rest.split(',').map(|v| v.parse().ok()).collect::<Option<_>>()?;
                (x.len() == campaign.x_dim).then_some(Ok(x))?
            }
        };
        Some(Self { index, theta, outcome })
    }
}

impl Results {
    /// Reads a campaign's file.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for another kind or version of file, or a line that cannot be read.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let mut text = String::new();
        File::open(path).and_then(|mut f| f.read_to_string(&mut text)).map_err(Error::io(path))?;
        let whole = text.rfind('\n').map_or(0, |i| i + 1);
        Self::parse(&text[..whole], path)
    }

    fn parse(text: &str, path: &Path) -> Result<Self, Error> {
        let bad = |reason: String| Error::Format { path: path.to_owned(), reason };
        let mut lines = text.lines();
        let first = lines.next().unwrap_or_default();
        let header: Header =
            serde_json::from_str(first).map_err(|e| bad(format!("no campaign's file: {e} in line 1")))?;
        if header.format != FORMAT || header.version != VERSION {
            let got = format!("{} version {}", header.format, header.version);
            return Err(bad(format!("expected {FORMAT} version {VERSION}, got {got}")));
        }
        let mut records = BTreeMap::new();
        for (i, line) in lines.enumerate() {
            let record = Record::parse(line, &header.campaign)
                .ok_or_else(|| bad(format!("line {} cannot be read: {line:?}", i + 2)))?;
            records.insert(record.index, record);
        }
        Ok(Self { campaign: header.campaign, records })
    }

    /// Puts shards together.
    ///
    /// # Errors
    /// [`Error::TooFew`] for none; [`Error::Mismatch`] for shards of different campaigns.
    pub fn merge(shards: impl IntoIterator<Item = Self>) -> Result<Self, Error> {
        let mut shards = shards.into_iter();
        let mut out = shards.next().ok_or(Error::TooFew { least: 1, got: 0 })?;
        for shard in shards {
            same_campaign(&out.campaign, &shard.campaign)?;
            out.records.extend(shard.records);
        }
        Ok(out)
    }

    /// Draws not yet run.
    pub fn missing(&self) -> usize {
        self.campaign.count - self.records.len()
    }

    /// Simulations that failed, with their parameters and reasons.
    pub fn failures(&self) -> impl Iterator<Item = (&Record, &SimulationFailure)> {
        self.records.values().filter_map(|r| r.outcome.as_ref().err().map(|e| (r, e)))
    }

    /// Simulations that succeeded, in order.
    ///
    /// # Errors
    /// [`Error::TooFew`] below 50.
    pub fn simulations(&self) -> Result<Simulations, Error> {
        let (mut theta, mut x) = (Points::new(self.campaign.prior.dim()), Points::new(self.campaign.x_dim));
        for record in self.records.values() {
            if let Ok(features) = &record.outcome {
                theta.push(&record.theta)?;
                x.push(features)?;
            }
        }
        Simulations::new(theta, x)
    }
}
