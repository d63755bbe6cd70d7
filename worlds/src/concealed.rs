//! Recordings in which an effect is concealed, of every domain, drawn at random: what the proof is made of.

/// What is hidden in a world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Hidden {
    /// Nothing: noise and nuisances alone.
    Nothing,
    /// One mechanism of the domain's list.
    One,
    /// Two of them.
    Two,
    /// Something that is not on the list.
    Unlisted,
}

impl Hidden {
    /// How many mechanisms of the list are at work.
    pub(crate) const fn listed(self) -> usize {
        match self {
            Self::Nothing | Self::Unlisted => 0,
            Self::One => 1,
            Self::Two => 2,
        }
    }
}

/// A recording with its answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Concealed {
    /// The files of the recording's folder: name and contents.
    pub files: Vec<(String, Vec<u8>)>,
    /// The answer.
    pub key: Key,
}

impl Concealed {
    /// A recording of one table.
    pub(crate) fn table(header: String, data: String, key: Key) -> Self {
        let files = [("recording.toml", header), ("data.csv", data)];
        Self { files: files.map(|(name, text)| (name.to_owned(), text.into_bytes())).into(), key }
    }
}

/// What was hidden.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// The kind of world.
    pub hidden: Hidden,
    /// Identifiers of the listed mechanisms at work, in alphabetical order.
    pub mechanisms: Vec<String>,
    /// Identifiers that may be named beside them or not, which is the same model (the drag through which a wind acts).
    pub beside: Vec<String>,
    /// Their parameters, by the names of the recordings' format.
    pub parameters: Vec<HiddenParameter>,
    /// What an unlisted effect is, in words.
    pub unlisted: Option<String>,
    /// Where a local effect acts.
    pub place: Option<Place>,
    /// How strong what is hidden is, where the maker knows it: the root of the sum of squares, in sigmas of white noise, of what
    /// it does to the readings beyond what the baseline's own unknowns can take away (and, where it is unlisted, any two listed
    /// mechanisms with them).
    pub strength: Option<f64>,
}

/// A parameter of a hidden mechanism.
#[derive(Debug, Clone, PartialEq)]
pub struct HiddenParameter {
    /// Identifier of the mechanism.
    pub mechanism: String,
    /// Name with its unit as a suffix.
    pub name: String,
    /// True value.
    pub value: f64,
}

/// Where a local effect acts: readings change at an end of the interval that lies within the recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Name of the variable.
    pub variable: String,
    /// Start of the interval; `-inf` for the beginning.
    pub from: f64,
    /// End of the interval; `inf` for the end.
    pub to: f64,
}

/// Makes worlds of one domain.
pub trait Maker: Sync {
    /// The domain.
    fn domain(&self) -> &'static str;

    /// What its worlds are called: as the domain, unless the domain has recordings of several kinds.
    fn name(&self) -> &'static str {
        self.domain()
    }

    /// The kind of world that stands in for one that the domain has not.
    fn kind(&self, hidden: Hidden) -> Hidden {
        hidden
    }

    /// Draws a world in which something of the given kind (or what stands in for it) is hidden: its strength from faint to strong on a log scale, the
    /// noise, the nuisances and the numbers of runs and rows as people have them. The same seed gives the same bits.
    fn conceal(&self, hidden: Hidden, seed: u64) -> Concealed;
}

/// All makers.
pub fn makers() -> &'static [&'static dyn Maker] {
    &[
        &crate::flights::Flights,
        &crate::bounces::Bounces,
        &crate::sounds::Sounds,
        &crate::waves::Waves,
        &crate::tilts::Tilts,
        &crate::presses::Presses,
        &crate::doughs::Doughs,
        &crate::customs::Customs,
    ]
}

impl Key {
    /// An answer without parameters or place.
    pub fn new(hidden: Hidden) -> Self {
        Self {
            hidden,
            mechanisms: Vec::new(),
            beside: Vec::new(),
            parameters: Vec::new(),
            unlisted: None,
            place: None,
            strength: None,
        }
    }

    /// Adds a mechanism at work, with its parameters.
    pub fn add(&mut self, mechanism: &str, parameters: &[(&str, f64)]) {
        self.mechanisms.push(mechanism.into());
        self.mechanisms.sort();
        self.parameters.extend(parameters.iter().map(|&(name, value)| HiddenParameter {
            mechanism: mechanism.into(),
            name: name.into(),
            value,
        }));
    }

