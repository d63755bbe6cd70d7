//! The likelihood of settled poses: of a volume, as a normal shape over the logarithm of the density.

use nalgebra::{DMatrix, DVector};

use super::gaussian::Shape;
use super::{FusionError, PoseErrors};
use crate::container::{Container, ContainerError, Cylinder, up_at_tilt};
use crate::volume::SettledPose;
use crate::wrench::Grasp;

/// Step of a derivative by the tilt, rad.
const STEP_RAD: f64 = 1e-4;
/// A relative error of the density above this one is no narrow one.
const NARROW: f64 = 0.2;
/// Rounds in which mass and covariance settle.
const ROUNDS: usize = 3;
/// How often the maximum is then looked for with the covariance that it has.
const CORRECTIONS: usize = 3;
/// Bends of the likelihood over a standard deviation (one of a normal shape) below this are none of a maximum; the longest step towards one, in
/// standard deviations.
const LEAST_BEND: f64 = 0.25;
const LONGEST: f64 = 3.0;
/// Widest normal shape over the logarithm of the density.
const WIDEST: f64 = 30.0;

/// Poses of one container.
pub(super) struct Poses<'a> {
    container: &'a Cylinder,
    grasp: &'a Grasp,
    errors: &'a PoseErrors,
    poses: &'a [SettledPose],
}

/// What a volume does at all poses: levers of a kilogram about the cavity's bottom, and their derivative by the tilt, m.
struct Levers {
    sin_cos: Vec<[f64; 2]>,
    lever: Vec<[f64; 2]>,
}

impl<'a> Poses<'a> {
    pub(super) fn new(
        container: &'a Cylinder,
        grasp: &'a Grasp,
        errors: &'a PoseErrors,
        poses: &'a [SettledPose],
    ) -> Result<Self, FusionError> {
        const LEAST: usize = 2;
        if poses.len() < LEAST {
            return Err(FusionError::TooFew { what: "poses", got: poses.len(), least: LEAST });
        }
        for (index, pose) in poses.iter().enumerate() {
            for got in [pose.tilt_rad, pose.wrench.fy_n, pose.wrench.tau_z_nm] {
                if !got.is_finite() {
                    return Err(FusionError::Value { what: "pose", index, got, expected: "numbers" });
                }
            }
        }
        Ok(Self { container, grasp, errors, poses })
    }

    fn levers(&self, volume_m3: f64) -> Result<Levers, ContainerError> {
        let grasp = self.grasp.grasp_height_m;
        let at = |tilt: f64| {
            let center = self.container.fill(&up_at_tilt(tilt), volume_m3)?.center_of_mass;
            let (sin, cos) = tilt.sin_cos();
            Ok::<f64, ContainerError>((center.z - grasp) * sin + center.x * cos)
        };
        let lever = |pose: &SettledPose| {
            let tilt = pose.tilt_rad;
            Ok([at(tilt)?, 0.5 * (at(tilt + STEP_RAD)? - at(tilt - STEP_RAD)?) / STEP_RAD])
        };
        Ok(Levers {
            sin_cos: self.poses.iter().map(|p| p.tilt_rad.sin_cos().into()).collect(),
            lever: self.poses.iter().map(lever).collect::<Result<_, ContainerError>>()?,
        })
    }

    /// How many readings count.
    pub(super) fn rows(&self) -> usize {
        self.poses.len() * if self.errors.force.is_some() { 2 } else { 1 }
    }

    /// Readings less those of the empty container, and the readings of a kilogram.
    fn linear(&self, levers: &Levers) -> [DVector<f64>; 2] {
        let (count, g) = (self.poses.len(), self.grasp.gravity_m_s2);
        let shell = self.grasp.shell_center_m - self.grasp.grasp_height_m;
        let empty = self.grasp.container_mass_kg + self.grasp.gripper_mass_kg;
        let left = DVector::from_fn(self.rows(), |i, _| {
            let pose = &self.poses[i % count];
            if i < count {
                pose.wrench.tau_z_nm + g * self.grasp.container_mass_kg * shell * levers.sin_cos[i][0]
            } else {
                pose.wrench.fy_n + g * empty
            }
        });
        let kilogram =
            DVector::from_fn(self.rows(), |i, _| if i < count { -g * levers.lever[i][0] } else { -g });
        [left, kilogram]
    }

