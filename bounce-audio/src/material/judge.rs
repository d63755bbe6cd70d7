//! Probabilities of materials from what was observed, and how unusual that is for all of them.

use bayes_sim::mixture::Mixture;
use bayes_sim::points::Points;
use nalgebra::DVector;

use super::error::MaterialError;
use super::gaussian::{Factor, Point, RESTITUTION, conditional};
use super::learned::Learned;
use super::observation::Observation;
use super::spectrum::FEATURES;
use crate::quantile::quantile;

/// Powers that the likelihood may be taken to.
const POWERS: [f64; 2] = [0.01, 2.0];
/// The log likelihood of a material whose covariance is none.
const IMPOSSIBLE: f64 = -1e9;
/// What is far is exceeded by the rest.
const FAR: f64 = 0.95;

/// What is said of observations of one kind: one set of senses and features, as many impacts.
///
/// The likelihood's power makes the drops held out most probable (temperature scaling: Guo et al. 2017, PMLR 70, 1321); how unusual a drop is
/// for a material (the largest of three distances: of what is heard, of what is measured once a drop, of both) is a rank among that material's drops held out (a conformal p-value: Bates et al. 2023, doi:10.1214/22-AOS2244).
#[derive(Debug, Clone)]
pub struct Judge<'a> {
    learned: &'a Learned,
    along: Vec<usize>,
    impacts: usize,
    power: f64,
    /// Log likelihoods of the drops held out, and their materials.
    calibration: Vec<(usize, Vec<f64>)>,
    /// Dimensions whose distances are looked at by themselves: what is heard, what is measured once a drop, both together.
    groups: Vec<Vec<usize>>,
    /// For each material the distances in each group that a twentieth of its drops held out exceed.
    far: Vec<Vec<f64>>,
    /// How far each material's drops held out are from it, ascending.
    usual: Vec<Vec<f64>>,
}

/// What is said of one drop.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// Probability of each material, given that it is one of them.
    pub probabilities: Vec<f64>,
    /// For each material the share of its drops that are as unusual as this one: small for a drop that is none of its.
    pub p_values: Vec<f64>,
}

/// An answer in short.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// It is this one, with its probability.
    Is(usize, f64),
    /// It is one of these, the most probable first; none is probable enough by itself.
    OneOf(Vec<usize>),
    /// No material has drops like this one.
    NoneOfThese,
}

impl Answer {
    /// The most probable material, and its probability.
    pub fn best(&self) -> (usize, f64) {
        let better = |a: (usize, f64), (k, p): (usize, &f64)| if *p > a.1 { (k, *p) } else { a };
        self.probabilities.iter().enumerate().fold((0, f64::NEG_INFINITY), better)
    }

    /// The largest share of any material's drops that are as unusual as this one.
    pub fn p_value(&self) -> f64 {
        self.p_values.iter().copied().fold(0.0, f64::max)
    }

    /// In short: none of these where it is more unusual than a share `level` of the drops of every material; a name where it has the
    /// probability `confident` and is not that unusual for it; else the fewest that have that probability together.
    pub fn verdict(&self, level: f64, confident: f64) -> Verdict {
        let (best, probability) = self.best();
        if self.p_value() < level {
            return Verdict::NoneOfThese;
        }
        if probability >= confident && self.p_values[best] >= level {
            return Verdict::Is(best, probability);
        }
        let mut order: Vec<usize> = (0..self.probabilities.len()).collect();
        order.sort_by(|&a, &b| self.probabilities[b].total_cmp(&self.probabilities[a]));
        let mut sum = 0.0;
        let enough = |k: &&usize| {
            let goes_on = sum < confident;
            sum += self.probabilities[**k];
            goes_on
        };
        let mut set: Vec<usize> = order.iter().take_while(enough).copied().collect();
        // One that is as unusual as none of its drops stands with what it would not be unusual for.
        let possible = order.into_iter().find(|k| self.p_values[*k] >= level && !set.contains(k));
        if set.len() == 1 {
            set.extend(possible);
        }
        Verdict::OneOf(set)
    }
}

