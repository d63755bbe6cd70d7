//! Rigs whose effects are sized by their strength in sigmas, and the one way in which an effect is concealed in them.

use std::marker::PhantomData;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use super::draw::{great_strength, log_between, sign, strength};
use super::key::{Concealed, Hidden, Key, Place};
use super::maker::Maker;
use super::nuisances::{Nuisances, Pairs, difference, size_of_strength};

/// The size of a leftover beside that of the main effect.
const LEFT: std::ops::Range<f64> = 0.03..0.3;
/// The strength from which a leftover shows.
const SHOWS: f64 = 8.0;
/// The part of an imitated effect's squares that the best listed mechanism takes away.
const IMITATED: std::ops::Range<f64> = 0.4..0.85;
/// Draws after which the kind that stands in is drawn.
const TRIES: usize = 60;

/// Which effects a world hides, by their numbers.
pub(crate) struct Choice {
    /// Those of the domain's list.
    pub(crate) listed: Vec<usize>,
    /// The one that is not on the list; looked at where something unlisted is hidden.
    pub(crate) unlisted: usize,
}

/// A rig with its sensors, and what effects will look like before their size is known.
pub(crate) trait Rig: Sized {
    /// The domain of its recordings.
    const DOMAIN: &'static str;

    /// Sizes of all effects; none at work by default.
    type Effects: Copy + Default;

    /// Draws a rig that can show what is to be hidden, and which effects are hidden.
    fn draw(hidden: Hidden, rng: &mut ChaCha8Rng) -> (Self, Choice);

    /// The changes of the readings that the baseline's nuisance parameters can make.
    fn nuisances(&self) -> Nuisances;

    /// Change of the readings by effects, in sigmas.
    fn response(&self, effects: Self::Effects) -> Vec<f64>;

    /// The listed effects that a model of such a recording can have.
    fn candidates(&self) -> Vec<usize>;

    /// The smallest and the largest plausible size of a listed effect.
    fn size_bounds(&self, listed: usize) -> [f64; 2];

    /// Puts a listed effect of this size to work.
    fn apply(&self, effects: &mut Self::Effects, listed: usize, size: f64);

    /// Writes a listed effect into the key.
    fn describe(&self, effects: &Self::Effects, listed: usize, key: &mut Key);

    /// The smallest and the largest plausible size of an unlisted effect.
    fn unlisted_size_bounds(&self, which: usize) -> [f64; 2];

    /// Effects with an unlisted one of this size and sign beside them.
    fn unlisted(&self, beside: Self::Effects, which: usize, sign: f64, size: f64) -> Self::Effects;

    /// Writes an unlisted effect into the key.
    fn describe_unlisted(&self, which: usize, key: &mut Key);

    /// Where an unlisted effect shows that changes the readings like this, in sigmas: the place that was described, or that in some runs.
    fn where_shown(&self, place: Place, _change: &[f64]) -> Place {
        place
    }

    /// The sign of an unlisted effect.
    fn unlisted_sign(rng: &mut ChaCha8Rng) -> f64 {
        sign(rng)
    }

    /// Header and data of the recording with these effects at work.
    fn files(self, effects: Self::Effects, rng: &mut ChaCha8Rng) -> [String; 2];

    /// Further files of the recording: name and contents.
    fn further_files(&self, _rng: &mut ChaCha8Rng) -> Vec<(String, String)> {
        Vec::new()
    }

    /// One listed effect alone.
    fn alone(&self, listed: usize, size: f64) -> Self::Effects {
        let mut effects = Self::Effects::default();
        self.apply(&mut effects, listed, size);
        effects
    }

    /// Response to each listed effect at a size in the middle of the plausible ones.
    fn directions(&self) -> Vec<Vec<f64>> {
        let middle = |[low, high]: [f64; 2]| (low * high).sqrt();
        self.candidates()
            .into_iter()
            .map(|l| self.response(self.alone(l, middle(self.size_bounds(l)))))
            .collect()
    }

    /// Sizes the hidden effects by the part of their response that no baseline can take away, and writes them into the key; the second are
    /// those on the list alone.
    fn hide(
        &self,
        hidden: Hidden,
        choice: &Choice,
        key: &mut Key,
        rng: &mut ChaCha8Rng,
    ) -> [Self::Effects; 2] {
        let nuisances = self.nuisances();
        let mut effects = Self::Effects::default();
        for &listed in &choice.listed {
            let wanted = if hidden == Hidden::Leftover { great_strength(rng) } else { strength(rng) };
            let strength_of = |size| nuisances.residual_norm(&self.response(self.alone(listed, size)));
            self.apply(&mut effects, listed, size_of_strength(wanted, self.size_bounds(listed), strength_of));
            self.describe(&effects, listed, key);
        }
        if !choice.listed.is_empty() {
            key.strength = Some(nuisances.residual_norm(&self.response(effects)));
        }
        let listed = effects;
        if hidden.unlisted() {
            let which = choice.unlisted;
            // What could pass for the unlisted effect: what is truly at work beside it, or any two of the list, or none.
            let truth = nuisances.with(&self.response(effects));
            let mimics = match hidden {
                Hidden::Leftover => Pairs::new(truth.clone(), &[]),
                Hidden::Imitated => Pairs::new(nuisances, &[]),
                _ => Pairs::new(nuisances, &self.directions()),
            };
            let before = self.response(effects);
            let strength_of = |all| {
                let change = difference(&before, &self.response(all));
                mimics.residual_norm(&change)
            };
            let wanted = match hidden {
                Hidden::Leftover => key.strength.unwrap_or(0.0) * log_between(rng, 0.03, 0.3),
                Hidden::Imitated => great_strength(rng),
                _ => strength(rng),
            };
            let sign = Self::unlisted_sign(rng);
            let unlisted = |size| self.unlisted(effects, which, sign, size);
            let bounds = self.unlisted_size_bounds(which);
            let all = unlisted(size_of_strength(wanted, bounds, |size| strength_of(unlisted(size))));
            key.strength = Some(strength_of(all)).filter(|_| hidden != Hidden::Leftover).or(key.strength);
            // One that a second mechanism of the list would take away as well is no leftover.
            let change = difference(&before, &self.response(all));
            let beyond = |other: Vec<f64>| truth.with(&other).residual_norm(&change) > SHOWS;
            let shows = hidden == Hidden::Leftover && self.directions().into_iter().all(beyond);
            key.leftover = shows.then(|| strength_of(all));
            effects = all;
            self.describe_unlisted(which, key);
            key.place = key.place.take().map(|place| self.where_shown(place, &change));
        }
        [effects, listed]
    }

