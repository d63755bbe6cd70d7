//! Grains of any shape: rigid clumps of spheres.

use std::sync::Arc;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::{
    energy::Energy,
    error::{DemError, finite, positive},
    grains::Grains,
    vector::{V3, add, along, cross, dot, scale, sub},
};

/// Points of the grid along each axis from which volume and inertia are taken.
const GRID: usize = 64;
/// Most spheres of a clump.
const MOST: usize = 64;

/// The shape of a grain: spheres that hold together, of even density. Volume and moments of inertia are those of their union,
/// overlaps counted once, from a grid of points (within some 0.2 %).
#[derive(Debug, Clone, PartialEq)]
pub struct Clump {
    /// Centres from the centre of mass along the principal axes, m.
    centres: Arc<[V3]>,
    radii: Vec<f64>,
    volume: f64,
    /// Principal moments over mass, m2.
    inertia: V3,
}

impl Clump {
    /// Spheres by centre and radius in m, in a frame of any origin.
    ///
    /// # Errors
    /// [`DemError::Count`] for none or more than 64, [`DemError::NotPositive`], [`DemError::OutOfRange`].
    pub fn new(spheres_m: &[([f64; 3], f64)]) -> Result<Self, DemError> {
        if spheres_m.is_empty() || spheres_m.len() > MOST {
            return Err(DemError::Count { received: spheres_m.len(), most: MOST });
        }
        for (centre, radius) in spheres_m {
            finite("centre of a clump's sphere", *centre)?;
            positive("radius of a clump's sphere", *radius)?;
        }
        let (volume, middle, inertia) = moments(spheres_m);
        let eigen = inertia.symmetric_eigen();
        let mut axes = eigen.eigenvectors;
        if axes.determinant() < 0.0 {
            axes.column_mut(2).neg_mut();
        }
        let turned = |c: V3| -> V3 { (axes.transpose() * (Vector3::from(c) - middle)).into() };
        Ok(Self {
            centres: spheres_m.iter().map(|s| turned(s.0)).collect(),
            radii: spheres_m.iter().map(|s| s.1).collect(),
            volume,
            inertia: eigen.eigenvalues.into(),
        })
    }

    /// A cube with rounded edges, as wide as `edge_m`: eight spheres.
    ///
    /// # Errors
    /// As [`Clump::new`].
    pub fn cube(edge_m: f64) -> Result<Self, DemError> {
        let (radius, at) = (0.3 * edge_m, 0.2 * edge_m);
        let sign = |k: usize, bit: usize| if k >> bit & 1 == 0 { -at } else { at };
        let spheres: Vec<_> = (0..8).map(|k| ([sign(k, 0), sign(k, 1), sign(k, 2)], radius)).collect();
        Self::new(&spheres)
    }

    /// A cylinder with rounded rims: two rings of six spheres.
    ///
    /// # Errors
    /// As [`Clump::new`]; a cylinder shorter than 0.4 of its diameter has no positive sphere between its ends.
    pub fn cylinder(diameter_m: f64, length_m: f64) -> Result<Self, DemError> {
        let radius = 0.2 * diameter_m;
        let half = 0.5 * length_m - radius;
        positive("half length of a cylinder less its rim", half)?;
        let spheres: Vec<_> = (0..12)
            .map(|k| {
                let (sine, cosine) = (std::f64::consts::TAU * f64::from(k % 6) / 6.0).sin_cos();
                let out = 0.5 * diameter_m - radius;
                ([out * cosine, out * sine, if k < 6 { -half } else { half }], radius)
            })
            .collect();
        Self::new(&spheres)
    }

    /// A rod with round ends, `aspect` (1 to 4) times as long as wide, of the volume of a sphere of a diameter in m.
    ///
    /// # Errors
    /// As [`Clump::new`]; [`DemError::OutOfRange`] for the aspect.
    pub fn rod(diameter_m: f64, aspect: f64) -> Result<Self, DemError> {
        super::error::within("aspect", aspect, 1.0, 4.0)?;
        // pi/6 w^3 + pi/4 w^2 (aspect - 1) w = pi/6 d^3.
        let width = diameter_m / (1.0 + 1.5 * (aspect - 1.0)).cbrt();
        let (half, count) = (0.5 * (aspect - 1.0) * width, 1 + (4.0 * (aspect - 1.0)).ceil() as usize);
        let at = |k: usize| if count == 1 { 0.0 } else { half * (2.0 * k as f64 / (count - 1) as f64 - 1.0) };
        let spheres: Vec<_> = (0..count).map(|k| ([at(k), 0.0, 0.0], 0.5 * width)).collect();
        Self::new(&spheres)
    }

