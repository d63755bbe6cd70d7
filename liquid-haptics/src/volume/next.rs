use super::profile::{Mass, Profile};
use super::{Cause, Liquid, SettledPose, Verdict, VolumeError, VolumeEstimate, VolumeFit};
use crate::container::ContainerError;

/// Volumes of the interval over which a tilt's worth is averaged.
const VOLUMES: usize = 5;
/// Torques of separate volumes that differ by as many standard deviations of the noise tell them apart.
const DECISIVE: f64 = 5.0;
/// Half the step of the central difference by the share of the capacity.
const HALF_STEP: f64 = 1e-4;

/// The tilt that narrows the volume most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NextTilt {
    /// The tilt, rad, in 0 to pi.
    pub tilt_rad: f64,
    /// The standard error of the volume that is expected with one more pose there, m^3.
    pub expected_error_m3: f64,
    /// Where separate volumes explain the poses so far: by how many standard deviations of the noise their torques differ there; a
    /// small number says that no tilt tells them apart.
    pub separation: Option<f64>,
}

/// Information (per unit of share and kilogram) about share and mass.
#[derive(Debug, Clone, Copy, Default)]
struct Information {
    share: f64,
    both: f64,
    mass: f64,
}

impl Information {
    fn with(self, by_share: f64, by_mass: f64, weight: f64) -> Self {
        Self {
            share: self.share + weight * by_share * by_share,
            both: self.both + weight * by_share * by_mass,
            mass: self.mass + weight * by_mass * by_mass,
        }
    }

    /// Variance of the share, the mass unknown as far as it is, from a share that might have been anything.
    fn variance(&self) -> f64 {
        let known = if self.mass > 0.0 { self.share - self.both * self.both / self.mass } else { self.share };
        1.0 / (known.max(0.0) + 12.0)
    }
}

impl VolumeFit<'_> {
    /// The tilt among `steps + 1` (1 or more steps) over 0 to pi at which one more pose narrows the volume most.
    ///
    /// It is the one with the least variance by Fisher's information with all poses so far, averaged over the volumes of the
    /// estimate's interval; where separate volumes explain the poses, the one among those that tell them apart, or else
    /// the one at which their torques differ most.
    ///
    /// Correlation of errors between poses is left out here.
    ///
    /// # Errors
    /// [`VolumeError::NothingToLearn`] where no torque depends on the volume, and as [`VolumeFit::estimate`].
    pub fn next_tilt(
        &self,
        poses: &[SettledPose],
        estimate: &VolumeEstimate,
        steps: usize,
    ) -> Result<NextTilt, VolumeError> {
        self.check(poses)?;
        if steps == 0 {
            return Err(VolumeError::TooFew { what: "steps", got: 0, least: 1 });
        }
        let profile =
            Profile::new(self.container, &self.grasp, &self.departures, self.error_correlation, poses)?;
        let capacity = profile.capacity_m3();
        let [low, high] = estimate.interval_m3.map(|v| v / capacity);
        let mut shares: Vec<f64> =
            (0..VOLUMES).map(|k| low + (high - low) * (k as f64 + 0.5) / VOLUMES as f64).collect();
        let mut separate = Vec::new();
        if let Verdict::Undetermined { cause: Cause::SeveralVolumes, candidates } = &estimate.verdict {
            separate = candidates.iter().map(|c| c.volume_m3 / capacity).collect();
            shares.clone_from(&separate);
        }
        let mass = self.mass(&profile, estimate.sigma_nm);
        let sofar: Vec<(f64, Information)> = shares
            .iter()
            .map(|share| Ok((*share, self.information(&profile, poses, estimate, *share)?)))
            .collect::<Result<_, ContainerError>>()?;
        let mut best: Option<([f64; 2], NextTilt)> = None;
        for step in 0..=steps {
            let tilt_rad = std::f64::consts::PI * step as f64 / steps as f64;
            let mut variance = 0.0;
            for (share, information) in &sofar {
                let (by_share, by_mass) = slopes(&profile, tilt_rad, *share, mass, estimate.mass_kg)?;
                let weight = estimate.sigma_nm.powi(-2);
                variance += information.with(by_share, by_mass, weight).variance() / sofar.len() as f64;
            }
            let gap = gap(&profile, tilt_rad, &separate, mass, estimate.mass_kg)?;
            // First what tells volumes apart, as far as that counts, then the variance.
            let gap = gap / estimate.sigma_nm;
            let worth = [gap.min(DECISIVE), -variance];
            if best.is_none_or(|(most, _)| worth > most) {
                let expected_error_m3 = variance.sqrt() * capacity;
                let separation = (!separate.is_empty()).then_some(gap);
                best = Some((worth, NextTilt { tilt_rad, expected_error_m3, separation }));
            }
        }
        // No better than a volume that might be anything.
        let anything = capacity / 12f64.sqrt();
        match best {
            Some((_, next)) if next.expected_error_m3 < anything * (1.0 - 1e-9) => Ok(next),
            _ => Err(VolumeError::NothingToLearn { mass_kg: estimate.mass_kg }),
        }
    }

    /// What the poses and the mass's prior say at a share.
    fn information(
        &self,
        profile: &Profile<'_>,
        poses: &[SettledPose],
        estimate: &VolumeEstimate,
        share: f64,
    ) -> Result<Information, ContainerError> {
        let mass = self.mass(profile, estimate.sigma_nm);
        let mut sum = Information::default();
        if let Liquid::Mass { error_kg, .. } = self.liquid
            && error_kg > 0.0
        {
            sum.mass = error_kg.powi(-2);
        }
        if let Liquid::MassAndDensity { error_kg, density_kg_m3, .. } = self.liquid {
            sum.share = (density_kg_m3 * profile.capacity_m3() / error_kg).powi(2);
        }
        for pose in poses {
            let (by_share, by_mass) = slopes(profile, pose.tilt_rad, share, mass, estimate.mass_kg)?;
            sum = sum.with(by_share, by_mass, estimate.sigma_nm.powi(-2));
        }
        Ok(sum)
    }
}

fn mass_at(share: f64, mass: Mass, best: f64) -> f64 {
    if let Mass::Share(full) | Mass::ShareAndPrior(full, ..) = mass { share * full } else { best }
}

/// Derivatives of the torque by the share (N m) and by a mass that is not exact (N m / kg).
fn slopes(
    profile: &Profile<'_>,
    tilt: f64,
    share: f64,
    mass: Mass,
    best: f64,
) -> Result<(f64, f64), ContainerError> {
    let (low, high) = ((share - HALF_STEP).max(0.0), (share + HALF_STEP).min(1.0));
    let torque = |s: f64| Ok::<f64, ContainerError>(mass_at(s, mass, best) * profile.lever_at(tilt, s)?);
    let by_share = (torque(high)? - torque(low)?) / (high - low);
    let by_mass = if let Mass::Prior(..) = mass { profile.lever_at(tilt, share)? } else { 0.0 };
    Ok((by_share, by_mass))
}

/// The least difference (N m) between the torques of any two shares; infinite for less than two.
fn gap(
    profile: &Profile<'_>,
    tilt: f64,
    shares: &[f64],
    mass: Mass,
    best: f64,
) -> Result<f64, ContainerError> {
    let torques = shares
        .iter()
        .map(|s| Ok(mass_at(*s, mass, best) * profile.lever_at(tilt, *s)?))
        .collect::<Result<Vec<f64>, ContainerError>>()?;
    let mut least = f64::INFINITY;
    for (i, a) in torques.iter().enumerate() {
        for b in &torques[i + 1..] {
            least = least.min((a - b).abs());
        }
    }
    Ok(least)
}
