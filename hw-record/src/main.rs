//! The command line of `hw-record`.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::{Parser, Subcommand};
use hw_drivers::emulator::{AtiEmulator, UrEmulator};
use hw_record::{record, source};

type Done = Result<(), Box<dyn std::error::Error>>;

/// Records devices to a folder of CSV, WAV and PNG files, or to an MCAP file, on one clock.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Records until it is stopped (Ctrl-C), or for a time.
    Record {
        /// Devices, with commas between: ati=192.0.2.1:49152, ur=192.0.2.2:30004, robotiq=192.0.2.2:63352, dynamixel=/dev/ttyUSB0@57600?id=1,
        /// dcon=192.0.2.3:4001?module=1&pa=200000, depth=FOLDER?fx=600&fy=600&cx=320&cy=240, wav=FILE; NAME:KIND=... where two are of a kind.
        #[arg(long, value_delimiter = ',', required = true, value_name = "KIND=ADDRESS")]
        device: Vec<String>,
        /// The folder to write to, or an MCAP file (NAME.mcap).
        #[arg(long)]
        out: PathBuf,
        /// Record for so long; until it is stopped without.
        #[arg(long, value_name = "SECONDS")]
        seconds: Option<f64>,
    },
    /// Emulates a force sensor at 1 kHz and a robot at 500 Hz on 127.0.0.1 until its standard input ends; prints --device's value.
    Emulate,
    /// Records the emulated devices, and prints how much of a core, what memory it takes, and what is lost.
    Rehearse {
        /// How long.
        #[arg(long, default_value_t = 60.0, value_name = "SECONDS")]
        seconds: f64,
        /// The folder or MCAP file to write to.
        #[arg(long)]
        out: PathBuf,
    },
}

fn print(line: &str) {
    // A reader that has gone away misses what is said, no more.
    let _ = writeln!(std::io::stdout().lock(), "{line}");
}

fn keep(devices: &[String], out: &std::path::Path, seconds: Option<f64>) -> Done {
    let sources = devices.iter().map(|d| source(d)).collect::<Result<Vec<_>, _>>()?;
    let stop = Arc::new(AtomicBool::new(false));
    let interrupted = Arc::clone(&stop);
    ctrlc::set_handler(move || interrupted.store(true, Ordering::Relaxed))?;
    if let Some(duration) = seconds.and_then(|s| Duration::try_from_secs_f64(s).ok()) {
        let timed = Arc::clone(&stop);
        std::thread::spawn(move || {
            std::thread::sleep(duration);
            timed.store(true, Ordering::Relaxed);
        });
    }
    for (name, tally) in record(sources, out, &stop)? {
        print(&format!("{name}: {tally}"));
    }
    Ok(())
}

fn emulate() -> Done {
    let sensor = AtiEmulator::start(1000.0, |t| [t.sin(), 0.0, -9.81, 0.0, 0.0, 0.1])?;
    let robot = UrEmulator::start([0.3, 0.1, 0.4, 0.0, 0.0, 0.0])?;
    print(&format!("ati={},ur={}", sensor.address(), robot.address()));
    std::io::copy(&mut std::io::stdin(), &mut std::io::sink())?;
    Ok(())
}

/// A child that ends with this program.
struct Emulator(Child);

impl Drop for Emulator {
    fn drop(&mut self) {
        // Its input ends with the pipe; it is waited for.
        drop(self.0.stdin.take());
        let _ = self.0.wait();
    }
}

/// Processor time (s) and memory (MB) of this process, from /proc.
fn taken() -> Option<(f64, f64)> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks: f64 = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    let pages: f64 = fields.get(21)?.parse().ok()?;
    // Linux counts in hundredths of a second for programs, and in pages of 4096 bytes here.
    Some((ticks / 100.0, pages * 4096.0 / 1e6))
}

fn rehearse(seconds: f64, out: &std::path::Path) -> Done {
    let program = std::env::current_exe()?;
    let mut child =
        Command::new(program).arg("emulate").stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    let stdout = child.stdout.take();
    let _emulator = Emulator(child);
    let mut devices = String::new();
    if let Some(stdout) = stdout {
        std::io::BufRead::read_line(&mut std::io::BufReader::new(stdout), &mut devices)?;
    }
    let devices: Vec<String> = devices.trim().split(',').map(str::to_owned).collect();
    let middle = std::thread::spawn(move || {
        std::thread::sleep(Duration::try_from_secs_f64(0.1 * seconds).unwrap_or_default());
        taken()
    });
    let begin = Instant::now();
    keep(&devices, out, Some(seconds))?;
    let early = middle.join().ok().flatten();
    if let (Some((cpu_s, memory_mb)), Some((_, early_mb))) = (taken(), early) {
        let share = 100.0 * cpu_s / begin.elapsed().as_secs_f64();
        print(&format!(
            "{seconds} s: {share:.1} % of a core, {early_mb:.1} MB after a tenth of the time, {memory_mb:.1} MB at the end"
        ));
    }
    Ok(())
}

fn main() -> ExitCode {
    let done = match Arguments::parse().command {
        Task::Record { device, out, seconds } => keep(&device, &out, seconds),
        Task::Emulate => emulate(),
        Task::Rehearse { seconds, out } => rehearse(seconds, &out),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "hw-record: {error}");
            ExitCode::from(2)
        }
    }
}
