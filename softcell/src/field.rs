//! A displacement everywhere from displacements at the markers, and lines of equal displacement (figure 5.9).
//!
//! Radial basis functions with a linear polynomial: `d(r) = sum_i w_i phi(|r - r_i|) + c_0 + c_1 u + c_2 v`. Markers that all move
//! alike are reproduced exactly, everywhere.

use nalgebra::{DMatrix, Dyn, LU};

/// Why there is no field.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// Too few markers.
    #[error("{got} markers; expected {expected} or more")]
    TooFew {
        /// Least number.
        expected: usize,
        /// Markers that came.
        got: usize,
    },
    /// As many values are needed as markers.
    #[error("{got} values for {expected} markers")]
    Length {
        /// Markers.
        expected: usize,
        /// Values.
        got: usize,
    },
    /// A number is none.
    #[error("marker {marker} has a place or a value that is no number")]
    NotFinite {
        /// Its index.
        marker: usize,
    },
    /// Two markers have one place, or all lie on a line.
    #[error("the markers' places do not determine a field: two coincide, or all lie on a line")]
    Degenerate,
    /// A kernel's width or a smoothing that is none.
    #[error("{what} is {got}; expected {expected}")]
    Setting {
        /// Which.
        what: &'static str,
        /// What it has to be.
        expected: &'static str,
        /// What it is.
        got: f64,
    },
    /// A lattice without room.
    #[error("a lattice of {columns} x {rows} points; expected 2 or more either way")]
    Lattice {
        /// Points along u.
        columns: usize,
        /// Points along v.
        rows: usize,
    },
}

/// Shape of the basis functions, r in units of the markers' places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kernel {
    /// `r^2 ln r`: the least bent field, without a width to choose.
    ThinPlate,
    /// `sqrt(1 + (r/width)^2)`: the default of SciPy and of [Matl 2021].
    Multiquadric {
        /// Width, above 0.
        width: f64,
    },
    /// `exp(-(r/width)^2 / 2)`.
    Gaussian {
        /// Width, above 0.
        width: f64,
    },
}

impl Kernel {
    fn at(&self, square: f64) -> f64 {
        match *self {
            Self::ThinPlate => {
                if square > 0.0 {
                    0.5 * square * square.ln()
                } else {
                    0.0
                }
            }
            Self::Multiquadric { width } => (1.0 + square / (width * width)).sqrt(),
            Self::Gaussian { width } => (-0.5 * square / (width * width)).exp(),
        }
    }

    /// Sign with which smoothing is added so that it smooths: that of the kernel on weights that sum to zero.
    fn sign(&self) -> f64 {
        if matches!(self, Self::Multiquadric { .. }) { -1.0 } else { 1.0 }
    }
}

/// Places with a solved system: values at them become a field. Plan once for a set of homes, use for each picture.
#[derive(Debug, Clone)]
pub struct Plan {
    kernel: Kernel,
    places: Vec<[f64; 2]>,
    middle: [f64; 2],
    scale: f64,
    solver: LU<f64, Dyn, Dyn>,
}

/// One component of displacement, anywhere.
#[derive(Debug, Clone)]
pub struct Field<'a> {
    plan: &'a Plan,
    weights: Vec<f64>,
}

