//! The last few results of something that takes long, each with what it was worked out from.
//!
//! A fit changes one number at a time: most of what follows from the others it asks for again. What is asked for stays,
//! what nobody asked for the longest goes.

use std::sync::{Arc as Shared, Mutex, MutexGuard, PoisonError};

/// Results `V` by what they were worked out from, `K`; the one asked for last at the end.
#[derive(Debug)]
pub(super) struct Recent<K, V> {
    most: usize,
    known: Mutex<Vec<(K, Shared<V>)>>,
}

impl<K: PartialEq, V> Recent<K, V> {
    /// Returns room for so many results.
    pub(super) fn new(most: usize) -> Self {
        Self { most, known: Mutex::default() }
    }

    fn known(&self) -> MutexGuard<'_, Vec<(K, Shared<V>)>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the result of `key`, if it is known.
    pub(super) fn find(&self, key: &K) -> Option<Shared<V>> {
        let mut known = self.known();
        let at = known.iter().rposition(|(own, _)| own == key)?;
        let last = known.len() - 1;
        known[at..].rotate_left(1);
        Some(Shared::clone(&known[last].1))
    }

    /// Keeps a result.
    pub(super) fn keep(&self, key: K, value: V) -> Shared<V> {
        let value = Shared::new(value);
        let mut known = self.known();
        if known.len() >= self.most {
            known.remove(0);
        }
        known.push((key, Shared::clone(&value)));
        value
    }

    /// Returns the result of `key`, worked out if it is not known.
    pub(super) fn of(&self, key: K, work: impl FnOnce(&K) -> V) -> Shared<V> {
        self.find(&key).unwrap_or_else(|| {
            let value = work(&key);
            self.keep(key, value)
        })
    }
}

/// The very same list as another, not one that happens to be equal.
#[derive(Debug, Clone)]
pub(super) struct Same(pub(super) Shared<Vec<f64>>);

impl PartialEq for Same {
    fn eq(&self, other: &Self) -> bool {
        Shared::ptr_eq(&self.0, &other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_for_again_stays_and_what_is_not_goes() {
        let recent: Recent<u8, u8> = Recent::new(2);
        let ten_times = |key: &u8| 10 * key;
        assert_eq!(*recent.of(1, ten_times), 10);
        assert_eq!(*recent.of(2, ten_times), 20);
        assert_eq!(*recent.of(1, |_| 0), 10, "known");
        assert_eq!(*recent.of(3, ten_times), 30);
        assert_eq!((recent.find(&2), recent.find(&1).as_deref()), (None, Some(&10)));
    }
}
