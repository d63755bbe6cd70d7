//! A named number with a unit.

/// A named number with a unit: a measured channel or a known input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantity {
    /// Name with its unit as a suffix, as in the recording (`z_m`).
    pub name: String,
    /// The unit alone (`m`); empty for a pure number.
    pub unit: String,
}

impl Quantity {
    /// A quantity of the given name and unit.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }
}
