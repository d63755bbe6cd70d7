//! When a slip begins: the mean shear starts to run.
//!
//! Page's cumulative sum (1954, doi:10.1093/biomet/41.1-2.100) on the mean shear's change from picture to picture, in standard
//! deviations of its noise; both axes are watched, either sign. The sum rises with changes above half of the wanted rate and
//! falls back to zero without; it alarms at a height that makes false alarms as rare as asked for, by Siegmund's approximation
//! (1985, *Sequential Analysis*, eq. 2.57).

/// Why there is no detector.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what} is {got}; expected a finite number above {above}")]
pub struct SlipError {
    /// Which setting.
    pub what: &'static str,
    /// What it is.
    pub got: f64,
    /// What it has to exceed.
    pub above: f64,
}

/// Watches the mean shear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlipDetector {
    sigma: f64,
    drift: f64,
    height: f64,
    sums: [[f64; 2]; 2],
    began: [[f64; 2]; 2],
    last: Option<[f64; 2]>,
}

/// A slip that was noticed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slip {
    /// When it was noticed, s.
    pub noticed_s: f64,
    /// When it began, s: since then the sum has not been zero.
    pub began_s: f64,
}

impl SlipDetector {
    /// Noise `sigma` of the mean shear's change from picture to picture; the least change a picture that is to be noticed, in the
    /// same unit; mean number of pictures (above 10) between false alarms.
    ///
    /// # Errors
    /// [`SlipError`].
    pub fn new(sigma: f64, least_change: f64, pictures_between_alarms: f64) -> Result<Self, SlipError> {
        let settings = [
            ("the noise", sigma, 0.0),
            ("the least change", least_change, 0.0),
            ("the number of pictures between false alarms", pictures_between_alarms, 10.0),
        ];
        for (what, got, above) in settings {
            if !(got > above && got.is_finite()) {
                return Err(SlipError { what, got, above });
            }
        }
        let drift = 0.5 * least_change / sigma;
        // Four one-sided sums share the false alarms.
        let height = height(drift, 4.0 * pictures_between_alarms);
        Ok(Self { sigma, drift, height, sums: [[0.0; 2]; 2], began: [[0.0; 2]; 2], last: None })
    }

    /// Takes in the mean shear at a time; says when a slip is noticed, and starts afresh. A shear that is no number is passed
    /// over.
    pub fn push(&mut self, t_s: f64, shear: [f64; 2]) -> Option<Slip> {
        if !shear.iter().all(|x| x.is_finite()) {
            return None;
        }
        let last = self.last.replace(shear).unwrap_or(shear);
        for axis in 0..2 {
            let change = (shear[axis] - last[axis]) / self.sigma;
            for (k, sign) in [1.0, -1.0].into_iter().enumerate() {
                let sum = &mut self.sums[axis][k];
                if *sum == 0.0 {
                    self.began[axis][k] = t_s;
                }
                *sum = (*sum + sign * change - self.drift).max(0.0);
                if *sum > self.height {
                    let slip = Slip { noticed_s: t_s, began_s: self.began[axis][k] };
                    self.reset();
                    return Some(slip);
                }
            }
        }
        None
    }

    /// Forgets what it has seen.
    pub fn reset(&mut self) {
        self.sums = [[0.0; 2]; 2];
        self.last = None;
    }
}

/// Height at which a one-sided sum of normal changes, less `drift` each, alarms once in `pictures` on average.
fn height(drift: f64, pictures: f64) -> f64 {
    let between = |h: f64| {
        let b = h + 1.166;
        ((2.0 * drift * b).exp() - 2.0 * drift * b - 1.0) / (2.0 * drift * drift)
    };
    let (mut low, mut high) = (0.0, 1.0);
    while between(high) < pictures && high < 1e6 {
        high *= 2.0;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if between(middle) < pictures { low = middle } else { high = middle }
    }
    high
}