    /// Takes a mechanism and its parameters out again.
    pub(crate) fn without(&mut self, mechanism: &str) {
        self.mechanisms.retain(|m| m != mechanism);
        self.parameters.retain(|p| p.mechanism != mechanism);
    }
}

/// What every maker draws.
pub(crate) mod draw {
    use rand::Rng;
    use rand_distr::{Distribution, Uniform};

    use crate::noise::Noise;

    /// A number between two.
    pub(crate) fn between(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
        Uniform::new_inclusive(low, high).map_or(low, |u| u.sample(rng))
    }

    /// A number between two above zero, evenly on a log scale.
    pub(crate) fn log_between(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
        between(rng, low.ln(), high.ln()).exp()
    }

    /// One or the other sign.
    pub(crate) fn sign(rng: &mut impl Rng) -> f64 {
        if rng.next_u32() & 1 == 0 { 1.0 } else { -1.0 }
    }

    /// A whole number from `low` to `high`.
    pub(crate) fn whole(rng: &mut impl Rng, low: usize, high: usize) -> usize {
        low + (rng.next_u64() % (high - low + 1) as u64) as usize
    }

    /// `count` different numbers below `of`, rising.
    pub(crate) fn choose(rng: &mut impl Rng, of: usize, count: usize) -> Vec<usize> {
        let mut all: Vec<usize> = (0..of).collect();
        let mut chosen: Vec<usize> =
            (0..count.min(of)).map(|_| all.swap_remove(whole(rng, 0, all.len() - 1))).collect();
        chosen.sort_unstable();
        chosen
    }

    /// How strong an effect is to be, in the sigmas of [`super::Key::strength`]: from faint to strong.
    pub(crate) fn strength(rng: &mut impl Rng) -> f64 {
        log_between(rng, 3.0, 150.0)
    }

    /// One sigma of readings with their rounding, as a calibration finds it.
    pub(crate) fn sigma(noise: &Noise) -> f64 {
        noise.sigma.hypot(noise.digit / 12f64.sqrt())
    }

    /// That sigma as it is stated: 2 % off at most.
    pub(crate) fn stated(rng: &mut impl Rng, noise: &Noise) -> f64 {
        sigma(noise) * between(rng, 0.98, 1.02)
    }

    /// Noise of the given sigma, as sensors have it: white, or correlated from row to row, or rounded to a coarse digit.
    pub(crate) fn noise(rng: &mut impl Rng, sigma: f64) -> Noise {
        let white = Noise::white(sigma);
        match whole(rng, 0, 3) {
            0 => Noise { correlation: between(rng, 0.2, 0.7), ..white },
            1 => Noise { digit: sigma * between(rng, 0.5, 2.0), ..white },
            _ => white,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

    use super::*;

    const KINDS: [Hidden; 4] = [Hidden::Nothing, Hidden::One, Hidden::Two, Hidden::Unlisted];

    /// A domain with worlds of every kind.
    type Drawn = (&'static str, [Concealed; 4]);

    /// Every maker's worlds, drawn once from each seed.
    fn worlds(seed: u64) -> &'static [Drawn] {
        static WORLDS: [OnceLock<Vec<Drawn>>; 2] = [const { OnceLock::new() }; 2];
        let draw = |m: &&'static dyn Maker| (m.domain(), KINDS.map(|hidden| m.conceal(hidden, seed)));
        WORLDS[(seed % 2) as usize].get_or_init(|| makers().iter().map(draw).collect())
    }

    fn file<'a>(world: &'a Concealed, name: &str) -> &'a str {
        let found = world.files.iter().find(|(n, _)| n == name);
        found.map_or("", |(_, text)| std::str::from_utf8(text).unwrap())
    }

    #[test]
    fn the_same_seed_gives_the_same_bits_and_another_seed_others() {
        for ((maker, (_, worlds)), (_, others)) in makers().iter().zip(worlds(11)).zip(worlds(12)) {
            for ((hidden, world), other) in KINDS.iter().zip(worlds).zip(others) {
                assert_eq!(*world, maker.conceal(*hidden, 11), "{}", maker.domain());
                assert_ne!(world.files, other.files, "{}", maker.domain());
            }
        }
    }

