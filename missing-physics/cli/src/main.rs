//! The command line of `missing-physics`.

use std::io::{IsTerminal as _, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use missing_physics::engine::Options;
use missing_physics::observer::{Observer, Progress};
use missing_physics_cli::commands::{self, CommandError, DiagnoseArguments};
use missing_physics_prove::{ProveArguments, prove};

/// Says which physics a simulation leaves out, from recordings.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Diagnoses a recording: what does the simulation miss, where, and what explains it?
    Diagnose {
        /// The recording's folder (it holds recording.toml).
        folder: PathBuf,
        /// Write the answer as JSON as well.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
        /// Write the report as one HTML page as well.
        #[arg(long, value_name = "FILE")]
        html: Option<PathBuf>,
        /// Write a picture of where it misses most as SVG as well.
        #[arg(long, value_name = "FILE")]
        svg: Option<PathBuf>,
        /// Write the repaired model as well, for `predict`.
        #[arg(long, value_name = "FILE")]
        write_model: Option<PathBuf>,
        /// Seed of every random draw.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Number of threads; 0 for all cores. The answer does not depend on it.
        #[arg(long, default_value_t = 0)]
        threads: usize,
        /// Rate of false alarms that is put up with, above 0 and below 0.5.
        #[arg(long, default_value_t = 0.05)]
        alpha: f64,
    },
    /// Predicts a recording by a repaired model: simulated channels as CSV, with intervals.
    Predict {
        /// The model that `diagnose --write-model` wrote.
        model: PathBuf,
        /// The recording's folder; cells of its table may be empty, where nothing was measured yet.
        folder: PathBuf,
        /// Write the table to a file instead of printing it.
        #[arg(long, value_name = "FILE")]
        csv: Option<PathBuf>,
    },
    /// Proves the tool on concealed effects: draws worlds, seals the answers, diagnoses, opens the seal, scores.
    Prove {
        /// One domain; all of which worlds can be drawn without it.
        #[arg(long)]
        domain: Option<String>,
        /// Worlds of each domain.
        #[arg(long, default_value_t = 100)]
        worlds: usize,
        /// One kind of worlds (nothing, one, two, unlisted, leftover, imitated); all in turns without it.
        #[arg(long)]
        kind: Option<String>,
        /// Seed of the worlds.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// The folder of the proof; one that was stopped goes on.
        #[arg(long, default_value = "proof")]
        out: PathBuf,
        /// Number of threads; 0 for all cores. The score does not depend on it.
        #[arg(long, default_value_t = 0)]
        threads: usize,
    },
    /// Lists what the tool knows: domains, baselines, mechanisms, columns.
    Domains,
    /// Reads and validates a recording, no more.
    Check {
        /// The recording's folder.
        folder: PathBuf,
    },
    /// Writes a commented template of a recording.
    New {
        /// The domain (see `domains`).
        domain: String,
        /// The folder to make.
        folder: PathBuf,
    },
}

/// A bar on a terminal, nothing in a pipe.
struct Bar(Option<ProgressBar>);

impl Bar {
    fn new() -> Self {
        if !std::io::stderr().is_terminal() {
            return Self(None);
        }
        let bar = ProgressBar::new(100);
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {msg}") {
            bar.set_style(style);
        }
        Self(Some(bar))
    }
}

impl Observer for Bar {
    fn progress(&self, progress: Progress<'_>) -> bool {
        if let Some(bar) = &self.0 {
            bar.set_message(progress.stage.to_owned());
            bar.set_position((100.0 * progress.done) as u64);
        }
        true
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Some(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}

fn run(command: Command) -> Result<String, CommandError> {
    match command {
        Command::Diagnose { folder, json, html, svg, write_model, seed, threads, alpha } => {
            let options = Options { alpha, seed, ..Options::default() };
            let arguments =
                DiagnoseArguments { folder, json, html, svg, model: write_model, options, threads };
            commands::diagnose(&arguments, &Bar::new())
        }
        Command::Predict { model, folder, csv } => commands::predict(&model, &folder, csv.as_deref()),
        Command::Prove { domain, worlds, kind, seed, out, threads } => {
            Ok(prove(&ProveArguments { domain, worlds, kind, seed, folder: out, threads }, &Bar::new())?)
        }
        Command::Domains => Ok(commands::domains()),
        Command::Check { folder } => commands::check(&folder),
        Command::New { domain, folder } => commands::new(&domain, &folder),
    }
}

fn main() -> ExitCode {
    // Clap prints its own messages, and leaves with status 2 for a wrong call.
    match run(Arguments::parse().command) {
        Ok(text) => {
            // A reader that has gone away is no failure of ours.
            let _ = std::io::stdout().lock().write_all(text.as_bytes());
            ExitCode::SUCCESS
        }
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "missing-physics: {error}");
            ExitCode::from(2)
        }
    }
}
