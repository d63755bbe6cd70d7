//! Many markers at once, through losses and meetings.

use hw_traits::picture::Picture;
use statrs::statistics::{Data, OrderStatistics as _};

use super::pyramid::Pyramid;
use super::step::LucasKanade;
use crate::markers::{Marker, MarkerError, MarkerSettings, find};

/// Why a picture could not be followed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// The first picture has no markers.
    #[error(transparent)]
    Marker(#[from] MarkerError),
    /// A picture of another size than the first.
    #[error("a picture of {got:?} pixels after one of {expected:?}")]
    Size {
        /// Columns and rows of the first.
        expected: (usize, usize),
        /// Columns and rows of this one.
        got: (usize, usize),
    },
    /// Too few markers are left to say anything: it is dark, or the skin is torn or far away.
    #[error("{seen} of {total} markers are seen; expected {least} or more")]
    Lost {
        /// Markers seen.
        seen: usize,
        /// Markers of the first picture.
        total: usize,
        /// Least number.
        least: usize,
    },
}

/// How markers are followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackerSettings {
    /// How they are found in the first picture.
    pub markers: MarkerSettings,
    /// Sizes of the pyramid; each doubles the reach between two pictures, about the patch's half side at the finest.
    pub levels: usize,
    /// Half the patch's side in pixels; none: from the markers' size.
    pub half_px: Option<usize>,
    /// A patch that does not come back to within this many pixels is lost.
    pub back_px: f64,
    /// A marker has at least this part of its first contrast.
    pub contrast: f64,
    /// Fewer markers than this are an error.
    pub least: usize,
}

impl Default for TrackerSettings {
    fn default() -> Self {
        Self {
            markers: MarkerSettings::default(),
            levels: 4,
            half_px: None,
            back_px: 1.0,
            contrast: 0.35,
            least: 6,
        }
    }
}

/// What is known of a marker now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// It is seen.
    Seen,
    /// It overlaps another: its place is what its neighbours' motion makes likely.
    Merged,
    /// It is not seen, for so many pictures: its place is what its neighbours' motion makes likely.
    Lost {
        /// Pictures since it was seen.
        pictures: u32,
    },
}

/// A marker through time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Track {
    /// Column and row in the first picture (or at the last [`Tracker::rebase`]), in pixels.
    pub home_px: [f64; 2],
    /// Column and row now, in pixels.
    pub at_px: [f64; 2],
    /// What is known of it.
    pub status: Status,
    /// Brightness above its surroundings at first, in grey levels.
    contrast: f64,
    speed_px: [f64; 2],
}

impl Track {
    /// How far it went from home, in pixels.
    pub fn by_px(&self) -> [f64; 2] {
        [self.at_px[0] - self.home_px[0], self.at_px[1] - self.home_px[1]]
    }

    /// Whether it is seen.
    pub fn seen(&self) -> bool {
        self.status == Status::Seen
    }
}

/// Follows markers; pictures must have one size. After the first picture nothing is allocated.
#[derive(Debug, Clone)]
pub struct Tracker {
    settings: TrackerSettings,
    step: LucasKanade,
    before: Pyramid,
    after: Pyramid,
    tracks: Vec<Track>,
    radius_px: f64,
}

impl Tracker {
    /// Finds the markers of a first picture. Markers that touch each other in it are followed once they part.
    ///
    /// # Errors
    /// [`TrackError::Marker`], [`TrackError::Lost`].
    pub fn new(picture: &Picture<u8>, settings: TrackerSettings) -> Result<Self, TrackError> {
        let markers = find(picture, &settings.markers)?;
        let areas: Vec<f64> = markers.iter().map(|m| m.area_px).collect();
        let area_px = Data::new(areas).median();
        let radius_px = (area_px / std::f64::consts::PI).sqrt();
        let half = settings.half_px.unwrap_or((1.4 * radius_px).ceil() as usize + 2);
        let mut before = Pyramid::default();
        before.fill(picture, settings.levels);
        let track = |m: &Marker| {
            let centre = centre(picture, m.at_px, radius_px);
            let at_px = centre.filter(|_| !m.merged).map_or(m.at_px, |c| c.at_px);
            let status = if m.merged { Status::Merged } else { Status::Seen };
            let contrast = centre.map_or(0.0, |c| c.contrast);
            Track { home_px: at_px, at_px, status, contrast, speed_px: [0.0; 2] }
        };
        let tracks: Vec<Track> = markers.iter().map(track).collect();
        let tracker = Self {
            settings,
            step: LucasKanade::new(half, 12),
            before,
            after: Pyramid::default(),
            tracks,
            radius_px,
        };
        tracker.enough().map(|()| tracker)
    }

