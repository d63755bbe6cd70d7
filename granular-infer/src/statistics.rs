//! A picture of poured grains in a few numbers.
//!
//! Lengths are scaled by `L = d N^(1/3)`, the edge of the cube that holds the grains in rows. All of them but the ground's are
//! of heights above the fitted ground; missing pixels do not count.

use std::f64::consts::PI;
use std::sync::LazyLock;

use crate::seeing::HeightMap;

/// Edges of the rings in L.
pub const RINGS: [f64; 10] = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.25, 1.6, 2.1, 3.0];
/// Added to a ring's mean height before its root is taken, in diameters.
const RING_FLOOR: f64 = 0.01;
/// Least height that moments are divided by, over what the grains' volume should give.
const LEAST: f64 = 0.3;
/// Heap and strays part here, in L.
const FOOT: f64 = 1.0;
/// Where grains lie one by one, in L: within it some stand on others.
const STRAYS: f64 = 1.25;
/// Where strays end, in L.
const FAR: f64 = 3.0;
/// Extent of the second moments, in L.
const SECOND: f64 = 1.6;
/// Steps in pixels over which differences of height are taken.
const LAGS: [usize; 3] = [1, 2, 4];

/// How a statistic behaves when the scene is turned about the vertical.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symmetry {
    /// It does not change.
    Scalar,
    /// It is the x of a vector whose y comes next.
    Vector,
    /// It is the `xx - yy` of a tensor whose `2 xy` comes next.
    Tensor,
    /// The second of its pair.
    Second,
}

/// Names and symmetries of the statistics, in order.
pub static STATISTICS: LazyLock<Vec<(String, Symmetry)>> = LazyLock::new(|| {
    let mut list: Vec<(String, Symmetry)> = vec![("ground_level".into(), Symmetry::Scalar)];
    list.push(("ground_slope_x".into(), Symmetry::Vector));
    list.push(("ground_slope_y".into(), Symmetry::Second));
    for ring in RINGS.windows(2) {
        list.push((format!("height_{}_to_{}", ring[0], ring[1]), Symmetry::Scalar));
    }
    list.push(("roughness".into(), Symmetry::Scalar));
    list.push(("roughness_2_over_1_px".into(), Symmetry::Scalar));
    list.push(("roughness_4_over_2_px".into(), Symmetry::Scalar));
    list.push(("stray_height".into(), Symmetry::Scalar));
    list.push(("centroid_x".into(), Symmetry::Vector));
    list.push(("centroid_y".into(), Symmetry::Second));
    list.push(("oval_xx_yy".into(), Symmetry::Tensor));
    list.push(("oval_xy".into(), Symmetry::Second));
    list
});

/// Number of [`STATISTICS`].
pub const COUNT: usize = 3 + RINGS.len() - 1 + LAGS.len() + 5;

/// Mean heights of the rings in diameters, of statistics.
pub fn ring_heights(statistics: &[f64; COUNT]) -> [f64; RINGS.len() - 1] {
    std::array::from_fn(|k| statistics[3 + k].powi(2) - RING_FLOOR)
}

/// Volume under the heights within the outermost ring, of statistics, over that of `count` grains: above one, since what lies
/// beneath a grain counts as filled; less where grains have left the picture.
pub fn volume_in_sight(statistics: &[f64; COUNT], count: usize) -> f64 {
    let heights = ring_heights(statistics);
    // Rings are in L and heights in d, and L^2 d over N pi/6 d^3 is 6 / (pi N^(1/3)).
    let sum: f64 = RINGS.windows(2).zip(heights).map(|(r, h)| (r[1] * r[1] - r[0] * r[0]) * h).sum();
    6.0 * sum / (count as f64).cbrt()
}

