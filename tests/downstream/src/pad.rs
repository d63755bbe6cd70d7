//! The simulation that is doubted: Hertz's law of a pad without a bottom, and what could be missing from it.

use hertz_contact::law::{Base, Indentation, Law as _, LawError, Layer};
use missing_physics::data::Run;
use missing_physics::model::{Mechanism, Model, Parameter, PredictError, Scope, Spec};

/// Hertz's law, what a bottom close by adds to it, and a cell whose zero is off.
pub struct Pad {
    spec: Spec,
    layer: Layer,
}

/// A pad under the fingertip.
pub fn pad(layer: &Layer, modulus_pa: f64, inverse_thickness_per_m: f64) -> Indentation<f64> {
    let thick = Indentation::elastic(super::FINGERTIP, modulus_pa, super::POISSON_RATIO);
    Indentation { layer: Some(*layer), inverse_thickness_per_m, ..thick }
}

/// A pad that is glued to the table.
pub fn glued() -> Result<Layer, LawError> {
    Layer::new(&super::FINGERTIP, super::POISSON_RATIO, Base::Bonded)
}

impl Pad {
    pub fn new(layer: Layer) -> Self {
        let parameter = |name: &str, unit: &str, start, upper, scale| Parameter {
            name: name.into(),
            unit: unit.into(),
            scope: Scope::Shared,
            start,
            lower: 0.0,
            upper,
            scale,
        };
        let mechanism = |id: &str, name: &str, parameter| Mechanism {
            id: id.into(),
            name: name.into(),
            parameters: vec![parameter],
            ..Mechanism::default()
        };
        let spec = Spec {
            baseline: "Hertz's law of a half-space".into(),
            parameters: vec![
                parameter("modulus_pa", "Pa", 15e3, f64::INFINITY, 1e3),
                parameter("inverse_thickness_per_m", "1/m", 0.0, 1e3, 10.0),
                parameter("offset_n", "N", 0.0, 1.0, 1e-3),
            ],
            mechanisms: vec![
                mechanism("thin-pad", "a bottom close by", 1),
                mechanism("offset", "the cell's zero is off", 2),
            ],
            terms: vec![],
        };
        Self { spec, layer }
    }
}

impl Model for Pad {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn predict(&self, run: &Run, shared: &[f64], _: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
        let &[modulus_pa, inverse_thickness_per_m, offset_n] = shared else {
            return Err(PredictError {
                run: run.label.clone(),
                reason: format!("{} parameters", shared.len()),
            });
        };
        let pad = pad(&self.layer, modulus_pa, inverse_thickness_per_m);
        for (force_n, depth_m) in out.iter_mut().zip(&run.inputs[0]) {
            *force_n = offset_n + pad.force(*depth_m);
        }
        Ok(())
    }
}