    /// The part of an unlisted effect's squares that the best listed mechanism takes away.
    fn imitated(&self, effects: Self::Effects) -> f64 {
        let nuisances = self.nuisances();
        let response = self.response(effects);
        let whole = nuisances.residual_norm(&response);
        let beside = |direction: Vec<f64>| nuisances.with(&direction).residual_norm(&response) / whole;
        1.0 - self.directions().into_iter().map(beside).fold(1.0, f64::min).powi(2)
    }
}

/// Makes worlds of a kind of rig.
pub(crate) struct RigMaker<R>(PhantomData<fn() -> R>);

impl<R> RigMaker<R> {
    /// The one value of this type.
    pub(crate) const NEW: Self = Self(PhantomData);
}

/// A world that was drawn.
struct Drawn<R: Rig> {
    rig: R,
    /// What is at work.
    effects: R::Effects,
    /// The same without what is not on the list.
    listed: R::Effects,
    key: Key,
    /// Where the noise is drawn from.
    rng: ChaCha8Rng,
}

impl<R: Rig> Drawn<R> {
    fn new(mut hidden: Hidden, seed: u64) -> Self {
        let (mut rng, mut tries) = (ChaCha8Rng::seed_from_u64(seed), 0);
        loop {
            let mut key = Key::new(hidden);
            let (rig, choice) = R::draw(hidden, &mut rng);
            let [effects, listed] = rig.hide(hidden, &choice, &mut key, &mut rng);
            let fits = match hidden {
                Hidden::Leftover => {
                    LEFT.contains(&(key.leftover.unwrap_or(0.0) / key.strength.unwrap_or(1.0)))
                }
                Hidden::Imitated => IMITATED.contains(&rig.imitated(effects)),
                _ => true,
            };
            if fits {
                return Self { rig, effects, listed, key, rng };
            }
            tries += 1;
            if tries == TRIES {
                hidden = hidden.without_leftovers();
            }
        }
    }

    /// The recording with these effects at work.
    fn recorded(mut self, effects: R::Effects) -> Concealed {
        let further = self.rig.further_files(&mut self.rng);
        let [header, data] = self.rig.files(effects, &mut self.rng);
        let mut concealed = Concealed::table(header, data, self.key);
        concealed.files.extend(further.into_iter().map(|(name, text)| (name, text.into_bytes())));
        concealed
    }
}

impl<R: Rig> Maker for RigMaker<R> {
    fn domain(&self) -> &'static str {
        R::DOMAIN
    }

    fn kind(&self, hidden: Hidden) -> Hidden {
        hidden
    }

    fn conceal(&self, hidden: Hidden, seed: u64) -> Concealed {
        let drawn = Drawn::<R>::new(hidden, seed);
        let effects = drawn.effects;
        drawn.recorded(effects)
    }

    fn without_leftover(&self, hidden: Hidden, seed: u64) -> Option<Concealed> {
        // Drawing costs time, and another kind has none.
        (hidden == Hidden::Leftover).then_some(())?;
        let drawn = Drawn::<R>::new(hidden, seed);
        let listed = drawn.listed;
        (drawn.key.hidden == Hidden::Leftover).then(|| drawn.recorded(listed))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Fails where an effect of the largest plausible size leaves less than `least` sigmas beyond what a baseline takes, or not
    /// `ratio` times what the smallest leaves.
    pub(crate) fn every_effect_shows<R: Rig>(rig: &R, unlisted: usize, ratio: f64, least: [f64; 2]) {
        let nuisances = rig.nuisances();
        let left = |effects| nuisances.residual_norm(&rig.response(effects));
        for listed in rig.candidates() {
            let [weak, strong] = rig.size_bounds(listed).map(|size| left(rig.alone(listed, size)));
            assert!(strong > ratio * weak && strong > least[0], "{listed}: {weak} {strong}");
        }
        for which in 0..unlisted {
            let strong =
                left(rig.unlisted(R::Effects::default(), which, 1.0, rig.unlisted_size_bounds(which)[1]));
            assert!(strong > least[1], "{which}: {strong}");
        }
        assert!(left(R::Effects::default()) < 1e-9);
    }
}