    /// Volume in m3.
    pub fn volume_m3(&self) -> f64 {
        self.volume
    }

    /// Principal moments of inertia over the mass, m2.
    pub fn inertia_m2(&self) -> [f64; 3] {
        self.inertia
    }

    /// Radius in m of the sphere about the centre of mass that holds it.
    pub fn reach_m(&self) -> f64 {
        let far = |(c, r): (&V3, &f64)| dot(*c, *c).sqrt() + r;
        self.centres.iter().zip(&self.radii).map(far).fold(0.0, f64::max)
    }

    pub(crate) fn radii(&self) -> &[f64] {
        &self.radii
    }
}

/// Volume, centre of mass and inertia over mass of a union of spheres.
fn moments(spheres: &[([f64; 3], f64)]) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let range = |axis: usize| {
        let low = spheres.iter().map(|(c, r)| c[axis] - r).fold(f64::INFINITY, f64::min);
        let high = spheres.iter().map(|(c, r)| c[axis] + r).fold(f64::NEG_INFINITY, f64::max);
        (low, (high - low) / GRID as f64)
    };
    let ranges = [range(0), range(1), range(2)];
    let (mut count, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for k in 0..GRID * GRID * GRID {
        let cell = [k % GRID, k / GRID % GRID, k / (GRID * GRID)];
        let p: V3 = std::array::from_fn(|a| ranges[a].0 + (cell[a] as f64 + 0.5) * ranges[a].1);
        let inside = |(c, r): &([f64; 3], f64)| {
            let d = sub(p, *c);
            dot(d, d) < r * r
        };
        if spheres.iter().any(inside) {
            let p = Vector3::from(p);
            count += 1.0;
            first += p;
            second += p * p.transpose();
        }
    }
    let middle = first / count;
    let spread: Matrix3<f64> = second / count - middle * middle.transpose();
    let cell = ranges[0].1 * ranges[1].1 * ranges[2].1;
    (count * cell, middle, Matrix3::identity() * spread.trace() - spread)
}

/// Where a clump is and how it is turned at the beginning; it is at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    /// Its shape.
    pub clump: Clump,
    /// Its centre of mass, m.
    pub position_m: [f64; 3],
    /// Unit quaternion x, y, z, w from its principal axes to the world.
    pub rotation_xyzw: [f64; 4],
}

/// A clump in motion.
#[derive(Debug, Clone)]
struct Body {
    first: usize,
    centres: Arc<[V3]>,
    mass: f64,
    inertia: V3,
    position: V3,
    velocity: V3,
    rotation: UnitQuaternion<f64>,
    /// Angular momentum in the world, kg m2/s.
    momentum: V3,
}

impl Body {
    fn spin_when(&self, rotation: &UnitQuaternion<f64>) -> V3 {
        let inside = rotation.inverse() * Vector3::from(self.momentum);
        (rotation * Vector3::from(std::array::from_fn(|k| inside[k] / self.inertia[k]))).into()
    }

    /// Half a step of force and torque of its spheres and of gravity and drag.
    fn kick(&mut self, grains: &Grains, gravity: V3, drag: f64, half: f64) {
        let (mut force, mut torque) = ([0.0; 3], [0.0; 3]);
        for k in self.first..self.first + self.centres.len() {
            let (p, load) = (grains.place[k], &grains.load[k]);
            let arm = sub([p[0], p[1], p[2]], self.position);
            force = add(force, load.force);
            torque = add(torque, add(load.torque, cross(arm, load.force)));
        }
        let speed = dot(self.velocity, self.velocity).sqrt();
        let free = along(gravity, -drag * speed, self.velocity);
        self.velocity = add(self.velocity, scale(along(free, 1.0 / self.mass, force), half));
        self.momentum = along(self.momentum, half, torque);
    }

    /// Position by its velocity, rotation by the spin at half the step.
    fn drift(&mut self, step: f64) {
        self.position = along(self.position, step, self.velocity);
        let turn = |spin: V3, time: f64| UnitQuaternion::from_scaled_axis(time * Vector3::from(spin));
        let middle = turn(self.spin_when(&self.rotation), 0.5 * step) * self.rotation;
        self.rotation = turn(self.spin_when(&middle), step) * self.rotation;
        self.rotation.renormalize_fast();
    }

