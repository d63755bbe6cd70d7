//! A search for the least cost on an interval: bracketing, then Brent's steps (Brent 1973).
//!
//! Not argmin's `BrentOpt`: the cost where the search begins is known and is not asked for again, the number of costs is bounded, and
//! nothing is allocated.

use argmin::core::Error;

/// A search on an interval.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LineSearch {
    /// Costs that are asked for at most.
    pub(crate) most: usize,
    /// Part of the interval to which the place is found.
    pub(crate) precision: f64,
}

impl Default for LineSearch {
    fn default() -> Self {
        Self { most: 16, precision: 2e-3 }
    }
}

const GOLDEN: f64 = 0.381_966_011_250_105_1;

impl LineSearch {
    /// The least cost found between two places about 0, where it is `at`.
    pub(crate) fn least(
        &self,
        cost: &mut dyn FnMut(f64) -> Result<f64, Error>,
        at: f64,
        from: f64,
        to: f64,
    ) -> Result<(f64, f64), Error> {
        let span = to - from;
        let (mut a, mut b, mut x, mut fx, mut asked) = self.bracket(cost, at, from, to)?;
        // Brent: parabolas through the three best places, golden sections where these mislead.
        let (mut w, mut fw, mut v, mut fv) = (x, fx, x, fx);
        let (mut step, mut last) = (0.0_f64, b - a);
        let fine = self.precision * span;
        while asked < self.most && (b - a) > 2.0 * fine {
            let middle = 0.5 * (a + b);
            let (r, q) = ((x - w) * (fx - fv), (x - v) * (fx - fw));
            let mut p = (x - v) * q - (x - w) * r;
            let mut q = 2.0 * (q - r);
            if q > 0.0 {
                p = -p;
            }
            q = q.abs();
            let good = p.abs() < 0.5 * q * last.abs() && p > q * (a - x) && p < q * (b - x);
            last = step;
            step = if good {
                p / q
            } else {
                last = if x < middle { b - x } else { a - x };
                GOLDEN * last
            };
            let u = if step.abs() >= fine { x + step } else { x + fine.copysign(step) };
            let u = u.clamp(a, b);
            let fu = cost(u)?;
            asked += 1;
            if fu <= fx {
                if u < x {
                    b = x
                } else {
                    a = x
                }
                (v, fv, w, fw, x, fx) = (w, fw, x, fx, u, fu);
            } else {
                if u < x {
                    a = u
                } else {
                    b = u
                }
                if fu <= fw || w == x {
                    (v, fv, w, fw) = (w, fw, u, fu);
                } else if fu <= fv || v == x || v == w {
                    (v, fv) = (u, fu);
                }
            }
        }
        Ok((x, fx))
    }

    /// Goes downhill from 0 with growing steps until the cost rises or the interval ends: both ends, the best place and its
    /// cost, and how many costs were asked for.
    fn bracket(
        &self,
        cost: &mut dyn FnMut(f64) -> Result<f64, Error>,
        at: f64,
        from: f64,
        to: f64,
    ) -> Result<(f64, f64, f64, f64, usize), Error> {
        // Towards the roomier side first.
        let ends = if to >= -from { [to, from] } else { [from, to] };
        let mut asked = 0;
        let mut uphill = 0.0;
        for end in ends {
            if end == 0.0 {
                continue;
            }
            let (mut behind, mut x, mut fx) = (uphill, 0.0_f64, at);
            let mut reach = 0.15 * (to - from);
            loop {
                let next = if x.abs() + reach < end.abs() { x + reach.copysign(end) } else { end };
                let f = cost(next)?;
                asked += 1;
                if !(f < fx) {
                    if x == 0.0 {
                        uphill = next;
                        break;
                    }
                    return Ok((behind.min(next), behind.max(next), x, fx, asked));
                }
                (behind, x, fx) = (x, next, f);
                if next == end {
                    return Ok((behind.min(end), behind.max(end), x, fx, asked));
                }
                reach *= 2.0;
            }
        }
        // Uphill to both sides: the best place is between.
        let first = if ends[0] > 0.0 { from } else { to };
        let other = if uphill == 0.0 { first } else { uphill };
        let near = 0.15 * (to - from);
        let (a, b) = ((-near).max(from).min(other), near.min(to).max(other));
        Ok((a.min(0.0), b.max(0.0), 0.0, at, asked))
    }
}
