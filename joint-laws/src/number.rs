//! The numbers that the laws are written in.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number, or a [`Dual`] one, which carries derivatives along.
pub trait Number:
    Copy
    + Debug
    + PartialEq
    + From<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + 'static
{
    /// The real part.
    fn re(&self) -> f64;

    /// A function of this number, of which the value and the derivative at the real part are given.
    #[must_use]
    fn chain(self, value: f64, derivative: f64) -> Self;

    /// `self += other * factor`.
    fn add_scaled(&mut self, other: Self, factor: f64);

    /// Becomes `a + b`, in its place.
    fn set_sum(&mut self, a: &Self, b: &Self) {
        *self = *a + *b;
    }

    /// Becomes `a - b`, in its place.
    fn set_difference(&mut self, a: &Self, b: &Self) {
        *self = *a - *b;
    }

    /// Becomes `a b`, in its place.
    fn set_product(&mut self, a: &Self, b: &Self) {
        *self = *a * *b;
    }

    /// Becomes `a factor`, in its place.
    fn set_scaled(&mut self, a: &Self, factor: f64) {
        *self = *a * factor;
    }

    /// The number without its real part.
    #[must_use]
    fn infinitesimal(self) -> Self {
        self - self.re()
    }

    /// The number itself where it is not below zero, else its negative.
    #[must_use]
    fn modulus(self) -> Self {
        if self.re() < 0.0 { -self } else { self }
    }

    /// The number, or the bound that it exceeds.
    #[must_use]
    fn within(self, lower: Self, upper: Self) -> Self {
        if self.re() > upper.re() {
            upper
        } else if self.re() < lower.re() {
            lower
        } else {
            self
        }
    }

    /// `1 / self`.
    #[must_use]
    fn recip(self) -> Self {
        let value = self.re().recip();
        self.chain(value, -value * value)
    }

    /// A whole power.
    #[must_use]
    fn powi(self, n: i32) -> Self {
        self.chain(self.re().powi(n), f64::from(n) * self.re().powi(n - 1))
    }

    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self {
        let value = self.re().sqrt();
        self.chain(value, 0.5 / value)
    }

    /// Exponential.
    #[must_use]
    fn exp(self) -> Self {
        let value = self.re().exp();
        self.chain(value, value)
    }

    /// Natural logarithm.
    #[must_use]
    fn ln(self) -> Self {
        self.chain(self.re().ln(), self.re().recip())
    }

    /// Sine.
    #[must_use]
    fn sin(self) -> Self {
        let (sin, cos) = self.re().sin_cos();
        self.chain(sin, cos)
    }

    /// Cosine.
    #[must_use]
    fn cos(self) -> Self {
        let (sin, cos) = self.re().sin_cos();
        self.chain(cos, -sin)
    }

    /// Tangent.
    #[must_use]
    fn tan(self) -> Self {
        let value = self.re().tan();
        self.chain(value, 1.0 + value * value)
    }

    /// Arc sine.
    #[must_use]
    fn asin(self) -> Self {
        self.chain(self.re().asin(), (1.0 - self.re() * self.re()).sqrt().recip())
    }

    /// Arc cosine.
    #[must_use]
    fn acos(self) -> Self {
        self.chain(self.re().acos(), -(1.0 - self.re() * self.re()).sqrt().recip())
    }

    /// Arc tangent.
    #[must_use]
    fn atan(self) -> Self {
        self.chain(self.re().atan(), (1.0 + self.re() * self.re()).recip())
    }

    /// The angle of the point (`x`, `self`).
    #[must_use]
    fn atan2(self, x: Self) -> Self {
        let (b, a) = (self.re(), x.re());
        let square = a * a + b * b;
        let mut angle = self.chain(b.atan2(a), a / square);
        angle.add_scaled(x.infinitesimal(), -b / square);
        angle
    }

    /// Hyperbolic sine.
    #[must_use]
    fn sinh(self) -> Self {
        self.chain(self.re().sinh(), self.re().cosh())
    }

    /// Hyperbolic cosine.
    #[must_use]
    fn cosh(self) -> Self {
        self.chain(self.re().cosh(), self.re().sinh())
    }

    /// Hyperbolic tangent.
    #[must_use]
    fn tanh(self) -> Self {
        let value = self.re().tanh();
        self.chain(value, 1.0 - value * value)
    }
}

impl Number for f64 {
    fn re(&self) -> f64 {
        *self
    }

    fn chain(self, value: f64, _: f64) -> Self {
        value
    }

    fn add_scaled(&mut self, other: Self, factor: f64) {
        *self += other * factor;
    }

    // Without derivatives one of the two will do.
    fn sin(self) -> Self {
        Self::sin(self)
    }

    fn cos(self) -> Self {
        Self::cos(self)
    }
}

/// A number with its derivatives by `N` parameters, first order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub re: f64,
    /// The derivatives.
    pub eps: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// The parameter of a number less than `N`, at a value.
    pub fn parameter(value: f64, number: usize) -> Self {
        let mut eps = [0.0; N];
        eps[number] = 1.0;
        Self { re: value, eps }
    }

    /// `a` times these derivatives plus `b` times others.
    #[inline(always)]
    fn mixed(&self, a: f64, other: &Self, b: f64) -> [f64; N] {
        let mut eps = [0.0; N];
        for (k, e) in eps.iter_mut().enumerate() {
            *e = a * self.eps[k] + b * other.eps[k];
        }
        eps
    }

    #[inline(always)]
    fn scaled(&self, factor: f64) -> [f64; N] {
        self.eps.map(|e| e * factor)
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    #[inline(always)]
    fn from(re: f64) -> Self {
        Self { re, eps: [0.0; N] }
    }
}

