//! What one volume makes of poses and swing: normal laws of viscosity and density, with their weights.

use super::film::Drains;
use super::gaussian::{FLAT, Shape, ln_box, ln_density, ln_sum};
use super::law::Wave;
use super::marginal::Marginal;
use super::posterior::{Component, Cut, ln_box_of};
use super::swing::{Motion, Node};
use super::tilt::Poses;
use super::{FusionError, Prior, SwingErrors};
use crate::container::{Container, Cylinder};
use crate::slosh::UprightCylinder;

/// Shallower than this share of the radius there is no law of a wave or a drain.
pub(super) const SHALLOW: f64 = 0.05;
/// Between these damping ratios of the wave's law a liquid may swing or drain; below it swings, above it drains.
pub(super) const EITHER: [f64; 2] = [0.1, 0.5];
/// The prior probability that a turn raises no wave in a liquid that could have one: near a lid, or by a turn that happens to be in step.
const STILL: f64 = 0.1;
/// Viscosities of a drain to begin with, and how they are narrowed.
const DRAIN_NODES: usize = 13;
const DRAIN_ROUNDS: usize = 6;
const DRAIN_KEPT: f64 = 14.0;
/// Drains are left out where their evidence is below the wave's by this logarithm.
pub(super) const HOPELESS: f64 = 40.0;

/// A cylinder of which any volume may be asked.
pub(super) struct Laws {
    pub(super) container: Cylinder,
    pub(super) gravity_m_s2: f64,
    pub(super) prior: Prior,
    pub(super) errors: SwingErrors,
    pub(super) drains: Drains,
}

/// Laws at one volume, and the least squares of a drain with how many rows they are of.
pub(super) struct AtVolume {
    pub(super) laws: Vec<Component>,
    pub(super) drain: [f64; 2],
}

impl Laws {
    /// The largest weights of waves and of drains; those that drain have a viscosity above where both may be.
    pub(super) fn compare(&self, nodes: &[(f64, Vec<Component>)]) -> (f64, f64) {
        let mut most = [f64::NEG_INFINITY; 2];
        for (share, laws) in nodes {
            let either = self.either(*share).map_or(f64::INFINITY, |e| e[0]);
            for law in laws {
                let k = usize::from(law.ln_viscosity.within[0] >= either);
                most[k] = most[k].max(law.ln_weight);
            }
        }
        (most[0], most[1])
    }

    /// The wave at a share of the capacity; none where it is too shallow, or full.
    pub(super) fn wave(&self, share: f64) -> Option<Wave> {
        let (radius, length) = (self.container.inner_radius_m(), self.container.inner_length_m());
        let level = share * length;
        if !(level >= SHALLOW * radius && share < 1.0) {
            return None;
        }
        let upright = UprightCylinder::new(radius, level, self.gravity_m_s2).ok()?;
        Some(Wave::new(upright, &self.errors))
    }

    /// Logarithms of the viscosities between which a liquid may swing or drain.
    fn either(&self, share: f64) -> Option<[f64; 2]> {
        self.wave(share).map(|w| EITHER.map(|damping| w.viscosity_m2_s(damping).ln()))
    }

    pub(super) fn at(
        &self,
        share: f64,
        poses: Option<&Poses<'_>>,
        motion: Option<&Motion>,
        drains: bool,
    ) -> Result<AtVolume, FusionError> {
        let [density, viscosity] = ln_box_of(&self.prior);
        let volume = share * self.container.capacity_m3();
        let tilt = match poses {
            None => Some(Shape::flat(0.5 * (density[0] + density[1]))),
            Some(poses) => poses.shape(volume, density)?,
        };
        let Some(tilt) = tilt else { return Ok(AtVolume { laws: Vec::new(), drain: [f64::INFINITY, 1.0] }) };
        let prior = -(density[1] - density[0]).ln();
        let by_poses = tilt.peak + ln_box(tilt.mean, tilt.sd, density) + prior;
        let ln_density = Cut { mean: tilt.mean, sd: tilt.sd, within: density };
        let (Some(motion), Some(wave)) = (motion, self.wave(share)) else {
            let flat = Cut { mean: 0.5 * (viscosity[0] + viscosity[1]), sd: FLAT, within: viscosity };
            let law = Component { ln_weight: by_poses, ln_viscosity: flat, ln_density };
            return Ok(AtVolume { laws: vec![law], drain: [f64::INFINITY, 1.0] });
        };
        let mut laws = self.waves(&wave, motion, by_poses, ln_density);
        let mut least = [f64::INFINITY, 1.0];
        if drains {
            let (drained, squares) = self.drained(share, &wave, motion, tilt);
            laws.extend(drained);
            least = [squares, motion.drain.t_s.len() as f64];
        }
        Ok(AtVolume { laws, drain: least })
    }

