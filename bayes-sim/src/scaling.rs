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
            let (mean, sd) = mean_sd(&column);
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
            out.scale.push(if scale > 0.0 { scale } else { 1.0 });
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
        let columns = (0..u.dim()).map(|j| mean_sd(&u.column(j)));
        let (centre, scale) = columns.map(|(m, s)| (m, if s > 0.0 { s } else { 1.0 })).unzip();
        Self { centre, scale }
    }

    pub(crate) fn apply(&self, u: &[f64]) -> Vec<f64> {
        (0..u.len()).map(|j| (u[j] - self.centre[j]) / self.scale[j]).collect()
    }

    pub(crate) fn ln_scale(&self) -> f64 {
        self.scale.iter().map(|s| s.ln()).sum()
    }
}

pub(crate) fn mean_sd(values: &[f64]) -> (f64, f64) {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n;
    (mean, variance.sqrt())
}
