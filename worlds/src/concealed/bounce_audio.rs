//! The domain `bounce`, from sound: bouncing balls with concealed effects, as microphones around the table record them.

use std::fmt::Write as _;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::bounce::{LISTED, listed, local};
use super::draw::{between, choose, log_between, whole};
use super::key::{Concealed, Hidden, Key};
use super::maker::Maker;
use crate::GRAVITY_M_S2;
use crate::physics::bounce::{BounceWorld, Impact, shows_softer};
use crate::physics::sound::{Room, TableModes, add_noise, wav};

/// Makes worlds of the domain `bounce` from sound.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BounceAudio;

/// Number of the effect that sound does not show: a fast clock is the same as a wrong speed of sound.
const CLOCK: usize = 4;
const SCALE: usize = 5;
/// The effect that only sounds have: a misplaced microphone.
const MICROPHONE: usize = LISTED;

impl Maker for BounceAudio {
    fn domain(&self) -> &'static str {
        "bounce"
    }

    fn name(&self) -> &'static str {
        "bounce-audio"
    }

    fn conceal(&self, hidden: Hidden, seed: u64) -> Concealed {
        let hidden = self.kind(hidden);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut key = Key::new(hidden);
        let mut world = SoundWorld::new(&mut rng);
        let what: Vec<usize> = (0..=MICROPHONE).filter(|&which| which != CLOCK).collect();
        for which in choose(&mut rng, what.len(), hidden.listed()).into_iter().map(|k| what[k]) {
            world.hide(which, &mut key, &mut rng);
        }
        if hidden == Hidden::Local {
            local(&mut world.ball, whole(&mut rng, 0, 2), &mut key, &mut rng);
            if let Some(place) = key.place.as_mut().filter(|place| place.variable == "x_m") {
                // Balls land over the whole of the square between the microphones.
                place.from += 0.35 * SIDE_M;
                place.to += 0.5 * SIDE_M;
                world.ball.effects.softer.x_m = [place.from, place.to];
            }
        } else if hidden.unlisted() {
            world.ball.effects.softer_side = log_between(&mut rng, 0.02, 0.15);
            key.unlisted = Some("a table that is softer on one side".into());
        }
        let mut heard = world.heard(&mut rng);
        // Drops in which all was heard hide no unheard impact.
        while heard.unheard == 0 && world.ball.effects.unheard > 0.0 {
            heard = world.heard(&mut rng);
        }
        key.state_missed(heard.unheard, world.ball.runs);
        if let Some(place) = key.place.as_mut().filter(|place| place.variable == "x_m") {
            place.runs = heard.softer;
        }
        Concealed { files: heard.files, key }
    }
}

/// Height of the microphones above the table, m.
const HEIGHT_M: f64 = 0.0762;
/// Side of the square about whose corners the microphones stand, m.
const SIDE_M: f64 = 0.55;

/// A ball in a room, and what the header states of the room.
struct SoundWorld {
    ball: BounceWorld,
    room: Room,
    stated_m: Vec<[f64; 3]>,
    stated_k: f64,
    rate_hz: u32,
    /// Signal-to-noise ratio of the quietest impact's first 5 ms at half a metre, dB.
    snr_db: f64,
    /// Clicks from elsewhere in a run, on average.
    clicks: f64,
}

/// What is recorded in a world.
struct Recorded {
    files: Vec<(String, Vec<u8>)>,
    /// The number of runs in which an impact cannot be heard.
    unheard: usize,
    /// The runs in which a softer restitution shows.
    softer: Vec<String>,
}

impl SoundWorld {
    fn new(rng: &mut ChaCha8Rng) -> Self {
        let ball = BounceWorld {
            runs: whole(rng, 6, 14),
            impacts: whole(rng, 4, 6),
            height_m: between(rng, 0.08, 0.35),
            height_known: whole(rng, 0, 1) == 1,
            restitution: between(rng, 0.7, 0.88),
            kappa: log_between(rng, 1e3, 3e4),
            noise: [0.0; 2],
            soft_from_m: 0.5 * SIDE_M,
            ..BounceWorld::drops()
        };
        let stated_k = between(rng, 285.0, 303.0);
        let rate_hz = [22_050, 44_100, 48_000][whole(rng, 0, 2)];
        let size_m = [between(rng, 3.5, 5.5), between(rng, 4.0, 6.0), between(rng, 2.4, 3.0)];
        let room = Room {
            size_m,
            table_m: [0.35 * size_m[0], 0.4 * size_m[1], 0.72],
            rt60_s: between(rng, 0.15, 0.45),
            speed_m_s: 331.3 * (stated_k / 273.15).sqrt(),
            rate_hz: f64::from(rate_hz),
            microphones_m: Vec::new(),
        };
        let (snr_db, clicks) = (between(rng, 14.0, 26.0), 0.2);
        let mut world = Self { ball, room, stated_m: Vec::new(), stated_k, rate_hz, snr_db, clicks };
        let four = whole(rng, 0, 1) == 1;
        world.place_microphones(four, rng);
        world
    }

    /// Places the microphones, to a millimetre, as people measure them.
    fn place_microphones(&mut self, four: bool, rng: &mut ChaCha8Rng) {
        let corners: &[[f64; 2]] = if four {
            &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
        } else {
            &[[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]]
        };
        let mut at = |share: f64| (1e3 * (share * SIDE_M + between(rng, -0.025, 0.025))).round() / 1e3;
        self.stated_m = corners.iter().map(|[x, y]| [at(*x), at(*y), HEIGHT_M]).collect();
        self.room.microphones_m = self.stated_m.clone();
    }

