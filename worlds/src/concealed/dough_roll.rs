//! The domain `dough-roll`: rolled doughs with concealed effects.

use std::fmt::Write as _;

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::draw::{self, between, choose, log_between, sign, stated, whole};
use super::key::{Hidden, Key, Place};
use super::nuisances::Nuisances;
use super::rig::{Choice, Rig};
use crate::noise::Noise;
use crate::physics::dough::{Band, DoughWorld, Effects, Long, Piece, PlannedRoll, Roll, Shape};

const LISTED: usize = 6;
const DRYING: usize = 1;
const UNLISTED: usize = 4;
/// The unlisted effect that acts at a place.
const TOO_LONG: usize = 2;

/// A table on which doughs were rolled: some to learn from, and some since.
pub(crate) struct Table {
    /// The doughs of the recording.
    world: DoughWorld,
    training: Vec<Piece>,
    /// Whether the training rolls are in a file of their own, and not the recording's first half.
    apart: bool,
    /// Whether times were recorded.
    timed: bool,
    /// Noise of length, width and height.
    noise: [Noise; 3],
    density_kg_m3: f64,
    /// Whether the band is not the usual one, so that the header states it.
    unusual_band: bool,
    /// Sign of a change of the response.
    sign: f64,
    long_from_m: f64,
}

impl Rig for Table {
    const DOMAIN: &'static str = "dough-roll";
    type Effects = Effects;

    fn draw(hidden: Hidden, rng: &mut ChaCha8Rng) -> (Self, Choice) {
        let table = Self::drawn(rng);
        let tried = table.candidates();
        let listed = choose(rng, tried.len(), hidden.listed()).into_iter().map(|k| tried[k]).collect();
        let unlisted = match hidden {
            Hidden::Local => TOO_LONG,
            _ if hidden.unlisted() => whole(rng, 0, UNLISTED - 1),
            _ => 0,
        };
        (table, Choice { listed, unlisted })
    }

    fn candidates(&self) -> Vec<usize> {
        (0..LISTED).filter(|l| self.timed || *l != DRYING).collect()
    }

    /// The baseline has no nuisance parameter: what training left open is not counted.
    fn nuisances(&self) -> Nuisances {
        Nuisances::default()
    }

    /// For each roll: the state after it less the state without the effects, and the next measurement of that state less this one.
    fn response(&self, effects: Effects) -> Vec<f64> {
        let at_work = DoughWorld { effects, ..self.world.clone() };
        let sigma = self.noise.map(|n| draw::sigma(&n) * std::f64::consts::SQRT_2);
        let mut all = Vec::new();
        for rolls in at_work.rolled() {
            for (i, m) in rolls.iter().enumerate() {
                let again = rolls.get(i + 1).map_or(m.after, |next| next.before);
                all.extend((0..3).map(|k| (m.after[k] - m.unchanged[k]) / sigma[k]));
                all.extend((0..3).map(|k| (again[k] - m.after[k]) / sigma[k]));
            }
        }
        all
    }

    fn size_bounds(&self, listed: usize) -> [f64; 2] {
        let last = self.world.pieces.iter().flat_map(|p| &p.rolls).map(|r| r.t_s).fold(1.0, f64::max);
        let rolls = self.world.pieces.iter().map(|p| p.rolls.len()).max().unwrap_or(1) as f64;
        match listed {
            0 => [2e-3, 0.5],
            DRYING => [2e-3 / last, 1.5 / last],
            2 => [0.25, 1.5],
            3 => [2e-3, 0.4],
            4 => [2e-4, 0.03],
            _ => [2e-3 / rolls, 1.5 / rolls],
        }
    }

    fn apply(&self, e: &mut Effects, listed: usize, size: f64) {
        match listed {
            0 => e.response = self.sign * size,
            DRYING => e.drying_per_s = size,
            2 => e.slip_n = size,
            3 => e.springback = size,
            4 => e.loss = size,
            _ => e.softening_per_roll = size,
        }
    }

    fn describe(&self, e: &Effects, listed: usize, key: &mut Key) {
        match listed {
            0 => key.add("stiffness-change", &[("factor", 1.0 + e.response)]),
            DRYING => key.add("drying", &[("rate_per_s", e.drying_per_s)]),
            2 => key.add("slip", &[("force_n", e.slip_n)]),
            3 => key.add("springback", &[("fraction", e.springback)]),
            4 => key.add("volume-loss", &[("fraction_per_roll", e.loss)]),
            _ => key.add("band-softening", &[("rate_per_roll", e.softening_per_roll)]),
        }
    }

