//! The elastic band that rolls a dough.

/// A band between two fingers: it is stiffer the wider they stand, and the deeper it is pressed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Stiffness at the smallest throw, N/m.
    pub k0_n_m: f64,
    /// By how much it grows with the throw, N/m^2.
    pub k1_n_m2: f64,
    /// The throw of `k0_n_m`, m.
    pub throw0_m: f64,
    /// Relative growth with the depth, 1/m.
    pub k2_per_m: f64,
}

impl Default for Band {
    /// The band of the format: 60 N/m, 900 N/m^2, 0.04 m, 8 1/m.
    fn default() -> Self {
        Self { k0_n_m: 60.0, k1_n_m2: 900.0, throw0_m: 0.04, k2_per_m: 8.0 }
    }
}

impl Band {
    /// Force (N) at a throw and a depth (m): `(k0 + k1 (throw - throw0)) depth (1 + k2 depth)`.
    pub fn force_n(&self, throw_m: f64, depth_m: f64) -> f64 {
        (self.k0_n_m + self.k1_n_m2 * (throw_m - self.throw0_m)) * depth_m * (1.0 + self.k2_per_m * depth_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_is_a_spring_that_stiffens() {
        let band = Band::default();
        approx::assert_relative_eq!(band.force_n(0.04, 0.02), 60.0 * 0.02 * 1.16, max_relative = 1e-14);
        approx::assert_relative_eq!(band.force_n(0.06, 0.01), 78.0 * 0.01 * 1.08, max_relative = 1e-14);
        assert!(band.force_n(0.04, 0.0).abs() < 1e-300);
    }
}
