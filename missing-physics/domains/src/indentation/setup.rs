//! What is known of a body that is pressed, and of the conditions under which it is.

use hertz_contact::indenter::Indenter;
use hertz_contact::law::{Indentation, Law as _};
use missing_physics::data::Run;

/// What is known of the set-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// The indenter; of radius 1 m where the radius is not known.
    pub indenter: Indenter,
    /// Whether its radius is known.
    pub radius_known: bool,
    /// Poisson's ratio of the body.
    pub poisson_ratio: f64,
    /// Thickness of the body on a rigid base, where it is known, m.
    pub thickness_m: Option<f64>,
    /// Whether rows have times (input 1).
    pub timed: bool,
}

/// A condition: the name of its modulus and where that starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// Name of the parameter.
    pub name: String,
    /// Its start, Pa.
    pub start_pa: f64,
}

impl Setup {
    /// The name of a condition's modulus; `key` is the condition's column and value.
    pub fn modulus_name(&self, key: Option<(&str, &str)>) -> String {
        let base = match self.indenter {
            _ if self.radius_known => "modulus_pa",
            Indenter::Sphere { .. } => "modulus_root_radius_pa_m05",
            _ => "modulus_radius_n_m",
        };
        match key {
            None => base.into(),
            Some((column, value)) => format!("{base} at {column} = {value}"),
        }
    }
}

/// Young's modulus (Pa) that fits the rows of one condition best, in the elastic law with contact at zero.
pub(super) fn start_modulus(setup: &Setup, runs: &[Run], kind: u32) -> f64 {
    let law = Indentation::elastic(setup.indenter, 1.0, setup.poisson_ratio);
    let (mut product, mut square) = (0.0, 0.0);
    for run in runs.iter().filter(|r| r.kind == kind) {
        for (depth, force) in run.inputs[0].iter().zip(&run.outputs[0]).filter(|(_, f)| f.is_finite()) {
            let unit = law.force(*depth);
            (product, square) = (product + unit * force, square + unit * unit);
        }
    }
    let modulus = product / square;
    if modulus > 0.0 && modulus.is_finite() { modulus } else { 1.0 }
}
