//! What a network's outputs mean: K Gaussian components, and the negative log density of a target under them.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::normal::{LN_SQRT_2PI, ln_mass, truncated_quantile};
use crate::posterior::open_uniform;

/// Least standard deviation of a component, in standard deviations of the target: `exp(-MAX_LOG_PRECISION)`.
pub(crate) const MAX_LOG_PRECISION: f64 = 9.0;

/// K Gaussians with full covariance in `dim` dimensions, or, in one, each cut to an interval.
///
/// A component's outputs are `[logit, mean (dim), a (dim), l (dim (dim - 1) / 2)]`: with `r = target - mean`,
/// `y_i = exp(a_i) (r_i + sum_{j<i} l_ij r_j)` is standard normal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Head {
    pub(crate) dim: usize,
    pub(crate) components: usize,
    /// Bounds of the one dimension, if each component is cut to them; none for no bound on that side.
    pub(crate) cut: Option<[Option<f64>; 2]>,
}

/// Numbers that one evaluation needs; the memory serves the next one.
#[derive(Debug, Default)]
pub(crate) struct HeadScratch {
    log_terms: Vec<f64>,
    residual: Vec<f64>,
}

impl Head {
    /// Outputs of one component.
    pub(crate) fn stride(&self) -> usize {
        1 + 2 * self.dim + self.dim * (self.dim - 1) / 2
    }

    pub(crate) fn outputs(&self) -> usize {
        self.components * self.stride()
    }

    /// Outputs that are means.
    pub(crate) fn mean_rows(&self) -> Vec<usize> {
        self.rows(1)
    }

    /// Outputs that are log precisions.
    pub(crate) fn precision_rows(&self) -> Vec<usize> {
        self.rows(1 + self.dim)
    }

    /// `dim` outputs of each component, from `first`.
    fn rows(&self, first: usize) -> Vec<usize> {
        (0..self.components).flat_map(|k| (0..self.dim).map(move |i| k * self.stride() + first + i)).collect()
    }

    /// Bounds as numbers, infinite where there is none.
    pub(crate) fn interval(&self) -> Option<[f64; 2]> {
        self.cut.map(|[a, b]| [a.unwrap_or(f64::NEG_INFINITY), b.unwrap_or(f64::INFINITY)])
    }

    /// Negative log density of `target`.
    pub(crate) fn loss(&self, outputs: &[f64], target: &[f64], scratch: &mut HeadScratch) -> f64 {
        let stride = self.stride();
        let top = outputs.iter().step_by(stride).fold(f64::NEG_INFINITY, |m, &l| m.max(l));
        let total: f64 = outputs.iter().step_by(stride).map(|l| (l - top).exp()).sum();
        let ln_total = top + total.ln();
        scratch.log_terms.clear();
        scratch.residual.resize(self.dim, 0.0);
        for block in outputs.chunks_exact(stride).take(self.components) {
            let ln_density = self.component(block, target, &mut scratch.residual);
            scratch.log_terms.push(block[0] - ln_total + ln_density);
        }
        let best = scratch.log_terms.iter().fold(f64::NEG_INFINITY, |m, &l| m.max(l));
        let sum: f64 = scratch.log_terms.iter().map(|l| (l - best).exp()).sum();
        -(best + sum.ln())
    }

    /// Log density of one component.
    fn component(&self, block: &[f64], target: &[f64], residual: &mut [f64]) -> f64 {
        let d = self.dim;
        let (mean, a, l) = (&block[1..=d], &block[d + 1..=2 * d], &block[2 * d + 1..]);
        for i in 0..d {
            residual[i] = target[i] - mean[i];
        }
        let mut ln_density = -(d as f64) * LN_SQRT_2PI;
        let mut at = 0;
        for i in 0..d {
            let ln_precision = a[i].min(MAX_LOG_PRECISION);
            let dot: f64 = l[at..at + i].iter().zip(&*residual).map(|(l, r)| l * r).sum();
            let whitened = ln_precision.exp() * (residual[i] + dot);
            ln_density += ln_precision - 0.5 * whitened * whitened;
            at += i;
        }
        let cut = self.interval().and_then(|interval| cut_mass([block[1], block[2]], interval));
        ln_density - cut.map_or(0.0, |c| c.0)
    }

