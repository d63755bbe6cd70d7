//! Standardisation of what goes into a network and of what comes out.

use serde::{Deserialize, Serialize};

use crate::points::Points;

/// Features on a common scale. One with heavy tails (kurtosis above 8) is centred at its median and pressed by `asinh`, so that
/// a few wild values neither set the scale nor reach the network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct InputScaling {
    centre: Vec<f64>,
    scale: Vec<f64>,
    heavy: Vec<bool>,
}

/// No input is further than this many standard deviations out for the network.
const REACH: f64 = 10.0;

impl InputScaling {
    pub(crate) fn fit(x: &Points) -> Self {
        let mut out = Self { centre: Vec::new(), scale: Vec::new(), heavy: Vec::new() };
        for j in 0..x.dim() {
            let mut column = x.column(j);
            let (mean, sd) = centre_scale(&column);
            let kurtosis =
                column.iter().map(|v| ((v - mean) / sd).powi(4)).sum::<f64>() / column.len() as f64;
            let heavy = kurtosis > 8.0;
            let (mut centre, mut scale) = (mean, sd);
            if heavy {
                column.sort_by(f64::total_cmp);
                let at = |q: f64| column[((column.len() - 1) as f64 * q) as usize];
                let spread = (at(0.75) - at(0.25)) / 1.349;
                if spread > 0.0 {
                    (centre, scale) = (at(0.5), spread);
                }
            }
            out.centre.push(centre);
            out.scale.push(scale);
            out.heavy.push(heavy);
        }
        out
    }

    pub(crate) fn dim(&self) -> usize {
        self.centre.len()
    }

    pub(crate) fn apply(&self, x: &[f64], out: &mut Vec<f64>) {
        for (j, &v) in x.iter().enumerate() {
            let z = (v - self.centre[j]) / self.scale[j];
            let z = if self.heavy[j] { z.asinh() } else { z };
            out.push(z.clamp(-REACH, REACH));
        }
    }
}

/// Centre and scale of each coordinate of the targets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct OutputScaling {
    pub(crate) centre: Vec<f64>,
    pub(crate) scale: Vec<f64>,
}

impl OutputScaling {
    pub(crate) fn fit(u: &Points) -> Self {
        let (centre, scale) = (0..u.dim()).map(|j| centre_scale(&u.column(j))).unzip();
        Self { centre, scale }
    }

    pub(crate) fn apply(&self, u: &[f64]) -> Vec<f64> {
        (0..u.len()).map(|j| (u[j] - self.centre[j]) / self.scale[j]).collect()
    }

    pub(crate) fn ln_scale(&self) -> f64 {
        self.scale.iter().map(|s| s.ln()).sum()
    }
}

/// Mean and standard deviation; for a column that never changes that value and 1, since the rounding of its mean is no scale.
fn centre_scale(values: &[f64]) -> (f64, f64) {
    let (mean, sd) = mean_sd(values);
    match values.first() {
        Some(first) if values.iter().all(|v| v == first) => (*first, 1.0),
        _ => (mean, if sd > 0.0 { sd } else { 1.0 }),
    }
}

pub(crate) fn mean_sd(values: &[f64]) -> (f64, f64) {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n;
    (mean, variance.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0.1 a thousand times has a mean that is not 0.1, but no spread: what is a little off is no 10 standard deviations off.
    #[test]
    fn a_column_that_never_changes_has_no_scale() {
        let column = vec![0.1; 1000];
        assert!(mean_sd(&column).1 > 0.0);
        let x = Points::from_values(1, column).unwrap_or_else(|e| panic!("{e}"));
        let mut z = Vec::new();
        InputScaling::fit(&x).apply(&[0.1 + 1e-9], &mut z);
        assert!(z[0].abs() < 1e-8, "{z:?}");
        assert_eq!(OutputScaling::fit(&x).apply(&[0.1]), [0.0]);
    }
}