    /// Every row has a field a column, finite numbers in all but labels, times that rise within a run, and two runs at least.
    #[test]
    fn files_are_well_formed() {
        const LABELS: [&str; 3] = ["run", "segment", "site"];
        for (domain, worlds) in worlds(11).iter().chain(worlds(12)) {
            for world in worlds {
                let header = file(world, "recording.toml");
                assert!(header.starts_with("format = 1\n"), "{header}");
                assert!(header.contains(&format!("domain = \"{domain}\"\n")), "{header}");
                if world.files.iter().all(|(name, _)| name != "data.csv") {
                    sounds_are_well_formed(world);
                    continue;
                }
                assert!(header.contains("data = \"data.csv\"\n"), "{header}");
                let mut rows = file(world, "data.csv").lines();
                let columns: Vec<&str> = rows.next().unwrap().split(',').collect();
                assert_eq!(columns[0], "run");
                let time = columns.iter().position(|c| *c == "t_s");
                let (mut runs, mut before) = (Vec::new(), f64::NEG_INFINITY);
                for row in rows {
                    let fields: Vec<&str> = row.split(',').collect();
                    assert_eq!(fields.len(), columns.len(), "{row}");
                    for (column, field) in columns.iter().zip(&fields).filter(|(c, _)| !LABELS.contains(c)) {
                        assert!(field.parse::<f64>().is_ok_and(f64::is_finite), "{column}: {row}");
                    }
                    if runs.last() != Some(&fields[0]) {
                        runs.push(fields[0]);
                        before = f64::NEG_INFINITY;
                    }
                    if let Some(time) = time {
                        let t: f64 = fields[time].parse().unwrap();
                        assert!(t > before, "{row}");
                        before = t;
                    }
                }
                let mut once = runs.clone();
                once.dedup();
                assert!(runs.len() >= 2 && once.len() == runs.len(), "{domain}");
            }
        }
    }

    /// Every file but the header is a sound that the header names, of one rate, whose samples are not all nought or clipped.
    fn sounds_are_well_formed(world: &Concealed) {
        let header = file(world, "recording.toml");
        for (name, bytes) in world.files.iter().filter(|(name, _)| name != "recording.toml") {
            assert!(header.contains(&format!("\"{name}\"")), "{name}: {header}");
            let mut sound = hound::WavReader::new(bytes.as_slice()).unwrap();
            assert_eq!(usize::from(sound.spec().channels), header.matches("0.0762]").count());
            let samples: Vec<i16> = sound.samples::<i16>().map(Result::unwrap).collect();
            let loudest = samples.iter().map(|s| s.unsigned_abs()).max().unwrap();
            assert!((3_000..32_700).contains(&loudest), "{name}: {loudest}");
        }
    }

    #[test]
    fn the_key_says_what_is_hidden() {
        let kinds = makers().iter().map(|m| KINDS.map(|hidden| m.kind(hidden)));
        for ((_, worlds), kinds) in worlds(11).iter().chain(worlds(12)).zip(kinds.clone().chain(kinds)) {
            let keys = worlds.each_ref().map(|w| &w.key);
            // Wind brings its drag with it.
            let counts =
                keys.each_ref().map(|k| k.mechanisms.iter().filter(|m| *m != "quadratic-drag").count());
            assert!(counts[0] == 0 && counts[1] <= 1 && counts[2] <= 2 && counts[3] == 0, "{keys:?}");
            if kinds == KINDS {
                assert!(!keys[1].mechanisms.is_empty() && keys[2].mechanisms.len() >= 2, "{keys:?}");
            }
            for (key, hidden) in keys.iter().zip(kinds) {
                assert_eq!((key.hidden, key.unlisted.is_some()), (hidden, hidden == Hidden::Unlisted));
                assert!(key.parameters.iter().all(|p| p.value.is_finite() && p.value != 0.0), "{key:?}");
                assert!(key.mechanisms.iter().all(|m| key.parameters.iter().any(|p| p.mechanism == *m)));
                assert!(key.strength.is_none_or(|s| s > 0.5 && s.is_finite()), "{key:?}");
                assert!(key.place.as_ref().is_none_or(|p| p.from < p.to), "{key:?}");
            }
        }
    }
}
