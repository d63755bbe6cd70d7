//! A band between two fingers that presses on a dough.

use super::body::{Body, Material};

/// The band: a spring stretched between the fingers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Elastic {
    /// Natural length, m.
    pub(super) natural_m: f64,
    /// Tension at twice the natural length, N.
    pub(super) modulus_n: f64,
    /// Its breadth, along the dough, m.
    pub(super) breadth_m: f64,
}

impl Elastic {
    /// Force (N) where the band is lifted by `deflection_m`, `offset_m` from the middle between fingers that stand `throw_m` apart: two
    /// straight halves, one tension.
    pub(super) fn force_n(&self, throw_m: f64, deflection_m: f64, offset_m: f64) -> f64 {
        if deflection_m <= 0.0 {
            return 0.0;
        }
        let offset = offset_m.abs().min(0.45 * throw_m);
        let (left, right) = (0.5 * throw_m - offset, 0.5 * throw_m + offset);
        let (l, r) = (left.hypot(deflection_m), right.hypot(deflection_m));
        let tension = self.modulus_n * ((l + r) / self.natural_m - 1.0).max(0.0);
        tension * deflection_m * (1.0 / l + 1.0 / r)
    }
}

/// What a press does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Press {
    /// Level of the band on the dough, m.
    pub(super) level_m: f64,
    pub(super) force_n: f64,
    /// Moment against rolling, over what the force can drive at a friction coefficient of one.
    pub(super) needs: f64,
    /// Mean height under the band, m.
    pub(super) height_m: f64,
}

/// Where the fingers are, and how far apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fingers {
    pub(super) at_m: [f64; 3],
    pub(super) throw_m: f64,
}

/// What part of a slice lies under the band.
fn under(faces: [f64; 2], y_m: f64, breadth_m: f64) -> f64 {
    let from = faces[0].max(y_m - 0.5 * breadth_m);
    let to = faces[1].min(y_m + 0.5 * breadth_m);
    (to - from).max(0.0)
}

/// Puts the band on the dough: the level at which both push alike. None where it hangs free.
pub(super) fn press(body: &Body, band: &Elastic, fingers: &Fingers, material: &Material) -> Option<Press> {
    let [x, y, z] = fingers.at_m;
    let offset = body.at_m[0] - x;
    let covered: Vec<(f64, usize)> = body
        .placed()
        .enumerate()
        .map(|(k, (faces, _))| (under(faces, y, band.breadth_m), k))
        .filter(|(l, _)| *l > 0.0)
        .collect();
    let top = covered.iter().map(|(_, k)| body.slices[*k].height_m()).fold(0.0, f64::max);
    if !(top > z) || offset.abs() > 0.5 * fingers.throw_m {
        return None;
    }
    let pushes = |level: f64| -> f64 {
        let load = |(l, k): &(f64, usize)| {
            let slice = &body.slices[*k];
            l * slice.load_n_m(slice.height_m() - level, material)
        };
        covered.iter().map(load).sum()
    };
    let (mut low, mut high) = (z, top);
    for _ in 0..36 {
        let level = 0.5 * (low + high);
        if pushes(level) > band.force_n(fingers.throw_m, level - z, offset) {
            low = level;
        } else {
            high = level;
        }
    }
    let level_m = 0.5 * (low + high);
    let (mut force, mut against, mut drive, mut heights, mut lengths) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (l, k) in &covered {
        let slice = &body.slices[*k];
        let squeeze = slice.height_m() - level_m;
        if squeeze > 0.0 {
            let q = slice.load_n_m(squeeze, material) * l;
            force += q;
            against += q * slice.flat_half_width_m(squeeze);
            drive += q * slice.height_m();
            heights += l * slice.height_m();
            lengths += l;
        }
    }
    (lengths > 0.0 && drive > 0.0).then(|| Press {
        level_m,
        force_n: force,
        needs: against / drive,
        height_m: heights / lengths,
    })
}

/// Lets the dough flow under a press, then turns it by an angle.
pub(super) fn knead(
    body: &mut Body,
    band: &Elastic,
    y_m: f64,
    press: &Press,
    angle_rad: f64,
    material: &Material,
) {
    let parts: Vec<f64> =
        body.placed().map(|(faces, slice)| under(faces, y_m, band.breadth_m) / slice.length_m).collect();
    for (slice, part) in body.slices.iter_mut().zip(parts) {
        let squeeze = slice.height_m() - press.level_m;
        // A slice that is covered in part flows in part.
        if part > 0.0 && squeeze > 0.0 {
            let mut whole = *slice;
            whole.flow(squeeze, band.breadth_m, material);
            slice.length_m += part * (whole.length_m - slice.length_m);
            for k in 0..2 {
                slice.oval_m[k] += part * (whole.oval_m[k] - slice.oval_m[k]);
            }
            slice.keep_flat(&whole, part);
        }
        slice.turn(angle_rad, squeeze);
    }
}
