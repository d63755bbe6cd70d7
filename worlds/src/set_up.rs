//! What makers that size their effects by sigmas share: a set-up, and the one way in which something is concealed in it.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use crate::concealed::draw::{sign, strength};
use crate::concealed::{Concealed, Hidden, Key};
use crate::sizing::{Basis, sized};

/// Which effects a world hides, by their numbers.
pub(crate) struct Choice {
    /// Of the list.
    pub(crate) listed: Vec<usize>,
    /// Not on the list; looked at where something unlisted is hidden.
    pub(crate) unlisted: usize,
}

/// A rig with its sensors, and what effects will look like before their size is known.
pub(crate) trait SetUp: Sized {
    /// Sizes of all effects; none at work by default.
    type Effects: Copy + Default;

    /// Draws a set-up that can show what is to be hidden, and which effects these are.
    fn draw(hidden: Hidden, rng: &mut ChaCha8Rng) -> (Self, Choice);

    /// What nobody is surprised at: all that the baseline's own unknowns can do to the readings.
    fn basis(&self) -> Basis;

    /// What effects do to the readings, in sigmas.
    fn change(&self, effects: Self::Effects) -> Vec<f64>;

    /// The listed effects that a model of such a recording can try.
    fn tried(&self) -> Vec<usize>;

    /// Between what sizes a listed effect is plausible.
    fn bounds(&self, listed: usize) -> [f64; 2];

    /// Puts a listed effect of this size to work.
    fn set(&self, effects: &mut Self::Effects, listed: usize, size: f64);

    /// Writes a listed effect into the key.
    fn say(&self, effects: &Self::Effects, listed: usize, key: &mut Key);

    /// Between what sizes an unlisted effect is plausible.
    fn unlisted_bounds(&self, which: usize) -> [f64; 2];

    /// An unlisted effect of this size and sign.
    fn unlisted(&self, which: usize, turn: f64, size: f64) -> Self::Effects;

    /// Writes an unlisted effect into the key.
    fn say_unlisted(&self, which: usize, key: &mut Key);

    /// The sign of an unlisted effect.
    fn turn(rng: &mut ChaCha8Rng) -> f64 {
        sign(rng)
    }

    /// Header and data of the recording with these effects at work.
    fn files(self, effects: Self::Effects, rng: &mut ChaCha8Rng) -> [String; 2];

    /// What lies beside them: name and contents.
    fn beside(&self, _rng: &mut ChaCha8Rng) -> Vec<(String, String)> {
        Vec::new()
    }

    /// One listed effect alone.
    fn alone(&self, listed: usize, size: f64) -> Self::Effects {
        let mut effects = Self::Effects::default();
        self.set(&mut effects, listed, size);
        effects
    }

    /// What the listed effects do when they are small.
    fn directions(&self) -> Vec<Vec<f64>> {
        let middle = |[low, high]: [f64; 2]| (low * high).sqrt();
        self.tried().into_iter().map(|l| self.change(self.alone(l, middle(self.bounds(l))))).collect()
    }

    /// Sizes what is hidden by what no baseline can take away, and writes it into the key.
    fn hide(&self, hidden: Hidden, choice: &Choice, key: &mut Key, rng: &mut ChaCha8Rng) -> Self::Effects {
        let plain = self.basis();
        let mut effects = Self::Effects::default();
        for &listed in &choice.listed {
            let wanted = strength(rng);
            let left = |size| plain.left(&self.change(self.alone(listed, size)));
            self.set(&mut effects, listed, sized(wanted, self.bounds(listed), left));
            self.say(&effects, listed, key);
        }
        if !choice.listed.is_empty() {
            key.strength = Some(plain.left(&self.change(effects)));
        }
        if hidden == Hidden::Unlisted {
            let which = choice.unlisted;
            let bases = plain.with_pairs(&self.directions());
            let rest = |effects| {
                let change = self.change(effects);
                bases.iter().map(|b| b.left(&change)).fold(f64::INFINITY, f64::min)
            };
            let (wanted, turn) = (strength(rng), Self::turn(rng));
            let size =
                sized(wanted, self.unlisted_bounds(which), |size| rest(self.unlisted(which, turn, size)));
            effects = self.unlisted(which, turn, size);
            key.strength = Some(rest(effects));
            self.say_unlisted(which, key);
        }
        effects
    }
}

/// Draws a world of a kind of set-up.
pub(crate) fn conceal<S: SetUp>(hidden: Hidden, seed: u64) -> Concealed {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut key = Key::new(hidden);
    let (set_up, choice) = S::draw(hidden, &mut rng);
    let effects = set_up.hide(hidden, &choice, &mut key, &mut rng);
    let beside = set_up.beside(&mut rng);
    let [header, data] = set_up.files(effects, &mut rng);
    let mut concealed = Concealed::table(header, data, key);
    concealed.files.extend(beside.into_iter().map(|(name, text)| (name, text.into_bytes())));
    concealed
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Fails where an effect of the largest plausible size leaves less than `least` sigmas beyond what a baseline takes, or not
    /// `ratio` times what the smallest leaves.
    pub(crate) fn every_effect_shows<S: SetUp>(set_up: &S, unlisted: usize, ratio: f64, least: [f64; 2]) {
        let plain = set_up.basis();
        let left = |effects| plain.left(&set_up.change(effects));
        for listed in set_up.tried() {
            let [weak, strong] = set_up.bounds(listed).map(|size| left(set_up.alone(listed, size)));
            assert!(strong > ratio * weak && strong > least[0], "{listed}: {weak} {strong}");
        }
        for which in 0..unlisted {
            let strong = left(set_up.unlisted(which, 1.0, set_up.unlisted_bounds(which)[1]));
            assert!(strong > least[1], "{which}: {strong}");
        }
        assert!(left(S::Effects::default()) < 1e-9);
    }
}
