//! A depth camera that looks straight down: spheres seen with occlusion, blur, noise and missing pixels.
//!
//! Pixel centres are at whole numbers, u = +x, v = -y, depth along the optical axis, the axis through x = y = 0.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use crate::campaign::Grains;

/// A pinhole depth camera above the ground z = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Focal lengths in pixels.
    pub focal_px: [f64; 2],
    /// Principal point in pixels.
    pub centre_px: [f64; 2],
    /// Height above the ground in m.
    pub height_m: f64,
    /// Depth of one count in m.
    pub depth_unit_m: f64,
    /// Width and height of the picture in pixels.
    pub size_px: [usize; 2],
}

/// What spoils a picture.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Flaws {
    /// Sigma of a Gaussian blur of the depth in pixels.
    pub blur_px: f64,
    /// Sigma of a pixel's noise in m, added after the blur.
    pub noise_m: f64,
    /// Share of pixels that are missing wherever they are.
    pub missing: f64,
    /// Share of the pixels at an edge that are missing beside those.
    pub missing_at_edges: f64,
    /// Step of depth to a neighbour, in m, from which a pixel is at an edge.
    pub edge_m: f64,
}

impl Camera {
    /// x and y in m of what a pixel sees at a depth in m.
    pub fn place_m(&self, u: usize, v: usize, depth_m: f64) -> [f64; 2] {
        [
            (u as f64 - self.centre_px[0]) / self.focal_px[0] * depth_m,
            -(v as f64 - self.centre_px[1]) / self.focal_px[1] * depth_m,
        ]
    }

    /// Depth of every pixel in m, row by row: the nearest sphere along its ray, or the ground.
    pub fn render(&self, grains: &Grains) -> Vec<f64> {
        let [width, height] = self.size_px;
        let mut depth = vec![self.height_m; width * height];
        for (place, &radius) in grains.positions_m.iter().zip(&grains.radii_m) {
            let below = self.height_m - place[2];
            if below <= 2.0 * radius {
                continue;
            }
            // A sphere's outline is an ellipse a little wider than its radius at its depth.
            let reach = 1.05 * radius / (below - radius);
            let range = |axis: usize, at: f64, most: usize| {
                let (f, c) = (self.focal_px[axis], self.centre_px[axis]);
                let from = (f * (at / below - reach) + c).floor().clamp(0.0, most as f64) as usize;
                let to = (f * (at / below + reach) + c).ceil().clamp(-1.0, most as f64 - 1.0) + 1.0;
                from..to as usize
            };
            for v in range(1, -place[1], height) {
                for u in range(0, place[0], width) {
                    let [x, y] = self.place_m(u, v, 1.0);
                    // |t (x, y, 1) - (px, py, below)| = radius.
                    let a = x * x + y * y + 1.0;
                    let b = x * place[0] + y * place[1] + below;
                    let c = place[0].powi(2) + place[1].powi(2) + below * below - radius * radius;
                    let root = b * b - a * c;
                    if root > 0.0 {
                        let pixel = &mut depth[v * width + u];
                        *pixel = pixel.min((b - root.sqrt()) / a);
                    }
                }
            }
        }
        depth
    }

    /// Whether the depth steps by more than `edge_m` from a pixel to one of its four neighbours.
    pub fn is_edge(&self, depth_m: &[f64], pixel: usize, edge_m: f64) -> bool {
        let width = self.size_px[0];
        let beside = |other: Option<usize>| {
            other.and_then(|o| depth_m.get(o)).is_some_and(|d| (d - depth_m[pixel]).abs() > edge_m)
        };
        let column = pixel % width;
        beside((column > 0).then(|| pixel - 1))
            || beside((column + 1 < width).then(|| pixel + 1))
            || beside(pixel.checked_sub(width))
            || beside(Some(pixel + width))
    }

    /// The counts that the camera gives for depths in m; 0 where a pixel is missing.
    pub fn expose(&self, depth_m: &[f64], flaws: &Flaws, rng: &mut dyn Rng) -> Vec<u16> {
        let mut blurred = depth_m.to_vec();
        blur(&mut blurred, self.size_px, flaws.blur_px);
        blurred
            .iter()
            .enumerate()
            .map(|(i, d)| {
                let noise: f64 = StandardNormal.sample(&mut *rng);
                let edge = flaws.missing_at_edges > 0.0 && self.is_edge(depth_m, i, flaws.edge_m);
                let share = flaws.missing + if edge { flaws.missing_at_edges } else { 0.0 };
                if rng.random::<f64>() < share {
                    return 0;
                }
                ((d + flaws.noise_m * noise) / self.depth_unit_m).round().clamp(1.0, 65535.0) as u16
            })
            .collect()
    }
}

/// Gaussian blur, rows then columns; pixels at the border are repeated.
fn blur(values: &mut [f64], [width, height]: [usize; 2], sigma_px: f64) {
    if sigma_px < 1e-3 {
        return;
    }
    let reach = (4.0 * sigma_px).ceil() as i64;
    let mut weights: Vec<f64> =
        (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma_px).powi(2)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|w| *w /= sum);
    // What a shift brings to all of a line at once.
    let shifted = |v: usize, k: i64, count: usize| (v as i64 + k).clamp(0, count as i64 - 1) as usize;
    let mut padded = Vec::new();
    for row in values.chunks_exact_mut(width) {
        padded.clear();
        padded.extend((0..width + 2 * reach as usize).map(|u| row[shifted(u, -reach, width)]));
        row.fill(0.0);
        for (k, weight) in weights.iter().enumerate() {
            row.iter_mut().zip(&padded[k..]).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    let rows = values.to_vec();
    for (v, row) in values.chunks_exact_mut(width).enumerate() {
        row.fill(0.0);
        for (k, weight) in (-reach..).zip(&weights) {
            let from = shifted(v, k, height) * width;
            row.iter_mut().zip(&rows[from..from + width]).for_each(|(sum, value)| *sum += weight * value);
        }
    }
}
