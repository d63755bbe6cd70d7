//! The extended Kalman filter of a pour: what has left, what is on its way, the lip, and the sensor's own errors.

use nalgebra::{SMatrix, SVector};

use super::PourError;
use super::plan::Scale;
use super::stream::Stream;

/// Volume that has come off the lip, and that has passed it, mL.
const OFF: usize = 0;
const PASSED: usize = 1;
/// Height of the bead at which the stream would stop less the stated one, mm.
const CREST: usize = 2;
/// Logarithm of the flow over that of the law.
const FACTOR: usize = 3;
/// Weight to begin with, N.
const WEIGHT: usize = 4;
/// Error of the tilt, rad.
const TILT: usize = 5;
/// Along the sensor's x and y, each: a constant offset, N; a wander, N; a drift, N/s.
const OFFSET: usize = 6;
const WANDER: usize = 8;
const DRIFT: usize = 10;
const N: usize = 12;

/// Share of a flow by which the law is off, correlated over some second.
const MISFIT_SHARE: f64 = 0.15;
/// Volume that moves unexplained, mL per root of a second.
const UNEXPLAINED_ML: f64 = 0.02;
/// Wander of the bead (mm) and of the factor, per root of a second, while it flows.
const CREST_MM: f64 = 0.15;
const FACTOR_WANDER: f64 = 0.08;
/// Step of the differences for derivatives: 0.01 mL, 0.01 mm, 0.01.
const DIFFERENCE: f64 = 0.01;

const ML: f64 = 1e-6;
const MM: f64 = 1e-3;

/// What a filter believes.
#[derive(Clone)]
pub(super) struct Filter<'a> {
    stream: Stream<'a>,
    scale: Scale,
    /// Weight of a millilitre, N.
    per_ml: f64,
    /// Height of the bead as stated, m.
    crest_m: f64,
    x: SVector<f64, N>,
    p: SMatrix<f64, N, N>,
    flows: bool,
    weighed: bool,
}

impl<'a> Filter<'a> {
    /// Before the pour: nothing has left, and the first weight is all but unknown.
    pub(super) fn new(stream: Stream<'a>, scale: Scale, density_kg_m3: f64) -> Self {
        let mut sd = SVector::<f64, N>::zeros();
        (sd[FACTOR], sd[TILT]) = (0.4, scale.tilt_rad);
        for axis in 0..2 {
            sd[OFFSET + axis] = scale.offset_n;
            sd[WANDER + axis] = scale.wander_n;
            sd[DRIFT + axis] = scale.drift_n_s;
        }
        Self {
            stream,
            scale,
            per_ml: density_kg_m3 * stream.gravity_m_s2 * ML,
            crest_m: stream.pour.bead.rest_m(),
            x: SVector::zeros(),
            p: SMatrix::from_diagonal(&sd.component_mul(&sd)),
            flows: false,
            weighed: false,
        }
    }

    /// What has come off the lip, m^3.
    pub(super) fn poured_m3(&self) -> f64 {
        self.x[OFF] * ML
    }

    /// Its standard error, m^3.
    pub(super) fn error_m3(&self) -> f64 {
        self.p[(OFF, OFF)].max(0.0).sqrt() * ML
    }

    /// The standard error of what has passed the lip, m^3.
    pub(super) fn passed_error_m3(&self) -> f64 {
        self.p[(PASSED, PASSED)].max(0.0).sqrt() * ML
    }

    /// The factor of the flow.
    pub(super) fn factor(&self) -> f64 {
        self.x[FACTOR].exp()
    }

    /// Height of the bead at which the stream stops, m.
    pub(super) fn crest_m(&self) -> f64 {
        self.crest_m + self.x[CREST] * MM
    }

    /// Flow over the lip at a tilt, m^3/s.
    pub(super) fn flow_m3_s(&self, tilt_rad: f64) -> Result<f64, PourError> {
        Ok(self.flow_ml_s(tilt_rad, &self.x)? * ML)
    }

    /// The standard error of that, m^3/s.
    pub(super) fn flow_error_m3_s(&self, tilt_rad: f64) -> Result<f64, PourError> {
        let slope = self.slope(tilt_rad)?;
        Ok((slope.transpose() * self.p * slope)[(0, 0)].max(0.0).sqrt() * ML)
    }

    fn flow_ml_s(&self, tilt_rad: f64, x: &SVector<f64, N>) -> Result<f64, PourError> {
        if !self.flows {
            return Ok(0.0);
        }
        let head = self.stream.head_m(tilt_rad, x[PASSED] * ML, self.crest_m + x[CREST] * MM)?;
        Ok(x[FACTOR].exp() * self.stream.flow_m3_s(tilt_rad, head) / ML)
    }

    /// How the flow changes with the state.
    fn slope(&self, tilt_rad: f64) -> Result<SVector<f64, N>, PourError> {
        let mut slope = SVector::zeros();
        for k in [PASSED, CREST] {
            let (mut low, mut high) = (self.x, self.x);
            low[k] -= DIFFERENCE;
            high[k] += DIFFERENCE;
            slope[k] =
                (self.flow_ml_s(tilt_rad, &high)? - self.flow_ml_s(tilt_rad, &low)?) / (2.0 * DIFFERENCE);
        }
        slope[FACTOR] = self.flow_ml_s(tilt_rad, &self.x)?;
        Ok(slope)
    }