    /// Covariance of the readings with a mass of liquid.
    fn covariance(&self, levers: &Levers, mass_kg: f64) -> DMatrix<f64> {
        let (count, rows, e) = (self.poses.len(), self.rows(), self.errors);
        let (g, container) = (self.grasp.gravity_m_s2, self.grasp.container_mass_kg);
        let shell = self.grasp.shell_center_m - self.grasp.grasp_height_m;
        let weight = (container + self.grasp.gripper_mass_kg + mass_kg) * g;
        let force = e.force.as_ref();
        let offset = force.map_or(0.0, |f| f.offset_n);
        let effects = DMatrix::from_fn(rows, 8, |i, j| {
            let [sin, cos] = levers.sin_cos[i % count];
            let [_, by_tilt] = levers.lever[i % count];
            match (i < count, j) {
                (true, 0) => e.torque_offset_nm,
                (true, 1) => e.grasp_m * g * (container + mass_kg) * sin,
                (true, 2) => -e.tilt_rad * g * (container * shell * cos + mass_kg * by_tilt),
                (true, 3) => -e.container_kg * g * shell * sin,
                (true, 4) => -e.shell_center_m * g * container * sin,
                (false, 3) => -e.container_kg * g,
                (false, 5) => -force.map_or(0.0, |f| f.gain) * weight,
                (false, 6) => -offset * sin,
                (false, 7) => offset * cos,
                _ => 0.0,
            }
        });
        let mut covariance = &effects * effects.transpose();
        let memory = -e.between_poses_s / e.wander_s;
        for i in 0..rows {
            for j in 0..rows {
                if (i < count) == (j < count) {
                    let (white, wander) = match force.filter(|_| i >= count) {
                        None => (e.torque_nm, e.torque_wander_nm),
                        Some(f) => (f.noise_n, f.wander_n),
                    };
                    covariance[(i, j)] += wander * wander * (memory * i.abs_diff(j) as f64).exp();
                    if i == j {
                        covariance[(i, j)] += white * white;
                    }
                }
            }
        }
        covariance
    }

    /// Logarithm of the likelihood of a mass, the squares in it, and the mass of greatest likelihood with that covariance and its error.
    fn weigh(&self, levers: &Levers, mass_kg: f64) -> Option<[f64; 4]> {
        let [left, kilogram] = self.linear(levers);
        let factor = self.covariance(levers, mass_kg).cholesky()?;
        let solved = factor.solve(&kilogram);
        let information = kilogram.dot(&solved);
        let residual = &left - &kilogram * mass_kg;
        let squares = residual.dot(&factor.solve(&residual));
        let ln_det: f64 = factor.l().diagonal().iter().map(|d| d.ln()).sum();
        Some([-0.5 * squares - ln_det, squares, left.dot(&solved) / information, information.sqrt().recip()])
    }

