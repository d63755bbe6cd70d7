//! Shaping a cookie: when to stop rolling, and how round it is (section 6.6).

use hw_traits::arm::{Arm, Pose};
use hw_traits::{Error, ErrorKind};

/// Why there is no answer.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// Too few heights to judge by, or no threshold.
    #[error(
        "a window of {window} heights and a spread of {spread_m} m; expected 3 or more, and a finite spread above 0"
    )]
    Settings {
        /// Heights.
        window: usize,
        /// Spread.
        spread_m: f64,
    },
    /// A picture of labels that is none.
    #[error("{pixels} pixels do not make rows of {width}")]
    NotRows {
        /// Pixels that came.
        pixels: usize,
        /// Columns.
        width: usize,
    },
    /// Nothing to measure.
    #[error("{pixels} pixels of the object; expected {expected} or more")]
    TooSmall {
        /// Pixels of it.
        pixels: usize,
        /// Least number.
        expected: usize,
    },
    /// The object is cut off.
    #[error("the object reaches the picture's border")]
    CutOff,
}

/// Watches the height while dough is rolled: done when the last heights' standard deviation is below a threshold.
#[derive(Debug, Clone)]
pub struct Settling {
    heights: Vec<f64>,
    next: usize,
    window: usize,
    spread_m: f64,
}

impl Settling {
    /// The rule of [Matl 2021]: ten heights at 1 Hz, 1 mm.
    pub fn matl_2021() -> Self {
        Self { heights: Vec::new(), next: 0, window: 10, spread_m: 1e-3 }
    }

    /// Another window and spread.
    ///
    /// # Errors
    /// [`ShapeError::Settings`].
    pub fn new(window: usize, spread_m: f64) -> Result<Self, ShapeError> {
        if window >= 3 && spread_m > 0.0 && spread_m.is_finite() {
            return Ok(Self { window, spread_m, ..Self::matl_2021() });
        }
        Err(ShapeError::Settings { window, spread_m })
    }

    /// Takes in a height (m); whether it has settled. A height that is no number is passed over.
    pub fn push(&mut self, height_m: f64) -> bool {
        if height_m.is_finite() {
            if self.heights.len() < self.window {
                self.heights.push(height_m);
            } else {
                self.heights[self.next] = height_m;
            }
            self.next = (self.next + 1) % self.window;
        }
        self.heights.len() == self.window && self.spread() < self.spread_m
    }

