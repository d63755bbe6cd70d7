//! The loss of [`Head`] and its derivative for a batch at a time, one unit's values side by side: what training spends its time on.
#![allow(clippy::needless_range_loop, reason = "a lane of several arrays at once")]

use pulp::Arch;

use crate::head::{Head, MAX_LOG_PRECISION, cut_mass};
use crate::normal::LN_SQRT_2PI;
use crate::real::{LANES, Real, load, store};

type Lanes<T> = [T; LANES];

/// Numbers that one evaluation needs; the memory serves the next one.
pub(crate) struct BatchScratch<T> {
    target: Vec<Lanes<T>>,
    residual: Vec<Lanes<T>>,
    mean_gradient: Vec<Lanes<T>>,
    logits: Vec<Lanes<T>>,
    terms: Vec<Lanes<T>>,
    arch: Arch,
}

impl<T: Real> BatchScratch<T> {
    pub(crate) fn new(head: &Head) -> Self {
        let (d, k) = (vec![[T::ZERO; LANES]; head.dim], vec![[T::ZERO; LANES]; head.components]);
        Self {
            target: d.clone(),
            residual: d.clone(),
            mean_gradient: d,
            logits: k.clone(),
            terms: k,
            arch: Arch::new(),
        }
    }
}

/// A matrix `batch x outputs` and which of its rows are looked at.
#[derive(Clone, Copy)]
struct Window {
    batch: usize,
    first: usize,
    count: usize,
}

impl Window {
    #[inline(always)]
    fn of(self, column: usize) -> std::ops::Range<usize> {
        let at = column * self.batch + self.first;
        at..at + self.count
    }
}

impl Head {
    /// Sum of the negative log densities of `batch` targets, which lie one after another, under `outputs` (`batch x outputs`); with
    /// `gradient`, the derivative of their *mean* by the outputs.
    pub(crate) fn batch_loss<T: Real>(
        &self,
        outputs: &[T],
        targets: &[T],
        mut gradient: Option<&mut [T]>,
        scratch: &mut BatchScratch<T>,
    ) -> f64 {
        let batch = targets.len() / self.dim;
        let (mut total, arch) = (0.0, scratch.arch);
        for first in (0..batch).step_by(LANES) {
            let window = Window { batch, first, count: LANES.min(batch - first) };
            let gradient = gradient.as_deref_mut();
            total += arch.dispatch(
                #[inline(always)]
                || self.window_loss(window, outputs, targets, gradient, scratch),
            );
        }
        total
    }

    #[inline(always)]
    fn window_loss<T: Real>(
        &self,
        window: Window,
        outputs: &[T],
        targets: &[T],
        mut gradient: Option<&mut [T]>,
        s: &mut BatchScratch<T>,
    ) -> f64 {
        for b in 0..window.count {
            let row = &targets[(window.first + b) * self.dim..];
            s.target.iter_mut().zip(row).for_each(|(t, v)| t[b] = *v);
        }
        for k in 0..self.components {
            s.logits[k] = load(&outputs[window.of(k * self.stride())]);
            s.terms[k] = s.logits[k];
            self.component_lanes(window, k, outputs, gradient.as_deref_mut(), s);
            if let Some(interval) = self.interval() {
                self.cut_lanes(window, k, interval, outputs, gradient.as_deref_mut(), s);
            }
        }
        let (top, sum) = softmax(&mut s.logits);
        let (best, share) = softmax(&mut s.terms);
        if let Some(gradient) = gradient {
            self.weigh(window, gradient, s);
        }
        let ln = |b: usize| (sum[b].to_f64() / share[b].to_f64()).ln() + (top[b] - best[b]).to_f64();
        (0..window.count).map(ln).sum()
    }

