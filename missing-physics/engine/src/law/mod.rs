//! What a residual says by itself, where no listed mechanism explains it.
//!
//! Five kinds of law are tried, the simplest first, each judged on data that its fit has not seen: a few of the model's
//! candidate terms, another power of a variable, a curved scale of a reading, an oscillation of one frequency, and a smooth curve over a variable.

pub(crate) mod added;
pub(crate) mod describe;
pub(crate) mod extended;
pub(crate) mod found;
mod prediction;
pub(crate) mod search;
pub(crate) mod sparse;
