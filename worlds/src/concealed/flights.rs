//! Flights whose hidden effects are sized by their strength: one of the list with something smaller beside it, or something that the list imitates.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::draw::{between, log_between, noise, sigma, sign, whole};
use super::key::{Hidden, Key};
use super::nuisances::{Nuisances, difference};
use super::rig::{Choice, Rig};
use crate::physics::flight::{Effects, FlightWorld, Knock, Launch, Mast, Measured};

/// The recording's header.
pub(super) const HEADER: &str = "format = 1\ndomain = \"trajectory\"\ndata = \"data.csv\"\n";

/// Listed effects that may have something beside them: all that a camera can see in space but wind, which acts through another.
const LISTED: usize = 7;
/// Effects that are not on the list.
const UNLISTED: usize = 3;

/// Throws that a camera films: four to eight runs of about a second.
pub(super) fn filmed(rng: &mut ChaCha8Rng) -> FlightWorld {
    let rows = whole(rng, 35, 60);
    let sigma = log_between(rng, 5e-4, 3e-3);
    FlightWorld {
        runs: whole(rng, 4, 8),
        rows: [rows, rows + 15],
        noise: noise(rng, sigma),
        ..FlightWorld::thrown(Measured::Position)
    }
}

/// Writes a listed effect but wind into the key, by its number among [`LISTED`].
pub(super) fn describe(e: &Effects, listed: usize, key: &mut Key) {
    match listed {
        0 => key.add("quadratic-drag", &[("k_per_m", e.quadratic_per_m)]),
        1 => key.add("linear-drag", &[("rate_per_s", e.linear_per_s)]),
        2 => key.add("buoyancy", &[("acceleration_m_s2", e.lift_m_s2)]),
        3 => {
            let [x, y, z] = e.magnus_per_s;
            key.add("magnus-lift", &[("lift_x_per_s", x), ("lift_y_per_s", y), ("lift_z_per_s", z)]);
        }
        4 => key.add("camera-scale", &[("scale", e.camera_scale)]),
        5 => {
            let [x, y] = e.camera_tilt_rad;
            key.add("camera-tilt", &[("about_x_rad", x), ("about_y_rad", y)]);
        }
        _ => key.add("clock-rate", &[("rate", e.clock_rate)]),
    }
}

/// Filmed throws, with what their effects look like before their sizes are known.
pub(super) struct Flights {
    world: FlightWorld,
    /// Of launches and noise.
    seed: u64,
    launches: Vec<Launch>,
    /// Readings of free flight, in sigmas.
    free: Vec<f64>,
    /// Which way listed effects act.
    signs: [f64; 3],
    /// How fast the mast swings, Hz, and when the camera is knocked, s.
    swing_hz: f64,
    knocked_s: f64,
}

impl Flights {
    /// All readings with these effects at work, in sigmas.
    fn readings(&self, effects: Effects) -> Vec<f64> {
        let flights = FlightWorld { effects, ..self.world }.flights(&self.launches);
        let sigma = sigma(&self.world.noise);
        flights.into_iter().flat_map(|(_, channels)| channels).flatten().map(|x| x / sigma).collect()
    }
}

impl Rig for Flights {
    const DOMAIN: &'static str = "trajectory";

    type Effects = Effects;

    fn draw(hidden: Hidden, rng: &mut ChaCha8Rng) -> (Self, Choice) {
        let world = filmed(rng);
        let seed = rng.random();
        let launches = world.launches(&mut ChaCha8Rng::seed_from_u64(seed));
        let (signs, swing_hz) = (std::array::from_fn(|_| sign(rng)), between(rng, 2.0, 8.0));
        let knocked_s = between(rng, 0.2, 0.5);
        let mut rig = Self { world, seed, launches, free: Vec::new(), signs, swing_hz, knocked_s };
        rig.free = rig.readings(Effects::default());
        let listed = (0..hidden.listed()).map(|_| whole(rng, 0, LISTED - 1)).collect();
        (rig, Choice { listed, unlisted: whole(rng, 0, UNLISTED - 1) })
    }

