//! A particle filter over ball and throw: which of the impacts were misheard is decided again with every impact that follows.

use super::aim::{Crossing, Price, aim};
use super::error::TrackError;
use super::particle::{Known, Particle};
use super::settings::FilterSettings;
use super::thin::{Weighted, normalise, thin};
use super::{Flight, Goal, Seen, Tracker, Workspace};
use crate::drop::Scatter;
use nalgebra::{Matrix4, Vector4};
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

/// Impacts in a row that may go unheard.
const UNHEARD: u32 = 2;
/// A sound this many flights after the last impact begins a new throw.
const ANEW: f64 = 4.0;
/// A sound that is no impact may come at any time within this, s, and anywhere within this, m^2.
const ANYWHERE: f64 = 0.3 * 0.5;
/// Logarithm of a density of a time that is as good as none.
const NEGLIGIBLE: f64 = -80.0;
/// Fewest draws that a goal is chosen by.
const LEAST_DRAWS: usize = 100;
/// Shortest flight that is looked ahead to, s.
const SHORTEST_S: f64 = 0.02;

/// A particle filter over the posterior of a ball and the states of its throw, the outlook of [Matl 2021], section 4.5.
///
/// Each particle is a ball (e, log10 kappa) from its posterior and a belief which sounds were misheard; given both, place and velocity are
/// Gaussian and are followed by a Kalman filter (a mixture Kalman filter: Chen and Liu 2000, doi:10.1111/1467-9868.00246). With every
/// sound each particle branches into "heard well", "misheard", "one or two impacts before it were not heard" and "no impact", and the
/// branches are thinned to as many as there may be particles, the heavy ones kept as they are (Fearnhead and Clifford 2003,
/// doi:10.1111/1467-9868.00421). So an impact that was believed at first, the first two included, is given up as soon as later ones
/// contradict it.
///
/// The goal is where the paddle touches the ball most probably, less a price for its energy, and is to be reached when the ball comes,
/// not before.
#[derive(Debug, Clone)]
pub struct ParticleFilter {
    balls: Vec<(f64, f64, Scatter)>,
    workspace: Workspace,
    settings: FilterSettings,
    particles: Vec<Weighted>,
    /// Scratch.
    branches: Vec<Weighted>,
    crossings: Vec<Crossing>,
    times: Vec<f64>,
    /// Sounds of this throw.
    sounds: u32,
}

impl ParticleFilter {
    /// With draws (e, log10 kappa) from a ball's posterior: e in (0, 1], log10 kappa finite.
    ///
    /// # Errors
    /// [`TrackError`] for no ball, and for a ball or a setting out of range.
    pub fn new(
        balls: &[[f64; 2]],
        workspace: Workspace,
        settings: FilterSettings,
    ) -> Result<Self, TrackError> {
        settings.check()?;
        if balls.is_empty() {
            return Err(TrackError::NoBall { expected: 1, got: 0 });
        }
        let mut known = Vec::with_capacity(balls.len());
        for &[e, log10_kappa] in balls {
            if !(e > 0.0 && e <= 1.0) {
                return Err(TrackError::Value {
                    what: "restitution",
                    expected: "above 0 and at most 1",
                    got: e,
                });
            }
            let (what, expected) = ("log10 kappa", "a finite number");
            let wrong = TrackError::Value { what, expected, got: log10_kappa };
            let kappa = 10f64.powf(log10_kappa);
            if !(kappa > 0.0 && kappa.is_finite()) {
                return Err(wrong);
            }
            known.push((e, kappa, Scatter::new(kappa).map_err(|_| wrong)?));
        }
        let n = settings.particles;
        Ok(Self {
            balls: known,
            workspace,
            settings,
            particles: Vec::with_capacity(n),
            branches: Vec::with_capacity(n * (1 + 2 * (UNHEARD as usize + 1))),
            crossings: Vec::with_capacity(n.max(LEAST_DRAWS)),
            times: Vec::with_capacity(n.max(LEAST_DRAWS)),
            sounds: 0,
        })
    }

