//! The dome: radius, firmness and markers at a pressure.

use hertz_contact::indenter::{Indenter, effective_radius_m};
use hertz_contact::law::{Indentation, Law};

/// A hemisphere of silicone with markers inside (section 5.2).
#[derive(Debug, Clone, PartialEq)]
pub struct Dome {
    /// Radius without pressure, m.
    pub radius_m: f64,
    /// Growth of the radius, m/Pa.
    pub growth_m_pa: f64,
    /// Young's modulus of the ball without pressure, Pa.
    pub modulus_pa: f64,
    /// Its rise, Pa/Pa.
    pub stiffening: f64,
    /// Part of the skin's tension `p R / 2` that a contact feels as a linear term.
    pub tension: f64,
    /// Stretching of the skin, N/m^3.
    pub stretching_n_m3: f64,
    /// Directions of the markers: angle from the axis, and about it, in rad.
    pub markers: Vec<[f64; 2]>,
}

impl Dome {
    /// The tip of [Matl 2021]: 21.23 mm, markers about 7 mm apart up to 60 degrees off the axis.
    pub fn matl_2021() -> Self {
        let mut dome = Self {
            radius_m: 0.02123,
            growth_m_pa: 7e-7,
            modulus_pa: 4000.0,
            stiffening: 2.8,
            tension: 0.1,
            stretching_n_m3: 2e4,
            markers: Vec::new(),
        };
        dome.cover(0.0060, 1.05);
        dome
    }

    /// Rings of markers, so far apart (m), up to an angle off the axis (rad).
    pub fn cover(&mut self, apart_m: f64, end_rad: f64) {
        self.markers.clear();
        let step = apart_m / self.radius_m;
        let mut ring = 0.0;
        while ring <= end_rad {
            let around = (std::f64::consts::TAU * ring.sin() / step).floor().max(1.0);
            for k in 0..around as usize {
                // Rings are turned against each other: no two markers lie in line with the axis.
                self.markers.push([ring, (k as f64 + 0.37 * ring / step) / around * std::f64::consts::TAU]);
            }
            ring += step;
        }
    }

    /// Radius at a pressure, m.
    pub fn radius_at_m(&self, pressure_pa: f64) -> f64 {
        self.radius_m + self.growth_m_pa * pressure_pa
    }

    /// Force and indentation at a pressure against a probe (infinite radius: a plate).
    pub fn law(&self, pressure_pa: f64, probe_m: f64) -> Indentation<f64> {
        let tip_m = self.radius_at_m(pressure_pa);
        let indenter = Indenter::Sphere { radius_m: effective_radius_m(tip_m, probe_m) };
        let modulus_pa = self.modulus_pa + self.stiffening * pressure_pa;
        Indentation {
            tension_n_m: self.tension * 0.5 * pressure_pa * tip_m,
            stretching_n_m3: self.stretching_n_m3,
            ..Indentation::elastic(indenter, modulus_pa, 0.5)
        }
    }

    /// Normal force in N of an indentation in m.
    pub fn force_n(&self, pressure_pa: f64, probe_m: f64, indentation_m: f64) -> f64 {
        self.law(pressure_pa, probe_m).force(indentation_m)
    }
}