    fn unlisted_size_bounds(&self, which: usize) -> [f64; 2] {
        match which {
            0 => [5e-3, 0.8],
            1 => [0.1, 12.0],
            2 => [1e-2, 12.0],
            _ => [1e-2, 8.0],
        }
    }

    fn unlisted(&self, beside: Effects, which: usize, sign: f64, size: f64) -> Effects {
        match which {
            0 => Effects { alternation: sign * size, ..beside },
            1 => Effects { throw_per_m: sign * size, ..beside },
            2 => Effects { long: Long { fall: size, from_m: self.long_from_m }, ..beside },
            _ => Effects { worked: size, ..beside },
        }
    }

    fn describe_unlisted(&self, which: usize, key: &mut Key) {
        let what = match which {
            0 => "a response that alternates from roll to roll",
            1 => "a band that answers the throw in another way",
            2 => {
                key.place = Some(Place::new("length_m", self.long_from_m, f64::INFINITY));
                "a dough that is too long for the band"
            }
            _ => "a dough that is harder after it was worked",
        };
        key.unlisted = Some(what.into());
    }

    fn files(self, effects: Effects, rng: &mut ChaCha8Rng) -> [String; 2] {
        let mut data = self.columns();
        let mut before = 0;
        if !self.apart {
            data += &self.rows(&self.trained_on().rolled(), 0, rng);
            before = self.training.len();
        }
        let at_work = DoughWorld { effects, ..self.world.clone() };
        data += &self.rows(&at_work.rolled(), before, rng);
        [self.header(rng), data]
    }

    fn further_files(&self, rng: &mut ChaCha8Rng) -> Vec<(String, String)> {
        if !self.apart {
            return Vec::new();
        }
        vec![("train.csv".into(), self.columns() + &self.rows(&self.trained_on().rolled(), 0, rng))]
    }
}

impl Table {
    fn drawn(rng: &mut ChaCha8Rng) -> Self {
        let apart = whole(rng, 0, 7) > 0;
        let density_kg_m3 = between(rng, 1150.0, 1300.0);
        let bowl = Bowl {
            volume_m3: between(rng, 0.04, 0.06) / density_kg_m3,
            softness_spread: between(rng, 0.0, 0.02),
            scatter: if whole(rng, 0, 1) == 0 { 0.0 } else { log_between(rng, 0.005, 0.05) },
        };
        let doughs = whole(rng, 6, 12);
        let rolls = whole(rng, 14, 34);
        // A person's favourite roll, or anything within the bounds.
        let favourite = [between(rng, 0.3, 0.8), between(rng, 0.3, 0.7)];
        let spread = if whole(rng, 0, 2) == 0 { between(rng, 0.1, 0.25) } else { f64::INFINITY };
        let pieces = bowl.pieces([doughs, rolls], favourite, spread, rng);
        let learned = if apart { whole(rng, 8, 12) } else { doughs };
        let training = bowl.pieces([learned, whole(rng, 40, 50)], favourite, f64::INFINITY, rng);
        let unusual_band = whole(rng, 0, 3) == 0;
        let mut band = Band { k0_n_m: 60.0, k1_n_m2: 900.0, throw0_m: 0.04, k2_per_m: 8.0 };
        if unusual_band {
            band.k0_n_m = between(rng, 45.0, 80.0).round();
            band.k1_n_m2 = between(rng, 600.0, 1200.0).round();
            band.k2_per_m = between(rng, 4.0, 12.0).round();
        }
        let noise = std::array::from_fn(|_| {
            // Each picture has its own, as the format says.
            let sigma = log_between(rng, 2.5e-4, 6e-4);
            Noise { correlation: 0.0, ..draw::noise(rng, sigma) }
        });
        let world = DoughWorld {
            band,
            breadth_m: between(rng, 0.035, 0.045),
            elastic_pa: log_between(rng, 2.5e4, 5e4),
            yield_pa: between(rng, 200.0, 700.0),
            rate_per_s: log_between(rng, 0.06, 0.11),
            exponent: between(rng, 1.7, 2.1),
            flattening: between(rng, 0.08, 0.16),
            pieces,
            effects: Effects::default(),
        };
        let mut table = Self {
            world,
            training,
            apart,
            timed: whole(rng, 0, 6) > 0,
            noise,
            density_kg_m3,
            unusual_band,
            sign: sign(rng),
            long_from_m: 0.0,
        };
        table.long_from_m = table.between_lengths(between(rng, 0.25, 0.55));
        table
    }

    /// The doughs that were learned from.
    fn trained_on(&self) -> DoughWorld {
        DoughWorld { pieces: self.training.clone(), effects: Effects::default(), ..self.world.clone() }
    }

