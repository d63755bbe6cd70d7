//! Polynomial features of standardised inputs.

/// All monomials of `inputs` variables from one degree to another, each variable standardised by a mean and a scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    mean: Vec<f64>,
    scale: Vec<f64>,
    /// Powers of each variable, term by term, by degree.
    powers: Vec<Vec<u8>>,
    /// Each term but the first is an earlier one times a variable.
    parents: Vec<(usize, usize)>,
}

impl Polynomial {
    /// The monomials of degrees `0..=degree` of the variables' rows, which also set their means and scales.
    ///
    /// A variable that never changes keeps a scale of one.
    pub fn standardised(rows: &[Vec<f64>], degree: u8) -> Self {
        let inputs = rows.first().map_or(0, Vec::len);
        let n = rows.len().max(1) as f64;
        let mean: Vec<f64> = (0..inputs).map(|k| rows.iter().map(|r| r[k]).sum::<f64>() / n).collect();
        let scale = (0..inputs)
            .map(|k| {
                let spread = (rows.iter().map(|r| (r[k] - mean[k]).powi(2)).sum::<f64>() / n).sqrt();
                if spread > 1e-12 * mean[k].abs().max(f64::MIN_POSITIVE) { spread } else { 1.0 }
            })
            .collect();
        let (mut powers, mut parents) = (vec![vec![0; inputs]], Vec::new());
        let mut first = 0;
        for _ in 0..degree {
            let end = powers.len();
            for parent in first..end {
                // Each monomial once: a variable is multiplied in only after those that are already there.
                let from = powers[parent].iter().rposition(|&p: &u8| p > 0).unwrap_or(0);
                for k in from..inputs {
                    let mut more = powers[parent].clone();
                    more[k] += 1;
                    powers.push(more);
                    parents.push((parent, k));
                }
            }
            first = end;
        }
        Self { mean, scale, powers, parents }
    }

    /// Gives a variable the scale of another one.
    pub fn scale_as(&mut self, variable: usize, other: usize) {
        if let Some(&scale) = self.scale.get(other)
            && let Some(own) = self.scale.get_mut(variable)
        {
            *own = scale;
        }
    }

    /// The value of a variable that lies one scale above its mean; NaN where there is no such variable.
    pub fn one_off(&self, variable: usize) -> f64 {
        self.mean.get(variable).zip(self.scale.get(variable)).map_or(f64::NAN, |(mean, scale)| mean + scale)
    }

    /// The power of a variable in a term; 0 where there is no such term or variable.
    pub fn power(&self, term: usize, variable: usize) -> u8 {
        self.powers.get(term).and_then(|powers| powers.get(variable)).copied().unwrap_or(0)
    }

    /// Number of terms.
    pub fn len(&self) -> usize {
        self.powers.len()
    }

    /// Whether there are no terms; never, since the constant is one.
    pub fn is_empty(&self) -> bool {
        self.powers.is_empty()
    }

    /// Number of terms up to a degree; they come first.
    pub fn up_to(&self, degree: u8) -> usize {
        self.powers.iter().filter(|p| p.iter().sum::<u8>() <= degree).count()
    }

    /// The terms at a row of the variables.
    pub fn terms(&self, row: &[f64]) -> Vec<f64> {
        // What is missing of a row counts as its mean.
        let standard = |(k, mean): (usize, &f64)| row.get(k).map_or(0.0, |x| (x - mean) / self.scale[k]);
        let z: Vec<f64> = self.mean.iter().enumerate().map(standard).collect();
        let mut terms = Vec::with_capacity(self.powers.len());
        terms.push(1.0);
        for &(parent, k) in &self.parents {
            terms.push(terms[parent] * z[k]);
        }
        terms
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_monomial_is_there_once() {
        let rows = vec![vec![1.0, 5.0, 2.0], vec![3.0, 5.0, 4.0]];
        let polynomial = Polynomial::standardised(&rows, 4);
        // Binomials (3 + d over d).
        assert_eq!([0, 1, 2, 3, 4].map(|d| polynomial.up_to(d)), [1, 4, 10, 20, 35]);
        let mut seen = polynomial.powers.clone();
        seen.sort();
        seen.dedup();
        assert_eq!(seen.len(), polynomial.len());
        // Means 2 and 3, scales 1 and 1; the constant variable keeps its unit.
        let terms = polynomial.terms(&[4.0, 5.5, 2.0]);
        assert_eq!(terms[..4], [1.0, 2.0, 0.5, -1.0]);
        assert_eq!(terms[4], 4.0);
    }
}
