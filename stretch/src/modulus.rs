//! The half-space that the membrane resembles: E*(x), E*(R, x) (sections 6.4 and 6.5).
//!
//! At each stretch x the modulus falls with the contact's diameter, `E = a + b exp(-D/c)`; for one diameter it grows with the
//! stretch, `E = p + q ln(1 + x/x_0)`. Forces are eqs 6.2 to 6.4, corrected, nu = 1/2.

use hertz_contact::calibrated::{Beyond, Calibrated, distinct};
use hertz_contact::indenter::Indenter;
use nalgebra::{Matrix2, Vector2};

/// Poisson's ratio of rubber.
pub const POISSON_RATIO: f64 = 0.5;

/// Why there is no modulus.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ModulusError {
    /// A number out of range.
    #[error("press {press}: {what} is {got}; expected a finite number, {least} or more")]
    Value {
        /// Index of the press.
        press: usize,
        /// Which column.
        what: &'static str,
        /// Its value.
        got: f64,
        /// Least value.
        least: f64,
    },
    /// Too few different states.
    #[error("{got} different {what}; expected {expected} or more")]
    TooFew {
        /// Of what.
        what: &'static str,
        /// Least number.
        expected: usize,
        /// Different ones.
        got: usize,
    },
    /// A state in which nothing was pressed in, or nothing was felt.
    #[error("presses with radius {radius_m} m at stretch {stretch_m} m have no positive modulus")]
    NoForce {
        /// Radius, m.
        radius_m: f64,
        /// Stretch, m.
        stretch_m: f64,
    },
    /// A question beyond what was calibrated.
    #[error(transparent)]
    Beyond(#[from] Beyond),
}

/// A press of a rigid ball whose force was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Press {
    /// Stretch of the membrane, m, 0 or more.
    pub stretch_m: f64,
    /// Radius of the ball, m, above 0.
    pub radius_m: f64,
    /// Indentation, m, 0 or more.
    pub indentation_m: f64,
    /// Force, N.
    pub force_n: f64,
}

/// The force over E for a ball: `4/3 sqrt(R) delta^(3/2)/(1 - nu^2)`.
pub(crate) fn per_modulus(radius_m: f64, indentation_m: f64) -> f64 {
    let ball = Indenter::Sphere { radius_m };
    ball.factor() / (1.0 - POISSON_RATIO.powi(2)) * indentation_m.max(0.0).powf(ball.exponent())
}

/// Modulus E in Pa of presses by one indenter at one stretch: least squares through the origin, and its standard error.
///
/// # Errors
/// [`ModulusError::TooFew`] (two presses), [`ModulusError::Value`].
pub fn effective_pa(indenter: &Indenter, presses: &[(f64, f64)]) -> Result<(f64, f64), ModulusError> {
    for (press, &(depth, force)) in presses.iter().enumerate() {
        for (what, got, least) in [("the indentation", depth, 0.0), ("the force", force, f64::MIN)] {
            if !(got.is_finite() && got >= least) {
                return Err(ModulusError::Value { press, what, got, least });
            }
        }
    }
    let factor = indenter.factor() / (1.0 - POISSON_RATIO.powi(2));
    let basis = |depth: f64| factor * depth.powf(indenter.exponent());
    let square: f64 = presses.iter().map(|p| basis(p.0).powi(2)).sum();
    if presses.len() < 2 || !(square > 0.0) {
        return Err(ModulusError::TooFew {
            what: "presses with an indentation",
            expected: 2,
            got: presses.len(),
        });
    }
    let modulus = presses.iter().map(|p| basis(p.0) * p.1).sum::<f64>() / square;
    let misfit: f64 = presses.iter().map(|p| (p.1 - modulus * basis(p.0)).powi(2)).sum();
    Ok((modulus, (misfit / (presses.len() - 1) as f64 / square).sqrt()))
}

/// `a + b exp(-D/c)`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Falling {
    a: f64,
    b: f64,
    c: f64,
}

