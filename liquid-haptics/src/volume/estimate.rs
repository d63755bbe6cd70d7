use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};

use super::profile::{Mass, Profile};
use super::valleys::{Grid, Valley};
use super::{
    Candidate, Cause, ErrorCorrelation, Liquid, SettledPose, Verdict, VolumeError, VolumeEstimate, checked,
};
use crate::container::Container;
use crate::wrench::{Departures, Grasp};

/// Two-sided level of the intervals.
const CONFIDENCE: f64 = 0.95;
/// Misfits less likely than this one are none of noise.
const MISFIT_P: f64 = 1e-3;
/// Tilts within this angle of each other are one, rad: half a degree, what an arm repeats.
const ALIKE_RAD: f64 = 0.01;
/// Rounds in which the noise and the weight of the mass's prior settle.
const NOISE_ROUNDS: usize = 3;

/// Volume by bounded least squares on the torques of all poses at once ([Matl 2021], eqs 2.1 and 2.2).
///
/// The interval holds the volumes whose profile likelihood is within the 95 % level: chi-square with one degree of freedom where
/// the noise is given (Wilks 1938, doi:10.1214/aoms/1177732360), Student's t squared where it is estimated.
#[derive(Clone, Copy)]
pub struct VolumeFit<'a> {
    /// What holds the liquid.
    pub container: &'a dyn Container,
    /// How it is held.
    pub grasp: Grasp,
    /// How the set-up is known to differ from the grasp as stated.
    pub departures: Departures,
    /// The liquid's mass or density.
    pub liquid: Liquid,
    /// The torque's noise, N m; estimated from the residuals where it is absent.
    pub sigma_nm: Option<f64>,
    /// How the torque's errors are correlated from pose to pose; the poses are then in the order in which they were measured.
    pub error_correlation: ErrorCorrelation,
    /// An interval wider than this share of the capacity leaves the volume open (0 to 1; a half is usual).
    pub widest_share: f64,
}

