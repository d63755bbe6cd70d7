//! The command line of `missing-physics`.

mod progress;

use std::borrow::Cow;
use std::io::{IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use missing_physics::engine::Options;
use missing_physics_cli::commands::{self, CommandError, DiagnoseArguments, Said, WatchArguments};
use missing_physics_domains::recording::program_of;
use missing_physics_import::Request;
use missing_physics_prove::{ProveArguments, prove};
use progress::{Loudness, Steps};

/// Says which physics a simulation leaves out, from recordings.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Arguments {
    /// Print errors alone: no report, no progress.
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Print each step and the time that it took, on standard error.
    #[arg(long, short, global = true, conflicts_with = "quiet")]
    verbose: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Diagnoses recordings: what does the simulation miss, where, and what explains it?
    Diagnose {
        /// The recording's folder (it holds recording.toml); of several each has a diagnosis, and outputs are folders with a file each.
        #[arg(required = true, value_name = "FOLDER")]
        folders: Vec<PathBuf>,
        /// Write the answer as JSON as well; - for standard output (the text is then on standard error).
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
        /// Write the report as one HTML page as well; FOLDER/ has index.html over all of them.
        #[arg(long, value_name = "FILE")]
        html: Option<PathBuf>,
        /// Write a picture of where it misses most as SVG as well.
        #[arg(long, value_name = "FILE")]
        svg: Option<PathBuf>,
        /// Write the repaired model as well, for `predict`.
        #[arg(long, value_name = "FILE")]
        write_model: Option<PathBuf>,
        /// Write the rows of the experiment that is proposed next as CSV as well: when to measure, what to command.
        #[arg(long, value_name = "FILE")]
        write_next: Option<PathBuf>,
        /// Seed of every random draw.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Number of threads; 0 for all cores. The answer does not depend on it.
        #[arg(long, default_value_t = 0)]
        threads: usize,
        /// Rate of false alarms that is put up with, above 0 and below 0.5.
        #[arg(long, default_value_t = 0.05)]
        alpha: f64,
        /// Start the program that the recording names (`custom`): recordings are passed on, and it may do anything.
        #[arg(long)]
        allow_command: bool,
        /// The most memory that it may take, GB; what is free without.
        #[arg(long, value_name = "GB")]
        memory: Option<f64>,
    },
    /// Makes a recording of a laboratory's files: CSV, MCAP and ROS 2 bags, Parquet, NumPy, MATLAB, WAV.
    Import {
        /// Files, or the folder of a bag or data set; several files are runs of one recording.
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// What it is a recording of (see `domains`); without it the columns are listed.
        #[arg(long)]
        domain: Option<String>,
        /// The folder to make; without it nothing is written.
        #[arg(long)]
        out: Option<PathBuf>,
        /// A column: z_m="Höhe (mm)", z_m="-Höhe (mm) + 1.2" (offset in m), t_s="Zeit [ms]" where the file says no unit, x_m= for none.
        #[arg(long = "map", value_name = "COLUMN=NAME")]
        maps: Vec<String>,
        /// A value of recording.toml: liquid_mass_kg="282 g", noise.z_m=0.002.
        #[arg(long = "set", value_name = "KEY=VALUE")]
        settings: Vec<String>,
        /// The column that tells runs apart.
        #[arg(long, value_name = "NAME")]
        run: Option<String>,
        /// A pause longer than this begins a new run.
        #[arg(long, value_name = "SECONDS")]
        gap: Option<f64>,
        /// So many rows are a run.
        #[arg(long, value_name = "ROWS")]
        every: Option<usize>,
        /// Rows a second, where no column tells the time.
        #[arg(long, value_name = "HZ")]
        rate: Option<f64>,
        /// Take recording.toml from this recording.
        #[arg(long, value_name = "FOLDER")]
        like: Option<PathBuf>,
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
        /// Start the program that the recording names (`custom`).
        #[arg(long)]
        allow_command: bool,
    },
    /// Proves the tool on concealed effects: draws worlds, seals the answers, diagnoses, opens the seal, scores.
    Prove {
        /// One domain; all of which worlds can be drawn without it.
        #[arg(long)]
        domain: Option<String>,
        /// Worlds of each domain.
        #[arg(long, default_value_t = 100)]
        worlds: usize,
        /// One kind of worlds (nothing, one, two, unlisted, leftover, imitated, local); all in turns without it.
        #[arg(long)]
        kind: Option<String>,
        /// Seed of the worlds.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Of each recording the first runs only, so many; all without it.
        #[arg(long)]
        runs: Option<usize>,
        /// The folder of the proof; one that was stopped goes on.
        #[arg(long, default_value = "proof")]
        out: PathBuf,
        /// Number of threads; 0 for all cores. The score does not depend on it.
        #[arg(long, default_value_t = 0)]
        threads: usize,
    },
    /// Watches a recording that grows: has anything changed since its first runs, from which run on, and what?
    Watch {
        /// The recording's folder, whose files grow.
        folder: PathBuf,
        /// So many runs at the beginning are those in which all was well.
        #[arg(long, default_value_t = 5, value_name = "RUNS")]
        reference: usize,
        /// Rate of false alarms over all looks together, above 0 and below 0.5.
        #[arg(long, default_value_t = 0.05)]
        alpha: f64,
        /// A last run is whole once the files have not changed for so long.
        #[arg(long, default_value_t = 2.0, value_name = "SECONDS")]
        settle: f64,
        /// End once nothing has come for so long.
        #[arg(long, value_name = "SECONDS")]
        end_after: Option<f64>,
        /// Rows of data.csv come on standard input, and are written behind those that are there.
        #[arg(long)]
        pipe: bool,
        /// Start the program that the recording names (`custom`).
        #[arg(long)]
        allow_command: bool,
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

fn run(command: Command, loudness: Loudness) -> Result<Said, CommandError> {
    match command {
        Command::Diagnose {
            folders,
            json,
            html,
            svg,
            write_model,
            write_next,
            seed,
            threads,
            alpha,
            allow_command,
            memory,
        } => {
            folders.iter().try_for_each(|folder| permit(folder, allow_command))?;
            on_interrupt("nothing was written".into());
            let options = Options { seed, ..Options::with_alpha(alpha) };
            let threads = useful(threads);
            let many = commands::into_folders(&folders, html.as_deref());
            let folder = folders.first().cloned().unwrap_or_default();
            let arguments = DiagnoseArguments {
                folder,
                json,
                html,
                svg,
                model: write_model,
                next: write_next,
                options,
                threads,
                memory: memory.map(|gigabytes| (1e9 * gigabytes) as u64),
                say: (loudness != Loudness::Quiet).then_some(progress::line),
                verbose: loudness == Loudness::Verbose,
            };
            let steps = Steps::new(loudness);
            if many {
                commands::diagnose_many(&folders, &arguments, &steps)
            } else {
                commands::diagnose(&arguments, &steps)
            }
        }
        Command::Import { files, domain, out, maps, settings, run, gap, every, rate, like } => {
            let (gap_s, rate_hz) = (gap, rate);
            let request =
                Request { files, maps, settings, run, gap_s, every, rate_hz, like, ..Request::default() };
            Ok(commands::import(&request, domain.as_deref(), out.as_deref())?.into())
        }
        Command::Predict { model, folder, csv, allow_command } => {
            permit(&folder, allow_command)?;
            on_interrupt("nothing was written".into());
            commands::predict(&model, &folder, csv.as_deref())
        }
        Command::Prove { domain, worlds, kind, seed, runs, out, threads } => {
            let threads = useful(threads);
            on_interrupt(format!(
                "worlds that were judged are kept in {}, the same command goes on",
                out.display()
            ));
            let arguments = ProveArguments { domain, worlds, kind, seed, runs, folder: out, threads };
            Ok(prove(&arguments, &Steps::new(loudness))?.into())
        }
        Command::Watch { folder, reference, alpha, settle, end_after, pipe, allow_command } => {
            permit(&folder, allow_command)?;
            let options = Options::with_alpha(alpha);
            let arguments =
                WatchArguments { folder, reference, options, settle_s: settle, end_after_s: end_after, pipe };
            watch(&arguments, loudness)?;
            Ok(Said::default())
        }
        Command::Domains => Ok(commands::domains().into()),
        Command::Check { folder } => Ok(commands::check(&folder)?.into()),
        Command::New { domain, folder } => Ok(commands::new(&domain, &folder)?.into()),
    }
}

/// Prints what changes in a recording that grows.
fn watch(arguments: &WatchArguments, loudness: Loudness) -> Result<(), CommandError> {
    on_interrupt(if arguments.pipe {
        format!("rows that came are kept in {}", arguments.folder.join("data.csv").display())
    } else {
        "nothing was written".into()
    });
    commands::watch(arguments, &mut |line| {
        if loudness != Loudness::Quiet {
            let mut out = std::io::stdout().lock();
            // A reader that has gone away misses what is said, no more.
            let _ = writeln!(out, "{}", shown(line, std::io::stdout().is_terminal()));
        }
    })
}

/// Asks, on a terminal, whether the program that a recording names may be started.
///
/// # Errors
/// [`CommandError::Program`] where nobody allows it.
fn permit(folder: &Path, allowed: bool) -> Result<(), CommandError> {
    let Some(command) = program_of(folder).filter(|_| !allowed) else { return Ok(()) };
    let program = command.join(" ");
    let refused = || CommandError::Program { folder: folder.into(), program: program.clone() };
    let (stdin, mut stderr) = (std::io::stdin(), std::io::stderr());
    if !(stdin.is_terminal() && stderr.is_terminal()) {
        return Err(refused());
    }
    let question = format!("{}: starts the program {program}\nmay it run? [y/N] ", folder.display());
    let mut answer = String::new();
    let asked =
        stderr.write_all(shown(&question, true).as_bytes()).and_then(|()| stdin.read_line(&mut answer));
    let yes = ["y", "yes"].contains(&answer.trim().to_lowercase().as_str());
    if asked.is_ok() && yes { Ok(()) } else { Err(refused()) }
}

/// Says what is kept where the work is interrupted, and ends what recordings have started.
fn on_interrupt(kept: String) {
    // Without a handler an interruption ends the program as well, and says nothing.
    let _ = ctrlc::set_handler(move || {
        missing_physics_domains::custom::end_all();
        let _ = writeln!(std::io::stderr(), "\nmissing-physics: stopped; {}", shown(&kept, true));
        std::process::exit(130);
    });
}

/// No more threads than can do any good: four for each core.
fn useful(threads: usize) -> usize {
    threads.min(4 * std::thread::available_parallelism().map_or(1, usize::from))
}

/// A text whose control characters move no cursor, where a terminal would obey them.
fn shown(text: &str, terminal: bool) -> Cow<'_, str> {
    let obeyed = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !terminal || !text.contains(obeyed) {
        return text.into();
    }
    let escaped = |c: char| if obeyed(c) { c.escape_default().to_string() } else { c.to_string() };
    text.chars().map(escaped).collect::<String>().into()
}

/// Prints what a command says, then writes its files.
fn deliver(said: &Said, quiet: bool) -> Result<(), String> {
    let printed = if quiet {
        Ok(())
    } else if said.takes_stdout() {
        let mut err = std::io::stderr().lock();
        err.write_all(shown(&said.text, std::io::stderr().is_terminal()).as_bytes())
    } else {
        let mut out = std::io::stdout().lock();
        let text = shown(&said.text, std::io::stdout().is_terminal());
        out.write_all(text.as_bytes()).and_then(|()| out.flush())
    };
    if let Some(note) = said.note.as_ref().filter(|_| !quiet) {
        // A reader that has gone away misses a note, no more.
        let _ = writeln!(std::io::stderr(), "note: {}", shown(note, std::io::stderr().is_terminal()));
    }
    said.write_files().map_err(|error| error.to_string())?;
    match printed {
        // A reader that has gone away is no failure of ours.
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(format!("standard output: {error}"))
        }
        _ => said.failure.clone().map_or(Ok(()), Err),
    }
}

