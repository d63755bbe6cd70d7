//! Material, coefficients and the step that they allow.

use std::f64::consts::PI;

use super::error::{DemError, positive, within};

/// How a contact resists being pressed together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// A linear spring: `F_n = k_n delta`, tangential stiffness `ratio k_n` (Cundall and Strack 1979,
    /// doi:10.1680/geot.1979.29.1.47).
    Linear {
        /// Normal stiffness `k_n` in N/m, positive.
        stiffness_n_m: f64,
        /// Tangential over normal stiffness, above 0 and up to 1; 2/7 gives both oscillations one period.
        tangential_ratio: f64,
    },
    /// Hertz's contact of equal materials with Mindlin's tangential stiffness (doi:10.1115/1.4009973):
    /// `F_n = 4/3 E* sqrt(R* delta) delta`, `S_t = 8 G* sqrt(R* delta)`.
    Hertz {
        /// Young's modulus E in Pa of grains and walls, positive.
        modulus_pa: f64,
        /// Poisson's ratio of grains and walls, 0 to 0.5.
        poisson_ratio: f64,
    },
}

/// What a contact loses and what it holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// Normal restitution e, 0.01 to 1, the same at any speed.
    pub restitution: f64,
    /// Sliding friction `mu_s`, 0 to 10.
    pub sliding_friction: f64,
    /// Rolling friction `mu_r`, 0 to 10: largest couple over (reduced radius times normal force).
    pub rolling_friction: f64,
    /// Share of critical damping `eta_r` of the rolling spring, 0 to 1 (Ai et al. 2011).
    pub rolling_damping: f64,
    /// Work of adhesion w in J/m2, 0 to 100: a touching contact is pulled together by `2 pi w R*` (Derjaguin, Muller and
    /// Toporov 1975, doi:10.1016/0021-9797(75)90018-1).
    pub work_of_adhesion_j_m2: f64,
}

impl Coefficients {
    /// Damping of the rolling spring where nothing else is said (Ai et al. 2011, doi:10.1016/j.powtec.2010.09.030).
    pub const ROLLING_DAMPING: f64 = 0.3;

    /// Dry grains with a rolling spring damped at [`Self::ROLLING_DAMPING`].
    pub fn dry(restitution: f64, sliding_friction: f64, rolling_friction: f64) -> Self {
        Self {
            restitution,
            sliding_friction,
            rolling_friction,
            rolling_damping: Self::ROLLING_DAMPING,
            work_of_adhesion_j_m2: 0.0,
        }
    }

    /// Refuses coefficients outside their ranges.
    pub fn check(&self) -> Result<(), DemError> {
        within("restitution", self.restitution, 0.01, 1.0)?;
        within("sliding_friction", self.sliding_friction, 0.0, 10.0)?;
        within("rolling_friction", self.rolling_friction, 0.0, 10.0)?;
        within("rolling_damping", self.rolling_damping, 0.0, 1.0)?;
        within("work_of_adhesion_j_m2", self.work_of_adhesion_j_m2, 0.0, 100.0)
    }

    /// Damping ratio that gives the restitution: `-ln e / sqrt(ln^2 e + pi^2)`.
    fn damping_ratio(&self) -> f64 {
        let log = self.restitution.ln();
        -log / log.hypot(PI)
    }
}

/// Factors of a contact's forces, worked out once for a law and a set of coefficients.
///
/// With `s = sqrt(R* delta)` and `q = sqrt(s)` (both 1 for the linear law).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Factors {
    /// Whether s and q follow Hertz.
    pub(crate) hertz: bool,
    /// `F_n = elastic s delta`.
    pub(crate) elastic: f64,
    /// `gamma_n = damping_n q sqrt(m*)`.
    pub(crate) damping_n: f64,
    /// `S_t = shear s`.
    pub(crate) shear: f64,
    /// `gamma_t = damping_t q sqrt(m*)`.
    pub(crate) damping_t: f64,
    /// `C_r = damping_r q R* sqrt(I_r)`.
    pub(crate) damping_r: f64,
    /// `mu_s`.
    pub(crate) friction: f64,
    /// `mu_r`.
    pub(crate) rolling: f64,
    /// Pull over reduced radius, N/m.
    pub(crate) adhesion: f64,
}

