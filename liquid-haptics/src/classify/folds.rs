use rand::Rng;
use rand::seq::SliceRandom;

use super::svm::check;
use super::{Classifier, ClassifyError};

/// Predicted against true classes over all rows, each predicted by a machine that was not trained on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Confusion {
    /// The classes, in order.
    pub classes: Vec<String>,
    /// How often a class (row) was taken for a class (column).
    pub counts: Vec<Vec<usize>>,
    /// Share of the rows that were right, in each fold.
    pub fold_accuracy: Vec<f64>,
}

impl Confusion {
    /// Share of all rows that were right.
    pub fn accuracy(&self) -> f64 {
        let right: usize = (0..self.classes.len()).map(|k| self.counts[k][k]).sum();
        let all: usize = self.counts.iter().flatten().sum();
        right as f64 / all.max(1) as f64
    }

    /// Standard deviation of the folds' accuracies; [Matl 2021] writes twice this after its plus-minus.
    pub fn fold_deviation(&self) -> f64 {
        let n = self.fold_accuracy.len() as f64;
        let mean = self.fold_accuracy.iter().sum::<f64>() / n;
        let squares: f64 = self.fold_accuracy.iter().map(|a| (a - mean).powi(2)).sum();
        (squares / (n - 1.0).max(1.0)).sqrt()
    }
}

/// Cross-validation in `folds` parts that each hold their share of every class; who is in which part comes from `rng`.
///
/// Features are standardised within each training part, so that no part knows of the one it is tried on.
///
/// # Errors
/// [`ClassifyError`]; [`ClassifyError::TooFew`] for less than two folds or a class with fewer rows than folds.
pub fn cross_validate(
    rows: &[Vec<f64>],
    labels: &[String],
    penalty: f64,
    folds: usize,
    rng: &mut impl Rng,
) -> Result<Confusion, ClassifyError> {
    check(rows, labels)?;
    if folds < 2 {
        return Err(ClassifyError::TooFew { what: "folds", got: folds, least: 2 });
    }
    let mut classes = labels.to_vec();
    classes.sort();
    classes.dedup();
    let mut fold_of = vec![0; rows.len()];
    let mut next = 0;
    for class in &classes {
        let mut members: Vec<usize> = (0..rows.len()).filter(|&i| labels[i] == *class).collect();
        if members.len() < folds {
            return Err(ClassifyError::TooFew { what: "rows of a class", got: members.len(), least: folds });
        }
        members.shuffle(rng);
        for i in members {
            fold_of[i] = next % folds;
            next += 1;
        }
    }
    let mut counts = vec![vec![0; classes.len()]; classes.len()];
    let mut fold_accuracy = Vec::with_capacity(folds);
    let place = |label: &str| classes.iter().position(|c| c == label).unwrap_or(0);
    for fold in 0..folds {
        let train: Vec<usize> = (0..rows.len()).filter(|&i| fold_of[i] != fold).collect();
        let train_rows: Vec<Vec<f64>> = train.iter().map(|&i| rows[i].clone()).collect();
        let train_labels: Vec<String> = train.iter().map(|&i| labels[i].clone()).collect();
        let machine = Classifier::fit(&train_rows, &train_labels, penalty)?;
        let (mut right, mut all) = (0, 0);
        for i in (0..rows.len()).filter(|&i| fold_of[i] == fold) {
            let said = machine.predict(&rows[i])?;
            counts[place(&labels[i])][place(said)] += 1;
            right += usize::from(said == labels[i]);
            all += 1;
        }
        fold_accuracy.push(right as f64 / all as f64);
    }
    Ok(Confusion { classes, counts, fold_accuracy })
}
