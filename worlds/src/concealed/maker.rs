//! What makes the worlds of a domain.

use super::key::{Concealed, Hidden};

/// Makes worlds of one domain.
pub trait Maker: Sync {
    /// The domain.
    fn domain(&self) -> &'static str;

    /// What its worlds are called: as the domain, unless the domain has recordings of several kinds.
    fn name(&self) -> &'static str {
        self.domain()
    }

    /// The kind of world that stands in for one that the domain has not.
    fn kind(&self, hidden: Hidden) -> Hidden {
        hidden
    }

    /// Draws a world in which something of the given kind (or what stands in for it) is hidden: its strength from faint to strong on a log scale, the
    /// noise, the nuisances and the numbers of runs and rows as people have them. The same seed gives the same bits.
    fn conceal(&self, hidden: Hidden, seed: u64) -> Concealed;
}