impl Plan {
    /// Plans for markers at places (three or more, not on a line). `smoothing` is 0 for a field through all values; above it, weights
    /// shrink as in ridge regression.
    ///
    /// # Errors
    /// [`FieldError`].
    pub fn new(places: &[[f64; 2]], kernel: Kernel, smoothing: f64) -> Result<Self, FieldError> {
        let n = places.len();
        if n < 3 {
            return Err(FieldError::TooFew { expected: 3, got: n });
        }
        if let Some(marker) = places.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(FieldError::NotFinite { marker });
        }
        if !(smoothing >= 0.0 && smoothing.is_finite()) {
            return Err(FieldError::Setting { what: "the smoothing", expected: "0 or more", got: smoothing });
        }
        let mean = |k: usize| places.iter().map(|p| p[k]).sum::<f64>() / n as f64;
        let middle = [mean(0), mean(1)];
        let scale = places.iter().map(|p| (p[0] - middle[0]).hypot(p[1] - middle[1])).fold(0.0, f64::max);
        if !(scale > 0.0) {
            return Err(FieldError::Degenerate);
        }
        // Lengths over the markers' extent: the system's condition does not depend on the unit.
        let kernel = match kernel {
            Kernel::ThinPlate => kernel,
            Kernel::Multiquadric { width } | Kernel::Gaussian { width }
                if !(width > 0.0 && width.is_finite()) =>
            {
                return Err(FieldError::Setting {
                    what: "the kernel's width",
                    expected: "above 0",
                    got: width,
                });
            }
            Kernel::Multiquadric { width } => Kernel::Multiquadric { width: width / scale },
            Kernel::Gaussian { width } => Kernel::Gaussian { width: width / scale },
        };
        let scaled: Vec<[f64; 2]> =
            places.iter().map(|p| [(p[0] - middle[0]) / scale, (p[1] - middle[1]) / scale]).collect();
        let entry = |i: usize, k: usize| match (i < n, k < n) {
            (true, true) if i == k => kernel.at(0.0) + kernel.sign() * smoothing,
            (true, true) => kernel.at(square(scaled[i], scaled[k])),
            (true, false) => polynomial(scaled[i])[k - n],
            (false, true) => polynomial(scaled[k])[i - n],
            (false, false) => 0.0,
        };
        let solver = DMatrix::from_fn(n + 3, n + 3, entry).lu();
        let diagonal = solver.u().diagonal();
        if !(diagonal.amin() > 1e-11 * diagonal.amax()) {
            return Err(FieldError::Degenerate);
        }
        Ok(Self { kernel, places: scaled, middle, scale, solver })
    }

    /// The field of one value a marker, in the order of the places.
    ///
    /// # Errors
    /// [`FieldError::Length`], [`FieldError::NotFinite`].
    pub fn field(&self, values: &[f64]) -> Result<Field<'_>, FieldError> {
        let n = self.places.len();
        if values.len() != n {
            return Err(FieldError::Length { expected: n, got: values.len() });
        }
        if let Some(marker) = values.iter().position(|v| !v.is_finite()) {
            return Err(FieldError::NotFinite { marker });
        }
        let right = nalgebra::DVector::from_fn(n + 3, |i, _| values.get(i).copied().unwrap_or(0.0));
        let weights = self.solver.solve(&right).ok_or(FieldError::Degenerate)?;
        Ok(Field { plan: self, weights: weights.as_slice().to_vec() })
    }
}

impl Field<'_> {
    /// The value at a place.
    pub fn at(&self, place: [f64; 2]) -> f64 {
        let plan = self.plan;
        let p = [(place[0] - plan.middle[0]) / plan.scale, (place[1] - plan.middle[1]) / plan.scale];
        let (bumps, tail) = self.weights.split_at(plan.places.len());
        let bent: f64 = bumps.iter().zip(&plan.places).map(|(w, q)| w * plan.kernel.at(square(p, *q))).sum();
        bent + tail.iter().zip(polynomial(p)).map(|(w, x)| w * x).sum::<f64>()
    }

    /// Values on a lattice from `low` to `high` (u, v), both included, rows of constant v, and the lines of equal value on it.
    ///
    /// # Errors
    /// [`FieldError::Lattice`].
    pub fn contours(
        &self,
        low: [f64; 2],
        high: [f64; 2],
        (columns, rows): (usize, usize),
        levels: &[f64],
    ) -> Result<Vec<Contour>, FieldError> {
        if columns < 2 || rows < 2 {
            return Err(FieldError::Lattice { columns, rows });
        }
        let u = |k: usize| low[0] + (high[0] - low[0]) * k as f64 / (columns - 1) as f64;
        let v = |k: usize| low[1] + (high[1] - low[1]) * k as f64 / (rows - 1) as f64;
        let values: Vec<f64> =
            (0..rows * columns).map(|i| self.at([u(i % columns), v(i / columns)])).collect();
        let lattice = Lattice { columns, rows, values: &values };
        let place = |[x, y]: [f64; 2]| {
            let step = [(high[0] - low[0]) / (columns - 1) as f64, (high[1] - low[1]) / (rows - 1) as f64];
            [low[0] + x * step[0], low[1] + y * step[1]]
        };
        let contour = |&level: &f64| {
            let lines = join(lattice.segments(level));
            let lines = lines.into_iter().map(|l| l.into_iter().map(place).collect()).collect();
            Contour { level, lines }
        };
        Ok(levels.iter().map(contour).collect())
    }
}

