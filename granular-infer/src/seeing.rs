//! From a depth picture to heights above the ground.

use statrs::statistics::{Data, OrderStatistics as _};

use crate::camera::Camera;

/// A depth picture as heights above a plane that was fitted to its ground.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    /// Width and height in pixels.
    pub size_px: [usize; 2],
    /// x and y in m of every pixel, row by row.
    pub places_m: Vec<[f64; 2]>,
    /// Height above the ground in m; NaN where the pixel is missing.
    pub heights_m: Vec<f64>,
    /// How much deeper the ground reads, below the camera, than the camera's stated height, m.
    pub ground_m: f64,
    /// Slope of the ground along x and y.
    pub slope: [f64; 2],
    /// Sigma of a pixel on the ground, m.
    pub noise_m: f64,
    /// Share of the pixels that are missing.
    pub missing: f64,
}

/// A picture that does not show grains on a ground.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SeeError {
    /// The picture has another number of pixels than its size says.
    #[error("{received} pixels, expected {expected}")]
    Size {
        /// Pixels that came.
        received: usize,
        /// Width times height.
        expected: usize,
    },
    /// Most pixels are missing.
    #[error("{missing:.0} % of the pixels are missing, expected at most {most:.0} %")]
    Missing {
        /// Missing ones in percent.
        missing: f64,
        /// Most allowed, in percent.
        most: f64,
    },
    /// Most pixels are at the sensor's limit.
    #[error("{saturated:.0} % of the pixels are at the limit of {limit} counts: the picture is saturated")]
    Saturated {
        /// Such pixels in percent.
        saturated: f64,
        /// The limit.
        limit: u16,
    },
    /// The picture's depth has nothing to do with the camera's height.
    #[error(
        "the middle depth is {depth_m:.4} m and the camera stands {height_m} m high: is depth_unit_m = {unit_m} right?"
    )]
    Unit {
        /// Median depth in m.
        depth_m: f64,
        /// The camera's height in m.
        height_m: f64,
        /// The unit in m.
        unit_m: f64,
    },
    /// No plane holds a fair part of the pixels.
    #[error("{share:.0} % of the pixels lie on a plane, expected at least {least:.0} %: there is no ground")]
    NoGround {
        /// Pixels on the best plane, percent.
        share: f64,
        /// Fewest allowed, percent.
        least: f64,
    },
    /// Nothing stands above the ground.
    #[error(
        "{volume_m3:.2e} m3 stand above the ground, expected about {expected_m3:.2e} m3: there are no grains"
    )]
    NoGrains {
        /// What is seen, m3.
        volume_m3: f64,
        /// What the grains should take up, m3.
        expected_m3: f64,
    },
}

/// Most missing pixels, percent.
const MOST_MISSING: f64 = 60.0;
/// Most saturated pixels, percent.
const MOST_SATURATED: f64 = 20.0;
/// Depth of the ground over the camera's height, at most (or its inverse, at least).
const UNIT_FACTOR: f64 = 1.3;
/// Fewest pixels on the ground, percent.
const LEAST_GROUND: f64 = 25.0;
/// Depths in m below the ground over which its noise is looked for.
const MOST_NOISE: f64 = 0.02;
/// Noise over that depth from which there is no ground: depths that are spread evenly have 0.74.
const ROUGH: f64 = 0.6;
/// Least share of the grains' volume that has to be seen.
const LEAST_VOLUME: f64 = 0.2;

impl HeightMap {
    /// Reads counts (0: missing) row by row; `volume_m3` is what the grains take up.
    ///
    /// # Errors
    /// [`SeeError`].
    pub fn new(camera: &Camera, counts: &[u16], volume_m3: f64) -> Result<Self, SeeError> {
        let [width, height] = camera.size_px;
        if counts.len() != width * height || counts.is_empty() {
            return Err(SeeError::Size { received: counts.len(), expected: width * height });
        }
        let limit = counts.iter().filter(|c| **c == u16::MAX).count();
        let saturated = 100.0 * limit as f64 / counts.len() as f64;
        if saturated > MOST_SATURATED {
            return Err(SeeError::Saturated { saturated, limit: u16::MAX });
        }
        let depths: Vec<f64> = counts
            .iter()
            .map(|&c| if c == 0 { f64::NAN } else { f64::from(c) * camera.depth_unit_m })
            .collect();
        Self::from_depths(camera, &depths, volume_m3)
    }

