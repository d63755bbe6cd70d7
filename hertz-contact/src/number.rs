//! The numbers that laws are written in.

use num_dual::DualNum;

/// `f64` or a dual number over it, so that derivatives with respect to any parameter are exact.
pub trait Number: DualNum<Primitive = f64, Real = f64> + Copy {}

impl<T: DualNum<Primitive = f64, Real = f64> + Copy> Number for T {}
