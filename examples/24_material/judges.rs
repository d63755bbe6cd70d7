//! Judges that have been asked for before.

use std::collections::HashMap;

use bounce_audio::material::{Classifier, Judge, MaterialError, Observation, Senses};

/// One judge for each set of senses, number of impacts, and whether there is a restitution; all recordings here have one sample rate and
/// all balls are weighed.
pub(crate) struct Judges<'a> {
    classifier: &'a Classifier,
    known: HashMap<(Senses, usize, bool), Judge<'a>>,
}

impl<'a> Judges<'a> {
    pub(crate) fn new(classifier: &'a Classifier) -> Self {
        Self { classifier, known: HashMap::new() }
    }

    pub(crate) fn of(&mut self, seen: &Observation, senses: Senses) -> Result<&Judge<'a>, MaterialError> {
        let key = (senses, seen.impacts(), seen.restitution().is_some());
        if !self.known.contains_key(&key) {
            let judge = self.classifier.judge(seen, senses)?;
            self.known.insert(key, judge);
        }
        self.known.get(&key).ok_or(MaterialError::Blind { senses: senses.words() })
    }
}
