//! Random places in a funnel, without overlap.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, LogNormal, Uniform};

use super::{
    cells::Cells,
    error::DemError,
    funnel::Funnel,
    vector::{V3, dot, sub},
};

/// Share of the funnel's volume that the grains are to take up at first.
const SHARE: f64 = 0.3;
/// Tries of a grain before the fill is made higher.
const TRIES: usize = 200;
/// Times that the fill is made higher, each by a tenth, before giving up.
const RISES: usize = 60;

/// Radii in m with a mean diameter and its coefficient of variation: a log-normal, cut at 0.4 and 2.5 means.
pub(crate) fn radii(count: usize, mean_m: f64, variation: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
    match LogNormal::from_mean_cv(1.0, variation) {
        Ok(law) if variation > 0.0 => {
            let one = |_| {
                let tries = law.sample_iter(&mut *rng).take(100);
                mean_m * tries.into_iter().find(|x| (0.4..=2.5).contains(x)).unwrap_or(1.0)
            };
            (0..count).map(one).collect()
        }
        _ => vec![mean_m; count],
    }
}

/// Radius of the funnel at a height above its outlet, both in m.
fn funnel_radius(funnel: &Funnel, height: f64) -> f64 {
    (funnel.outlet_radius_m + height * funnel.cone_half_angle_rad.tan()).min(funnel.tube_radius_m)
}

/// Places spheres one after another at random in the funnel, above its outlet.
pub(crate) fn fill(funnel: &Funnel, radii: &[f64], rng: &mut ChaCha8Rng) -> Result<Vec<V3>, DemError> {
    let n = radii.len();
    let largest = radii.iter().fold(0.0, |a: f64, &r| a.max(r));
    let clearance = 1e-3 * largest;
    // How far the cone keeps a centre from the axis: r <= radius(z) - R / cos(angle).
    let (sine, cosine) = funnel.cone_half_angle_rad.sin_cos();
    let room = |height: f64, radius: f64| {
        let r = radius + clearance;
        let cone = funnel.outlet_radius_m + height * sine / cosine - r / cosine;
        cone.min(funnel.tube_radius_m - r)
    };
    let mut top = height_of(funnel, radii);
    let cells = Cells::new(n, 2.0 * largest);
    let mut head = vec![u32::MAX; cells.count()];
    let mut next = vec![u32::MAX; n];
    let mut places: Vec<V3> = Vec::with_capacity(n);
    let unit = Uniform::new(0.0, 1.0).map_err(|_| DemError::Fill { placed: 0, expected: n })?;
    let (mut tries, mut rises) = (0, 0);
    while places.len() < n {
        let radius = radii[places.len()];
        let low = radius + clearance;
        let height = low + unit.sample(rng) * (top - low).max(0.0);
        let widest = funnel_radius(funnel, top);
        let x = widest * (2.0 * unit.sample(rng) - 1.0);
        let y = widest * (2.0 * unit.sample(rng) - 1.0);
        let p = [x, y, height];
        let at = p.map(|c| cells.along(c));
        let free = |_: ()| {
            for shift in 0..27_i64 {
                let cell = [at[0] + shift % 3 - 1, at[1] + shift / 3 % 3 - 1, at[2] + shift / 9 - 1];
                let mut k = head[cells.index(cell)];
                while k != u32::MAX {
                    let d = sub(p, places[k as usize]);
                    let apart = radius + radii[k as usize] + clearance;
                    if dot(d, d) < apart * apart {
                        return false;
                    }
                    k = next[k as usize];
                }
            }
            true
        };
        let most = room(height, radius);
        if most >= 0.0 && x * x + y * y <= most * most && free(()) {
            let cell = cells.index(at);
            next[places.len()] = head[cell];
            head[cell] = places.len() as u32;
            places.push(p);
            tries = 0;
            continue;
        }
        tries += 1;
        if tries == TRIES {
            (tries, rises) = (0, rises + 1);
            top = 1.1 * top + largest;
            if rises > RISES {
                return Err(DemError::Fill { placed: places.len(), expected: n });
            }
        }
    }
    let base = [funnel.axis_m[0], funnel.axis_m[1], funnel.outlet_height_m];
    Ok(places.iter().map(|p| [p[0] + base[0], p[1] + base[1], p[2] + base[2]]).collect())
}

/// Height of the fill above the outlet at which the grains take up their share.
fn height_of(funnel: &Funnel, radii: &[f64]) -> f64 {
    let pi = std::f64::consts::PI;
    let wanted: f64 = radii.iter().map(|r| 4.0 / 3.0 * pi * r.powi(3)).sum::<f64>() / SHARE;
    let cone = funnel.tube_height_m() - funnel.outlet_height_m;
    let (a, b) = (funnel.outlet_radius_m, funnel.tube_radius_m);
    let volume = pi / 3.0 * cone * (a * a + a * b + b * b);
    if wanted > volume {
        return cone + (wanted - volume) / (pi * b * b);
    }
    // Within the cone: V = pi/(3 tan) ((a + h tan)^3 - a^3).
    let tan = funnel.cone_half_angle_rad.tan();
    ((a.powi(3) + 3.0 * tan * wanted / pi).cbrt() - a) / tan
}
