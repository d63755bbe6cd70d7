//! One curve and what is believed of it.

use super::curve::{Projected, Ready, Sample, Shape};
use super::robust::{scale, weight};
use super::settings::{Baseline, Curve, Fit, FitError, Loss, Noise};
use crate::root::rising;

/// Samples that a contact needs beyond its parameters, and at least in contact.
pub(super) const SPARE: usize = 3;
pub(super) const IN_CONTACT: usize = 4;
/// A step of a contact point (spans) with which it has settled.
const SETTLED: f64 = 1e-9;

/// A curve with what is believed of it.
#[derive(Debug, Clone, Default)]
pub(super) struct State {
    pub(super) ready: Ready,
    /// Contact point and the bounds of its search, in spans from the middle.
    pub(super) at: f64,
    pub(super) bounds: (f64, f64),
    /// Standard deviation in own units, and the part of the force over it.
    pub(super) sigma: f64,
    pub(super) ratio: f64,
    /// Where on the grid of ratios that is.
    pub(super) grid: i32,
    /// Stiffness in own units of a modulus of 1 Pa.
    pub(super) per_pa: f64,
    pub(super) autocorrelation: f64,
    /// Step of the reading in own units, zero where there is none; whether it is more than noise; how far it may move the
    /// contact point.
    pub(super) step: f64,
    pub(super) coarse: bool,
    pub(super) moved: f64,
}

impl State {
    pub(super) fn load(&mut self, fit: &Fit, index: usize, curve: &Curve<'_>) -> Result<(), FitError> {
        let (d, f) = (curve.indentation_m, curve.force_n);
        for got in [Some(f.len()), curve.sigma_n.map(<[f64]>::len)].into_iter().flatten() {
            if got != d.len() {
                return Err(FitError::Length { curve: index, expected: d.len(), got });
            }
        }
        let expected = parameters(fit) + SPARE;
        if d.len() < expected {
            return Err(FitError::TooFew { curve: index, expected, got: d.len() });
        }
        let sigma = curve.sigma_n.unwrap_or(&[]);
        for (column, values) in [("indentation_m", d), ("force_n", f), ("sigma_n", sigma)] {
            // A span has to be a number, too.
            let bad = |x: &f64| !(x.abs() < 1e150) || (column == "sigma_n" && !(*x > 1e-150));
            if let Some(sample) = values.iter().position(bad) {
                return Err(FitError::Value { curve: index, sample, column, value: values[sample] });
            }
        }
        let (low, high) =
            d.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        let span = high - low;
        if !(span > 1e-12 * low.abs().max(high.abs())) {
            return Err(FitError::NotMoved { curve: index });
        }
        let ready = &mut self.ready;
        (ready.middle_m, ready.span_m) = (0.5 * (low + high), span);
        let mean = f.iter().sum::<f64>() / f.len() as f64;
        ready.mean_n = if fit.baseline == Baseline::Zero { 0.0 } else { mean };
        let largest = f.iter().map(|x| (x - ready.mean_n).abs()).fold(0.0, f64::max);
        ready.unit_n = if largest > 0.0 { largest } else { 1.0 };
        ready.cut = f64::INFINITY;
        let smallest = sigma.iter().copied().fold(f64::INFINITY, f64::min);
        ready.samples.clear();
        for (i, (d, f)) in d.iter().zip(f).enumerate() {
            let known = sigma.get(i).map_or(1.0, |s| (smallest / s).powi(2));
            ready.samples.push(Sample {
                u: (d - ready.middle_m) / span,
                force: (f - ready.mean_n) / ready.unit_n,
                known,
                weight: known,
            });
        }
        (self.sigma, self.ratio, self.at) = (0.0, 0.0, 0.0);
        self.per_pa = 1.0 / Shape::new(fit, span).modulus_pa(1.0, ready.unit_n);
        self.bound(fit, index)
    }

    /// Where contact is looked for: from a span ahead of the curve to where the last few samples are in contact.
    pub(super) fn bound(&mut self, fit: &Fit, index: usize) -> Result<(), FitError> {
        let mut all: Vec<f64> = self.ready.used().map(|p| p.u).collect();
        let expected = parameters(fit) + SPARE;
        if all.len() < expected {
            return Err(FitError::TooFew { curve: index, expected, got: all.len() });
        }
        let nth = all.len() - IN_CONTACT;
        let high = *all.select_nth_unstable_by(nth, f64::total_cmp).1;
        self.bounds = (-1.5, high.max(-0.5));
        Ok(())
    }

