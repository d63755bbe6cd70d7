//! Heaps in few bytes: what a campaign keeps of its pours.
//!
//! A shard is a list of records, each a pour's number and its grains sphere by sphere (a rod is several, as many in every rod of a
//! pour): centres in 32nds of the mean diameter, radii in 64ths of the mean radius. Shards of one campaign merge by putting one
//! behind the other.

use crate::campaign::{Grains, Rig};

/// Steps of a centre in a mean diameter.
const STEPS: f64 = 32.0;
/// Steps of a radius in a mean radius.
const RADIUS_STEPS: f64 = 64.0;
/// Bytes before the spheres: the pour's number and how many there are.
const HEAD: usize = 8;
/// Bytes of a sphere.
const GRAIN: usize = 7;

/// A shard that does not hold what it says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ShardError {
    /// The bytes end within a record.
    #[error("a shard of {bytes} bytes ends within the record at byte {at}")]
    Short {
        /// All bytes.
        bytes: usize,
        /// Where the record begins.
        at: usize,
    },
    /// A record's spheres are no whole number for each of the rig's grains.
    #[error("pour {pour} has {received} spheres, expected {expected} or a multiple of it")]
    Count {
        /// The pour.
        pour: u32,
        /// Spheres in the record.
        received: usize,
        /// Grains of the rig.
        expected: usize,
    },
}

/// Appends a pour's record.
pub fn append(shard: &mut Vec<u8>, pour: u32, rig: &Rig, grains: &Grains) {
    let scale = STEPS / rig.diameter_m;
    let coordinate = |v: f64| (v * scale).round().clamp(f64::from(i16::MIN), f64::from(i16::MAX)) as i16;
    let mut list: Vec<([i16; 3], u8)> = grains
        .positions_m
        .iter()
        .zip(&grains.radii_m)
        .map(|(p, r)| (p.map(coordinate), (r / (0.5 * rig.diameter_m) * RADIUS_STEPS).round() as u8))
        .collect();
    // In order of x, and x as a difference: that compresses.
    list.sort_unstable();
    shard.extend(pour.to_le_bytes());
    shard.extend((list.len() as u32).to_le_bytes());
    let mut last = 0i16;
    let steps: Vec<i16> =
        list.iter().map(|(p, _)| p[0].wrapping_sub(std::mem::replace(&mut last, p[0]))).collect();
    for byte in 0..2 {
        shard.extend(steps.iter().map(|v| v.to_le_bytes()[byte]));
        for axis in 1..3 {
            shard.extend(list.iter().map(|(p, _)| p[axis].to_le_bytes()[byte]));
        }
    }
    shard.extend(list.iter().map(|(_, r)| *r));
}

/// All records of a shard.
///
/// # Errors
/// [`ShardError`].
pub fn read(shard: &[u8], rig: &Rig) -> Result<Vec<(u32, Grains)>, ShardError> {
    let scale = rig.diameter_m / STEPS;
    let mut records = Vec::new();
    let mut at = 0;
    while at < shard.len() {
        let short = ShardError::Short { bytes: shard.len(), at };
        let word = |from: usize| -> Option<u32> {
            Some(u32::from_le_bytes(shard.get(from..from + 4)?.try_into().ok()?))
        };
        let (Some(pour), Some(n)) = (word(at), word(at + 4)) else { return Err(short) };
        let n = n as usize;
        if n == 0 || !n.is_multiple_of(rig.count) {
            return Err(ShardError::Count { pour, received: n, expected: rig.count });
        }
        let Some(body) = shard.get(at + HEAD..at + HEAD + GRAIN * n) else { return Err(short) };
        let value =
            |axis: usize, i: usize| i16::from_le_bytes([body[axis * n + i], body[(3 + axis) * n + i]]);
        let mut x = 0i16;
        let mut grains = Grains::default();
        for i in 0..n {
            x = x.wrapping_add(value(0, i));
            grains.positions_m.push([x, value(1, i), value(2, i)].map(|v| f64::from(v) * scale));
            grains.radii_m.push(0.5 * rig.diameter_m * f64::from(body[6 * n + i]) / RADIUS_STEPS);
        }
        records.push((pour, grains));
        at += HEAD + GRAIN * n;
    }
    Ok(records)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    const RIG: Rig = Rig {
        count: 3,
        diameter_m: 4e-3,
        mass_kg: 4e-5,
        outlet_radius_m: 0.014,
        cone_half_angle_rad: 0.78,
        tube_radius_m: 0.04,
    };

    /// Grains come back in some order, within half a step.
    #[test]
    fn grains_come_back() {
        let grains = Grains {
            positions_m: vec![[0.3, -0.2, 0.001], [-0.1, 0.05, 0.02], [-0.1001, 0.0, 0.004]],
            radii_m: vec![2e-3, 1e-3, 4e-3],
        };
        let mut shard = Vec::new();
        append(&mut shard, 7, &RIG, &grains);
        append(&mut shard, 9, &RIG, &grains);
        let read_back = read(&shard, &RIG).unwrap();
        assert_eq!(read_back.iter().map(|r| r.0).collect::<Vec<_>>(), [7, 9]);
        for (place, radius) in grains.positions_m.iter().zip(&grains.radii_m) {
            let found = &read_back[1].1;
            let near = found.positions_m.iter().zip(&found.radii_m).any(|(p, r)| {
                p.iter().zip(place).all(|(a, b)| (a - b).abs() <= 0.5001 * 4e-3 / 32.0)
                    && (r - radius).abs() <= 0.5001 * 2e-3 / 64.0
            });
            assert!(near, "{place:?}");
        }
        assert_eq!(read(&shard[..20], &RIG), Err(ShardError::Short { bytes: 20, at: 0 }));
        let rig = Rig { count: 4, ..RIG };
        assert_eq!(read(&shard, &rig), Err(ShardError::Count { pour: 7, received: 3, expected: 4 }));
    }
}
