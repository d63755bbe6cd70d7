//! Units by plausibility: what a recording would be if a unit or a sign were a usual mistake.
//!
//! A hint is no error: what is odd may be right.

#[cfg(any(feature = "indentation", feature = "liquid-tilt", feature = "slosh", feature = "trajectory"))]
use missing_physics::data::Run;

/// How far (as a factor) a value may be from what a mistake would make of it.
#[cfg(any(feature = "slosh", feature = "trajectory"))]
const NEAR: f64 = 1.8;

/// The mistake that makes a quantity `ratio` times what it should be, of those that are listed with their factors.
#[cfg(any(feature = "slosh", feature = "trajectory"))]
fn mistake<'m>(ratio: f64, mistakes: &[(f64, &'m str)]) -> Option<&'m str> {
    let distance = |factor: f64| (ratio / factor).ln().abs();
    let nearest = mistakes.iter().min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)))?;
    (distance(nearest.0) < NEAR.ln()).then_some(nearest.1)
}

/// A ratio in few digits.
#[cfg(any(feature = "indentation", feature = "trajectory"))]
fn times(ratio: f64) -> String {
    if (0.01..1e4).contains(&ratio) { format!("{ratio:.3}") } else { format!("{ratio:.1e}") }
}

#[cfg(feature = "trajectory")]
/// A height that falls in another way than `gravity_m_s2` makes it: the unit of height or time, or the sign.
pub(crate) fn fall(runs: &[Run], height: usize, gravity_m_s2: f64) -> Option<String> {
    let mut found: Vec<f64> =
        runs.iter().filter_map(|r| acceleration(&r.inputs[0], &r.outputs[height])).collect();
    found.sort_by(f64::total_cmp);
    let acceleration = *found.get(found.len() / 2)?;
    let ratio = acceleration.abs() / gravity_m_s2;
    let down = if acceleration > 0.0 { "z points up: turn the sign of z_m" } else { "" };
    if !(gravity_m_s2 > 0.0) {
        return None;
    }
    if (0.25..=NEAR).contains(&ratio) {
        let rises = format!("z_m rises ever faster, at {acceleration:.2} m/s^2: {down}");
        return (acceleration > 0.0).then_some(rises);
    }
    let what = mistake(
        ratio,
        &[
            (1e3, "is z_m in millimetres?"),
            (1e2, "is z_m in centimetres?"),
            (1.0 / 0.0254, "is z_m in inches?"),
            (1.0 / 0.3048, "is z_m in feet?"),
            (1e-6, "is t_s in milliseconds?"),
            (1e-3, "are z_m in millimetres and t_s in milliseconds?"),
            (1e-12, "is t_s in microseconds?"),
            (1e-18, "is t_s in nanoseconds?"),
        ],
    )?;
    let also = if down.is_empty() { String::new() } else { format!(" ({down}, too)") };
    let g = times(ratio);
    Some(format!("z_m falls at {:.3e} m/s^2, {g} times gravity: {what}{also}", acceleration.abs()))
}

#[cfg(feature = "trajectory")]
/// The second derivative of a parabola through a run, where it is sure.
fn acceleration(t: &[f64], z: &[f64]) -> Option<f64> {
    let n = t.len() as f64;
    if t.len() < 5 {
        return None;
    }
    // Times between -1 and 1, and Legendre's polynomials made orthogonal over them.
    let (first, span) = (t[0], t[t.len() - 1] - t[0]);
    let u: Vec<f64> = t.iter().map(|t| 2.0 * (t - first) / span - 1.0).collect();
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / n;
    let m = mean(&mut u.iter().copied());
    let p1: Vec<f64> = u.iter().map(|u| u - m).collect();
    let s1 = mean(&mut p1.iter().map(|p| p * p));
    let a = mean(&mut p1.iter().map(|p| p * p * p)) / s1;
    let p2: Vec<f64> = p1.iter().map(|p| p * p - a * p - s1).collect();
    let s2 = mean(&mut p2.iter().map(|p| p * p));
    let dot = |p: &[f64]| p.iter().zip(z).map(|(p, z)| p * z).sum::<f64>() / n;
    let (c0, c1, c2) = (mean(&mut z.iter().copied()), dot(&p1) / s1, dot(&p2) / s2);
    let left = |i: usize| z[i] - c0 - c1 * p1[i] - c2 * p2[i];
    let variance = (0..t.len()).map(|i| left(i).powi(2)).sum::<f64>() / (n - 3.0).max(1.0);
    let sure = c2.abs() > 8.0 * (variance / (n * s2)).sqrt();
    let value = 8.0 * c2 / (span * span);
    (sure && value.is_finite()).then_some(value)
}