    /// Place and velocity at the start of each run.
    fn nuisances(&self) -> Nuisances {
        let mut nuisances = Nuisances::default();
        let mut begin = 0;
        for launch in &self.launches {
            for axis in 0..3 {
                for power in 0..2 {
                    let mut column = vec![0.0; self.free.len()];
                    let rows = &mut column[begin + axis * launch.rows..begin + (axis + 1) * launch.rows];
                    rows.iter_mut().enumerate().for_each(|(i, v)| *v = (i as f64).powi(power));
                    nuisances.add(&column);
                }
            }
            begin += 3 * launch.rows;
        }
        nuisances
    }

    fn response(&self, effects: Effects) -> Vec<f64> {
        difference(&self.free, &self.readings(effects))
    }

    fn candidates(&self) -> Vec<usize> {
        (0..LISTED).collect()
    }

    fn size_bounds(&self, listed: usize) -> [f64; 2] {
        match listed {
            0 => [5e-4, 0.1],
            1..=3 => [2e-3, 0.4],
            4 | 5 => [5e-4, 0.06],
            _ => [2e-4, 0.03],
        }
    }

    fn apply(&self, e: &mut Effects, listed: usize, size: f64) {
        let [a, b, c] = self.signs.map(|sign| sign * size);
        match listed {
            0 => e.quadratic_per_m = size,
            1 => e.linear_per_s = size,
            2 => e.lift_m_s2 = a,
            3 => e.magnus_per_s = [0.6 * a, 0.7 * b, 0.4 * c],
            4 => e.camera_scale = a,
            5 => e.camera_tilt_rad = [0.8 * a, 0.6 * b],
            _ => e.clock_rate = a,
        }
    }

    fn describe(&self, effects: &Effects, listed: usize, key: &mut Key) {
        describe(effects, listed, key);
    }

    fn unlisted_size_bounds(&self, which: usize) -> [f64; 2] {
        match which {
            0 => [1e-4, 0.03],
            1 => [5e-3, 3.0],
            _ => [1e-4, 0.05],
        }
    }

    fn unlisted(&self, beside: Effects, which: usize, sign: f64, size: f64) -> Effects {
        match which {
            0 => Effects { mast: Mast { amplitude_m: size, frequency_hz: self.swing_hz }, ..beside },
            1 => Effects { cord_per_s2: size, ..beside },
            _ => Effects { knock: Knock { height_m: sign * size, at_s: self.knocked_s }, ..beside },
        }
    }

    fn describe_unlisted(&self, which: usize, key: &mut Key) {
        let what = ["a mast that swings", "a cord that pulls back", "a camera that is knocked"];
        key.unlisted = Some(what[which.min(UNLISTED - 1)].into());
    }

    fn files(self, effects: Effects, _rng: &mut ChaCha8Rng) -> [String; 2] {
        let world = FlightWorld { effects, ..self.world };
        [HEADER.into(), world.draw(self.seed).csv(6)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::concealed::rig::tests::every_effect_shows;

    #[test]
    fn effects_show_beside_the_start_of_each_run() {
        let (rig, _) = Flights::draw(Hidden::Leftover, &mut ChaCha8Rng::seed_from_u64(5));
        every_effect_shows(&rig, UNLISTED, 10.0, [20.0, 20.0]);
    }

    /// A mast that swings is seen in the flights that are written: they differ from those without it by the response.
    #[test]
    fn the_response_is_what_is_written() {
        let (rig, _) = Flights::draw(Hidden::Leftover, &mut ChaCha8Rng::seed_from_u64(6));
        let effects = rig.unlisted(rig.alone(0, 0.05), 0, 1.0, 0.01);
        let (response, scale) = (rig.response(effects), sigma(&rig.world.noise));
        let written = |effects| -> Vec<f64> {
            let drawn = FlightWorld { effects, ..rig.world }.draw(rig.seed);
            drawn.runs.into_iter().flat_map(|run| run.channels).flatten().collect()
        };
        let moved = difference(&written(Effects::default()), &written(effects));
        let coarse = 1e-9 + rig.world.noise.digit;
        assert!(moved.iter().zip(&response).all(|(m, r)| (m - scale * r).abs() <= coarse));
    }
}
