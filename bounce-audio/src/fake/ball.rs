//! A ball as it might be: drag, a rough skin, a restitution that falls with speed.

use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

/// Step of the integration (classical Runge-Kutta), s.
const STEP_S: f64 = 5e-4;
/// Impacts that are followed at most.
const MOST: usize = 64;

/// What a ball is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FakeBall {
    /// Restitution at 1 m/s.
    pub restitution: f64,
    /// How fast it falls with the speed of the impact, s/m.
    pub slope_s_m: f64,
    /// Standard deviation of the slope of the asperity that it lands on, along each axis: it turns the ball by twice the slope, so that
    /// `1 / (4 slope^2)` is the concentration of its directions.
    pub asperity: f64,
    /// Part of the speed along the table that an impact takes beyond restitution's.
    pub lost: f64,
    /// Quadratic drag, 1/m.
    pub drag_per_m: f64,
    /// Radius, m.
    pub radius_m: f64,
}

impl FakeBall {
    /// A ball with the given restitution and concentration of directions; a ping-pong ball's drag and radius.
    pub fn new(restitution: f64, kappa: f64) -> Self {
        let asperity = 0.5 / kappa.sqrt();
        Self { restitution, slope_s_m: 0.01, asperity, lost: 0.0, drag_per_m: 0.1, radius_m: 0.02 }
    }
}

/// An impact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touchdown {
    /// When, s.
    pub t_s: f64,
    /// Where on the table, m.
    pub place_m: [f64; 3],
    /// Speed across the table, m/s.
    pub speed_m_s: f64,
}

/// A throw, as it went.
#[derive(Debug, Clone, PartialEq)]
pub struct Flown {
    /// Impacts on the table.
    pub touchdowns: Vec<Touchdown>,
    /// Where the centre was each half millisecond, with the time in s.
    pub path: Vec<(f64, [f64; 3])>,
}

type State = [f64; 6];

impl FakeBall {
    /// Flies and bounces from a place and a velocity of its centre until `on` says that it is over, or for `limit_s`; the table is a
    /// plane with the given unit normal through the origin.
    pub fn fly<R: Rng + ?Sized>(
        &self,
        place_m: [f64; 3],
        velocity_m_s: [f64; 3],
        normal: [f64; 3],
        limit_s: f64,
        mut over: impl FnMut(f64, [f64; 3]) -> bool,
        rng: &mut R,
    ) -> Flown {
        let ([x, y, z], [u, v, w]) = (place_m, velocity_m_s);
        let mut state: State = [x, y, z, u, v, w];
        let mut t = 0.0;
        let mut flown = Flown { touchdowns: Vec::new(), path: Vec::new() };
        let height = |s: &State| (0..3).map(|i| normal[i] * s[i]).sum::<f64>() - self.radius_m;
        while t < limit_s {
            let at = [state[0], state[1], state[2]];
            flown.path.push((t, at));
            if over(t, at) {
                break;
            }
            let next = self.step(&state, STEP_S);
            if height(&next) > 0.0 {
                (state, t) = (next, t + STEP_S);
                continue;
            }
            let (mut low, mut high) = (0.0, STEP_S);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if height(&self.step(&state, middle)) > 0.0 { low = middle } else { high = middle }
            }
            state = self.step(&state, low);
            t += low;
            let down = -(0..3).map(|i| normal[i] * state[3 + i]).sum::<f64>();
            let place_m = std::array::from_fn(|i| state[i] - self.radius_m * normal[i]);
            flown.touchdowns.push(Touchdown { t_s: t, place_m, speed_m_s: down });
            self.rebound(&mut state, &normal, rng);
            let up = (0..3).map(|i| normal[i] * state[3 + i]).sum::<f64>();
            if flown.touchdowns.len() == MOST || !(up > 0.02) {
                break;
            }
        }
        flown
    }

    fn step(&self, s: &State, h: f64) -> State {
        let rate = |s: &State| {
            let drag = -self.drag_per_m * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]).sqrt();
            [s[3], s[4], s[5], drag * s[3], drag * s[4], drag * s[5] - 9.80665]
        };
        let along = |a: &State, k: &State, h: f64| -> State { std::array::from_fn(|i| a[i] + h * k[i]) };
        let k1 = rate(s);
        let k2 = rate(&along(s, &k1, 0.5 * h));
        let k3 = rate(&along(s, &k2, 0.5 * h));
        let k4 = rate(&along(s, &k3, h));
        std::array::from_fn(|i| s[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
    }

    /// Reflection on an asperity, then what is lost.
    fn rebound<R: Rng + ?Sized>(&self, s: &mut State, normal: &[f64; 3], rng: &mut R) {
        let v = [s[3], s[4], s[5]];
        let dot = |a: &[f64; 3], b: &[f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let mut facet: [f64; 3] =
            std::array::from_fn(|i| normal[i] + self.asperity * rng.sample::<f64, _>(StandardNormal));
        let size = dot(&facet, &facet).sqrt();
        facet = facet.map(|f| f / size);
        let into = dot(&v, &facet);
        let mirrored: [f64; 3] = std::array::from_fn(|i| v[i] - 2.0 * into * facet[i]);
        let e = (self.restitution - self.slope_s_m * (dot(&v, &v).sqrt() - 1.0)).clamp(0.0, 1.0);
        // A facet so steep that it sends the ball down: the next one sends it up again.
        let across = dot(&mirrored, normal);
        for i in 0..3 {
            let along = mirrored[i] - across * normal[i];
            s[3 + i] = e * ((1.0 - self.lost) * along + across.abs() * normal[i]);
        }
    }
}
