//! Stiffness: the band's force, fitted on a rigid probe, and palpation ([Matl 2021], section 7.4 and Table 7.1).

use hw_traits::arm::Arm;
use hw_traits::camera::DepthCamera;
use hw_traits::clock::Clock;
use hw_traits::gripper::Gripper;
use nalgebra::{DMatrix, DVector};

use crate::features::Polynomial;
use crate::handling::RigError;
use crate::rollout::Setup;

/// One press on a rigid probe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Press {
    /// Length of the band, m.
    pub throw_m: f64,
    /// How deep the probe indents it, m.
    pub depth_m: f64,
    /// The force, N.
    pub force_n: f64,
}

/// The band's force F = h(throw, depth): depth times a polynomial of both, so that what does not touch does not push.
#[derive(Debug, Clone, PartialEq)]
pub struct BandForce {
    polynomial: Polynomial,
    coefficients: DVector<f64>,
    /// Smallest and largest throw and depth that were measured, m.
    range: [[f64; 2]; 2],
    /// Sigma of what it leaves, N.
    pub sigma_n: f64,
}

/// Why there is no force or no stiffness.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StiffnessError {
    /// Too few presses.
    #[error("{presses} presses for {coefficients} coefficients: at least {least} are needed")]
    TooFew {
        /// Presses.
        presses: usize,
        /// Coefficients.
        coefficients: usize,
        /// Presses needed.
        least: usize,
    },
    /// A press that is none.
    #[error("press {number}: {press:?}; expected finite numbers, throw and depth above 0")]
    Press {
        /// Its number, from 0.
        number: usize,
        /// The press.
        press: Press,
    },
    /// The presses are too much alike.
    #[error("the presses do not determine the force: vary both throw and depth, each over 4 values or more")]
    Undetermined,
    /// Nothing was measured there.
    #[error("{name} of {value} m: the force was measured from {low} to {high} m")]
    Outside {
        /// Throw or depth.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Smallest measured.
        low: f64,
        /// Largest measured.
        high: f64,
    },
    /// No dent was seen.
    #[error(
        "pressed to {depth_m:.4} m, the dough gave way by {deflection_m:.5} m, less than {least_m:.5} m: it is too stiff for this band"
    )]
    NoDent {
        /// The deepest press.
        depth_m: f64,
        /// What was seen, m.
        deflection_m: f64,
        /// What is needed, m.
        least_m: f64,
    },
    /// The rig failed.
    #[error(transparent)]
    Rig(#[from] RigError),
}

const DEGREE: u8 = 3;

impl BandForce {
    /// Fits the force to presses by least squares.
    ///
    /// # Errors
    /// [`StiffnessError`].
    pub fn fit(presses: &[Press]) -> Result<Self, StiffnessError> {
        let good = |p: &Press| {
            p.throw_m > 0.0
                && p.depth_m > 0.0
                && [p.throw_m, p.depth_m, p.force_n].iter().all(|v| v.is_finite())
        };
        if let Some(number) = presses.iter().position(|p| !good(p)) {
            return Err(StiffnessError::Press { number, press: presses[number] });
        }
        let rows: Vec<Vec<f64>> = presses.iter().map(|p| vec![p.throw_m, p.depth_m]).collect();
        let polynomial = Polynomial::standardised(&rows, DEGREE);
        let (n, p) = (presses.len(), polynomial.len());
        if n < p + 2 {
            return Err(StiffnessError::TooFew { presses: n, coefficients: p, least: p + 2 });
        }
        let design = DMatrix::from_row_iterator(
            n,
            p,
            presses.iter().zip(&rows).flat_map(|(press, row)| {
                polynomial.terms(row).into_iter().map(|t| t * press.depth_m).collect::<Vec<_>>()
            }),
        );
        let forces = DVector::from_iterator(n, presses.iter().map(|p| p.force_n));
        let qr = design.clone().qr();
        let diagonal = qr.r().diagonal();
        if diagonal.iter().any(|d| !(d.abs() > 1e-9 * diagonal.amax())) {
            return Err(StiffnessError::Undetermined);
        }
        let coefficients =
            qr.r().solve_upper_triangular(&qr.q().tr_mul(&forces)).ok_or(StiffnessError::Undetermined)?;
        let left = (&forces - &design * &coefficients).norm_squared();
        let range = [0, 1].map(|k| {
            let values = rows.iter().map(|r| r[k]);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)])
        });
        Ok(Self { polynomial, coefficients, range, sigma_n: (left / (n - p) as f64).sqrt() })
    }

    /// The force (N) at a throw and a depth (m).
    ///
    /// # Errors
    /// [`StiffnessError::Outside`] where nothing was measured; depths down to 0 are within.
    pub fn force_n(&self, throw_m: f64, depth_m: f64) -> Result<f64, StiffnessError> {
        for (name, value, [low, high]) in
            [("a throw", throw_m, self.range[0]), ("a depth", depth_m, [0.0, self.range[1][1]])]
        {
            let slack = 1e-3 * (high - low);
            if !(value >= low - slack && value <= high + slack) {
                return Err(StiffnessError::Outside { name, value, low, high });
            }
        }
        let terms = self.polynomial.terms(&[throw_m, depth_m]);
        Ok(depth_m * terms.iter().zip(self.coefficients.iter()).map(|(t, c)| t * c).sum::<f64>())
    }
}

