//! A ball that bounces on a table, as its impacts are heard.

use std::fmt::Write as _;
use std::ops::Range;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::GRAVITY_M_S2;

use super::bisection::bisect;
use super::runge_kutta;

type Vec3 = [f64; 3];

/// Everything that may act beside gravity and a constant restitution; all zero is a level table in a vacuum.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effects {
    /// Quadratic drag in 1/m.
    pub drag_per_m: f64,
    /// Fall of the restitution with the speed, from 1 m/s on, in s/m.
    pub slope_s_m: f64,
    /// Slopes of the table along x and y.
    pub table_slope: [f64; 2],
    /// Fraction of the tangential speed that each impact takes.
    pub friction: f64,
    /// Relative error of the stated times.
    pub clock_rate: f64,
    /// Relative error of the stated places' scale.
    pub position_scale: f64,
    /// Fraction of the runs in which one impact after the first goes unheard.
    pub unheard: f64,
    /// Unlisted: fall of the restitution where x is above [`BounceWorld::soft_from_m`].
    pub softer_side: f64,
    /// Unlisted: the table is a shallow bowl, whose slope grows by so much for each metre from the middle, in 1/m.
    pub bowl_per_m: f64,
    /// Unlisted: change of the restitution from the first run to the last.
    pub warming: f64,
    /// Unlisted: fall of the restitution with the square of the speed beyond 1 m/s, in s^2/m^2.
    pub curvature_s2_m2: f64,
    /// Unlisted: fall of the restitution at some impacts only.
    pub softer: Softer,
}

/// A restitution that is lower at some impacts: between two places along x, two speeds, and from a run on, all of which have to hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Softer {
    /// By how much.
    pub by: f64,
    /// Along x, m.
    pub x_m: [f64; 2],
    /// Speed at which the ball comes, m/s.
    pub speed_m_s: [f64; 2],
    /// The first run, counted from 0.
    pub from_run: usize,
}

impl Softer {
    /// Whether it acts at an impact at a place along x, m, with a speed, m/s.
    fn acts(&self, x: f64, speed: f64) -> bool {
        let within = |value: f64, [low, high]: [f64; 2]| value > low && value < high;
        self.by != 0.0 && within(x, self.x_m) && within(speed, self.speed_m_s)
    }
}

impl Default for Softer {
    fn default() -> Self {
        let all = [f64::NEG_INFINITY, f64::INFINITY];
        Self { by: 0.0, x_m: all, speed_m_s: all, from_run: 0 }
    }
}

/// How drops are recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BounceWorld {
    /// Number of runs.
    pub runs: usize,
    /// Impacts that are heard in a run.
    pub impacts: usize,
    /// Height of the drops in m.
    pub height_m: f64,
    /// Whether the height is the same in all runs and stated; else it varies by two fifths, and is not.
    pub height_known: bool,
    /// Restitution at 1 m/s.
    pub restitution: f64,
    /// Concentration of the directions (von Mises and Fisher).
    pub kappa: f64,
    /// One sigma of the velocity along the table with which a ball is let go, along each axis, in m/s.
    pub release_m_s: f64,
    /// One sigma of the times in s, and of the places in m.
    pub noise: [f64; 2],
    /// Whether the header states the noise.
    pub noise_known: bool,
    /// Whether places are recorded beside times.
    pub placed: bool,
    /// One sigma of the restitution's logarithm from impact to impact.
    pub restitution_scatter: f64,
    /// Where the softer side of the table begins, if it has one, along x in m.
    pub soft_from_m: f64,
    /// The effects at work.
    pub effects: Effects,
}

/// An impact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Impact {
    /// When and where it is heard, s and m.
    pub(crate) heard: Vec3,
    /// Whether a [`Softer`] restitution acts at it.
    pub(crate) softer: bool,
}

/// Whether a softer restitution shows in a drop: acts at an impact before and after which a speed is recorded, the first one among them where
/// the height of the fall is known.
pub(crate) fn shows_softer(heard: &[Impact], height_known: bool) -> bool {
    let inner = usize::from(!height_known)..heard.len().saturating_sub(1);
    heard.get(inner).is_some_and(|inner| inner.iter().any(|impact| impact.softer))
}

