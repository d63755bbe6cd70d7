//! The misfit of all poses as a function of the volume, the mass profiled out.

use nalgebra::DMatrix;

use super::{ErrorCorrelation, Liquid, SettledPose};
use crate::container::{Container, ContainerError};
use crate::wrench::{Departures, Grasp};

/// How the mass follows from the volume and the torques.
#[derive(Debug, Clone, Copy)]
pub(super) enum Mass {
    /// A known mass, kg.
    Exact(f64),
    /// By least squares with a prior: mass (kg), and the torque's variance over the prior's ((N m / kg)^2).
    Prior(f64, f64),
    /// The capacity's mass, kg, times the share of it that is filled.
    Share(f64),
    /// The capacity's mass, kg, times the share of it that is filled; and a prior of the mass as in [`Mass::Prior`].
    ShareAndPrior(f64, f64, f64),
}

impl Mass {
    /// A liquid's, with the torque's noise (N m).
    pub(super) fn of(liquid: &Liquid, capacity_m3: f64, sigma_nm: f64) -> Self {
        match *liquid {
            Liquid::Mass { mass_kg, error_kg } if error_kg > 0.0 => {
                Self::Prior(mass_kg, (sigma_nm / error_kg).powi(2))
            }
            Liquid::Mass { mass_kg, .. } => Self::Exact(mass_kg),
            Liquid::Density(density) => Self::Share(density * capacity_m3),
            Liquid::MassAndDensity { mass_kg, error_kg, density_kg_m3 } => {
                Self::ShareAndPrior(density_kg_m3 * capacity_m3, mass_kg, (sigma_nm / error_kg).powi(2))
            }
        }
    }
}

/// Torques of a load as functions of the share of the capacity that is filled.
pub(super) struct Profile<'a> {
    container: &'a dyn Container,
    grasp: &'a Grasp,
    departures: &'a Departures,
    capacity_m3: f64,
    tilts: Vec<f64>,
    /// Torque of everything but the liquid, N m.
    shell: Vec<f64>,
    /// Measured torque less that, N m; whitened where the errors are correlated.
    excess: Vec<f64>,
    /// The Cholesky factor of the errors' correlation; none where they are independent.
    factor: Option<DMatrix<f64>>,
}

impl<'a> Profile<'a> {
    pub(super) fn new(
        container: &'a dyn Container,
        grasp: &'a Grasp,
        departures: &'a Departures,
        correlation: ErrorCorrelation,
        poses: &[SettledPose],
    ) -> Result<Self, ContainerError> {
        let tilts: Vec<f64> = poses.iter().map(|p| p.tilt_rad).collect();
        let mut profile = Self {
            container,
            grasp,
            departures,
            capacity_m3: container.capacity_m3(),
            shell: Vec::with_capacity(tilts.len()),
            excess: Vec::with_capacity(tilts.len()),
            factor: correlation.factor(tilts.len()),
            tilts,
        };
        for pose in poses {
            let shell = profile.torque(pose.tilt_rad, 0.0, 0.0)?;
            profile.shell.push(shell);
            profile.excess.push(pose.wrench.tau_z_nm - shell);
        }
        let mut excess = std::mem::take(&mut profile.excess);
        profile.whiten(&mut excess);
        profile.excess = excess;
        Ok(profile)
    }

    pub(super) fn poses(&self) -> usize {
        self.tilts.len()
    }

    pub(super) fn capacity_m3(&self) -> f64 {
        self.capacity_m3
    }

    fn torque(&self, tilt_rad: f64, mass_kg: f64, share: f64) -> Result<f64, ContainerError> {
        let volume = share.clamp(0.0, 1.0) * self.capacity_m3;
        Ok(self.grasp.wrench(self.container, tilt_rad, mass_kg, volume, self.departures)?.tau_z_nm)
    }

    /// Torque of a kilogram of the liquid at a tilt, N m / kg.
    pub(super) fn lever_at(&self, tilt_rad: f64, share: f64) -> Result<f64, ContainerError> {
        Ok(self.torque(tilt_rad, 1.0, share)? - self.torque(tilt_rad, 0.0, share)?)
    }

    /// Whitens values of all poses.
    fn whiten(&self, values: &mut [f64]) {
        let Some(l) = &self.factor else { return };
        for i in 0..values.len() {
            let predicted: f64 = (0..i).map(|j| l[(i, j)] * values[j]).sum();
            values[i] = (values[i] - predicted) / l[(i, i)];
        }
    }

    /// Torques of a kilogram of the liquid at all poses, N m / kg; whitened as the excess is.
    pub(super) fn levers(&self, share: f64) -> Result<Vec<f64>, ContainerError> {
        let pairs = self.tilts.iter().zip(&self.shell);
        let lever = |(tilt, shell): (&f64, &f64)| Ok(self.torque(*tilt, 1.0, share)? - shell);
        let mut levers = pairs.map(lever).collect::<Result<Vec<f64>, ContainerError>>()?;
        self.whiten(&mut levers);
        Ok(levers)
    }

    /// The mass (kg) that fits best.
    pub(super) fn mass(&self, levers: &[f64], share: f64, mass: Mass) -> f64 {
        match mass {
            Mass::Exact(mass) => mass,
            Mass::Share(full) | Mass::ShareAndPrior(full, ..) => share * full,
            Mass::Prior(prior, weight) => {
                let (mut top, mut bottom) = (weight * prior, weight);
                for (lever, excess) in levers.iter().zip(&self.excess) {
                    top += lever * excess;
                    bottom += lever * lever;
                }
                if bottom > 0.0 { (top / bottom).max(0.0) } else { prior }
            }
        }
    }

    /// Sum of the residuals' squares over the poses, (N m)^2, and the prior's part in the same unit.
    pub(super) fn squares(&self, levers: &[f64], share: f64, mass: Mass) -> (f64, f64) {
        let best = self.mass(levers, share, mass);
        let poses = levers.iter().zip(&self.excess).map(|(b, d)| (d - best * b).powi(2)).sum();
        let prior = match mass {
            Mass::Prior(prior, weight) | Mass::ShareAndPrior(_, prior, weight) => {
                weight * (best - prior).powi(2)
            }
            Mass::Exact(_) | Mass::Share(_) => 0.0,
        };
        (poses, prior)
    }

    /// All of the misfit, (N m)^2.
    pub(super) fn misfit(&self, share: f64, mass: Mass) -> Result<f64, ContainerError> {
        let (poses, prior) = self.squares(&self.levers(share)?, share, mass);
        Ok(poses + prior)
    }

    /// The largest torque measured above the load's own, N m.
    pub(super) fn scale(&self) -> f64 {
        self.excess.iter().chain(&self.shell).fold(0.0, |most: f64, e| most.max(e.abs()))
    }
}