impl Falling {
    fn fit(points: &[(f64, f64)]) -> Self {
        let span = points.iter().map(|p| p.0).fold(0.0, f64::max);
        let shapes = (0..40).map(|k| span * 0.1 * 1.15f64.powi(k));
        let with = |c: f64| {
            let (x, misfit) = two(points, |d| (-d / c).exp());
            (Self { a: x[0], b: x[1], c }, misfit)
        };
        best(shapes.map(with))
    }

    fn at(&self, d: f64) -> f64 {
        self.a + self.b * (-d / self.c).exp()
    }
}

/// `p + q ln(1 + x/x_0)`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rising {
    p: f64,
    q: f64,
    scale: f64,
}

impl Rising {
    fn fit(points: &[(f64, f64)]) -> Self {
        let span = points.iter().map(|p| p.0).fold(0.0, f64::max);
        let shapes = (0..40).map(|k| span * 0.01 * 1.25f64.powi(k));
        let with = |scale: f64| {
            let (x, misfit) = two(points, |d| (d / scale).ln_1p());
            (Self { p: x[0], q: x[1], scale }, misfit)
        };
        best(shapes.map(with))
    }

    fn at(&self, x: f64) -> f64 {
        self.p + self.q * (x / self.scale).ln_1p()
    }
}

/// Least squares of a constant and one function.
fn two(points: &[(f64, f64)], of: impl Fn(f64) -> f64) -> (Vector2<f64>, f64) {
    let (mut gram, mut right, mut square) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
    for (x, y) in points {
        let row = Vector2::new(1.0, of(*x));
        gram += row * row.transpose();
        right += row * *y;
        square += y * y;
    }
    match gram.try_inverse().map(|inverse| inverse * right) {
        Some(x) => (x, (square - x.dot(&right)).max(0.0)),
        None => (Vector2::new(right[0] / gram[(0, 0)].max(1.0), 0.0), f64::INFINITY),
    }
}

fn best<T: Copy>(fits: impl Iterator<Item = (T, f64)>) -> T {
    let mut fits = fits.collect::<Vec<_>>();
    fits.sort_by(|a, b| a.1.total_cmp(&b.1));
    // The lists of shapes have forty entries.
    fits[0].0
}

/// Part of the calibrated range that may be asked for beyond it.
const SLACK: f64 = 0.05;

/// Modulus over radius and stretch.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    stretches_m: Vec<f64>,
    falling: Vec<Falling>,
    radius_m: Calibrated,
    stretch_m: Calibrated,
    /// Relative error of a force by leaving out each radius in turn: root mean square.
    relative_error: f64,
    /// The same, N: mean of the absolute value, and its standard deviation.
    error_n: (f64, f64),
}

