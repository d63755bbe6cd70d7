//! Walls: planes, cone frustums, tubes, meshes, at rest or moving; the contacts of grains with them.

use super::{
    contact::{History, Pair, Touch, react, sizes},
    error::{DemError, finite, positive, within},
    frame::{Frame, WallMotion},
    grains::Grains,
    material::{Coefficients, Factors},
    mesh::Mesh,
    vector::{V3, along, dot, scale, sub},
};

/// The surface of a wall, as it stands at the beginning.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// An infinite plane; grains are on the side that the normal points to.
    Plane {
        /// A point of the plane, m.
        point_m: [f64; 3],
        /// A vector away from the plane, of any length above zero.
        normal: [f64; 3],
    },
    /// A thin cone frustum that opens upwards about a vertical axis; its lower rim is round to the touch.
    Frustum {
        /// The axis's x and y, m.
        axis_m: [f64; 2],
        /// Height of the lower rim, m.
        bottom_m: f64,
        /// Radius of the lower rim, m, positive.
        bottom_radius_m: f64,
        /// Radius of the upper rim, m, above the lower one's.
        top_radius_m: f64,
        /// Half angle from the axis in rad, above 0 and below pi/2.
        half_angle_rad: f64,
    },
    /// A thin vertical tube, without end above.
    Tube {
        /// The axis's x and y, m.
        axis_m: [f64; 2],
        /// Radius, m, positive.
        radius_m: f64,
        /// Height of the lower rim, m.
        bottom_m: f64,
    },
    /// A thin triangle mesh, both of whose sides hold grains. A grain touches it at its nearest point: in a corner that is
    /// narrower than the grain it is held by one face at a time.
    Mesh(Mesh),
}

/// A wall and what grains do on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Wall {
    /// The surface.
    pub shape: Shape,
    /// Coefficients of grains against this wall.
    pub coefficients: Coefficients,
}

impl Shape {
    /// Refuses surfaces without extent.
    pub fn check(&self) -> Result<(), DemError> {
        match *self {
            Self::Plane { point_m, normal } => {
                finite("point_m", point_m)?;
                finite("normal", normal)?;
                positive("length of normal", dot(normal, normal).sqrt())
            }
            Self::Frustum { axis_m, bottom_m, bottom_radius_m, top_radius_m, half_angle_rad } => {
                finite("axis_m and bottom_m", [axis_m[0], axis_m[1], bottom_m])?;
                positive("bottom_radius_m", bottom_radius_m)?;
                positive("top_radius_m - bottom_radius_m", top_radius_m - bottom_radius_m)?;
                within("half_angle_rad", half_angle_rad, 0.01, 1.56)
            }
            Self::Tube { axis_m, radius_m, bottom_m } => {
                finite("axis_m and bottom_m", [axis_m[0], axis_m[1], bottom_m])?;
                positive("radius_m", radius_m)
            }
            Self::Mesh(_) => Ok(()),
        }
    }
}

/// A surface made ready for looking up distances.
#[derive(Debug, Clone)]
enum Surface {
    Plane {
        offset: f64,
        normal: V3,
    },
    /// A straight line in the half plane through the axis: from `start` along `direction`.
    Turned {
        axis: [f64; 2],
        start: [f64; 2],
        direction: [f64; 2],
        length: f64,
        rim: bool,
    },
    Mesh(Mesh),
}

impl Surface {
    fn of(shape: &Shape) -> Self {
        match *shape {
            Shape::Mesh(ref mesh) => Self::Mesh(mesh.clone()),
            Shape::Plane { point_m, normal } => {
                let normal = scale(normal, 1.0 / dot(normal, normal).sqrt());
                Self::Plane { offset: dot(point_m, normal), normal }
            }
            Shape::Frustum { axis_m, bottom_m, bottom_radius_m, top_radius_m, half_angle_rad } => {
                let (sine, cosine) = half_angle_rad.sin_cos();
                Self::Turned {
                    axis: axis_m,
                    start: [bottom_radius_m, bottom_m],
                    direction: [sine, cosine],
                    length: (top_radius_m - bottom_radius_m) / sine,
                    rim: true,
                }
            }
            Shape::Tube { axis_m, radius_m, bottom_m } => Self::Turned {
                axis: axis_m,
                start: [radius_m, bottom_m],
                direction: [0.0, 1.0],
                length: f64::INFINITY,
                rim: false,
            },
        }
    }

