//! Pours from which a recording's emulator is learned: those that come with the tool, or new ones, kept for the next time.

use std::path::PathBuf;

use granular_infer::campaign::{Grains, Ranges, Rig};
use granular_infer::shard;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use crate::recording::ReadError;

/// The rig of the pours that come with the tool, and the pours (`cargo run --release -p granular-infer --example campaign`).
#[allow(clippy::approx_constant, reason = "the angle as recordings state it, to the bit")]
pub(super) const BUNDLED_RIG: Rig = Rig {
    count: 1000,
    diameter_m: 4e-3,
    mass_kg: 4.356e-5,
    outlet_radius_m: 0.014,
    cone_half_angle_rad: 0.7854,
    tube_radius_m: 0.04,
};
const BUNDLED: &[u8] = include_bytes!("campaign.bin.gz");
/// Seed of all campaigns.
const SEED: u64 = 1;
/// Pours of a new campaign.
const POURS: u32 = 500;
/// Pours between two writes of the cache.
const CHUNK: u32 = 20;

/// A campaign: its rig and ranges, and its pours by number.
#[derive(Debug)]
pub(super) struct Campaign {
    pub(super) rig: Rig,
    pub(super) ranges: Ranges,
    pub(super) pours: Vec<(u32, Grains)>,
    /// Lengths of the recording over those of the campaign.
    pub(super) scale: f64,
}

impl Campaign {
    pub(super) const SEED: u64 = SEED;

    /// The campaign for a rig whose funnel stands between two heights in m.
    ///
    /// # Errors
    /// [`ReadError::Open`] where no pour can be made, or the cache is not what it should be.
    pub(super) fn of(rig: &Rig, [low, high]: [f64; 2]) -> Result<Self, ReadError> {
        let scale = rig.diameter_m / BUNDLED_RIG.diameter_m;
        let ranges = Ranges::default();
        let inside = low / scale >= 1.2 * ranges.height_m[0] && high / scale <= 0.98 * ranges.height_m[1];
        if inside && similar(rig, scale) {
            let fail =
                |why: String| ReadError::Open { file: "the pours that come with the tool".into(), why };
            let mut bytes = Vec::new();
            std::io::Read::read_to_end(&mut flate2::read::GzDecoder::new(BUNDLED), &mut bytes)
                .map_err(|e| fail(e.to_string()))?;
            let pours = shard::read(&bytes, &BUNDLED_RIG).map_err(|e| fail(e.to_string()))?;
            return Ok(Self { rig: BUNDLED_RIG, ranges, pours, scale });
        }
        let ranges = Ranges { height_m: [0.6 * low, 1.4 * high], ..ranges };
        let pours = cached(rig, &ranges)?;
        Ok(Self { rig: *rig, ranges, pours, scale: 1.0 })
    }
}

/// Whether a rig is the bundled one at another scale: heaps are then the same, times scale (Froude).
fn similar(rig: &Rig, scale: f64) -> bool {
    let close = |a: f64, b: f64| (a / b - 1.0).abs() < 5e-3;
    rig.count == BUNDLED_RIG.count
        && close(rig.outlet_radius_m, scale * BUNDLED_RIG.outlet_radius_m)
        && close(rig.tube_radius_m, scale * BUNDLED_RIG.tube_radius_m)
        && close(rig.cone_half_angle_rad, BUNDLED_RIG.cone_half_angle_rad)
}

/// Pours that were made before, and those that are missing of [`POURS`].
fn cached(rig: &Rig, ranges: &Ranges) -> Result<Vec<(u32, Grains)>, ReadError> {
    let file = cache_file(rig, ranges);
    let mut bytes = file.as_ref().and_then(|f| std::fs::read(f).ok()).unwrap_or_default();
    // A file that was cut short, or is another's, is made anew.
    let mut pours = shard::read(&bytes, rig).unwrap_or_default();
    if pours.is_empty() {
        bytes.clear();
    }
    let mut next = pours.last().map_or(0, |p| p.0 + 1);
    let bar = ProgressBar::new(u64::from(POURS)).with_position(u64::from(next));
    if let Ok(style) = ProgressStyle::with_template("{bar:30} pouring {pos} of {len}, {eta} left") {
        bar.set_style(style);
    }
    while next < POURS {
        let last = (next + CHUNK).min(POURS);
        let made: Vec<_> = (next..last)
            .into_par_iter()
            .map(|pour| {
                let conditions = ranges.draw(SEED, u64::from(pour));
                (pour, rig.pour(&conditions, u64::from(pour)))
            })
            .collect();
        for (pour, grains) in made {
            let grains = grains.map_err(|e| ReadError::Open {
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
        bar.set_position(u64::from(last));
        next = last;
    }
    bar.finish_and_clear();
    pours = shard::read(&bytes, rig)
        .map_err(|e| ReadError::Open { file: "the pours".into(), why: e.to_string() })?;
    Ok(pours)
}

/// Where a rig's pours are kept: `missing-physics` in the user's cache folder.
fn cache_file(rig: &Rig, ranges: &Ranges) -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let folder = set("XDG_CACHE_HOME").or_else(|| Some(set("HOME")?.join(".cache")))?;
    // FNV-1a over everything that the pours depend on.
    let text = format!("2 {SEED} {rig:?} {ranges:?}");
    let hash = text
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3));
    Some(folder.join("missing-physics").join(format!("pours-{hash:016x}.bin")))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// The pours that come with the tool are those of its rig, its ranges and its seed: poured again they are the same heaps. (Bits
    /// may differ between processors, and a pour amplifies them.)
    #[test]
    fn bundled_pours_can_be_poured_again() {
        let campaign = Campaign::of(&BUNDLED_RIG, [0.04, 0.12]).unwrap();
        assert_eq!(campaign.rig, BUNDLED_RIG);
        let mean_radius = |g: &Grains| {
            let radii: Vec<f64> =
                g.positions_m.iter().map(|p| p[0].hypot(p[1])).filter(|r| *r < 0.1).collect();
            (radii.len() as f64, radii.iter().sum::<f64>() / radii.len() as f64)
        };
        let spheres = campaign.pours.iter().filter(|(_, g)| g.radii_m.len() == BUNDLED_RIG.count);
        for (pour, kept) in spheres.take(3) {
            let conditions = campaign.ranges.draw(SEED, u64::from(*pour));
            let again = BUNDLED_RIG.pour(&conditions, u64::from(*pour)).unwrap();
            let ((n, r), (n_again, r_again)) = (mean_radius(kept), mean_radius(&again));
            assert!((n_again / n - 1.0).abs() < 0.1, "{pour}: {n} and {n_again} grains near the axis");
            assert!((r_again / r - 1.0).abs() < 0.1, "{pour}: {r} and {r_again} m");
        }
        let rods = campaign.pours.iter().filter(|(_, g)| g.radii_m.len() > BUNDLED_RIG.count);
        assert!(rods.clone().count() > 30 && rods.clone().all(|(pour, _)| pour % 2 == 0));
    }
}
