use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, TryRecvError, sync_channel};
use std::time::{Duration, Instant};

use hw_traits::{ErrorKind, Severity};

use crate::error::RecordError;
use crate::source::{Reading, Source};
use crate::store::{Bag, Folder, Store};
use crate::tally::Tally;

/// What is written within this time is on its way to the disk: a program that is killed loses no more.
const FLUSH: Duration = Duration::from_millis(250);
/// Readings are taken so often.
const BATCH: Duration = Duration::from_millis(20);
/// Readings that may wait for the disk.
const WAITING: usize = 1 << 16;

/// A reading on its way: the source's number, the arrival (s), and the reading or the device's error.
type Passed = (usize, f64, Result<Reading, String>);

/// Records sources until `stop`, each reading with its arrival on this computer's one clock (from zero) and its time on the device's: to the MCAP file
/// `out` where its name ends so, else to the folder `out`.
///
/// A device that is late or whose link broke is asked again; one with a fatal error, or at its end, ends alone.
///
/// # Errors
/// [`RecordError`]; what was recorded until then is kept.
pub fn record(
    sources: Vec<Source>,
    out: &Path,
    stop: &Arc<AtomicBool>,
) -> Result<BTreeMap<String, Tally>, RecordError> {
    let mut tallies: Vec<(String, Tally)> = Vec::new();
    for source in &sources {
        if tallies.iter().any(|(name, _)| *name == source.name) {
            return Err(RecordError::Twice { name: source.name.clone() });
        }
        tallies.push((source.name.clone(), Tally::default()));
    }
    let bag = out.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap"));
    let mut store: Box<dyn Store> =
        if bag { Box::new(Bag::new(out, &sources)?) } else { Box::new(Folder::new(out, &sources)?) };
    let (sender, readings) = sync_channel::<Passed>(WAITING);
    let zero = Instant::now();
    for (number, source) in sources.into_iter().enumerate() {
        let (sender, stop) = (sender.clone(), Arc::clone(stop));
        std::thread::spawn(move || listen(number, source, zero, &sender, &stop));
    }
    drop(sender);
    let mut flushed = Instant::now();
    let mut ended = false;
    while !ended {
        // Woken for each reading, this thread would take as long as those that read.
        std::thread::sleep(BATCH);
        ended = loop {
            match readings.try_recv() {
                Ok((number, arrival_s, Ok(reading))) => {
                    store.put(number, arrival_s, &reading)?;
                    tallies[number].1.count(arrival_s, reading.t_s);
                }
                Ok((number, _, Err(error))) => tallies[number].1.fail(error),
                Err(TryRecvError::Empty) => break false,
                Err(TryRecvError::Disconnected) => break true,
            }
        };
        if flushed.elapsed() >= FLUSH {
            flushed = Instant::now();
            store.flush()?;
        }
    }
    store.finish()?;
    Ok(tallies.into_iter().collect())
}

fn listen(number: usize, mut source: Source, zero: Instant, sender: &SyncSender<Passed>, stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed) {
        let answer = (source.next)();
        let kind = answer.as_ref().err().map(hw_traits::Error::kind);
        if kind == Some(ErrorKind::EndOfRecording) {
            return;
        }
        if kind.is_some() {
            // A line that is gone is not asked without a pause.
            std::thread::sleep(Duration::from_millis(5));
        }
        let passed = (number, zero.elapsed().as_secs_f64(), answer.map_err(|e| e.to_string()));
        if sender.send(passed).is_err() || kind.is_some_and(|k| k.severity() == Severity::Fatal) {
            return;
        }
    }
}
