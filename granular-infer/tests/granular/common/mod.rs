//! The pour that tests vary.

use granular_infer::dem::{Coefficients, Funnel, Law, Pour};

/// Grains of 4 mm and 1,300 kg/m3, E 5 MPa, from 5 cm.
pub(crate) fn pour(count: usize) -> Pour {
    let dry = Coefficients::dry(0.5, 0.5, 0.2);
    Pour {
        count,
        diameter_m: 4e-3,
        size_variation: 0.0,
        density_kg_m3: 1300.0,
        law: Law::Hertz { modulus_pa: 5e6, poisson_ratio: 0.25 },
        grains: dry,
        ground: dry,
        funnel: Funnel {
            outlet_radius_m: 0.014,
            cone_half_angle_rad: std::f64::consts::FRAC_PI_4,
            tube_radius_m: 0.03,
            outlet_height_m: 0.05,
            axis_m: [0.0; 2],
        },
        gravity_m_s2: [0.0, 0.0, -9.81],
        drag_per_m: 0.0,
        closed_s: 0.0,
        step_s: None,
        rest: None,
        most_s: 4.0,
    }
}
