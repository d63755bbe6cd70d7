//! The next impact from the last flight: a density learned from simulated impacts ([Matl 2021], section 4.3, "a second BayesSim model").
//!
//! Without drag the physics has no scale of its own: with the last flight's duration T as unit of time and `g T^2 / 2` as unit of length,
//! all that matters is `tan phi = 2 d / (g T^2)`, the slope at which the ball came down. And what [Matl 2021] learns as (duration,
//! distance, angle) is learned here as the ratio of the speeds after and before, and the two angles by which the ball leaves its mirror
//! image: close to Gaussian at any slope. So the density is of three numbers over one, and is written down once on a lattice of slopes: a
//! draw then costs a table's look-up and three Gaussians. Between lattice points one of the two neighbours is taken by chance, which
//! interpolates the density.

use super::Flight;
use crate::drop::{Ball, DropModel, Moving, Table, each};
use bayes_sim::error::Error;
use bayes_sim::mdn::{Mdn, MdnSettings, MixtureDensity};
use bayes_sim::points::Points;
use bayes_sim::prior::Prior;
use bayes_sim::simulations::Simulations;
use nalgebra::{Matrix3, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Steepest slope that is learned: an angle from the vertical, rad.
const STEEPEST_RAD: f64 = 1.3;
/// Lattice points over the angle.
const LATTICE: usize = 96;
/// Draws that the moments are taken from.
const MOMENTS: u32 = 2_000;
/// Shortest flight over the one before that a draw may have.
const SHORTEST: f64 = 0.02;

/// How the next impact is learned.
#[derive(Debug, Clone, PartialEq)]
pub struct NextSettings {
    /// Simulated impacts.
    pub simulations: usize,
    /// Relative standard deviation of the speeds' ratio beyond the simulation's own: how well times and places tell it, and how much
    /// chance restitution has. Above zero.
    pub speed_sigma: f64,
    /// The network.
    pub network: MdnSettings,
}

impl Default for NextSettings {
    fn default() -> Self {
        let network =
            MdnSettings { components: 6, hidden: vec![32, 32], members: 1, ..MdnSettings::default() };
        Self { simulations: 6_000, speed_sigma: 0.005, network }
    }
}

/// A flight as it might go: relative to the direction of the one before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Duration of the flight, s.
    pub duration_s: f64,
    /// Along the direction of the flight before, m.
    pub forward_m: f64,
    /// To the left of it, m.
    pub left_m: f64,
}

/// The density of the next flight given the last one.
#[derive(Debug, Clone)]
pub struct NextBounce {
    nodes: Vec<Node>,
    gravity_m_s2: f64,
}

#[derive(Debug, Clone)]
struct Node {
    /// Sums of the weights.
    cumulative: Vec<f64>,
    means: Vec<Vector3<f64>>,
    factors: Vec<Matrix3<f64>>,
    mean: Vector3<f64>,
    covariance: Matrix3<f64>,
}

impl NextBounce {
    /// Learns from simulated impacts of balls (e, log10 kappa), such as draws from a posterior, each simulation with one of them in turn.
    /// Same seed, same bits.
    ///
    /// # Errors
    /// [`Error`] for no ball, a ball out of range, or too few simulations.
    pub fn learn(
        balls: &[[f64; 2]],
        gravity_m_s2: f64,
        settings: &NextSettings,
        seed: u64,
    ) -> Result<Self, Error> {
        let mut models = Vec::with_capacity(balls.len());
        for &[e, log10_kappa] in balls {
            let model =
                Ball::new(e, 10f64.powf(log10_kappa)).and_then(|b| DropModel::new(b, Table::LEVEL, 2.0));
            let rule = "a restitution in [0, 1] and a concentration of 0 or more";
            models.push(model.map_err(|_| Error::Setting { name: "balls", value: e, rule })?);
        }
        if models.is_empty() {
            return Err(Error::TooFew { least: 1, got: 0 });
        }
        let simulated = each(settings.simulations, seed, |i, rng| {
            let angle = STEEPEST_RAD * rng.random::<f64>();
            (angle, turned(&models[i % models.len()], angle, settings.speed_sigma, rng))
        });
        let (mut theta, mut x) = (Points::new(3), Points::new(1));
        let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for (angle, next) in &simulated {
            x.push(&[*angle])?;
            theta.push(next)?;
            for (b, v) in bounds.iter_mut().zip(next) {
                *b = [b[0].min(*v), b[1].max(*v)];
            }
        }
        // Room around what was simulated: the box is a formality here.
        let prior =
            Prior::uniform(&bounds.map(|[a, b]| [a - 0.2 * (b - a) - 1e-6, b + 0.2 * (b - a) + 1e-6]))?;
        let density = Mdn::train(&prior, &Simulations::new(theta, x)?, &settings.network, seed)?;
        let angle = |i: usize| STEEPEST_RAD * i as f64 / (LATTICE - 1) as f64;
        let nodes: Result<Vec<Node>, Error> =
            (0..LATTICE).map(|i| Node::new(&density, angle(i), seed)).collect();
        Ok(Self { nodes: nodes?, gravity_m_s2 })
    }

