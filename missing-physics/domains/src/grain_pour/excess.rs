//! Where in the pictures heights exceed those of the best baseline: rings about the axis, and octants of them.

use std::f64::consts::{FRAC_PI_4, PI};

use granular_infer::statistics::{COUNT, RINGS, ring_heights};

use super::read::Read;

/// Octants of a ring, from +x towards +y.
const OCTANTS: [&str; 8] = ["+x", "+x+y", "+y", "-x+y", "-x", "-x-y", "-y", "+x-y"];
/// Least excess that is told: in mean diameters, and in standard errors over the runs.
const LEAST: [f64; 2] = [0.25, 4.0];
/// Most places that are told.
const MOST: usize = 3;
/// Fewest pixels of an octant.
const FEWEST: usize = 10;

/// A place and by how much pictures exceed the baseline there, m.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Excess {
    ring: usize,
    /// None for the whole ring; an octant's is beyond its ring's.
    octant: Option<usize>,
    mean_m: f64,
    error_m: f64,
}

/// In words, the largest first; none where heights are the baseline's. `baseline` has the mean statistics of each picture.
pub(super) fn words(read: &Read, baseline: &[[f64; COUNT]]) -> Option<String> {
    let d = read.rig.diameter_m;
    let length = d * (read.rig.count as f64).cbrt();
    let lines: Vec<String> = largest(read, baseline)
        .iter()
        .map(|e| {
            let [from, to] = [e.ring, e.ring + 1].map(|k| 1e3 * length * RINGS[k]);
            let place =
                e.octant.map_or("all round".into(), |o| format!("towards {}, beyond its ring's", OCTANTS[o]));
            let (mean, error) = (1e3 * e.mean_m, 1e3 * e.error_m);
            format!("{mean:+.1} +- {error:.1} mm from {from:.0} to {to:.0} mm off the axis, {place}")
        })
        .collect();
    let text = "heights less those of the best equal spheres on level ground";
    (!lines.is_empty()).then(|| format!("{text}: {}", lines.join("; ")))
}

fn largest(read: &Read, baseline: &[[f64; COUNT]]) -> Vec<Excess> {
    let maps: Vec<_> = read.pictures.iter().zip(baseline).map(|(p, mean)| cells(p, mean, read)).collect();
    let d = read.rig.diameter_m;
    let mut all = Vec::new();
    for ring in 0..RINGS.len() - 1 {
        all.extend(over_runs(maps.iter().map(|m| m[ring].0), ring, None));
        for octant in 0..OCTANTS.len() {
            all.extend(over_runs(maps.iter().map(|m| m[ring].1[octant]), ring, Some(octant)));
        }
    }
    all.retain(|e| e.mean_m.abs() > (LEAST[0] * d).max(LEAST[1] * e.error_m));
    all.sort_by(|a, b| b.mean_m.abs().total_cmp(&a.mean_m.abs()));
    all.truncate(MOST);
    all
}

/// Mean and standard error of what at least two runs show.
fn over_runs(values: impl Iterator<Item = f64>, ring: usize, octant: Option<usize>) -> Option<Excess> {
    let values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    let n = values.len() as f64;
    let mean_m = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|v| (v - mean_m).powi(2)).sum::<f64>() / (n - 1.0);
    (values.len() > 1).then(|| Excess { ring, octant, mean_m, error_m: (square / n).sqrt() })
}

/// For each ring its excess, and beyond it that of its octants; NaN where there are too few pixels.
fn cells(picture: &super::read::Picture, baseline: &[f64; COUNT], read: &Read) -> Vec<(f64, [f64; 8])> {
    let d = read.rig.diameter_m;
    let length = d * (read.rig.count as f64).cbrt();
    let mut sums = vec![[(0.0, 0usize); 8]; RINGS.len() - 1];
    for ([x, y], z) in picture.map.places_m.iter().zip(&picture.map.heights_m) {
        let r = x.hypot(*y) / length;
        let ring = RINGS.windows(2).position(|w| r >= w[0] && r < w[1]);
        if let (Some(ring), true) = (ring, z.is_finite()) {
            let octant = ((y.atan2(*x) + 2.0 * PI + 0.5 * FRAC_PI_4) / FRAC_PI_4) as usize % OCTANTS.len();
            let (sum, count) = &mut sums[ring][octant];
            *sum += z;
            *count += 1;
        }
    }
    let wanted = ring_heights(baseline);
    sums.iter()
        .zip(wanted)
        .map(|(octants, wanted)| {
            let (sum, count) = octants.iter().fold((0.0, 0), |(s, n), (sum, count)| (s + sum, n + count));
            let ring = sum / count as f64;
            let beyond =
                octants.map(|(sum, count)| if count < FEWEST { f64::NAN } else { sum / count as f64 - ring });
            (ring - wanted * d, beyond)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_over_runs_has_its_error() {
        let found = over_runs([1.0, 3.0, f64::NAN].into_iter(), 2, Some(1));
        assert_eq!(found, Some(Excess { ring: 2, octant: Some(1), mean_m: 2.0, error_m: 1.0 }));
        assert_eq!(over_runs([1.0].into_iter(), 0, None), None);
    }
}
