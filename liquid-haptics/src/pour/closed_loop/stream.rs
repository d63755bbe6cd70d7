//! The stream over the lip as the filter sees it: a level surface, a parabolic notch, one factor that is learned.

use super::super::{Mouth, Pour};
use super::PourError;
use crate::container::up_at_tilt;

/// Softness of the edge between no head and some, m: the filter needs a slope to find out that the lip is lower than it thought.
const SOFT_M: f64 = 2e-4;
/// Lag of what comes off the lip behind what has passed it: for thin liquids (s), and per kinematic viscosity (s over m^2/s). The latter is
/// that of a thread of 1.5 mm under the surface tension of some 0.06 N/m, three times its radius times the dynamic viscosity over the tension, for 1200 kg/m^3.
const LAG_S: f64 = 0.05;
const LAG_S_PER_M2_S: f64 = 90.0;

/// Container, liquid and gravity.
#[derive(Clone, Copy)]
pub(super) struct Stream<'a> {
    pub(super) pour: Pour<'a>,
    pub(super) inside_m3: f64,
    pub(super) viscosity_m2_s: f64,
    pub(super) gravity_m_s2: f64,
}

impl Stream<'_> {
    fn mouth(&self) -> Mouth {
        self.pour.mouth
    }

    /// Height of the surface above the lip's lowest point and a bead of `crest_m`, once `left_m3` have left, m.
    pub(super) fn head_m(&self, tilt_rad: f64, left_m3: f64, crest_m: f64) -> Result<f64, PourError> {
        let tilt = tilt_rad.clamp(0.0, self.pour.steepest_rad);
        let volume =
            (self.inside_m3 - left_m3).clamp(1e-3 * self.inside_m3, self.pour.container.capacity_m3());
        let surface = self.pour.container.fill(&up_at_tilt(tilt), volume)?.surface_height_m;
        Ok(surface - self.mouth().lowest_m(tilt) - crest_m)
    }

    /// Volume flow over the lip at a head (m, softly cut at 0), m^3/s.
    ///
    /// The lip's lowest part is a parabola. Over it a thin liquid falls freely, `(8 g / 27)^(1/2) d^(3/2)` per width at a depth `d` (a broad
    /// crest: Chow 1959, Open-Channel Hydraulics, section 3-7), a thick one shears, `g d^3 / (3 nu)` (Nusselt 1916); across the parabola these are
    /// `3 pi / 8` and `32 / 35` of their value in the middle, and what takes both takes them one after the other.
    pub(super) fn flow_m3_s(&self, tilt_rad: f64, head_m: f64) -> f64 {
        let sin = tilt_rad.sin().max(0.05);
        let scaled = head_m / SOFT_M;
        let head = if scaled > 30.0 { head_m } else { SOFT_M * scaled.exp().ln_1p() };
        let half_width = (2.0 * self.mouth().radius_m * head / sin).sqrt().min(self.mouth().radius_m);
        let g = self.gravity_m_s2;
        let fall = 3.0 * std::f64::consts::PI / 8.0 * (8.0 * g / 27.0).sqrt() * head.powf(1.5) * half_width;
        let shear = 32.0 / 35.0 * g / (3.0 * self.viscosity_m2_s) * head.powi(3) * half_width;
        if fall + shear > 0.0 { fall * shear / (fall + shear) } else { 0.0 }
    }

    /// The head (m) at which so much flows, the factor applied.
    pub(super) fn head_for_m(&self, tilt_rad: f64, flow_m3_s: f64, factor: f64) -> f64 {
        let (mut low, mut high) = (-10.0 * SOFT_M, 0.05);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if factor * self.flow_m3_s(tilt_rad, middle) < flow_m3_s { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// The lag that the viscosity lets expect, s.
    pub(super) fn lag_s(&self) -> f64 {
        LAG_S + LAG_S_PER_M2_S * self.viscosity_m2_s
    }
}
