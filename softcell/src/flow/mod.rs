//! Markers followed from picture to picture: pyramidal Lucas-Kanade, then the marker's own centre.
//!
//! Lucas and Kanade's step (1981; in Bouguet's pyramid, 2000) finds where a patch went, from the coarsest level down. Steps add
//! up, and so do their errors; a marker is bright on dark, so each step ends on its centre of brightness, which forgets the way
//! it came. A marker is *lost* when it leaves the picture, when its patch does not come back on the way back, or when nothing
//! bright is where it should be; it is looked for where its neighbours' motion puts it. Two that run into each other are
//! *merged* until they part.

mod pyramid;
mod step;
mod tracker;

pub use pyramid::Pyramid;
pub use step::{Flow, LucasKanade};
pub use tracker::{Status, Track, TrackError, Tracker, TrackerSettings};
