//! What balls and tables are made of, as they vary from piece to piece.
//!
//! All are rounded middles that a simulation assumes, not measurements of a piece: moduli, densities and loss factors are of the order that Ashby, *Materials
//! Selection in Mechanical Design* (4th edition, 2011, appendix A) has; restitutions on hard ground of that in Goldsmith 1960, *Impact*, and for hollow and
//! rubber balls in Cross 1999 (doi:10.1119/1.19229), each with a wide range.

/// How a ball is built.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Build {
    /// The same all through.
    Solid,
    /// Hollow: least and greatest thickness of its wall, m.
    Shell([f64; 2]),
}

/// What a ball may be made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Substance {
    /// Its name.
    pub name: &'static str,
    /// Young's modulus, Pa.
    pub youngs_pa: f64,
    /// Standard deviation of the modulus's logarithm from piece to piece.
    pub spread: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density of what it is made of, kg/m^3.
    pub density_kg_m3: f64,
    /// Restitution on a rigid floor at 1 m/s: least and greatest.
    pub restitution: [f64; 2],
    /// Loss factor of its own vibrations.
    pub loss_factor: f64,
    /// Diameters that such balls have: least and greatest, m.
    pub diameter_m: [f64; 2],
    /// How it is built.
    pub build: Build,
}

const fn solid(
    name: &'static str,
    [youngs_pa, spread, poisson, density_kg_m3]: [f64; 4],
    restitution: [f64; 2],
    loss_factor: f64,
    diameter_m: [f64; 2],
) -> Substance {
    Substance {
        name,
        youngs_pa,
        spread,
        poisson,
        density_kg_m3,
        restitution,
        loss_factor,
        diameter_m,
        build: Build::Solid,
    }
}

/// Eight kinds of balls. Wood: beech, whose modulus depends on the side that it falls on; cork: Gibson, Easterling and Ashby 1981
/// (doi:10.1098/rspa.1981.0117); rubber: polybutadiene; shell: a table tennis ball.
pub const SUBSTANCES: [Substance; 8] = [
    solid("steel", [210e9, 0.02, 0.29, 7810.0], [0.85, 0.96], 5e-4, [0.010, 0.030]),
    solid("glass", [72e9, 0.05, 0.22, 2500.0], [0.80, 0.95], 1e-3, [0.012, 0.030]),
    solid("acrylic", [4.0e9, 0.10, 0.37, 1185.0], [0.70, 0.85], 5e-2, [0.012, 0.030]),
    solid("nylon", [2.8e9, 0.12, 0.39, 1140.0], [0.62, 0.80], 4e-2, [0.012, 0.030]),
    solid("wood", [2.0e9, 0.25, 0.30, 720.0], [0.50, 0.70], 3e-2, [0.015, 0.040]),
    solid("cork", [20e6, 0.25, 0.05, 180.0], [0.45, 0.65], 0.15, [0.020, 0.040]),
    solid("rubber", [6e6, 0.35, 0.49, 1000.0], [0.78, 0.92], 8e-2, [0.020, 0.045]),
    Substance {
        name: "celluloid shell",
        youngs_pa: 2.3e9,
        spread: 0.08,
        poisson: 0.33,
        density_kg_m3: 1400.0,
        restitution: [0.82, 0.93],
        loss_factor: 2.5e-2,
        diameter_m: [0.038, 0.040],
        build: Build::Shell([0.35e-3, 0.5e-3]),
    },
];

/// Balls of other kinds. A golf ball is an effective solid and a tennis ball an effective shell, whose modulus stands for its pressure.
pub const STRANGERS: [Substance; 6] = [
    solid("lead", [16e9, 0.05, 0.44, 11340.0], [0.15, 0.35], 2e-2, [0.010, 0.025]),
    solid("alumina", [370e9, 0.03, 0.22, 3900.0], [0.88, 0.97], 5e-4, [0.008, 0.020]),
    solid("aluminium", [70e9, 0.02, 0.33, 2700.0], [0.60, 0.80], 1e-3, [0.012, 0.030]),
    solid("golf ball", [0.1e9, 0.15, 0.45, 1130.0], [0.75, 0.82], 0.1, [0.0427, 0.0430]),
    solid("foam", [0.3e6, 0.2, 0.10, 60.0], [0.40, 0.60], 0.2, [0.040, 0.070]),
    Substance {
        name: "tennis ball",
        youngs_pa: 25e6,
        spread: 0.1,
        poisson: 0.49,
        density_kg_m3: 1450.0,
        restitution: [0.70, 0.76],
        loss_factor: 0.3,
        diameter_m: [0.0654, 0.0686],
        build: Build::Shell([3.0e-3, 3.4e-3]),
    },
];

/// What a table's top may be made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slab {
    /// Its name.
    pub name: &'static str,
    /// Young's modulus of its bending, Pa: of an anisotropic plate the geometric mean along and across.
    pub youngs_pa: f64,
    /// Young's modulus under the ball, Pa.
    pub contact_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, kg/m^3.
    pub density_kg_m3: f64,
    /// Loss factor of its material.
    pub loss_factor: f64,
    /// Least and greatest thickness, m.
    pub thickness_m: [f64; 2],
}

const fn slab(
    name: &'static str,
    [youngs_pa, contact_pa, poisson]: [f64; 3],
    density_kg_m3: f64,
    loss_factor: f64,
    thickness_m: [f64; 2],
) -> Slab {
    Slab { name, youngs_pa, contact_pa, poisson, density_kg_m3, loss_factor, thickness_m }
}

/// Nine kinds of table tops; the first four, the next two and the last three have no material in common.
pub const SLABS: [Slab; 9] = [
    slab("oak", [5e9, 1.5e9, 0.30], 700.0, 1.2e-2, [0.018, 0.040]),
    slab("particle board", [3e9, 1.2e9, 0.25], 680.0, 2e-2, [0.016, 0.028]),
    slab("glass", [72e9, 72e9, 0.22], 2500.0, 2e-3, [0.008, 0.015]),
    slab("granite", [55e9, 55e9, 0.25], 2700.0, 3e-3, [0.020, 0.040]),
    slab("plywood", [7e9, 1.3e9, 0.30], 650.0, 1.5e-2, [0.015, 0.030]),
    slab("concrete", [30e9, 30e9, 0.20], 2300.0, 8e-3, [0.030, 0.050]),
    slab("bamboo", [8e9, 1.6e9, 0.30], 720.0, 1e-2, [0.018, 0.030]),
    slab("marble", [50e9, 50e9, 0.25], 2700.0, 2e-3, [0.018, 0.030]),
    slab("steel plate", [205e9, 205e9, 0.29], 7850.0, 1e-3, [0.006, 0.012]),
];
