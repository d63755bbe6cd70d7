//! A depth camera that looks down on the dough, at a slight angle.

use hw_traits::arm::Pose;
use hw_traits::picture::{Intrinsics, NotRows, Picture};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::body::Body;

/// The camera, its place and its faults.
#[derive(Debug, Clone, PartialEq)]
pub struct Eye {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The pinhole.
    pub intrinsics: Intrinsics,
    /// The camera in the world.
    pub pose_in_world: Pose,
    /// Sigma of a pixel's depth, m.
    pub noise_m: f64,
    /// Share of the pixels that see nothing.
    pub holes: f64,
    /// Share of the pixels that see something in the air before what there is.
    pub flying: f64,
}

impl Eye {
    /// Above (0.4, 0) at 0.5 m, tilted by a tenth of a radian; 320 x 240 pixels, 0.6 mm of noise, 2 % of holes, 0.1 % of flying points.
    pub fn overhead() -> Self {
        let down = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI - 0.1);
        let q = UnitQuaternion::from_rotation_matrix(&down);
        let focal = 380.0;
        Self {
            width: 320,
            height: 240,
            intrinsics: Intrinsics { fx: focal, fy: focal, cx: 159.5, cy: 119.5 },
            pose_in_world: Pose { position_m: [0.4, 0.05, 0.5], rotation_xyzw: [q.i, q.j, q.k, q.w] },
            noise_m: 6e-4,
            holes: 0.02,
            flying: 1e-3,
        }
    }

    pub(super) fn picture(&self, body: &Body, rng: &mut impl Rng) -> Result<Picture<f32>, NotRows> {
        let [i, j, k, w] = self.pose_in_world.rotation_xyzw;
        let turn = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, i, j, k)).to_rotation_matrix();
        let from = Vector3::from(self.pose_in_world.position_m);
        let top = Top::of(body);
        let mut data = Vec::with_capacity(self.width * self.height);
        for v in 0..self.height {
            for u in 0..self.width {
                let ray = turn * Vector3::from(self.intrinsics.point(u as f64, v as f64, 1.0));
                let mut depth = top.depth(&from, &ray);
                let kind: f64 = rng.random();
                if kind < self.holes {
                    depth = f64::NAN;
                } else if kind < self.holes + self.flying {
                    depth -= 0.08 * rng.random::<f64>();
                }
                let noise: f64 = StandardNormal.sample(rng);
                data.push((depth + self.noise_m * noise) as f32);
            }
        }
        Picture::new(self.width, data)
    }
}

/// Upper side of a dough.
struct Top {
    x: f64,
    /// Face, half width and half height of each slice; a last face.
    slices: Vec<[f64; 3]>,
    end: f64,
    highest: f64,
    widest: f64,
}

impl Top {
    fn of(body: &Body) -> Self {
        let slices: Vec<[f64; 3]> =
            body.placed().map(|(f, s)| [f[0], s.half_width_m(), 0.5 * s.height_m()]).collect();
        let most = |k: usize| slices.iter().map(|s| s[k]).fold(0.0, f64::max);
        let end = body.at_m[1] + 0.5 * body.length_m();
        Self { x: body.at_m[0], highest: 2.0 * most(2), widest: most(1), slices, end }
    }

    /// Height above the table at a place; the outline's widest part hides what is below it.
    fn level(&self, x: f64, y: f64) -> f64 {
        let first = self.slices.first().map_or(0.0, |s| s[0]);
        if !(y >= first && y < self.end) {
            return 0.0;
        }
        let k = self.slices.partition_point(|s| s[0] <= y).saturating_sub(1);
        let [_, p, q] = self.slices[k];
        let side = (x - self.x) / p;
        if side.abs() >= 1.0 { 0.0 } else { q * (1.0 + (1.0 - side * side).sqrt()) }
    }

    /// Where a ray meets dough or table: its parameter, which is the depth.
    fn depth(&self, from: &Vector3<f64>, ray: &Vector3<f64>) -> f64 {
        let reach = |z: f64| (z - from.z) / ray.z;
        let (enter, leave) = (reach(self.highest), reach(0.0));
        let at = |t: f64| from + ray * t;
        let near = |p: &Vector3<f64>| {
            (p.x - self.x).abs() < self.widest + self.highest
                && p.y > self.slices[0][0] - self.highest
                && p.y < self.end + self.highest
        };
        if !near(&at(leave)) {
            return leave;
        }
        const STEPS: usize = 24;
        let inside = |t: f64| {
            let p = at(t);
            p.z <= self.level(p.x, p.y)
        };
        let step = (leave - enter) / STEPS as f64;
        let Some(hit) = (0..=STEPS).find(|k| inside(enter + *k as f64 * step)) else { return leave };
        let (mut low, mut high) = (enter + (hit as f64 - 1.0).max(0.0) * step, enter + hit as f64 * step);
        for _ in 0..10 {
            let middle = 0.5 * (low + high);
            if inside(middle) { high = middle } else { low = middle }
        }
        0.5 * (low + high)
    }
}