impl Law {
    /// Refuses constants outside their ranges.
    pub fn check(&self) -> Result<(), DemError> {
        match *self {
            Self::Linear { stiffness_n_m, tangential_ratio } => {
                positive("stiffness_n_m", stiffness_n_m)?;
                positive("tangential_ratio", tangential_ratio)?;
                within("tangential_ratio", tangential_ratio, 0.0, 1.0)
            }
            Self::Hertz { modulus_pa, poisson_ratio } => {
                positive("modulus_pa", modulus_pa)?;
                within("poisson_ratio", poisson_ratio, 0.0, 0.5)
            }
        }
    }

    /// Reduced moduli E* and G* of two bodies of one material, in Pa.
    fn reduced_moduli(modulus_pa: f64, poisson_ratio: f64) -> (f64, f64) {
        let shear = 0.5 * modulus_pa / (1.0 + poisson_ratio);
        (0.5 * modulus_pa / (1.0 - poisson_ratio * poisson_ratio), 0.5 * shear / (2.0 - poisson_ratio))
    }

    /// The factors of this law with these coefficients.
    pub(crate) fn factors(&self, with: &Coefficients) -> Factors {
        let ratio = with.damping_ratio();
        let (hertz, elastic, tangent, shear, damping) = match *self {
            Self::Linear { stiffness_n_m: k, tangential_ratio } => {
                (false, k, k, k * tangential_ratio, 2.0 * ratio)
            }
            Self::Hertz { modulus_pa, poisson_ratio } => {
                let (e, g) = Self::reduced_moduli(modulus_pa, poisson_ratio);
                (true, 4.0 / 3.0 * e, 2.0 * e, 8.0 * g, 2.0 * (5.0_f64 / 6.0).sqrt() * ratio)
            }
        };
        Factors {
            hertz,
            elastic,
            damping_n: damping * tangent.sqrt(),
            shear,
            damping_t: damping * shear.sqrt(),
            damping_r: 2.0 * with.rolling_damping * shear.sqrt(),
            friction: with.sliding_friction,
            rolling: with.rolling_friction,
            adhesion: 2.0 * PI * with.work_of_adhesion_j_m2,
        }
    }
}

/// The longest step in s with which contacts are followed, for the smallest grain and the fastest impact.
///
/// Hertz: 0.3 of Rayleigh's time `pi R sqrt(rho/G) / (0.1631 nu + 0.8766)` and 0.2 of Hertz's contact time of two grains,
/// `2.87 (m*^2 / (R* E*^2 v))^(1/5)`, whichever is shorter. Linear: 0.1 of the contact time `pi sqrt(m*/k_n)`.
/// `density_kg_m3`, `smallest_radius_m` and `fastest_m_s` have to be positive.
pub fn stable_step_s(
    law: &Law,
    density_kg_m3: f64,
    smallest_radius_m: f64,
    fastest_m_s: f64,
) -> Result<f64, DemError> {
    law.check()?;
    positive("density_kg_m3", density_kg_m3)?;
    positive("smallest_radius_m", smallest_radius_m)?;
    positive("fastest_m_s", fastest_m_s)?;
    let reduced_mass = 2.0 / 3.0 * PI * smallest_radius_m.powi(3) * density_kg_m3;
    Ok(match *law {
        Law::Linear { stiffness_n_m, .. } => 0.1 * PI * (reduced_mass / stiffness_n_m).sqrt(),
        Law::Hertz { modulus_pa, poisson_ratio } => {
            let shear = 0.5 * modulus_pa / (1.0 + poisson_ratio);
            let rayleigh =
                PI * smallest_radius_m * (density_kg_m3 / shear).sqrt() / (0.1631 * poisson_ratio + 0.8766);
            let (e, _) = Law::reduced_moduli(modulus_pa, poisson_ratio);
            let contact = 2.87
                * (reduced_mass * reduced_mass / (0.5 * smallest_radius_m * e * e * fastest_m_s)).powf(0.2);
            (0.3 * rayleigh).min(0.2 * contact)
        }
    })
}
