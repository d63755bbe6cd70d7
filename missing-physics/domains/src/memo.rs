//! A memo of what a model has worked out and may be asked for again.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Mutex, PoisonError};

/// Values by what they depend on; all are forgotten when they are too many, or too large together.
#[derive(Debug)]
pub(super) struct Memo<K, V> {
    most: usize,
    values: Mutex<Values<K, V>>,
}

#[derive(Debug)]
struct Values<K, V> {
    by_key: HashMap<K, V>,
    size: usize,
}

impl<K: Eq + Hash, V: Clone> Memo<K, V> {
    /// A memo of values whose sizes sum up to at most `most`.
    pub(super) fn new(most: usize) -> Self {
        Self { most, values: Mutex::new(Values { by_key: HashMap::new(), size: 0 }) }
    }

    /// Whether the value of a key is remembered.
    #[cfg(feature = "custom")]
    pub(super) fn knows(&self, key: &K) -> bool {
        self.values.lock().unwrap_or_else(PoisonError::into_inner).by_key.contains_key(key)
    }

    /// The value of a key, of a size, made where it is not remembered; two threads that ask at once may both make it.
    pub(super) fn get_or<E>(&self, key: K, size: usize, make: impl FnOnce() -> Result<V, E>) -> Result<V, E> {
        let lock = || self.values.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = lock().by_key.get(&key) {
            return Ok(value.clone());
        }
        let value = make()?;
        let mut values = lock();
        if values.size + size > self.most {
            *values = Values { by_key: HashMap::new(), size: 0 };
        }
        values.size += size;
        values.by_key.insert(key, value.clone());
        Ok(value)
    }
}

/// Numbers as they are compared: by their bits.
#[cfg(any(test, feature = "custom", feature = "dough-roll"))]
pub(super) fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|v| v.to_bits()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_made_once_until_there_are_too_many() {
        let memo = Memo::new(2);
        let mut made = 0;
        let mut ask = |key: f64| -> Result<f64, ()> {
            memo.get_or(bits(&[key]), 1, || {
                made += 1;
                if key < 0.0 { Err(()) } else { Ok(2.0 * key) }
            })
        };
        assert_eq!([ask(1.0), ask(1.0), ask(-1.0), ask(3.0)], [Ok(2.0), Ok(2.0), Err(()), Ok(6.0)]);
        assert_eq!([ask(4.0), ask(1.0)], [Ok(8.0), Ok(2.0)]);
        assert_eq!(made, 5);
    }
}
