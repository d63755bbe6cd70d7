//! The simulation that is doubted: Hertz's law of a pad without a bottom, and what could be missing from it.

use hertz_contact::law::{Base, Indentation, Law as _, LawError, Layer};
use missing_physics::data::Run;
use missing_physics::model::{Model, PredictError, Spec, SpecBuilder, SpecError, UNBOUNDED};

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
    pub fn new(layer: Layer) -> Result<Self, SpecError> {
        let mut b = SpecBuilder::new("Hertz's law of a half-space");
        let above_zero = [0.0, f64::INFINITY];
        b.shared("modulus_pa", "Pa", 15e3, above_zero, 1e3);
        let bottom = b.shared("inverse_thickness_per_m", "1/m", 0.0, [0.0, 200.0], 10.0);
        let zero = b.shared("offset_n", "N", 0.0, UNBOUNDED, 1e-3);
        b.mechanism(
            "thin-pad",
            &[bottom],
            ["a bottom close by", "The table shows.", "F = C(chi) F_Hertz", ""],
            &[],
        );
        b.mechanism(
            "offset",
            &[zero],
            ["an offset", "The cell's zero is off.", "F = F_Hertz + offset_n", ""],
            &[],
        );
        Ok(Self { spec: b.build()?, layer })
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
