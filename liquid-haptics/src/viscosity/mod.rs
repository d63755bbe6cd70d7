//! How thick a liquid is, from what the wrist feels after its bottle has been swung upright ([Matl 2021], section 2.4 and appendix A.3).
//!
//! A thin liquid sloshes: the damping of its first mode, fitted to all readings at once, gives the kinematic viscosity by
//! [Matl 2021], eq. 2.4. A thick one drains down the wall: the torque of the film gives it by [`Drain`]. [`ViscosityFit`] tells from the
//! readings which of the two it is, and says so where they do not tell.

mod drain;
mod drain_fit;
mod error;
mod estimate;
mod least_squares;
mod mode;
pub mod tank;

pub use drain::{Drain, rise_time_s, thesis_drain_viscosity};
pub use error::ViscosityError;
pub use estimate::{Refusal, Regime, Verdict, ViscosityEstimate, ViscosityFit};
pub use mode::{ModeFit, fit_mode};

use statrs::distribution::{ContinuousCDF, Normal};

use crate::container::{Container, ContainerError, Cylinder};

/// A cylinder with liquid in it, as far as its motion goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bottle {
    /// Radius of the cavity, m.
    pub radius_m: f64,
    /// Length of the cavity, m.
    pub length_m: f64,
    /// Volume of the liquid, m^3.
    pub volume_m3: f64,
    /// Mass of the liquid, kg.
    pub mass_kg: f64,
    /// Gravity, m/s^2.
    pub gravity_m_s2: f64,
}

impl Bottle {
    /// A cylinder with a volume (m^3) and a mass (kg) of liquid in it.
    ///
    /// # Errors
    /// [`ContainerError::Volume`] where the volume does not fit.
    pub fn new(
        cylinder: &Cylinder,
        volume_m3: f64,
        mass_kg: f64,
        gravity_m_s2: f64,
    ) -> Result<Self, ContainerError> {
        let capacity_m3 = cylinder.capacity_m3();
        if !(volume_m3 >= 0.0 && volume_m3 <= capacity_m3) {
            return Err(ContainerError::Volume { got_m3: volume_m3, capacity_m3 });
        }
        Ok(Self {
            radius_m: cylinder.inner_radius_m(),
            length_m: cylinder.inner_length_m(),
            volume_m3,
            mass_kg,
            gravity_m_s2,
        })
    }

    /// Density of the liquid, kg/m^3.
    pub fn density_kg_m3(&self) -> f64 {
        self.mass_kg / self.volume_m3
    }

    /// Height of the liquid's surface above the cavity's bottom when upright, m.
    pub fn level_m(&self) -> f64 {
        self.volume_m3 / (std::f64::consts::PI * self.radius_m * self.radius_m)
    }
}

/// Standard errors that 95 % of a normal variable lie within.
fn normal_quantile() -> f64 {
    Normal::standard().inverse_cdf(0.975)
}

/// As many times as readings, at least `least`; all numbers, times rising.
fn checked(t_s: &[f64], reading: &[f64], least: usize) -> Result<(), ViscosityError> {
    if t_s.len() != reading.len() {
        return Err(ViscosityError::Lengths { times: t_s.len(), readings: reading.len() });
    }
    if t_s.len() < least {
        return Err(ViscosityError::TooFew { got: t_s.len(), least });
    }
    let bad = |index, what, got, expected| Err(ViscosityError::Reading { index, what, got, expected });
    for (i, (t, y)) in t_s.iter().zip(reading).enumerate() {
        if !t.is_finite() {
            return bad(i, "time", *t, "a number");
        }
        if !y.is_finite() {
            return bad(i, "value", *y, "a number");
        }
        if i > 0 && !(*t > t_s[i - 1]) {
            return bad(i, "time", *t, "more than the one before");
        }
    }
    Ok(())
}