    /// The bead may have broken: from now on what leaves is looked for, `loose_ml` of it per root of a second, by no law.
    pub(super) fn look(&mut self, dt_s: f64, loose_ml: f64) {
        self.p[(PASSED, PASSED)] += loose_ml * loose_ml * dt_s;
    }

    /// The bead has broken: from now on the law holds, its bead known to `crest_mm`.
    pub(super) fn begin(&mut self, crest_mm: f64) {
        self.flows = true;
        self.p[(CREST, CREST)] += crest_mm * crest_mm;
    }

    /// Goes on by a time at a tilt.
    pub(super) fn predict(&mut self, dt_s: f64, tilt_rad: f64) -> Result<(), PourError> {
        let flow = self.flow_ml_s(tilt_rad, &self.x)?;
        let slope = self.slope(tilt_rad)?;
        let follows = 1.0 - (-dt_s / self.stream.lag_s()).exp();
        let keeps = (-dt_s / self.scale.wander_s).exp();
        let mut f = SMatrix::<f64, N, N>::identity();
        // Implicit in the volume itself, so that a wide lip does not make the step unstable.
        let damped = 1.0 / (1.0 - dt_s * slope[PASSED].min(0.0));
        for k in [PASSED, CREST, FACTOR] {
            f[(PASSED, k)] += dt_s * damped * slope[k];
        }
        let behind = self.x[PASSED] - self.x[OFF];
        f[(OFF, OFF)] = 1.0 - follows;
        f[(OFF, PASSED)] = follows;
        for axis in 0..2 {
            f[(WANDER + axis, WANDER + axis)] = keeps;
            f[(OFFSET + axis, DRIFT + axis)] = dt_s;
            self.x[WANDER + axis] *= keeps;
            self.x[OFFSET + axis] += dt_s * self.x[DRIFT + axis];
        }
        self.x[OFF] += follows * behind;
        self.x[PASSED] += dt_s * damped * flow;
        self.p = f * self.p * f.transpose();
        let kick = self.scale.wander_n * self.scale.wander_n * (1.0 - keeps * keeps);
        for axis in 0..2 {
            self.p[(WANDER + axis, WANDER + axis)] += kick;
        }
        if self.flows {
            let misfit = MISFIT_SHARE * flow;
            self.p[(PASSED, PASSED)] += (misfit * misfit + UNEXPLAINED_ML * UNEXPLAINED_ML) * dt_s;
            if flow > 0.1 {
                self.p[(CREST, CREST)] += CREST_MM * CREST_MM * dt_s;
                self.p[(FACTOR, FACTOR)] += FACTOR_WANDER * FACTOR_WANDER * dt_s;
            }
        }
        Ok(())
    }

    /// Takes the mean of `readings` forces along the sensor's x and y (N) at a measured tilt.
    pub(super) fn update(&mut self, [fx, fy]: [f64; 2], tilt_rad: f64, readings: usize) {
        if !self.weighed {
            // The first weight is that of the first block, as far as offsets let it be known.
            self.weighed = true;
            self.x[WEIGHT] = fx.hypot(fy);
            self.p[(WEIGHT, WEIGHT)] = (3.0 * (self.scale.offset_n + self.scale.noise_n)).powi(2);
        }
        let weight = self.x[WEIGHT] - self.per_ml * self.x[OFF];
        let (sin, cos) = (tilt_rad + self.x[TILT]).sin_cos();
        let variance = (self.scale.noise_n.powi(2)) / readings as f64 + self.scale.block_n.powi(2);
        for (axis, read, part, turned) in [(0, fx, sin, cos), (1, fy, -cos, sin)] {
            let mut h = SVector::<f64, N>::zeros();
            h[WEIGHT] = part;
            h[OFF] = -part * self.per_ml;
            h[TILT] = weight * turned;
            h[OFFSET + axis] = 1.0;
            h[WANDER + axis] = 1.0;
            // The second axis is judged after what the first one has told: sines are those of before, and so is what is linear in them.
            let now = self.x[WEIGHT] - self.per_ml * self.x[OFF];
            let (sin, cos) = (tilt_rad + self.x[TILT]).sin_cos();
            let expected =
                now * if axis == 0 { sin } else { -cos } + self.x[OFFSET + axis] + self.x[WANDER + axis];
            let seen = self.p * h;
            let spread = (h.transpose() * seen)[(0, 0)] + variance;
            let gain = seen / spread;
            self.x += gain * (read - expected);
            // Joseph's form keeps the covariance positive.
            let rest = SMatrix::<f64, N, N>::identity() - gain * h.transpose();
            self.p = rest * self.p * rest.transpose() + gain * gain.transpose() * variance;
        }
    }

    /// What will have come off the lip if the wrist goes on as it is for `delay_s` and then turns back at a rate, m^3.
    pub(super) fn after_turning_back_m3(
        &self,
        tilt_rad: f64,
        delay_s: f64,
        back_rad_s: f64,
    ) -> Result<f64, PourError> {
        let step = 0.01;
        let (mut x, mut tilt, mut t) = (self.x, tilt_rad, 0.0);
        let begin = self.x[PASSED];
        loop {
            let flow = self.flow_ml_s(tilt, &x)?;
            x[PASSED] += step * flow;
            t += step;
            if t > delay_s {
                tilt -= back_rad_s * step;
            }
            if tilt <= 0.0 || t > delay_s + 3.0 || (t > delay_s && flow < 1e-3) {
                break;
            }
        }
        Ok((begin.max(self.x[OFF]) + x[PASSED] - begin) * ML)
    }
}
