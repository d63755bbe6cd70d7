//! The shapes of noise among which the data choose: a few far apart, tried one by one, and lattices between them on which the
//! best of these is followed uphill.
//!
//! The few alone are not enough: an autoregression of 0.5 whitened as one of 0.6 leaves neighbours correlated by 0.1, which a
//! thousand rows show.

use std::sync::LazyLock;

use crate::noise::process::Shape;

/// Correlations of neighbours in noise that is an autoregression of one row.
const PHIS: [f64; 8] = [0.2, 0.4, 0.6, 0.75, 0.86, 0.93, 0.97, 0.99];

/// Steps of the lattices at which a climb looks around, from far to near.
const STRIDES: [usize; 4] = [8, 4, 2, 1];

/// The shapes by number: the few first (white the very first), then the lattices.
#[derive(Debug)]
pub(crate) struct Family {
    shapes: Vec<Shape>,
    few: usize,
    lattices: Vec<Lattice>,
}

/// Shapes of one kind, by share and then by length.
#[derive(Debug, Clone, Copy)]
struct Lattice {
    first: usize,
    shares: Axis,
    lengths: Axis,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// An autoregression along the noise variable.
    Rough,
    /// An autoregression from row to row.
    ByRow,
    /// White noise and an autoregression.
    Mixed,
    /// White noise and a smooth part.
    Smooth,
    /// White noise and errors that accumulate as the model says.
    Accumulated,
}

/// Evenly spaced values.
#[derive(Debug, Clone, Copy)]
struct Axis {
    from: f64,
    step: f64,
    count: usize,
}

impl Axis {
    fn at(&self, i: usize) -> f64 {
        self.from + self.step * i as f64
    }

    fn nearest(&self, value: f64) -> usize {
        (((value - self.from) / self.step).round().max(0.0) as usize).min(self.count - 1)
    }

    /// The steps `stride` away from `i` that are on the axis.
    fn beside(&self, i: usize, stride: usize) -> impl Iterator<Item = usize> {
        let above = (i + stride < self.count).then_some(i + stride);
        i.checked_sub(stride).into_iter().chain(above)
    }
}

/// All of the variance.
const WHOLE: Axis = Axis { from: f64::INFINITY, step: 1.0, count: 1 };
/// Shares as log odds: 7 to 99 %.
const SHARES: Axis = Axis { from: -2.6, step: 0.1, count: 73 };
/// Correlations of neighbours by Fisher's z = atanh(phi), whose standard error is 1/sqrt(rows): 0.04 to 0.99.
const CORRELATIONS: Axis = Axis { from: 0.04, step: 0.02, count: 136 };
/// Correlations of neighbours beside white noise, by Fisher's z: 0.46 to 0.99.
const MIXED_CORRELATIONS: Axis = Axis { from: 0.5, step: 0.04, count: 57 };
/// Logarithms of smooth lengths: 2 to 30 steps.
const LENGTHS: Axis = Axis { from: 0.69, step: 0.05, count: 55 };

/// Logarithms of the size of accumulated errors in white sigmas: 0.03 to 400.
const SIZES: Axis = Axis { from: -3.5, step: 0.1, count: 96 };
/// Correlations of neighbouring steps of errors that accumulate: what remembers more than a step or two is no scatter, but differs from run
/// to run.
const MEMORIES: Axis = Axis { from: 0.0, step: 0.1, count: 7 };
/// Sizes of accumulated errors that are tried one by one.
const FEW_SIZES: [f64; 7] = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0];

impl Kind {
    fn of(shape: &Shape) -> Option<Self> {
        match shape {
            s if s.accumulated > 0.0 => Some(Self::Accumulated),
            s if s.correlated <= 0.0 => None,
            s if s.by_row => Some(Self::ByRow),
            s if s.smooth => Some(Self::Smooth),
            s if s.correlated < 1.0 => Some(Self::Mixed),
            _ => Some(Self::Rough),
        }
    }

