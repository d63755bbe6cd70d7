//! The rectangle of least area around points of the plane.

/// A rectangle of least area around some points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// The longer side, m.
    pub length_m: f64,
    /// The shorter side, m.
    pub width_m: f64,
    /// The longer side's direction, from the x axis, in (-pi/2, pi/2] rad.
    pub yaw_rad: f64,
    /// The middle, m.
    pub centre_m: [f64; 2],
}

fn cross(o: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
}

/// Convex hull, counter-clockwise and without points on its edges (Andrew 1979, doi:10.1016/0020-0190(79)90072-3).
///
/// The points are sorted in place.
pub fn hull(points: &mut [[f64; 2]]) -> Vec<[f64; 2]> {
    points.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut chain: Vec<[f64; 2]> = Vec::new();
    let mut go = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let first = chain.len();
        for &p in points {
            while chain.len() >= first + 2 && cross(chain[chain.len() - 2], chain[chain.len() - 1], p) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        // The last one is where the other half begins.
        chain.pop();
    };
    go(&mut points.iter());
    go(&mut points.iter().rev());
    chain
}

/// The rectangle of least area around a convex hull: one of its sides lies on an edge (Freeman and Shapira 1975,
/// doi:10.1145/360881.360919), found by rotating calipers (Toussaint 1983). None for fewer than three corners.
pub fn around(hull: &[[f64; 2]]) -> Option<Rectangle> {
    let n = hull.len();
    if n < 3 {
        return None;
    }
    let along = |d: [f64; 2], k: usize| d[0] * hull[k % n][0] + d[1] * hull[k % n][1];
    // Walks on while the next corner lies further along a direction.
    let advance = |from: &mut usize, d: [f64; 2]| {
        for _ in 0..n {
            if along(d, *from + 1) < along(d, *from) {
                break;
            }
            *from += 1;
        }
    };
    let mut best: Option<(f64, Rectangle)> = None;
    let (mut right, mut top, mut left) = (0, 0, 0);
    for k in 0..n {
        let (a, b) = (hull[k], hull[(k + 1) % n]);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let size = dx.hypot(dy);
        if !(size > 0.0) {
            continue;
        }
        let e = [dx / size, dy / size];
        let normal = [-e[1], e[0]];
        right = right.max(k + 1);
        advance(&mut right, e);
        top = top.max(right);
        advance(&mut top, normal);
        left = left.max(top);
        advance(&mut left, [-e[0], -e[1]]);
        let (low, high) = (along(e, left), along(e, right));
        let (ground, roof) = (along(normal, k), along(normal, top));
        let (side, rise) = (high - low, roof - ground);
        if best.as_ref().is_none_or(|(area, _)| side * rise < *area) {
            let (m, v) = (0.5 * (low + high), 0.5 * (ground + roof));
            let centre_m = [m * e[0] + v * normal[0], m * e[1] + v * normal[1]];
            let d = if side >= rise { e } else { normal };
            // A direction and its opposite are the same side.
            let d = if d[0] < 0.0 || (d[0] == 0.0 && d[1] < 0.0) { [-d[0], -d[1]] } else { d };
            let yaw_rad = d[1].atan2(d[0]);
            let yaw_rad = if yaw_rad <= -std::f64::consts::FRAC_PI_2 { -yaw_rad } else { yaw_rad };
            let found = Rectangle { length_m: side.max(rise), width_m: side.min(rise), yaw_rad, centre_m };
            best = Some((side * rise, found));
        }
    }
    best.map(|(_, rectangle)| rectangle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The slow reference: every edge, all points.
    fn reference(hull: &[[f64; 2]]) -> f64 {
        let mut least = f64::INFINITY;
        for k in 0..hull.len() {
            let (a, b) = (hull[k], hull[(k + 1) % hull.len()]);
            let angle = (b[1] - a[1]).atan2(b[0] - a[0]);
            let (s, c) = angle.sin_cos();
            let extent = |f: &dyn Fn(&[f64; 2]) -> f64| {
                let v: Vec<f64> = hull.iter().map(f).collect();
                v.iter().fold(f64::MIN, |m, x| m.max(*x)) - v.iter().fold(f64::MAX, |m, x| m.min(*x))
            };
            least = least.min(extent(&|p| c * p[0] + s * p[1]) * extent(&|p| c * p[1] - s * p[0]));
        }
        least
    }

    #[test]
    fn a_turned_rectangle_is_found() {
        for yaw in [0.0, 0.3, 1.2, -0.7, std::f64::consts::FRAC_PI_2] {
            let (s, c) = f64::sin_cos(yaw);
            let mut points: Vec<[f64; 2]> = Vec::new();
            for i in 0..=20 {
                for j in 0..=8 {
                    let (x, y) = (0.1 * f64::from(i) / 20.0 - 0.05, 0.03 * f64::from(j) / 8.0 - 0.015);
                    points.push([0.2 + c * x - s * y, -0.1 + s * x + c * y]);
                }
            }
            let found = around(&hull(&mut points)).unwrap();
            approx::assert_relative_eq!(found.length_m, 0.1, max_relative = 1e-9);
            approx::assert_relative_eq!(found.width_m, 0.03, max_relative = 1e-9);
            approx::assert_abs_diff_eq!((found.yaw_rad - yaw).sin(), 0.0, epsilon = 1e-9);
            approx::assert_abs_diff_eq!(found.centre_m[0], 0.2, epsilon = 1e-9);
        }
    }

    #[test]
    fn points_on_a_line_have_no_rectangle() {
        let mut line: Vec<[f64; 2]> = (0..9).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        assert_eq!(around(&hull(&mut line)), None);
        assert_eq!(around(&hull(&mut [[1.0, 2.0]; 5])), None);
        assert_eq!(around(&hull(&mut [])), None);
    }

    proptest! {
        #[test]
        fn calipers_find_what_trying_every_edge_finds(points in prop::collection::vec([-1.0..1.0_f64, -1.0..1.0_f64], 3..60)) {
            let mut points = points;
            let corners = hull(&mut points);
            // All points lie left of every edge.
            for k in 0..corners.len() {
                let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
                prop_assert!(points.iter().all(|p| cross(a, b, *p) >= -1e-12));
            }
            if let Some(found) = around(&corners) {
                let least = reference(&corners);
                prop_assert!((found.length_m * found.width_m - least).abs() <= 1e-9 * least.max(1e-3));
            }
        }
    }
}
