//! What a diagnosis takes of memory: told beforehand, and kept within what there is.

use missing_physics::data::{Recording, Run};
use missing_physics::model::{Model, Scope};

use super::error::CommandError;

/// What the tool itself takes, with what `grain-pour` learns from, bytes.
const ITSELF: f64 = 256e6;
/// What is kept of a run and channel, for each shape that its noise may have: columns of derivatives and curves, and their products. Bytes
/// of all shapes together for each value of a column, and for each product; more than any recording of `docs/evidence` takes.
const COLUMN: f64 = 600.0;
const PRODUCT: f64 = 1000.0;
/// Columns of curves along each variable.
const CURVES: usize = 12;
/// The part of it where noise has one shape.
const WHITE: f64 = 0.05;
/// What is not worth a word.
const LITTLE: u64 = 1_000_000_000;

/// The most memory that a diagnosis of a recording takes, bytes. Where that is much, it is asked which parameters act on which channel in
/// the longest run: a parameter of another run, or of another joint, takes no room there.
pub(super) fn needed(model: &dyn Model, recording: &Recording) -> u64 {
    let curves = CURVES * recording.variables.len();
    let columns = (model.spec().parameters.len() + curves) as f64;
    let channels = recording.channels.len();
    let rows: usize = recording.runs.iter().map(Run::len).sum();
    let white = model.extensions().errors.is_some_and(|errors| errors.longest_correlation() <= 0.0);
    let shapes = if white { WHITE } else { 1.0 };
    let with = |squares: f64| {
        let products = recording.runs.len() as f64 * squares;
        let values = channels as f64 * columns * rows as f64;
        (ITSELF + shapes * (COLUMN * values + PRODUCT * products)) as u64
    };
    let all = with(channels as f64 * columns * columns);
    if all <= LITTLE {
        return all;
    }
    let square = |acting: usize| ((acting + curves) as f64).powi(2);
    acting(model, recording).map_or(all, |acting| with(acting.into_iter().map(square).sum()))
}

/// How many parameters act on each channel in the longest run, from where fits begin; nothing where the model predicts nothing there.
fn acting(model: &dyn Model, recording: &Recording) -> Option<Vec<usize>> {
    let run = recording.runs.iter().max_by_key(|run| run.len())?;
    let spec = model.spec();
    let (shared, mut nuisance) = (spec.starts(Scope::Shared), spec.starts(Scope::PerRun));
    model.nuisance_start(run, &mut nuisance);
    let (all_shared, all_nuisance): (Vec<usize>, Vec<usize>) =
        ((0..shared.len()).collect(), (0..nuisance.len()).collect());
    let values = run.len() * recording.channels.len();
    let mut out = vec![0.0; values];
    let mut columns = vec![0.0; values * (shared.len() + nuisance.len())];
    model.jacobian(run, &shared, &nuisance, &all_shared, &all_nuisance, &mut out, &mut columns).ok()?;
    let of_channel = |channel: usize| {
        let rows = channel * run.len()..(channel + 1) * run.len();
        columns.chunks(values).filter(|column| column[rows.clone()].iter().any(|v| *v != 0.0)).count()
    };
    Some((0..recording.channels.len()).map(of_channel).collect())
}

/// What is to be said before a diagnosis that needs so many bytes; nothing where it needs little.
///
/// # Errors
/// [`CommandError::Memory`] where it needs more than `most` or, where nothing is said, than is free.
pub(super) fn checked(needed: u64, most: Option<u64>) -> Result<Option<String>, CommandError> {
    if let Some(free) = most.or_else(free)
        && needed > free
    {
        return Err(CommandError::Memory { needed_gb: gigabytes(needed), free_gb: gigabytes(free) });
    }
    Ok((needed > LITTLE).then(|| said(needed)))
}

/// How much memory is needed, in words.
pub(super) fn said(needed: u64) -> String {
    format!("takes up to {:.1} GB of memory", gigabytes(needed))
}

fn gigabytes(bytes: u64) -> f64 {
    bytes as f64 / 1e9
}

/// Memory that is free, bytes: of the machine, and of the group to which this process is held; nothing where nobody says.
fn free() -> Option<u64> {
    let file = |path: &str| std::fs::read_to_string(path).ok();
    let machine = file("/proc/meminfo").and_then(|text| kilobytes(&text, "MemAvailable:"));
    let number = |path: &str| file(path)?.trim().parse::<u64>().ok();
    let group = number("/sys/fs/cgroup/memory.max")
        .zip(number("/sys/fs/cgroup/memory.current"))
        .map(|(most, taken)| most.saturating_sub(taken));
    machine.into_iter().chain(group).min()
}

/// The most memory that this process has had, bytes; nothing where nobody says.
pub fn most_memory() -> Option<u64> {
    kilobytes(&std::fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// A value of a line such as `VmHWM:  1234 kB`, in bytes.
fn kilobytes(text: &str, key: &str) -> Option<u64> {
    let value = text.lines().find_map(|line| line.strip_prefix(key))?;
    Some(value.split_whitespace().next()?.parse::<u64>().ok()? << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused_and_what_is_much_is_said() {
        assert_eq!(checked(1 << 20, Some(1 << 30)).ok(), Some(None));
        assert_eq!(
            checked(3_400_000_000, Some(1 << 40)).ok().flatten().as_deref(),
            Some("takes up to 3.4 GB of memory")
        );
        let refused = checked(3_400_000_000, Some(1 << 31)).map_err(|e| e.to_string());
        let why = refused.err().unwrap_or_default();
        assert!(why.contains("3.4 GB") && why.contains("2.1 GB") && why.contains("--memory"), "{why}");
    }

    #[test]
    fn sizes_are_read_from_what_the_system_says() {
        assert_eq!(kilobytes("Name: x\nVmHWM:\t  1024 kB\n", "VmHWM:"), Some(1 << 20));
        assert_eq!(kilobytes("VmHWM: many", "VmHWM:"), None);
    }
}
