//! Force over indentation.
//!
//! Every law is generic over `f64` and dual numbers. Indentation and force are positive under compression. A law's
//! parameters are plain fields; [`Law::check`] says whether they make sense, and where they do not the force is not
//! specified (it may be NaN).

mod adhesion;
mod elastic;
mod extra;
mod indentation;
mod layer;

pub use adhesion::{Dmt, Jkr};
pub use elastic::{Elastic, NeoHookean, PowerLaw, SneddonSphere};
pub use extra::{Compliant, Membrane, Rim, Stiffened};
pub use indentation::{Acting, Contact, Indentation};
pub use layer::{Base, Dimitriadis, Layer, Layered};

use crate::Number;

/// Why a law's parameters make no sense.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LawError {
    /// A parameter is not a finite positive number.
    #[error("{name} is {value}, expected a finite number above zero")]
    NotPositive {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A parameter is not a finite number of zero or more.
    #[error("{name} is {value}, expected a finite number of zero or more")]
    Negative {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A parameter is not a finite number.
    #[error("{name} is {value}, expected a finite number")]
    NotFinite {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A parameter is outside the range in which it means something.
    #[error("{name} is {value}, expected a number from {low} to {high}")]
    OutOfRange {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// The effect has no law for this indenter.
    #[error("{effect} has no law for this indenter")]
    Indenter {
        /// Which effect.
        effect: &'static str,
    },
}

/// Why there is no indentation at a force.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum InverseError {
    /// The force is not a finite number.
    #[error("the force is {force_n} N, expected a finite number")]
    NotFinite {
        /// The force in N.
        force_n: f64,
    },
    /// The force pulls more than the contact can hold.
    #[error("the force is {force_n} N, but the contact is held down to {lowest_n} N only")]
    BelowLowest {
        /// The force in N.
        force_n: f64,
        /// The lowest that the law reaches, in N.
        lowest_n: f64,
    },
    /// No indentation that a number can hold gives the force.
    #[error("the law does not reach {force_n} N")]
    NotReached {
        /// The force in N.
        force_n: f64,
    },
}

/// Whether a law holds at an indentation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Validity {
    /// The bodies do not touch; the force is zero.
    NoContact,
    /// The law holds to about 1 %, the material being what it takes it to be.
    Holds,
    /// The law is used beyond its range.
    Beyond {
        /// What is too large, as a ratio without unit (an angle in rad).
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Up to where the law holds.
        limit: f64,
    },
}

impl Validity {
    pub(crate) fn of(indentation_m: f64, quantity: &'static str, value: f64, limit: f64) -> Self {
        if !(indentation_m > 0.0) {
            Self::NoContact
        } else if value <= limit {
            Self::Holds
        } else {
            Self::Beyond { quantity, value, limit }
        }
    }

    /// This one where it does not hold, else the other.
    pub(crate) fn and(self, other: Self) -> Self {
        if self == Self::Holds { other } else { self }
    }
}

/// Force over indentation, on the branch that is stable while the indentation is prescribed.
pub trait Law<T: Number> {
    /// Whether the parameters make sense.
    ///
    /// # Errors
    /// [`LawError`].
    fn check(&self) -> Result<(), LawError>;

    /// Force in N at an indentation in m; zero where there is no contact.
    fn force(&self, indentation_m: T) -> T;

    /// Stiffness dF/d(indentation) in N/m; zero where there is no contact.
    fn derivative(&self, indentation_m: T) -> T;

    /// Force and stiffness, where that is cheaper than one after the other.
    fn both(&self, indentation_m: T) -> (T, T) {
        (self.force(indentation_m), self.derivative(indentation_m))
    }

    /// Whether the law holds at an indentation in m.
    fn validity(&self, indentation_m: f64) -> Validity;

    /// Indentation in m from which on the force rises: 0, or below where adhesion holds the bodies.
    fn rises_from_m(&self) -> f64 {
        0.0
    }

    /// Indentation in m at a force in N, on the branch on which the force rises.
    ///
    /// # Errors
    /// [`InverseError`].
    fn inverse(&self, force_n: T) -> Result<T, InverseError> {
        invert(self, force_n, 1e-3)
    }
}

/// The inverse by bracketing, `scale` being a first guess of the size of the indentation.
pub(crate) fn invert<T: Number, L: Law<T> + ?Sized>(
    law: &L,
    force_n: T,
    scale: f64,
) -> Result<T, InverseError> {
    let force = force_n.re();
    if !force.is_finite() {
        return Err(InverseError::NotFinite { force_n: force });
    }
    let at = |x: f64| {
        let (value, slope) = law.both(T::from(x));
        (value.re() - force, slope.re())
    };
    let low = law.rises_from_m();
    let lowest = at(low).0;
    if lowest > 0.0 {
        return Err(InverseError::BelowLowest { force_n: force, lowest_n: lowest + force });
    }
    let mut step = if scale > 0.0 && scale.is_finite() { scale } else { 1e-3 };
    while at(low + step).0 < 0.0 {
        step *= 8.0;
        if !(step < 1e300) {
            return Err(InverseError::NotReached { force_n: force });
        }
    }
    let root = crate::root::rising(at, low, low + step, low + 0.5 * step);
    Ok(polish(T::from(root), |x| {
        let (value, slope) = law.both(x);
        (value - force_n, slope)
    }))
}

/// Newton's steps in `T`, which carry the derivatives of a root whose real part is known: the first is right to first order, the
/// second to third.
pub(crate) fn polish<T: Number>(root: T, f: impl Fn(T) -> (T, T)) -> T {
    let mut x = root;
    for _ in 0..T::NDERIV.min(2) {
        let (value, slope) = f(x);
        if slope.re() == 0.0 || !slope.re().is_finite() {
            return x;
        }
        x -= value / slope;
    }
    x
}

pub(crate) fn positive(name: &'static str, value: f64) -> Result<(), LawError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(LawError::NotPositive { name, value }) }
}

pub(crate) fn zero_or_more(name: &'static str, value: f64) -> Result<(), LawError> {
    if value >= 0.0 && value.is_finite() { Ok(()) } else { Err(LawError::Negative { name, value }) }
}

pub(crate) fn finite(name: &'static str, value: f64) -> Result<(), LawError> {
    if value.is_finite() { Ok(()) } else { Err(LawError::NotFinite { name, value }) }
}

pub(crate) fn poisson(value: f64) -> Result<(), LawError> {
    if value > -1.0 && value <= 0.5 {
        Ok(())
    } else {
        Err(LawError::OutOfRange { name: "poisson_ratio", value, low: -1.0, high: 0.5 })
    }
}

/// `E / (1 - nu^2)`.
pub(crate) fn plane_modulus<T: Number>(modulus_pa: T, poisson_ratio: f64) -> T {
    modulus_pa / (1.0 - poisson_ratio * poisson_ratio)
}