    /// A draw of the mixture that the outputs mean.
    pub(crate) fn draw<R: Rng>(&self, outputs: &[f64], out: &mut [f64], rng: &mut R) {
        let (d, stride) = (self.dim, self.stride());
        let logits = outputs.iter().step_by(stride);
        let top = logits.clone().fold(f64::NEG_INFINITY, |m, &l| m.max(l));
        let k = choose(logits.map(|l| (l - top).exp()), rng.random());
        let block = &outputs[k * stride..(k + 1) * stride];
        if let Some([low, high]) = self.interval() {
            let (mean, precision) = (block[1], self.precision(block, 0));
            let edges = [low, high].map(|b| precision * (b - mean));
            let z = truncated_quantile(edges[0], edges[1], open_uniform(rng));
            out[0] = (mean + z / precision).clamp(low, high);
            return;
        }
        // Residuals first: each needs those before it.
        let mut at = 2 * d + 1;
        for i in 0..d {
            let y: f64 = StandardNormal.sample(rng);
            let dot: f64 = block[at..at + i].iter().zip(&*out).map(|(l, r)| l * r).sum();
            out[i] = y / self.precision(block, i) - dot;
            at += i;
        }
        out.iter_mut().zip(&block[1..=d]).for_each(|(r, mean)| *r += mean);
    }

    /// `exp(a_i)` of one component, floored as in the loss.
    pub(crate) fn precision(&self, block: &[f64], i: usize) -> f64 {
        block[self.dim + 1 + i].min(MAX_LOG_PRECISION).exp()
    }
}

/// The index at which the running sum of the weights passes a share of their total.
pub(crate) fn choose(weights: impl Iterator<Item = f64> + Clone, share: f64) -> usize {
    let mut left = share * weights.clone().sum::<f64>();
    let mut last = 0;
    for (i, w) in weights.enumerate() {
        last = i;
        left -= w;
        if left <= 0.0 {
            break;
        }
    }
    last
}

