//! What a ball is made of, by the spectrum of its impacts, by how it bounces, and by its weight and size, in one posterior.
//!
//! [`Observation::of`] listens to a drop, [`Classifier::learn`] learns from labelled drops what each material is like and from drops on
//! other tables how far that may be believed, and a [`Judge`] answers: a probability for each material, and how unusual the drop is for
//! all of them, so that a material that is none of the list gets no confident name.

mod classifier;
mod contact;
mod error;
mod gaussian;
mod judge;
mod learned;
mod observation;
mod spectrum;
mod verdicts;

pub use classifier::{Classifier, Senses};
pub use contact::contact_time_s;
pub use error::MaterialError;
pub use judge::{Answer, Judge, Verdict};
pub use learned::Labelled;
pub use observation::{Given, Observation};
pub use verdicts::{Reliability, Verdicts};