    fn hide(&mut self, which: usize, key: &mut Key, rng: &mut ChaCha8Rng) {
        if which < SCALE || which + 1 == LISTED {
            return listed(&mut self.ball, which, key, rng);
        }
        // A fourth microphone shows what three cannot.
        if self.stated_m.len() < 4 {
            self.place_microphones(true, rng);
        }
        if which == SCALE {
            listed(&mut self.ball, which, key, rng);
            // It is heard, not added to places.
            self.room.speed_m_s /= 1.0 + std::mem::take(&mut self.ball.effects.position_scale);
        } else {
            let (size, turn) = (log_between(rng, 0.003, 0.03), between(rng, 0.0, std::f64::consts::TAU));
            let (microphone, offset) = (whole(rng, 0, 3), [size * turn.cos(), size * turn.sin()]);
            for (stands, by) in self.room.microphones_m[microphone].iter_mut().zip(offset) {
                *stands += by;
            }
            let [x, y] = offset;
            key.add("microphone-offset", &[("offset_m", size), ("offset_x_m", x), ("offset_y_m", y)]);
        }
    }

    /// The recording.
    fn heard(&self, rng: &mut ChaCha8Rng) -> Recorded {
        let table = TableModes::new(0.42 * self.room.rate_hz.min(22e3), rng);
        let mut unheard = 0;
        let (mut files, mut softer) = (Vec::new(), Vec::new());
        for run in 0..self.ball.runs {
            let silent = self.ball.unheard(rng);
            unheard += usize::from(silent.is_some());
            let (sound, events) = self.sound(&table, silent, run, rng);
            files.push((format!("drop-{run:02}.wav"), sound));
            softer.extend(shows_softer(&events, self.ball.height_known).then(|| (run + 1).to_string()));
        }
        let names: Vec<String> = files.iter().map(|(name, _)| format!("{name:?}")).collect();
        let mut header = format!(
            "format = 1\ndomain = \"bounce\"\n\n[audio]\nfiles = [{}]\nmicrophones_m = {:?}\ntemperature_k = {}\n",
            names.join(", "),
            self.stated_m,
            self.stated_k
        );
        if self.ball.height_known {
            let _ = write!(header, "\n[rig]\ndrop_height_m = {}\n", self.ball.height_m);
        }
        files.insert(0, ("recording.toml".into(), header.into_bytes()));
        Recorded { files, unheard, softer }
    }

    /// The sound of one run, in which the impact of a number may be silent, and its impacts.
    fn sound(
        &self,
        table: &TableModes,
        silent: Option<usize>,
        run: usize,
        rng: &mut ChaCha8Rng,
    ) -> (Vec<u8>, Vec<Impact>) {
        let from = [between(rng, 0.25, 0.75) * SIDE_M, between(rng, 0.25, 0.75) * SIDE_M];
        let height = self.ball.height_m * if self.ball.height_known { 1.0 } else { between(rng, 0.7, 1.3) };
        let impacts = self.ball.impacts + usize::from(silent.is_some());
        let mut events = self.ball.in_run(run).drop(from, height, 0.0..1e-3, impacts, rng);
        let early = events[0].heard[0] - between(rng, 0.03, 0.12);
        events.iter_mut().for_each(|e| e.heard[0] -= early);
        let last = events.last().map_or(0.0, |e| e.heard[0]);
        let length = ((last + 0.15) * self.room.rate_hz) as usize;
        let mut channels = vec![vec![0.0; length]; self.stated_m.len()];
        let mut speed = (2.0 * GRAVITY_M_S2 * height).sqrt();
        let mut loudness = 0.0;
        for (number, Impact { heard: [t, x, y], .. }) in events.iter().enumerate() {
            if let Some(next) = events.get(number + 1).filter(|_| number > 0) {
                speed = 0.5 * GRAVITY_M_S2 * (next.heard[0] - t) / self.ball.restitution;
            }
            if Some(number) != silent {
                let burst = table.strike(speed, self.room.rate_hz, rng);
                loudness = burst.loudness();
                // The microphones stand on the table, and tilt with it.
                self.room.play(&burst, [*x, *y, 0.0], *t, rng, &mut channels);
            }
        }
        if rng.random::<f64>() < self.clicks {
            self.click(&events, rng, &mut channels);
        }
        let sigma = 2.0 * loudness * 10f64.powf(-self.snr_db / 20.0);
        add_noise(sigma, self.room.rate_hz, rng, &mut channels);
        (wav(&channels, self.rate_hz, between(rng, 0.3, 0.9)), events)
    }

    /// A sound from elsewhere in the room, between two impacts.
    fn click(&self, events: &[Impact], rng: &mut ChaCha8Rng, channels: &mut [Vec<f64>]) {
        let (turn, away) = (between(rng, 0.0, std::f64::consts::TAU), between(rng, 1.2, 1.4));
        let place =
            [0.5 * SIDE_M + away * turn.cos(), 0.5 * SIDE_M + away * turn.sin(), between(rng, 0.2, 1.0)];
        let gap = whole(rng, 0, events.len() - 2);
        let [before, after] = [events[gap].heard[0], events[gap + 1].heard[0]];
        let t = before + between(rng, 0.35, 0.65) * (after - before);
        let burst =
            TableModes::new(0.42 * self.room.rate_hz.min(22e3), rng).strike(1.0, self.room.rate_hz, rng);
        self.room.play(&burst, place, t, rng, channels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An impact that is said to go unheard in some of the drops does so in one at least: the first drops of this seed were heard whole.
    #[test]
    fn what_is_hidden_is_there() {
        let key = BounceAudio.conceal(Hidden::One, 137).key;
        assert_eq!(key.mechanisms, ["missed-impact"]);
        assert!(key.parameters[0].value > 0.0, "{:?}", key.parameters);
    }
}