    fn axes(self) -> [Axis; 2] {
        match self {
            Self::Rough | Self::ByRow => [WHOLE, CORRELATIONS],
            Self::Mixed => [SHARES, MIXED_CORRELATIONS],
            Self::Smooth => [SHARES, LENGTHS],
            Self::Accumulated => [MEMORIES, SIZES],
        }
    }

    /// The shape at a point of the axes: log odds of the correlated share, or the memory of errors that accumulate, and length, or their size.
    fn shape(self, share: f64, length: f64) -> Shape {
        if self == Self::Accumulated {
            return Shape { accumulated: length.exp(), memory: share, ..Shape::WHITE };
        }
        let smooth = self == Self::Smooth;
        let length_steps = if smooth { length.exp() } else { -1.0 / length.tanh().ln() };
        let correlated = if share.is_finite() { 1.0 / (1.0 + (-share).exp()) } else { 1.0 };
        Shape { correlated, length_steps, smooth, by_row: self == Self::ByRow, ..Shape::WHITE }
    }
}

impl Family {
    /// The family, made once.
    pub(crate) fn get() -> &'static Self {
        static FAMILY: LazyLock<Family> = LazyLock::new(Family::new);
        &FAMILY
    }

    fn new() -> Self {
        let mut shapes = few();
        let few = shapes.len();
        let lattices = [Kind::Rough, Kind::ByRow, Kind::Mixed, Kind::Smooth, Kind::Accumulated].map(|kind| {
            let [shares, lengths] = kind.axes();
            let first = shapes.len();
            for i in 0..shares.count {
                shapes.extend((0..lengths.count).map(|j| kind.shape(shares.at(i), lengths.at(j))));
            }
            Lattice { first, shares, lengths, kind }
        });
        Self { shapes, few, lattices: lattices.to_vec() }
    }

    /// How many shapes there are, those on the lattices included.
    pub(crate) fn len(&self) -> usize {
        self.shapes.len()
    }

    /// The numbers of the few that are tried one by one.
    pub(crate) fn few(&self) -> std::ops::Range<usize> {
        0..self.few
    }

    /// A shape by its number.
    pub(crate) fn shape(&self, number: usize) -> Shape {
        self.shapes[number]
    }

    /// Prior weights of shapes for somebody who prefers no kind of noise, and among those of a kind none.
    pub(crate) fn indifferent(&self, numbers: &[usize]) -> Vec<f64> {
        let kind = |n: usize| Kind::of(&self.shapes[n]);
        numbers
            .iter()
            .map(|&n| 1.0 / numbers.iter().filter(|&&other| kind(other) == kind(n)).count() as f64)
            .collect()
    }

    /// The lattice's points `stride` steps from a shape along each of its axes, the nearest point itself first; none of white noise.
    pub(crate) fn around(&self, number: usize, stride: usize) -> Vec<usize> {
        let shape = &self.shapes[number];
        let Some(lattice) = self.lattices.iter().find(|l| Some(l.kind) == Kind::of(shape)) else {
            return Vec::new();
        };
        let share = match lattice.kind {
            Kind::Accumulated => shape.memory,
            _ => (shape.correlated / (1.0 - shape.correlated)).ln(),
        };
        let i = if lattice.shares.count == 1 { 0 } else { lattice.shares.nearest(share) };
        let length = match lattice.kind {
            Kind::Accumulated => shape.accumulated.ln(),
            Kind::Smooth => shape.length_steps.ln(),
            _ => (-1.0 / shape.length_steps).exp().atanh(),
        };
        let j = lattice.lengths.nearest(length);
        let at = |i: usize, j: usize| lattice.first + i * lattice.lengths.count + j;
        std::iter::once(at(i, j))
            .chain(lattice.shares.beside(i, stride).map(|i| at(i, j)))
            .chain(lattice.lengths.beside(j, stride).map(|j| at(i, j)))
            .collect()
    }

    /// The strides of a climb, from far to near.
    pub(crate) fn strides(&self) -> [usize; 4] {
        STRIDES
    }

    /// Steps of a lattice's axis that are a standard error of a correlation found in so many rows; one at least.
    pub(crate) fn error_steps(&self, rows: usize) -> usize {
        (1.0 / ((rows.max(1) as f64).sqrt() * CORRELATIONS.step)).round().clamp(1.0, 8.0) as usize
    }

    /// Follows a score uphill from a shape, on its lattice and among those that are `admitted`; returns the best and its score.
    pub(crate) fn climb<S>(
        &self,
        start: (usize, S),
        admitted: impl Fn(&Shape) -> bool,
        score: impl Fn(usize) -> S,
        better: impl Fn(&S, &S) -> bool,
    ) -> (usize, S) {
        let mut best = start;
        let mut seen = vec![best.0];
        for stride in STRIDES {
            loop {
                let before = best.0;
                for number in self.around(before, stride) {
                    if seen.contains(&number) || !admitted(&self.shapes[number]) {
                        continue;
                    }
                    seen.push(number);
                    let value = score(number);
                    if better(&value, &best.1) {
                        best = (number, value);
                    }
                }
                if best.0 == before {
                    break;
                }
            }
        }
        best
    }
}

