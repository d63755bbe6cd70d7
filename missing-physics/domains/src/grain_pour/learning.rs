//! Which pictures the emulator of a recording is learned from, and what each counts for.

use std::f64::consts::PI;

use granular_infer::camera::Flaws;
use granular_infer::campaign::{Conditions, Grains, Ranges};
use granular_infer::emulator::Sample;
use granular_infer::seeing::HeightMap;
use granular_infer::statistics::{COUNT, statistics, volume_in_sight};
use missing_physics::observer::{Observer, Progress};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::cache::SEED;
use super::campaign::Campaign;
use super::read::Read;
use crate::reading::upper_median;

/// Most blur that pictures are made with, px.
pub(super) const MOST_BLUR_PX: f64 = 3.0;
/// A pour is learned from if it has this part of the volume in sight that the recording's picture with the least has.
const IN_SIGHT: f64 = 0.7;
/// Over what part of half its range a friction or restitution is near; what pours far from it count for.
const NEAR: f64 = 0.7;
const FAR_COUNTS: f64 = 0.05;
/// Parts of the pours between which is told how far the work is.
const PARTS: usize = 20;

/// Pictures of a campaign's pours, as the recording's camera would have taken them.
pub(super) fn samples(campaign: &Campaign, read: &Read, observer: &dyn Observer) -> Vec<Sample> {
    let noise = upper_median(read.pictures.iter().map(|p| p.map.noise_m).collect()).unwrap_or(0.0);
    let unit = read.camera.depth_unit_m;
    // Rounding to counts adds its own part again.
    let noise_m = (noise * noise - unit * unit / 12.0).max(0.0).sqrt();
    let volume_m3 = read.rig.count as f64 * PI / 6.0 * read.rig.diameter_m.powi(3);
    let flaws = missing(campaign, read, Flaws { noise_m, ..Flaws::default() });
    let one = |(pour, grains): &(u32, Grains)| {
        let conditions = campaign.ranges.draw(SEED, u64::from(*pour));
        let depth = read.camera.render(&scaled(grains, campaign.scale.length));
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        rng.set_stream(u64::from(*pour));
        let blurred = MOST_BLUR_PX * rng.random::<f64>();
        [0.0, blurred]
            .into_iter()
            .filter_map(move |blur_px| {
                let counts = read.camera.expose(&depth, &Flaws { blur_px, ..flaws }, &mut rng);
                let map = HeightMap::new(&read.camera, &counts, volume_m3).ok()?;
                let seen = statistics(&map, read.rig.count, read.rig.diameter_m);
                Some(Sample { conditions, blur_px2: blur_px * blur_px, statistics: seen })
            })
            .collect::<Vec<_>>()
    };
    let (pours, mut samples) = (&campaign.pours, Vec::with_capacity(2 * campaign.pours.len()));
    for (k, part) in pours.chunks(pours.len().div_ceil(PARTS).max(1)).enumerate() {
        let done = k as f64 / PARTS as f64;
        // What is learned from is never a part of it: to stop is for the diagnosis that follows.
        let _ = observer.progress(Progress { stage: "learning what pictures of pours show", done });
        samples.par_extend(part.par_iter().flat_map_iter(one));
    }
    samples
}

/// What a pour counts for beside grains that are likely: less the further its frictions and restitution lie from theirs.
pub(super) fn counts(ranges: &Ranges, c: &Conditions, likely: &[Conditions]) -> f64 {
    let log = |[a, b]: [f64; 2], v: f64, to: f64| 2.0 * (v / to).ln() / (b / a).ln();
    let distance2 = |to: &Conditions| {
        log(ranges.sliding_friction, c.sliding_friction, to.sliding_friction).powi(2)
            + log(ranges.rolling_friction, c.rolling_friction, to.rolling_friction).powi(2)
            + (2.0 * (c.restitution - to.restitution) / (ranges.restitution[1] - ranges.restitution[0]))
                .powi(2)
    };
    let nearest = likely.iter().map(distance2).fold(f64::INFINITY, f64::min);
    FAR_COUNTS + (-0.5 * nearest / (NEAR * NEAR)).exp()
}

