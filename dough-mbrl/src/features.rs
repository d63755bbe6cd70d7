//! Polynomial features of standardised inputs.

/// All monomials of `inputs` variables from one degree to another, each variable standardised by a mean and a scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    mean: Vec<f64>,
    scale: Vec<f64>,
    /// Powers of each variable, term by term, by degree.
    powers: Vec<Vec<u8>>,
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
        let mut powers = vec![vec![0; inputs]];
        let mut last = powers.clone();
        for _ in 0..degree {
            let mut next = Vec::new();
            for term in &last {
                // Each monomial once: a variable is multiplied in only after those that are already there.
                let from = term.iter().rposition(|&p| p > 0).unwrap_or(0);
                for k in from..inputs {
                    let mut more = term.clone();
                    more[k] += 1;
                    next.push(more);
                }
            }
            powers.extend(next.iter().cloned());
            last = next;
        }
        Self { mean, scale, powers }
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
        let z: Vec<f64> =
            row.iter().zip(self.mean.iter().zip(&self.scale)).map(|(x, (m, s))| (x - m) / s).collect();
        let product = |p: &Vec<u8>| z.iter().zip(p).map(|(z, &p)| z.powi(i32::from(p))).product();
        self.powers.iter().map(product).collect()
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
