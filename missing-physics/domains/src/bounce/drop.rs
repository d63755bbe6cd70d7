//! One drop as it was measured, and by how much each of its impacts is off what an effect expects.

use bounce_audio::impact::{Hop, Velocity, heading, reflected, speed, speed_after_drop};
use bounce_audio::missed::parts;
use nalgebra::DVector;

use super::effects::Effects;

/// How many numbers say by how much an impact is off: the logarithm of its speed's ratio, and two of its direction.
pub(super) const PER_IMPACT: usize = 3;

/// One of the values of a drop that are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Measured {
    /// When an impact was heard.
    Time(usize),
    /// Where, along an axis.
    Place(usize, usize),
    /// Where the ball first headed along an axis.
    Approach(usize),
}

/// How far off an impact may be, beside a typical one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Relative {
    /// Error of its time over that of a typical one.
    pub(super) time: f64,
    /// Error of its place over that of a typical one: the lower triangular root of the covariance.
    pub(super) place: [[f64; 2]; 2],
}

impl Relative {
    pub(super) const TYPICAL: Self = Self { time: 1.0, place: [[1.0, 0.0], [0.0, 1.0]] };
}

/// A drop: when and where the ball was heard.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Drop {
    pub(super) times_s: Vec<f64>,
    /// Places on the table; empty where only times were measured.
    pub(super) places_m: Vec<[f64; 2]>,
    /// Height from which it fell to the first impact that was heard, where it is known.
    pub(super) height_m: Option<f64>,
    /// Logarithm of each impact's loudness; empty where it was not heard.
    pub(super) loudness: Vec<f64>,
    /// How far off each impact may be; empty where all are alike.
    pub(super) relative: Vec<Relative>,
    /// Where the ball headed, seen from above, when it first came to the table (or left it, where its fall is not known),
    /// beyond what balls do on average that land where it did.
    pub(super) approach: [f64; 2],
    /// Where balls land on average.
    pub(super) middle_m: [f64; 2],
    /// When each microphone heard each impact, s; empty where there are fewer than four.
    pub(super) arrivals_s: Vec<Vec<f64>>,
    /// How many impacts went unheard before the first one heard (only with a known height) and within each flight.
    pub(super) unheard: Vec<usize>,
    /// How many of the unheard impacts are known because the file's numbers jump.
    pub(super) known: Vec<usize>,
}

impl Drop {
    /// Index of the first impact about which something is known: the first, if the height from which it fell is.
    pub(super) fn first(&self) -> usize {
        usize::from(self.height_m.is_none())
    }

    /// Number of impacts about which something is known.
    pub(super) fn impacts(&self) -> usize {
        (self.times_s.len() - 1).saturating_sub(self.first())
    }

    /// Number of errors: three an impact, and before them where a ball headed first whose fall is not known.
    pub(super) fn errors_len(&self) -> usize {
        self.lead() + PER_IMPACT * self.impacts()
    }

    fn lead(&self) -> usize {
        if self.height_m.is_some() { 0 } else { 2 }
    }

    /// Number of errors that are not of speeds; they come first.
    ///
    /// Errors are taken apart in their order. Speeds are known far better than directions: what is wrong with them must not
    /// show in the directions.
    pub(super) fn directions(&self) -> usize {
        self.lead() + (PER_IMPACT - 1) * self.impacts()
    }

    /// Where the error of an impact in a channel stands (0: of its speed; 1 and 2: of its direction).
    pub(super) fn row(&self, impact: usize, channel: usize) -> usize {
        match channel {
            0 => self.directions() + impact,
            _ => self.lead() + 2 * impact + channel - 1,
        }
    }

    /// Number of measured values: the times, the places' x and y in turn, and where the ball first headed, which is
    /// measured to be straight down.
    pub(super) fn measured(&self) -> usize {
        self.times_s.len() + 2 * self.places_m.len() + 2
    }

    /// What the measured value at an index is.
    pub(super) fn quantity(&self, index: usize) -> Measured {
        let (times, places) = (self.times_s.len(), 2 * self.places_m.len());
        match index {
            i if i < times => Measured::Time(i),
            i if i < times + places => Measured::Place((i - times) / 2, (i - times) % 2),
            i => Measured::Approach(i - times - places),
        }
    }

    /// The measured values.
    pub(super) fn values(&self) -> DVector<f64> {
        DVector::from_fn(self.measured(), |i, _| match self.quantity(i) {
            Measured::Time(k) => self.times_s[k],
            Measured::Place(k, axis) => self.places_m[k][axis],
            Measured::Approach(axis) => self.approach[axis],
        })
    }