impl<'a> Judge<'a> {
    pub(super) fn new(learned: &'a Learned, along: &[usize], impacts: usize) -> Result<Self, MaterialError> {
        let points = learned.calibration(along, impacts)?;
        let [heard, measured]: [Vec<usize>; 2] =
            [true, false].map(|sound| along.iter().copied().filter(|k| (*k < FEATURES) == sound).collect());
        let mut groups = vec![along.to_vec()];
        if !heard.is_empty() && !measured.is_empty() {
            groups.extend([heard, measured]);
        }
        let materials = learned.materials.len();
        let mut judge = Self {
            learned,
            along: along.to_vec(),
            impacts,
            power: 1.0,
            calibration: Vec::with_capacity(points.len()),
            far: vec![vec![1.0; groups.len()]; materials],
            usual: vec![Vec::new(); materials],
            groups,
        };
        let mut distances: Vec<Vec<Vec<f64>>> = vec![Vec::new(); materials];
        for (material, point) in &points {
            judge.calibration.push((*material, judge.likelihoods(point)));
            distances[*material].push(judge.distances(point, *material));
        }
        for (material, own) in distances.iter().enumerate() {
            for group in 0..judge.groups.len() {
                let mut one: Vec<f64> = own.iter().map(|d| d[group]).collect();
                judge.far[material][group] = quantile(&mut one, FAR).unwrap_or(1.0).max(f64::MIN_POSITIVE);
            }
            judge.usual[material] = own.iter().map(|d| judge.farthest(material, d)).collect();
            judge.usual[material].sort_by(f64::total_cmp);
        }
        judge.power = judge.best_power();
        Ok(judge)
    }

    /// The material along some dimensions as seen in a point, and the point there.
    fn seen(&self, point: &Point, material: usize, along: &[usize]) -> Option<(Factor, DVector<f64>)> {
        let shared = &self.learned.shared;
        let noise = shared.noise(point.impacts, point.speed_variance);
        let factor = Factor::new(&self.learned.materials[material], &noise, along)?;
        Some((factor, shared.standard(point, along)))
    }

    /// Log likelihood of each material.
    fn likelihoods(&self, point: &Point) -> Vec<f64> {
        let one = |m: usize| {
            self.seen(point, m, &self.along).map_or(IMPOSSIBLE, |(factor, x)| factor.ln_density(&x))
        };
        (0..self.usual.len()).map(one).collect()
    }

    /// Distance from a material in each group.
    fn distances(&self, point: &Point, material: usize) -> Vec<f64> {
        let one = |group: &Vec<usize>| {
            self.seen(point, material, group).map_or(f64::INFINITY, |(factor, x)| factor.distance(&x))
        };
        self.groups.iter().map(one).collect()
    }

    /// The largest distance, each in units of what is far for the material.
    fn farthest(&self, material: usize, distances: &[f64]) -> f64 {
        distances.iter().zip(&self.far[material]).map(|(d, far)| d / far).fold(0.0, f64::max)
    }