    /// The likelihood of a volume (m^3) over the logarithm of the density (between two, kg/m^3); `None` where it is no number.
    pub(super) fn shape(
        &self,
        volume_m3: f64,
        ln_density: [f64; 2],
    ) -> Result<Option<Shape>, ContainerError> {
        let levers = self.levers(volume_m3)?;
        let mass = |ln_density: f64| volume_m3 * ln_density.exp();
        let middle = 0.5 * (ln_density[0] + ln_density[1]);
        let mut best = mass(middle);
        for _ in 0..ROUNDS {
            let Some([_, _, found, error]) = self.weigh(&levers, best) else { return Ok(None) };
            if !(volume_m3 > 0.0 && error < NARROW * found) {
                return Ok(self.wide(&levers, volume_m3, ln_density));
            }
            best = found;
        }
        let Some([_, _, _, error]) = self.weigh(&levers, best) else { return Ok(None) };
        let mut shape = Shape { peak: 0.0, mean: (best / volume_m3).ln(), sd: error / best };
        let at = |shape: &Shape, z: f64| {
            self.weigh(&levers, mass(shape.mean + z * shape.sd)).map_or(f64::NAN, |w| w[0])
        };
        // The covariance grows with the mass: where the misfit is large that shifts the maximum.
        for _ in 0..CORRECTIONS {
            let [before, here, after] = [-1.0, 0.0, 1.0].map(|z| at(&shape, z));
            let bend = 2.0 * here - before - after;
            // What bends upwards, or hardly down, is far from its maximum: a step with the bend as it was.
            let bend = if bend > LEAST_BEND { bend } else { 1.0 };
            shape.mean += shape.sd * (0.5 * (after - before) / bend).clamp(-LONGEST, LONGEST);
            shape.sd /= bend.sqrt();
        }
        shape.peak = at(&shape, 0.0);
        Ok(shape.peak.is_finite().then_some(shape))
    }

    /// The parabola through three densities: where the mass is known to be next to nothing, or not known.
    fn wide(&self, levers: &Levers, volume_m3: f64, [low, high]: [f64; 2]) -> Option<Shape> {
        let at = |x: f64| self.weigh(levers, volume_m3 * x.exp()).map(|w| w[0]);
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let [a, b, c] = [at(low)?, at(middle)?, at(high)?];
        Some(parabola([a, b, c], middle, half))
    }

    /// Squares of what a volume and a density leave, over their covariance.
    pub(super) fn squares(&self, volume_m3: f64, density_kg_m3: f64) -> Result<f64, ContainerError> {
        let levers = self.levers(volume_m3)?;
        Ok(self.weigh(&levers, volume_m3 * density_kg_m3).map_or(f64::INFINITY, |w| w[1]))
    }
}

