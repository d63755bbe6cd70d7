//! What each material is like, learned from labelled drops, and drops on other tables that say how far to believe it.

use super::error::MaterialError;
use super::gaussian::{DIMENSIONS, Point, RESTITUTION};
use super::judge::Judge;
use super::learned::{FEWEST, Labelled, Learned};
use super::observation::Observation;
use super::spectrum::FEATURES;

/// By how much each material's covariance is drawn to that of all: what is tried.
const SHRINKAGES: [f64; 6] = [0.05, 0.15, 0.3, 0.5, 0.8, 1.0];

/// What is used of an observation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Senses {
    /// The spectra of the impacts.
    pub sound: bool,
    /// The restitution.
    pub bounce: bool,
    /// Mass and diameter.
    pub weight: bool,
}

impl Senses {
    /// All of them.
    pub const ALL: Self = Self { sound: true, bounce: true, weight: true };
    /// The spectra alone.
    pub const SOUND: Self = Self { sound: true, bounce: false, weight: false };
    /// The restitution alone.
    pub const BOUNCE: Self = Self { sound: false, bounce: true, weight: false };
    /// Mass and diameter alone.
    pub const WEIGHT: Self = Self { sound: false, bounce: false, weight: true };

    /// Their names.
    pub fn words(&self) -> String {
        let all = [(self.sound, "sound"), (self.bounce, "bounce"), (self.weight, "weight")];
        let words: Vec<&str> = all.iter().filter(|s| s.0).map(|s| s.1).collect();
        if words.is_empty() { "none".into() } else { words.join(" and ") }
    }

    /// Dimensions of a point that they observe.
    fn along(&self, point: &Point) -> Vec<usize> {
        let asked = |k: usize| match k {
            k if k < FEATURES => self.sound,
            RESTITUTION => self.bounce,
            _ => self.weight,
        };
        (0..DIMENSIONS).filter(|&k| asked(k) && point.values[k].is_finite()).collect()
    }
}

/// What each of several materials is like.
#[derive(Debug, Clone)]
pub struct Classifier {
    learned: Learned,
    shrinkage: f64,
}

impl Classifier {
    /// Learns from drops of each material (20 or more of which all is observed, at one sample rate; others are left out), and keeps others (15 or more of each, best on
    /// other tables and in other rooms) to calibrate by. Covariances are drawn to that of all materials (Friedman 1989,
    /// doi:10.1080/01621459.1989.10478752) by what predicts the latter best.
    ///
    /// # Errors
    /// [`MaterialError::TooFew`], [`MaterialError::Materials`], and [`MaterialError::Flat`] for a feature that says nothing.
    pub fn learn(
        materials: usize,
        learned: &[Labelled],
        held_out: Vec<Labelled>,
    ) -> Result<Self, MaterialError> {
        let whole =
            |d: &&Labelled| d.observation.logit_restitution.is_some() && d.observation.ln_density.is_some();
        let learned: Vec<Labelled> = learned.iter().filter(whole).cloned().collect();
        for (drops, least, purpose) in
            [(&learned, FEWEST[0], "learn from"), (&held_out, FEWEST[1], "calibrate by")]
        {
            if let Some(wrong) = drops.iter().find(|d| d.material >= materials) {
                let (expected, got) = (materials, wrong.material + 1);
                return Err(MaterialError::Materials { what: "a label", expected, got });
            }
            for material in 0..materials {
                let got = drops.iter().filter(|d| d.material == material).count();
                if got < least {
                    return Err(MaterialError::TooFew { material, purpose, least, got });
                }
            }
        }
        let tried: Result<Vec<(f64, Self)>, MaterialError> = SHRINKAGES
            .iter()
            .map(|&shrinkage| {
                let one = Learned::new(materials, &learned, held_out.clone(), shrinkage)?;
                let score =
                    Judge::new(&one, &(0..DIMENSIONS).collect::<Vec<_>>(), usize::MAX)?.held_out_score();
                Ok((score, Self { learned: one, shrinkage }))
            })
            .collect();
        let best = tried?.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|b| b.1).ok_or(MaterialError::Materials { what: "drops", expected: 1, got: 0 })
    }

    /// How many materials it knows.
    pub fn materials(&self) -> usize {
        self.learned.materials.len()
    }

    /// By how much each material's covariance is drawn to that of all, 0 to 1.
    pub fn shrinkage(&self) -> f64 {
        self.shrinkage
    }

    /// A judge for observations like this one by some of its senses: of as many impacts, with the features that its sample rate shows. It is
    /// calibrated by the drops held out, seen as this one is.
    ///
    /// # Errors
    /// [`MaterialError::Blind`] where the senses observed nothing; [`MaterialError::TooFew`] where too few drops held out have what it has.
    pub fn judge(&self, like: &Observation, senses: Senses) -> Result<Judge<'_>, MaterialError> {
        let along = senses.along(&Point::of(like, usize::MAX));
        if along.is_empty() {
            return Err(MaterialError::Blind { senses: senses.words() });
        }
        Judge::new(&self.learned, &along, like.impacts())
    }
}
