//! Algorithm 2: the next impact has a distribution. Places that it excludes are not believed, and the paddle goes as far as the spread of
//! what may come lets it.

use super::next::NextBounce;
use super::{FIRST_S, Flight, Goal, Seen, Tracker, Workspace};
use rand::Rng;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Impacts in a row that may go unheard.
const UNHEARD: usize = 2;
/// A sound this early, in parts of the flight that was expected, is no impact; one this late comes after one that was not heard.
const TIMELY: (f64, f64) = (0.6, 1.5);

/// How the tracker behaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StochasticSettings {
    /// Draws at each impact that is looked ahead to: n = 10 in [Matl 2021].
    pub samples: usize,
    /// Impacts to look ahead, k: 2 for a ball of much chance, 4 for one of little.
    pub ahead: usize,
    /// The paddle goes all the way where the crossing is known to this (standard deviation, m), and the less the less it is known.
    pub sure_m: f64,
    /// How far from the paddle's middle a ball is still touched, m: the paddle goes no farther than to have the crossing within this, less
    /// two standard deviations. 0 for the rule of [Matl 2021], which goes to the mean.
    pub touch_m: f64,
    /// Probability that an honest place is taken for an outlier.
    pub false_outliers: f64,
    /// Standard deviation of a place beyond what the density says: hearing, and what it does not model, m.
    pub tolerance_m: f64,
}

impl Default for StochasticSettings {
    fn default() -> Self {
        Self { samples: 10, ahead: 3, sure_m: 0.03, touch_m: 0.0, false_outliers: 1e-3, tolerance_m: 0.012 }
    }
}

/// Algorithm 2 of [Matl 2021], appendix B.4.
///
/// Beyond it: a sound much too early is no impact, and one much too late follows an impact that was not heard, in whose place its mean
/// is taken. The first two impacts are believed whatever they are.
#[derive(Debug, Clone)]
pub struct Stochastic {
    next: NextBounce,
    workspace: Workspace,
    settings: StochasticSettings,
    /// Square of the Mahalanobis distance beyond which a place is an outlier.
    envelope: f64,
    last: Option<Seen>,
    flight: Option<Flight>,
    outliers: usize,
}

/// Sums over the ways through the plane.
#[derive(Default)]
struct Ways {
    weight: f64,
    /// Weighted sums of time, y and z.
    first: [f64; 3],
    second: [f64; 3],
}

impl Ways {
    fn add(&mut self, weight: f64, values: [f64; 3]) {
        self.weight += weight;
        for (k, v) in values.into_iter().enumerate() {
            self.first[k] += weight * v;
            self.second[k] += weight * v * v;
        }
    }

    fn mean(&self, k: usize) -> f64 {
        self.first[k] / self.weight
    }

    fn variance(&self, k: usize) -> f64 {
        (self.second[k] / self.weight - self.mean(k).powi(2)).max(0.0)
    }
}

impl Stochastic {
    /// With the density of the next impact. Samples and impacts to look ahead are at least 1 and at most 100 and 6.
    pub fn new(next: NextBounce, workspace: Workspace, settings: StochasticSettings) -> Self {
        let settings = StochasticSettings {
            samples: settings.samples.clamp(1, 100),
            ahead: settings.ahead.clamp(1, 6),
            ..settings
        };
        let level = (1.0 - settings.false_outliers).clamp(0.0, 1.0 - 1e-12);
        let envelope = ChiSquared::new(2.0).map_or(f64::INFINITY, |chi| chi.inverse_cdf(level));
        Self { next, workspace, settings, envelope, last: None, flight: None, outliers: 0 }
    }

    /// Places of this throw that were not believed.
    pub fn outliers(&self) -> usize {
        self.outliers
    }