    fn spread(&self) -> f64 {
        let n = self.heights.len() as f64;
        let mean = self.heights.iter().sum::<f64>() / n;
        (self.heights.iter().map(|h| (h - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
    }
}

/// Circles that are rolled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rolling {
    /// The tool over the middle of the dough, pressed in as deep as wanted.
    pub middle: Pose,
    /// Radius of the circles, m.
    pub circle_m: f64,
    /// Moves a circle, 3 or more.
    pub moves: usize,
    /// Time for each move, s.
    pub move_s: f64,
    /// Circles after which rolling ends in any case.
    pub most: usize,
}

/// How rolling ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Rolled {
    /// Height after each circle, m.
    pub heights_m: Vec<f64>,
    /// Whether it settled, or the circles were used up.
    pub settled: bool,
}

/// Why rolling stopped.
#[derive(Debug, thiserror::Error)]
pub enum RollError<E: std::fmt::Debug> {
    /// A device failed.
    #[error("{1}: {0:?}")]
    Device(E, ErrorKind),
    /// A setting out of range.
    #[error("{what} is {got}; expected {expected}")]
    Setting {
        /// Which.
        what: &'static str,
        /// What it has to be.
        expected: &'static str,
        /// What it is.
        got: f64,
    },
}

/// Rolls in circles until the height settles. `height_m` looks at the dough, waits as long as it likes, and is asked once a circle; a
/// height that is no number counts as none.
///
/// # Errors
/// [`RollError`]; the tool stays where it was.
pub fn roll<R: Arm>(
    rig: &mut R,
    rolling: &Rolling,
    mut settling: Settling,
    mut height_m: impl FnMut(&mut R) -> Result<f64, R::Error>,
) -> Result<Rolled, RollError<R::Error>> {
    let Rolling { moves, move_s, .. } = *rolling;
    for (what, expected, got, least) in [
        ("the circle's radius", "a finite number above 0", rolling.circle_m, f64::MIN_POSITIVE),
        ("the time for a move", "a finite number above 0", move_s, f64::MIN_POSITIVE),
        ("the number of moves", "3 or more", moves as f64, 3.0),
    ] {
        if !(got >= least && got.is_finite()) {
            return Err(RollError::Setting { what, expected, got });
        }
    }
    let device = |e: R::Error| {
        let kind = e.kind();
        RollError::Device(e, kind)
    };
    let mut heights_m = Vec::new();
    for _ in 0..rolling.most {
        for k in 0..moves {
            let around = std::f64::consts::TAU * k as f64 / moves as f64;
            let mut pose = rolling.middle;
            pose.position_m[0] += rolling.circle_m * around.cos();
            pose.position_m[1] += rolling.circle_m * around.sin();
            rig.move_to(pose, move_s).map_err(device)?;
        }
        let height = height_m(rig).map_err(device)?;
        heights_m.push(height);
        if settling.push(height) {
            return Ok(Rolled { heights_m, settled: true });
        }
    }
    Ok(Rolled { heights_m, settled: false })
}

/// Circularity `4 pi area / perimeter^2` of an object in a picture of labels: 1 for a disc, pi/4 for a square.
///
/// The perimeter is that of the line at one half in the picture averaged over 3 x 3 pixels twice: following pixels' edges would
/// give a disc that of its square. Corners lose a pixel or so. Pixels are square.
///
/// # Errors
/// [`ShapeError`].
pub fn circularity(inside: &[bool], width: usize) -> Result<f64, ShapeError> {
    if width == 0 || !inside.len().is_multiple_of(width) {
        return Err(ShapeError::NotRows { pixels: inside.len(), width });
    }
    let height = inside.len() / width;
    let area = inside.iter().filter(|i| **i).count();
    if area < 100 {
        return Err(ShapeError::TooSmall { pixels: area, expected: 100 });
    }
    let edge = |i: usize| {
        i < width || i >= width * (height - 1) || i.is_multiple_of(width) || (i + 1).is_multiple_of(width)
    };
    if inside.iter().enumerate().any(|(i, x)| *x && edge(i)) {
        return Err(ShapeError::CutOff);
    }
    let flat: Vec<f64> = inside.iter().map(|i| f64::from(u8::from(*i))).collect();
    let smooth = blurred(&blurred(&flat, width), width);
    let mut perimeter = 0.0;
    for row in 0..height - 1 {
        for column in 0..width - 1 {
            let i = row * width + column;
            let corners =
                [([0.0, 0.0], i), ([1.0, 0.0], i + 1), ([1.0, 1.0], i + width + 1), ([0.0, 1.0], i + width)];
            let corner = |k: usize| (corners[k].0, smooth[corners[k].1]);
            perimeter +=
                within([corner(0), corner(1), corner(2)]) + within([corner(0), corner(2), corner(3)]);
        }
    }
    Ok(4.0 * std::f64::consts::PI * area as f64 / (perimeter * perimeter))
}

/// Means over 3 x 3 pixels; zero at the border.
fn blurred(values: &[f64], width: usize) -> Vec<f64> {
    let height = values.len() / width;
    let mut out = vec![0.0; values.len()];
    for row in 1..height.saturating_sub(1) {
        for column in 1..width - 1 {
            let line = |r: usize| values[r * width + column - 1..=r * width + column + 1].iter().sum::<f64>();
            out[row * width + column] = (line(row - 1) + line(row) + line(row + 1)) / 9.0;
        }
    }
    out
}

/// Length of the line at one half within a triangle of places and values.
fn within(corners: [([f64; 2], f64); 3]) -> f64 {
    let crossing = |a: usize, b: usize| {
        let ((p, x), (q, y)) = (corners[a], corners[b]);
        ((x >= 0.5) != (y >= 0.5)).then(|| {
            let s = (0.5 - x) / (y - x);
            [p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1])]
        })
    };
    match [crossing(0, 1), crossing(1, 2), crossing(0, 2)] {
        [Some(p), Some(q), None] | [Some(p), None, Some(q)] | [None, Some(p), Some(q)] => {
            (p[0] - q[0]).hypot(p[1] - q[1])
        }
        _ => 0.0,
    }
}
