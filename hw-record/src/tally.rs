/// What came of a stream: how much, how evenly, and how its clock runs beside this computer's.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tally {
    /// Readings.
    pub readings: u64,
    /// Gaps: steps of the device's clock of more than 1.5 times the usual one.
    pub gaps: u64,
    /// Readings that are missing in them, by the usual step.
    pub missing: u64,
    /// The longest gap, s.
    pub longest_s: f64,
    /// Errors that the device gave, and the last of them.
    pub errors: u64,
    /// The last error.
    pub last_error: Option<String>,
    first: Option<[f64; 2]>,
    last: [f64; 2],
    /// The first steps, of which the middle one is the usual one.
    steps: Vec<f64>,
    usual_s: Option<f64>,
    /// Sums of device times, arrivals, squares and products, for a line.
    sums: [f64; 4],
}

/// Steps that are looked at before one is usual.
const STEPS: usize = 51;

impl Tally {
    /// Counts a reading by its arrival and its device's time, s.
    pub fn count(&mut self, arrival_s: f64, device_s: f64) {
        self.readings += 1;
        let first = *self.first.get_or_insert([arrival_s, device_s]);
        if self.readings > 1 {
            self.step(device_s - self.last[1]);
        }
        self.last = [arrival_s, device_s];
        let (x, y) = (device_s - first[1], arrival_s - first[0]);
        self.sums = [self.sums[0] + x, self.sums[1] + y, self.sums[2] + x * x, self.sums[3] + x * y];
    }

    /// Counts an error.
    pub fn fail(&mut self, error: String) {
        self.errors += 1;
        self.last_error = Some(error);
    }

    fn step(&mut self, step_s: f64) {
        let Some(usual) = self.usual_s else {
            self.steps.push(step_s);
            if self.steps.len() == STEPS {
                self.steps.sort_by(f64::total_cmp);
                self.usual_s = self.steps.get(STEPS / 2).copied();
                for step in std::mem::take(&mut self.steps) {
                    self.step(step);
                }
            }
            return;
        };
        if step_s > 1.5 * usual {
            self.gaps += 1;
            self.missing += (step_s / usual).round() as u64 - 1;
            self.longest_s = self.longest_s.max(step_s);
        }
    }

    /// The usual step of the device's clock, s; none of fewer than 52 readings.
    pub fn usual_step_s(&self) -> Option<f64> {
        self.usual_s
    }

    /// By how much this computer's clock is faster than the device's, as a share: the slope of arrivals over device times, less one.
    /// None of readings over less than a second.
    pub fn drift(&self) -> Option<f64> {
        let first = self.first?;
        let (n, [x, y, xx, xy]) = (self.readings as f64, self.sums);
        let spread = xx - x * x / n;
        (self.last[1] - first[1] >= 1.0 && spread > 0.0).then(|| (xy - x * y / n) / spread - 1.0)
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} readings", self.readings)?;
        if let Some(usual) = self.usual_s.filter(|s| *s > 0.0) {
            write!(f, " at {:.1} Hz", 1.0 / usual)?;
        }
        write!(f, ", {} gaps", self.gaps)?;
        if self.gaps > 0 {
            write!(f, " ({} readings missing, the longest {:.3} s)", self.missing, self.longest_s)?;
        }
        if let Some(drift) = self.drift() {
            write!(f, ", this computer's clock is {:+.0} ppm off the device's", 1e6 * drift)?;
        }
        if let Some(error) = &self.last_error {
            write!(f, ", {} errors, the last: {error}", self.errors)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_and_drift_are_what_they_are() {
        let mut tally = Tally::default();
        for k in 0..5000u32 {
            // Seven readings are lost at one place, one at another; the computer's clock is 200 ppm fast.
            if (100..107).contains(&k) || k == 3000 {
                continue;
            }
            let t = 1e-3 * f64::from(k);
            tally.count(50.0 + t * 1.0002, 7.0 + t);
        }
        assert_eq!((tally.readings, tally.gaps, tally.missing), (4992, 2, 8));
        assert!((tally.longest_s - 8e-3).abs() < 1e-9);
        assert!((tally.drift().unwrap_or(0.0) - 2e-4).abs() < 1e-9);
    }

    #[test]
    fn few_readings_have_no_usual_step_and_no_drift() {
        let mut tally = Tally::default();
        assert_eq!((tally.drift(), tally.usual_step_s()), (None, None));
        tally.count(1.0, 1.0);
        tally.count(1.1, 1.1);
        assert_eq!((tally.drift(), tally.gaps), (None, 0));
    }
}