/// A drop as it is heard.
#[derive(Debug, Clone)]
pub(crate) struct Drop {
    /// The impact that goes unheard, counted from 0, if one does.
    unheard: Option<usize>,
    /// All impacts.
    pub(crate) impacts: Vec<Impact>,
}

/// What is recorded of drops.
#[derive(Debug, Clone)]
pub(crate) struct Recorded {
    /// The contents of `recording.toml` and `data.csv`.
    pub(crate) files: [String; 2],
    /// For each impact that went unheard its run and the number of the last impact before it that was heard, both counted from 1.
    pub(crate) unheard: Vec<[usize; 2]>,
    /// Runs in which a softer restitution shows, counted from 1.
    pub(crate) softer: Vec<usize>,
}

impl Effects {
    /// How high the table is at a place.
    fn table_height(&self, [x, y, _]: &Vec3) -> f64 {
        self.table_slope[0] * x + self.table_slope[1] * y + 0.5 * self.bowl_per_m * (x * x + y * y)
    }

    /// Slopes of the table at a place.
    fn slopes_at(&self, [x, y, _]: &Vec3) -> [f64; 2] {
        [self.table_slope[0] + self.bowl_per_m * x, self.table_slope[1] + self.bowl_per_m * y]
    }
}

impl BounceWorld {
    /// Thirty drops from 0.3 m, six impacts each, heard to 30 us and 6 mm.
    pub fn drops() -> Self {
        Self {
            runs: 30,
            impacts: 6,
            height_m: 0.3,
            height_known: false,
            restitution: 0.8,
            kappa: 5000.0,
            release_m_s: 0.05,
            noise: [3e-5, 6e-3],
            noise_known: true,
            placed: true,
            restitution_scatter: 0.0,
            soft_from_m: 0.02,
            effects: Effects::default(),
        }
    }

    /// The contents of `recording.toml` and `data.csv`.
    pub fn files(&self, seed: u64) -> [String; 2] {
        self.recorded(seed).files
    }

    /// The same ball in a run, counted from 0.
    pub(crate) fn in_run(&self, run: usize) -> Self {
        let mut world = *self;
        if run < world.effects.softer.from_run {
            world.effects.softer = Softer::default();
        }
        let part = run as f64 / (world.runs.max(2) - 1) as f64;
        world.restitution += world.effects.warming * (part - 0.5);
        world
    }