    /// Adds the log density of component `k` to its term; its derivative goes into the gradient.
    #[inline(always)]
    fn component_lanes<T: Real>(
        &self,
        window: Window,
        k: usize,
        outputs: &[T],
        gradient: Option<&mut [T]>,
        s: &mut BatchScratch<T>,
    ) {
        let (d, base) = (self.dim, k * self.stride());
        let most = T::of(MAX_LOG_PRECISION);
        let (half, constant) = (T::of(0.5), T::of(d as f64 * LN_SQRT_2PI));
        for i in 0..d {
            let mean = load(&outputs[window.of(base + 1 + i)]);
            for b in 0..LANES {
                s.residual[i][b] = s.target[i][b] - mean[b];
                s.mean_gradient[i][b] = T::ZERO;
            }
        }
        let mut ln_density = s.terms[k].map(|t| t - constant);
        let mut gradient = gradient;
        let mut at = base + 1 + 2 * d;
        for i in 0..d {
            let a = load(&outputs[window.of(base + 1 + d + i)]);
            let mut whitened = s.residual[i];
            for j in 0..i {
                let l = load(&outputs[window.of(at + j)]);
                for b in 0..LANES {
                    whitened[b] += l[b] * s.residual[j][b];
                }
            }
            let (mut scaled, mut slope) = ([T::ZERO; LANES], [T::ZERO; LANES]);
            for b in 0..LANES {
                let held = a[b].smaller(most);
                let precision = held.exp();
                let y = precision * whitened[b];
                scaled[b] = precision * y;
                slope[b] = if a[b] < most { T::ONE - y * y } else { T::ZERO };
                ln_density[b] = ln_density[b] + held - half * y * y;
            }
            if let Some(gradient) = gradient.as_deref_mut() {
                store(&slope, &mut gradient[window.of(base + 1 + d + i)]);
                for b in 0..LANES {
                    s.mean_gradient[i][b] += scaled[b];
                }
                for j in 0..i {
                    let l = load(&outputs[window.of(at + j)]);
                    let mut by_factor = [T::ZERO; LANES];
                    for b in 0..LANES {
                        s.mean_gradient[j][b] += scaled[b] * l[b];
                        by_factor[b] = -scaled[b] * s.residual[j][b];
                    }
                    store(&by_factor, &mut gradient[window.of(at + j)]);
                }
            }
            at += i;
        }
        if let Some(gradient) = gradient {
            for (i, by_mean) in s.mean_gradient.iter().enumerate() {
                store(by_mean, &mut gradient[window.of(base + 1 + i)]);
            }
        }
        s.terms[k] = ln_density;
    }

    /// Takes the log mass within the interval off component `k`, where it is less than one.
    #[inline(always)]
    fn cut_lanes<T: Real>(
        &self,
        window: Window,
        k: usize,
        interval: [f64; 2],
        outputs: &[T],
        mut gradient: Option<&mut [T]>,
        s: &mut BatchScratch<T>,
    ) {
        let base = k * self.stride();
        let (mean, a) = (window.of(base + 1), window.of(base + 2));
        for b in 0..window.count {
            let block = [outputs[mean.start + b].to_f64(), outputs[a.start + b].to_f64()];
            let Some((ln, slopes)) = cut_mass(block, interval) else { continue };
            s.terms[k][b] = s.terms[k][b] - T::of(ln);
            if let Some(gradient) = gradient.as_deref_mut() {
                gradient[mean.start + b] = gradient[mean.start + b] - T::of(slopes[0]);
                gradient[a.start + b] = gradient[a.start + b] - T::of(slopes[1]);
            }
        }
    }

    /// Weighs each component's derivative by its share, and makes that of its logit.
    #[inline(always)]
    fn weigh<T: Real>(&self, window: Window, gradient: &mut [T], s: &BatchScratch<T>) {
        let part = T::of(1.0 / window.batch as f64);
        let stride = self.stride();
        for k in 0..self.components {
            let (weight, share) = (&s.logits[k], &s.terms[k]);
            let mut logit = [T::ZERO; LANES];
            for b in 0..LANES {
                logit[b] = (weight[b] - share[b]) * part;
            }
            store(&logit, &mut gradient[window.of(k * stride)]);
            for column in k * stride + 1..(k + 1) * stride {
                let mut derivative = load(&gradient[window.of(column)]);
                for b in 0..LANES {
                    derivative[b] = -derivative[b] * share[b] * part;
                }
                store(&derivative, &mut gradient[window.of(column)]);
            }
        }
    }
}

/// Turns each lane's values into shares of one; gives the largest value and the sum of `exp(value - largest)`.
#[inline(always)]
fn softmax<T: Real>(values: &mut [Lanes<T>]) -> (Lanes<T>, Lanes<T>) {
    let (mut top, mut sum) = (values[0], [T::ZERO; LANES]);
    for value in values.iter() {
        for b in 0..LANES {
            top[b] = top[b].larger(value[b]);
        }
    }
    for value in values.iter_mut() {
        for b in 0..LANES {
            value[b] = (value[b] - top[b]).exp();
            sum[b] += value[b];
        }
    }
    for value in values.iter_mut() {
        for b in 0..LANES {
            value[b] = value[b] / sum[b];
        }
    }
    (top, sum)
}