    /// Distance and the unit vector from the surface to the point; none where the surface ends before, or a mesh is farther
    /// than `most`.
    #[inline(always)]
    fn nearest(&self, point: V3, most: f64) -> Option<(f64, V3)> {
        match *self {
            Self::Mesh(ref mesh) => mesh.nearest(point, most),
            Self::Plane { offset, normal } => Some((dot(point, normal) - offset, normal)),
            Self::Turned { axis, start, direction, length, rim } => {
                let (x, y) = (point[0] - axis[0], point[1] - axis[1]);
                let r = (x * x + y * y).sqrt();
                let (u, w) = (r - start[0], point[2] - start[1]);
                let mut along_line = u * direction[0] + w * direction[1];
                if along_line > length || (along_line < 0.0 && !rim) {
                    return None;
                }
                along_line = along_line.max(0.0);
                let (u, w) = (u - along_line * direction[0], w - along_line * direction[1]);
                let distance = (u * u + w * w).sqrt();
                if !(distance > 0.0 && r > 0.0) {
                    return None;
                }
                let out = u / (distance * r);
                Some((distance, [x * out, y * out, w / distance]))
            }
        }
    }

    /// Whether the surface may be nearer than `most`, whether or not it ends before.
    fn near(&self, point: V3, most: f64) -> bool {
        let at_least = match *self {
            Self::Mesh(ref mesh) => return mesh.nearest(point, most).is_some(),
            Self::Plane { offset, normal } => dot(point, normal) - offset,
            Self::Turned { axis, start, direction, length, .. } => {
                let (x, y) = (point[0] - axis[0], point[1] - axis[1]);
                let (u, w) = ((x * x + y * y).sqrt() - start[0], point[2] - start[1]);
                let along_line = (u * direction[0] + w * direction[1]).min(length).max(0.0);
                let (u, w) = (u - along_line * direction[0], w - along_line * direction[1]);
                (u * u + w * w).sqrt()
            }
        };
        at_least <= most
    }
}

/// A grain near a wall.
#[derive(Debug, Clone, Copy)]
struct Near {
    wall: u32,
    grain: u32,
    pair: Pair,
    history: History,
}

/// All walls and the grains near them.
#[derive(Debug, Clone)]
pub(crate) struct Walls {
    surfaces: Vec<Surface>,
    frames: Vec<Frame>,
    factors: Vec<Factors>,
    present: Vec<bool>,
    /// Force of the grains on each wall in the last step, N.
    loads: Vec<V3>,
    near: Vec<Near>,
    before: Vec<Near>,
}

impl Walls {
    pub(crate) fn new(shapes: &[Shape], factors: Vec<Factors>, grains: usize) -> Self {
        Self {
            surfaces: shapes.iter().map(Surface::of).collect(),
            frames: vec![Frame::default(); shapes.len()],
            factors,
            present: vec![true; shapes.len()],
            loads: vec![[0.0; 3]; shapes.len()],
            near: Vec::with_capacity(2 * grains + 16),
            before: Vec::with_capacity(2 * grains + 16),
        }
    }

    /// Takes a wall away.
    pub(crate) fn remove(&mut self, wall: usize) -> Result<(), DemError> {
        let count = self.present.len();
        let present =
            self.present.get_mut(wall).ok_or(DemError::Index { name: "wall", received: wall, count })?;
        *present = false;
        self.near.retain(|n| n.wall as usize != wall);
        Ok(())
    }

    /// Force in N of the grains on a wall.
    pub(crate) fn load(&self, wall: usize) -> Result<V3, DemError> {
        let count = self.loads.len();
        self.loads.get(wall).copied().ok_or(DemError::Index { name: "wall", received: wall, count })
    }