    /// All drops.
    pub(crate) fn heard(&self, seed: u64) -> Vec<Drop> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let of_run = |run: usize| {
            let spread = if self.height_known { 1.0 } else { rng.random_range(0.6..1.4) };
            let unheard = self.unheard(&mut rng);
            let count = self.impacts + usize::from(unheard.is_some());
            let height_m = self.height_m * spread;
            Drop { unheard, impacts: self.in_run(run).drop([0.0; 2], height_m, 0.0..1.0, count, &mut rng) }
        };
        (0..self.runs).map(of_run).collect()
    }

    /// The recording, with what is known of its making.
    pub(crate) fn recorded(&self, seed: u64) -> Recorded {
        let (mut all_unheard, mut softer) = (Vec::new(), Vec::new());
        let mut header = String::from("format = 1\ndomain = \"bounce\"\ndata = \"data.csv\"\n");
        if self.noise_known {
            let [time, place] = self.noise;
            let _ = write!(header, "\n[noise]\nt_s = {time}\n");
            if self.placed {
                let _ = write!(header, "x_m = {place}\ny_m = {place}\n");
            }
        }
        if self.height_known {
            let _ = write!(header, "\n[rig]\ndrop_height_m = {}\n", self.height_m);
        }
        let mut data =
            String::from(if self.placed { "run,bounce,t_s,x_m,y_m\n" } else { "run,bounce,t_s\n" });
        for (run, Drop { unheard, impacts: heard }) in (1..).zip(self.heard(seed)) {
            all_unheard.extend(unheard.map(|impact| [run, impact]));
            softer.extend(shows_softer(&heard, self.height_known).then_some(run));
            let kept = heard.iter().enumerate().filter(|(i, _)| Some(*i) != unheard);
            for (number, (_, Impact { heard: [t, x, y], .. })) in kept.enumerate() {
                let _ = write!(data, "{run},{},{t:.7}", number + 1);
                let _ = if self.placed { writeln!(data, ",{x:.5},{y:.5}") } else { writeln!(data) };
            }
        }
        Recorded { files: [header, data], unheard: all_unheard, softer }
    }

    /// The impact of a run that goes unheard, if one does.
    pub(crate) fn unheard(&self, rng: &mut ChaCha8Rng) -> Option<usize> {
        (rng.random::<f64>() < self.effects.unheard).then(|| rng.random_range(1..self.impacts.max(3) - 1))
    }

    /// Time and place of each impact, as they are heard, of a ball that is let go above a place at some time in `begin_s`.
    pub(crate) fn drop(
        &self,
        from_m: [f64; 2],
        height_m: f64,
        begin_s: Range<f64>,
        impacts: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<Impact> {
        let e = &self.effects;
        let normal = |rng: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(rng) };
        // The stated height is that above the place where it lands.
        let mut place = [from_m[0], from_m[1], height_m];
        let mut velocity = [self.release_m_s * normal(rng), self.release_m_s * normal(rng), 0.0];
        let mut t = rng.random_range(begin_s);
        let mut level = Self { effects: *e, ..*self };
        level.effects.table_slope = [0.0; 2];
        level.effects.bowl_per_m = 0.0;
        let mut heard = Vec::with_capacity(impacts);
        for impact in 0..impacts {
            let table = if impact == 0 { &level } else { self };
            t += table.fly(&mut place, &mut velocity);
            place[2] = e.table_height(&place);
            let at = [
                t * (1.0 + e.clock_rate) + self.noise[0] * normal(rng),
                place[0] * (1.0 + e.position_scale) + self.noise[1] * normal(rng),
                place[1] * (1.0 + e.position_scale) + self.noise[1] * normal(rng),
            ];
            heard.push(Impact { heard: at, softer: e.softer.acts(place[0], norm(&velocity)) });
            velocity = self.rebound(&place, &velocity, rng);
        }
        heard
    }

    /// Flies until the table is reached; the time it took.
    fn fly(&self, place: &mut Vec3, velocity: &mut Vec3) -> f64 {
        const STEP_S: f64 = 1e-3;
        let above = |p: &Vec3| p[2] - self.effects.table_height(p);
        let mut t = 0.0;
        loop {
            let (p, v) = self.step(place, velocity, STEP_S);
            let [sx, sy] = self.effects.slopes_at(&p);
            if above(&p) <= 0.0 && v[2] - sx * v[0] - sy * v[1] < 0.0 {
                break;
            }
            (*place, *velocity) = (p, v);
            t += STEP_S;
        }
        let in_flight = |h: f64| above(&self.step(place, velocity, h).0) > 0.0;
        let [_, late] = bisect([0.0, STEP_S], 50, in_flight);
        (*place, *velocity) = self.step(place, velocity, late);
        t + late
    }

    /// Place and velocity a step later.
    fn step(&self, place: &Vec3, velocity: &Vec3, h: f64) -> (Vec3, Vec3) {
        let rates = |&[_, _, _, u, v, w]: &[f64; 6], _| {
            let k = self.effects.drag_per_m * norm(&[u, v, w]);
            [u, v, w, -k * u, -k * v, -k * w - GRAVITY_M_S2]
        };
        let [[x, y, z], [u, v, w]] = [*place, *velocity];
        let [x, y, z, u, v, w] = runge_kutta::step(&[x, y, z, u, v, w], 0.0, h, rates);
        ([x, y, z], [u, v, w])
    }

    /// The velocity after an impact.
    fn rebound(&self, place: &Vec3, v: &Vec3, rng: &mut ChaCha8Rng) -> Vec3 {
        let e = &self.effects;
        let speed = norm(v);
        let mut restitution =
            self.restitution - e.slope_s_m * (speed - 1.0) - e.curvature_s2_m2 * (speed - 1.0).powi(2);
        if place[0] > self.soft_from_m {
            restitution -= e.softer_side;
        }
        if e.softer.acts(place[0], speed) {
            restitution -= e.softer.by;
        }
        let [sx, sy] = e.slopes_at(place);
        let up = unit(&[-sx, -sy, 1.0]);
        let into = v[0] * up[0] + v[1] * up[1] + v[2] * up[2];
        let mirrored: Vec3 =
            std::array::from_fn(|i| (1.0 - e.friction) * (v[i] - into * up[i]) - into * up[i]);
        if self.restitution_scatter > 0.0 {
            let off: f64 = StandardNormal.sample(rng);
            restitution *= (self.restitution_scatter * off).exp();
        }
        let size = restitution * norm(&mirrored);
        von_mises_fisher(&unit(&mirrored), self.kappa, rng).map(|x| size * x)
    }
}