    /// The markers, in an order that never changes.
    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// Takes the markers' present places for home.
    pub fn rebase(&mut self) {
        self.tracks.iter_mut().for_each(|t| t.home_px = t.at_px);
    }

    /// Follows the markers into the next picture.
    ///
    /// # Errors
    /// [`TrackError::Size`] (nothing changed then), [`TrackError::Lost`] (the markers may come back with the next picture).
    pub fn next(&mut self, picture: &Picture<u8>) -> Result<&[Track], TrackError> {
        let got = (picture.width(), picture.height());
        if got != self.before.size() {
            return Err(TrackError::Size { expected: self.before.size(), got });
        }
        self.after.fill(picture, self.settings.levels);
        for i in 0..self.tracks.len() {
            if self.tracks[i].seen() {
                self.follow(picture, i);
            }
        }
        for i in 0..self.tracks.len() {
            if !self.tracks[i].seen() {
                self.recover(picture, i);
            }
        }
        self.part();
        std::mem::swap(&mut self.before, &mut self.after);
        self.enough().map(|()| self.tracks.as_slice())
    }

    fn enough(&self) -> Result<(), TrackError> {
        let seen = self.tracks.iter().filter(|t| t.seen()).count();
        let least = self.settings.least;
        if seen >= least { Ok(()) } else { Err(TrackError::Lost { seen, total: self.tracks.len(), least }) }
    }

    /// One marker that was seen: there, back again, and onto its centre.
    fn follow(&mut self, picture: &Picture<u8>, i: usize) {
        let track = self.tracks[i];
        let at = track.at_px;
        let guess = [at[0] + track.speed_px[0], at[1] + track.speed_px[1]];
        let there = self.step.follow(&self.before, &self.after, at, guess).map(|f| f.at_px);
        let returns = there
            .and_then(|p| self.step.follow(&self.after, &self.before, p, at))
            .is_some_and(|b| (b.at_px[0] - at[0]).hypot(b.at_px[1] - at[1]) <= self.settings.back_px);
        let centre = there.filter(|_| returns).and_then(|p| centre(picture, p, self.radius_px));
        let track = &mut self.tracks[i];
        match centre.filter(|c| c.contrast >= self.settings.contrast * track.contrast) {
            Some(c) => {
                track.speed_px = [c.at_px[0] - at[0], c.at_px[1] - at[1]];
                track.at_px = c.at_px;
            }
            None => track.status = Status::Lost { pictures: 0 },
        }
    }

    /// One marker that was not seen: where its neighbours would have it, if something bright is there and nobody else's.
    fn recover(&mut self, picture: &Picture<u8>, i: usize) {
        let track = self.tracks[i];
        // Where nobody is seen, it is looked for where it was.
        let by = self.neighbours_motion(i).unwrap_or_else(|| track.by_px());
        let likely = [track.home_px[0] + by[0], track.home_px[1] + by[1]];
        let free = |p: [f64; 2]| {
            let apart = |(k, t): (usize, &Track)| {
                k == i || t.at_px[0].mul_add(-1.0, p[0]).hypot(t.at_px[1] - p[1]) > 1.5 * self.radius_px
            };
            self.tracks.iter().enumerate().all(apart)
        };
        let found = centre(picture, likely, self.radius_px)
            .filter(|c| (c.at_px[0] - likely[0]).hypot(c.at_px[1] - likely[1]) <= 2.0 * self.radius_px)
            .filter(|c| c.contrast >= self.settings.contrast * track.contrast)
            .filter(|c| free(c.at_px));
        let track = &mut self.tracks[i];
        track.speed_px = [0.0; 2];
        if let Some(c) = found {
            (track.at_px, track.status) = (c.at_px, Status::Seen);
            track.contrast = track.contrast.max(c.contrast);
            return;
        }
        track.at_px = likely;
        if let Status::Lost { pictures } = &mut track.status {
            *pictures = pictures.saturating_add(1);
        }
    }