    /// An impact as it is believed, after one at `last` that a flight led to; `None` for a sound that is none.
    fn believed(&mut self, impact: &Seen, mut last: Seen, mut flight: Flight) -> Option<(Seen, Flight)> {
        for _ in 0..=UNHEARD {
            let length = flight.length_m();
            let (mean, spread) = self.next.moments(flight.duration_s, length);
            let waited = (impact.t_s - last.t_s) / mean.duration_s;
            if waited < TIMELY.0 {
                return None;
            }
            let along = forward(&flight);
            let expected = Seen {
                t_s: last.t_s + mean.duration_s,
                place_m: placed(last.place_m, along, mean.forward_m, mean.left_m),
            };
            if waited > TIMELY.1 {
                flight = Flight::between(&last, &expected);
                last = expected;
                continue;
            }
            let off = [impact.place_m[0] - expected.place_m[0], impact.place_m[1] - expected.place_m[1]];
            let (f, l) = (off[0] * along[0] + off[1] * along[1], off[1] * along[0] - off[0] * along[1]);
            let room = self.settings.tolerance_m.powi(2);
            let (a, b, c) = (spread[0][0] + room, spread[0][1], spread[1][1] + room);
            let distance = (c * f * f - 2.0 * b * f * l + a * l * l) / (a * c - b * b);
            let mut seen = *impact;
            if !(distance <= self.envelope) {
                // When it was is right even where the place is not.
                seen.place_m = expected.place_m;
                self.outliers += 1;
            }
            return Some((seen, Flight::between(&last, &seen)));
        }
        None
    }

    /// Draws ways on from an impact that a flight led to, and keeps those that go through the plane.
    fn look(
        &self,
        from: Seen,
        flight: &Flight,
        depth: usize,
        weight: f64,
        ways: &mut Ways,
        rng: &mut dyn Rng,
    ) {
        let n = self.settings.samples;
        let (weight, length) = (weight / n as f64, flight.length_m());
        let along = forward(flight);
        for _ in 0..n {
            let step = self.next.draw(flight.duration_s, length, rng);
            let place_m = placed(from.place_m, along, step.forward_m, step.left_m);
            let to = Seen { t_s: from.t_s + step.duration_s, place_m };
            let flight = Flight::between(&from, &to);
            if let Some((t, [y, z])) = self.workspace.crossing(from.place_m, &flight) {
                ways.add(weight, [from.t_s + t, y, z]);
            } else if depth + 1 < self.settings.ahead && place_m[0] < self.workspace.plane_x_m {
                self.look(to, &flight, depth + 1, weight, ways, rng);
            }
        }
    }
}

/// Unit vector of a flight; along x where it went straight up.
fn forward(flight: &Flight) -> [f64; 2] {
    let length = flight.length_m();
    if length > 0.0 { flight.along_m.map(|d| d / length) } else { [1.0, 0.0] }
}

fn placed(from: [f64; 2], along: [f64; 2], forward: f64, left: f64) -> [f64; 2] {
    [from[0] + forward * along[0] - left * along[1], from[1] + forward * along[1] + left * along[0]]
}

impl Tracker for Stochastic {
    fn begin(&mut self) {
        (self.last, self.flight, self.outliers) = (None, None, 0);
    }

    fn heard(&mut self, impact: &Seen, paddle_m: [f64; 2], rng: &mut dyn Rng) -> Option<Goal> {
        let w = self.workspace;
        let Some(last) = self.last else {
            self.last = Some(*impact);
            // As algorithm 1 does: there is nothing to be more careful by.
            return Some(w.within(impact.place_m[1], w.rest_z_m, impact.t_s + FIRST_S));
        };
        let (seen, flight) = match self.flight {
            None => (*impact, Flight::between(&last, impact)),
            Some(flight) => self.believed(impact, last, flight)?,
        };
        if !(flight.duration_s > 0.0) {
            return None;
        }
        (self.last, self.flight) = (Some(seen), Some(flight));
        let mut ways = Ways::default();
        self.look(seen, &flight, 0, 1.0, &mut ways, rng);
        if !(ways.weight > 0.0) {
            return None;
        }
        let sigma = (ways.variance(1) + ways.variance(2)).sqrt();
        let off = [ways.mean(1) - paddle_m[0], ways.mean(2) - paddle_m[1]];
        let far = off[0].hypot(off[1]);
        let free = (self.settings.touch_m - 2.0 * sigma).max(0.0);
        let needed = if far > 0.0 { (1.0 - free / far).max(0.0) } else { 0.0 };
        let share = needed * (self.settings.sure_m / sigma.max(1e-9)).min(1.0);
        let (next, _) = self.next.moments(flight.duration_s, flight.length_m());
        let at_s = ways.mean(0).min(seen.t_s + next.duration_s);
        Some(w.within(paddle_m[0] + share * off[0], paddle_m[1] + share * off[1], at_s))
    }
}
