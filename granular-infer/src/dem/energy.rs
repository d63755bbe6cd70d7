//! Where the energy is.

use super::{
    contact::{History, Pair, sizes},
    grains::Grains,
    material::Factors,
    neighbours::Neighbours,
    vector::{V3, dot},
    wall::Walls,
};

/// Energies in J of all grains together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Energy {
    /// Translation and rotation.
    pub kinetic_j: f64,
    /// Weight times height, zero at the origin.
    pub gravity_j: f64,
    /// Normal, tangential and rolling springs, less the work that adhesion has done.
    pub elastic_j: f64,
}

impl Energy {
    /// The sum.
    pub fn total_j(&self) -> f64 {
        self.kinetic_j + self.gravity_j + self.elastic_j
    }
}

/// Translation and rotation.
pub(crate) fn kinetic(grains: &Grains) -> f64 {
    grains
        .motion
        .iter()
        .zip(&grains.mass)
        .zip(&grains.place)
        .map(|((m, mass), p)| {
            0.5 * mass * (dot(m.velocity, m.velocity) + 0.4 * p[3] * p[3] * dot(m.spin, m.spin))
        })
        .sum()
}

/// All of it.
pub(crate) fn energy(
    grains: &Grains,
    gravity: V3,
    factors: &Factors,
    neighbours: &Neighbours,
    walls: &Walls,
) -> Energy {
    let mut elastic = 0.0;
    neighbours.contacts(grains, |pair, history, overlap| elastic += stored(factors, pair, history, overlap));
    walls.contacts(grains, |f, pair, history, overlap| elastic += stored(f, pair, history, overlap));
    let weight = |(p, m): (&[f64; 4], &f64)| -m * dot(gravity, [p[0], p[1], p[2]]);
    Energy {
        kinetic_j: kinetic(grains),
        gravity_j: grains.place.iter().zip(&grains.mass).map(weight).sum(),
        elastic_j: elastic,
    }
}

/// The springs of one contact.
fn stored(f: &Factors, pair: &Pair, history: &History, overlap: f64) -> f64 {
    let ((s, _), share) = (sizes(f.hertz, pair.radius, overlap), if f.hertz { 0.4 } else { 0.5 });
    let shear = f.shear * s;
    share * f.elastic * s * overlap * overlap - f.adhesion * pair.radius * overlap
        + 0.5 * dot(history.shear, history.shear) / shear
        + 0.5 * dot(history.couple, history.couple) / (shear * pair.radius * pair.radius)
}