fn main() -> ExitCode {
    // Clap prints its own messages, and leaves with status 2 for a wrong call.
    let Arguments { quiet, verbose, command } = Arguments::parse();
    let loudness = match (quiet, verbose) {
        (true, _) => Loudness::Quiet,
        (_, true) => Loudness::Verbose,
        _ => Loudness::Usual,
    };
    let done = run(command, loudness);
    if let Err(CommandError::Unsound { text, .. }) = &done
        && !quiet
    {
        // What was taken for what is what helps; a reader that has gone away misses nothing.
        let _ = std::io::stdout().lock().write_all(shown(text, std::io::stdout().is_terminal()).as_bytes());
    }
    let delivered = done.map_err(|error| error.to_string()).and_then(|said| deliver(&said, quiet));
    match delivered {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "missing-physics: {}", shown(&error, true));
            ExitCode::from(2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::shown;

    /// A terminal would set its title, clear its screen or go back to the line's beginning; lines and tables stay.
    #[test]
    fn a_terminal_obeys_no_name() {
        let hostile = "a\u{1b}]0;x\u{7}\rb\u{9b}2J\tc\n";
        assert_eq!(shown(hostile, false), hostile);
        assert_eq!(shown(hostile, true), "a\\u{1b}]0;x\\u{7}\\rb\\u{9b}2J\tc\n");
    }
}
