//! Bottles, liquids, and how far the true ones are from what is stated of them.

use std::f64::consts::PI;

use liquid_haptics::container::{ContainerError, Cylinder};
use liquid_haptics::fake::{Disturbances, OpenBottle};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub(crate) const GRAVITY: f64 = 9.80665;
pub(crate) const WALL_M: f64 = 0.001;
pub(crate) const GRIPPER_KG: f64 = 0.9;
/// What is left of the gain of the forces after a calibration on the empty bottle, 1 sigma.
pub(crate) const GAIN: f64 = 1e-4;

/// Name, density, kinematic viscosity, surface tension, and the bead: where it breaks and where a stream stops.
pub(crate) struct Liquid {
    pub(crate) name: &'static str,
    pub(crate) density: f64,
    pub(crate) viscosity: f64,
    tension: f64,
    bead: [f64; 2],
}

const fn liquid(name: &'static str, density: f64, viscosity: f64, tension: f64, bead: [f64; 2]) -> Liquid {
    Liquid { name, density, viscosity, tension, bead }
}

/// From water to honey; beads are those of contact angles near 120 and 75 degrees for water, less for what wets.
pub(crate) const LIQUIDS: [Liquid; 6] = [
    liquid("isopropyl alcohol", 785.0, 2.6e-6, 0.022, [2.2e-3, 1.4e-3]),
    liquid("water", 997.0, 1e-6, 0.072, [4.8e-3, 3.4e-3]),
    liquid("oil", 915.0, 7e-5, 0.033, [2.6e-3, 1.6e-3]),
    liquid("glycerol", 1260.0, 7.5e-4, 0.063, [3.6e-3, 2.4e-3]),
    liquid("syrup", 1330.0, 1.5e-3, 0.075, [3.6e-3, 2.4e-3]),
    liquid("honey", 1420.0, 7e-3, 0.06, [3.2e-3, 2.2e-3]),
];

/// Inner radius and length, lip, mass (m, kg).
pub(crate) struct Vessel {
    pub(crate) name: &'static str,
    radius: f64,
    length: f64,
    lip: f64,
    mass: f64,
}

/// The small bottle of [Matl 2021], a jar, and a beaker without a lip.
pub(crate) const VESSELS: [Vessel; 3] = [
    Vessel { name: "bottle", radius: 0.034, length: 0.170, lip: 0.027, mass: 0.085 },
    Vessel { name: "jar", radius: 0.045, length: 0.120, lip: 0.038, mass: 0.15 },
    Vessel { name: "beaker", radius: 0.036, length: 0.130, lip: 0.036, mass: 0.11 },
];

/// One pour: what is stated, and what is true.
pub(crate) struct Case {
    pub(crate) liquid: usize,
    pub(crate) vessel: usize,
    pub(crate) wanted_m3: f64,
    pub(crate) stated: OpenBottle,
    pub(crate) truth: OpenBottle,
    pub(crate) disturbances: Disturbances,
    pub(crate) seed: u64,
}

impl Case {
    /// A pour of `wanted_m3`; the fill (half to six sevenths), the bead (0.3 mm off), the weir (its law is good to a tenth), the tilt (1 mrad off), offsets,
    /// drifts and what is left of the gain are drawn.
    pub(crate) fn new(liquid: usize, vessel: usize, wanted_m3: f64, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = |sigma: f64| sigma * Distribution::<f64>::sample(&StandardNormal, &mut rng);
        let (kind, size) = (&LIQUIDS[liquid], &VESSELS[vessel]);
        let capacity = PI * size.radius * size.radius * size.length;
        let volume_m3 = capacity * (0.68 + draw(0.08)).clamp(0.5, 0.86);
        let [hold_m, rest_m] = kind.bead;
        let stated = OpenBottle {
            radius_m: size.radius,
            length_m: size.length,
            bottom_m: WALL_M,
            lip_radius_m: size.lip,
            hold_m,
            rest_m,
            discharge: 0.9,
            volume_m3,
            density_kg_m3: kind.density,
            viscosity_m2_s: kind.viscosity,
            surface_tension_n_m: kind.tension,
            container_mass_kg: size.mass,
            gripper_mass_kg: GRIPPER_KG,
            grasp_height_m: 0.75 * size.length,
            shell_center_m: 0.5 * size.length,
            gravity_m_s2: GRAVITY,
        };
        let bead = draw(3e-4).clamp(-rest_m, 1e-3);
        let truth = OpenBottle {
            hold_m: hold_m + bead,
            rest_m: rest_m + bead,
            discharge: 0.9 * (1.0 + draw(0.1)).clamp(0.7, 1.3),
            ..stated
        };
        let disturbances = Disturbances {
            latency_s: 0.03,
            offset_n: [draw(0.3), draw(0.3), draw(0.3)],
            warming_n_s: [draw(5e-5), draw(5e-5), draw(5e-5)],
            force_gain: draw(GAIN),
            angle_offset_rad: draw(1e-3),
            bead_wander_m: 1e-4,
            ..Disturbances::default()
        };
        Self { liquid, vessel, wanted_m3, stated, truth, disturbances, seed }
    }

    pub(crate) fn kind(&self) -> &'static Liquid {
        &LIQUIDS[self.liquid]
    }

    /// The cavity, closed.
    pub(crate) fn cylinder(&self) -> Result<Cylinder, ContainerError> {
        Cylinder::new(self.stated.radius_m + WALL_M, self.stated.length_m + 2.0 * WALL_M, WALL_M)
    }
}
