use super::check::check;
use super::film::Drains;
use super::gaussian::{ln_density, ln_sum};
use super::laws::{EITHER, HOPELESS, Laws, SHALLOW};
use super::marginal::Marginal;
use super::posterior::{Component, Posterior};
use super::swing::Motion;
use super::tilt::Poses;
use super::{FusionError, PoseErrors, Prior, Swing, SwingErrors};
use crate::container::{Container, Cylinder};
use crate::volume::SettledPose;
use crate::wrench::Grasp;

/// Volumes to begin with; most in the end; and in how many rounds they are placed.
const FIRST: usize = 65;
const MOST: usize = 420;
const ROUNDS: usize = 12;
/// Rounds that follow every maximum, whatever it weighs.
const FOLLOWED: usize = 4;
/// No two neighbouring volumes hold more than this share of the posterior between them.
const SHARE: f64 = 0.01;
/// Points of a predicted frequency.
const PREDICTED: usize = 4000;

/// A held cylinder, what is known of it beforehand, and how well its sensor and the laws are known.
pub struct FusionFit {
    grasp: Grasp,
    pose_errors: PoseErrors,
    laws: Laws,
}

impl std::fmt::Debug for FusionFit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FusionFit")
            .field("container", &self.laws.container)
            .field("prior", &self.laws.prior)
            .finish_non_exhaustive()
    }
}

impl FusionFit {
    /// A plan for a container (its drains are worked out here), asked as often as there are liquids.
    ///
    /// # Errors
    /// [`FusionError::Range`] for a setting outside its range.
    pub fn new(
        container: Cylinder,
        grasp: Grasp,
        prior: Prior,
        pose_errors: PoseErrors,
        swing_errors: SwingErrors,
    ) -> Result<Self, FusionError> {
        check(&grasp, &prior, &pose_errors, &swing_errors)?;
        let drains = Drains::new(&container, grasp.gravity_m_s2);
        let laws = Laws { container, gravity_m_s2: grasp.gravity_m_s2, prior, errors: swing_errors, drains };
        Ok(Self { grasp, pose_errors, laws })
    }

    /// What a swing shows of its motion, whatever the volume.
    ///
    /// # Errors
    /// [`FusionError`] for readings that are none, too few or too short.
    pub fn motion(&self, swing: &Swing<'_>) -> Result<Motion, FusionError> {
        let radius = self.laws.container.inner_radius_m();
        let gravity = self.grasp.gravity_m_s2;
        let film_nm = 1000.0 * gravity * self.laws.drains.at(0.5).moment_m4(1e-4, 1.0);
        Motion::new(swing, &self.laws.errors, radius, SHALLOW * radius, gravity, film_nm)
    }

    /// The posterior by poses, by a swing, or by both; the prior by neither.
    ///
    /// # Errors
    /// [`FusionError`] for poses that are none or too few; [`FusionError::NothingFits`].
    pub fn posterior(
        &self,
        poses: Option<&[SettledPose]>,
        motion: Option<&Motion>,
    ) -> Result<Posterior, FusionError> {
        let poses = poses
            .map(|poses| Poses::new(&self.laws.container, &self.grasp, &self.pose_errors, poses))
            .transpose()?;
        let capacity = self.laws.container.capacity_m3();
        let mut drains = motion.is_some();
        let mut least_drain = [f64::INFINITY, 1.0];
        let mut nodes: Vec<(f64, Vec<Component>)> = Vec::new();
        let mut wanted: Vec<f64> = (0..FIRST).map(|k| k as f64 / (FIRST - 1) as f64).collect();
        for round in 0..ROUNDS {
            for share in std::mem::take(&mut wanted) {
                let at = self.laws.at(share, poses.as_ref(), motion, drains)?;
                if at.drain[0] < least_drain[0] {
                    least_drain = at.drain;
                }
                nodes.push((share, at.laws));
            }
            nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
            let heights: Vec<f64> =
                nodes.iter().map(|(_, laws)| ln_sum(laws.iter().map(|l| l.ln_weight))).collect();
            if round == 0 && drains {
                let (wave, drain) = self.laws.compare(&nodes);
                drains = drain > wave - HOPELESS;
            }
            if nodes.len() < MOST {
                wanted = split(&nodes, &heights, round < FOLLOWED);
            }
            if wanted.is_empty() {
                break;
            }
        }
        let (volumes, laws) = nodes.into_iter().map(|(share, laws)| (share * capacity, laws)).unzip();
        let mut posterior = Posterior::new(volumes, laws).ok_or(FusionError::NothingFits)?;
        if let Some((volume, law)) = posterior.mode() {
            if let Some(poses) = &poses {
                let [low, high] = law.ln_density.within;
                let squares = poses.squares(volume, law.ln_density.mean.clamp(low, high).exp())?;
                posterior.poses_p = Motion::chance([squares, (poses.rows() as f64 - 2.0).max(1.0)]);
            }
            posterior.swing_p = motion.and_then(|m| {
                let [wave, drain] = [m.squares, least_drain].map(Motion::chance);
                [wave, drain.filter(|_| drains)].into_iter().flatten().reduce(f64::max)
            });
        }
        Ok(posterior)
    }

