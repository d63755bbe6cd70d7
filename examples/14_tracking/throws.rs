//! One throw, played by each of the trackers: the same flight, the same sounds.

use crate::balls::{Ball, Inferred};
use crate::place::{OUTLIER_M, Place};
use crate::{Failure, SPACE};
use bounce_audio::fake::{Court, CourtSettings, Toss, Touchdown, Verdict};
use bounce_audio::hear::HearSettings;
use bounce_audio::listen::{Delays, Listener};
use bounce_audio::track::{
    Deterministic, FilterSettings, Goal, HearingError, ParticleFilter, Played, Player, Seen, Stochastic,
    StochasticSettings, Tracker, play,
};
use hw_traits::microphones::Microphones;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// A ball is touched within the paddle's radius and its own; a little less is safe, m.
const TOUCH_M: f64 = 0.07;

pub(crate) const TRACKERS: [&str; 6] = [
    "a paddle that stays",
    "1, straight on",
    "2, with chance",
    "2, no farther than needed",
    "a particle filter",
    "the filter, an oracle",
];

/// One throw with one tracker.
pub(crate) struct Outcome {
    pub(crate) verdict: Verdict,
    /// The first impact, from 0, that was heard far from the truth, or not at all.
    pub(crate) misheard: Option<usize>,
    /// Errors of the places of impacts, m.
    pub(crate) errors_m: Vec<f64>,
    pub(crate) unheard: usize,
    pub(crate) energy: f64,
    pub(crate) slowest_s: f64,
}

/// The paddle stays where it is.
struct Still;

impl Tracker for Still {
    fn begin(&mut self) {}

    fn heard(&mut self, _: &Seen, _: [f64; 2], _: &mut dyn Rng) -> Option<Goal> {
        None
    }
}

/// The filter, told which impacts are misheard: it hears nothing of them.
struct Warned<'a> {
    filter: ParticleFilter,
    court: &'a Court,
}

impl Tracker for Warned<'_> {
    fn begin(&mut self) {
        self.filter.begin();
    }

    fn heard(&mut self, impact: &Seen, paddle_m: [f64; 2], rng: &mut dyn Rng) -> Option<Goal> {
        let mut truth = self.court.impact_times_s().zip(&self.court.truth().touchdowns);
        let is_right = truth.any(|(t_s, down)| is_near(impact, t_s) && off_m(impact, down) <= OUTLIER_M);
        is_right.then(|| self.filter.heard(impact, paddle_m, rng))?
    }
}

fn is_near(seen: &Seen, t_s: f64) -> bool {
    (seen.t_s - t_s).abs() < 0.02
}

fn off_m(seen: &Seen, down: &Touchdown) -> f64 {
    (seen.place_m[0] - down.place_m[0]).hypot(seen.place_m[1] - down.place_m[1])
}

/// A throw from anywhere at the table's far edge to anywhere at the paddle's plane.
fn aimed(ball: &Ball, rng: &mut ChaCha8Rng) -> Toss {
    let mut uniform = |a: f64, b: f64| a + (b - a) * rng.random::<f64>();
    let (from, to) = ([uniform(0.0, 0.06), uniform(0.05, 0.5)], uniform(0.03, 0.52));
    let speed = ball.speed_m_s * uniform(0.8, 1.2);
    let slope = (to - from[1]) / (SPACE.plane_x_m - from[0]);
    let height = 0.27 + 0.02 * rng.sample::<f64, _>(StandardNormal);
    let up = 0.05 * rng.sample::<f64, _>(StandardNormal);
    Toss { place_m: [from[0], from[1], height], velocity_m_s: [speed, speed * slope, up] }
}

/// Plays one throw with every tracker.
pub(crate) fn throw(
    place: &Place,
    (ball, known): (&Ball, &Inferred),
    (delays, hearing): (Delays, &HearingError),
    seed: u64,
) -> Result<[Outcome; 6], Failure> {
    let mut court = Court::new(place.room()?, ball.real(), CourtSettings::default(), 1000 + seed);
    court.toss(&aimed(ball, &mut ChaCha8Rng::seed_from_u64(seed)));
    let e = known.posterior.mixture().mean()[0];
    let chance = |touch_m| {
        let settings = StochasticSettings { ahead: ball.ahead, touch_m, ..StochasticSettings::default() };
        Stochastic::new(known.next.clone(), SPACE, settings)
    };
    let settings = FilterSettings { hearing: *hearing, touch_m: TOUCH_M, ..FilterSettings::default() };
    let microphones = place.microphones_m(&place.room()?);
    let go = |tracker: &mut dyn Tracker| outcome(court.clone(), (&microphones, delays), tracker, seed);
    let filter = ParticleFilter::new(&known.draws, SPACE, settings)?;
    Ok([
        go(&mut Still)?,
        go(&mut Deterministic::new(e, SPACE))?,
        go(&mut chance(0.0))?,
        go(&mut chance(TOUCH_M))?,
        go(&mut filter.clone())?,
        go(&mut Warned { filter, court: &court })?,
    ])
}

/// A tracker behind a pointer.
struct Any<'a>(&'a mut dyn Tracker);

impl Tracker for Any<'_> {
    fn begin(&mut self) {
        self.0.begin();
    }

    fn heard(&mut self, impact: &Seen, paddle_m: [f64; 2], rng: &mut dyn Rng) -> Option<Goal> {
        self.0.heard(impact, paddle_m, rng)
    }
}

fn outcome(
    mut court: Court,
    (microphones_m, delays): (&[[f64; 3]], Delays),
    tracker: &mut dyn Tracker,
    seed: u64,
) -> Result<Outcome, Failure> {
    let (rate_hz, c) = (court.rate_hz(), 343.0);
    let mut listener = Listener::new(microphones_m, rate_hz, c, &HearSettings::default(), delays)?;
    let mut player = Player {
        listener: &mut listener,
        tracker: &mut Any(tracker),
        plane_x_m: SPACE.plane_x_m,
        buffer: 485,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let played = play(&mut court, &mut player, Court::is_over, &mut rng)?;
    let (errors_m, misheard, unheard) = compared(&court, &played);
    Ok(Outcome {
        verdict: court.verdict(),
        misheard,
        errors_m,
        unheard,
        energy: played.energy_m2_s,
        slowest_s: played.slowest_s,
    })
}

/// What was heard beside what was: errors (m), the first impact that was misheard or not heard, and how many were not heard.
fn compared(court: &Court, played: &Played) -> (Vec<f64>, Option<usize>, usize) {
    let (mut errors, mut first, mut unheard) = (Vec::new(), None, 0);
    for (number, (t_s, down)) in court.impact_times_s().zip(&court.truth().touchdowns).enumerate() {
        let near = played.impacts.iter().find(|seen| is_near(seen, t_s));
        let wrong = match near {
            Some(seen) => {
                let off = off_m(seen, down);
                errors.push(off);
                off > OUTLIER_M
            }
            None => {
                unheard += 1;
                true
            }
        };
        if wrong && first.is_none() {
            first = Some(number);
        }
    }
    (errors, first, unheard)
}