/// White first, those that go by row and those that accumulate last.
fn few() -> Vec<Shape> {
    let mut shapes = vec![Shape::WHITE];
    let rough =
        |phi: f64, correlated: f64| Shape { correlated, length_steps: -1.0 / phi.ln(), ..Shape::WHITE };
    shapes.extend(PHIS.map(|phi| rough(phi, 1.0)));
    for correlated in [0.15, 0.4, 0.7, 0.9, 0.98] {
        for phi in [0.75, 0.9, 0.97] {
            shapes.push(rough(phi, correlated));
        }
    }
    for correlated in [0.3, 0.7, 0.93, 0.99] {
        for length_steps in [3.0, 7.0, 18.0] {
            shapes.push(Shape { correlated, length_steps, smooth: true, ..Shape::WHITE });
        }
    }
    shapes.extend(PHIS.map(|phi| Shape { by_row: true, ..rough(phi, 1.0) }));
    shapes.extend(FEW_SIZES.map(|accumulated| Shape { accumulated, ..Shape::WHITE }));
    shapes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point's neighbours differ from it by a step of one axis, and are of its kind.
    #[test]
    fn neighbours_are_a_step_away() {
        let family = Family::get();
        assert!(family.around(0, 1).is_empty());
        for number in (1..family.few).chain((family.few..family.len()).step_by(97)) {
            let around = family.around(number, 1);
            let centre = family.shape(around[0]);
            let kind = Kind::of(&family.shape(number));
            assert!(around.len() >= 2, "{number}");
            for shape in around.iter().map(|&n| family.shape(n)) {
                assert_eq!(Kind::of(&shape), kind);
                let odds = |s: &Shape| (s.correlated / (1.0 - s.correlated).max(1e-12)).ln();
                let accumulates = shape.accumulated > 0.0;
                assert!(accumulates || (odds(&shape) - odds(&centre)).abs() < 0.11);
                assert!((shape.memory - centre.memory).abs() < 0.11);
                let size = |s: &Shape| if s.accumulated > 0.0 { s.accumulated } else { s.length_steps };
                assert!((size(&shape) / size(&centre)).ln().abs() < 0.5);
            }
            if number >= family.few {
                assert_eq!(around[0], number);
            }
        }
    }

    /// A climb ends at the lattice's best point for a score with one top, wherever it begins.
    #[test]
    fn a_climb_finds_the_top() {
        let family = Family::get();
        let top = [1.3, 0.8];
        let score = |n: usize| {
            let s = family.shape(n);
            let z = (-1.0 / s.length_steps).exp().atanh();
            -((s.correlated / (1.0 - s.correlated)).ln() - top[0]).powi(2) - 3.0 * (z - top[1]).powi(2)
        };
        let few: Vec<usize> =
            family.few().filter(|&n| Kind::of(&family.shape(n)) == Some(Kind::Mixed)).collect();
        assert_eq!(few.len(), 15);
        for start in few {
            let (found, value) = family.climb((start, score(start)), |_| true, score, |a, b| a > b);
            assert!(value > -0.1f64.powi(2), "{:?}", family.shape(found));
        }
    }
}