/// How a dough is palpated: pressed ever deeper at its highest point until it gives way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Palpation {
    /// Length of the band, m.
    pub throw_m: f64,
    /// First depth and the step to the next, m.
    pub step_m: f64,
    /// Deepest press, m.
    pub deepest_m: f64,
    /// The dent at which it ends, m: far above the noise of a height.
    pub dent_m: f64,
    /// Pictures over which a height is averaged.
    pub pictures: usize,
}

impl Default for Palpation {
    /// 90 mm; steps of 2 mm down to 30 mm; 2 mm of dent; 8 pictures.
    fn default() -> Self {
        Self { throw_m: 0.09, step_m: 2e-3, deepest_m: 0.03, dent_m: 2e-3, pictures: 8 }
    }
}

/// What palpation found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Palpated {
    /// Force over dent, N/m; Table 7.1 has N/mm.
    pub stiffness_n_m: f64,
    /// Force of the deepest press, N.
    pub force_n: f64,
    /// The dent that it left, m.
    pub dent_m: f64,
}

impl Palpation {
    /// Palpates the dough on a rig. What the dough gives way the band is not indented: the force is h(throw, depth - dent).
    ///
    /// # Errors
    /// [`StiffnessError`].
    pub fn run<R: Arm + Gripper + DepthCamera + Clock>(
        &self,
        rig: &mut R,
        setup: &Setup,
        band: &BandForce,
    ) -> Result<Palpated, StiffnessError> {
        let count = self.pictures.max(1);
        let first = setup.look(rig)?;
        let height = |rig: &mut R| -> Result<f64, RigError> {
            let heights = (0..count).map(|_| Ok(setup.look(rig)?.height_m));
            Ok(heights.sum::<Result<f64, RigError>>()? / count as f64)
        };
        let before = height(rig)?;
        let [x, y] = first.highest_m;
        setup.handling.stretch(rig, self.throw_m)?;
        let steps = (self.deepest_m / self.step_m).floor().clamp(1.0, 1000.0) as usize;
        let mut seen = (0.0, 0.0);
        for k in 1..=steps {
            let depth_m = self.step_m * k as f64;
            let z = (first.ground_m + before - depth_m).max(first.ground_m);
            setup.handling.touch(rig, first.ground_m, &[[x, y, z]])?;
            let dent_m = before - height(rig)?;
            if dent_m >= self.dent_m {
                let force_n = band.force_n(self.throw_m, (depth_m - dent_m).max(0.0))?;
                return Ok(Palpated { stiffness_n_m: force_n / dent_m, force_n, dent_m });
            }
            seen = (depth_m, dent_m);
        }
        Err(StiffnessError::NoDent { depth_m: seen.0, deflection_m: seen.1, least_m: self.dent_m })
    }
}