    /// Leaves out what lies deeper than `depth` spans beyond the contact; whether that changes anything.
    pub(super) fn cut(&mut self, fit: &Fit, index: usize, depth: f64) -> Result<bool, FitError> {
        let cut = self.at + depth;
        let before = self.ready.used().count();
        let old = self.ready.cut;
        self.ready.cut = cut;
        let got = self.in_contact(cut);
        if got < IN_CONTACT {
            return Err(FitError::TooFew { curve: index, expected: IN_CONTACT, got });
        }
        self.bound(fit, index)?;
        Ok(self.ready.used().count() != before || (old.is_finite() && (old - cut).abs() > 1e-6))
    }

    pub(super) fn in_contact(&self, until: f64) -> usize {
        self.ready.samples.iter().filter(|p| p.u > self.at && p.u <= until.min(self.ready.cut)).count()
    }

    /// Correlation of neighbours in standard errors.
    pub(super) fn trend(&self) -> f64 {
        self.autocorrelation * (self.ready.used().count() as f64).sqrt()
    }

    /// The contact point with the smallest misfit on a grid.
    pub(super) fn scan(&mut self, fit: &Fit) {
        let stride = (self.ready.samples.len() / 400).max(1);
        let (low, high) = self.bounds;
        let misfit = |at: f64| self.ready.least_misfit(fit, at, stride);
        let ahead = (0..8).map(|i| low + (-0.5 - low) * f64::from(i) / 8.0);
        let within = (0..=48).map(|i| -0.5 + (high + 0.5) * f64::from(i) / 48.0);
        let best = ahead.chain(within).map(|at| (misfit(at), at)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, at)) = best {
            self.at = at;
        }
    }

    /// The contact point nearest to the present one at which the misfit is smallest, for a stiffness or for the best one.
    pub(super) fn refine(&mut self, fit: &Fit, stiffness: Option<f64>) -> Projected {
        match self.near(fit, stiffness) {
            Some(found) => found,
            None => self.bracketed(fit, stiffness),
        }
    }

    /// As [`State::refine`] from close by: Newton's steps, then the secant's, as long as each is less than half of the last one.
    fn near(&mut self, fit: &Fit, stiffness: Option<f64>) -> Option<Projected> {
        let (mut at, mut way) = (self.at, 0.1);
        let mut before: Option<(f64, f64)> = None;
        for _ in 0..10 {
            let p = self.ready.project(fit, at, 1);
            let (value, curvature) = slope(&p, stiffness);
            let secant = before.map(|(old, slope)| (value - slope) / (at - old));
            // Far off the linearised curvature a secant is rounding, or across a kink.
            let steep = secant.filter(|s| *s > 0.5 * curvature && *s < 2.0 * curvature).unwrap_or(curvature);
            let step = value / steep;
            if !(steep > 0.0 && step.abs() < 0.5 * way) {
                return None;
            }
            if step.abs() < SETTLED {
                self.at = at;
                return Some(p);
            }
            before = Some((at, value));
            (at, way) = (at - step, step.abs());
            if at <= self.bounds.0 || at >= self.bounds.1 {
                return None;
            }
        }
        None
    }

    /// As [`State::refine`] from anywhere: bracketed first.
    fn bracketed(&mut self, fit: &Fit, stiffness: Option<f64>) -> Projected {
        let ready = &self.ready;
        let slope = |at: f64| slope(&ready.project(fit, at, 1), stiffness);
        let (mut low, mut high) = (self.at, self.at);
        let (value, curvature) = slope(self.at);
        // First guess of the way: Newton's step, doubled until the slope changes sign.
        let mut step = if curvature > 0.0 { (2.0 * value / curvature).abs() } else { 0.02 };
        step = step.clamp(1e-6, 0.1);
        for _ in 0..30 {
            if value > 0.0 {
                low = (self.at - step).max(self.bounds.0);
                if low <= self.bounds.0 || slope(low).0 <= 0.0 {
                    break;
                }
            } else {
                high = (self.at + step).min(self.bounds.1);
                if high >= self.bounds.1 || slope(high).0 >= 0.0 {
                    break;
                }
            }
            step *= 2.0;
        }
        self.at = rising_to(SETTLED, slope, low, high, self.at - value / curvature);
        self.ready.project(fit, self.at, 1)
    }

    /// Down-weights spikes: samples far off the median of five neighbours.
    pub(super) fn despike(&mut self, room: &mut Vec<f64>) {
        let n = self.ready.samples.len();
        let off = |samples: &[Sample], i: usize| {
            let first = i.saturating_sub(2).min(n.saturating_sub(5));
            let mut five = [0.0; 5];
            for (x, p) in five.iter_mut().zip(&samples[first..]) {
                *x = p.force;
            }
            samples[i].force - median_of_five(five)
        };
        let s = scale((0..n).map(|i| off(&self.ready.samples, i)), room);
        if !(s > 0.0) {
            return;
        }
        for i in 0..n {
            let u = off(&self.ready.samples, i) / s;
            let p = &mut self.ready.samples[i];
            p.weight = p.known * weight(Loss::Huber, u / 4.0).0.powi(2);
        }
    }

    /// Residuals over their relative sigmas, of used samples, and the part of the contact in the force.
    pub(super) fn residuals(&self, fit: &Fit, stiffness: f64, out: &mut Vec<(f64, f64)>) {
        let shape = Shape::new(fit, self.ready.span_m);
        let (level, tilt) = self.ready.baseline(fit, self.at, stiffness);
        out.clear();
        out.extend(self.ready.used().map(|p| {
            let contact = stiffness * shape.at(p.u - self.at).0;
            ((p.force - contact - level - tilt * p.u) * p.known.sqrt(), contact)
        }));
    }

    /// The noise's size, and the part that goes with the force.
    pub(super) fn measure_noise(
        &mut self,
        fit: &Fit,
        round: usize,
        pairs: &[(f64, f64)],
        room: &mut Vec<f64>,
    ) {
        // Rounding of the sums is noise, too.
        let floor = 1e-13;
        // So is rounding by the reading, which a median of flat samples does not see.
        let rounding = self.step / 12_f64.sqrt();
        let size = |ratio: f64, room: &mut Vec<f64>| {
            let over = |(e, c): &(f64, f64)| e / (1.0 + (ratio * c).powi(2)).sqrt();
            let s = match fit.loss {
                Loss::Square => {
                    (pairs.iter().map(|p| over(p).powi(2)).sum::<f64>() / pairs.len().max(1) as f64).sqrt()
                }
                _ => scale(pairs.iter().map(over), room),
            };
            s.max(floor)
        };
        self.coarse = self.step > 0.0 && size(0.0, room) < 0.4 * self.step;
        if fit.noise == Noise::White {
            (self.sigma, self.ratio) = (size(0.0, room).max(rounding), 0.0);
            return;
        }
        let mut best = f64::NEG_INFINITY;
        // After the first rounds the neighbours of the last answer are enough.
        let near = self.grid;
        let range = if round < 3 { -1..24 } else { (near - 1).max(-1)..near + 2 };
        for k in range {
            let ratio = if k < 0 { 0.0 } else { 0.1 * 1.6_f64.powi(k) };
            let s = size(ratio, room).max(rounding);
            let spread: f64 = pairs.iter().map(|(_, c)| (ratio * c).powi(2).ln_1p()).sum();
            let likelihood = -(pairs.len() as f64) * s.ln() - 0.5 * spread;
            if likelihood > best {
                best = likelihood;
                (self.sigma, self.ratio, self.grid) = (s, ratio, k);
            }
        }
    }
}

