//! The 16 statistics against definitions, scipy and formations whose statistics are known.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use approx::assert_relative_eq;
use granular_infer::seeing::HeightMap;
use granular_infer::summary::{
    Bound, Mask, NAMES, SummaryError, distance_correlation, fit_chi, points, summary,
};
use proptest::prelude::*;

/// The definition: double centred distances, all pairs.
fn slow_distance_correlation(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len();
    let centred = |v: &[f64]| -> Vec<f64> {
        let d = |i: usize, j: usize| (v[i] - v[j]).abs();
        let rows: Vec<f64> = (0..n).map(|i| (0..n).map(|j| d(i, j)).sum::<f64>() / n as f64).collect();
        let all = rows.iter().sum::<f64>() / n as f64;
        (0..n * n).map(|k| d(k / n, k % n) - rows[k / n] - rows[k % n] + all).collect()
    };
    let (a, b) = (centred(x), centred(y));
    let mean = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / (n * n) as f64;
    let variances = mean(&a, &a) * mean(&b, &b);
    if variances > 0.0 { (mean(&a, &b).max(0.0) / variances.sqrt()).sqrt() } else { 0.0 }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// Ties (whole numbers) and far offsets included.
    #[test]
    fn distance_correlation_is_its_definition(
        pairs in prop::collection::vec((-5_i32..5, -5_i32..5, -1.0..1.0_f64, -1.0..1.0_f64), 2..60),
        fine in prop::bool::ANY,
        offset in -100.0..100.0_f64,
    ) {
        let share = f64::from(u8::from(fine));
        let x: Vec<f64> = pairs.iter().map(|p| offset + f64::from(p.0) + share * p.2).collect();
        let y: Vec<f64> = pairs.iter().map(|p| f64::from(p.1) * f64::from(p.0) + share * p.3).collect();
        let (fast, slow) = (distance_correlation(&x, &y), slow_distance_correlation(&x, &y));
        // Of the squares; a root makes rounding near 0 look large.
        prop_assert!((fast * fast - slow * slow).abs() < 1e-9, "{fast} and {slow}");
    }
}

#[test]
fn distance_correlation_of_known_relations() {
    let x: Vec<f64> = (0..500).map(|i| (0.37 * f64::from(i)).sin()).collect();
    let line: Vec<f64> = x.iter().map(|x| 3.0 - 2.0 * x).collect();
    assert_relative_eq!(distance_correlation(&x, &line), 1.0, epsilon = 1e-9);
    assert_eq!(distance_correlation(&x, &vec![2.0; 500]), 0.0);
    // A parabola has no correlation of the ordinary kind.
    let parabola: Vec<f64> = x.iter().map(|x| x * x).collect();
    assert!(distance_correlation(&x, &parabola) > 0.4);
}

/// scipy 1.17: q = stats.chi(3, loc=0.01, scale=0.02).ppf((arange(400) + 0.5)/400); stats.chi.fit(q, 3, loc=0.01, scale=0.02).
#[test]
fn the_chi_fit_is_scipys() {
    use statrs::distribution::{ContinuousCDF, Gamma};
    let half_square = Gamma::new(1.5, 1.0).unwrap();
    let values: Vec<f64> = (0..400)
        .map(|i| {
            let p = (f64::from(i) + 0.5) / 400.0;
            0.01 + 0.02 * (2.0 * half_square.inverse_cdf(p)).sqrt()
        })
        .collect();
    let fit = fit_chi(&values).unwrap();
    assert_eq!(fit.bound, None);
    let scipy = [2.880671, 0.0106484551, 0.0200523404, 2.917341952718];
    assert_relative_eq!(fit.ln_density, scipy[3], epsilon = 1e-9);
    // scipy's own answers from three starts differ by 1e-5 in df.
    assert_relative_eq!(fit.degrees, scipy[0], max_relative = 1e-4);
    assert_relative_eq!(fit.shift, scipy[1], max_relative = 1e-4);
    assert_relative_eq!(fit.scale, scipy[2], max_relative = 1e-4);
}

/// What the likelihood wants beyond the bounds is said.
#[test]
fn a_fit_at_its_bounds_says_so() {
    // Half of an exponential: more at the shift than any chi with a whole degree of freedom has.
    let steep: Vec<f64> = (0..300).map(|i| -(1.0 - (f64::from(i) + 0.5) / 300.0).ln()).collect();
    let fit = fit_chi(&steep).unwrap();
    assert_eq!((fit.bound, fit.degrees), (Some(Bound::FewestDegrees), 1.0));
    // Skewed to the left: no shift is low enough, no number of degrees high enough.
    let left: Vec<f64> = (0..300).map(|i| ((f64::from(i) + 0.5) / 300.0).powf(0.2)).collect();
    assert!(matches!(fit_chi(&left).unwrap().bound, Some(Bound::MostDegrees | Bound::LeastShift)));
}

