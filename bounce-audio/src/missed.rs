//! Impacts that were not heard: two flights that were taken for one.

use crate::quantile::quantile;

/// Most impacts in a row that may have gone unheard.
const MOST: usize = 3;
/// Below this restitution a flight that was cut short adds too little to the one before it to stand out of chance.
const LEAST_RESTITUTION: f64 = 0.25;
/// An unheard impact has to explain this much of the logarithm of a duration.
const DOUBT: f64 = 0.15;

/// The restitution of a ball from how its flights shorten: the median ratio of neighbouring ones over all drops.
///
/// `drops` holds, drop by drop, the durations of its flights in s. `None` where no drop has two flights.
pub fn typical_restitution<'a>(drops: impl IntoIterator<Item = &'a [f64]>) -> Option<f64> {
    let mut ratios: Vec<f64> = drops.into_iter().flat_map(|d| d.windows(2).map(|w| w[1] / w[0])).collect();
    quantile(&mut ratios, 0.5)
}

/// How many impacts went unheard within each of the flights (durations in s), for a ball of the given restitution in (0, 1).
///
/// A flight that hides `m` impacts lasts `1 + e + ... + e^m` times its first part. The first flight is judged by the second,
/// or by `expected_first`, its duration in s where the drop is known.
pub fn unheard(durations_s: &[f64], restitution: f64, expected_first: Option<f64>) -> Vec<usize> {
    let e = restitution;
    let n = durations_s.len();
    if !(LEAST_RESTITUTION..1.0).contains(&e) {
        return vec![0; n];
    }
    let doubt = |m: usize| if m > 0 { DOUBT } else { 0.0 };
    let off =
        |duration: f64, expected: f64, m: usize| (parts(duration, m, e).0 / expected).ln().abs() + doubt(m);
    let nearest = |duration: f64, expected: f64| {
        (0..=MOST).map(|m| (off(duration, expected, m), m)).fold((f64::INFINITY, 0), nearer)
    };
    let mut found = Vec::with_capacity(n);
    let mut before: Option<f64> = expected_first.map(|t| t / e);
    for (i, &duration) in durations_s.iter().enumerate() {
        let m = match (before, durations_s.get(i + 1)) {
            (Some(before), _) => nearest(duration, e * before).1,
            (None, Some(&next)) => {
                let choices =
                    (0..=MOST).map(|m| (nearest(next, e * parts(duration, m, e).1).0 + doubt(m), m));
                choices.fold((f64::INFINITY, 0), nearer).1
            }
            (None, None) => 0,
        };
        before = Some(parts(duration, m, e).1);
        found.push(m);
    }
    found
}

fn nearer(best: (f64, usize), next: (f64, usize)) -> (f64, usize) {
    if next.0 < best.0 { next } else { best }
}

/// The durations of the first and the last part of a flight that hides `unheard` impacts of the given restitution.
pub fn parts(duration_s: f64, unheard: usize, restitution: f64) -> (f64, f64) {
    let whole: f64 = (0..=unheard).map(|k| restitution.powi(k as i32)).sum();
    let first = duration_s / whole;
    (first, first * restitution.powi(unheard as i32))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    fn flights(e: f64, n: usize) -> Vec<f64> {
        (0..n).map(|k| 0.5 * e.powi(k as i32)).collect()
    }

    #[test]
    fn what_was_merged_is_found_wherever_it_is() {
        for e in [0.5, 0.7, 0.85, 0.95] {
            for at in 0..4 {
                for m in 0..=MOST {
                    let all = flights(e, 8);
                    let mut heard = all[..at].to_vec();
                    heard.push(all[at..=at + m].iter().sum());
                    heard.extend(&all[at + m + 1..]);
                    let mut expected = vec![0; heard.len()];
                    expected[at] = m;
                    assert_eq!(unheard(&heard, e, None), expected, "e {e}, flight {at}, {m} unheard");
                    assert_eq!(unheard(&heard, e, Some(0.5)), expected);
                    let (first, last) = parts(heard[at], m, e);
                    approx::assert_relative_eq!(first, all[at], max_relative = 1e-12);
                    approx::assert_relative_eq!(last, all[at + m], max_relative = 1e-12);
                }
            }
        }
    }

    #[test]
    fn a_restitution_that_changes_hides_nothing() {
        let mut t = vec![0.5];
        for k in 0..10 {
            let e = 0.75 + 0.02 * f64::from(k);
            t.push(t[t.len() - 1] * e);
        }
        let e = typical_restitution([t.as_slice()]).unwrap();
        assert_eq!(unheard(&t, e, None), vec![0; 11]);
        assert_eq!(typical_restitution([[0.4].as_slice()]), None);
    }
}
