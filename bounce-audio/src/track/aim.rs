//! Where the paddle should go for a ball that comes through its plane nobody knows where: as likely as can be to touch it, at a price for
//! the energy of getting there.

/// A way through the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    pub(super) t_s: f64,
    pub(super) at_m: [f64; 2],
}

/// What counts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Price {
    /// How far from the paddle's middle a ball is still touched, m.
    pub(super) touch_m: f64,
    /// Probability of touching that a m^2/s of energy may cost.
    pub(super) energy_s_m2: f64,
}

/// Width of the edge within which a touch is in doubt, m.
const EDGE_M: f64 = 0.01;
/// Crossings that are tried as goals.
const TRIED: usize = 48;
/// Parts into which the way to a goal is divided.
const PARTS: usize = 24;
/// Of the crossings that a goal touches, this share comes before the paddle is there.
const EARLY: f64 = 0.1;
/// Least time for a motion, s.
const SOONEST_S: f64 = 0.05;
/// Energy over mass of a motion from rest to rest by a polynomial of fifth degree, in distance^2 / duration.
const QUINTIC: f64 = 5.0 / 7.0;

fn away(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Probability of touching from a place (m), over the crossings.
fn touched(crossings: &[Crossing], place_m: [f64; 2], touch_m: f64) -> f64 {
    let one = |c: &Crossing| ((touch_m - away(c.at_m, place_m)) / EDGE_M + 0.5).clamp(0.0, 1.0);
    crossings.iter().map(one).sum::<f64>() / crossings.len().max(1) as f64
}

/// The goal (y and z, m), and when (s) it is to be reached by a paddle at a place (m) now (s); `None` without crossings.
pub(super) fn aim(
    crossings: &[Crossing],
    paddle_m: [f64; 2],
    now_s: f64,
    price: &Price,
    times: &mut Vec<f64>,
) -> Option<([f64; 2], f64)> {
    if crossings.is_empty() {
        return None;
    }
    times.clear();
    times.extend(crossings.iter().map(|c| c.t_s));
    let typical = crate::quantile::quantile(times, 0.5)?;
    let duration = (typical - now_s).max(SOONEST_S);
    let worth = |place: [f64; 2]| {
        let energy = QUINTIC * away(place, paddle_m).powi(2) / duration;
        touched(crossings, place, price.touch_m) - price.energy_s_m2 * energy
    };
    let mut best = (worth(paddle_m), paddle_m);
    let take = |place: [f64; 2], best: &mut (f64, [f64; 2])| {
        let worth = worth(place);
        if worth > best.0 {
            *best = (worth, place);
        }
    };
    for crossing in crossings.iter().step_by(crossings.len().div_ceil(TRIED)) {
        take(crossing.at_m, &mut best);
    }
    // The middle of what the best one touches, and no farther than pays.
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for c in crossings.iter().filter(|c| away(c.at_m, best.1) <= price.touch_m) {
        (sum, count) = ([sum[0] + c.at_m[0], sum[1] + c.at_m[1]], count + 1.0);
    }
    if count > 0.0 {
        take(sum.map(|s| s / count), &mut best);
    }
    let far = best.1;
    for part in 1..PARTS {
        let share = part as f64 / PARTS as f64;
        take(std::array::from_fn(|k| paddle_m[k] + share * (far[k] - paddle_m[k])), &mut best);
    }
    times.clear();
    times.extend(crossings.iter().filter(|c| away(c.at_m, best.1) <= price.touch_m).map(|c| c.t_s));
    Some((best.1, crate::quantile::quantile(times, EARLY).unwrap_or(typical)))
}