fn norm(v: &Vec3) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

fn unit(v: &Vec3) -> Vec3 {
    let size = norm(v);
    v.map(|x| x / size)
}

/// A direction about a mean one (von Mises and Fisher; Ulrich 1984, doi:10.2307/2347441, in closed form on the sphere).
fn von_mises_fisher(mean: &Vec3, kappa: f64, rng: &mut ChaCha8Rng) -> Vec3 {
    let u: f64 = rng.random();
    let along = 1.0 + (u + (1.0 - u) * (-2.0 * kappa).exp()).ln() / kappa;
    let across = (1.0 - along * along).max(0.0).sqrt();
    let turn = rng.random_range(0.0..std::f64::consts::TAU);
    let helper = if mean[0].abs() < 0.5 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let cross = |a: &Vec3, b: &Vec3| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let first = unit(&cross(mean, &helper));
    let second = cross(mean, &first);
    std::array::from_fn(|i| along * mean[i] + across * (turn.cos() * first[i] + turn.sin() * second[i]))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    #[test]
    fn without_noise_flights_shorten_by_the_restitution() {
        let world = BounceWorld {
            runs: 1,
            noise: [0.0; 2],
            kappa: 1e14,
            release_m_s: 0.0,
            height_known: true,
            ..BounceWorld::drops()
        };
        let [header, data] = world.files(3);
        assert!(header.contains("drop_height_m = 0.3"));
        let times: Vec<f64> =
            data.lines().skip(1).map(|l| l.split(',').nth(2).unwrap().parse().unwrap()).collect();
        let flights: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
        approx::assert_relative_eq!(flights[0], 0.8 * (8.0 * 0.3 / GRAVITY_M_S2).sqrt(), max_relative = 1e-6);
        for pair in flights.windows(2) {
            approx::assert_relative_eq!(pair[1] / pair[0], 0.8, max_relative = 2e-6);
        }
    }

    /// A ball that falls straight down is mirrored at the slope where it lands, and lands again on the bowl.
    #[test]
    fn a_bowl_sends_balls_to_its_middle() {
        let effects = Effects { bowl_per_m: 0.8, ..Effects::default() };
        let still = BounceWorld { noise: [0.0; 2], kappa: 1e14, release_m_s: 0.0, ..BounceWorld::drops() };
        let world = BounceWorld { effects, ..still };
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let heard = world.drop([0.1, 0.0], 0.3, 0.0..1.0, 2, &mut rng);
        let [first, second] = [heard[0].heard, heard[1].heard];
        let (duration, theta) = (second[0] - first[0], (0.8_f64 * 0.1).atan());
        let after = 0.8 * (2.0 * GRAVITY_M_S2 * 0.3).sqrt();
        // Directions are drawn about the mean one to 1e-7 rad.
        approx::assert_relative_eq!(
            (second[1] - first[1]) / duration,
            -after * (2.0 * theta).sin(),
            max_relative = 1e-5
        );
        let rise = after * (2.0 * theta).cos() * duration - 0.5 * GRAVITY_M_S2 * duration * duration;
        approx::assert_abs_diff_eq!(rise, 0.4 * (second[1].powi(2) - first[1].powi(2)), epsilon = 1e-6);
    }

    #[test]
    fn directions_scatter_by_one_over_kappa() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let n = 20_000;
        let square = (0..n)
            .map(|_| {
                let d = von_mises_fisher(&[0.0, 0.0, 1.0], 400.0, &mut rng);
                d[0] * d[0]
            })
            .sum::<f64>()
            / f64::from(n);
        // Four standard errors of a variance.
        assert!((square * 400.0 - 1.0).abs() < 4.0 * (2.0 / f64::from(n)).sqrt() + 1.0 / 400.0, "{square}");
    }
}