/// The normal shape through three values half a width apart; as good as straight where it would bend upwards.
pub(super) fn parabola([a, b, c]: [f64; 3], middle: f64, half: f64) -> Shape {
    let slope = 0.5 * (c - a) / half;
    let bend = ((2.0 * b - a - c) / (half * half)).max(WIDEST.powi(-2));
    let shift = slope / bend;
    Shape { peak: b + 0.5 * slope * shift, mean: middle + shift, sd: bend.sqrt().recip() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::super::ForceErrors;
    use super::*;
    use crate::wrench::Departures;

    const GRASP: Grasp = Grasp {
        container_mass_kg: 0.1,
        gripper_mass_kg: 0.9,
        grasp_height_m: 0.11,
        shell_center_m: 0.08,
        gravity_m_s2: 9.80665,
    };
    const ERRORS: PoseErrors = PoseErrors {
        torque_nm: 1e-4,
        torque_wander_nm: 2e-4,
        torque_offset_nm: 3e-4,
        grasp_m: 4e-4,
        tilt_rad: 2e-3,
        container_kg: 5e-4,
        shell_center_m: 6e-4,
        force: Some(ForceErrors { noise_n: 2e-3, wander_n: 3e-3, offset_n: 0.02, gain: 1e-3 }),
        wander_s: 30.0,
        between_poses_s: 20.0,
    };
    const VOLUME_M3: f64 = 200e-6;
    const MASS_KG: f64 = 0.2;

    fn poses(grasp: &Grasp, departures: &Departures) -> Vec<SettledPose> {
        let bottle = Cylinder::new(0.035, 0.172, 0.001).unwrap();
        let pose = |k: i32| {
            let tilt_rad = 0.4 * f64::from(k);
            let wrench = grasp.wrench(&bottle, tilt_rad, MASS_KG, VOLUME_M3, departures).unwrap();
            SettledPose { tilt_rad, wrench }
        };
        (0..7).map(pose).collect()
    }

    /// Wrenches with drawn errors, by the wrench's own code, have the covariance.
    #[test]
    fn the_covariance_is_that_of_drawn_errors() {
        let bottle = Cylinder::new(0.035, 0.172, 0.001).unwrap();
        let exact = poses(&GRASP, &Departures::default());
        let model = Poses::new(&bottle, &GRASP, &ERRORS, &exact).unwrap();
        let covariance = model.covariance(&model.levers(VOLUME_M3).unwrap(), MASS_KG);
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let mut draw = |sigma: f64| sigma * Distribution::<f64>::sample(&StandardNormal, &mut rng);
        let force = ERRORS.force.unwrap();
        let memory = (-ERRORS.between_poses_s / ERRORS.wander_s).exp();
        let (rows, draws) = (14, 40_000);
        let mut sums = DMatrix::<f64>::zeros(rows, rows);
        for _ in 0..draws {
            let departures = Departures {
                force_gain: draw(force.gain),
                torque_offset_nm: draw(ERRORS.torque_offset_nm),
                angle_offset_rad: draw(ERRORS.tilt_rad),
                grasp_offset_m: draw(ERRORS.grasp_m),
                shell_shift_m: draw(ERRORS.shell_center_m),
                surface_lag_rad: 0.0,
            };
            let container_mass_kg = GRASP.container_mass_kg + draw(ERRORS.container_kg);
            let off = poses(&Grasp { container_mass_kg, ..GRASP }, &departures);
            let offset = [draw(force.offset_n), draw(force.offset_n)];
            let mut wander = [draw(ERRORS.torque_wander_nm), draw(force.wander_n)];
            let mut row = DVector::zeros(rows);
            for (i, (off, exact)) in off.iter().zip(&exact).enumerate() {
                let (sin, cos) = exact.tilt_rad.sin_cos();
                row[i] = off.wrench.tau_z_nm - exact.wrench.tau_z_nm + wander[0] + draw(ERRORS.torque_nm);
                row[7 + i] = off.wrench.fy_n - exact.wrench.fy_n + offset[1] * cos - offset[0] * sin
                    + wander[1]
                    + draw(force.noise_n);
                let kick = (1.0 - memory * memory).sqrt();
                wander = [
                    memory * wander[0] + kick * draw(ERRORS.torque_wander_nm),
                    memory * wander[1] + kick * draw(force.wander_n),
                ];
            }
            sums += &row * row.transpose();
        }
        for i in 0..rows {
            for j in 0..rows {
                let scale = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
                let off = (sums[(i, j)] / f64::from(draws) - covariance[(i, j)]) / scale;
                assert!(off.abs() < 0.03, "{i} {j}: {off}");
            }
        }
    }

    /// Over two standard deviations the normal shape is the likelihood, at the true volume and far off it.
    #[test]
    fn the_shape_is_the_likelihood() {
        let bottle = Cylinder::new(0.035, 0.172, 0.001).unwrap();
        let exact = poses(&GRASP, &Departures::default());
        for force in [ERRORS.force, None] {
            let errors = PoseErrors { force, ..ERRORS };
            let model = Poses::new(&bottle, &GRASP, &errors, &exact).unwrap();
            for volume in [VOLUME_M3, 0.99 * VOLUME_M3, 150e-6, 400e-6] {
                let shape = model.shape(volume, [600f64.ln(), 2000f64.ln()]).unwrap().unwrap();
                let levers = model.levers(volume).unwrap();
                let likelihood = |z: f64| {
                    model.weigh(&levers, volume * (shape.mean + z * shape.sd).exp()).unwrap()[0] - shape.peak
                };
                for z in [-2.0, -1.0, 1.0, 2.0] {
                    approx::assert_abs_diff_eq!(likelihood(z), -0.5 * z * z, epsilon = 0.1);
                }
            }
        }
    }
}
