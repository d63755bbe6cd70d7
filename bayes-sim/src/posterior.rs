//! What every learned density offers, and the posterior that is a mixture cut to the prior's box.

use std::sync::OnceLock;

use rand::{Rng, RngExt};

use crate::component::Component;
use crate::error::Error;
use crate::mixture::{Mixture, cumulative, draw, pick};
use crate::normal::ln_sum_exp;
use crate::points::{Points, check_length, check_row};
use crate::prior::Prior;
use crate::truncation::{BoxMass, Boxed, CLOSE};

/// A density q(theta | x) learned from simulations; parameters in their own units, zero outside the prior.
pub trait ConditionalDensity: Sync {
    /// The prior of the simulations it was trained on.
    fn prior(&self) -> &Prior;

    /// Numbers an observation has.
    fn x_dim(&self) -> usize;

    /// `ln q(theta | x)`; minus infinity outside the prior.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::NotFinite`] for an observation of another length or with NaN.
    fn ln_density(&self, theta: &[f64], x: &[f64]) -> Result<f64, Error>;

    /// `ln q(theta | x)` of many parameters at one observation.
    ///
    /// # Errors
    /// As [`ConditionalDensity::ln_density`].
    fn ln_densities(&self, theta: &Points, x: &[f64]) -> Result<Vec<f64>, Error> {
        theta.rows().map(|t| self.ln_density(t, x)).collect()
    }

    /// Draws `count` parameter vectors given an observation.
    ///
    /// # Errors
    /// As [`ConditionalDensity::ln_density`].
    fn sample(&self, x: &[f64], count: usize, rng: &mut dyn Rng) -> Result<Points, Error>;
}

/// Draws, and how they came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Draws {
    /// Parameters in their own units, all within the prior.
    pub theta: Points,
    /// Share of the mixture's direct draws that fell within the prior's box.
    pub acceptance: f64,
    /// Whether every draw is an exact one. Where hardly any mass is within the box, the rest are resampled from weighted ones.
    pub exact: bool,
}

/// A mixture in the prior's coordinates, cut to the prior's box and scaled to one.
#[derive(Debug, Clone)]
pub struct Posterior {
    prior: Prior,
    mixture: Mixture,
    mass: OnceLock<BoxMass>,
}

/// A region of highest density.
#[derive(Debug, Clone, PartialEq)]
pub struct HighestDensity {
    /// Probability within.
    pub level: f64,
    /// Least log density within, of parameters in their own units.
    pub ln_threshold: f64,
}

impl Posterior {
    /// Cuts a mixture over the prior's coordinates (logarithms where the prior is in the logarithm) to the prior's bounds.
    ///
    /// # Errors
    /// [`Error::Length`] if the two have different dimensions.
    pub fn new(prior: Prior, mixture: Mixture) -> Result<Self, Error> {
        if prior.dim() != mixture.dim() {
            return Err(Error::Length { what: "mixture", expected: prior.dim(), got: mixture.dim() });
        }
        Ok(Self { prior, mixture, mass: OnceLock::new() })
    }

    /// The prior.
    pub fn prior(&self) -> &Prior {
        &self.prior
    }

    /// The mixture before it is cut, in the prior's coordinates.
    pub fn mixture(&self) -> &Mixture {
        &self.mixture
    }

    /// Share of the mixture within the prior's box: exact in one dimension, to 1e-12 in two, with the stated error above.
    /// Computed once, when first asked for.
    pub fn mass(&self) -> BoxMass {
        *self.mass.get_or_init(|| {
            let bounds = self.prior.bounds();
            let boxed = |c: &Component| (c.ln_weight.exp(), Boxed::new(c, &bounds));
            let mut parts: Vec<(f64, Boxed)> = self.mixture.components.iter().map(boxed).collect();
            // Those that may have most inside come first: the others need no digits that do not count.
            parts.sort_by(|a, b| (b.0 * b.1.most()).total_cmp(&(a.0 * a.1.most())));
            let mut out = BoxMass { value: 0.0, error: 0.0 };
            for (weight, part) in &parts {
                let mass = part.mass(0.1 * CLOSE * out.value / weight.max(f64::MIN_POSITIVE));
                out.value += weight * mass.value;
                out.error += weight * mass.error;
            }
            out
        })
    }

    /// Log density of a parameter vector; minus infinity outside the prior.
    ///
    /// # Errors
    /// [`Error::Length`].
    pub fn ln_density(&self, theta: &[f64]) -> Result<f64, Error> {
        check_length("parameters", theta, self.prior.dim())?;
        if !self.prior.contains(theta) {
            return Ok(f64::NEG_INFINITY);
        }
        let u = self.prior.coordinates(theta);
        let ln_mass = self.mass().value.max(f64::MIN_POSITIVE).ln();
        Ok(self.mixture.ln_density_unchecked(&u) - ln_mass + self.prior.ln_jacobian(&u))
    }

