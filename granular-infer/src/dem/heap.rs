//! A heap in a few numbers.

use super::error::DemError;
use crate::order::quantile;

/// A heap on the plane z = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heap {
    /// Mean distance of the grains' centres from the axis, m; half the foot's radius for a sharp cone.
    pub mean_radius_m: f64,
    /// Median of the same distances, m; grains that rolled far away do not move it.
    pub median_radius_m: f64,
    /// Highest point of any grain, m.
    pub height_m: f64,
    /// Mean height of the centres, m.
    pub mean_height_m: f64,
}

/// The heap's numbers about a vertical axis through `axis_m`; no grains, or lists of two lengths, are an error.
pub fn heap(positions_m: &[[f64; 3]], radii_m: &[f64], axis_m: [f64; 2]) -> Result<Heap, DemError> {
    let n = positions_m.len();
    if n == 0 {
        return Err(DemError::Count { received: 0, most: super::MAX_GRAINS });
    }
    if radii_m.len() != n {
        return Err(DemError::Length { name: "radii_m", expected: n, received: radii_m.len() });
    }
    let mut from_axis: Vec<f64> =
        positions_m.iter().map(|p| (p[0] - axis_m[0]).hypot(p[1] - axis_m[1])).collect();
    let tops = positions_m.iter().zip(radii_m).map(|(p, r)| p[2] + r);
    Ok(Heap {
        mean_radius_m: from_axis.iter().sum::<f64>() / n as f64,
        median_radius_m: quantile(&mut from_axis, 0.5),
        height_m: tops.fold(f64::NEG_INFINITY, f64::max),
        mean_height_m: positions_m.iter().map(|p| p[2]).sum::<f64>() / n as f64,
    })
}