    /// Changes a measured value.
    pub(super) fn nudge(&mut self, index: usize, by: f64) {
        match self.quantity(index) {
            Measured::Time(k) => self.times_s[k] += by,
            Measured::Place(k, axis) => self.places_m[k][axis] += by,
            Measured::Approach(axis) => self.approach[axis] += by,
        }
    }

    /// The drop with its places on the straight line nearest to them, along which each flight gets as far as the square of
    /// its duration: restitution shortens the speed along the table and that across it alike.
    pub(super) fn straight(&self) -> Self {
        let far: Vec<f64> = std::iter::once(0.0)
            .chain(self.times_s.windows(2).scan(0.0, |far, w| {
                *far += (w[1] - w[0]).powi(2);
                Some(*far)
            }))
            .collect();
        let n = self.places_m.len().max(1) as f64;
        let middle = far.iter().sum::<f64>() / n;
        let square: f64 = far.iter().map(|s| (s - middle).powi(2)).sum();
        let mut drop = self.clone();
        for axis in 0..2 {
            let mean = self.places_m.iter().map(|p| p[axis]).sum::<f64>() / n;
            let along = |(s, p): (&f64, &[f64; 2])| (s - middle) * (p[axis] - mean);
            let slope = far.iter().zip(&self.places_m).map(along).sum::<f64>() / square;
            if slope.is_finite() {
                let line = drop.places_m.iter_mut().zip(&far);
                line.for_each(|(p, s)| p[axis] = mean + slope * (s - middle));
            }
        }
        drop
    }

    fn place(&self, impact: usize) -> [f64; 2] {
        self.places_m.get(impact).copied().unwrap_or_default()
    }

    /// How far off an impact may be.
    pub(super) fn relative(&self, impact: usize) -> Relative {
        self.relative.get(impact).copied().unwrap_or(Relative::TYPICAL)
    }

    /// Where the ball headed, seen from above, when it first came to the table (or left it, where its fall is not known).
    pub(super) fn comes(&self, effects: &Effects) -> [f64; 2] {
        let place = self.place(0);
        [0, 1].map(|k| {
            self.approach[k] + effects.heads[k] + effects.outwards_per_m * (place[k] - self.middle_m[k])
        })
    }

    /// The flight from one impact to the next as the effects see it, or the part of it beside an unheard impact.
    fn flight(&self, index: usize, effects: &Effects, unheard: usize, part: Part) -> (Velocity, Velocity) {
        let louder = match (self.loudness.get(index), self.loudness.get(index + 1)) {
            (Some(then), Some(now)) => now - then,
            _ => 0.0,
        };
        let heard = self.times_s[index + 1] - self.times_s[index] - effects.walk_s * louder;
        let whole = heard / (1.0 + effects.clock_rate);
        let duration_s = match (unheard, part) {
            (0, _) => whole,
            (m, Part::First) => parts(whole, m, effects.restitution).0,
            (m, Part::Last) => parts(whole, m, effects.restitution).1,
        };
        let share = duration_s / (whole * (1.0 + effects.position_scale));
        let (from, to) = (self.place(index), self.place(index + 1));
        let [dx, dy] = [(to[0] - from[0]) * share, (to[1] - from[1]) * share];
        let halfway = [0, 1].map(|k| 0.5 * (from[k] + to[k]) - self.middle_m[k]);
        let [slope_x, slope_y] = effects.table_at(halfway);
        let rise = slope_x * dx + slope_y * dy;
        Hop { displacement_m: [dx, dy, rise], duration_s }
            .velocities(effects.gravity_m_s2, effects.drag_per_m)
    }