    /// Draws `count` parameter vectors in bounded time, whatever share of the mixture is outside the box: at most
    /// `50 count + 1000` direct draws, and after them, for what is still missing, resampling from `20 count` weighted draws that
    /// are inside by construction.
    pub fn sample<R: Rng + ?Sized>(&self, count: usize, rng: &mut R) -> Draws {
        let (d, bounds) = (self.prior.dim(), self.prior.bounds());
        let components = &self.mixture.components;
        let (spreads, weights) =
            (self.mixture.spreads(), cumulative(components.iter().map(|c| c.ln_weight.exp())));
        let mut values = Vec::with_capacity(count * d);
        let (mut tries, mut accepted) = (0_usize, 0_usize);
        while accepted < count && tries < 50 * count + 1000 {
            let k = pick(&weights, rng);
            draw(&components[k].mean, &spreads[k], rng, &mut values);
            tries += 1;
            if values[accepted * d..].iter().zip(&bounds).all(|(u, b)| *u >= b[0] && *u <= b[1]) {
                accepted += 1;
            } else {
                values.truncate(accepted * d);
            }
        }
        if accepted < count {
            self.resample(count - accepted, &bounds, rng, &mut values);
        }
        let mut theta = Points::new(d);
        for u in values.chunks_exact(d) {
            // Lengths agree by construction.
            let _ = theta.push(&self.prior.values(u));
        }
        Draws { theta, acceptance: accepted as f64 / tries.max(1) as f64, exact: accepted == count }
    }

    /// Draws inside by construction, weighted by the mass of their path, resampled.
    fn resample<R: Rng + ?Sized>(
        &self,
        count: usize,
        bounds: &[[f64; 2]],
        rng: &mut R,
        values: &mut Vec<f64>,
    ) {
        let d = self.prior.dim();
        let components = &self.mixture.components;
        let boxed: Vec<Boxed> = components.iter().map(|c| Boxed::new(c, bounds)).collect();
        let proposals = 20 * count + 200;
        let (mut ln_weights, mut points) = (Vec::with_capacity(proposals), vec![0.0; proposals * d]);
        // Every component in turn: a far one with a small weight may be all that is inside.
        for (i, out) in points.chunks_exact_mut(d).enumerate() {
            let k = i % components.len();
            ln_weights.push(components[k].ln_weight + boxed[k].propose(&components[k], rng, out));
        }
        let total = ln_sum_exp(ln_weights.iter().copied());
        if total.is_finite() {
            let sums = cumulative(ln_weights.iter().map(|l| (l - total).exp()));
            for _ in 0..count {
                let i = pick(&sums, rng);
                values.extend_from_slice(&points[i * d..(i + 1) * d]);
            }
        } else {
            // Nothing of the mixture is in the box that a number could tell from zero: its point nearest to the mean.
            let mean = self.mixture.mean();
            for _ in 0..count {
                values.extend(mean.iter().zip(bounds).map(|(m, b)| m.clamp(b[0], b[1])));
            }
        }
    }

    /// The region of highest density that holds `level` of the probability, from `count` draws.
    ///
    /// # Errors
    /// [`Error::Setting`] for a level not between 0 and 1, or no draw.
    pub fn highest_density<R: Rng + ?Sized>(
        &self,
        level: f64,
        count: usize,
        rng: &mut R,
    ) -> Result<HighestDensity, Error> {
        if !(level > 0.0 && level < 1.0) {
            return Err(Error::Setting { name: "level", value: level, rule: "between 0 and 1" });
        }
        if count == 0 {
            return Err(Error::Setting { name: "count", value: 0.0, rule: "at least 1" });
        }
        let draws = self.sample(count, rng);
        let mut ln: Vec<f64> = draws.theta.rows().map(|t| self.ln_density(t)).collect::<Result<_, _>>()?;
        ln.sort_by(f64::total_cmp);
        let at = ((1.0 - level) * count as f64) as usize;
        Ok(HighestDensity { level, ln_threshold: ln[at.min(count - 1)] })
    }

    /// Intervals of highest density of one parameter, in its own units, from its draws: more than one where the density has
    /// several humps.
    ///
    /// # Errors
    /// [`Error::Indices`] for a parameter that does not exist; [`Error::Setting`] as in [`Posterior::highest_density`].
    pub fn intervals<R: Rng + ?Sized>(
        &self,
        parameter: usize,
        level: f64,
        rng: &mut R,
    ) -> Result<Vec<[f64; 2]>, Error> {
        check_interval(&self.prior, parameter, level)?;
        Ok(highest_density(&self.prior, &self.sample(INTERVAL_DRAWS, rng).theta, parameter, level))
    }
}

