//! What a swing shows, whatever the volume: how probable each frequency and damping of its wave is, and the readings a drain is weighed by.

use std::f64::consts::{PI, TAU};

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::gaussian::ln_sum;
use super::nuisance::{Nuisance, drift};
use super::rows::{Rows, check};
use super::{FusionError, Swing, SwingErrors};
use crate::slosh::UprightCylinder;
use crate::viscosity::fit_mode;

/// Readings are averaged over this part of the shortest period.
const BIN_PER_PERIOD: f64 = 0.1;
/// Bins of a drain grow by this share of the time.
const DRAIN_GROWTH: f64 = 0.05;
/// A swing lasts this many of the shortest periods at least.
const LEAST_PERIODS: f64 = 8.0;
/// Damping ratios within which a wave is looked for.
const DAMPING: [f64; 2] = [5e-4, 0.7];
/// What dry friction of the contact line may take of the first amplitude in a quarter period.
const STICKING: [f64; 6] = [0.0, 0.002, 0.005, 0.01, 0.02, 0.04];
/// The search's first grid, the one of readings that it leaves open, and the ones about a wave, in frequency and damping.
const FIRST: [usize; 2] = [65, 9];
const OPEN: [usize; 2] = [129, 33];
const LATER: [usize; 2] = [15, 13];
const ROUNDS: usize = 5;
/// A grid is narrowed to where the logarithm of the likelihood is within this of its greatest.
const KEPT: f64 = 16.0;
/// The second antisymmetric mode's frequency over the first one's, from shallow to deep.
const SECOND: [f64; 2] = [1.55, 2.6];
/// A second mode is taken out where it is this many of its errors large.
const FELT: f64 = 5.0;
/// The transient of a thick liquid's wave: its damping ratio at the deep liquid's frequency.
const TRANSIENT: f64 = 0.4;
/// Cosines of what a drain's shape misses.
const MISSED: usize = 4;
/// Where the logarithm of a likelihood ratio is above this a wave swings.
const SWINGS: f64 = 12.0;

/// A frequency and a damping ratio, and the logarithm of the likelihood's integral about them over that of no motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    pub(super) ln_omega: f64,
    pub(super) ln_damping: f64,
    pub(super) ln_weight: f64,
}

/// The readings of a drain.
pub(super) struct DrainRows {
    /// Times since gravity has pulled along the wall, s.
    pub(super) t_s: Vec<f64>,
    /// Standard deviation of each row's white noise, N m.
    pub(super) noise_nm: Vec<f64>,
    pub(super) nuisance: Nuisance,
    /// Logarithm of the likelihood of no motion but drift.
    pub(super) still: f64,
}

/// What a swing shows of its wave, and what a drain is weighed by: worked out once, asked for every volume.
pub struct Motion {
    pub(super) nodes: Vec<Node>,
    pub(super) drain: DrainRows,
    /// The best wave's squares and how many rows they are of.
    pub(super) squares: [f64; 2],
    /// Logarithm of the likelihood ratio of the best wave to no motion.
    pub(super) gain: f64,
}

impl std::fmt::Debug for Motion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Motion")
            .field("gain", &self.gain)
            .field("nodes", &self.nodes.len())
            .finish_non_exhaustive()
    }
}

impl Motion {
    /// Whether a wave stands out of the noise.
    pub fn swings(&self) -> bool {
        self.gain > SWINGS
    }

    /// The wave's angular frequency (rad/s, damping included) and damping ratio: means of the logarithm over what is probable of the readings alone.
    pub fn frequency_and_damping(&self) -> [f64; 2] {
        let most = self.nodes.iter().map(|n| n.ln_weight).fold(f64::NEG_INFINITY, f64::max);
        let mut sums = [0.0; 3];
        for node in &self.nodes {
            let weight = (node.ln_weight - most).exp();
            sums[0] += weight;
            sums[1] += weight * node.ln_omega;
            sums[2] += weight * node.ln_damping;
        }
        [(sums[1] / sums[0]).exp(), (sums[2] / sums[0]).exp()]
    }

    /// The chance of residuals as large as those of some squares over as many rows.
    pub(super) fn chance([squares, rows]: [f64; 2]) -> Option<f64> {
        ChiSquared::new(rows).ok().map(|law| law.sf(squares))
    }

