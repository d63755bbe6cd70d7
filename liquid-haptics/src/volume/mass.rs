//! Mass by linear regression of the forces.

use nalgebra::{DMatrix, DVector};

use super::{SettledPose, VolumeError, checked};
use crate::wrench::Grasp;

/// Where the relative error of the forces comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ForceGain<'a> {
    /// The gain is known; 0 for forces that are right.
    Known(f64),
    /// The gain is fitted, from poses of the same load with the container empty.
    FromEmpty(&'a [SettledPose]),
}

/// What is fitted to the forces besides the liquid's mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassFit<'a> {
    /// The relative error of the forces.
    pub gain: ForceGain<'a>,
    /// Whether the sensor may have constant offsets in the gripper's frame, which turn with the tilt; without them only the
    /// forces along gravity count, as weight has none across.
    pub offsets: bool,
    /// Noise of a force, N; estimated from the residuals where it is absent.
    pub sigma_n: Option<f64>,
}

/// The liquid's mass as the forces have it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassEstimate {
    /// The mass, kg; below 0 where noise makes it so.
    pub mass_kg: f64,
    /// Standard error of the mass, kg.
    pub error_kg: f64,
    /// The relative error of the forces.
    pub force_gain: f64,
    /// Standard error of the force gain; 0 where the gain is known.
    pub force_gain_error: f64,
    /// Offsets of the force across and along the container's axis, N; 0 where they are not fitted.
    pub offset_n: [f64; 2],
    /// Noise of a force, N.
    pub sigma_n: f64,
}

/// One row of the regression: its factors, and the force.
struct Rows {
    factors: Vec<[f64; 4]>,
    forces: Vec<f64>,
}

impl Rows {
    /// Poses of a load of `load[0]` times the gain and `load[1]` times the liquid's mass times the gain.
    fn add(&mut self, poses: &[SettledPose], load: [f64; 2], offsets: bool) {
        for pose in poses {
            let (sin, cos) = pose.tilt_rad.sin_cos();
            self.factors.push([-load[0], -load[1], -sin, cos]);
            self.forces.push(pose.wrench.fy_n);
            if offsets {
                self.factors.push([0.0, 0.0, cos, sin]);
                self.forces.push(pose.wrench.fx_n);
            }
        }
    }
}

/// The liquid's mass from poses with it inside, by least squares: `f_y = -(1 + gain) g (m_c + m_g + m_l)` ([Matl 2021], section 2.4),
/// linear in the gain and its product with the mass.
///
/// # Errors
/// [`VolumeError::Range`] for a gain of -1 or less or a noise that is not above 0, [`VolumeError::Pose`], [`VolumeError::TooFew`]
/// where the noise cannot be estimated, [`VolumeError::NotDetermined`] where the poses do not tell mass, gain and offsets apart.
pub fn fit_mass(
    grasp: &Grasp,
    poses: &[SettledPose],
    fit: &MassFit<'_>,
) -> Result<MassEstimate, VolumeError> {
    checked(poses)?;
    let gravity = grasp.gravity_m_s2;
    let empty = (grasp.container_mass_kg + grasp.gripper_mass_kg) * gravity;
    if let Some(sigma) = fit.sigma_n
        && !(sigma > 0.0 && sigma.is_finite())
    {
        return Err(VolumeError::Range { name: "sigma_n", got: sigma, expected: "above 0" });
    }
    let mut rows = Rows { factors: Vec::new(), forces: Vec::new() };
    rows.add(poses, [empty, gravity], fit.offsets);
    let mut columns = vec![1];
    let mut known = 0.0;
    match fit.gain {
        ForceGain::Known(gain) if gain > -1.0 && gain.is_finite() => known = 1.0 + gain,
        ForceGain::Known(got) => {
            return Err(VolumeError::Range { name: "force_gain", got, expected: "above -1" });
        }
        ForceGain::FromEmpty(poses) => {
            checked(poses)?;
            rows.add(poses, [empty, 0.0], fit.offsets);
            columns.insert(0, 0);
        }
    }
    if fit.offsets {
        columns.extend([2, 3]);
    }
    let (count, fitted) = (rows.forces.len(), columns.len());
    let least = fitted + usize::from(fit.sigma_n.is_none());
    if count < least {
        return Err(VolumeError::TooFew { what: "forces", got: count, least });
    }
    let design = DMatrix::from_fn(count, fitted, |i, j| rows.factors[i][columns[j]]);
    let right = DVector::from_fn(count, |i, _| rows.forces[i] - known * rows.factors[i][0]);
    // Columns of unit length, so that the rank does not depend on units.
    let scales: Vec<f64> = design.column_iter().map(|c| c.norm().max(f64::MIN_POSITIVE)).collect();
    let scaled = DMatrix::from_fn(count, fitted, |i, j| design[(i, j)] / scales[j]);
    let svd = scaled.clone().svd(true, true);
    let fixed = svd.rank(RANK_TOLERANCE);
    let what = match (columns.contains(&0), fit.offsets) {
        (false, false) => "mass",
        (true, false) => "mass and gain",
        (false, true) => "mass and offsets",
        (true, true) => "mass, gain and offsets",
    };
    let missing = VolumeError::NotDetermined { what, fixed, fitted };
    if fixed < fitted {
        return Err(missing);
    }
    let Ok(solution) = svd.solve(&right, 0.0) else { return Err(missing) };
    let Some(inverse) = (scaled.transpose() * &scaled).try_inverse() else { return Err(missing) };
    let squares = (&right - &scaled * &solution).norm_squared();
    let sigma_n = fit.sigma_n.unwrap_or_else(|| (squares / (count - fitted) as f64).sqrt());
    let value = |column: usize| {
        columns.iter().position(|c| *c == column).map(|j| solution[j] / scales[j]).unwrap_or_default()
    };
    let covariance = |a: usize, b: usize| {
        let at = |column| columns.iter().position(|c| *c == column);
        let (Some(i), Some(j)) = (at(a), at(b)) else { return 0.0 };
        sigma_n * sigma_n * inverse[(i, j)] / (scales[i] * scales[j])
    };
    let gain = if known > 0.0 { known } else { value(0) };
    let mass_kg = value(1) / gain;
    // The ratio's error to first order.
    let variance = covariance(1, 1) - 2.0 * mass_kg * covariance(0, 1) + mass_kg * mass_kg * covariance(0, 0);
    Ok(MassEstimate {
        mass_kg,
        error_kg: variance.max(0.0).sqrt() / gain.abs(),
        force_gain: gain - 1.0,
        force_gain_error: covariance(0, 0).sqrt(),
        offset_n: [value(2), value(3)],
        sigma_n,
    })
}

/// Singular values below this share of the greatest count as none (columns have unit length): an offset that is known to no
/// better than ten million times a force's noise is not known.
const RANK_TOLERANCE: f64 = 1e-7;