/// Lines on which a field has one value.
#[derive(Debug, Clone, PartialEq)]
pub struct Contour {
    /// The value.
    pub level: f64,
    /// Its lines; a closed one ends where it begins.
    pub lines: Vec<Vec<[f64; 2]>>,
}

fn square(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)
}

fn polynomial(p: [f64; 2]) -> [f64; 3] {
    [1.0, p[0], p[1]]
}

struct Lattice<'a> {
    columns: usize,
    rows: usize,
    values: &'a [f64],
}

/// Where a line crosses the edge between two neighbouring points of the lattice, the lower index first.
type Edge = (usize, usize);

impl Lattice<'_> {
    /// Pieces of the line, each between two edges of one triangle: every square is cut along its diagonal, so no case is ambiguous.
    fn segments(&self, level: f64) -> Vec<[(Edge, [f64; 2]); 2]> {
        let mut out = Vec::new();
        for row in 0..self.rows - 1 {
            for column in 0..self.columns - 1 {
                let a = row * self.columns + column;
                let (b, c, d) = (a + 1, a + self.columns, a + self.columns + 1);
                for corners in [[a, b, d], [a, d, c]] {
                    let pairs = [(0, 1), (1, 2), (0, 2)];
                    let crossings: Vec<_> = pairs
                        .iter()
                        .filter_map(|&(i, k)| self.crossing(corners[i], corners[k], level))
                        .collect();
                    if let [first, second] = crossings[..] {
                        out.push([first, second]);
                    }
                }
            }
        }
        out
    }

    fn crossing(&self, i: usize, k: usize, level: f64) -> Option<(Edge, [f64; 2])> {
        let (i, k) = (i.min(k), i.max(k));
        let (a, b) = (self.values[i], self.values[k]);
        // A point on the level counts as above, so that a line never ends in one.
        if (a >= level) == (b >= level) {
            return None;
        }
        let s = (level - a) / (b - a);
        let at = |n: usize| [(n % self.columns) as f64, (n / self.columns) as f64];
        let (p, q) = (at(i), at(k));
        Some(((i, k), [p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1])]))
    }
}

/// Puts pieces that share an edge together.
fn join(segments: Vec<[(Edge, [f64; 2]); 2]>) -> Vec<Vec<[f64; 2]>> {
    use std::collections::BTreeMap;
    let mut at: BTreeMap<Edge, Vec<usize>> = BTreeMap::new();
    for (i, s) in segments.iter().enumerate() {
        s.iter().for_each(|(edge, _)| at.entry(*edge).or_default().push(i));
    }
    let mut used = vec![false; segments.len()];
    let mut lines = Vec::new();
    // Open lines first, from their ends; what is left is closed.
    let ends = at.values().filter(|v| v.len() == 1).map(|v| v[0]);
    let order: Vec<usize> = ends.chain(0..segments.len()).collect();
    for start in order {
        if used[start] {
            continue;
        }
        let [first, second] = segments[start];
        let (mut from, mut to) = (first, second);
        if at.get(&to.0).is_some_and(|v| v.len() == 1) {
            (from, to) = (second, first);
        }
        used[start] = true;
        let mut line = vec![from.1, to.1];
        while let Some(next) = at.get(&to.0).and_then(|v| v.iter().copied().find(|&i| !used[i])) {
            used[next] = true;
            let [a, b] = segments[next];
            to = if a.0 == to.0 { b } else { a };
            line.push(to.1);
        }
        lines.push(line);
    }
    lines
}