    /// Posterior probability that a sound of this throw, counted from 0, was misheard or no impact; `None` for one that was not heard yet.
    pub fn misheard(&self, sound: u32) -> Option<f64> {
        if sound >= self.sounds.min(u64::BITS) || self.particles.is_empty() {
            return None;
        }
        let is = |p: &&Weighted| p.particle.misheard >> sound & 1 == 1;
        Some(self.particles.iter().filter(is).map(|p| p.weight).sum())
    }

    /// Mean place (m) of the last impact and velocity (m/s) along the table before it, with their covariance; `None` before the first
    /// impact. After the first impact the velocity is the one after it.
    pub fn state(&self) -> Option<([f64; 4], [[f64; 4]; 4])> {
        let mean = self.particles.iter().fold(Vector4::zeros(), |sum, p| sum + p.particle.mean * p.weight);
        let covariance = self.particles.iter().fold(Matrix4::zeros(), |sum, p| {
            let off = p.particle.mean - mean;
            sum + (p.particle.covariance + off * off.transpose()) * p.weight
        });
        (!self.particles.is_empty()).then(|| (mean.into(), covariance.into()))
    }

    fn known(&self) -> Known {
        Known {
            gravity_m_s2: self.workspace.gravity_m_s2,
            speed_sigma: self.settings.speed_sigma,
            time_sigma_s: self.settings.hearing.time_sigma_s,
            first_flight: self.settings.first_flight,
        }
    }

    /// The sound's bit; none beyond 64.
    fn bit(&self) -> u64 {
        1u64.checked_shl(self.sounds).unwrap_or(0)
    }

    /// A throw begins with an impact, heard well or misheard.
    fn start(&mut self, impact: &Seen) {
        let (n, bit, s) = (self.settings.particles, self.bit(), self.settings);
        let (h, [x, y], [u, v]) = (s.hearing, impact.place_m, s.throw_m_s);
        let balls = (n / 2).clamp(1, self.balls.len());
        self.particles.clear();
        for (share, sigma, misheard) in
            [(1.0 - h.outliers, h.sigma_m, 0), (h.outliers, h.outlier_sigma_m, bit)]
        {
            let variances = [sigma, sigma, s.throw_sigma_m_s, s.throw_sigma_m_s].map(|s| s * s);
            for ball in (0..balls).take(n - self.particles.len()) {
                let (restitution, kappa, _) = self.balls[ball];
                let particle = Particle {
                    restitution,
                    kappa,
                    mean: Vector4::new(x, y, u, v),
                    covariance: Matrix4::from_diagonal(&variances.into()),
                    t_s: impact.t_s,
                    down_m_s: None,
                    misheard,
                };
                self.particles.push(Weighted { weight: share / balls as f64, ball, particle });
            }
        }
        normalise(&mut self.particles);
    }

    /// Weighs what each particle makes of a sound; `false` where none of it can be.
    fn branch(&mut self, impact: &Seen) -> bool {
        let (h, known, bit) = (self.settings.hearing, self.known(), self.bit());
        let places = [((1.0 - h.outliers).ln(), h.sigma_m, 0), (h.outliers.ln(), h.outlier_sigma_m, bit)];
        self.branches.clear();
        for &Weighted { weight, ball, particle } in &self.particles {
            let weight = weight.ln();
            let mut none = particle;
            none.misheard |= bit;
            self.branches.push(Weighted {
                weight: weight + (h.spurious / ANYWHERE).ln(),
                ball,
                particle: none,
            });
            for unheard in 0..=UNHEARD {
                let mut landed = particle;
                let time = landed.reach(impact.t_s, unheard, &known);
                if !(time > NEGLIGIBLE) {
                    continue;
                }
                let real = ((1.0 - h.spurious) * (1.0 - h.unheard) * h.unheard.powi(unheard as i32)).ln();
                for (share, sigma_m, bit) in places {
                    let mut next = landed;
                    let place = next.place(impact.place_m, sigma_m);
                    next.misheard |= bit;
                    let weight = weight + real + time + share + place;
                    self.branches.push(Weighted { weight, ball, particle: next });
                }
            }
        }
        let best = self.branches.iter().fold(f64::NEG_INFINITY, |b, w| b.max(w.weight));
        for branch in &mut self.branches {
            branch.weight = (branch.weight - best).exp();
        }
        normalise(&mut self.branches);
        best.is_finite()
    }