/// Pours whose grains roll out of sight, as they do on slippery or tilted ground, follow laws of their own: a centroid goes uphill when what
/// is downhill has left. Where the recording has no such picture they only make the emulator worse.
pub(super) fn in_sight(samples: Vec<Sample>, seen: &[[f64; COUNT]], count: usize) -> Vec<Sample> {
    let volumes = samples.iter().map(|s| volume_in_sight(&s.statistics, count)).collect();
    // A recording with more in sight than any pour (of other grains than it says) must leave something to learn from.
    let usual = upper_median(volumes).unwrap_or(0.0);
    let least = seen.iter().map(|s| volume_in_sight(s, count)).fold(usual, f64::min);
    samples.into_iter().filter(|s| volume_in_sight(&s.statistics, count) >= IN_SIGHT * least).collect()
}

/// Grains at another scale.
pub(super) fn scaled(grains: &Grains, scale: f64) -> Grains {
    Grains {
        positions_m: grains.positions_m.iter().map(|p| p.map(|v| scale * v)).collect(),
        radii_m: grains.radii_m.iter().map(|r| scale * r).collect(),
    }
}

/// Which pixels are missing: some everywhere, as far out, and more at edges, as in the heap.
fn missing(campaign: &Campaign, read: &Read, flaws: Flaws) -> Flaws {
    /// Pours over which edges are counted.
    const POURS: usize = 30;
    let edge_m = 0.5 * read.rig.diameter_m;
    let length = read.rig.diameter_m * (read.rig.count as f64).cbrt();
    let (mut inner, mut outer) = ([0usize; 2], [0usize; 2]);
    for map in read.pictures.iter().map(|p| &p.map) {
        for ([x, y], z) in map.places_m.iter().zip(&map.heights_m) {
            let r = x.hypot(*y) / length;
            let count = if r < 1.0 { &mut inner } else { &mut outer };
            if !(1.0..=2.1).contains(&r) {
                count[0] += usize::from(!z.is_finite());
                count[1] += 1;
            }
        }
    }
    let share = |[part, all]: [usize; 2]| part as f64 / all.max(1) as f64;
    let mut edges = [0usize; 2];
    for (_, grains) in campaign.pours.iter().take(POURS) {
        let depth = read.camera.render(&scaled(grains, campaign.scale.length));
        for i in 0..depth.len() {
            let [x, y] =
                read.camera.place_m(i % read.camera.size_px[0], i / read.camera.size_px[0], depth[i]);
            if x.hypot(y) < length {
                edges[0] += usize::from(read.camera.is_edge(&depth, i, edge_m));
                edges[1] += 1;
            }
        }
    }
    let missing = share(outer);
    let missing_at_edges = ((share(inner) - missing) / share(edges).max(0.01)).clamp(0.0, 0.9);
    Flaws { missing, missing_at_edges, edge_m, ..flaws }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Statistics of a heap whose rings are all so many diameters high.
    fn heap(height: f64) -> [f64; COUNT] {
        let mut statistics = [0.0; COUNT];
        statistics[3..12].fill((height + 0.01_f64).sqrt());
        statistics
    }

    /// What has rolled out of sight is learned from only where the recording has such a picture, and something always is.
    #[test]
    fn pours_out_of_sight_are_left_aside() {
        let conditions = Ranges::default().baseline();
        let all: Vec<Sample> = (0..20)
            .map(|k| Sample { conditions, blur_px2: 0.0, statistics: heap(0.1 * f64::from(k) + 0.05) })
            .collect();
        let left = |seen: &[f64]| {
            let seen: Vec<[f64; COUNT]> = seen.iter().map(|h| heap(*h)).collect();
            in_sight(all.clone(), &seen, 1000).len()
        };
        assert_eq!(left(&[1.0, 0.9]), 20 - 6);
        assert_eq!(left(&[0.9, 0.1]), 20 - 1);
        assert_eq!(left(&[50.0]), 20 - 7);
    }
}