/// Derivative of the misfit with respect to the contact point over twice the stiffness, and its own, linearised.
fn slope(p: &Projected, stiffness: Option<f64>) -> (f64, f64) {
    let k = stiffness.unwrap_or_else(|| p.stiffness());
    let along = if stiffness.is_none() && p.a > 0.0 { p.c * p.c / p.a } else { 0.0 };
    (p.d - k * p.c, k * (p.e - along))
}

fn median_of_five([a, b, c, d, e]: [f64; 5]) -> f64 {
    // Neither the smaller of the smaller ones nor the larger of the larger ones of two pairs is in the middle.
    let low = a.min(b).max(c.min(d));
    let high = a.max(b).min(c.max(d));
    low.min(high).max(low.max(high).min(e))
}

/// Parameters of a curve and the modulus.
pub(super) fn parameters(fit: &Fit) -> usize {
    2 + match fit.baseline {
        Baseline::Zero => 0,
        Baseline::Offset => 1,
        Baseline::Tilt => 2,
    }
}

/// [`rising`] to a coarser tolerance, for sums that carry rounding.
pub(super) fn rising_to(
    tolerance: f64,
    mut f: impl FnMut(f64) -> (f64, f64),
    low: f64,
    high: f64,
    start: f64,
) -> f64 {
    let mut near: Option<f64> = None;
    rising(
        |x| {
            // Two steps nearer than the tolerance end it.
            if near.is_some_and(|old| (old - x).abs() < tolerance) {
                return (0.0, 1.0);
            }
            near = Some(x);
            f(x)
        },
        low,
        high,
        if start.is_finite() { start } else { 0.5 * (low + high) },
    )
}

#[cfg(test)]
mod tests {
    use super::median_of_five;

    #[test]
    fn the_median_of_five_is_the_third() {
        // Every order of five numbers, and of three that repeat.
        for k in 0..5_usize.pow(5) {
            let five: [usize; 5] = std::array::from_fn(|i| k / 5_usize.pow(i as u32) % 5);
            let mut sorted = five;
            sorted.sort_unstable();
            assert_eq!(median_of_five(five.map(|x| x as f64)), sorted[2] as f64, "{five:?}");
        }
    }
}
