//! A posterior as a sum over volumes of normal laws of density and viscosity.

use std::collections::BTreeMap;

use super::Prior;
use super::gaussian::{cdf, ln_box, ln_density};
use super::marginal::Marginal;

/// Points of a marginal that is a sum of normal laws.
const POINTS: usize = 2400;
/// Laws that weigh less than this are left out.
const NEGLIGIBLE: f64 = 1e-7;
/// A law is summed so many standard deviations about its mean.
const REACH: f64 = 5.0;

/// A normal law, cut to an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cut {
    pub(super) mean: f64,
    pub(super) sd: f64,
    pub(super) within: [f64; 2],
}

impl Cut {
    /// Mean and standard deviation (the latter of a law that is cut hardly, evenly, or far out).
    fn moments(&self) -> [f64; 2] {
        let [a, b] = self.within.map(|x| (x - self.mean) / self.sd);
        let whole = cdf(b) - cdf(a);
        if whole > 1e-12 && self.sd < 100.0 * (self.within[1] - self.within[0]) {
            let density = |z: f64| (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
            let shift = (density(a) - density(b)) / whole;
            let squares = 1.0 + (a * density(a) - b * density(b)) / whole - shift * shift;
            return [self.mean + self.sd * shift, self.sd * squares.max(0.0).sqrt()];
        }
        let [low, high] = self.within;
        if self.sd >= 100.0 * (high - low) {
            return [0.5 * (low + high), (high - low) / 12f64.sqrt()];
        }
        let edge = if self.mean < low { low } else { high };
        let scale = self.sd * self.sd / (edge - self.mean).abs();
        [edge + scale * (edge - self.mean).signum(), scale]
    }

    /// The same for laws whose numbers agree to a twentieth of their standard deviations, or of a width that is narrower.
    #[allow(clippy::cast_possible_truncation, reason = "beyond the range all are one")]
    fn key(&self) -> [i64; 4] {
        let step = 0.05 * self.sd.min(self.within[1] - self.within[0]);
        let place = |x: f64| (x / step).round() as i64;
        [
            place(self.mean),
            (100.0 * self.sd.ln()).round() as i64,
            place(self.within[0]),
            place(self.within[1]),
        ]
    }

    /// Where it has its weight, and the logarithm of its integral's factor.
    fn support(&self) -> ([f64; 2], f64) {
        let [middle, spread] = self.moments();
        let [low, high] = self.within;
        let reach = REACH * self.sd.min(2.0 * spread.max(1e-12));
        (
            [(middle - reach).max(low), (middle + reach).min(high)],
            ln_box(self.mean, self.sd, self.within) - self.sd.ln() - 0.5 * std::f64::consts::TAU.ln(),
        )
    }

    /// The law of the sum with another, as if independent.
    fn plus(&self, other: &Self) -> Self {
        let ([a, s], [b, t]) = (self.moments(), other.moments());
        let within = [self.within[0] + other.within[0], self.within[1] + other.within[1]];
        Self { mean: a + b, sd: s.hypot(t), within }
    }
}

/// One law of the sum: of the logarithms of viscosity and density at a volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Component {
    pub(super) ln_weight: f64,
    pub(super) ln_viscosity: Cut,
    pub(super) ln_density: Cut,
}

/// A quantity of a [`Posterior`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// The volume, m^3.
    Volume,
    /// The density, kg/m^3; correlations are of its logarithm.
    Density,
    /// The kinematic viscosity, m^2/s; correlations are of its logarithm.
    Viscosity,
}

/// What is known of volume, density and viscosity.
#[derive(Debug, Clone, PartialEq)]
pub struct Posterior {
    pub(super) volumes_m3: Vec<f64>,
    /// Density of the volume at each, not normalised.
    volume_density: Vec<f64>,
    /// Laws, their volume's index, and their share.
    components: Vec<(usize, f64, Component)>,
    /// Logarithm of the evidence.
    pub(super) ln_evidence: f64,
    pub(super) swing_p: Option<f64>,
    pub(super) poses_p: Option<f64>,
}

impl Posterior {
    /// From volumes (rising) with their laws; `None` where nothing has a weight.
    pub(super) fn new(volumes_m3: Vec<f64>, laws: Vec<Vec<Component>>) -> Option<Self> {
        let all = laws.iter().flatten().map(|c| c.ln_weight);
        let most = all.fold(f64::NEG_INFINITY, f64::max);
        if !most.is_finite() {
            return None;
        }
        let volume_density: Vec<f64> =
            laws.iter().map(|l| l.iter().map(|c| (c.ln_weight - most).exp()).sum()).collect();
        let last = volumes_m3.len() - 1;
        let width = |k: usize| 0.5 * (volumes_m3[(k + 1).min(last)] - volumes_m3[k.saturating_sub(1)]);
        let whole: f64 = (0..=last).map(|k| width(k) * volume_density[k]).sum();
        let mut components = Vec::new();
        for (k, laws) in laws.iter().enumerate() {
            for law in laws {
                let share = (law.ln_weight - most).exp() * width(k) / whole;
                if share > NEGLIGIBLE / laws.len() as f64 {
                    components.push((k, share, *law));
                }
            }
        }
        let ln_evidence = most + (whole / volumes_m3[last]).ln();
        Some(Self { volumes_m3, volume_density, components, ln_evidence, swing_p: None, poses_p: None })
    }

    /// The volume, m^3.
    pub fn volume_m3(&self) -> Marginal {
        Marginal::new(self.volumes_m3.clone(), self.volume_density.clone(), false)
    }

