//! Numbers that networks are trained in: f32 for speed, f64 where a derivative is checked.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};

/// Observations that are worked on side by side, so that the compiler can use vector instructions.
pub(crate) const LANES: usize = 16;

/// What training needs of a number.
pub(crate) trait Real:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + Send
    + Sync
{
    const ZERO: Self;
    const ONE: Self;

    fn of(value: f64) -> Self;
    fn to_f64(self) -> f64;
    fn exp(self) -> Self;
    fn sqrt(self) -> Self;
    /// `target = a b`, or added to it.
    fn multiply(target: MatMut<'_, Self>, accum: Accum, a: MatRef<'_, Self>, b: MatRef<'_, Self>);

    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }

    #[inline(always)]
    fn exp(self) -> Self {
        self.exp()
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    fn multiply(target: MatMut<'_, Self>, accum: Accum, a: MatRef<'_, Self>, b: MatRef<'_, Self>) {
        matmul(target, accum, a, b, 1.0, Par::Seq);
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

    #[inline(always)]
    fn of(value: f64) -> Self {
        value as Self
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    /// Without a branch or a call: `2^n` by its bits, `e^r` for what is left by Cephes's polynomial; about 1e-7 relative. Held at
    /// -87 and 88, where a single runs out.
    #[inline(always)]
    fn exp(self) -> Self {
        const ROUND: f32 = 12_582_912.0;
        let x = self.smaller(88.0).larger(-87.0);
        let shifted = x * std::f32::consts::LOG2_E + ROUND;
        let n = shifted - ROUND;
        let r = x - n * 0.693_359_4 + n * 2.121_944_4e-4;
        let p = 1.987_569_1e-4;
        let p = p * r + 1.398_2e-3;
        let p = p * r + 8.333_452e-3;
        let p = p * r + 4.166_579_6e-2;
        let p = p * r + 1.666_666_5e-1;
        let p = p * r + 0.5;
        let power = (shifted.to_bits().wrapping_sub(ROUND.to_bits()).wrapping_add(127)) << 23;
        (p * r * r + r + 1.0) * Self::from_bits(power)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    fn multiply(target: MatMut<'_, Self>, accum: Accum, a: MatRef<'_, Self>, b: MatRef<'_, Self>) {
        matmul(target, accum, a, b, 1.0, Par::Seq);
    }
}

/// Up to [`LANES`] numbers, zeros behind them.
#[inline(always)]
pub(crate) fn load<T: Real>(values: &[T]) -> [T; LANES] {
    if let Ok(full) = values.try_into() {
        return full;
    }
    let mut out = [T::ZERO; LANES];
    out.iter_mut().zip(values).for_each(|(o, v)| *o = *v);
    out
}

/// The first of these numbers, as many as there is room for.
#[inline(always)]
pub(crate) fn store<T: Real>(lanes: &[T; LANES], values: &mut [T]) {
    if let Ok(full) = <&mut [T; LANES]>::try_from(&mut *values) {
        *full = *lanes;
    } else {
        values.iter_mut().zip(lanes).for_each(|(v, o)| *v = *o);
    }
}

/// Sum in a fixed order of sixteen partial sums.
#[inline(always)]
pub(crate) fn sum<T: Real>(values: &[T], of: impl Fn(T) -> T) -> T {
    let mut partial = [T::ZERO; LANES];
    for chunk in values.chunks(LANES) {
        let lanes = load(chunk);
        for (p, v) in partial.iter_mut().zip(lanes) {
            *p += of(v);
        }
    }
    partial.into_iter().fold(T::ZERO, |a, b| a + b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_in_single_precision() {
        for i in -8_600..8_700 {
            let x = i as f32 * 0.01;
            let exact = f64::from(x).exp();
            assert!((Real::exp(x).to_f64() / exact - 1.0).abs() < 3e-7, "{x}");
        }
        assert!(Real::exp(-1e30_f32) < 1e-37 && Real::exp(1e30_f32).is_finite());
    }

    #[test]
    fn sums_of_any_length() {
        for n in [0, 1, 15, 16, 17, 100] {
            let values: Vec<f64> = (0..n).map(f64::from).collect();
            assert_eq!(sum(&values, |v| v), 0.5 * f64::from(n) * f64::from(n - 1));
        }
    }
}
