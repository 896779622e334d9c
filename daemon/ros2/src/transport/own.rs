//! The nodes of this process, which are no peers of each other.

use super::locked;
use std::sync::Mutex;

/// The ids of this process on one transport.
pub(crate) struct OwnIds<T: 'static>(Mutex<Vec<T>>);

/// An id, which is in the list as long as this exists.
pub(crate) struct OwnId<T: PartialEq + 'static> {
    ids: &'static OwnIds<T>,
    id: T,
}

impl<T: PartialEq + Clone> OwnIds<T> {
    pub const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    pub fn add(&'static self, id: T) -> OwnId<T> {
        locked(&self.0).push(id.clone());
        OwnId { ids: self, id }
    }

    pub fn all(&self) -> Vec<T> {
        locked(&self.0).clone()
    }
}

impl<T: PartialEq> Drop for OwnId<T> {
    fn drop(&mut self) {
        locked(&self.ids.0).retain(|id| *id != self.id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_is_listed_as_long_as_its_node_exists() {
        static IDS: OwnIds<u8> = OwnIds::new();
        let (first, second) = (IDS.add(1), IDS.add(2));
        assert_eq!(IDS.all(), [1, 2]);
        drop(first);
        assert_eq!(IDS.all(), [2]);
        drop(second);
        assert!(IDS.all().is_empty());
    }
}