    /// Laws of the wave at a volume: for each damping ratio, with the frequencies summed; and of none.
    fn waves(&self, law: &Wave, motion: &Motion, by_poses: f64, ln_density_law: Cut) -> Vec<Component> {
        let [_, viscosity] = ln_box_of(&self.prior);
        let [low, high] = EITHER.map(|d| law.viscosity_m2_s(d).ln());
        let pieces = [
            ([viscosity[0], low.min(viscosity[1])], 0.0),
            ([low.max(viscosity[0]), high.min(viscosity[1])], 0.5f64.ln()),
        ];
        let prior = -(viscosity[1] - viscosity[0]).ln();
        let mut laws = Vec::new();
        for (within, half) in pieces {
            if within[1] > within[0] {
                laws.push(Component {
                    ln_weight: by_poses + STILL.ln() + (within[1] - within[0]).ln() + prior + half,
                    ln_viscosity: Cut { mean: 0.5 * (within[0] + within[1]), sd: FLAT, within },
                    ln_density: ln_density_law,
                });
            }
        }
        let mut left: &[_] = &sorted(motion);
        while let Some(first) = left.first() {
            let same = left.partition_point(|n| n.ln_damping <= first.ln_damping);
            let (here, after) = left.split_at(same);
            left = after;
            let damping = first.ln_damping.exp();
            let [mean, error] = law.ln_frequency(damping, &self.errors);
            let wave = ln_sum(here.iter().map(|n| n.ln_weight + ln_density(n.ln_omega, mean, error)));
            let middle = law.viscosity_m2_s(damping).ln();
            let (spread, slope) = (self.errors.ln_damping, law.slope(damping));
            let sd = spread / slope;
            for (within, half) in pieces {
                if within[1] > within[0] {
                    // The law's normal density of the damping ratio's logarithm, over viscosities.
                    let box_ = ln_box(middle, sd, within) - spread.ln() - 0.5 * std::f64::consts::TAU.ln();
                    laws.push(Component {
                        ln_weight: by_poses + (1.0 - STILL).ln() + wave + box_ + prior + half,
                        ln_viscosity: Cut { mean: middle, sd, within },
                        ln_density: ln_density_law,
                    });
                }
            }
        }
        laws
    }

    /// Laws of a drain at a volume: for each viscosity, placed where they weigh; and the least squares.
    fn drained(&self, share: f64, law: &Wave, motion: &Motion, tilt: Shape) -> (Vec<Component>, f64) {
        let [density, viscosity] = ln_box_of(&self.prior);
        let [low, high] = EITHER.map(|d| law.viscosity_m2_s(d).ln());
        let mut bounds = [low.max(viscosity[0]), viscosity[1]];
        if !(bounds[1] > bounds[0]) {
            return (Vec::new(), f64::INFINITY);
        }
        let whole = [bounds[0], viscosity[1]];
        let drain = self.drains.at(share);
        let prior = -(viscosity[1] - viscosity[0]).ln() - (density[1] - density[0]).ln();
        let (mut laws, mut least) = (Vec::new(), f64::INFINITY);
        for _ in 0..DRAIN_ROUNDS {
            let step = (bounds[1] - bounds[0]) / (DRAIN_NODES - 1) as f64;
            laws.clear();
            for k in 0..DRAIN_NODES {
                let x = bounds[0] + step * k as f64;
                let (film, squares) =
                    self.drains.shape(&motion.drain, &drain, x.exp(), self.errors.film, density);
                least = least.min(squares);
                let both = tilt.times(&film);
                let half = if x < high { 0.5f64.ln() } else { 0.0 };
                laws.push(Component {
                    ln_weight: both.peak + ln_box(both.mean, both.sd, density) + prior + half + step.ln(),
                    ln_viscosity: Cut {
                        mean: x,
                        sd: step.hypot(self.errors.ln_film_viscosity),
                        within: whole,
                    },
                    ln_density: Cut { mean: both.mean, sd: both.sd, within: density },
                });
            }
            let most = laws.iter().map(|l| l.ln_weight).fold(f64::NEG_INFINITY, f64::max);
            let kept: Vec<f64> = laws
                .iter()
                .filter(|l| l.ln_weight > most - DRAIN_KEPT)
                .map(|l| l.ln_viscosity.mean)
                .collect();
            let (Some(first), Some(last)) = (kept.first(), kept.last()) else { break };
            let next = [(first - step).max(whole[0]), (last + step).min(whole[1])];
            if !(next[1] - next[0] < 0.6 * (bounds[1] - bounds[0])) {
                break;
            }
            bounds = next;
        }
        (laws, least)
    }

    /// Whether a drain of a probable volume explains the motion nearly as well as the best wave does.
    pub(super) fn drains_as_well(&self, volumes: &Marginal, motion: &Motion) -> bool {
        let capacity = self.container.capacity_m3();
        let [density, _] = ln_box_of(&self.prior);
        let best = [0.05, 0.25, 0.5, 0.75, 0.95].into_iter().filter_map(|q| {
            let share = volumes.quantile(q) / capacity;
            let flat = Shape::flat(0.5 * (density[0] + density[1]));
            let (laws, _) = self.drained(share, &self.wave(share)?, motion, flat);
            Some(ln_sum(laws.iter().map(|l| l.ln_weight)))
        });
        best.fold(f64::NEG_INFINITY, f64::max) > motion.gain - HOPELESS
    }
}

/// Nodes by their damping ratio.
fn sorted(motion: &Motion) -> Vec<Node> {
    let mut nodes = motion.nodes.clone();
    nodes.sort_by(|a, b| a.ln_damping.total_cmp(&b.ln_damping));
    nodes
}