    /// The density, kg/m^3.
    pub fn density_kg_m3(&self) -> Marginal {
        self.sum(|c| c.ln_density)
    }

    /// The kinematic viscosity, m^2/s.
    pub fn viscosity_m2_s(&self) -> Marginal {
        self.sum(|c| c.ln_viscosity)
    }

    /// The dynamic viscosity, Pa s: the kinematic one times the density.
    pub fn dynamic_viscosity_pa_s(&self) -> Marginal {
        self.sum(|c| c.ln_viscosity.plus(&c.ln_density))
    }

    fn sum(&self, of: impl Fn(&Component) -> Cut) -> Marginal {
        // Laws that are alike are one: a thousand volumes have nearly the same.
        let mut alike: BTreeMap<[i64; 4], (f64, Cut)> = BTreeMap::new();
        for (_, share, component) in &self.components {
            let law = of(component);
            alike.entry(law.key()).or_insert((0.0, law)).0 += share;
        }
        let laws: Vec<(f64, Cut)> = alike.into_values().collect();
        let mut reach = [f64::INFINITY, f64::NEG_INFINITY];
        for (_, law) in &laws {
            let ([low, high], _) = law.support();
            reach = [reach[0].min(low), reach[1].max(high)];
        }
        let step = ((reach[1] - reach[0]) / (POINTS - 1) as f64).max(1e-12);
        let x: Vec<f64> = (0..POINTS).map(|k| reach[0] + step * k as f64).collect();
        let mut density = vec![0.0; POINTS];
        for (share, law) in &laws {
            let ([low, high], ln_whole) = law.support();
            let first = ((low - reach[0]) / step).ceil().max(0.0) as usize;
            let end = (((high - reach[0]) / step).floor().max(0.0) as usize + 1).min(POINTS);
            if first + 2 > end {
                // Narrower than the points are apart.
                density[first.min(POINTS - 1)] += share / step;
                continue;
            }
            for (d, x) in density[first..end].iter_mut().zip(&x[first..end]) {
                *d += share * (ln_density(*x, law.mean, law.sd) - ln_whole).exp();
            }
        }
        Marginal::new(x, density, true)
    }

    /// Correlation of two quantities, -1 to 1; that of a quantity with itself is 1.
    pub fn correlation(&self, a: Quantity, b: Quantity) -> f64 {
        let mut sums = [0.0; 6];
        for (k, share, law) in &self.components {
            let of = |quantity| match quantity {
                Quantity::Volume => [self.volumes_m3[*k], 0.0],
                Quantity::Density => law.ln_density.moments(),
                Quantity::Viscosity => law.ln_viscosity.moments(),
            };
            let ([x, s], [y, t]) = (of(a), of(b));
            let own = if a == b { s * t } else { 0.0 };
            let terms = [1.0, x, y, x * x + s * s, y * y + t * t, x * y + own];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += share * term);
        }
        let [whole, x, y, xx, yy, xy] = sums;
        let (x, y) = (x / whole, y / whole);
        let spread = ((xx / whole - x * x) * (yy / whole - y * y)).max(0.0).sqrt();
        if spread > 0.0 { ((xy / whole - x * y) / spread).clamp(-1.0, 1.0) } else { 0.0 }
    }

    /// Points of the joint density of volume (m^3) and the logarithm of the viscosity (m^2/s), which integrates to one, at given volumes' ends
    /// and viscosities: for a picture.
    pub fn volume_and_viscosity(&self, volumes_m3: &[f64], viscosities_m2_s: &[f64]) -> Vec<Vec<f64>> {
        let mut map = vec![vec![0.0; viscosities_m2_s.len()]; volumes_m3.len().saturating_sub(1)];
        for (k, share, law) in &self.components {
            let at = volumes_m3.partition_point(|v| *v <= self.volumes_m3[*k]);
            if at == 0 || at >= volumes_m3.len() {
                continue;
            }
            let width = volumes_m3[at] - volumes_m3[at - 1];
            let (_, ln_whole) = law.ln_viscosity.support();
            for (cell, viscosity) in map[at - 1].iter_mut().zip(viscosities_m2_s) {
                let x = viscosity.ln();
                let cut = law.ln_viscosity;
                if (cut.within[0]..=cut.within[1]).contains(&x) {
                    *cell += share / width * (ln_density(x, cut.mean, cut.sd) - ln_whole).exp();
                }
            }
        }
        map
    }

    /// The chance of poses that miss as far as these do, at what is most probable; none without poses. Below 0.001 no liquid in this
    /// container explains the poses with the errors that are stated.
    pub fn poses_p(&self) -> Option<f64> {
        self.poses_p
    }

    /// The same of the swing's readings: below 0.001 something moves that is neither the wave nor the drain.
    pub fn swing_p(&self) -> Option<f64> {
        self.swing_p
    }

    /// Logarithm of the evidence of what was weighed, to compare hypotheses on the same poses and the same swing.
    pub fn ln_evidence(&self) -> f64 {
        self.ln_evidence
    }

    pub(super) fn mode(&self) -> Option<(f64, Component)> {
        let best = self.components.iter().max_by(|a, b| a.2.ln_weight.total_cmp(&b.2.ln_weight))?;
        Some((self.volumes_m3[best.0], best.2))
    }
}

pub(super) fn ln_box_of(prior: &Prior) -> [[f64; 2]; 2] {
    [prior.density_kg_m3.map(f64::ln), prior.viscosity_m2_s.map(f64::ln)]
}
