//! A membrane's own law: `F = a delta + b delta^3`, pre-tension and stretching, with `a(R, x)` and `b(R, x)` quadratic in the logarithm of the
//! ball's radius R and in `ln(1 + x/x_max)` of the stretch x.
//!
//! The linear term is the tension that is there, the cubic one what the deflection adds (the large-deflection plate's: Timoshenko and
//! Woinowsky-Krieger 1959, section 97). How both depend on radius and stretch is empirical, so that the model interpolates and says nothing beyond
//! its calibration. A rubber's tension rises ever less with its stretch, which is why a logarithm of it is bent less than the stretch itself.

use hertz_contact::calibrated::Calibrated;
use hertz_contact::law::{Law, Membrane};
use nalgebra::{DMatrix, DVector};

use crate::calibration::{CalibrationError, ForceModel, LeftOut, Press, SLACK, check, left_out};

/// Terms over radius and over stretch: 1, u, u^2 of a logarithm u.
const TERMS: usize = 3;
/// Coefficients of `a`, and of `b`.
const PER_POWER: usize = TERMS * TERMS;

/// Forces of balls on a stretched membrane.
#[derive(Debug, Clone, PartialEq)]
pub struct MembraneModel {
    radius_m: Calibrated,
    stretch_m: Calibrated,
    indentation_m: Calibrated,
    /// Radius, stretch and indentation in whose units the coefficients are.
    units: [f64; 3],
    /// Of `a`, then of `b`, N.
    coefficients: DVector<f64>,
    left_out: [Option<LeftOut>; 2],
}

impl MembraneModel {
    /// Fits presses with three radii or more at three stretches or more, by least squares of the forces.
    ///
    /// # Errors
    /// [`CalibrationError`].
    pub fn fit(presses: &[Press]) -> Result<Self, CalibrationError> {
        check(presses)?;
        Ok(Self { left_out: left_out(presses, Self::of)?, ..Self::of(presses)? })
    }

    fn of(presses: &[Press]) -> Result<Self, CalibrationError> {
        let pressed = presses.iter().filter(|p| p.indentation_m > 0.0).count();
        if pressed < 2 * PER_POWER {
            let what = "presses with an indentation";
            return Err(CalibrationError::TooFew { what, expected: 2 * PER_POWER, got: pressed });
        }
        let most = |of: fn(&Press) -> f64| presses.iter().map(of).fold(f64::MIN_POSITIVE, f64::max);
        let units = [most(|p| p.radius_m), most(|p| p.stretch_m), most(|p| p.indentation_m)];
        let terms = |p: &Press| features(units, p.radius_m, p.stretch_m, p.indentation_m);
        let design = DMatrix::from_fn(presses.len(), 2 * PER_POWER, |row, k| terms(&presses[row])[k]);
        let forces = DVector::from_iterator(presses.len(), presses.iter().map(|p| p.force_n));
        // Presses to one depth alone do not tell `a` from `b`: of all that fit alike, the smallest.
        let svd = design.svd(true, true);
        let least = 1e-9 * svd.singular_values.max();
        let Ok(coefficients) = svd.solve(&forces, least) else {
            let what = "presses that tell the law";
            return Err(CalibrationError::TooFew { what, expected: 2 * PER_POWER, got: 0 });
        };
        let over = |what, of: fn(&Press) -> f64| Calibrated::over(what, presses.iter().map(of), SLACK);
        Ok(Self {
            radius_m: over("the radius in m", |p| p.radius_m),
            stretch_m: over("the stretch in m", |p| p.stretch_m),
            indentation_m: Calibrated::over("the indentation in m", [0.0, units[2]], SLACK),
            units,
            coefficients,
            left_out: [None; 2],
        })
    }

    /// The law for a ball's radius (m) at a stretch (m). Neither term is below 0: a stretched membrane does not soften.
    ///
    /// # Errors
    /// [`CalibrationError::Beyond`].
    pub fn law(&self, radius_m: f64, stretch_m: f64) -> Result<Membrane<f64>, CalibrationError> {
        self.radius_m.check(radius_m)?;
        self.stretch_m.check(stretch_m)?;
        let terms = over_states(self.units, radius_m, stretch_m);
        let of = |power: usize| {
            let coefficients = self.coefficients.iter().skip(power * PER_POWER);
            terms.iter().zip(coefficients).map(|(t, c)| t * c).sum::<f64>().max(0.0)
        };
        let depth = self.units[2];
        Ok(Membrane { tension_n_m: of(0) / depth, stretching_n_m3: of(1) / depth.powi(3) })
    }
}

/// Powers of the radius's logarithm and of the stretch's, each with each.
fn over_states([radius, stretch, _]: [f64; 3], radius_m: f64, stretch_m: f64) -> [f64; PER_POWER] {
    let (u, s) = ((radius_m / radius).ln(), (stretch_m / stretch).ln_1p());
    std::array::from_fn(|k| u.powi((k / TERMS) as i32) * s.powi((k % TERMS) as i32))
}

/// What the coefficients are multiplied by for a press.
fn features(units: [f64; 3], radius_m: f64, stretch_m: f64, indentation_m: f64) -> [f64; 2 * PER_POWER] {
    let states = over_states(units, radius_m, stretch_m);
    let d = indentation_m / units[2];
    std::array::from_fn(|k| states[k % PER_POWER] * if k < PER_POWER { d } else { d.powi(3) })
}

impl ForceModel for MembraneModel {
    fn force_n(&self, radius_m: f64, stretch_m: f64, indentation_m: f64) -> Result<f64, CalibrationError> {
        self.indentation_m.check(indentation_m)?;
        Ok(self.law(radius_m, stretch_m)?.force(indentation_m))
    }

    fn indentation_m(&self, radius_m: f64, stretch_m: f64, force_n: f64) -> Result<f64, CalibrationError> {
        let law = self.law(radius_m, stretch_m)?;
        law.inverse(force_n).map_err(|_| CalibrationError::NotReached { force_n })
    }

    fn radius_left_out(&self) -> Option<LeftOut> {
        self.left_out[0]
    }

    fn stretch_left_out(&self) -> Option<LeftOut> {
        self.left_out[1]
    }
}
