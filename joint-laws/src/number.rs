//! The numbers that the laws are written in.

use num_dual::DualNum;

/// A real number, or a dual number over `f64`, which carries derivatives along.
pub trait Number: DualNum<Primitive = f64, Real = f64> + Copy {
    /// The number itself where it is not below zero, else its negative.
    fn modulus(self) -> Self {
        if self.re() < 0.0 { -self } else { self }
    }

    /// The number, or the bound that it exceeds.
    fn within(self, lower: Self, upper: Self) -> Self {
        if self.re() > upper.re() {
            upper
        } else if self.re() < lower.re() {
            lower
        } else {
            self
        }
    }
}

impl<T: DualNum<Primitive = f64, Real = f64> + Copy> Number for T {}