    /// What readings show of a cylinder's wave, where a level is `shallow_m` at least; `film_nm` is about the size of a thin liquid's film after a second, N m.
    pub(super) fn new(
        swing: &Swing<'_>,
        errors: &SwingErrors,
        radius_m: f64,
        shallow_m: f64,
        gravity_m_s2: f64,
        film_nm: f64,
    ) -> Result<Self, FusionError> {
        check(swing)?;
        let omega = |level_m: f64| {
            UprightCylinder::new(radius_m, level_m, gravity_m_s2)
                .map(|c| c.angular_frequency_rad_s(0, errors.tension_over_density[0]))
                .map_err(|_| FusionError::Range { name: "radius_m", got: radius_m, expected: "above 0" })
        };
        let (slow, fast) = (omega(shallow_m)?, omega(20.0 * radius_m)?);
        let got_s = swing.t_s.last().copied().unwrap_or_default() - swing.t_s[0];
        let least_s = LEAST_PERIODS * TAU / fast;
        if !(got_s >= least_s) {
            return Err(FusionError::TooShort { got_s, least_s });
        }
        let widest = 1.0 + 4.0 * errors.frequency.hypot(0.02);
        let search = Search {
            errors,
            head_start_s: swing.head_start_s,
            film_nm,
            // A boundary layer lowers it, most where it damps most.
            box_: [[(slow * 0.5).ln(), (fast * widest).ln()], DAMPING.map(f64::ln)],
        };
        let mut rows = Rows::averaged(swing, |_| BIN_PER_PERIOD * TAU / fast);
        let none = FusionError::NothingFits;
        let mut found = search.nodes(&rows).ok_or(none.clone())?;
        if found.gain > SWINGS && search.take_out_second(&mut rows, &found) {
            found = search.nodes(&rows).ok_or(none.clone())?;
        }
        let drain = search.drain(swing, fast).ok_or(none)?;
        let count = rows.t_s.len() as f64;
        let missed = errors.shape.powi(2) * found.best.1.iter().map(|x| x * x).sum::<f64>() / count;
        let squares = [found.squares / (1.0 + missed), count];
        Ok(Self { nodes: found.nodes, drain, squares, gain: found.gain })
    }
}

struct Search<'a> {
    errors: &'a SwingErrors,
    head_start_s: f64,
    film_nm: f64,
    box_: [[f64; 2]; 2],
}

struct Found {
    nodes: Vec<Node>,
    gain: f64,
    squares: f64,
    /// The best wave: angular frequency, damping ratio, and its readings.
    best: ([f64; 2], Vec<f64>),
}

