//! A ball in flight: gravity, drag, lift, wind.

mod error;
mod forces;
mod integrate;

pub use error::FlightError;
pub use forces::{Flight, State};

use num_dual::DualNum;

impl<T: DualNum<Primitive = f64, Real = f64> + Copy> Flight<T> {
    /// The states at rising times (s, from the start on), to a relative error of 1e-9.
    ///
    /// Plain numbers for which only linear drag and constant forces act take the closed form; everything else is
    /// integrated. A dual number is integrated always, since a coefficient of zero may have a derivative.
    ///
    /// # Errors
    /// [`FlightError`]; `out` is then unspecified.
    pub fn states(&self, start: &State<T>, times_s: &[f64], out: &mut [State<T>]) -> Result<(), FlightError> {
        let zero = |v: &T| v.re() == 0.0;
        let closed = T::NDERIV == 0
            && zero(&self.quadratic_per_m)
            && zero(&self.cubic_s_per_m2)
            && self.lift_per_s.iter().chain(&self.stiffness_per_s2).all(zero);
        if closed {
            return self.states_in_linear_drag(start, times_s, out);
        }
        self.check(start, times_s, out.len())?;
        integrate::states(self, start, times_s, out)
    }

    /// The states in closed form, under gravity, linear drag, wind and constant forces alone; whatever else is set is
    /// left out.
    ///
    /// # Errors
    /// [`FlightError`].
    pub fn states_in_linear_drag(
        &self,
        start: &State<T>,
        times_s: &[f64],
        out: &mut [State<T>],
    ) -> Result<(), FlightError> {
        self.check(start, times_s, out.len())?;
        for (state, &t) in out.iter_mut().zip(times_s) {
            *state = self.linear(start, t);
            if !state.position.iter().chain(&state.velocity).all(|v| v.re().is_finite()) {
                return Err(FlightError::Overflow { time_s: t });
            }
        }
        Ok(())
    }

    fn check(&self, start: &State<T>, times_s: &[f64], got: usize) -> Result<(), FlightError> {
        if got != times_s.len() {
            return Err(FlightError::Length { expected: times_s.len(), got });
        }
        let vectors = [
            ("constant_m_s2", &self.constant_m_s2),
            ("lift_per_s", &self.lift_per_s),
            ("wind_m_s", &self.wind_m_s),
            ("stiffness_per_s2", &self.stiffness_per_s2),
            ("position", &start.position),
            ("velocity", &start.velocity),
        ];
        let scalars = [
            ("quadratic_per_m", self.quadratic_per_m.re()),
            ("linear_per_s", self.linear_per_s.re()),
            ("cubic_s_per_m2", self.cubic_s_per_m2.re()),
            ("gravity_m_s2", self.gravity_m_s2),
        ];
        let all =
            scalars.into_iter().chain(vectors.iter().flat_map(|(n, v)| v.iter().map(move |x| (*n, x.re()))));
        for (name, value) in all {
            if !value.is_finite() {
                return Err(FlightError::NotFinite { name, value });
            }
        }
        for (name, value) in &scalars[..2] {
            if *value < 0.0 {
                return Err(FlightError::Negative { name, value: *value });
            }
        }
        let mut last = 0.0;
        for (index, &value) in times_s.iter().enumerate() {
            if !(value >= last && value.is_finite()) {
                return Err(FlightError::Times { index, value });
            }
            last = value;
        }
        Ok(())
    }

    /// Linear drag and constant forces at time `t`.
    fn linear(&self, start: &State<T>, t: f64) -> State<T> {
        // With x = r t: v = v0 - x f(x) u0 + t f(x) a, p = p0 + t v0 + t^2 g(x) (a - r u0),
        // f(x) = (1 - e^-x) / x, g(x) = (1 - f(x)) / x; both have series at 0.
        let x = self.linear_per_s * t;
        let (f, g) = if x.re() < 1e-2 {
            let (mut f, mut g) = (T::from(0.0), T::from(0.0));
            for n in (1..=8).rev() {
                // Horner: f = 1 - x/2 (1 - x/3 (...)), g = 1/2 - x/6 + x^2/24 - ...
                f = (T::from(1.0) - x * f) * (1.0 / f64::from(n + 1));
                g = (T::from(1.0) - x * g) * (1.0 / f64::from(n + 2));
            }
            (T::from(1.0) - x * f, (T::from(1.0) - x * g) * 0.5)
        } else {
            let f = -(-x).exp_m1() / x;
            (f, (T::from(1.0) - f) / x)
        };
        let mut state = *start;
        for i in 0..3 {
            let down = if i == 2 { self.gravity_m_s2 } else { 0.0 };
            let pull = self.constant_m_s2[i]
                - T::from(down)
                - self.linear_per_s * (start.velocity[i] - self.wind_m_s[i]);
            state.velocity[i] += pull * f * t;
            state.position[i] += start.velocity[i] * t + pull * g * (t * t);
        }
        state
    }
}

/// Quadratic drag in 1/m of a sphere: `k = rho Cd A / (2 m)`, from its drag coefficient, diameter (m), mass (kg) and the
/// air's density (kg/m^3).
pub fn drag_per_m(drag_coefficient: f64, diameter_m: f64, mass_kg: f64, air_density_kg_m3: f64) -> f64 {
    let area = 0.25 * std::f64::consts::PI * diameter_m * diameter_m;
    0.5 * air_density_kg_m3 * drag_coefficient * area / mass_kg
}
