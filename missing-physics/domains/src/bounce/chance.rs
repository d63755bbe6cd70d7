//! What chance alone does to a drop, by simulation.
//!
//! A speed depends on the squares of small angles, and where places are heard badly the angles' errors are as large as the
//! angles: errors of speeds then are far from normal, however well they are whitened. Tests are therefore calibrated by drops like
//! the measured ones, in which nothing is hidden, that go through the same whitening.

use bounce_audio::impact::{Velocity, reflected, speed, speed_after_drop};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::drop::Drop;
use super::effects::Effects;
use super::spread::ROUNDS;
use super::weights::{Linear, Spread, Weights};

/// Errors of simulated drops like a measured one, whitened as its own are: by the `judged` spread, where the true one is another
/// that is plausible too. Few or none where such drops make no sense.
pub(super) fn null_errors(
    likely: &Linear,
    effects: &Effects,
    [truth, judged]: [&Spread; 2],
    count: usize,
    rng: &mut impl Rng,
) -> Vec<Vec<f64>> {
    let level = Effects { unheard: 1.0, ..*effects };
    (0..count)
        .filter_map(|_| {
            let drop = simulated(&likely.drop, &level, truth, rng)?;
            let mut linear = Linear::about_straight(&drop, &level);
            for _ in 0..ROUNDS {
                linear = linear.likely(&level, judged)?;
            }
            let white = Weights::new(linear, *judged)?.errors(&level, &[])?;
            white.iter().all(|v| v.is_finite()).then(|| white.as_slice().to_vec())
        })
        .collect()
}

fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// A drop like another, on a level table without air, as it would be heard.
fn simulated(like: &Drop, effects: &Effects, spread: &Spread, rng: &mut impl Rng) -> Option<Drop> {
    let mut drop = like.clone();
    let gravity = effects.gravity_m_s2;
    let hidden = |place: usize| like.unheard.get(place).copied().unwrap_or(0);
    let usually = like.comes(effects);
    let off = [0, 1].map(|_| spread.approach_rad * normal(rng));
    let mut velocity: Velocity = match like.height_m {
        Some(height) => {
            let falls = speed_after_drop(height, gravity, 0.0) * effects.restitution.powi(hidden(0) as i32);
            let came = [0, 1].map(|k| falls * (usually[k] + off[k]));
            rebound(&[came[0], came[1], -falls], effects, spread, rng)?
        }
        None => {
            let leaves = like.leaves_m_s(effects);
            let [x, y] = [0, 1].map(|k| usually[k] + off[k]);
            [leaves * x, leaves * y, leaves * (1.0 - x * x - y * y).max(0.0).sqrt()]
        }
    };
    let mut place = like.places_m.first().copied()?;
    let mut time = like.times_s.first().copied()?;
    for impact in 0..like.times_s.len() {
        let relative = like.relative(impact);
        drop.times_s[impact] = time + spread.time_s * relative.time * normal(rng);
        let [a, b] = [0, 1].map(|_| normal(rng));
        drop.places_m[impact] = [0, 1]
            .map(|k| place[k] + spread.place_m[k] * (relative.place[k][0] * a + relative.place[k][1] * b));
        for flight in 0..=hidden(impact + 1) {
            if impact + flight > 0 {
                let falling = [velocity[0], velocity[1], -velocity[2]];
                velocity = rebound(&falling, effects, spread, rng)?;
            }
            let duration = 2.0 * velocity[2] / gravity;
            time += duration;
            place = [0, 1].map(|k| place[k] + velocity[k] * duration);
        }
    }
    drop.times_s.windows(2).all(|w| w[1] > w[0]).then_some(drop)
}

/// The velocity after an impact, its direction scattered; `None` where the ball does not leave the table.
fn rebound(before: &Velocity, effects: &Effects, spread: &Spread, rng: &mut impl Rng) -> Option<Velocity> {
    let mirrored = reflected(before, [0.0; 2], 0.0);
    let size = speed(&mirrored);
    let [x, y, z] = mirrored.map(|v| v / size);
    // Two directions across the mean one.
    let first = [z, 0.0, -x].map(|v| v / z.hypot(x));
    let second = [y * first[2] - z * first[1], z * first[0] - x * first[2], x * first[1] - y * first[0]];
    let [a, b] = [0, 1].map(|_| normal(rng) / spread.kappa.sqrt());
    let turned: Velocity = std::array::from_fn(|i| [x, y, z][i] + a * first[i] + b * second[i]);
    let scale = size * effects.restitution * (spread.restitution * normal(rng)).exp() / speed(&turned);
    let after = turned.map(|v| scale * v);
    (after[2] > 0.0).then_some(after)
}

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    pub(in super::super) const EFFECTS: Effects = Effects { unheard: 1.0, ..Effects::none(9.81, 0.8) };

    /// A ball that drifts a little along x on its six impacts.
    pub(in super::super) fn drop() -> Drop {
        let flights: Vec<f64> = (0..5).map(|k| 0.45 * 0.8f64.powi(k)).collect();
        let sums = |f: fn(&f64) -> f64| {
            let rest = flights.iter().scan(0.0, move |sum, t| {
                *sum += f(t);
                Some(*sum)
            });
            std::iter::once(0.0).chain(rest).collect::<Vec<f64>>()
        };
        Drop {
            times_s: sums(|t| *t),
            places_m: sums(|t| 0.2 * t * t).into_iter().map(|x| [x, 0.0]).collect(),
            height_m: Some(0.5 * 9.81 * (0.225f64 / 0.8).powi(2)),
            unheard: vec![0; 6],
            known: vec![0; 6],
            ..Drop::default()
        }
    }

    /// Where angles are heard well, whitened errors are white and of the size that they should have.
    #[test]
    fn chance_is_white_where_angles_are_small() {
        let spread = Spread::heard(1e-3);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let drop = drop();
        let likely = Linear::about_straight(&drop, &EFFECTS).likely(&EFFECTS, &spread).unwrap();
        let copies = null_errors(&likely, &EFFECTS, [&spread; 2], 400, &mut rng);
        assert!(copies.len() > 390);
        let n = copies.len() as f64;
        for channel in 0..3 {
            let sigma = spread.of_channels()[channel];
            for impact in 0..drop.impacts() {
                let row = drop.row(impact, channel);
                let square = copies.iter().map(|c| (c[row] / sigma).powi(2)).sum::<f64>() / n;
                // Five standard errors of a variance from 400.
                assert!((square - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{channel} {impact}: {square}");
            }
        }
    }

    /// Late flights shorter than the errors of heard places: a straight drop is found all the same, and headings stay small.
    #[test]
    fn wild_headings_do_not_lead_astray() {
        let mut wild = drop();
        for (i, place) in wild.places_m.iter_mut().enumerate() {
            place[1] += if i % 2 == 0 { 0.05 } else { -0.05 };
        }
        let spread = Spread::heard(0.05);
        let mut linear = Linear::about_straight(&wild, &EFFECTS);
        for _ in 0..ROUNDS {
            linear = linear.likely(&EFFECTS, &spread).unwrap();
        }
        let steepest = linear.drop.headings(&EFFECTS).iter().map(|h| h[0].hypot(h[1])).fold(0.0, f64::max);
        assert!(steepest < 0.15, "{steepest}");
    }
}
