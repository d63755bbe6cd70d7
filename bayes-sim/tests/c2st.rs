//! The classifier two-sample test against scikit-learn's, whose numbers data/c2st_sklearn.py made.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

mod common;

use bayes_sim::c2st::c2st;
use bayes_sim::error::Error;
use bayes_sim::points::Points;

/// The changes of data/c2st_sklearn.py.
fn changed(points: &Points, change: &str) -> Points {
    let (n, d) = (points.len(), points.dim());
    let columns: Vec<Vec<f64>> = (0..d).map(|j| points.column(j)).collect();
    let means: Vec<f64> = columns.iter().map(|c| c.iter().sum::<f64>() / n as f64).collect();
    let sd =
        |j: usize| (columns[j].iter().map(|v| (v - means[j]).powi(2)).sum::<f64>() / (n - 1) as f64).sqrt();
    let value = |i: usize, j: usize| match change {
        "scaled" => means[j] + 1.15 * (columns[j][i] - means[j]),
        "shifted" => columns[j][i] + 0.15 * sd(j),
        "unpaired" => columns[j][(i + n - 7 * j) % n],
        _ => columns[j][i],
    };
    let values = (0..n).flat_map(|i| (0..d).map(move |j| (i, j))).map(|(i, j)| value(i, j)).collect();
    Points::from_values(d, values).unwrap()
}

/// Means over two seeds within 0.01 where scikit-learn's own seeds agree as well; where they do not (the classifier settles in one of
/// several minima: 0.76 to 0.84), within their range. Ten dimensions take minutes and are left to the script.
#[test]
fn agrees_with_scikit_learn() {
    let table = include_str!("data/c2st_sklearn.csv");
    for task in [common::two_moons(), common::slcp()] {
        let Some((_, points)) = common::reference(&task, 1, 10_000) else { return };
        let halves = [0..5000, 5000..10_000].map(|r| points.select(&r.collect::<Vec<_>>()));
        for change in ["same", "scaled", "shifted", "unpaired"] {
            let key = format!("{},{change},", task.name);
            let rows = table.lines().filter(|l| l.starts_with(&key));
            let theirs: Vec<f64> = rows.map(|l| l.rsplit(',').next().unwrap().parse().unwrap()).collect();
            let mean = theirs.iter().sum::<f64>() / theirs.len() as f64;
            let (low, high) = theirs.iter().fold((mean, mean), |(l, h), v| (l.min(*v), h.max(*v)));
            let agree = high - low < 0.015;
            let other = changed(&halves[1], change);
            let ours = (1..=2).map(|s| c2st(&halves[0], &other, s).unwrap()).sum::<f64>() / 2.0;
            println!("{} {change}: {ours:.4}, scikit-learn {mean:.4} ({low:.4} to {high:.4})", task.name);
            let (low, high) = if agree { (mean, mean) } else { (low, high) };
            assert!(ours > low - 0.01 && ours < high + 0.01, "{} {change}: {ours} {mean}", task.name);
        }
    }
}

#[test]
fn wrong_samples_are_errors() {
    let good = Points::from_values(1, (0..60).map(f64::from).collect()).unwrap();
    let bad = Points::from_values(1, (0..60).map(|i| if i == 7 { f64::NAN } else { 0.0 }).collect()).unwrap();
    assert!(matches!(c2st(&good, &bad, 1), Err(Error::NotFinite { row: 7, .. })));
    assert!(matches!(c2st(&good, &good.select(&[1, 2]), 1), Err(Error::TooFew { .. })));
    assert!(matches!(
        c2st(&good, &Points::from_values(2, vec![0.0; 120]).unwrap(), 1),
        Err(Error::Length { .. })
    ));
}