    /// Whether a sound comes so late that no flight of this throw led to it.
    fn is_late(&self, t_s: f64) -> bool {
        let g = self.workspace.gravity_m_s2;
        let flight = |p: &Particle| {
            p.down_m_s.map_or(self.settings.first_flight[0], |down| 2.0 * p.restitution * down / g)
        };
        self.particles.iter().all(|p| t_s - p.particle.t_s > ANEW * flight(&p.particle))
    }

    /// Where balls go through the plane, drawn by the particles' weights, one from each stratum.
    fn look(&self, crossings: &mut Vec<Crossing>, rng: &mut dyn Rng) {
        crossings.clear();
        let count = self.settings.particles.max(LEAST_DRAWS);
        let (mut sum, mut drawn) = (0.0, 0);
        for p in &self.particles {
            sum += p.weight;
            while drawn < count && (drawn as f64 + 0.5) / (count as f64) < sum {
                crossings.extend(self.crossing(p.ball, &p.particle, rng));
                drawn += 1;
            }
        }
    }

    /// Where one particle's ball goes through the plane, by chance.
    fn crossing(&self, ball: usize, particle: &Particle, rng: &mut dyn Rng) -> Option<Crossing> {
        let (g, s) = (self.workspace.gravity_m_s2, &self.settings);
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let factor = (particle.covariance + Matrix4::identity() * 1e-14).cholesky()?.l();
        let state = particle.mean + factor * Vector4::from_fn(|_, _| normal());
        let (mut place, mut t_s) = ([state[0], state[1]], particle.t_s);
        let mut velocity = [state[2], state[3], 0.0];
        let mut is_first = particle.down_m_s.is_none();
        velocity[2] = match particle.down_m_s {
            Some(down) => down,
            None => 0.5 * g * s.first_flight[0] * (s.first_flight[1] * normal()).exp(),
        };
        let (e, _, scatter) = &self.balls[ball];
        for _ in 0..s.ahead {
            if !is_first {
                let size = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
                let speed = e * size * (1.0 + s.speed_sigma * rng.sample::<f64, _>(StandardNormal));
                velocity = scatter.draw(&velocity.map(|v| v / size), rng).map(|x| speed * x);
                velocity[2] = velocity[2].abs();
            }
            is_first = false;
            let duration_s = 2.0 * velocity[2] / g;
            if !(duration_s > SHORTEST_S) {
                return None;
            }
            let flight = Flight { duration_s, along_m: [velocity[0] * duration_s, velocity[1] * duration_s] };
            if let Some((t, at_m)) = self.workspace.crossing(place, &flight) {
                return Some(Crossing { t_s: t_s + t, at_m });
            }
            place = [place[0] + flight.along_m[0], place[1] + flight.along_m[1]];
            t_s += duration_s;
        }
        None
    }
}

impl Tracker for ParticleFilter {
    fn begin(&mut self) {
        self.particles.clear();
        self.sounds = 0;
    }

    fn heard(&mut self, impact: &Seen, paddle_m: [f64; 2], rng: &mut dyn Rng) -> Option<Goal> {
        let numbers = [impact.t_s, impact.place_m[0], impact.place_m[1], paddle_m[0], paddle_m[1]];
        if !numbers.iter().all(|v| v.is_finite()) {
            return None;
        }
        if self.particles.is_empty() || self.is_late(impact.t_s) || !self.branch(impact) {
            self.start(impact);
        } else {
            thin(&mut self.branches, self.settings.particles, &mut self.particles, rng);
        }
        self.sounds = self.sounds.saturating_add(1);
        let at_it = self.particles.iter().filter(|p| p.particle.t_s == impact.t_s);
        if at_it.map(|p| p.weight).sum::<f64>() < 0.5 {
            return None;
        }
        let mut crossings = std::mem::take(&mut self.crossings);
        self.look(&mut crossings, rng);
        let s = &self.settings;
        let price = Price { touch_m: s.touch_m, energy_s_m2: s.energy_price_s_m2 };
        let goal = aim(&crossings, paddle_m, impact.t_s, &price, &mut self.times);
        self.crossings = crossings;
        goal.map(|([y, z], at_s)| self.workspace.within(y, z, at_s))
    }
}
