//! What was calibrated: a fitted curve says nothing beyond its samples.

/// A question beyond what was calibrated.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what} is {got}; calibrated from {low} to {high}")]
pub struct Beyond {
    /// Which quantity.
    pub what: &'static str,
    /// What was asked for.
    pub got: f64,
    /// Least calibrated value.
    pub low: f64,
    /// Greatest calibrated value.
    pub high: f64,
}

/// The range of a calibrated quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibrated {
    what: &'static str,
    low: f64,
    high: f64,
    slack: f64,
}

impl Calibrated {
    /// The range of some values; `slack` is the part of it that may be asked for beyond either end.
    pub fn over(what: &'static str, values: impl IntoIterator<Item = f64>, slack: f64) -> Self {
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = values.into_iter().fold(ends, |r, x| (r.0.min(x), r.1.max(x)));
        Self { what, low, high, slack: slack * (high - low) }
    }

    /// Least calibrated value.
    pub fn low(&self) -> f64 {
        self.low
    }

    /// Greatest calibrated value.
    pub fn high(&self) -> f64 {
        self.high
    }

    /// Whether a value may be asked for; a number that is none may not.
    ///
    /// # Errors
    /// [`Beyond`].
    pub fn check(&self, got: f64) -> Result<(), Beyond> {
        let Self { what, low, high, slack } = *self;
        if got >= low - slack && got <= high + slack { Ok(()) } else { Err(Beyond { what, got, low, high }) }
    }
}

/// The different ones of some values, rising.
pub fn distinct(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

#[cfg(test)]
mod tests {
    use super::{Beyond, Calibrated, distinct};

    #[test]
    fn ends_slack_and_numbers_that_are_none() {
        let range = Calibrated::over("the pressure", [3.0, 1.0, 2.0], 0.05);
        assert_eq!((range.low(), range.high()), (1.0, 3.0));
        assert!(range.check(1.0).is_ok() && range.check(3.09).is_ok() && range.check(0.91).is_ok());
        let beyond = Beyond { what: "the pressure", got: 3.2, low: 1.0, high: 3.0 };
        assert_eq!(range.check(3.2), Err(beyond));
        assert!(range.check(f64::NAN).is_err() && Calibrated::over("none", [], 0.1).check(0.0).is_err());
        assert_eq!(distinct([2.0, 1.0, 2.0]), [1.0, 2.0]);
    }
}
