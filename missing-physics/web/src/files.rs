//! Files in memory, as they were dropped on the page.

use std::collections::BTreeMap;

use missing_physics_domains::recording::{Memory, Source};

/// Files in memory, by name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Files {
    contents: BTreeMap<String, Vec<u8>>,
}

impl Files {
    /// Adds a file; one of the same name is replaced.
    pub fn add(&mut self, name: &str, bytes: impl Into<Vec<u8>>) {
        self.contents.insert(name.to_owned(), bytes.into());
    }

    /// Names and contents, in the order of the names.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.contents.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice()))
    }

    /// The files as those of a recording of this name.
    pub(crate) fn source(&self, name: &str) -> Source {
        let empty = Memory::new(name);
        Source::Memory(self.iter().fold(empty, |memory, (name, bytes)| memory.with_file(name, bytes)))
    }
}
