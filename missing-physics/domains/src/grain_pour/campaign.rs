//! Pours from which a recording's emulator is learned: those that come with the tool, or new ones, kept for the next time.

use granular_infer::campaign::{Conditions, Grains, Ranges, Rig};
use granular_infer::shard;
use missing_physics::observer::Observer;

use super::cache::{Cache, cached, holds};
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
const BUNDLED: &[u8] = missing_physics_pours::CAMPAIGN;

/// A campaign: its ranges, and its pours by number.
#[derive(Debug)]
pub(super) struct Campaign {
    pub(super) ranges: Ranges,
    pub(super) pours: Vec<(u32, Grains)>,
    pub(super) scale: Scale,
}

/// A recording's lengths and works of adhesion over those of its campaign: heaps of grains twice as large that fall twice as far are the
/// same, times two (Froude), whatever their density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    pub(super) length: f64,
    adhesion: f64,
}

impl Scale {
    /// The campaign's conditions for a recording's.
    pub(super) fn down(self, c: &Conditions) -> Conditions {
        Conditions {
            height_m: c.height_m / self.length,
            work_of_adhesion_j_m2: c.work_of_adhesion_j_m2 / self.adhesion,
            drag_per_m: c.drag_per_m * self.length,
            ..*c
        }
    }

    /// A campaign's ranges as the recording's.
    pub(super) fn up(self, r: &Ranges) -> Ranges {
        Ranges {
            height_m: r.height_m.map(|h| h * self.length),
            work_of_adhesion_j_m2: r.work_of_adhesion_j_m2 * self.adhesion,
            drag_per_m: r.drag_per_m / self.length,
            ..*r
        }
    }
}

impl Campaign {
    /// The campaign for a rig whose funnel stands between two heights in m.
    ///
    /// # Errors
    /// [`ReadError::Unfit`] where no pour can be made, or the cache is not what it should be.
    pub(super) fn of(rig: &Rig, [low, high]: [f64; 2], observer: &dyn Observer) -> Result<Self, ReadError> {
        let length = rig.diameter_m / BUNDLED_RIG.diameter_m;
        let adhesion = rig.density_kg_m3() / BUNDLED_RIG.density_kg_m3() * length.powi(2);
        let scale = Scale { length, adhesion };
        let heights_m = [low, high].map(|h| h / length);
        let ranges = Ranges::default();
        if holds(ranges.height_m, heights_m) && similar(rig, length) {
            let fail =
                |why: String| ReadError::Unfit { file: "the pours that come with the tool".into(), why };
            let mut bytes = Vec::new();
            std::io::Read::read_to_end(&mut flate2::read::GzDecoder::new(BUNDLED), &mut bytes)
                .map_err(|e| fail(e.to_string()))?;
            let pours = shard::read(&bytes, &BUNDLED_RIG).map_err(|e| fail(e.to_string()))?;
            return Ok(Self { ranges, pours, scale });
        }
        let rig = at_scale(rig, length);
        let cache = Cache::of(&rig);
        let height_m = cache.heights_m(heights_m);
        let ranges = Ranges { height_m, ..ranges };
        let pours = cached(&rig, &ranges, cache.file(height_m), observer)?;
        Ok(Self { ranges, pours, scale })
    }
}

/// A rig as it is poured: with the bundled grains, and to 10 um, so that recordings of one rig share their pours.
pub(super) fn at_scale(rig: &Rig, length: f64) -> Rig {
    let to = |v: f64| (v / length * 1e5).round() / 1e5;
    Rig {
        diameter_m: BUNDLED_RIG.diameter_m,
        mass_kg: BUNDLED_RIG.mass_kg,
        outlet_radius_m: to(rig.outlet_radius_m),
        tube_radius_m: to(rig.tube_radius_m),
        ..*rig
    }
}

/// Whether a rig is the bundled one at another scale.
fn similar(rig: &Rig, scale: f64) -> bool {
    let close = |a: f64, b: f64| (a / b - 1.0).abs() < 5e-3;
    rig.count == BUNDLED_RIG.count
        && close(rig.outlet_radius_m, scale * BUNDLED_RIG.outlet_radius_m)
        && close(rig.tube_radius_m, scale * BUNDLED_RIG.tube_radius_m)
        && close(rig.cone_half_angle_rad, BUNDLED_RIG.cone_half_angle_rad)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use missing_physics::observer::Silent;

    use super::super::cache::SEED;
    use super::*;

    /// What a recording may say of its rig, of other grains and at another scale, leaves the poured rig alone; conditions go down as
    /// ranges go up.
    #[test]
    fn a_larger_rig_is_poured_as_the_same() {
        let rig = Rig { count: 700, ..BUNDLED_RIG };
        let twice =
            Rig { diameter_m: 8e-3, mass_kg: 5e-4, outlet_radius_m: 0.028, tube_radius_m: 0.08, ..rig };
        assert_eq!(at_scale(&twice, 2.0), at_scale(&rig, 1.0));
        assert_eq!(at_scale(&rig, 1.0), rig);
        let scale = Scale { length: 2.0, adhesion: 6.0 };
        let ranges = Ranges::default();
        let most = Conditions {
            height_m: scale.up(&ranges).height_m[1],
            work_of_adhesion_j_m2: scale.up(&ranges).work_of_adhesion_j_m2,
            drag_per_m: scale.up(&ranges).drag_per_m,
            ..ranges.baseline()
        };
        let down = scale.down(&most);
        assert_eq!([most.height_m, most.drag_per_m], [2.0 * ranges.height_m[1], 0.5 * ranges.drag_per_m]);
        assert_eq!([down.height_m, down.drag_per_m], [ranges.height_m[1], ranges.drag_per_m]);
        assert_eq!(down.work_of_adhesion_j_m2, ranges.work_of_adhesion_j_m2);
    }

    /// The pours that come with the tool are those of its rig, its ranges and its seed: poured again they are the same heaps. (Bits
    /// may differ between processors, and a pour amplifies them.)
    #[test]
    fn bundled_pours_can_be_poured_again() {
        let campaign = Campaign::of(&BUNDLED_RIG, [0.04, 0.12], &Silent).unwrap();
        assert_eq!(campaign.scale, Scale { length: 1.0, adhesion: 1.0 });
        let mean_radius = |g: &Grains| {
            let radii: Vec<f64> =
                g.positions_m.iter().map(|p| p[0].hypot(p[1])).filter(|r| *r < 0.1).collect();
            (radii.len() as f64, radii.iter().sum::<f64>() / radii.len() as f64)
        };
        let spheres = campaign.pours.iter().filter(|(_, g)| g.radii_m.len() == BUNDLED_RIG.count);
        for (pour, bundled) in spheres.take(3) {
            let conditions = campaign.ranges.draw(SEED, u64::from(*pour));
            let again = BUNDLED_RIG.pour(&conditions, u64::from(*pour)).unwrap();
            let ((n, r), (n_again, r_again)) = (mean_radius(bundled), mean_radius(&again));
            assert!((n_again / n - 1.0).abs() < 0.1, "{pour}: {n} and {n_again} grains near the axis");
            assert!((r_again / r - 1.0).abs() < 0.1, "{pour}: {r} and {r_again} m");
        }
        let rods = campaign.pours.iter().filter(|(_, g)| g.radii_m.len() > BUNDLED_RIG.count);
        assert!(rods.clone().count() > 30 && rods.clone().all(|(pour, _)| pour % 2 == 0));
    }
}
