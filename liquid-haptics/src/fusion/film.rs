//! The likelihood of a drain: of a volume and a viscosity, as a normal shape over the logarithm of the density.

use super::gaussian::Shape;
use super::swing::DrainRows;
use super::tilt::parabola;
use crate::container::{Container, Cylinder};
use crate::viscosity::{Bottle, Drain};

/// Volumes that are planned, beside none.
const PLANS: usize = 160;
/// A relative error of the weight above this one is no narrow one.
const NARROW: f64 = 0.3;

/// Drains of every volume of a cylinder.
pub(super) struct Drains {
    plans: Vec<Drain>,
    gravity_m_s2: f64,
}

impl Drains {
    pub(super) fn new(cylinder: &Cylinder, gravity_m_s2: f64) -> Self {
        let plan = |k: usize| {
            // Neither empty nor full: a film needs liquid, and a wall that is free.
            let share = (k as f64 / PLANS as f64).clamp(0.002, 0.998);
            Drain::new(&Bottle {
                radius_m: cylinder.inner_radius_m(),
                length_m: cylinder.inner_length_m(),
                volume_m3: share * cylinder.capacity_m3(),
                mass_kg: 1.0,
                gravity_m_s2,
            })
        };
        Self { plans: (0..=PLANS).map(plan).collect(), gravity_m_s2 }
    }

    /// The drain of a share of the capacity, by cubics between the plans.
    pub(super) fn at(&self, share: f64) -> Drain {
        let place = share * PLANS as f64;
        let k = (place.floor().max(0.0) as usize).min(PLANS - 1);
        let u = place - k as f64;
        let at = |offset: usize| &self.plans[(k + offset).saturating_sub(1).min(PLANS)];
        let factors = [
            0.5 * u * (-1.0 + u * (2.0 - u)),
            1.0 + 0.5 * u * u * (3.0 * u - 5.0),
            0.5 * u * (1.0 + u * (4.0 - 3.0 * u)),
            0.5 * u * u * (u - 1.0),
        ];
        Drain::mixed([at(0), at(1), at(2), at(3)], factors)
    }

    /// The likelihood of a viscosity (m^2/s) in a drain over that of no motion, over the logarithm of the density (between two, kg/m^3), where the
    /// weight has a relative error; and the squares it leaves.
    pub(super) fn shape(
        &self,
        rows: &DrainRows,
        drain: &Drain,
        viscosity_m2_s: f64,
        weight_error: f64,
        ln_density: [f64; 2],
    ) -> (Shape, f64) {
        let column: Vec<f64> = rows
            .t_s
            .iter()
            .zip(&rows.noise_nm)
            .map(|(t, noise)| -self.gravity_m_s2 * drain.moment_m4(viscosity_m2_s, *t) / noise)
            .collect();
        let [own, with] = rows.nuisance.one(&column);
        let base = rows.nuisance.ln_likelihood - rows.still;
        let gain = 0.5 * with * with / own;
        let (density, sd) = (with / own, own.sqrt().recip());
        if density > 0.0 && sd < NARROW * density {
            let narrow = sd / density;
            let wide = narrow.hypot(weight_error);
            let shape = Shape { peak: base + gain + (narrow / wide).ln(), mean: density.ln(), sd: wide };
            return (shape, rows.nuisance.squares - 2.0 * gain);
        }
        let at = |x: f64| base + x.exp() * (with - 0.5 * own * x.exp());
        let [low, high] = ln_density;
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let shape = parabola([at(low), at(middle), at(high)], middle, half);
        (shape, rows.nuisance.squares - 2.0 * (at(middle) - base))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// Between the plans the drain is that which is planned there.
    #[test]
    fn drains_between_plans_are_those_planned_there() {
        let cylinder = Cylinder::new(0.035, 0.172, 0.001).unwrap();
        let drains = Drains::new(&cylinder, 9.81);
        for share in [0.11, 0.27, 0.49, 0.51, 0.73, 0.88] {
            let volume = share * cylinder.capacity_m3();
            let exact = Drain::new(&Bottle::new(&cylinder, volume, 1.0, 9.81).unwrap());
            let mixed = drains.at(share);
            for viscosity in [1e-3, 1e-2, 0.1] {
                for t in [0.3, 1.0, 5.0, 20.0] {
                    let whole = exact.moment_m4(viscosity, 0.0);
                    let off = mixed.moment_m4(viscosity, t) - exact.moment_m4(viscosity, t);
                    assert!(off.abs() < 2e-4 * whole, "{share} {viscosity} {t}: {}", off / whole);
                }
            }
        }
    }
}