    /// Where on the lattice a flight is.
    fn place(&self, flight: &Flight) -> f64 {
        let slope = flight.length_m() / self.unit_m(flight);
        slope.atan() / STEEPEST_RAD * (LATTICE - 1) as f64
    }

    fn unit_m(&self, flight: &Flight) -> f64 {
        0.5 * self.gravity_m_s2 * flight.duration_s * flight.duration_s
    }

    /// Draws the next flight after one of a duration (s) and a length (m).
    pub fn draw<R: Rng + ?Sized>(&self, duration_s: f64, length_m: f64, rng: &mut R) -> Step {
        let flight = Flight { duration_s, along_m: [length_m, 0.0] };
        let at = self.place(&flight).clamp(0.0, (LATTICE - 1) as f64);
        let up = usize::from(rng.random::<f64>() < at.fract());
        let node = &self.nodes[(at as usize + up).min(LATTICE - 1)];
        let angle = at * STEEPEST_RAD / (LATTICE - 1) as f64;
        let [time, forward, left] = node.draw(angle, rng);
        let unit = self.unit_m(&flight);
        Step { duration_s: duration_s * time, forward_m: unit * forward, left_m: unit * left }
    }

    /// Mean of the next flight and the covariance of (forward, left), m^2.
    pub fn moments(&self, duration_s: f64, length_m: f64) -> (Step, [[f64; 2]; 2]) {
        let flight = Flight { duration_s, along_m: [length_m, 0.0] };
        let at = self.place(&flight).round().clamp(0.0, (LATTICE - 1) as f64);
        let (node, unit) = (&self.nodes[at as usize], self.unit_m(&flight));
        let c = |i: usize, j: usize| unit * unit * node.covariance[(i, j)];
        let mean = Step {
            duration_s: duration_s * node.mean[0],
            forward_m: unit * node.mean[1],
            left_m: unit * node.mean[2],
        };
        (mean, [[c(1, 1), c(1, 2)], [c(2, 1), c(2, 2)]])
    }
}

/// What an impact does to a ball that comes down at an angle from the vertical: speeds' ratio, and the angles that it leaves its mirror
/// image by, within the plane of its flight and out of it.
fn turned<R: Rng + ?Sized>(model: &DropModel, angle: f64, speed_sigma: f64, rng: &mut R) -> [f64; 3] {
    let before = Moving {
        t_s: 0.0,
        position_m: [0.0; 3],
        velocity_m_s: [angle.sin(), 0.0, -angle.cos()],
        spin_rad_s: [0.0; 3],
    };
    let v = model.bounce(&before, rng).velocity_m_s;
    let speed = v.iter().map(|v| v * v).sum::<f64>().sqrt();
    let unsure = 1.0 + speed_sigma * rng.sample::<f64, _>(StandardNormal);
    let out = if speed > 0.0 { (v[1] / speed).asin() } else { 0.0 };
    [speed * unsure, v[0].atan2(v[2]) - angle, out]
}

/// Duration, forward and left of the flight that follows, in the units of the one that came down at an angle.
fn flown(angle: f64, [ratio, turn, out]: [f64; 3]) -> [f64; 3] {
    // The flight before took 1 and came down at a speed of 1 across.
    let speed = ratio / angle.cos();
    let up = speed * out.cos() * (angle + turn).cos();
    let time = up.max(SHORTEST);
    [time, speed * out.cos() * (angle + turn).sin() * time, speed * out.sin() * time]
}

impl Node {
    fn new(density: &Mdn, angle: f64, seed: u64) -> Result<Self, Error> {
        let posterior = density.posterior(&[angle])?;
        let mixture = posterior.mixture();
        let mut node = Self {
            cumulative: Vec::with_capacity(mixture.len()),
            means: Vec::with_capacity(mixture.len()),
            factors: Vec::with_capacity(mixture.len()),
            mean: Vector3::zeros(),
            covariance: Matrix3::zeros(),
        };
        let mut sum = 0.0;
        for (k, weight) in mixture.weights().into_iter().enumerate() {
            let covariance = Matrix3::from_row_slice(&mixture.component_covariance(k));
            let factor = covariance.cholesky().ok_or(Error::NotPositiveDefinite { component: k })?;
            sum += weight;
            node.cumulative.push(sum);
            node.means.push(Vector3::from_row_slice(mixture.component_mean(k)));
            node.factors.push(factor.l());
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for n in 1..=MOMENTS {
            // Welford 1962, doi:10.1080/00401706.1962.10490022.
            let draw = Vector3::from(node.draw(angle, &mut rng));
            let off = draw - node.mean;
            node.mean += off / f64::from(n);
            node.covariance += off * (draw - node.mean).transpose() / f64::from(MOMENTS);
        }
        Ok(node)
    }

    /// Duration, forward and left of a flight after one that came down at an angle, in its units.
    fn draw<R: Rng + ?Sized>(&self, angle: f64, rng: &mut R) -> [f64; 3] {
        let u = rng.random::<f64>();
        let k = self.cumulative.iter().position(|c| u < *c).unwrap_or(self.cumulative.len() - 1);
        let z = Vector3::from_fn(|_, _| rng.sample::<f64, _>(StandardNormal));
        flown(angle, (self.means[k] + self.factors[k] * z).into())
    }
}