#[cfg(feature = "slosh")]
/// A wave that swings at another frequency than its mode: the unit of time.
pub(crate) fn swing(runs: &[Run], expected_rad_s: f64) -> Option<String> {
    let mut found: Vec<f64> = runs.iter().filter_map(|r| frequency(&r.inputs[0], &r.outputs[0])).collect();
    found.sort_by(f64::total_cmp);
    let measured = *found.get(found.len() / 2)?;
    let what = mistake(
        measured / expected_rad_s,
        &[
            (1e-3, "is t_s in milliseconds?"),
            (1e-6, "is t_s in microseconds?"),
            (1e3, "is t_s a thousand times too short?"),
        ],
    )?;
    Some(format!("the wave swings at {measured:.3e} rad/s, the liquid at {expected_rad_s:.3} rad/s: {what}"))
}

#[cfg(feature = "slosh")]
/// The angular frequency of the largest swings: how often the middle is crossed.
fn frequency(t: &[f64], y: &[f64]) -> Option<f64> {
    let middle = y.iter().sum::<f64>() / y.len() as f64;
    let size = y.iter().map(|y| (y - middle).abs()).fold(0.0, f64::max);
    // Crossings count while the wave is large: noise crosses too.
    let (mut side, mut crossings) = (0.0, Vec::new());
    for (t, y) in t.iter().zip(y) {
        let y = y - middle;
        if y.abs() > 0.25 * size {
            if side * y < 0.0 {
                crossings.push(*t);
            }
            side = y.signum();
        }
    }
    let span = crossings.last()? - crossings.first()?;
    (crossings.len() > 3 && span > 0.0).then(|| std::f64::consts::PI * (crossings.len() - 1) as f64 / span)
}

#[cfg(feature = "indentation")]
/// A curve whose force falls with depth, or that goes far deeper than its indenter is wide.
pub(crate) fn press(runs: &[Run], radius_m: Option<f64>) -> Option<String> {
    let rows = || runs.iter().flat_map(|r| r.inputs[0].iter().copied().zip(r.outputs[0].iter().copied()));
    let n = rows().count().max(1) as f64;
    let (md, mf) = (rows().map(|r| r.0).sum::<f64>() / n, rows().map(|r| r.1).sum::<f64>() / n);
    let mut sums = [0.0; 3];
    for (d, f) in rows() {
        let (d, f) = (d - md, f - mf);
        sums.iter_mut().zip([d * d, f * f, d * f]).for_each(|(sum, v)| *sum += v);
    }
    if sums[2] < -0.5 * (sums[0] * sums[1]).sqrt() {
        return Some(
            "force_n falls with depth: compression is positive, turn the sign of force_n (or of delta_m)"
                .into(),
        );
    }
    let deepest = rows().map(|r| r.0).fold(0.0, f64::max);
    let radius = radius_m.filter(|r| deepest > 30.0 * r)?;
    let ratio = times(deepest / radius);
    Some(format!("delta_m reaches {deepest} m, {ratio} radii of the indenter: is delta_m in millimetres?"))
}

#[cfg(feature = "liquid-tilt")]
/// A load that weighs less than its rig, or pulls up: the unit or sign of the force.
pub(crate) fn weigh(runs: &[Run], rig_kg: f64, reach_m: f64, gravity_m_s2: f64) -> Option<String> {
    let mut forces: Vec<f64> = runs.iter().flat_map(|r| r.outputs[1].iter().copied()).collect();
    forces.sort_by(f64::total_cmp);
    let force = *forces.get(forces.len() / 2)?;
    let least = rig_kg * gravity_m_s2;
    if force > 0.1 * least && force > 0.0 {
        return Some(format!(
            "fy_n is {force} N in the middle: weight makes it negative, turn the sign of fy_n"
        ));
    }
    if least > 0.0 && -force > 100.0 * least {
        return Some(format!("fy_n is {force} N for a rig that weighs {least:.2} N: is it in millinewtons?"));
    }
    if least > 0.0 && -force < 0.05 * least {
        return Some(format!(
            "fy_n is {force} N for a rig that weighs {least:.2} N: was the sensor tared with it?"
        ));
    }
    let torque = runs.iter().flat_map(|r| r.outputs[2].iter()).fold(0.0, |m: f64, t| m.max(t.abs()));
    let most = force.abs() * reach_m;
    (torque > 20.0 * most && most > 0.0)
        .then(|| format!("tau_z_nm reaches {torque} N m where the load can make {most:.3}: is it in N mm?"))
}

