//! What a closed-loop pour is told, and what it tells.

use super::{ClosedLoopError, Pour};

/// How good the sensor is; the filter's prior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Standard deviation of a reading's force, N.
    pub noise_n: f64,
    /// Error of a mean of readings that does not fall with their number, N.
    pub block_n: f64,
    /// Standard deviation of a wander along each axis, N.
    pub wander_n: f64,
    /// How long the wander remembers, s.
    pub wander_s: f64,
    /// Standard deviation of a constant offset, N; the turn to the lip tells it apart from the weight.
    pub offset_n: f64,
    /// Standard deviation of a drift, N/s.
    pub drift_n_s: f64,
    /// Standard deviation of the measured tilt's error, rad.
    pub tilt_rad: f64,
}

impl Scale {
    /// The simulated ATI Axia80 of [Matl 2021], section 2.5: 0.1 N a reading, a wander of 2 mN over 30 s, offsets of half a newton, a drift of
    /// 0.1 mN/s, a tilt known to 2 mrad.
    pub const AXIA80: Self = Self {
        noise_n: 0.105,
        block_n: 2e-3,
        wander_n: 2e-3,
        wander_s: 30.0,
        offset_n: 0.5,
        drift_n_s: 1e-4,
        tilt_rad: 2e-3,
    };
}

/// What is known of the liquid before it is poured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inside {
    /// Volume inside, m^3.
    pub volume_m3: f64,
    /// Density, kg/m^3, as the same sensor weighs it: a gain of the forces that mass and pour share cancels.
    pub density_kg_m3: f64,
    /// Standard error of that, as a share.
    pub density_error_share: f64,
    /// Kinematic viscosity (m^2/s), to a factor of two.
    pub viscosity_m2_s: f64,
}

/// How to pour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manner {
    /// Readings of which the mean is taken before the filter sees them.
    pub readings: usize,
    /// How long the wrist weighs before the flow, upright and again at the lip, and after it, s.
    pub weigh_s: f64,
    /// Fastest flow, m^3/s.
    pub flow_m3_s: f64,
    /// Slowest flow, at which a thin liquid is stopped, m^3/s; thick ones are slower by their lag.
    pub last_flow_m3_s: f64,
    /// Rate of turning to the lip and back from it, rad/s.
    pub turn_rad_s: f64,
    /// Longest time of all, s.
    pub patience_s: f64,
}

impl Default for Manner {
    /// Means of 156 readings (50 a second of 7812), 3 s of weighing, 8 mL/s down to 1.2, turns at 1 rad/s, patience of 300 s.
    fn default() -> Self {
        Self {
            readings: 156,
            weigh_s: 3.0,
            flow_m3_s: 8e-6,
            last_flow_m3_s: 1.2e-6,
            turn_rad_s: 1.0,
            patience_s: 300.0,
        }
    }
}

/// Which part of a pour it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Weighing upright.
    Upright,
    /// Turning to the lip, and weighing there.
    ToTheLip,
    /// Creeping until something flows.
    Creeping,
    /// Pouring.
    Pouring,
    /// Turning back, and waiting for what hangs.
    Back,
    /// Weighing upright what is left.
    After,
}

/// What is believed after a block of readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Time of the readings, s.
    pub t_s: f64,
    /// The part of the pour.
    pub phase: Phase,
    /// Measured tilt, rad.
    pub tilt_rad: f64,
    /// Volume that has come off the lip, m^3, and its standard error without that of the density.
    pub poured_m3: f64,
    /// Its standard error, m^3.
    pub error_m3: f64,
    /// Flow over the lip, m^3/s.
    pub flow_m3_s: f64,
    /// Its standard error, m^3/s.
    pub flow_error_m3_s: f64,
    /// What would have been poured if the wrist were to turn back now, m^3.
    pub if_stopped_m3: f64,
}

/// What has been poured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Poured {
    /// Volume, m^3.
    pub volume_m3: f64,
    /// Its standard error, m^3, the density's included.
    pub error_m3: f64,
    /// Its 95 % interval, m^3.
    pub interval_m3: [f64; 2],
    /// What was predicted when the wrist was turned back, m^3.
    pub predicted_m3: f64,
    /// Its standard error, m^3: of what had passed the lip and of the density, not of what was still to pass it.
    pub predicted_error_m3: f64,
    /// How long it took, s.
    pub took_s: f64,
}

/// A pour with the scale in the loop.
#[derive(Clone, Copy)]
pub struct ClosedLoop<'a> {
    /// Container, mouth, bead and steepest tilt.
    pub pour: Pour<'a>,
    /// The liquid.
    pub inside: Inside,
    /// The sensor.
    pub scale: Scale,
    /// How to pour.
    pub manner: Manner,
    /// Gravity, m/s^2.
    pub gravity_m_s2: f64,
}

impl ClosedLoop<'_> {
    /// Refuses numbers that are none.
    pub(super) fn check<E: std::fmt::Debug>(&self) -> Result<(), ClosedLoopError<E>> {
        let (inside, scale, manner) = (&self.inside, &self.scale, &self.manner);
        let above = [
            ("density_kg_m3", inside.density_kg_m3),
            ("viscosity_m2_s", inside.viscosity_m2_s),
            ("gravity_m_s2", self.gravity_m_s2),
            ("noise_n", scale.noise_n),
            ("wander_s", scale.wander_s),
            ("readings", manner.readings as f64),
            ("weigh_s", manner.weigh_s),
            ("flow_m3_s", manner.flow_m3_s),
            ("last_flow_m3_s", manner.last_flow_m3_s),
            ("turn_rad_s", manner.turn_rad_s),
            ("patience_s", manner.patience_s),
        ];
        for (name, got) in above {
            if !(got > 0.0 && got.is_finite()) {
                return Err(ClosedLoopError::Plan { name, got, expected: "above 0" });
            }
        }
        let not_below = [
            ("density_error_share", inside.density_error_share),
            ("block_n", scale.block_n),
            ("wander_n", scale.wander_n),
            ("offset_n", scale.offset_n),
            ("drift_n_s", scale.drift_n_s),
            ("tilt_rad", scale.tilt_rad),
        ];
        for (name, got) in not_below {
            if !(got >= 0.0 && got.is_finite()) {
                return Err(ClosedLoopError::Plan { name, got, expected: "0 or more" });
            }
        }
        Ok(())
    }
}