impl<const N: usize> Number for Dual<N> {
    #[inline(always)]
    fn re(&self) -> f64 {
        self.re
    }

    #[inline(always)]
    fn chain(self, value: f64, derivative: f64) -> Self {
        Self { re: value, eps: self.scaled(derivative) }
    }

    #[inline(always)]
    fn add_scaled(&mut self, other: Self, factor: f64) {
        self.re += other.re * factor;
        for (a, b) in self.eps.iter_mut().zip(&other.eps) {
            *a += b * factor;
        }
    }

    #[inline(always)]
    fn set_sum(&mut self, a: &Self, b: &Self) {
        self.re = a.re + b.re;
        for (k, e) in self.eps.iter_mut().enumerate() {
            *e = a.eps[k] + b.eps[k];
        }
    }

    #[inline(always)]
    fn set_difference(&mut self, a: &Self, b: &Self) {
        self.re = a.re - b.re;
        for (k, e) in self.eps.iter_mut().enumerate() {
            *e = a.eps[k] - b.eps[k];
        }
    }

    #[inline(always)]
    fn set_product(&mut self, a: &Self, b: &Self) {
        self.re = a.re * b.re;
        for (k, e) in self.eps.iter_mut().enumerate() {
            *e = b.re * a.eps[k] + a.re * b.eps[k];
        }
    }

    #[inline(always)]
    fn set_scaled(&mut self, a: &Self, factor: f64) {
        self.re = a.re * factor;
        for (k, e) in self.eps.iter_mut().enumerate() {
            *e = a.eps[k] * factor;
        }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { re: -self.re, eps: self.eps.map(|e| -e) }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, other: Self) -> Self {
        self -= other;
        self
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { re: self.re * other.re, eps: self.mixed(other.re, &other, self.re) }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = other.re.recip();
        let re = self.re * inverse;
        Self { re, eps: self.mixed(inverse, &other, -re * inverse) }
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: f64) -> Self {
        Self { re: self.re + other, ..self }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: f64) -> Self {
        Self { re: self.re - other, ..self }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        Self { re: self.re * other, eps: self.scaled(other) }
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: f64) -> Self {
        Self { re: self.re / other, eps: self.eps.map(|e| e / other) }
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.re += other.re;
        for (a, b) in self.eps.iter_mut().zip(&other.eps) {
            *a += b;
        }
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        self.re -= other.re;
        for (a, b) in self.eps.iter_mut().zip(&other.eps) {
            *a -= b;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// What is computed in place is what operators give.
    #[test]
    fn operations_in_place_are_those_of_the_operators() {
        let (x, y) = (Dual::<2>::parameter(0.4, 0) * 3.0, Dual::<2>::parameter(1.3, 1).sin());
        let mut z = Dual::from(0.0);
        z.set_sum(&x, &y);
        assert_eq!(z, x + y);
        z.set_difference(&x, &y);
        assert_eq!(z, x - y);
        z.set_product(&x, &y);
        assert_eq!(z, x * y);
        z.set_scaled(&x, -0.7);
        assert_eq!(z, x * -0.7);
    }

    /// Every function's derivatives against differences.
    #[test]
    fn derivatives_are_those_of_the_functions() {
        fn all<T: Number>(x: T, y: T) -> Vec<T> {
            vec![
                x + y * 2.0 - x * y / (y + 3.0),
                -(x - 0.1) / y - 1.5,
                x.recip(),
                x.powi(3) * y.powi(-2),
                x.sqrt(),
                x.exp() - y.ln(),
                x.sin() * y.cos(),
                x.tan(),
                x.asin() + x.acos() * y,
                y.atan() + x.atan2(-y),
                x.sinh() * y.cosh() + x.tanh(),
                (-x).modulus() + x.within(y, y) + (x - y).infinitesimal(),
            ]
        }
        let (x, y, h) = (0.4, 1.3, 1e-6);
        let dual = all(Dual::<2>::parameter(x, 0), Dual::parameter(y, 1));
        let values = all(x, y);
        let differences = |dx: f64, dy: f64| -> Vec<f64> {
            let (up, down) = (all(x + dx, y + dy), all(x - dx, y - dy));
            up.iter().zip(down).map(|(a, b)| (a - b) / (2.0 * h)).collect()
        };
        let (by_x, by_y) = (differences(h, 0.0), differences(0.0, h));
        for (k, d) in dual.iter().enumerate() {
            assert_relative_eq!(d.re, values[k], max_relative = 1e-14);
            // The last holds the infinitesimal part of x - y, which differences do not see.
            let [ex, ey] = if k + 1 == dual.len() { [1.0, -1.0] } else { [0.0, 0.0] };
            assert_relative_eq!(d.eps[0] - ex, by_x[k], epsilon = 1e-8);
            assert_relative_eq!(d.eps[1] - ey, by_y[k], epsilon = 1e-8);
        }
    }
}
