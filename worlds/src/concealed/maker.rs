//! What makes the worlds of a domain.

use super::key::{Concealed, Hidden};

/// Makes worlds of one domain.
pub trait Maker: Sync {
    /// The domain.
    fn domain(&self) -> &'static str;

    /// The name of its worlds: the domain's, unless the domain has recordings of several kinds.
    fn name(&self) -> &'static str {
        self.domain()
    }

    /// The kind of world that stands in for one that the domain has not.
    fn kind(&self, hidden: Hidden) -> Hidden {
        hidden.without_leftovers()
    }

    /// Draws a world with a hidden effect of the given kind, or of the kind that stands in for it: the strength from faint to strong on a
    /// log scale; noise, nuisance parameters and numbers of runs and rows as people have them. A seed always gives the same bits.
    fn conceal(&self, hidden: Hidden, seed: u64) -> Concealed;

    /// The world that [`Self::conceal`] draws with the same noise and without its leftover; `None` of one that has none.
    fn without_leftover(&self, _hidden: Hidden, _seed: u64) -> Option<Concealed> {
        None
    }
}