impl Surface {
    /// Fits presses with three radii or more at three stretches or more, and leaves out each inner radius in turn (section 6.5). The outer
    /// ones are not left out: that would be extrapolation, which [`Surface::modulus_pa`] refuses.
    ///
    /// # Errors
    /// [`ModulusError`].
    pub fn fit(presses: &[Press]) -> Result<Self, ModulusError> {
        check(presses)?;
        let mut surface = Self::without(presses, None)?;
        let radii = distinct(presses.iter().map(|p| p.radius_m));
        let (mut errors, mut relative) = (Vec::new(), Vec::new());
        if radii.len() >= 4 {
            for &left_out in &radii[1..radii.len() - 1] {
                let others = Self::without(presses, Some(left_out))?;
                for p in presses.iter().filter(|p| p.radius_m == left_out && p.indentation_m > 0.0) {
                    let force =
                        others.modulus(p.radius_m, p.stretch_m) * per_modulus(p.radius_m, p.indentation_m);
                    errors.push((force - p.force_n).abs());
                    relative.push(((force - p.force_n) / force).powi(2));
                }
            }
        }
        if !errors.is_empty() {
            let n = errors.len() as f64;
            let mean = errors.iter().sum::<f64>() / n;
            let spread = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n).sqrt();
            surface.error_n = (mean, spread);
            surface.relative_error = (relative.iter().sum::<f64>() / n).sqrt();
        }
        Ok(surface)
    }

    fn without(presses: &[Press], left_out: Option<f64>) -> Result<Self, ModulusError> {
        let used: Vec<&Press> = presses.iter().filter(|p| Some(p.radius_m) != left_out).collect();
        let stretches_m = distinct(used.iter().map(|p| p.stretch_m));
        let radii = distinct(used.iter().map(|p| p.radius_m));
        for (what, got) in [("stretches", stretches_m.len()), ("radii", radii.len())] {
            if got < 3 {
                return Err(ModulusError::TooFew { what, expected: 3, got });
            }
        }
        let mut falling = Vec::with_capacity(stretches_m.len());
        for &stretch_m in &stretches_m {
            let mut points = Vec::with_capacity(radii.len());
            for &radius_m in &radii {
                let here = used.iter().filter(|p| p.stretch_m == stretch_m && p.radius_m == radius_m);
                let (mut up, mut square) = (0.0, 0.0);
                for p in here {
                    let g = per_modulus(radius_m, p.indentation_m);
                    (up, square) = (up + g * p.force_n, square + g * g);
                }
                // A radius need not have been pressed in at every stretch.
                if square > 0.0 {
                    if !(up > 0.0) {
                        return Err(ModulusError::NoForce { radius_m, stretch_m });
                    }
                    points.push((2.0 * radius_m, up / square));
                }
            }
            if points.len() < 3 {
                return Err(ModulusError::TooFew {
                    what: "radii at one stretch",
                    expected: 3,
                    got: points.len(),
                });
            }
            falling.push(Falling::fit(&points));
        }
        let radius_m = Calibrated::over("the radius in m", radii, SLACK);
        let stretch_m = Calibrated::over("the stretch in m", stretches_m.iter().copied(), SLACK);
        let (relative_error, error_n) = (f64::NAN, (f64::NAN, f64::NAN));
        Ok(Self { stretches_m, falling, radius_m, stretch_m, relative_error, error_n })
    }

    fn modulus(&self, radius_m: f64, stretch_m: f64) -> f64 {
        let points: Vec<(f64, f64)> =
            self.stretches_m.iter().zip(&self.falling).map(|(x, f)| (*x, f.at(2.0 * radius_m))).collect();
        Rising::fit(&points).at(stretch_m)
    }

    /// Modulus E in Pa for a ball's radius at a stretch.
    ///
    /// # Errors
    /// [`ModulusError::Beyond`].
    pub fn modulus_pa(&self, radius_m: f64, stretch_m: f64) -> Result<f64, ModulusError> {
        self.radius_m.check(radius_m)?;
        self.stretch_m.check(stretch_m)?;
        Ok(self.modulus(radius_m, stretch_m))
    }

    /// Error of forces with each inner radius left out in turn: mean of the absolute value and its standard deviation, N; NaN with less than
    /// four radii.
    pub fn left_out_error_n(&self) -> (f64, f64) {
        self.error_n
    }

    /// The same as a part of the force, root mean square; NaN with less than four radii.
    pub fn left_out_relative(&self) -> f64 {
        self.relative_error
    }
}

fn check(presses: &[Press]) -> Result<(), ModulusError> {
    for (press, p) in presses.iter().enumerate() {
        for (what, got, least) in [
            ("the stretch", p.stretch_m, 0.0),
            ("the radius", p.radius_m, f64::MIN_POSITIVE),
            ("the indentation", p.indentation_m, 0.0),
            ("the force", p.force_n, f64::MIN),
        ] {
            if !(got.is_finite() && got >= least) {
                return Err(ModulusError::Value { press, what, got, least });
            }
        }
    }
    Ok(())
}