/// A cone of height H and radius R on a fine grid: z falls with r, and r has density 2 r/R^2.
#[test]
fn a_cone_has_its_closed_forms() {
    let (height, radius, steps) = (0.02, 0.05, 200);
    let mut cone = Vec::new();
    for i in -steps..=steps {
        for j in -steps..=steps {
            let (x, y) = (radius * f64::from(i) / f64::from(steps), radius * f64::from(j) / f64::from(steps));
            let r = x.hypot(y);
            if r < radius {
                // Off the axis, so that the centroid has to be found.
                cone.push([0.3 + x, y - 0.1, height * (1.0 - r / radius)]);
            }
        }
    }
    let s = summary(&cone).unwrap().values;
    let at = |name: &str| s[NAMES.iter().position(|n| *n == name).unwrap()];
    assert_relative_eq!(at("max_z_m"), height, max_relative = 1e-9);
    assert_relative_eq!(at("mean_z_m"), height / 3.0, max_relative = 2e-3);
    assert_relative_eq!(at("sd_z_m"), height / 18.0_f64.sqrt(), max_relative = 2e-3);
    assert_relative_eq!(at("mean_r_m"), 2.0 / 3.0 * radius, max_relative = 2e-3);
    assert_relative_eq!(at("sd_x_m"), 0.5 * radius, max_relative = 2e-3);
    assert_relative_eq!(at("sd_r_m"), radius / 18.0_f64.sqrt(), max_relative = 2e-3);
    let quartiles = radius * (0.75_f64.sqrt() - 0.5);
    assert_relative_eq!(at("iqr_r_m"), quartiles, max_relative = 3e-3);
    // Of the density 2 r: fourth central moment 1/135, variance 1/18.
    assert_relative_eq!(at("kurtosis_r"), 324.0 / 135.0 - 3.0, epsilon = 5e-3);
    assert_relative_eq!(at("dcor_r_z"), 1.0, epsilon = 1e-9);
}

/// scipy 1.17, r = repeat(.., 2): stats.kurtosis(r), stats.iqr(r), r.std().
#[test]
fn moments_are_scipys() {
    let r: Vec<f64> = (0..200)
        .map(|i| {
            let i = f64::from(i);
            0.05 * (1.0 - 0.98 * (0.7 * i).cos().powi(2)).sqrt() + 0.01 * (2.1 * i).sin().powi(2)
        })
        .collect();
    // Pairs of opposite points have their centroid at the origin and these radii.
    let pairs: Vec<[f64; 3]> = r
        .iter()
        .enumerate()
        .flat_map(|(i, &r)| {
            let (s, c) = (i as f64).sin_cos();
            [[r * c, r * s, r], [-r * c, -r * s, r]]
        })
        .collect();
    let s = summary(&pairs).unwrap().values;
    let [kurtosis, iqr, sd] = [-0.572143622408, 0.0194420326049, 0.0149085198265];
    assert_relative_eq!(s[11], kurtosis, epsilon = 1e-9);
    assert_relative_eq!(s[10], iqr, epsilon = 1e-12);
    assert_relative_eq!(s[7], sd, epsilon = 1e-12);
}

fn map(heights_m: Vec<f64>, size_px: [usize; 2]) -> HeightMap {
    let places_m = (0..heights_m.len())
        .map(|i| [1e-3 * (i % size_px[0]) as f64, 1e-3 * (i / size_px[0]) as f64])
        .collect();
    HeightMap { size_px, places_m, heights_m, ground_m: 0.0, slope: [0.0; 2], noise_m: 1e-4, missing: 0.0 }
}

#[test]
fn blocks_are_means_and_masks_choose() {
    let mut heights = vec![0.0; 64];
    // One block of four pixels stands 2 mm high, one of its pixels is missing; another has three missing.
    for i in [18, 19, 26] {
        heights[i] = 2e-3;
    }
    heights[27] = f64::NAN;
    (heights[0], heights[1], heights[8], heights[9]) = (f64::NAN, f64::NAN, f64::NAN, 5e-3);
    let map = map(heights, [8, 8]);
    let seen = points(&map, 2, Mask::Higher(1e-3)).unwrap();
    assert_eq!(seen.len(), 1);
    assert_relative_eq!(seen[0][0], (2e-3 + 3e-3 + 2e-3) / 3.0, epsilon = 1e-15);
    assert_relative_eq!(seen[0][2], 2e-3, epsilon = 1e-15);
    let marked: Vec<bool> = (0..64).map(|i| i >= 32).collect();
    assert_eq!(points(&map, 2, Mask::Marked(&marked)).unwrap().len(), 8);
    assert_eq!(
        points(&map, 2, Mask::Marked(&marked[1..])),
        Err(SummaryError::Mask { received: 63, expected: 64 })
    );
    assert_eq!(points(&map, 0, Mask::Higher(1e-3)), Err(SummaryError::Block { received: 0, most: 8 }));
    assert_eq!(points(&map, 9, Mask::Higher(1e-3)), Err(SummaryError::Block { received: 9, most: 8 }));
}

#[test]
fn points_without_statistics_are_refused() {
    let circle: Vec<[f64; 3]> = (0..40)
        .map(|i| {
            let a = f64::from(i) * std::f64::consts::TAU / 40.0;
            [a.cos(), a.sin(), 1.0]
        })
        .collect();
    assert!(matches!(summary(&circle), Err(SummaryError::NoSpread { .. })), "{:?}", summary(&circle));
    assert_eq!(summary(&circle[..5]).unwrap_err(), SummaryError::TooFew { received: 5, least: 20 });
    assert_eq!(summary(&[]).unwrap_err(), SummaryError::TooFew { received: 0, least: 20 });
    assert!(matches!(summary(&vec![[0.1, 0.2, 0.3]; 30]), Err(SummaryError::NoSpread { .. })));
    let mut bad = circle;
    bad[7][2] = f64::NAN;
    assert_eq!(summary(&bad).unwrap_err(), SummaryError::NotFinite { point: 7 });
}