/// A learned density at one observation.
#[derive(Debug, Clone, PartialEq)]
pub struct Given<D> {
    density: D,
    x: Vec<f64>,
}

impl<D: ConditionalDensity> Given<D> {
    /// q(theta | x) at the observation x.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::NotFinite`] for an observation of another length or with NaN.
    pub fn new(density: D, x: &[f64]) -> Result<Self, Error> {
        check_row("observation", x, density.x_dim())?;
        Ok(Self { density, x: x.to_vec() })
    }

    /// The prior.
    pub fn prior(&self) -> &Prior {
        self.density.prior()
    }

    /// Log density of a parameter vector; minus infinity outside the prior.
    ///
    /// # Errors
    /// [`Error::Length`].
    pub fn ln_density(&self, theta: &[f64]) -> Result<f64, Error> {
        self.density.ln_density(theta, &self.x)
    }

    /// Log densities of many parameter vectors.
    ///
    /// # Errors
    /// [`Error::Length`].
    pub fn ln_densities(&self, theta: &Points) -> Result<Vec<f64>, Error> {
        self.density.ln_densities(theta, &self.x)
    }

    /// Draws `count` parameter vectors.
    ///
    /// # Errors
    /// Those of the density.
    pub fn sample(&self, count: usize, rng: &mut dyn Rng) -> Result<Points, Error> {
        self.density.sample(&self.x, count, rng)
    }

    /// Intervals of highest density of one parameter, as [`Posterior::intervals`].
    ///
    /// # Errors
    /// [`Error::Indices`] for a parameter that does not exist; [`Error::Setting`] for a level not between 0 and 1.
    pub fn intervals(&self, parameter: usize, level: f64, rng: &mut dyn Rng) -> Result<Vec<[f64; 2]>, Error> {
        check_interval(self.prior(), parameter, level)?;
        Ok(highest_density(self.prior(), &self.sample(INTERVAL_DRAWS, rng)?, parameter, level))
    }
}

/// Draws behind intervals of one parameter.
const INTERVAL_DRAWS: usize = 20_000;

fn check_interval(prior: &Prior, parameter: usize, level: f64) -> Result<(), Error> {
    if parameter >= prior.dim() {
        return Err(Error::Indices { indices: vec![parameter], dim: prior.dim() });
    }
    if !(level > 0.0 && level < 1.0) {
        return Err(Error::Setting { name: "level", value: level, rule: "between 0 and 1" });
    }
    Ok(())
}

/// Intervals of highest density of one parameter of [`INTERVAL_DRAWS`] draws.
fn highest_density(prior: &Prior, draws: &Points, parameter: usize, level: f64) -> Vec<[f64; 2]> {
    const BINS: usize = 400;
    let marginal = prior.marginals()[parameter];
    let mut u: Vec<f64> = draws.rows().map(|t| marginal.coordinate(t[parameter])).collect();
    u.sort_by(f64::total_cmp);
    // A density cut in other dimensions has no closed marginal; a kernel estimate as smooth as a mixture does.
    let (low, high) = (u[0], u[u.len() - 1]);
    let width = ((high - low) / BINS as f64).max(f64::MIN_POSITIVE);
    let mut bins = [0.0_f64; BINS];
    u.iter().for_each(|v| bins[(((v - low) / width) as usize).min(BINS - 1)] += 1.0);
    let smooth: Vec<f64> = (0..BINS)
        .map(|b| {
            let near = b.saturating_sub(4)..(b + 5).min(BINS);
            near.clone().map(|i| bins[i]).sum::<f64>() / near.len() as f64
        })
        .collect();
    let mut order: Vec<usize> = (0..BINS).collect();
    order.sort_by(|&a, &b| smooth[b].total_cmp(&smooth[a]));
    let (mut inside, mut held) = ([false; BINS], 0.0);
    for b in order {
        if held >= level * u.len() as f64 {
            break;
        }
        inside[b] = true;
        held += bins[b];
    }
    let edge = |b: usize| marginal.value(low + b as f64 * width);
    let starts = (0..BINS).filter(|&b| inside[b] && (b == 0 || !inside[b - 1]));
    starts.map(|b| [edge(b), edge((b..BINS).find(|&e| !inside[e]).unwrap_or(BINS))]).collect()
}

/// A share in `0..1` that is never exactly 0.
pub(crate) fn open_uniform(rng: &mut dyn Rng) -> f64 {
    1.0 - rng.random::<f64>()
}
