//! Where readings go.

mod bag;
mod folder;
mod keep;

pub(crate) use bag::Bag;
pub(crate) use folder::Folder;
pub(crate) use keep::Store;
