//! How the particle filter behaves.

use super::error::TrackError;

/// How impacts are heard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HearingError {
    /// Standard deviation of each coordinate of a place that was heard well, m. Above zero.
    pub sigma_m: f64,
    /// Probability that a place is misheard, within (0, 1).
    pub outliers: f64,
    /// Standard deviation of each coordinate of a misheard place, m. Above zero.
    pub outlier_sigma_m: f64,
    /// Standard deviation of a time, s. Above zero.
    pub time_sigma_s: f64,
    /// Probability that an impact is not heard at all, within (0, 1).
    pub unheard: f64,
    /// Probability that a sound is no impact, within (0, 1).
    pub spurious: f64,
}

impl Default for HearingError {
    /// A mean error of 7.9 mm beside the outliers, as that of [Matl 2021], figure 4.3, in real time.
    fn default() -> Self {
        Self {
            sigma_m: 6.3e-3,
            outliers: 0.15,
            outlier_sigma_m: 0.12,
            time_sigma_s: 5e-4,
            unheard: 0.03,
            spurious: 0.02,
        }
    }
}

/// How the filter behaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterSettings {
    /// Particles, 1 to 10,000.
    pub particles: usize,
    /// Impacts to look ahead, 1 to 20.
    pub ahead: usize,
    /// How impacts are heard.
    pub hearing: HearingError,
    /// Relative standard deviation of a speed after an impact beyond what restitution and scatter make of it: drag, a restitution that
    /// depends on the speed. Above zero.
    pub speed_sigma: f64,
    /// Mean velocity along the table after the first impact of a throw, m/s.
    pub throw_m_s: [f64; 2],
    /// Standard deviation of each component of that velocity, m/s. Above zero.
    pub throw_sigma_m_s: f64,
    /// Median duration of the first flight between two impacts, s, and standard deviation of its logarithm. Above zero.
    pub first_flight: [f64; 2],
    /// How far from the paddle's middle a ball is still touched, m. Above zero.
    pub touch_m: f64,
    /// Probability of touching the ball that a m^2/s of the paddle's energy is worth, s/m^2. Zero or more.
    pub energy_price_s_m2: f64,
}

impl Default for FilterSettings {
    fn default() -> Self {
        Self {
            particles: 600,
            ahead: 8,
            hearing: HearingError::default(),
            speed_sigma: 0.006,
            throw_m_s: [0.5, 0.0],
            throw_sigma_m_s: 0.3,
            first_flight: [0.37, 0.2],
            touch_m: 0.07,
            energy_price_s_m2: 4.0,
        }
    }
}

impl FilterSettings {
    /// Whether all values are within their ranges.
    ///
    /// # Errors
    /// [`TrackError::Value`] names the first that is not.
    pub fn check(&self) -> Result<(), TrackError> {
        let value = |what, got: f64, expected, ok: bool| {
            if ok { Ok(()) } else { Err(TrackError::Value { what, expected, got }) }
        };
        let n = self.particles;
        value("the number of particles", n as f64, "1 to 10,000", (1..=10_000).contains(&n))?;
        value("impacts to look ahead", self.ahead as f64, "1 to 20", (1..=20).contains(&self.ahead))?;
        let h = &self.hearing;
        for (what, v) in [
            ("sigma_m", h.sigma_m),
            ("outlier_sigma_m", h.outlier_sigma_m),
            ("time_sigma_s", h.time_sigma_s),
            ("speed_sigma", self.speed_sigma),
            ("throw_sigma_m_s", self.throw_sigma_m_s),
            ("the first flight's duration", self.first_flight[0]),
            ("the first flight's sigma", self.first_flight[1]),
            ("touch_m", self.touch_m),
        ] {
            value(what, v, "a finite number above 0", v > 0.0 && v.is_finite())?;
        }
        for (what, v) in [("outliers", h.outliers), ("unheard", h.unheard), ("spurious", h.spurious)] {
            value(what, v, "a probability above 0 and below 1", v > 0.0 && v < 1.0)?;
        }
        for v in self.throw_m_s {
            value("throw_m_s", v, "a finite number", v.is_finite())?;
        }
        let price = self.energy_price_s_m2;
        value("energy_price_s_m2", price, "a finite number of 0 or more", price >= 0.0 && price.is_finite())
    }
}