    /// The length that is a part of the way from the shortest dough's to the longest's, to a tenth of a millimetre.
    fn between_lengths(&self, part: f64) -> f64 {
        let lengths = || self.world.rolled().into_iter().flatten().map(|m| m.before[0]).collect::<Vec<_>>();
        let low = lengths().into_iter().fold(f64::INFINITY, f64::min);
        let high = lengths().into_iter().fold(0.0, f64::max);
        ((low + part * (high - low)) * 1e4).round() * 1e-4
    }

    fn columns(&self) -> String {
        let time = if self.timed { ",t_s" } else { "" };
        format!(
            "run,step,length_m,width_m,height_m,throw_m,depth_m,next_length_m,next_width_m,next_height_m{time}\n"
        )
    }

    /// Rows of the rolls as they were measured, each state by two pictures; the first run's number follows so many others.
    fn rows(&self, doughs: &[Vec<Roll>], runs: usize, rng: &mut ChaCha8Rng) -> String {
        let measured: Vec<[f64; 3]> = doughs.iter().flatten().flat_map(|m| [m.before, m.after]).collect();
        let mut pictures = vec![[0.0; 3]; measured.len()];
        for k in 0..3 {
            // Pictures before a roll, then those after one.
            for which in [0, 1] {
                let mut column: Vec<f64> = measured.iter().skip(which).step_by(2).map(|m| m[k]).collect();
                self.noise[k].apply(&mut column, rng);
                pictures.iter_mut().skip(which).step_by(2).zip(column).for_each(|(p, v)| p[k] = v.max(1e-4));
            }
        }
        let mut rows = String::new();
        let mut seen = pictures.chunks(2);
        for (run, rolls) in doughs.iter().enumerate() {
            for (step, m) in rolls.iter().enumerate() {
                let Some([before, after]) = seen.next() else { return rows };
                let [throw, depth] = m.action;
                let _ = write!(rows, "{},{}", runs + run + 1, step + 1);
                before.iter().for_each(|v| rows += &format!(",{v:.5}"));
                let _ = write!(rows, ",{throw:.4},{depth:.4}");
                after.iter().for_each(|v| rows += &format!(",{v:.5}"));
                if self.timed {
                    let _ = write!(rows, ",{:.2}", m.t_s);
                }
                rows.push('\n');
            }
        }
        rows
    }

    fn header(&self, rng: &mut ChaCha8Rng) -> String {
        let mut header = String::from("format = 1\ndomain = \"dough-roll\"\ndata = \"data.csv\"\n");
        if whole(rng, 0, 2) > 0 {
            header += "\n[noise]\n";
            for prefix in ["", "next_"] {
                for (name, noise) in ["length_m", "width_m", "height_m"].iter().zip(&self.noise) {
                    let _ = writeln!(header, "{prefix}{name} = {:.3e}", stated(rng, noise));
                }
            }
        }
        let mass_kg = self.density_kg_m3 * self.world.pieces.first().map_or(0.0, |p| p.fresh.volume_m3);
        let _ = write!(header, "\n[rig]\nmass_kg = {mass_kg:.3}\n");
        if whole(rng, 0, 1) == 0 {
            let _ = writeln!(header, "density_kg_m3 = {:.0}", self.density_kg_m3);
        }
        if self.apart {
            header += "training = \"train.csv\"\n";
        }
        if self.unusual_band {
            let b = &self.world.band;
            let _ = writeln!(
                header,
                "band = {{ k0_n_m = {}, k1_n_m2 = {}, throw0_m = {}, k2_per_m = {} }}",
                b.k0_n_m, b.k1_n_m2, b.throw0_m, b.k2_per_m
            );
        }
        header
    }
}

/// Dough for several pieces.
struct Bowl {
    volume_m3: f64,
    /// Relative sigma of the pieces' softness.
    softness_spread: f64,
    /// Relative sigma of the response to each roll.
    scatter: f64,
}