    /// As [`HeightMap::new`], from depths in m (NaN: missing).
    ///
    /// # Errors
    /// [`SeeError`], but for saturation.
    pub fn from_depths(camera: &Camera, depths: &[f64], volume_m3: f64) -> Result<Self, SeeError> {
        let [width, height] = camera.size_px;
        if depths.len() != width * height || depths.is_empty() {
            return Err(SeeError::Size { received: depths.len(), expected: width * height });
        }
        let missing = 100.0 * depths.iter().filter(|d| !d.is_finite()).count() as f64 / depths.len() as f64;
        if missing > MOST_MISSING {
            return Err(SeeError::Missing { missing, most: MOST_MISSING });
        }
        let some = depths.iter().step_by(one_in(depths.len())).copied().filter(|d| d.is_finite());
        let middle = Data::new(some.collect::<Vec<_>>()).median();
        if !(middle < UNIT_FACTOR * camera.height_m && middle > camera.height_m / UNIT_FACTOR) {
            let (height_m, unit_m) = (camera.height_m, camera.depth_unit_m);
            return Err(SeeError::Unit { depth_m: middle, height_m, unit_m });
        }
        let rays: Vec<[f64; 2]> =
            (0..depths.len()).map(|i| camera.place_m(i % width, i / width, 1.0)).collect();
        let plane = ground(camera, depths, &rays)?;
        let mut places_m = Vec::with_capacity(depths.len());
        let mut heights_m = Vec::with_capacity(depths.len());
        for (ray, depth) in rays.iter().zip(depths) {
            let z = plane.depth(*ray) - depth;
            // What the depth has in excess is the camera's; the ground lies where it was said to.
            let seen = if z.is_finite() { camera.height_m - z } else { camera.height_m };
            places_m.push(ray.map(|r| r * seen));
            heights_m.push(z);
        }
        let map = Self {
            size_px: camera.size_px,
            places_m,
            heights_m,
            ground_m: plane.level - camera.height_m,
            slope: plane.slope.map(|s| -s),
            noise_m: plane.noise,
            missing: 0.01 * missing,
        };
        let above = map.volume_m3(camera);
        if above < LEAST_VOLUME * volume_m3 {
            return Err(SeeError::NoGrains { volume_m3: above, expected_m3: volume_m3 });
        }
        Ok(map)
    }

    /// Volume in m3 between the ground and what clearly stands above it.
    fn volume_m3(&self, camera: &Camera) -> f64 {
        let clear = self.heights_m.iter().filter(|z| **z > 4.0 * self.noise_m);
        let area = |z: &f64| (camera.height_m - z).powi(2) / (camera.focal_px[0] * camera.focal_px[1]);
        // A sum of nothing is -0.
        clear.map(|z| z * area(z)).sum::<f64>() + 0.0
    }
}

/// A ground plane: depth at x = y = 0, slopes of the depth, noise about it.
struct Plane {
    level: f64,
    slope: [f64; 2],
    noise: f64,
}

impl Plane {
    /// Depth in m of the plane along a pixel's ray, which passes x and y in m at a depth of 1 m.
    fn depth(&self, [x, y]: [f64; 2]) -> f64 {
        self.level / (1.0 - self.slope[0] * x - self.slope[1] * y)
    }