    /// Lets a wall move from now on.
    pub(crate) fn set_motion(&mut self, wall: usize, motion: WallMotion) -> Result<(), DemError> {
        let count = self.present.len();
        let frame =
            self.frames.get_mut(wall).ok_or(DemError::Index { name: "wall", received: wall, count })?;
        frame.set(motion);
        Ok(())
    }

    /// Moves the walls on by a step in s; tells whether one has gone farther than its list of grains allows.
    pub(crate) fn advance(&mut self, step: f64) -> bool {
        let mut left = false;
        for frame in &mut self.frames {
            if frame.moves() {
                left |= frame.advance(step);
            }
        }
        left
    }

    /// Lists the grains that may touch a wall before one moves farther than its margin, in m.
    pub(crate) fn rebuild(&mut self, grains: &Grains, margin: &[f64]) {
        let largest = grains.place.iter().fold(0.0, |a: f64, p| a.max(p[3]));
        for frame in self.frames.iter_mut().filter(|f| f.moves()) {
            frame.list(grains, largest);
        }
        std::mem::swap(&mut self.near, &mut self.before);
        self.near.clear();
        let mut old = self.before.iter().peekable();
        for (w, surface) in self.surfaces.iter().enumerate() {
            if !self.present[w] {
                continue;
            }
            for (g, (place, margin)) in grains.place.iter().zip(margin).enumerate() {
                let [x, y, z, radius] = *place;
                let frame = &self.frames[w];
                if !surface.near(frame.inside([x, y, z]), radius + margin + frame.allowed()) {
                    continue;
                }
                let key = (w as u32, g as u32);
                while old.next_if(|o| (o.wall, o.grain) < key).is_some() {}
                let history =
                    old.next_if(|o| (o.wall, o.grain) == key).map(|o| o.history).unwrap_or_default();
                let pair = Pair::wall(radius, grains.mass[g]);
                self.near.push(Near { wall: key.0, grain: key.1, pair, history });
            }
        }
    }

    /// Adds the walls' forces to the grains.
    pub(crate) fn react(&mut self, grains: &mut Grains, step: f64) {
        self.loads.fill([0.0; 3]);
        for near in &mut self.near {
            let g = near.grain as usize;
            let [x, y, z, radius] = grains.place[g];
            let frame = &self.frames[near.wall as usize];
            let found = self.surfaces[near.wall as usize].nearest(frame.inside([x, y, z]), radius);
            let (distance, normal) = match found {
                Some((distance, normal)) if distance < radius => (distance, frame.outside(normal)),
                _ => {
                    near.history = History::default();
                    continue;
                }
            };
            let motion = &grains.motion[g];
            let (velocity, spin) = frame.motion_at(along([x, y, z], -distance, normal));
            let factors = &self.factors[near.wall as usize];
            let touch = Touch {
                normal,
                overlap: radius - distance,
                sizes: sizes(factors.hertz, radius, radius - distance),
                velocity: sub(motion.velocity, velocity),
                surface: scale(motion.spin, distance),
                rotation: sub(motion.spin, spin),
            };
            let r = react(factors, &near.pair, &touch, &mut near.history, step);
            let on_wall = &mut self.loads[near.wall as usize];
            *on_wall = sub(*on_wall, r.force);
            let load = &mut grains.load[g];
            load.force = along(load.force, 1.0, r.force);
            load.torque = sub(along(load.torque, -distance, r.turn), scale(r.couple, -1.0));
        }
    }

    /// Calls back with factors, pair, history and overlap in m of each contact.
    pub(crate) fn contacts(&self, grains: &Grains, mut each: impl FnMut(&Factors, &Pair, &History, f64)) {
        for near in &self.near {
            let [x, y, z, radius] = grains.place[near.grain as usize];
            let wall = near.wall as usize;
            let inside = self.frames[wall].inside([x, y, z]);
            if let Some((distance, _)) = self.surfaces[wall].nearest(inside, radius)
                && distance < radius
            {
                each(&self.factors[wall], &near.pair, &near.history, radius - distance);
            }
        }
    }
}