    /// By how much each impact is off, in the order of [`Drop::row`]; all unheard impacts before the first impact (0) or in a flight (its
    /// number and 1) count where `split` says so, and the known ones elsewhere.
    fn fill(&self, effects: &Effects, split: impl Fn(usize) -> bool, out: &mut [f64]) {
        let hidden = |place: usize| {
            let (found, known) = (self.unheard.get(place), self.known.get(place));
            (if split(place) { found } else { known }).copied().unwrap_or(0)
        };
        // Times and places in wrong units change every angle alike, the noise of the directions too: no likelier for that.
        let angles = (1.0 + effects.position_scale)
            * (1.0 + effects.heard_scale)
            * (1.0 + effects.clock_rate).powi(-2);
        let mut before: Option<Velocity> = self.height_m.map(|height| {
            let speed = speed_after_drop(height, effects.gravity_m_s2, effects.drag_per_m);
            let speed = speed * effects.restitution.powi(hidden(0) as i32);
            let [x, y] = self.comes(effects);
            [speed * x / angles, speed * y / angles, -speed]
        });
        let mut at = 0;
        for impact in 0..self.times_s.len() - 1 {
            let m = hidden(impact + 1);
            let (after, mut landing) = self.flight(impact, effects, m, Part::First);
            if m > 0 {
                landing = self.flight(impact, effects, m, Part::Last).1;
            }
            if let Some(before) = before {
                let place = self.place(impact);
                let from_middle = [0, 1].map(|k| place[k] - self.middle_m[k]);
                let expected = reflected(&before, effects.table_at(from_middle), effects.friction);
                let ratio =
                    (speed(&after).max(f64::MIN_POSITIVE) / speed(&expected).max(f64::MIN_POSITIVE)).ln();
                let restitution = effects.log_restitution(place, speed(&before));
                let (now, then) = (heading(&after), heading(&expected));
                let values = [ratio - restitution, angles * (now[0] - then[0]), angles * (now[1] - then[1])];
                values.iter().enumerate().for_each(|(c, v)| out[self.row(at, c)] = *v);
                at += 1;
            } else if self.lead() > 0 {
                let (now, came) = (heading(&after), self.comes(effects));
                (0..2).for_each(|k| out[k] = angles * now[k] - came[k]);
            }
            before = Some(landing);
        }
    }

    /// By how much each impact is off, in the order of [`Drop::row`].
    pub(super) fn errors(&self, effects: &Effects, out: &mut [f64]) {
        let split = effects.unheard;
        if self.unheard == self.known || split == 1.0 {
            return self.fill(effects, |_| true, out);
        }
        self.fill(effects, |_| false, out);
        if split != 0.0 {
            let mut apart = vec![0.0; out.len()];
            self.fill(effects, |_| true, &mut apart);
            out.iter_mut().zip(&apart).for_each(|(o, a)| *o += split * (a - *o));
        }
    }

    /// By how much the impacts are off the less where the unheard impacts of one place (0: before the first impact; else in the flight of
    /// that number less 1) count as such, and those of no other; `None` where all that are there are known.
    pub(super) fn unheard_at(&self, place: usize, effects: &Effects) -> Option<DVector<f64>> {
        if self.unheard.get(place) == self.known.get(place) {
            return None;
        }
        let of = |split: bool| {
            let mut out = DVector::zeros(self.errors_len());
            self.fill(effects, |p| split && p == place, out.as_mut_slice());
            out
        };
        Some(of(false) - of(true))
    }

    /// How many impacts went unheard within a flight.
    fn hidden(&self, flight: usize) -> usize {
        self.unheard.get(flight + 1).copied().unwrap_or(0)
    }

    /// How many impacts went unheard after an impact, as far as the effects take that for what it is.
    pub(super) fn between(&self, impact: usize, effects: &Effects) -> usize {
        let (found, known) = (&self.unheard, &self.known);
        let counted = if effects.unheard > 0.5 { found } else { known };
        counted.get(impact + 1).copied().unwrap_or(0)
    }

    /// Velocity at which the ball lands after a flight.
    pub(super) fn lands(&self, flight: usize, effects: &Effects) -> Velocity {
        self.flight(flight, effects, self.between(flight, effects), Part::Last).1
    }

    /// Speed at which the ball leaves the first impact, m/s.
    pub(super) fn leaves_m_s(&self, effects: &Effects) -> f64 {
        speed(&self.flight(0, effects, self.hidden(0), Part::First).0)
    }

    /// Where the ball heads after an impact.
    pub(super) fn heading(&self, impact: usize, effects: &Effects) -> [f64; 2] {
        heading(&self.flight(impact, effects, self.hidden(impact), Part::First).0)
    }

    /// Where the ball heads after each of the impacts about which something is known.
    pub(super) fn headings(&self, effects: &Effects) -> Vec<[f64; 2]> {
        (self.first()..self.times_s.len() - 1).map(|i| self.heading(i, effects)).collect()
    }

    /// Speed at which the ball comes to each impact, or leaves the first where its fall is not known, m/s.
    pub(super) fn speeds(&self, effects: &Effects) -> Vec<f64> {
        let landing = (0..self.times_s.len() - 1)
            .map(|i| speed(&self.flight(i, effects, self.hidden(i), Part::Last).1));
        let first = self.height_m.map_or_else(
            || self.leaves_m_s(effects),
            |h| {
                let hidden = self.unheard.first().copied().unwrap_or(0);
                speed_after_drop(h, effects.gravity_m_s2, 0.0) * effects.restitution.powi(hidden as i32)
            },
        );
        std::iter::once(first).chain(landing).collect()
    }
}

#[derive(Debug, Clone, Copy)]
enum Part {
    First,
    Last,
}
