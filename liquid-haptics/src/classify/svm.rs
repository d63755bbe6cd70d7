use smartcore::linalg::basic::matrix::DenseMatrix;
use smartcore::svm::Kernels;
use smartcore::svm::svc::{SVC, SVCParameters};

use super::ClassifyError;

/// Passes over the data: LASVM comes near the optimum in two, and stays there.
const EPOCHS: usize = 20;
/// Tolerance of the optimum's conditions, as in libsvm.
const TOLERANCE: f64 = 1e-3;
/// The solver shuffles; the same data give the same machine.
const SEED: u64 = 0;

/// A linear machine that tells several classes apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Classifier {
    classes: Vec<String>,
    mean: Vec<f64>,
    scale: Vec<f64>,
    pairs: Vec<Pair>,
}

/// Above 0 where it is the second class rather than the first.
#[derive(Debug, Clone, PartialEq)]
struct Pair {
    classes: [usize; 2],
    weights: Vec<f64>,
    bias: f64,
}

impl Classifier {
    /// Learns from rows of features and their labels; `penalty` is C, the price of a row within the margin, above 0 (1 is usual).
    ///
    /// # Errors
    /// [`ClassifyError`].
    pub fn fit(rows: &[Vec<f64>], labels: &[String], penalty: f64) -> Result<Self, ClassifyError> {
        let columns = check(rows, labels)?;
        if !(penalty > 0.0 && penalty.is_finite()) {
            return Err(ClassifyError::Penalty { got: penalty });
        }
        let mut classes = labels.to_vec();
        classes.sort();
        classes.dedup();
        if classes.len() < 2 {
            return Err(ClassifyError::TooFew { what: "classes", got: classes.len(), least: 2 });
        }
        let count = rows.len() as f64;
        let mean: Vec<f64> = (0..columns).map(|j| rows.iter().map(|r| r[j]).sum::<f64>() / count).collect();
        let scale: Vec<f64> = (0..columns)
            .map(|j| (rows.iter().map(|r| (r[j] - mean[j]).powi(2)).sum::<f64>() / count).sqrt())
            // A feature that never changes tells nothing.
            .map(|s| if s > 0.0 { s } else { 1.0 })
            .collect();
        let mut machine = Self { classes, mean, scale, pairs: Vec::new() };
        let scaled: Vec<Vec<f64>> = rows.iter().map(|r| machine.standardised(r)).collect();
        for second in 1..machine.classes.len() {
            for first in 0..second {
                let pair = pair(&scaled, labels, &machine.classes, [first, second], penalty)?;
                machine.pairs.push(pair);
            }
        }
        Ok(machine)
    }

    /// The classes, in order.
    pub fn classes(&self) -> &[String] {
        &self.classes
    }

    /// The class of a row of features.
    ///
    /// # Errors
    /// [`ClassifyError::Length`] and [`ClassifyError::Feature`].
    pub fn predict(&self, row: &[f64]) -> Result<&str, ClassifyError> {
        finite(0, row, self.mean.len())?;
        let scaled = self.standardised(row);
        let mut votes = vec![(0, 0.0); self.classes.len()];
        for pair in &self.pairs {
            let margin = pair.bias + pair.weights.iter().zip(&scaled).map(|(w, x)| w * x).sum::<f64>();
            let winner = pair.classes[usize::from(margin > 0.0)];
            votes[winner].0 += 1;
            votes[winner].1 += margin.abs();
        }
        let best = (0..votes.len())
            .max_by(|&a, &b| votes[a].0.cmp(&votes[b].0).then(votes[a].1.total_cmp(&votes[b].1)))
            .unwrap_or(0);
        Ok(&self.classes[best])
    }

    fn standardised(&self, row: &[f64]) -> Vec<f64> {
        let moments = self.mean.iter().zip(&self.scale);
        row.iter().zip(moments).map(|(x, (mean, scale))| (x - mean) / scale).collect()
    }
}

/// The machine of one pair of classes.
fn pair(
    rows: &[Vec<f64>],
    labels: &[String],
    classes: &[String],
    [first, second]: [usize; 2],
    penalty: f64,
) -> Result<Pair, ClassifyError> {
    let failed = |error: smartcore::error::Failed| ClassifyError::Solver(error.to_string());
    let (mut members, mut sides) = (Vec::new(), Vec::new());
    for (row, label) in rows.iter().zip(labels) {
        if *label == classes[first] || *label == classes[second] {
            members.push(row.clone());
            sides.push(if *label == classes[second] { 1 } else { -1 });
        }
    }
    let columns = rows[0].len();
    let x = DenseMatrix::from_2d_vec(&members).map_err(failed)?;
    let settings = SVCParameters::default()
        .with_c(penalty)
        .with_kernel(Kernels::linear())
        .with_epoch(EPOCHS)
        .with_tol(TOLERANCE)
        .with_seed(Some(SEED));
    // A linear machine is its values at the origin and at the ends of the unit vectors: kept as numbers, it borrows nothing.
    let mut probes = vec![vec![0.0; columns]; columns + 1];
    (0..columns).for_each(|j| probes[j + 1][j] = 1.0);
    let probes = DenseMatrix::from_2d_vec(&probes).map_err(failed)?;
    let machine = SVC::fit(&x, &sides, &settings).map_err(failed)?;
    let values = machine.decision_function(&probes).map_err(failed)?;
    let bias = values[0];
    Ok(Pair { classes: [first, second], weights: values[1..].iter().map(|v| v - bias).collect(), bias })
}

/// How many features every row has.
pub(super) fn check(rows: &[Vec<f64>], labels: &[String]) -> Result<usize, ClassifyError> {
    if rows.len() != labels.len() {
        return Err(ClassifyError::Labels { labels: labels.len(), rows: rows.len() });
    }
    let columns = rows.first().map_or(0, Vec::len);
    if columns == 0 {
        return Err(ClassifyError::TooFew { what: "features", got: columns, least: 1 });
    }
    for (i, row) in rows.iter().enumerate() {
        finite(i, row, columns)?;
    }
    Ok(columns)
}

fn finite(row: usize, features: &[f64], expected: usize) -> Result<(), ClassifyError> {
    if features.len() != expected {
        return Err(ClassifyError::Length { row, got: features.len(), expected });
    }
    match features.iter().position(|f| !f.is_finite()) {
        Some(column) => Err(ClassifyError::Feature { row, column, got: features[column] }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// Points (0, 0) and (2, 0), (2, 2) on either side: the widest margin lies halfway, at x = 1; worked out by hand, standardised
    /// as the machine does.
    #[test]
    fn the_margin_is_the_widest() {
        let rows = vec![vec![0.0, 0.0], vec![0.0, 2.0], vec![2.0, 0.0], vec![2.0, 2.0]];
        let labels = ["a", "a", "b", "b"].map(str::to_owned);
        let machine = Classifier::fit(&rows, &labels, 100.0).unwrap();
        let pair = &machine.pairs[0];
        // x is standardised to -1 and 1: the weight is 1, the bias 0.
        assert!((pair.weights[0] - 1.0).abs() < 1e-3 && pair.weights[1].abs() < 1e-3, "{pair:?}");
        assert!(pair.bias.abs() < 1e-3);
        assert_eq!(machine.predict(&[0.9, 7.0]).unwrap(), "a");
        assert_eq!(machine.predict(&[1.1, -7.0]).unwrap(), "b");
    }
}