    /// Motion from home of the six nearest markers that are seen, the nearer the heavier.
    fn neighbours_motion(&self, i: usize) -> Option<[f64; 2]> {
        let home = self.tracks[i].home_px;
        let mut nearest = [(f64::INFINITY, [0.0; 2]); 6];
        for t in self.tracks.iter().enumerate().filter(|(k, t)| *k != i && t.seen()).map(|(_, t)| t) {
            let d = (t.home_px[0] - home[0]).hypot(t.home_px[1] - home[1]);
            if d < nearest[5].0 {
                nearest[5] = (d, t.by_px());
                nearest.sort_by(|a, b| a.0.total_cmp(&b.0));
            }
        }
        let (mut sum, mut by) = (0.0, [0.0; 2]);
        for (d, m) in nearest.iter().filter(|n| n.0.is_finite()) {
            let w = 1.0 / (d * d + 1.0);
            sum += w;
            by = [by[0] + w * m[0], by[1] + w * m[1]];
        }
        (sum > 0.0).then(|| [by[0] / sum, by[1] / sum])
    }

    /// Markers that came onto one another are merged.
    fn part(&mut self) {
        for i in 0..self.tracks.len() {
            for k in 0..i {
                let (a, b) = (self.tracks[i], self.tracks[k]);
                let apart = (a.at_px[0] - b.at_px[0]).hypot(a.at_px[1] - b.at_px[1]);
                if apart < 1.5 * self.radius_px && (a.seen() || b.seen()) {
                    for t in [i, k] {
                        if !matches!(self.tracks[t].status, Status::Lost { .. }) {
                            self.tracks[t].status = Status::Merged;
                        }
                    }
                }
            }
        }
    }
}

/// Where something bright has its centre.
#[derive(Debug, Clone, Copy)]
struct Centre {
    at_px: [f64; 2],
    contrast: f64,
}

/// Centre of brightness of a disc about the marker's size, moved until it rests on its own centre.
fn centre(picture: &Picture<u8>, near: [f64; 2], radius_px: f64) -> Option<Centre> {
    let reach = 1.5 * radius_px + 1.0;
    let mut p = near;
    let mut contrast = 0.0;
    for _ in 0..8 {
        let inside = |x: f64, end: usize| x - reach >= 0.0 && x + reach <= (end - 1) as f64;
        if !(inside(p[0], picture.width()) && inside(p[1], picture.height())) {
            return None;
        }
        let (low, high) = range(picture, p, reach);
        contrast = high - low;
        if !(contrast > 4.0) {
            return None;
        }
        // Up to a quarter of the way is noise and blur of the dark.
        let floor = low + 0.25 * contrast;
        let (mut sum, mut u, mut v) = (0.0, 0.0, 0.0);
        disc(picture, p, reach, |x, y, grey| {
            let w = (grey - floor).max(0.0);
            sum += w;
            u += w * x;
            v += w * y;
        });
        if !(sum > 0.0) {
            return None;
        }
        let next = [u / sum, v / sum];
        let moved = (next[0] - p[0]).hypot(next[1] - p[1]);
        p = next;
        if moved < 2e-3 {
            break;
        }
    }
    Some(Centre { at_px: p, contrast })
}

fn disc(picture: &Picture<u8>, p: [f64; 2], reach: f64, mut each: impl FnMut(f64, f64, f64)) {
    let width = picture.width();
    for row in (p[1] - reach).ceil() as usize..=(p[1] + reach) as usize {
        for column in (p[0] - reach).ceil() as usize..=(p[0] + reach) as usize {
            let (x, y) = (column as f64, row as f64);
            if (x - p[0]).powi(2) + (y - p[1]).powi(2) <= reach * reach {
                each(x, y, f64::from(picture.data()[row * width + column]));
            }
        }
    }
}

/// Grey levels below which a tenth of the disc lies and above which another tenth does.
fn range(picture: &Picture<u8>, p: [f64; 2], reach: f64) -> (f64, f64) {
    let mut counts = [0u32; 256];
    let mut n = 0;
    disc(picture, p, reach, |_, _, grey| {
        counts[grey as usize] += 1;
        n += 1;
    });
    let tenth = n / 10;
    (quantile(&counts, 0..256, tenth), quantile(&counts, (0..256).rev(), tenth))
}

/// The first grey level, in the given order, by which more than `skip` pixels have come.
fn quantile(counts: &[u32; 256], mut order: impl Iterator<Item = usize>, skip: u32) -> f64 {
    let mut sum = 0;
    let reached = order.find(|&grey| {
        sum += counts[grey];
        sum > skip
    });
    reached.unwrap_or(0) as f64
}
