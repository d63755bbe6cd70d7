//! The numbers that laws are written in.

use num_dual::DualNum;

/// `f64` or a dual number over it, so that derivatives with respect to any parameter are exact.
pub trait Number: DualNum<Primitive = f64, Real = f64> + Copy {}

impl<T: DualNum<Primitive = f64, Real = f64> + Copy> Number for T {}

/// `f(x)` from its value and slope at the real part of `x`: exact for plain numbers and first derivatives, else none.
pub(crate) fn first_order<T: Number>(x: T, f: impl FnOnce(f64) -> (f64, f64)) -> Option<T> {
    if T::NDERIV > 1 {
        return None;
    }
    let (value, slope) = f(x.re());
    Some((x - T::from(x.re())) * slope + T::from(value))
}
