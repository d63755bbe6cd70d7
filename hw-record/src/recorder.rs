use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use hw_traits::{Error as _, Severity};

use crate::source::Source;
use crate::tally::Tally;

/// What is written within this time is on its way to the disk: a program that is killed loses no more.
const FLUSH: Duration = Duration::from_millis(250);
/// Readings that may wait for the disk.
const WAITING: usize = 1 << 16;

/// Why nothing was recorded, or no more.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// A file cannot be written.
    #[error("{}: {error}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// Two sources have one name.
    #[error("two devices are called {name}, expected a name for each")]
    Twice {
        /// The name.
        name: String,
    },
}

/// A reading on its way: the source's number, the arrival (s), and the device's time with the numbers, or its error.
type Passed = (usize, f64, Result<(f64, Vec<f64>), String>);

/// Records sources to `FOLDER/NAME.csv` until `stop`, each row with its arrival on this computer's one clock (`arrival_s`, from zero) and its time on the
/// device's (`t_s`).
///
/// A device that is late or whose link broke is asked again; one with a fatal error ends alone.
///
/// # Errors
/// [`RecordError`]; what was recorded until then is kept.
pub fn record(
    sources: Vec<Source>,
    folder: &Path,
    stop: &Arc<AtomicBool>,
) -> Result<BTreeMap<String, Tally>, RecordError> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |error| RecordError::Io { path, error }
    };
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    let mut files: Vec<(PathBuf, BufWriter<File>)> = Vec::new();
    let mut tallies: Vec<(String, Tally)> = Vec::new();
    for source in &sources {
        if tallies.iter().any(|(name, _)| *name == source.name) {
            return Err(RecordError::Twice { name: source.name.clone() });
        }
        let path = folder.join(format!("{}.csv", source.name));
        let mut file = BufWriter::new(File::create(&path).map_err(failed(&path))?);
        writeln!(file, "arrival_s,t_s,{}", source.columns.join(",")).map_err(failed(&path))?;
        files.push((path, file));
        tallies.push((source.name.clone(), Tally::default()));
    }
    let (sender, readings) = sync_channel::<Passed>(WAITING);
    let zero = Instant::now();
    for (number, source) in sources.into_iter().enumerate() {
        let (sender, stop) = (sender.clone(), Arc::clone(stop));
        std::thread::spawn(move || listen(number, source, zero, &sender, &stop));
    }
    drop(sender);
    let mut flushed = Instant::now();
    loop {
        match readings.recv_timeout(FLUSH) {
            Ok((number, arrival_s, Ok((t_s, numbers)))) => {
                let (path, file) = &mut files[number];
                let row = numbers
                    .iter()
                    .fold(format!("{arrival_s:.6},{t_s:.6}"), |row, n| row + "," + &n.to_string());
                writeln!(file, "{row}").map_err(failed(path))?;
                tallies[number].1.count(arrival_s, t_s);
            }
            Ok((number, _, Err(error))) => tallies[number].1.fail(error),
            Err(RecvTimeoutError::Timeout) => {}
            // All have ended.
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if flushed.elapsed() >= FLUSH {
            flushed = Instant::now();
            for (path, file) in &mut files {
                file.flush().map_err(failed(path))?;
            }
        }
    }
    for (path, file) in &mut files {
        file.flush().map_err(failed(path))?;
    }
    Ok(tallies.into_iter().collect())
}

fn listen(number: usize, mut source: Source, zero: Instant, sender: &SyncSender<Passed>, stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed) {
        let answer = (source.next)();
        let fatal = answer.as_ref().is_err_and(|e| e.kind().severity() == Severity::Fatal);
        if answer.is_err() {
            // A line that is gone is not asked without a pause.
            std::thread::sleep(Duration::from_millis(5));
        }
        let passed = (number, zero.elapsed().as_secs_f64(), answer.map_err(|e| e.to_string()));
        if sender.send(passed).is_err() || fatal {
            return;
        }
    }
}