impl Bowl {
    /// So many pieces, rolled so many times each, around a favourite place between the bounds or (an infinite spread) anywhere.
    fn pieces(
        &self,
        [count, rolls]: [usize; 2],
        favourite: [f64; 2],
        spread: f64,
        rng: &mut ChaCha8Rng,
    ) -> Vec<Piece> {
        let normal = |rng: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(rng) };
        let mut now_s = between(rng, 1.0, 15.0);
        let mut piece = || {
            let volume_m3 = self.volume_m3 * (1.0 + 0.01 * normal(rng));
            let length_m = (6.0 * volume_m3 / std::f64::consts::PI).cbrt() * between(rng, 1.02, 1.1);
            let fresh = Shape { volume_m3, length_m, oval: 0.01 + 0.01 * normal(rng) };
            let softness = 1.0 + self.softness_spread * normal(rng);
            let mut roll = |_| {
                now_s += between(rng, 5.5, 7.5);
                let setting = favourite.map(|middle| {
                    if spread.is_finite() {
                        (middle + spread * normal(rng)).clamp(0.0, 1.0)
                    } else {
                        between(rng, 0.0, 1.0)
                    }
                });
                let scatter = (1.0 + self.scatter * normal(rng)).max(0.1);
                PlannedRoll { setting, t_s: (now_s * 100.0).round() * 0.01, scatter }
            };
            let rolls = (0..rolls).map(&mut roll).collect();
            // The next ball is made and laid down.
            now_s += between(rng, 30.0, 60.0);
            Piece { fresh, softness, rolls }
        };
        (0..count).map(|_| piece()).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;
    use crate::concealed::maker::Maker as _;
    use crate::concealed::rig::{RigMaker, tests::every_effect_shows};

    #[test]
    fn every_effect_changes_the_rolls() {
        for seed in 0..4 {
            let mut table = Table::drawn(&mut ChaCha8Rng::seed_from_u64(seed));
            table.timed = true;
            every_effect_shows(&table, UNLISTED, 5.0, [10.0; 2]);
        }
    }

    /// Balls of some 4 cm become rolls of 8 to 25 cm, whatever the dough.
    #[test]
    fn doughs_get_as_long_as_people_have_them() {
        for seed in 0..20 {
            let table = Table::drawn(&mut ChaCha8Rng::seed_from_u64(seed));
            for made in table.trained_on().rolled() {
                let [from, to] = [made[0].before[0], made[made.len() - 1].after[0]];
                assert!((0.038..0.052).contains(&from) && (0.09..0.26).contains(&to), "{seed}: {from} {to}");
                assert!(made.iter().all(|m| m.action[0] >= m.before[1] - 1e-4 && m.action[1] >= 5e-3 - 1e-9));
            }
        }
    }

    /// What is keyed is what a roll does: its strain over the usual one.
    #[test]
    fn effects_on_the_response_are_keyed_as_what_a_roll_does() {
        let table = Table::drawn(&mut ChaCha8Rng::seed_from_u64(5));
        let keyed = |effects: &Effects, listed| {
            let mut key = Key::new(Hidden::One);
            table.describe(effects, listed, &mut key);
            key.parameters[0].value
        };
        let check = |effects: Effects, expected: &dyn Fn(usize, &Roll) -> f64| {
            for rolls in (DoughWorld { effects, ..table.world.clone() }).rolled() {
                for (step, m) in rolls.iter().enumerate() {
                    let [now, unchanged] = [m.after, m.unchanged].map(|then| (then[0] / m.before[0]).ln());
                    approx::assert_relative_eq!(now, expected(step, m) * unchanged, max_relative = 1e-6);
                }
            }
        };
        let none = Effects::default();
        let half = Effects { response: -0.5, ..none };
        let factor = keyed(&half, 0);
        check(half, &|_, _| factor);
        let dry = Effects { drying_per_s: 1e-3, ..none };
        let rate = keyed(&dry, DRYING);
        check(dry, &|_, m| (-rate * m.t_s).exp());
        let soft = Effects { softening_per_roll: 0.02, ..none };
        let rate = keyed(&soft, LISTED - 1);
        check(soft, &|step, _| (-rate * step as f64).exp());
    }

    /// The training file, or twice as many runs, the first half of which know nothing of an effect.
    #[test]
    fn there_is_something_to_learn_from() {
        let mut inside = 0;
        for seed in 0..24 {
            let world = RigMaker::<Table>::NEW.conceal(Hidden::One, seed);
            let file = |name: &str| {
                world
                    .files
                    .iter()
                    .find(|(n, _)| n == name)
                    .map(|(_, text)| std::str::from_utf8(text).unwrap())
            };
            let header = file("recording.toml").unwrap();
            assert_eq!(header.contains("training"), file("train.csv").is_some());
            let table = file("train.csv").or(file("data.csv")).unwrap();
            let runs = table.lines().skip(1).filter(|l| l.split(',').nth(1) == Some("1")).count();
            assert!((8..=24).contains(&runs), "{runs}");
            inside += usize::from(file("train.csv").is_none());
        }
        assert!((1..12).contains(&inside), "{inside}");
    }
}
