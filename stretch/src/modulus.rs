//! The half-space that the membrane resembles: E*(x), E*(R, x) (sections 6.4 and 6.5).
//!
//! At each stretch x the modulus falls with the contact's diameter, `E = a + b exp(-D/c)`; for one diameter it grows with the
//! stretch, `E = p + q ln(1 + x/x_0)`. Forces are eqs 6.2 to 6.4, corrected, nu = 1/2.

use hertz_contact::calibrated::{Calibrated, distinct};
use hertz_contact::indenter::Indenter;
use nalgebra::{Matrix2, Vector2};

use crate::calibration::{CalibrationError, ForceModel, LeftOut, Press, check, left_out};

/// Poisson's ratio of rubber.
pub const POISSON_RATIO: f64 = 0.5;

/// The force over E for a ball: `4/3 sqrt(R) delta^(3/2)/(1 - nu^2)`.
pub(crate) fn per_modulus(radius_m: f64, indentation_m: f64) -> f64 {
    let ball = Indenter::Sphere { radius_m };
    ball.factor() / (1.0 - POISSON_RATIO.powi(2)) * indentation_m.max(0.0).powf(ball.exponent())
}

/// Modulus E in Pa of presses by one indenter at one stretch: least squares through the origin, and its standard error.
///
/// # Errors
/// [`CalibrationError::TooFew`] (two presses), [`CalibrationError::Value`].
pub fn effective_pa(indenter: &Indenter, presses: &[(f64, f64)]) -> Result<(f64, f64), CalibrationError> {
    for (press, &(depth, force)) in presses.iter().enumerate() {
        for (what, got, least) in [("the indentation", depth, 0.0), ("the force", force, f64::MIN)] {
            if !(got.is_finite() && got >= least) {
                return Err(CalibrationError::Value { press, what, got, least });
            }
        }
    }
    let factor = indenter.factor() / (1.0 - POISSON_RATIO.powi(2));
    let basis = |depth: f64| factor * depth.powf(indenter.exponent());
    let square: f64 = presses.iter().map(|p| basis(p.0).powi(2)).sum();
    if presses.len() < 2 || !(square > 0.0) {
        return Err(CalibrationError::TooFew {
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

/// Modulus over radius and stretch: a half-space that stands for the membrane (sections 6.4 and 6.5 of [Matl 2021]).
/// [`MembraneModel`](crate::membrane::MembraneModel) has a membrane's own law and errs less.
#[derive(Debug, Clone, PartialEq)]
pub struct HalfSpace {
    stretches_m: Vec<f64>,
    falling: Vec<Falling>,
    radius_m: Calibrated,
    stretch_m: Calibrated,
    left_out: [Option<LeftOut>; 2],
}

impl HalfSpace {
    /// Fits presses with three radii or more at three stretches or more.
    ///
    /// # Errors
    /// [`CalibrationError`].
    pub fn fit(presses: &[Press]) -> Result<Self, CalibrationError> {
        check(presses)?;
        Ok(Self { left_out: left_out(presses, Self::of)?, ..Self::of(presses)? })
    }

    fn of(presses: &[Press]) -> Result<Self, CalibrationError> {
        let stretches_m = distinct(presses.iter().map(|p| p.stretch_m));
        let radii = distinct(presses.iter().map(|p| p.radius_m));
        let mut falling = Vec::with_capacity(stretches_m.len());
        for &stretch_m in &stretches_m {
            let mut points = Vec::with_capacity(radii.len());
            for &radius_m in &radii {
                let here = presses.iter().filter(|p| p.stretch_m == stretch_m && p.radius_m == radius_m);
                let (mut up, mut square) = (0.0, 0.0);
                for p in here {
                    let g = per_modulus(radius_m, p.indentation_m);
                    (up, square) = (up + g * p.force_n, square + g * g);
                }
                // A radius need not have been pressed in at every stretch.
                if square > 0.0 {
                    points.push((2.0 * radius_m, up / square));
                }
            }
            if points.len() < 3 {
                let what = "radii at one stretch";
                return Err(CalibrationError::TooFew { what, expected: 3, got: points.len() });
            }
            falling.push(Falling::fit(&points));
        }
        let radius_m = Calibrated::over("the radius in m", radii, crate::calibration::SLACK);
        let stretch_m =
            Calibrated::over("the stretch in m", stretches_m.iter().copied(), crate::calibration::SLACK);
        Ok(Self { stretches_m, falling, radius_m, stretch_m, left_out: [None; 2] })
    }

    fn modulus(&self, radius_m: f64, stretch_m: f64) -> f64 {
        let points: Vec<(f64, f64)> =
            self.stretches_m.iter().zip(&self.falling).map(|(x, f)| (*x, f.at(2.0 * radius_m))).collect();
        Rising::fit(&points).at(stretch_m)
    }

    /// Modulus E in Pa for a ball's radius at a stretch.
    ///
    /// # Errors
    /// [`CalibrationError::Beyond`].
    pub fn modulus_pa(&self, radius_m: f64, stretch_m: f64) -> Result<f64, CalibrationError> {
        self.radius_m.check(radius_m)?;
        self.stretch_m.check(stretch_m)?;
        Ok(self.modulus(radius_m, stretch_m))
    }
}

impl ForceModel for HalfSpace {
    fn force_n(&self, radius_m: f64, stretch_m: f64, indentation_m: f64) -> Result<f64, CalibrationError> {
        Ok(self.modulus_pa(radius_m, stretch_m)? * per_modulus(radius_m, indentation_m))
    }

    fn indentation_m(&self, radius_m: f64, stretch_m: f64, force_n: f64) -> Result<f64, CalibrationError> {
        let per_unit = self.modulus_pa(radius_m, stretch_m)? * per_modulus(radius_m, 1.0);
        let indentation_m = (force_n / per_unit).powf(2.0 / 3.0);
        if indentation_m.is_finite() {
            Ok(indentation_m)
        } else {
            Err(CalibrationError::NotReached { force_n })
        }
    }

    fn radius_left_out(&self) -> Option<LeftOut> {
        self.left_out[0]
    }

    fn stretch_left_out(&self) -> Option<LeftOut> {
        self.left_out[1]
    }
}
