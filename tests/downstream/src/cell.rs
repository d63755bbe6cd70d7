//! The driver of a load cell, with errors of its own; here it feels a pad that is computed.

use hertz_contact::law::{Indentation, Law as _};
use hw_traits::clock::Stamped;
use hw_traits::force_torque::{ForceTorque, Wrench};
use hw_traits::{ErrorKind, ErrorType};

/// What this cell's protocol can say.
#[derive(Debug)]
pub enum CellError {
    /// Nothing came over the wire.
    Silence,
    /// The force is beyond the cell's range.
    Overload,
}

impl hw_traits::Error for CellError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Silence => ErrorKind::Link,
            Self::Overload => ErrorKind::Saturated,
        }
    }
}

/// A cell under a fingertip that goes 20 um deeper from reading to reading, sixty times, and then starts again.
#[derive(Debug, Clone)]
pub struct LoadCell {
    pad: Indentation<f64>,
    readings: u32,
    plugged: bool,
}

impl LoadCell {
    const RANGE_N: f64 = 2.0;

    /// Over a pad.
    pub fn over(pad: Indentation<f64>) -> Self {
        Self { pad, readings: 0, plugged: true }
    }

    /// The same cell with its cable pulled.
    pub fn unplugged(self) -> Self {
        Self { plugged: false, ..self }
    }
}

impl ErrorType for LoadCell {
    type Error = CellError;
}

impl ForceTorque for LoadCell {
    fn read(&mut self) -> Result<Stamped<Wrench>, CellError> {
        self.readings += 1;
        // One reading in fifty is lost on its way.
        if !self.plugged || self.readings.is_multiple_of(50) {
            return Err(CellError::Silence);
        }
        let row = self.readings - 1 - self.readings / 50;
        let force_n = self.pad.force(2e-5 * f64::from(row % 60)) + 1e-3 * normal(self.readings);
        if force_n > Self::RANGE_N {
            return Err(CellError::Overload);
        }
        let wrench = Wrench { force_n: [0.0, 0.0, force_n], torque_nm: [0.0; 3] };
        Ok(Stamped { t_s: 0.01 * f64::from(self.readings), value: wrench })
    }

    fn tare(&mut self, _readings: usize) -> Result<(), CellError> {
        Ok(())
    }
}

/// A number that is nearly standard normal, the same for the same reading: a sum of twelve hashes (SplitMix64).
fn normal(reading: u32) -> f64 {
    let uniform = |k: u64| {
        let mut z = (12 * u64::from(reading) + k).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    };
    (0..12).map(uniform).sum::<f64>() - 6.0
}
