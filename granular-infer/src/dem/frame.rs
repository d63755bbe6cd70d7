//! Where a wall stands, and how it moves.

use nalgebra::{Rotation3, Vector3};

use super::{
    grains::Grains,
    vector::{V3, along, cross, dot, sub},
};

/// How a wall moves: its pivot with a velocity, and about the pivot with an angular velocity. A path is one such motion after
/// another.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WallMotion {
    /// Velocity of the pivot, m/s.
    pub velocity_m_s: [f64; 3],
    /// Angular velocity, rad/s.
    pub spin_rad_s: [f64; 3],
    /// The pivot, where it is now, m.
    pub about_m: [f64; 3],
}

/// A wall's frame: a point p of the shape is at `origin + rotation p`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    rotation: Rotation3<f64>,
    origin: V3,
    motion: WallMotion,
    /// Whether the wall stands where the shape says.
    at_home: bool,
    /// How far grains may lie beyond their margins, how far the wall has gone, and from how far a spin reaches, m.
    allowed: f64,
    gone: f64,
    reach: f64,
}

impl Default for Frame {
    fn default() -> Self {
        Self {
            rotation: Rotation3::identity(),
            origin: [0.0; 3],
            motion: WallMotion::default(),
            at_home: true,
            allowed: 0.0,
            gone: 0.0,
            reach: 0.0,
        }
    }
}

impl Frame {
    pub(crate) fn set(&mut self, motion: WallMotion) {
        self.motion = motion;
        if !self.moves() {
            self.allowed = 0.0;
        }
    }

    pub(crate) fn moves(&self) -> bool {
        self.motion.velocity_m_s != [0.0; 3] || self.motion.spin_rad_s != [0.0; 3]
    }

    pub(crate) fn allowed(&self) -> f64 {
        self.allowed
    }

    /// Grains are listed anew, in m beyond their margins.
    pub(crate) fn list(&mut self, grains: &Grains, largest: f64) {
        self.allowed = 0.5 * largest;
        self.gone = 0.0;
        let far = |p: &[f64; 4]| {
            let d = sub([p[0], p[1], p[2]], self.motion.about_m);
            dot(d, d)
        };
        // A grain that touches has its contact within its own margin of where it is now.
        self.reach = grains.place.iter().map(far).fold(0.0, f64::max).sqrt() + 3.0 * largest;
    }

    /// Moves on by a step; tells whether grains are to be listed anew.
    pub(crate) fn advance(&mut self, step: f64) -> bool {
        let WallMotion { velocity_m_s: v, spin_rad_s: w, about_m } = self.motion;
        let turn = Rotation3::new(step * Vector3::from(w));
        let arm: V3 = (turn * Vector3::from(sub(self.origin, about_m))).into();
        self.motion.about_m = along(about_m, step, v);
        self.origin = along(arm, 1.0, self.motion.about_m);
        self.rotation = turn * self.rotation;
        self.at_home = false;
        let speed = dot(v, v).sqrt() + self.reach * dot(w, w).sqrt();
        self.gone += step * speed;
        // One step ahead, so that it is never too late.
        self.gone + step * speed > self.allowed
    }

    /// A point in the shape's own frame.
    #[inline(always)]
    pub(crate) fn inside(&self, point: V3) -> V3 {
        if self.at_home {
            return point;
        }
        (self.rotation.inverse() * Vector3::from(sub(point, self.origin))).into()
    }

    /// A direction of the shape's frame in the world.
    #[inline(always)]
    pub(crate) fn outside(&self, direction: V3) -> V3 {
        if self.at_home {
            return direction;
        }
        (self.rotation * Vector3::from(direction)).into()
    }

    /// Velocity at a point of the world and angular velocity.
    #[inline(always)]
    pub(crate) fn motion_at(&self, point: V3) -> (V3, V3) {
        if self.at_home {
            return ([0.0; 3], [0.0; 3]);
        }
        let WallMotion { velocity_m_s, spin_rad_s, about_m } = self.motion;
        (along(velocity_m_s, 1.0, cross(spin_rad_s, sub(point, about_m))), spin_rad_s)
    }
}
