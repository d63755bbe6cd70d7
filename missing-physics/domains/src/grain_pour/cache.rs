//! Pours of rigs other than the bundled one, kept for the next recording.

use std::path::PathBuf;

use granular_infer::campaign::{Grains, Ranges, Rig};
use granular_infer::shard;
use missing_physics::observer::{Observer, Progress};
use rayon::prelude::*;

use crate::recording::ReadError;

/// Seed of all campaigns.
pub(super) const SEED: u64 = 1;
/// Pours of a new campaign.
const POURS: u32 = 500;
/// Pours between two writes of the cache.
const CHUNK: u32 = 20;

/// Pours that were made before, and those that are missing of [`POURS`].
pub(super) fn cached(
    rig: &Rig,
    ranges: &Ranges,
    file: Option<PathBuf>,
    observer: &dyn Observer,
) -> Result<Vec<(u32, Grains)>, ReadError> {
    let mut bytes = file.as_ref().and_then(|f| std::fs::read(f).ok()).unwrap_or_default();
    // A file that was cut short, or is another's, is made anew.
    let mut pours = shard::read(&bytes, rig).unwrap_or_default();
    if pours.is_empty() {
        bytes.clear();
    }
    let mut next = pours.last().map_or(0, |p| p.0 + 1);
    while next < POURS {
        // Where it is stopped, what was poured is kept.
        let done = f64::from(next) / f64::from(POURS);
        if !observer.progress(Progress { stage: "pouring grains with this rig", done }) {
            return Err(ReadError::Unfit { file: "the pours".into(), why: "stopped".into() });
        }
        let last = (next + CHUNK).min(POURS);
        let made: Vec<_> = (next..last)
            .into_par_iter()
            .map(|pour| {
                let conditions = ranges.draw(SEED, u64::from(pour));
                (pour, rig.pour(&conditions, u64::from(pour)))
            })
            .collect();
        for (pour, grains) in made {
            let grains = grains.map_err(|e| ReadError::Unfit {
                file: "the rig".into(),
                why: format!("no grains can be poured with it: {e}"),
            })?;
            shard::append(&mut bytes, pour, rig, &grains);
        }
        // Pours that cannot be kept are made again the next time; nothing is lost but time.
        if let Some(file) = &file
            && let Some(folder) = file.parent()
            && std::fs::create_dir_all(folder).is_ok()
        {
            let part = file.with_extension(format!("{}.part", std::process::id()));
            let _ = std::fs::write(&part, &bytes).and_then(|()| std::fs::rename(&part, file));
        }
        next = last;
    }
    pours = shard::read(&bytes, rig)
        .map_err(|e| ReadError::Unfit { file: "the pours".into(), why: e.to_string() })?;
    Ok(pours)
}

/// Where a rig's pours are kept: files of `missing-physics` in the user's cache folder, `pours-RIG-LOW-HIGH.bin` with the campaign's
/// heights in micrometres.
#[derive(Debug)]
pub(super) struct Cache {
    folder: Option<PathBuf>,
    begin: String,
}

impl Cache {
    pub(super) fn of(rig: &Rig) -> Self {
        let set = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
        let user = set("XDG_CACHE_HOME").or_else(|| Some(set("HOME")?.join(".cache")));
        // FNV-1a over everything that the pours depend on, but for the heights.
        let text = format!("3 {} {rig:?} {:?}", SEED, Ranges { height_m: [0.0; 2], ..Ranges::default() });
        let hash = text
            .bytes()
            .fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3));
        Self { folder: user.map(|f| f.join("missing-physics")), begin: format!("pours-{hash:016x}") }
    }

    /// The heights of a campaign for a recording: those of one that is there, if they hold the recording's and no more than twice
    /// as much as they must.
    pub(super) fn heights_m(&self, [low, high]: [f64; 2]) -> [f64; 2] {
        let new = [0.6 * low, 1.4 * high].map(|h| (h * 1e6).round() / 1e6);
        let narrow = |[a, b]: [f64; 2]| 2.0 * a >= new[0] && b <= 2.0 * new[1];
        let names = self.folder.iter().filter_map(|f| std::fs::read_dir(f).ok()).flatten().flatten();
        let mut there: Vec<[f64; 2]> = names
            .filter_map(|entry| {
                let name = entry.file_name().into_string().ok()?;
                let heights = name.strip_prefix(&self.begin)?.strip_prefix('-')?.strip_suffix(".bin")?;
                let (low, high) = heights.split_once('-')?;
                Some([f64::from(low.parse::<u32>().ok()?) / 1e6, f64::from(high.parse::<u32>().ok()?) / 1e6])
            })
            .filter(|heights| holds(*heights, [low, high]) && narrow(*heights))
            .collect();
        // The narrowest; a folder is in no order.
        there.sort_by(|a, b| (a[1] / a[0]).total_cmp(&(b[1] / b[0])).then(a[0].total_cmp(&b[0])));
        there.first().copied().unwrap_or(new)
    }

    /// The file of a campaign.
    pub(super) fn file(&self, heights_m: [f64; 2]) -> Option<PathBuf> {
        let [low, high] = heights_m.map(|h| (h * 1e6).round() as u32);
        Some(self.folder.as_ref()?.join(format!("{}-{low}-{high}.bin", self.begin)))
    }
}

/// Whether a campaign's heights hold a recording's, with some to spare.
pub(super) fn holds(campaign: [f64; 2], [low, high]: [f64; 2]) -> bool {
    low >= 1.2 * campaign[0] && high <= 0.98 * campaign[1]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// A campaign serves recordings whose heights it holds, and not those whose heights it hardly covers or far exceeds.
    #[test]
    fn a_campaign_serves_other_heights() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache { folder: Some(folder.path().into()), begin: "pours-0".into() };
        let first = cache.heights_m([0.05, 0.1]);
        assert_eq!(first, [0.03, 0.14]);
        std::fs::write(cache.file(first).unwrap(), []).unwrap();
        // Another rig's, and what is no campaign.
        for name in ["pours-1-34000-120000.bin", "pours-0-x-1.bin", "pours-0.bin", "pours-0-1-2.bin.part"] {
            std::fs::write(folder.path().join(name), []).unwrap();
        }
        for near in [[0.05, 0.1], [0.04, 0.12], [0.06, 0.08]] {
            assert_eq!(cache.heights_m(near), first, "{near:?}");
        }
        for far in [[0.03, 0.1], [0.05, 0.15], [0.12, 0.13], [0.045, 0.046]] {
            assert_ne!(cache.heights_m(far), first, "{far:?}");
        }
        let narrower = [0.032, 0.126];
        std::fs::write(cache.file(narrower).unwrap(), []).unwrap();
        assert_eq!(cache.heights_m([0.05, 0.1]), narrower);
    }
}
