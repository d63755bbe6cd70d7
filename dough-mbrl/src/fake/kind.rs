//! What the dough of a rig is, and what happens to it.

/// What the dough of a rig is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DoughKind {
    /// Water kneaded into 50 g of it, g; 0 to 6.
    pub water_g: f64,
    /// Its volume, m^3.
    pub volume_m3: f64,
    /// How easily it flows along its axis: part of the friction hill's axial share of a squeeze, in (0, 1]; above 1, or not above 0,
    /// counts as 1. The rest widens it, and what presses bear, and so its stiffness, is the same.
    pub axial_flow: f64,
}

/// Axial flow of doughs A and C: found once, on seeds that no example uses, so that random rolls take dough A to 10 inches in about 150 rolls and
/// dough C, which gives way far less under the same band, to 4 inches in about 100: as many as a random rollout has in [Matl 2021]. The
/// wetter a dough, the more it sticks to band and table, which hold it back.
const AXIAL_FLOW: [f64; 2] = [0.275, 0.9];

/// Pressure (Pa) that dough bears with 1, 2, 3, 4 and 5 g of water: found once, by palpating the fake as in the test
/// `stiffness_is_that_of`, so that its stiffness is that of Table 7.1.
const HARDNESS_PA: [f64; 5] = [9260.0, 7280.0, 6310.0, 4730.0, 3440.0];

impl DoughKind {
    /// 50 g of 1250 kg/m^3 with 5 g of water.
    pub const A: Self = Self { water_g: 5.0, volume_m3: 4e-5, axial_flow: AXIAL_FLOW[0] };
    /// With 3 g.
    pub const B: Self = Self { water_g: 3.0, axial_flow: 0.5 * (AXIAL_FLOW[0] + AXIAL_FLOW[1]), ..Self::A };
    /// With 1 g.
    pub const C: Self = Self { water_g: 1.0, axial_flow: AXIAL_FLOW[1], ..Self::A };
}

/// Pressure (Pa) that dough with so much water bears.
pub(super) fn hardness_pa(water_g: f64) -> f64 {
    let at = (water_g - 1.0).clamp(-1.0, 5.0);
    let k = (at.max(0.0) as usize).min(HARDNESS_PA.len() - 2);
    let slope = HARDNESS_PA[k + 1] - HARDNESS_PA[k];
    (HARDNESS_PA[k] + slope * (at - k as f64)).max(500.0)
}

/// What else happens on a rig; by default nothing of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effects {
    /// Rate at which water leaves, 1/s.
    pub drying_per_s: f64,
    /// Below this force (N) the band slides over the dough.
    pub slip_n: f64,
    /// Part of a roll's change that comes back within seconds.
    pub springback: f64,
    /// Part of the dough under the band that stays on it at each contact.
    pub sticking: f64,
    /// Rate at which the band softens, by contact.
    pub softening: f64,
}
