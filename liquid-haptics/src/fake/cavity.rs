//! Where liquid lies in a cavity, by summing columns.

use std::fmt::Debug;

/// Steps of the bisection for the level.
const HALVINGS: usize = 50;

/// A cavity as columns that run along its axis (z, from 0 at the container's outer bottom); x is the side that goes down.
pub trait Cavity: Debug {
    /// The columns: `[x, cross-section, from, to]` in m, m^2, m, m. Every column is symmetric in y.
    fn columns(&self) -> &[[f64; 4]];

    /// Volume, m^3.
    fn capacity_m3(&self) -> f64 {
        self.columns().iter().map(|[_, area, from, to]| area * (to - from)).sum()
    }

    /// Volume and its first moments along x and z of what lies below a level (m, along up) at a tilt (rad).
    fn below(&self, tilt_rad: f64, level_m: f64) -> [f64; 3] {
        let (sin, cos) = tilt_rad.sin_cos();
        let mut sums = [0.0; 3];
        for &[x, area, from, to] in self.columns() {
            // Wet where -x sin + z cos <= level.
            let (low, high) = if cos.abs() < 1e-12 {
                if -x * sin <= level_m { (from, to) } else { (from, from) }
            } else {
                let at = ((level_m + x * sin) / cos).clamp(from, to);
                if cos > 0.0 { (from, at) } else { (at, to) }
            };
            let volume = area * (high - low);
            sums[0] += volume;
            sums[1] += volume * x;
            sums[2] += volume * 0.5 * (high + low);
        }
        sums
    }

    /// Centre of mass `[x, z]` (m) of a volume (m^3, above 0, at most the capacity) at a tilt (rad).
    fn center(&self, tilt_rad: f64, volume_m3: f64) -> [f64; 2] {
        let reach = self.columns().iter().fold(0.0f64, |most, c| most.max(c[0].abs() + c[3].abs()));
        let (mut low, mut high) = (-reach, reach);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.below(tilt_rad, middle)[0] < volume_m3 { low = middle } else { high = middle }
        }
        // Between the last two levels moments are as good as linear in the volume.
        let (less, more) = (self.below(tilt_rad, low), self.below(tilt_rad, high));
        let gap = more[0] - less[0];
        let share = if gap > 0.0 { ((volume_m3 - less[0]) / gap).clamp(0.0, 1.0) } else { 0.0 };
        let at = |k: usize| less[k] + share * (more[k] - less[k]);
        [at(1) / at(0), at(2) / at(0)]
    }
}

/// A circular cylinder.
#[derive(Debug, Clone, PartialEq)]
pub struct Round {
    columns: Vec<[f64; 4]>,
}

impl Round {
    /// A cavity of inner radius and length (m) that begins a bottom's thickness (m) up, in that many columns.
    pub fn new(radius_m: f64, length_m: f64, bottom_m: f64, columns: usize) -> Self {
        let step = std::f64::consts::PI / columns as f64;
        let column = |k: usize| {
            // Columns of equal angle: the midpoint rule converges fast, as slices vanish at both ends.
            let (sin, cos) = ((k as f64 + 0.5) * step).sin_cos();
            [radius_m * cos, 2.0 * (radius_m * sin).powi(2) * step, bottom_m, bottom_m + length_m]
        };
        Self { columns: (0..columns).map(column).collect() }
    }
}

impl Cavity for Round {
    fn columns(&self) -> &[[f64; 4]] {
        &self.columns
    }
}

/// A carton: a square box with a gable of two slopes on top that meet in a ridge along y.
#[derive(Debug, Clone, PartialEq)]
pub struct Box3 {
    columns: Vec<[f64; 4]>,
}

impl Box3 {
    /// A cavity of inner width, height of the walls and of the gable above them (m), in that many columns.
    pub fn new(width_m: f64, walls_m: f64, gable_m: f64, columns: usize) -> Self {
        let step = width_m / columns as f64;
        let column = |k: usize| {
            let x = (k as f64 + 0.5) * step - 0.5 * width_m;
            [x, step * width_m, 0.0, walls_m + gable_m * (1.0 - 2.0 * x.abs() / width_m)]
        };
        Self { columns: (0..columns).map(column).collect() }
    }
}

impl Cavity for Box3 {
    fn columns(&self) -> &[[f64; 4]] {
        &self.columns
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn a_half_full_cylinder_on_its_side_is_as_by_hand() {
        let cavity = Round::new(0.03, 0.1, 0.002, 4000);
        approx::assert_relative_eq!(cavity.capacity_m3(), PI * 0.03f64.powi(2) * 0.1, max_relative = 1e-9);
        let [x, z] = cavity.center(0.5 * PI, 0.5 * cavity.capacity_m3());
        approx::assert_relative_eq!(x, 4.0 * 0.03 / (3.0 * PI), max_relative = 1e-4);
        approx::assert_relative_eq!(z, 0.052, max_relative = 1e-9);
    }
}