    /// Moves to where most pixels (depth, ray) lie, and says on how many it ended; the first band is twice as wide where the level is a
    /// guess.
    fn settle<'p>(
        &mut self,
        camera: &Camera,
        pixels: impl Iterator<Item = (&'p f64, &'p [f64; 2])> + Clone,
        guess: bool,
    ) -> usize {
        let (mut left, mut deeper) = (Vec::new(), Vec::new());
        let mut within = 0u32;
        for round in 0..ROUNDS {
            left.clear();
            left.extend(pixels.clone().map(|(d, ray)| d - self.depth(*ray)));
            // Deeper than the ground is only noise: its spread is the noise's. Half of the ground is; no branch could be foreseen.
            deeper.resize(left.len(), 0.0);
            let mut count = 0;
            for r in &left {
                deeper[count] = *r;
                count += usize::from(*r > 0.0 && *r < MOST_NOISE);
            }
            self.noise = (1.4826 * Data::new(&mut deeper[..count]).median())
                .max(0.3 * camera.depth_unit_m)
                .min(MOST_NOISE);
            let band = 2.5 * self.noise * if guess && round == 0 { 2.0 } else { 1.0 };
            let mut sums = [[0.0; 9]; 2];
            within = 0;
            for (k, (r, (_, [x, y]))) in left.iter().zip(pixels.clone()).enumerate() {
                if r.abs() < band {
                    let terms = [1.0, *x, *y, x * x, x * y, y * y, *r, r * x, r * y];
                    sums[k % 2].iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                    within += 1;
                }
            }
            let [n, x, y, xx, xy, yy, r, rx, ry] = std::array::from_fn(|k| sums[0][k] + sums[1][k]);
            let h = camera.height_m;
            let normal = nalgebra::Matrix3::new(
                n,
                h * x,
                h * y,
                h * x,
                h * h * xx,
                h * h * xy,
                h * y,
                h * h * xy,
                h * h * yy,
            );
            let right = nalgebra::Vector3::new(r, h * rx, h * ry);
            let Some(step) = normal.cholesky().map(|c| c.solve(&right)) else { break };
            self.level += step[0];
            self.slope[0] += step[1];
            self.slope[1] += step[2];
            if step.amax() < SETTLED * self.noise / f64::from(within).sqrt() {
                break;
            }
        }
        within as usize
    }
}

/// One in so many pixels of a picture says nearly where the ground lies: of a small picture all do.
const fn one_in(pixels: usize) -> usize {
    if pixels < 20_000 { 1 } else { 17 }
}

/// Most rounds in which the ground is looked for.
const ROUNDS: usize = 12;
/// A step of less than this part of its standard error ends the search for the ground.
const SETTLED: f64 = 0.01;

/// The plane that most pixels lie on: from the commonest depth, least squares over what lies within 2.5 sigma, repeated; first for some of
/// the pixels, then for all.
fn ground(camera: &Camera, depths: &[f64], rays: &[[f64; 2]]) -> Result<Plane, SeeError> {
    let few = one_in(depths.len());
    let level = commonest(camera, depths.iter().step_by(few).copied());
    let mut plane = Plane { level, slope: [0.0; 2], noise: 0.0 };
    let mut within = plane.settle(camera, depths.iter().zip(rays).step_by(few), true);
    if few > 1 {
        within = plane.settle(camera, depths.iter().zip(rays), false);
    }
    let finite = depths.iter().filter(|d| d.is_finite()).count();
    let share = 100.0 * within as f64 / finite.max(1) as f64;
    if share < LEAST_GROUND || plane.noise >= ROUGH * MOST_NOISE || plane.slope.iter().any(|s| s.abs() > 1.0)
    {
        return Err(SeeError::NoGround { share, least: LEAST_GROUND });
    }
    Ok(plane)
}

/// The commonest depth, in bins of half a percent of the camera's height.
fn commonest(camera: &Camera, depths: impl Iterator<Item = f64> + Clone) -> f64 {
    let bin = 5e-3 * camera.height_m;
    let mut bins = vec![0u32; 1 + (2.0 * camera.height_m / bin) as usize];
    for d in depths.clone().filter(|d| d.is_finite()) {
        if let Some(count) = bins.get_mut((d / bin) as usize) {
            *count += 1;
        }
    }
    let most = bins.iter().enumerate().max_by_key(|(_, n)| **n).map_or(0, |(i, _)| i);
    let middle = (most as f64 + 0.5) * bin;
    // A little wider than the bin: a ground without noise may lie on its very edge.
    let near = depths.filter(|d| (d - middle).abs() <= 0.6 * bin);
    Data::new(near.collect::<Vec<_>>()).median()
}