/// The statistics of a picture of `count` grains of a mean diameter in m.
pub fn statistics(map: &HeightMap, count: usize, diameter_m: f64) -> [f64; COUNT] {
    let length = diameter_m * (count as f64).cbrt();
    let d = diameter_m;
    let variance = map.noise_m * map.noise_m;
    let clear = (4.0 * map.noise_m).max(0.35 * d);
    let (mut ring, mut pixels) = ([0.0; RINGS.len() - 1], [0usize; RINGS.len() - 1]);
    let (mut mass, mut first) = (0.0, [0.0; 2]);
    let (mut inner, mut second) = (0.0, [0.0; 2]);
    let (mut stray, mut square) = (0.0, 0.0);
    let mut radii = vec![f64::NAN; map.heights_m.len()];
    for (i, (&[x, y], &z)) in map.places_m.iter().zip(&map.heights_m).enumerate() {
        if !z.is_finite() {
            continue;
        }
        let r = (x * x + y * y).sqrt() / length;
        radii[i] = r;
        // Rings begin at zero: the ring is how many of the other edges lie within the radius.
        let k = RINGS[1..].iter().filter(|edge| **edge <= r).count();
        if k < ring.len() {
            ring[k] += z;
            pixels[k] += 1;
        }
        if r < FAR {
            mass += z;
            first[0] += z * x;
            first[1] += z * y;
        }
        if r < SECOND {
            inner += z;
            second[0] += z * (x * x - y * y);
            second[1] += z * 2.0 * x * y;
        }
        if (STRAYS..FAR).contains(&r) && z > clear {
            stray += z;
            square += z * z;
        }
    }
    let mut out = [0.0; COUNT];
    out[0] = map.ground_m / d;
    out[1] = map.slope[0];
    out[2] = map.slope[1];
    for k in 0..ring.len() {
        // A root evens out how much a height varies from pour to pour; a hundredth of a diameter keeps noise inside it.
        out[3 + k] = (ring[k] / pixels[k].max(1) as f64 / d + RING_FLOOR).max(0.0).sqrt();
    }
    let at = 3 + ring.len();
    let [one, two, four] = LAGS.map(|lag| {
        let all = differences(map, &radii, lag) - 2.0 * variance;
        all.max(1e-4 * d * d)
    });
    out[at] = (one / (d * d)).ln();
    out[at + 1] = (two / one).ln();
    out[at + 2] = (four / two).ln();
    // Mean height weighted by height: what is alone on the ground stands as high as a grain. A few pixels of an ordinary grain
    // stand in where there are no strays.
    let usual = 0.6 * d;
    out[at + 3] = ((square + 10.0 * usual * usual) / (stray + 10.0 * usual) / d).ln();
    // Heights of all grains in a pixel's area, summed: N pi/6 d^3 = pi/6 L^3.
    let pixel_m2 = PI * (FAR * length).powi(2) / pixels.iter().sum::<usize>().max(1) as f64;
    let least = LEAST * PI / 6.0 * length.powi(3) / pixel_m2;
    let mass = mass.max(least);
    let inner = inner.max(least) * length * length;
    out[at + 4] = first[0] / mass / length;
    out[at + 5] = first[1] / mass / length;
    out[at + 6] = second[0] / inner;
    out[at + 7] = second[1] / inner;
    out
}

/// Mean square difference between pixels that lie `lag` apart along a row or a column, both within the foot.
fn differences(map: &HeightMap, radii: &[f64], lag: usize) -> f64 {
    let [width, height] = map.size_px;
    let (mut sum, mut n) = (0.0, 0usize);
    let within = |r: f64| r < FOOT;
    let mut add = |i: usize, j: usize| {
        if within(radii[i]) && within(radii[j]) {
            sum += (map.heights_m[i] - map.heights_m[j]).powi(2);
            n += 1;
        }
    };
    for v in 0..height {
        for u in 0..width {
            let i = v * width + u;
            if u + lag < width {
                add(i, i + lag);
            }
            if v + lag < height {
                add(i, i + lag * width);
            }
        }
    }
    sum / n.max(1) as f64
}