    /// The power at which the drops held out are most probable: their log probability is concave in it, so its derivative is bisected.
    fn best_power(&self) -> f64 {
        let flat = vec![1.0; self.usual.len()];
        let derivative = |power: f64| {
            let one = |(material, ln): &(usize, Vec<f64>)| {
                let p = probabilities(ln, power, &flat);
                ln[*material] - p.iter().zip(ln).map(|(p, l)| p * l).sum::<f64>()
            };
            self.calibration.iter().map(one).sum::<f64>()
        };
        let [mut low, mut high] = POWERS;
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if derivative(middle) > 0.0 { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Mean log probability of the drops held out, under equal priors.
    pub(super) fn held_out_score(&self) -> f64 {
        let flat = vec![1.0; self.usual.len()];
        let one = |(material, ln): &(usize, Vec<f64>)| {
            probabilities(ln, self.power, &flat)[*material].max(f64::MIN_POSITIVE).ln()
        };
        self.calibration.iter().map(one).sum::<f64>() / self.calibration.len() as f64
    }

    /// The power that the likelihood is taken to.
    pub fn power(&self) -> f64 {
        self.power
    }

    /// The answer for an observation of the kind, given the materials' prior weights (above 0; they need not add up to 1).
    ///
    /// # Errors
    /// [`MaterialError::Materials`] for a prior of another length, [`MaterialError::Value`] for one that is not above 0,
    /// [`MaterialError::Blind`] for an observation that lacks what the judge looks at.
    pub fn answer(&self, observation: &Observation, prior: &[f64]) -> Result<Answer, MaterialError> {
        let (point, ln) = self.checked(observation, prior)?;
        let p_values = self.usual.iter().enumerate().map(|(material, usual)| {
            let far = self.farthest(material, &self.distances(&point, material));
            let as_far = usual.len() - usual.partition_point(|u| *u < far);
            (as_far + 1) as f64 / (usual.len() + 1) as f64
        });
        Ok(Answer { p_values: p_values.collect(), probabilities: probabilities(&ln, self.power, prior) })
    }

    /// What the restitution will be, from what was observed without it: a mixture over materials, each weighed by its probability, of the
    /// logarithm of e / (1 - e).
    ///
    /// # Errors
    /// As [`Judge::answer`]; [`MaterialError::Blind`] for a judge that looks at the restitution itself.
    pub fn restitution(&self, observation: &Observation, prior: &[f64]) -> Result<Mixture, MaterialError> {
        let blind = || MaterialError::Blind { senses: "all but the bounce".into() };
        if self.along.contains(&RESTITUTION) {
            return Err(blind());
        }
        let (point, ln) = self.checked(observation, prior)?;
        let shared = &self.learned.shared;
        let noise = shared.noise(point.impacts, point.speed_variance);
        let x = shared.standard(&point, &self.along);
        let (scale, middle) = (shared.scales[RESTITUTION], shared.means[RESTITUTION]);
        let (mut weights, mut means, mut covariances) = (Vec::new(), Vec::new(), Vec::new());
        for (material, p) in self.learned.materials.iter().zip(probabilities(&ln, self.power, prior)) {
            // What is impossible has no place in a mixture.
            if p < 1e-6 {
                continue;
            }
            let [mean, variance] =
                conditional(material, &noise, RESTITUTION, &self.along, &x).ok_or_else(blind)?;
            weights.push(p);
            means.push(middle + scale * mean);
            covariances.push(vec![scale * scale * variance]);
        }
        let means = Points::from_values(1, means).map_err(|_| blind())?;
        Mixture::new(&weights, &means, &covariances).map_err(|_| blind())
    }

    fn checked(&self, observation: &Observation, prior: &[f64]) -> Result<(Point, Vec<f64>), MaterialError> {
        let (expected, got) = (self.usual.len(), prior.len());
        if expected != got {
            return Err(MaterialError::Materials { what: "a prior", expected, got });
        }
        if let Some(&got) = prior.iter().find(|p| !(**p > 0.0 && p.is_finite())) {
            return Err(MaterialError::Value {
                what: "a prior's weight",
                expected: "a finite number above 0",
                got,
            });
        }
        let point = Point::of(observation, self.impacts);
        if !self.along.iter().all(|&k| point.values[k].is_finite()) {
            return Err(MaterialError::Blind { senses: "those of the judge".into() });
        }
        let ln = self.likelihoods(&point);
        Ok((point, ln))
    }
}

/// Normalised products of prior weights and likelihoods to a power.
fn probabilities(ln: &[f64], power: f64, prior: &[f64]) -> Vec<f64> {
    let terms: Vec<f64> = ln.iter().zip(prior).map(|(l, p)| power * l + p.ln()).collect();
    let most = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let raised: Vec<f64> = terms.iter().map(|t| (t - most).exp()).collect();
    let sum: f64 = raised.iter().sum();
    raised.iter().map(|r| r / sum).collect()
}
