//! What a model has worked out and may be asked for again.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Mutex, PoisonError};

/// Values by what they hang on; all are forgotten when there are too many.
#[derive(Debug)]
pub(super) struct Kept<K, V> {
    most: usize,
    by: Mutex<HashMap<K, V>>,
}

impl<K: Eq + Hash, V: Clone> Kept<K, V> {
    pub(super) fn new(most: usize) -> Self {
        Self { most, by: Mutex::default() }
    }

    /// The value of a key, made where it is not kept; two threads that ask at once may both make it.
    pub(super) fn get_or<E>(&self, key: K, make: impl FnOnce() -> Result<V, E>) -> Result<V, E> {
        let lock = || self.by.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = lock().get(&key) {
            return Ok(value.clone());
        }
        let value = make()?;
        let mut by = lock();
        if by.len() >= self.most {
            by.clear();
        }
        by.insert(key, value.clone());
        Ok(value)
    }
}

/// Numbers as they are compared: by their bits.
pub(super) fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|v| v.to_bits()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_made_once_until_there_are_too_many() {
        let kept = Kept::new(2);
        let mut made = 0;
        let mut ask = |key: f64| -> Result<f64, ()> {
            kept.get_or(bits(&[key]), || {
                made += 1;
                if key < 0.0 { Err(()) } else { Ok(2.0 * key) }
            })
        };
        assert_eq!([ask(1.0), ask(1.0), ask(-1.0), ask(3.0)], [Ok(2.0), Ok(2.0), Err(()), Ok(6.0)]);
        assert_eq!([ask(4.0), ask(1.0)], [Ok(8.0), Ok(2.0)]);
        assert_eq!(made, 5);
    }
}
