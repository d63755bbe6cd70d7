//! The balls, and what is known of each: the joint posterior of drops that were heard.

use crate::place::Place;
use crate::{Failure, SPACE};
use bayes_sim::mdn::MixtureDensity;
use bayes_sim::posterior::Posterior;
use bounce_audio::drop::{Bounce, Vector, each};
use bounce_audio::fake::{Burst, FakeBall, Room};
use bounce_audio::features::Features;
use bounce_audio::hear::{HearSettings, hear};
use bounce_audio::posterior::DropSimulator;
use bounce_audio::track::{NextBounce, NextSettings};
use bounce_audio::wav::Sound;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Silence before each drop, s.
const LEAD_S: f64 = 0.1;

pub(crate) struct Ball {
    pub(crate) name: &'static str,
    restitution: f64,
    log10_kappa: f64,
    /// Mean speed along the table of a throw, m/s.
    pub(crate) speed_m_s: f64,
    /// Impacts that algorithm 2 looks ahead.
    pub(crate) ahead: usize,
}

pub(crate) const BALLS: [Ball; 3] = [
    Ball { name: "tennis", restitution: 0.77, log10_kappa: 3.3, speed_m_s: 0.75, ahead: 3 },
    Ball { name: "ping-pong", restitution: 0.88, log10_kappa: 3.8, speed_m_s: 0.55, ahead: 4 },
    Ball { name: "moon", restitution: 0.86, log10_kappa: 2.2, speed_m_s: 0.6, ahead: 2 },
];

/// A ball as its drops sounded.
pub(crate) struct Inferred {
    pub(crate) posterior: Posterior,
    /// Drops of which three impacts were heard.
    pub(crate) drops: usize,
    /// Draws (e, log10 kappa).
    pub(crate) draws: Vec<[f64; 2]>,
    pub(crate) next: NextBounce,
}

impl Ball {
    pub(crate) fn real(&self) -> FakeBall {
        FakeBall::new(self.restitution, 10f64.powf(self.log10_kappa))
    }

    /// What is known of the ball after drops were heard, and the density of its next impact.
    pub(crate) fn infer(
        &self,
        density: &dyn MixtureDensity,
        simulator: &DropSimulator,
        place: &Place,
        drops: usize,
        seed: u64,
    ) -> Result<Inferred, Failure> {
        let (real, room) = (self.real(), place.room()?);
        let microphones = place.microphones_m(&room);
        let heard = each(drops, seed, |_, rng| drop_heard(&real, simulator, (&room, &microphones), rng));
        let heard: Vec<Features> =
            heard.into_iter().collect::<Result<Vec<_>, Failure>>()?.into_iter().flatten().collect();
        let posterior = examples::drops::joint(density, simulator, &heard)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let draws: Vec<[f64; 2]> =
            posterior.sample(200, &mut rng).theta.rows().map(|r| [r[0], r[1]]).collect();
        let mut settings = NextSettings::default();
        if examples::small() {
            settings.simulations = 2_000;
            settings.network.training.max_epochs = 40;
        }
        let next = NextBounce::learn(&draws, SPACE.gravity_m_s2, &settings, 2)?;
        Ok(Inferred { posterior, drops: heard.len(), draws, next })
    }
}

/// The features of a drop onto the table's middle as they are heard offline; `None` where three impacts were not.
fn drop_heard(
    real: &FakeBall,
    simulator: &DropSimulator,
    (room, microphones_m): (&Room, &[[f64; 3]]),
    rng: &mut ChaCha8Rng,
) -> Result<Option<Features>, Failure> {
    let start = simulator.release.draw(rng);
    let at: Vector = std::array::from_fn(|k| start.position_m[k] + [0.275, 0.275, real.radius_m][k]);
    let flown = real.fly(at, start.velocity_m_s, [0.0, 0.0, 1.0], 1.5, |_, _| false, rng);
    let rate_hz = room.rate_hz();
    let three = flown.touchdowns.iter().take(3);
    let lasts = LEAD_S + 0.1 + three.clone().map(|d| d.t_s).fold(0.0, f64::max);
    let mut channels = vec![vec![0.0; (lasts * rate_hz) as usize]; room.microphones_m().len()];
    for down in three {
        let burst = Burst::new(0.02 * down.speed_m_s, rng);
        room.strike(down.place_m, LEAD_S + down.t_s, &burst, &mut channels);
    }
    channels.iter_mut().flatten().for_each(|v| *v += 1e-3 * rng.sample::<f64, _>(StandardNormal));
    let sound = Sound { rate_hz, channels };
    let heard = hear(&sound, microphones_m, room.speed_m_s(), &HearSettings::default())?;
    let placed = |i: &bounce_audio::hear::Impact| {
        i.location.map(|l| Bounce { t_s: i.t_s, position_m: [l.x_m, l.y_m, 0.0] })
    };
    let impacts: Vec<Bounce> = heard.impacts.iter().filter_map(placed).collect();
    Ok(Features::of(&impacts).ok())
}