/// `ln` of the mass that a one-dimensional component `[mean, a]` has within the interval, and its derivatives by the two; none where
/// all of it is inside.
pub(crate) fn cut_mass([mean, a]: [f64; 2], interval: [f64; 2]) -> Option<(f64, [f64; 2])> {
    let precision = a.min(MAX_LOG_PRECISION).exp();
    let [low, high] = interval.map(|b| precision * (b - mean));
    if low < -8.5 && high > 8.5 {
        return None;
    }
    let ln = ln_mass(low, high);
    let edge = |z: f64| if z.is_finite() { (-0.5 * z * z - LN_SQRT_2PI - ln).exp() } else { 0.0 };
    let (at_low, at_high) = (edge(low), edge(high));
    let times = |z: f64, e: f64| if z.is_finite() { z * e } else { 0.0 };
    let by_precision = if a < MAX_LOG_PRECISION { times(high, at_high) - times(low, at_low) } else { 0.0 };
    Some((ln, [precision * (at_low - at_high), by_precision]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::head_batch::BatchScratch;
    use crate::real::Real;
    use num_dual::{Dual64, DualNum};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// The same density written plainly, over dual numbers.
    fn reference(head: &Head, out: &[Dual64], target: &[f64]) -> Dual64 {
        let (d, stride) = (head.dim, head.stride());
        let mut weights = Dual64::from(0.0);
        let mut sum = Dual64::from(0.0);
        for block in out.chunks_exact(stride) {
            weights += block[0].exp();
            let mut q = Dual64::from(1.0);
            let mut at = 2 * d + 1;
            for i in 0..d {
                let mut y = -(block[1 + i] - target[i]);
                for j in 0..i {
                    y -= block[at] * (block[1 + j] - target[j]);
                    at += 1;
                }
                y *= block[d + 1 + i].exp();
                q *= block[d + 1 + i].exp() * (y * y * -0.5).exp() * 0.398_942_280_401_432_7;
            }
            sum += block[0].exp() * q;
        }
        -(sum / weights).ln()
    }

    /// The loss and its derivative as training has them.
    fn by_hand<T: Real>(head: &Head, out: &[f64], target: &[f64]) -> (f64, Vec<f64>) {
        let [out, target] = [out, target].map(|v| v.iter().map(|v| T::of(*v)).collect::<Vec<T>>());
        let mut gradient = vec![T::ZERO; out.len()];
        let loss = head.batch_loss(&out, &target, Some(&mut gradient), &mut BatchScratch::new(head));
        (loss, gradient.iter().map(|g| g.to_f64()).collect())
    }

    #[test]
    fn gradients_agree_with_dual_numbers() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for (dim, components) in [(1, 1), (1, 4), (2, 3), (4, 2)] {
            let head = Head { dim, components, cut: None };
            for _ in 0..20 {
                let out: Vec<f64> = (0..head.outputs()).map(|_| rng.random_range(-1.5..1.5)).collect();
                let target: Vec<f64> = (0..dim).map(|_| rng.random_range(-1.5..1.5)).collect();
                let (loss, by_hand) = by_hand::<f64>(&head, &out, &target);
                for (i, a) in by_hand.iter().enumerate() {
                    let seeded = out.iter().enumerate();
                    let dual: Vec<Dual64> =
                        seeded.map(|(j, &o)| Dual64::new(o, if i == j { 1.0 } else { 0.0 })).collect();
                    let value = reference(&head, &dual, &target);
                    assert!((loss - value.re).abs() < 1e-12 * value.re.abs().max(1.0));
                    let b = value.eps;
                    assert!((a - b).abs() < 1e-10 * b.abs().max(1.0), "{a} {b}");
                }
            }
        }
    }

    /// Cut components against finite differences, far outside the interval included; their density integrates to one.
    #[test]
    fn cut_components_are_normalised_and_differentiated() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for cut in [[Some(-1.0), Some(1.5)], [None, Some(0.5)], [Some(-0.3), None]] {
            let head = Head { dim: 1, components: 3, cut: Some(cut) };
            for far in [1.0, 6.0] {
                let out: Vec<f64> = (0..head.outputs()).map(|_| far * rng.random_range(-1.5..1.5)).collect();
                let loss = |o: &[f64], t: f64| head.loss(o, &[t], &mut HeadScratch::default());
                let by_hand = by_hand::<f64>(&head, &out, &[0.2]).1;
                for i in 0..out.len() {
                    let mut moved = out.clone();
                    moved[i] += 1e-5;
                    let up = loss(&moved, 0.2);
                    moved[i] -= 2e-5;
                    let slope = (up - loss(&moved, 0.2)) / 2e-5;
                    assert!(
                        (slope - by_hand[i]).abs() < 1e-5 * slope.abs().max(1.0),
                        "{slope} {}",
                        by_hand[i]
                    );
                }
                if far < 2.0 {
                    let [low, high] = cut.map(|c| c.unwrap_or(f64::NAN));
                    let (low, high) =
                        (if low.is_nan() { -200.0 } else { low }, if high.is_nan() { 200.0 } else { high });
                    let n = 4_000_000;
                    let h = (high - low) / f64::from(n);
                    let mut s = HeadScratch::default();
                    let sum: f64 = (0..n)
                        .map(|i| h * (-head.loss(&out, &[low + h * (f64::from(i) + 0.5)], &mut s)).exp())
                        .sum();
                    assert!((sum - 1.0).abs() < 1e-5, "{sum}");
                }
            }
        }
    }

    /// A batch, in double and in single precision, against one target after another; its length no multiple of the lanes.
    #[test]
    fn a_batch_is_the_sum_of_its_rows() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for (dim, cut) in [(1, Some([Some(-1.0), Some(1.0)])), (3, None)] {
            let (head, batch) = (Head { dim, components: 4, cut }, 37);
            let mut draw = |n: usize| (0..n).map(|_| rng.random_range(-1.0..1.0)).collect::<Vec<f64>>();
            let (rows, targets) = (draw(batch * head.outputs()), draw(batch * dim));
            let columns: Vec<f64> =
                (0..head.outputs() * batch).map(|i| rows[(i % batch) * head.outputs() + i / batch]).collect();
            let mut s = HeadScratch::default();
            let pairs = rows.chunks(head.outputs()).zip(targets.chunks(dim));
            let reference: f64 = pairs.map(|(o, t)| head.loss(o, t, &mut s)).sum();
            let (double, exact) = by_hand::<f64>(&head, &columns, &targets);
            let (single, near) = by_hand::<f32>(&head, &columns, &targets);
            assert!((reference - double).abs() < 1e-10, "{reference} {double}");
            assert!((single - double).abs() < 1e-4, "{single} {double}");
            let largest = exact.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
            assert!(exact.iter().zip(&near).all(|(a, b)| (a - b).abs() < 1e-5 * largest.max(1.0)));
        }
    }
}