impl Search<'_> {
    fn nuisance(&self, rows: &Rows, further: Vec<Vec<f64>>) -> Option<Nuisance> {
        let noise = self.errors.torque_nm;
        let drift = drift(
            &rows.t_s,
            [self.errors.torque_offset_nm, self.errors.torque_wander_nm],
            self.errors.wander_s,
        );
        // About the mean, which the offset takes up: an offset may be larger than is stated of a tared sensor.
        let mean = rows.torque.iter().sum::<f64>() / rows.torque.len() as f64;
        let y = rows.torque.iter().map(|y| y - mean).collect();
        let columns = drift.into_iter().chain(further).map(|c| rows.scaled(c, noise)).collect();
        Nuisance::new(columns, rows.scaled(y, noise))
    }

    /// Columns of a wave that sticks, over the noise and times the amplitude.
    fn wave(
        &self,
        rows: &Rows,
        [ln_omega, ln_damping]: [f64; 2],
        reach: f64,
    ) -> impl Fn(f64) -> [Vec<f64>; 2] {
        let (omega, damping) = (ln_omega.exp(), ln_damping.exp());
        let noise = self.errors.torque_nm;
        let unit: Vec<[f64; 3]> = rows
            .t_s
            .iter()
            .zip(&rows.count)
            .map(|(t, count)| {
                let (sin, cos) = (omega * t).sin_cos();
                let scale = reach * count.sqrt() / noise;
                [(-damping * omega * t).exp(), scale * cos, scale * sin]
            })
            .collect();
        move |sticking: f64| {
            // Dry friction takes 2 / pi of it per radian.
            let lost = 2.0 * sticking / (PI * damping);
            let fade = |f: f64| ((1.0 + lost) * f - lost).max(0.0);
            let cos = unit.iter().map(|[f, cos, _]| fade(*f) * cos).collect();
            [cos, unit.iter().map(|[f, _, sin]| fade(*f) * sin).collect()]
        }
    }

    fn nodes(&self, rows: &Rows) -> Option<Found> {
        let still = self.nuisance(rows, Vec::new())?.ln_likelihood;
        let film = rows.t_s.iter().map(|t| self.film_nm / (t + self.head_start_s).max(0.1).sqrt()).collect();
        let nuisance = self.nuisance(rows, vec![film])?;
        let reach = rows.reach();
        let mut bounds = self.box_;
        let mut sizes = FIRST;
        let mut found =
            Found { nodes: Vec::new(), gain: f64::NEG_INFINITY, squares: 0.0, best: ([0.0; 2], Vec::new()) };
        for round in 0..ROUNDS {
            let steps: [f64; 2] =
                std::array::from_fn(|k| (bounds[k][1] - bounds[k][0]) / (sizes[k] - 1) as f64);
            found.nodes.clear();
            let mut best = f64::NEG_INFINITY;
            for i in 0..sizes[0] * sizes[1] {
                let at = [i / sizes[1], i % sizes[1]];
                let place: [f64; 2] = std::array::from_fn(|k| bounds[k][0] + steps[k] * at[k] as f64);
                let wave = self.wave(rows, place, reach);
                let tries: &[f64] = if sizes == LATER { &STICKING } else { &STICKING[..1] };
                let mut sum = Vec::with_capacity(tries.len());
                for sticking in tries {
                    let [cos, sin] = wave(*sticking);
                    let Some((ln, squares, factors)) = nuisance.two([&cos, &sin]) else { continue };
                    sum.push(ln - still);
                    if ln - still > best {
                        best = ln - still;
                        found.squares = squares;
                        let reading = cos.iter().zip(&sin).map(|(c, s)| factors[0] * c + factors[1] * s);
                        found.best = (place.map(f64::exp), reading.collect());
                    }
                }
                let ln_weight =
                    ln_sum(sum.iter().copied()) - (sum.len() as f64).ln() + (steps[0] * steps[1]).ln();
                found.nodes.push(Node { ln_omega: place[0], ln_damping: place[1], ln_weight });
            }
            found.gain = best;
            let most = found.nodes.iter().map(|n| n.ln_weight).fold(f64::NEG_INFINITY, f64::max);
            let kept = found.nodes.iter().filter(|n| n.ln_weight > most - KEPT);
            let mut next = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
            for node in kept {
                for (k, x) in [node.ln_omega, node.ln_damping].into_iter().enumerate() {
                    next[k] = [next[k][0].min(x - steps[k]), next[k][1].max(x + steps[k])];
                }
            }
            for (next, whole) in next.iter_mut().zip(&self.box_) {
                *next = [next[0].max(whole[0]), next[1].min(whole[1])];
            }
            let shrinks = |k: usize| next[k][1] - next[k][0] < 0.6 * (bounds[k][1] - bounds[k][0]);
            let narrower = shrinks(0) || shrinks(1);
            if round + 1 == ROUNDS || !narrower && sizes != FIRST {
                break;
            }
            if !narrower {
                sizes = OPEN;
                continue;
            }
            (bounds, sizes) = (next, LATER);
        }
        found.nodes.iter().any(|n| n.ln_weight.is_finite()).then_some(found)
    }

    /// Takes the second mode out of the readings, where there is one; whether there was.
    fn take_out_second(&self, rows: &mut Rows, found: &Found) -> bool {
        let ([omega, _], wave) = &found.best;
        let noise = self.errors.torque_nm;
        let left: Vec<f64> = rows
            .torque
            .iter()
            .zip(wave)
            .zip(&rows.count)
            .map(|((y, w), count)| y - w * noise / count.sqrt())
            .collect();
        let Ok(second) = fit_mode(&rows.t_s, &left, SECOND.map(|share| share * omega)) else { return false };
        if !(second.amplitude() > FELT * second.amplitude_error) {
            return false;
        }
        let begin = rows.t_s[0];
        for (t, y) in rows.t_s.iter().zip(&mut rows.torque) {
            *y -= second.at(t - begin) - second.offset;
        }
        true
    }

    fn drain(&self, swing: &Swing<'_>, fast: f64) -> Option<DrainRows> {
        let least = BIN_PER_PERIOD * TAU / fast;
        let rows = Rows::averaged(swing, |t| least.max(DRAIN_GROWTH * (t + self.head_start_s)));
        let still = self.nuisance(&rows, Vec::new())?.ln_likelihood;
        let reach = rows.reach();
        let transient = |phase: f64| -> Vec<f64> {
            let fade = |t: &f64| reach * (-TRANSIENT * fast * t).exp() * (fast * t + phase).cos();
            rows.t_s.iter().map(fade).collect()
        };
        // A drain's shape misses a share of it that goes smoothly with the logarithm of the time.
        let place = |t: f64| (t + self.head_start_s).max(least).ln();
        let (first, end) = (place(rows.t_s[0]), place(rows.t_s.last().copied().unwrap_or_default()));
        let last = rows.torque.last().copied().unwrap_or_default();
        let missed = |k: usize| -> Vec<f64> {
            let wave = |t: f64| (k as f64 * PI * (place(t) - first) / (end - first).max(f64::EPSILON)).cos();
            let share = self.errors.film_shape * (2.0 / MISSED as f64).sqrt();
            rows.t_s.iter().zip(&rows.torque).map(|(t, y)| share * (y - last) * wave(*t)).collect()
        };
        let transients = [transient(0.0), transient(0.5 * PI)];
        let further = transients.into_iter().chain((1..=MISSED).map(missed)).collect();
        let nuisance = self.nuisance(&rows, further)?;
        let noise_nm = rows.count.iter().map(|c| self.errors.torque_nm / c.sqrt()).collect();
        let t_s = rows.t_s.iter().map(|t| t + self.head_start_s).collect();
        Some(DrainRows { t_s, noise_nm, nuisance, still })
    }
}
