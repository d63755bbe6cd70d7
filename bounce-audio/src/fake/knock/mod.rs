//! The sound of a ball that is dropped on a table: what it is made of, and of what the table, decides what is heard.
//!
//! Finer than what listens to it: the force is integrated, with losses and a plate that gives way; ball, its vibrations and the plate's modes
//! radiate; a room answers, and a microphone has a response, noise that drifts, hum, and steps of 16 bits. Balls fall through air.

mod collision;
mod radiation;
mod record;
mod substance;

pub use record::{Recorded, Recorder};
pub use substance::{Build, SLABS, STRANGERS, SUBSTANCES, Slab, Substance};

use collision::Contact;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;
use std::f64::consts::PI;

/// Between two values, uniform.
fn between<R: Rng + ?Sized>([low, high]: [f64; 2], rng: &mut R) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

/// One ball.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Striker {
    /// Diameter, m.
    pub diameter_m: f64,
    /// Thickness of its wall, m; `None` of a solid one.
    pub wall_m: Option<f64>,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Young's modulus, Pa.
    pub youngs_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density of its material, kg/m^3.
    pub density_kg_m3: f64,
    /// Restitution on a rigid floor at 1 m/s.
    pub restitution: f64,
    /// Loss factor of its vibrations.
    pub loss_factor: f64,
}

impl Striker {
    /// A ball of a substance as its row says, with a diameter, a wall (m; `None` for a solid one) and a restitution.
    pub fn of(substance: &Substance, diameter_m: f64, wall_m: Option<f64>, restitution: f64) -> Self {
        let radius = 0.5 * diameter_m;
        let inner = wall_m.map_or(0.0, |w| (radius - w).max(0.0));
        let volume = 4.0 / 3.0 * PI * (radius.powi(3) - inner.powi(3));
        Self {
            diameter_m,
            wall_m,
            mass_kg: volume * substance.density_kg_m3,
            youngs_pa: substance.youngs_pa,
            poisson: substance.poisson,
            density_kg_m3: substance.density_kg_m3,
            restitution,
            loss_factor: substance.loss_factor,
        }
    }

    /// A ball of a substance as one may be: size, wall and restitution anywhere between the limits, modulus and loss with their spread,
    /// density to 3 %.
    pub fn draw<R: Rng + ?Sized>(substance: &Substance, rng: &mut R) -> Self {
        let wall_m = match substance.build {
            Build::Solid => None,
            Build::Shell(limits) => Some(between(limits, rng)),
        };
        let varied = Substance {
            youngs_pa: substance.youngs_pa * (substance.spread * rng.sample::<f64, _>(StandardNormal)).exp(),
            loss_factor: substance.loss_factor * (0.3 * rng.sample::<f64, _>(StandardNormal)).exp(),
            density_kg_m3: substance.density_kg_m3 * (0.03 * rng.sample::<f64, _>(StandardNormal)).exp(),
            ..*substance
        };
        let (diameter_m, restitution) = (between(varied.diameter_m, rng), between(varied.restitution, rng));
        Self::of(&varied, diameter_m, wall_m, restitution)
    }

    /// It against a board: two solids in series, or the wall of a shell, which is softer than any board.
    fn contact(&self, board: &Board) -> Contact {
        let radius = 0.5 * self.diameter_m;
        let plane = |e: f64, nu: f64| (1.0 - nu * nu) / e;
        let (stiffness, power) = match self.wall_m {
            None => {
                let modulus =
                    1.0 / (plane(self.youngs_pa, self.poisson) + plane(board.contact_pa, board.poisson));
                (4.0 / 3.0 * modulus * radius.sqrt(), 1.5)
            }
            Some(wall) => {
                let bend = (3.0 * (1.0 - self.poisson * self.poisson)).sqrt();
                (4.0 * self.youngs_pa * wall * wall / (radius * bend), 1.0)
            }
        };
        Contact { mass_kg: self.mass_kg, stiffness, power, loss_s: 0.0, impedance: f64::INFINITY }
    }
}

/// A table's top, simply supported, and where it is struck.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Its two sides, m.
    pub size_m: [f64; 2],
    /// Thickness, m.
    pub thickness_m: f64,
    /// Young's modulus of bending, Pa.
    pub youngs_pa: f64,
    /// Young's modulus under the ball, Pa.
    pub contact_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, kg/m^3.
    pub density_kg_m3: f64,
    /// Loss factor of material and supports together.
    pub loss_factor: f64,
    /// Where the ball strikes, from a corner, m.
    pub struck_m: [f64; 2],
}

impl Board {
    /// A board of a kind as one may be: 0.5 to 1.2 m by 0.4 to 0.8 m, moduli to 10 %, supports that add a loss of 0.003 to 0.02.
    pub fn draw<R: Rng + ?Sized>(slab: &Slab, rng: &mut R) -> Self {
        let size_m = [between([0.5, 1.2], rng), between([0.4, 0.8], rng)];
        let vary = |rng: &mut R| (0.1 * rng.sample::<f64, _>(StandardNormal)).exp();
        Self {
            size_m,
            thickness_m: between(slab.thickness_m, rng),
            youngs_pa: slab.youngs_pa * vary(rng),
            contact_pa: slab.contact_pa * vary(rng),
            poisson: slab.poisson,
            density_kg_m3: slab.density_kg_m3,
            loss_factor: slab.loss_factor + between([3e-3, 2e-2], rng),
            struck_m: size_m.map(|side| side * between([0.2, 0.8], rng)),
        }
    }

    /// Bending rigidity, N m.
    fn rigidity(&self) -> f64 {
        self.youngs_pa * self.thickness_m.powi(3) / (12.0 * (1.0 - self.poisson * self.poisson))
    }

    /// Mechanical impedance at a point, N s/m.
    fn impedance(&self) -> f64 {
        8.0 * (self.rigidity() * self.density_kg_m3 * self.thickness_m).sqrt()
    }
}
