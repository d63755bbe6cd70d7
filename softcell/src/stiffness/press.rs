//! What is measured in a press, and what is known of the instrument.

use super::{StiffnessError, positive};

/// What is known of the instrument, all as standard deviations but the play.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instrument {
    /// Noise of the tip's indentation in one reading, m, above 0.
    pub tip_noise_m: f64,
    /// What the camera's zero wanders by from the begin of a contact to the deepest reading, m.
    pub drift_m: f64,
    /// Error of the camera's gain, as a share.
    pub gain_share: f64,
    /// What the rubber's part of the tip's modulus may have changed by since the calibration, as a share.
    pub ageing_share: f64,
    /// The same of the air's part: errors of the pressure.
    pub air_share: f64,
    /// Error of the gels' moduli, which all of them have in common, as a share.
    pub gel_share: f64,
    /// Error of two springs in series as a model, which is the same for presses at the same pressure, as a share of the tip's modulus.
    pub model_share: f64,
    /// Most that the stage may lose when it turns back, m.
    pub play_m: f64,
    /// Most mean shear, in radii of the contact.
    pub shear_share: f64,
}

impl Instrument {
    /// A camera with the static noise of [Matl 2021], whose 0.6 mm of smallest indentation are 4.37 times 0.14 mm
    /// ([`crate::modulus::smallest_indentation_m`]), a gain known to 1 %, rubber that has aged by 5 %, gels known to 3 %.
    pub fn matl_2021() -> Self {
        Self {
            tip_noise_m: 1.4e-4,
            drift_m: 2e-5,
            gain_share: 0.01,
            ageing_share: 0.05,
            air_share: 0.02,
            gel_share: 0.03,
            model_share: 0.03,
            play_m: 1e-4,
            shear_share: 0.1,
        }
    }

    pub(super) fn check(&self) -> Result<(), StiffnessError> {
        for (what, got) in [
            ("the noise of the tip's indentation", self.tip_noise_m),
            ("the drift of the tip's indentation", self.drift_m),
            ("the error of the camera's gain", self.gain_share),
            ("the ageing", self.ageing_share),
            ("the error of the air's part", self.air_share),
            ("the error of the gels", self.gel_share),
            ("the model's error", self.model_share),
            ("the play", self.play_m),
            ("the largest shear", self.shear_share),
        ] {
            positive(what, got)?;
        }
        Ok(())
    }
}

/// One reading of a press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Travel of the tip's base towards the object, m from any zero.
    pub travel_m: f64,
    /// Indentation of the tip at its apex as the camera sees it, m from any zero.
    pub tip_m: f64,
    /// Radius of the contact, m; 0: none.
    pub contact_m: f64,
    /// Mean shear of the skin, m.
    pub shear_m: f64,
}

/// One press at one pressure, in and out.
#[derive(Debug, Clone, PartialEq)]
pub struct Press {
    /// Gauge pressure, Pa.
    pub pressure_pa: f64,
    /// Readings on the way in, from before the contact on.
    pub loading: Vec<Reading>,
    /// Readings on the way out.
    pub unloading: Vec<Reading>,
}