impl VolumeFit<'_> {
    /// The volume that fits all poses best, and what they leave open.
    ///
    /// # Errors
    /// [`VolumeError::Range`] for settings outside their range, [`VolumeError::TooFew`] and [`VolumeError::Pose`],
    /// [`VolumeError::NegativeMass`], [`VolumeError::Search`], and the container's.
    pub fn estimate(&self, poses: &[SettledPose]) -> Result<VolumeEstimate, VolumeError> {
        self.check(poses)?;
        let profile =
            Profile::new(self.container, &self.grasp, &self.departures, self.error_correlation, poses)?;
        let grid = Grid::new(&profile)?;
        let (sigma_nm, freedom) = match self.sigma_nm {
            Some(sigma) => (sigma, None),
            None => {
                let (sigma, freedom) = self.noise(&profile, &grid)?;
                (sigma, Some(freedom))
            }
        };
        let mass = self.mass(&profile, sigma_nm);
        let quantile = quantile(freedom).powi(2);
        let (valleys, deepest) = grid.valleys(mass, quantile * sigma_nm * sigma_nm)?;
        let checks = poses.len() - 1 + usize::from(matches!(self.liquid, Liquid::MassAndDensity { .. }));
        let misfit_p = if freedom.is_none() && checks > 0 {
            let chi_square = deepest.misfit / (sigma_nm * sigma_nm);
            ChiSquared::new(checks as f64).ok().map(|d| d.sf(chi_square))
        } else {
            None
        };
        let misfits = misfit_p.is_some_and(|p| p < MISFIT_P);
        let verdict = if misfits { Verdict::Misfit } else { self.verdict(poses, &valleys) };
        let capacity = profile.capacity_m3();
        let reach = valleys
            .iter()
            .fold([1.0f64, 0.0f64], |[low, high], v| [low.min(v.reach[0]), high.max(v.reach[1])]);
        let share = if verdict == Verdict::Empty { 0.0 } else { deepest.share };
        Ok(VolumeEstimate {
            volume_m3: share * capacity,
            interval_m3: reach.map(|s| s * capacity),
            mass_kg: profile.mass(&profile.levers(share)?, share, mass),
            sigma_nm,
            misfit_p,
            verdict,
        })
    }

    pub(super) fn mass(&self, profile: &Profile<'_>, sigma_nm: f64) -> Mass {
        Mass::of(&self.liquid, profile.capacity_m3(), sigma_nm)
    }

    pub(super) fn check(&self, poses: &[SettledPose]) -> Result<(), VolumeError> {
        checked(poses)?;
        let range = |name, got, expected| Err(VolumeError::Range { name, got, expected });
        match self.liquid {
            Liquid::Density(got) | Liquid::MassAndDensity { density_kg_m3: got, .. }
                if !(got > 0.0 && got.is_finite()) =>
            {
                return range("density_kg_m3", got, "above 0");
            }
            Liquid::Mass { mass_kg, .. } | Liquid::MassAndDensity { mass_kg, .. } if !mass_kg.is_finite() => {
                return range("mass_kg", mass_kg, "a number");
            }
            Liquid::Mass { error_kg, .. } if !(error_kg >= 0.0 && error_kg.is_finite()) => {
                return range("error_kg", error_kg, "0 or more");
            }
            Liquid::MassAndDensity { error_kg, .. } if !(error_kg > 0.0 && error_kg.is_finite()) => {
                return range("error_kg", error_kg, "above 0");
            }
            Liquid::Mass { mass_kg, error_kg } | Liquid::MassAndDensity { mass_kg, error_kg, .. }
                if mass_kg < -quantile(None) * error_kg =>
            {
                return Err(VolumeError::NegativeMass { mass_kg, error_kg });
            }
            Liquid::Mass { .. } | Liquid::Density(_) | Liquid::MassAndDensity { .. } => {}
        }
        if !(self.widest_share > 0.0 && self.widest_share <= 1.0) {
            return range("widest_share", self.widest_share, "above 0, at most 1");
        }
        match self.sigma_nm {
            Some(sigma) if !(sigma > 0.0 && sigma.is_finite()) => range("sigma_nm", sigma, "above 0"),
            None if poses.len() < 3 => {
                Err(VolumeError::TooFew { what: "poses to estimate the noise", got: poses.len(), least: 3 })
            }
            _ => Ok(()),
        }
    }

    /// The torque's noise (N m) from the residuals, and its degrees of freedom: poses less the volume and the share of the mass
    /// that the torques rather than the prior determine.
    fn noise(&self, profile: &Profile<'_>, grid: &Grid<'_>) -> Result<(f64, f64), VolumeError> {
        let least = profile.scale() * f64::EPSILON * 16.0 + f64::MIN_POSITIVE.sqrt();
        let mut sigma = profile.scale().max(least);
        let mut freedom = profile.poses() as f64 - 1.0;
        let mut mass = match self.liquid {
            Liquid::Mass { mass_kg, .. } => Mass::Exact(mass_kg),
            Liquid::Density(density) => Mass::Share(density * profile.capacity_m3()),
            // To begin with the mass alone says which of the volumes it is.
            Liquid::MassAndDensity { .. } => self.mass(profile, sigma),
        };
        for _ in 0..NOISE_ROUNDS {
            let (share, _) = grid.best(mass)?;
            let levers = profile.levers(share)?;
            let strength: f64 = levers.iter().map(|b| b * b).sum();
            let from_torques = match mass {
                Mass::Prior(_, weight) if strength > 0.0 => strength / (strength + weight),
                _ => 0.0,
            };
            freedom = profile.poses() as f64 - 1.0 - from_torques;
            sigma = (profile.squares(&levers, share, mass).0 / freedom).sqrt().max(least);
            match self.mass(profile, sigma) {
                prior @ (Mass::Prior(..) | Mass::ShareAndPrior(..)) => mass = prior,
                // Without a prior there is nothing to settle.
                Mass::Exact(_) | Mass::Share(_) => break,
            }
        }
        Ok((sigma, freedom))
    }

    fn verdict(&self, poses: &[SettledPose], valleys: &[Valley]) -> Verdict {
        let capacity = self.container.capacity_m3();
        let open = |cause| Verdict::Undetermined {
            cause,
            candidates: valleys
                .iter()
                .map(|v| Candidate {
                    volume_m3: v.share * capacity,
                    interval_m3: v.reach.map(|s| s * capacity),
                })
                .collect(),
        };
        if let Liquid::Mass { mass_kg, error_kg } = self.liquid
            && mass_kg <= quantile(None) * error_kg
        {
            return Verdict::Empty;
        }
        let wide = valleys.iter().map(|v| v.reach[1] - v.reach[0]).sum::<f64>() > self.widest_share;
        let (low, high) = poses.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
            (low.min(p.tilt_rad), high.max(p.tilt_rad))
        });
        // The mass checks the torque, then.
        let both = matches!(self.liquid, Liquid::MassAndDensity { .. });
        match valleys {
            _ if wide => open(Cause::Flat),
            _ if high - low < ALIKE_RAD && !both => open(Cause::AlikePoses),
            [valley] if valley.reach[0] <= 0.0 => match self.liquid {
                Liquid::Density(_) | Liquid::MassAndDensity { .. } => Verdict::Empty,
                Liquid::Mass { .. } => Verdict::Determined,
            },
            [valley] if valley.reach[1] >= 1.0 => Verdict::Full,
            [_] => Verdict::Determined,
            _ => open(Cause::SeveralVolumes),
        }
    }
}

/// How many standard errors the level reaches to either side, with the degrees of freedom of an estimated noise.
pub(super) fn quantile(freedom: Option<f64>) -> f64 {
    let upper = 0.5 + 0.5 * CONFIDENCE;
    let t = freedom.and_then(|f| StudentsT::new(0.0, 1.0, f).ok()).map(|t| t.inverse_cdf(upper));
    t.unwrap_or_else(|| Normal::standard().inverse_cdf(upper))
}