    /// Tells its spheres where they are and how they move.
    fn tell(&self, grains: &mut Grains) {
        let (turn, spin): (Rotation3<f64>, V3) =
            (self.rotation.to_rotation_matrix(), self.spin_when(&self.rotation));
        for (k, centre) in self.centres.iter().enumerate() {
            let arm: V3 = (turn * Vector3::from(*centre)).into();
            let place = &mut grains.place[self.first + k];
            for axis in 0..3 {
                place[axis] = self.position[axis] + arm[axis];
            }
            let motion = &mut grains.motion[self.first + k];
            motion.velocity = add(self.velocity, cross(spin, arm));
            motion.spin = spin;
        }
    }
}

/// All clumps of a simulation.
#[derive(Debug, Clone)]
pub(crate) struct Bodies {
    all: Vec<Body>,
}

impl Bodies {
    /// Clumps as placed, and their spheres.
    pub(crate) fn new(placed: &[Placed], density: f64) -> Result<(Self, Grains), DemError> {
        let (mut all, mut radii, mut places) = (Vec::new(), Vec::new(), Vec::new());
        for p in placed {
            finite("position_m", p.position_m)?;
            let [x, y, z, w] = p.rotation_xyzw;
            let length = x.hypot(y).hypot(z).hypot(w);
            super::error::within("length of rotation_xyzw", length, 1.0 - 1e-6, 1.0 + 1e-6)?;
            let mass = density * p.clump.volume;
            all.push(Body {
                first: radii.len(),
                centres: p.clump.centres.clone(),
                mass,
                inertia: scale(p.clump.inertia, mass),
                position: p.position_m,
                velocity: [0.0; 3],
                rotation: UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z)),
                momentum: [0.0; 3],
            });
            radii.extend(&p.clump.radii);
            places.extend(std::iter::repeat_n([0.0; 3], p.clump.radii.len()));
        }
        // Of a sphere only place, radius and the mass that it collides with count: all of the clump's.
        let mut grains = Grains::new(&radii, &places, density, 0.0);
        for (name, body) in all.iter().enumerate() {
            for k in body.first..body.first + body.centres.len() {
                grains.mass[k] = body.mass;
                grains.body[k] = name as u32;
            }
            body.tell(&mut grains);
        }
        Ok((Self { all }, grains))
    }

    pub(crate) fn len(&self) -> usize {
        self.all.len()
    }

    /// Half a kick, the drift, and where the spheres are then.
    pub(crate) fn advance(&mut self, grains: &mut Grains, gravity: V3, drag: f64, step: f64) {
        for body in &mut self.all {
            body.kick(grains, gravity, drag, 0.5 * step);
            body.drift(step);
            body.tell(grains);
        }
    }

    /// The other half.
    pub(crate) fn finish(&mut self, grains: &mut Grains, gravity: V3, drag: f64, step: f64) {
        for body in &mut self.all {
            body.kick(grains, gravity, drag, 0.5 * step);
            body.tell(grains);
        }
    }

    pub(crate) fn set_motion(
        &mut self,
        clump: usize,
        velocity: V3,
        spin: V3,
        grains: &mut Grains,
    ) -> Result<(), DemError> {
        let count = self.all.len();
        let body =
            self.all.get_mut(clump).ok_or(DemError::Index { name: "clump", received: clump, count })?;
        body.velocity = velocity;
        let inside = body.rotation.inverse() * Vector3::from(spin);
        let momentum = Vector3::from(std::array::from_fn(|k| inside[k] * body.inertia[k]));
        body.momentum = (body.rotation * momentum).into();
        body.tell(grains);
        Ok(())
    }

    /// Centre of mass (m) and rotation (x, y, z, w) of each.
    pub(crate) fn poses(&self) -> impl ExactSizeIterator<Item = (V3, [f64; 4])> + '_ {
        self.all.iter().map(|b| {
            let q = b.rotation.coords;
            (b.position, [q[0], q[1], q[2], q[3]])
        })
    }

    /// Velocity (m/s) and angular velocity (rad/s) of each.
    pub(crate) fn motions(&self) -> impl ExactSizeIterator<Item = (V3, V3)> + '_ {
        self.all.iter().map(|b| (b.velocity, b.spin_when(&b.rotation)))
    }

    pub(crate) fn kinetic(&self) -> f64 {
        let one = |b: &Body| {
            0.5 * (b.mass * dot(b.velocity, b.velocity) + dot(b.momentum, b.spin_when(&b.rotation)))
        };
        self.all.iter().map(one).sum()
    }

    /// The energy of the clumps in place of that of their spheres as if each were a grain.
    pub(crate) fn energy(&self, gravity: V3, spheres: Energy) -> Energy {
        let weight = |b: &Body| -b.mass * dot(gravity, b.position);
        Energy { kinetic_j: self.kinetic(), gravity_j: self.all.iter().map(weight).sum(), ..spheres }
    }
}
