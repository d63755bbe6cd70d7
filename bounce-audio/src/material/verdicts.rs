//! How good answers are: counted, and whether probabilities are what they say.

use super::error::MaterialError;

/// Least probability that counts in the log loss.
const LEAST: f64 = 1e-12;

/// Answers whose truth is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdicts {
    materials: usize,
    said: Vec<(usize, Vec<f64>)>,
}

/// Answers whose largest probability lies in one interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reliability {
    /// Mean of the largest probability, 0 to 1.
    pub confidence: f64,
    /// Share of these answers that are right, 0 to 1.
    pub right: f64,
    /// How many there are.
    pub count: usize,
}

impl Verdicts {
    /// None yet, for a number of materials.
    pub fn new(materials: usize) -> Self {
        Self { materials, said: Vec::new() }
    }

    /// One more: the true material (from 0) and the probabilities that were said.
    ///
    /// # Errors
    /// [`MaterialError::Materials`] for another number of materials.
    pub fn add(&mut self, truth: usize, probabilities: &[f64]) -> Result<(), MaterialError> {
        let got = if truth < self.materials { probabilities.len() } else { truth + 1 };
        if got != self.materials {
            return Err(MaterialError::Materials { what: "an answer", expected: self.materials, got });
        }
        self.said.push((truth, probabilities.to_vec()));
        Ok(())
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.said.len()
    }

    /// How often each material (rows) was said to be each (columns: the most probable).
    pub fn confusion(&self) -> Vec<Vec<usize>> {
        let mut counts = vec![vec![0; self.materials]; self.materials];
        for (truth, p) in &self.said {
            counts[*truth][best(p).0] += 1;
        }
        counts
    }

    /// Share that are right, 0 to 1; NaN of none.
    pub fn accuracy(&self) -> f64 {
        let right = self.said.iter().filter(|(truth, p)| best(p).0 == *truth).count();
        right as f64 / self.said.len() as f64
    }

    /// Mean of the negative logarithm of the true material's probability, nats; of equal guesses it is the logarithm of their number.
    pub fn log_loss(&self) -> f64 {
        let sum: f64 = self.said.iter().map(|(truth, p)| -p[*truth].max(LEAST).ln()).sum();
        sum / self.said.len() as f64
    }

    /// How right answers are against how sure they are, in intervals of equal width from 0 to 1; empty ones are left out.
    pub fn reliability(&self, intervals: usize) -> Vec<Reliability> {
        let mut sums = vec![(0.0, 0, 0); intervals.max(1)];
        for (truth, p) in &self.said {
            let (material, confidence) = best(p);
            let at = ((confidence * intervals as f64) as usize).min(sums.len() - 1);
            sums[at].0 += confidence;
            sums[at].1 += usize::from(material == *truth);
            sums[at].2 += 1;
        }
        let one = |(sum, right, count): (f64, usize, usize)| Reliability {
            confidence: sum / count as f64,
            right: right as f64 / count as f64,
            count,
        };
        sums.into_iter().filter(|s| s.2 > 0).map(one).collect()
    }

    /// Expected calibration error: mean difference of how sure and how right, weighed by count (Naeini, Cooper and Hauskrecht 2015, AAAI 29,
    /// 2901).
    pub fn calibration_error(&self, intervals: usize) -> f64 {
        let off = |r: Reliability| r.count as f64 * (r.confidence - r.right).abs();
        self.reliability(intervals).into_iter().map(off).sum::<f64>() / self.said.len() as f64
    }
}

fn best(p: &[f64]) -> (usize, f64) {
    p.iter().enumerate().fold((0, f64::NEG_INFINITY), |a, (k, v)| if *v > a.1 { (k, *v) } else { a })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    #[test]
    fn what_is_counted_is_what_was_said() {
        let mut verdicts = Verdicts::new(2);
        for (truth, p) in [(0, 0.8), (0, 0.8), (1, 0.8), (1, 0.1)] {
            verdicts.add(truth, &[p, 1.0 - p]).unwrap();
        }
        assert_eq!(verdicts.confusion(), vec![vec![2, 0], vec![1, 1]]);
        assert_eq!(verdicts.accuracy(), 0.75);
        let loss = -(2.0 * 0.8f64.ln() + 0.2f64.ln() + 0.9f64.ln()) / 4.0;
        approx::assert_relative_eq!(verdicts.log_loss(), loss, max_relative = 1e-12);
        // Three at 0.8, of which two are right, and one at 0.9 that is.
        let error = (3.0 * (0.8 - 2.0 / 3.0) + (1.0 - 0.9)) / 4.0;
        approx::assert_relative_eq!(verdicts.calibration_error(20), error, max_relative = 1e-12);
        assert!(verdicts.add(2, &[0.5, 0.5]).is_err());
        assert!(verdicts.add(0, &[1.0]).is_err());
    }
}