#[cfg(feature = "bounce")]
/// Times between impacts that no ball makes: the unit of time, or their order.
pub(crate) fn beat(drops: &[Vec<f64>], gravity_m_s2: f64) -> Option<String> {
    let mut first: Vec<f64> = drops.iter().filter_map(|t| Some(t.get(1)? - t.first()?)).collect();
    first.sort_by(f64::total_cmp);
    let flight = *first.get(first.len() / 2)?;
    let height = gravity_m_s2 * flight * flight / 8.0;
    let high =
        |what: &str| format!("between the first impacts {flight} s pass, a bounce of {height:.3e} m: {what}");
    if height > 1e3 {
        return Some(high("is t_s in milliseconds?"));
    }
    if height < 1e-7 {
        return Some(high("is t_s a thousand times too short?"));
    }
    let pairs = || drops.iter().flat_map(|t| t.windows(3).map(|w| (w[1] - w[0], w[2] - w[1])));
    let (grow, all) = (pairs().filter(|(a, b)| b > a).count(), pairs().count());
    (all > 3 && 10 * grow > 9 * all).then(|| "the times between impacts grow: a ball's shrink".into())
}

#[cfg(feature = "dough-roll")]
/// A dough of another size than a kitchen's or a factory's: the unit of length.
pub(crate) fn dough(lengths_m: &[f64]) -> Option<String> {
    let mut sorted = lengths_m.to_vec();
    sorted.sort_by(f64::total_cmp);
    let length = *sorted.get(sorted.len() / 2)?;
    (length > 5.0).then(|| format!("the doughs are {length} m long: are the lengths in millimetres?"))
}

#[cfg(feature = "custom")]
/// Angles beyond some turns are degrees more often than not.
pub(crate) fn angles<'n>(columns: impl Iterator<Item = (&'n str, f64)>) -> Vec<String> {
    let odd = columns.filter(|(name, largest)| name.ends_with("_rad") && (30.0..=720.0).contains(largest));
    odd.map(|(name, largest)| format!("{name} reaches {largest}: is it in degrees?")).collect()
}

#[cfg(all(test, feature = "trajectory", feature = "slosh"))]
mod tests {
    use super::*;

    fn run(t: impl Iterator<Item = f64>, y: impl Fn(f64) -> f64, scale: [f64; 2]) -> Run {
        let t: Vec<f64> = t.collect();
        let y = t.iter().map(|t| scale[1] * y(*t)).collect();
        let t = t.iter().map(|t| scale[0] * t).collect();
        Run { label: "1".into(), inputs: vec![t], outputs: vec![y], kind: 0 }
    }

    #[test]
    fn a_fall_in_other_units_is_seen() {
        let fallen = |scale| {
            let steps = (0..40).map(|i| f64::from(i) / 60.0);
            fall(
                &[run(steps, |t| 2.0 + 0.5 * t - 4.903 * t * t + 1e-3 * (700.0 * t).sin(), scale)],
                0,
                9.80665,
            )
        };
        assert_eq!(fallen([1.0, 1.0]), None);
        for (scale, said) in [
            ([1.0, 1e3], "millimetres?"),
            ([1.0, 1e2], "centimetres"),
            ([1e3, 1.0], "is t_s in milliseconds"),
            ([1e3, 1e3], "and t_s in milliseconds"),
            ([1.0, -1.0], "turn the sign"),
            ([1.0, -1e3], "turn the sign of z_m, too"),
            ([1.0, 1.0 / 0.3048], "feet"),
            ([1.0, 1.0 / 0.0254], "inches"),
        ] {
            let hint = fallen(scale).unwrap_or_default();
            assert!(hint.contains(said), "{scale:?}: {hint}");
        }
    }

    /// What hardly falls (a feather) or is noise alone says nothing.
    #[test]
    fn what_is_not_sure_is_not_said() {
        let noisy = |t: f64| ((1e4 * t).sin() * 1e4).fract();
        let steps = || (0..40).map(|i| f64::from(i) / 60.0);
        assert_eq!(fall(&[run(steps(), noisy, [1.0, 1.0])], 0, 9.80665), None);
        assert_eq!(fall(&[run(steps(), |t| 2.0 - t, [1.0, 1.0])], 0, 9.80665), None);
        assert_eq!(fall(&[], 0, 9.80665), None);
    }

    #[test]
    fn a_wave_in_milliseconds_is_seen() {
        let swung = |scale| {
            let steps = (0..400).map(|i| f64::from(i) / 50.0);
            swing(&[run(steps, |t| (-0.2 * t).exp() * (20.0 * t).cos(), scale)], 20.0)
        };
        assert_eq!(swung([1.0, 1.0]), None);
        assert!(swung([1e3, 1.0]).is_some_and(|hint| hint.contains("milliseconds")));
    }
}