    /// How well a swing's frequency is what the poses' posterior predicts: the chance of one as improbable or more, 0 where the poses leave no
    /// liquid that could swing. None where no wave stands out of the noise, or it is damped too much to be one. Below 0.001 the senses contradict
    /// each other: another container, foam, a lid under the surface.
    pub fn frequency_p(&self, by_poses: &Posterior, motion: &Motion) -> Option<f64> {
        let [omega, damping] = motion.frequency_and_damping();
        let volumes = by_poses.volume_m3();
        if !motion.swings() || damping > EITHER[1] || self.laws.drains_as_well(&volumes, motion) {
            return None;
        }
        let capacity = self.laws.container.capacity_m3();
        let points: Vec<[f64; 2]> = volumes.points().collect();
        let mut laws = Vec::new();
        for pair in points.windows(2) {
            let share = 0.5 * (pair[0][0] + pair[1][0]) / capacity;
            let weight = 0.5 * (pair[0][1] + pair[1][1]) * (pair[1][0] - pair[0][0]);
            if let Some(law) = self.laws.wave(share).filter(|_| weight > 0.0) {
                let [mean, error] = law.ln_frequency(damping, &self.laws.errors);
                laws.push([weight, mean, error]);
            }
        }
        let low = laws.iter().map(|l| l[1] - 8.0 * l[2]).fold(f64::INFINITY, f64::min);
        let high = laws.iter().map(|l| l[1] + 8.0 * l[2]).fold(f64::NEG_INFINITY, f64::max);
        if !(high > low) {
            return Some(0.0);
        }
        let x: Vec<f64> =
            (0..PREDICTED).map(|k| low + (high - low) * k as f64 / (PREDICTED - 1) as f64).collect();
        let density = x
            .iter()
            .map(|x| laws.iter().map(|[w, mean, sd]| w * ln_density(*x, *mean, *sd).exp()).sum())
            .collect();
        Some(Marginal::new(x, density, false).rarer_than(omega.ln()))
    }
}

/// Middles of the gaps that hold too much, and of those about every maximum if they are to be followed.
fn split(nodes: &[(f64, Vec<Component>)], heights: &[f64], follow: bool) -> Vec<f64> {
    let most = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mass = |k: usize| {
        let higher = heights[k].max(heights[k + 1]);
        (nodes[k + 1].0 - nodes[k].0) * (higher - most).exp()
    };
    let whole: f64 = (0..nodes.len() - 1).map(mass).sum();
    let peak = |k: usize| {
        let before = k == 0 || heights[k] >= heights[k - 1];
        before && (k + 1 == nodes.len() || heights[k] >= heights[k + 1])
    };
    (0..nodes.len() - 1)
        .filter(|k| mass(*k) > SHARE * whole || follow && (peak(*k) || peak(*k + 1)))
        .map(|k| 0.5 * (nodes[k].0 + nodes[k + 1].0))
        .collect()
}
