/// Why a container cannot be, or cannot hold what is asked.
///
/// Not exhaustive: the feature `mesh` adds a variant.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContainerError {
    /// A dimension is outside its range.
    #[error("{name} is {got}, expected {expected}")]
    Dimension {
        /// What it is.
        name: &'static str,
        /// What came.
        got: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// The volume is negative, no number, or more than the container holds.
    #[error("a volume of {got_m3} m^3, expected 0 to {capacity_m3} m^3")]
    Volume {
        /// What came.
        got_m3: f64,
        /// What fits.
        capacity_m3: f64,
    },
    /// The mesh is no container.
    #[cfg(feature = "mesh")]
    #[error(transparent)]
    Mesh(#[from] super::mesh::MeshError),
}
