//! Measured curves beside what a peer made of them: the numbers stand in each recording's PROVENANCE.md.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::path::Path;

use hertz_contact::fit::{Baseline, Curve, Fit, Loss, Noise, Range, Report, Workspace};
use hertz_contact::indenter::Indenter;

/// Recording, radius (m), and the modulus (Pa) that nanite 4.2.3 finds: a ball's parabola, contact point and offset free, over the
/// whole approach. The instrument's own fit of the first gives 117.0.
const PEERS: [(&str, f64, f64); 3] = [
    ("afm-chiaro-aebp1", 2.75e-5, 118.0),
    ("afm-reference-point-0", 1.864e-5, 55.1),
    ("afm-reference-point-2", 1.864e-5, 43.0),
];

/// Measured bodies in the repository, and all of them beside the workspace.
const BUNDLED: &str = "../recordings/measured/indentation";
const SHARED: &str = "../../shared/recordings/real/indentation";

/// Depth, force, time, and whether it is held, of each row of each run of a recording.
fn runs(folder: &str, name: &str) -> Vec<Vec<[f64; 4]>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder).join(name).join("data.csv");
    let text = std::fs::read_to_string(&file).unwrap();
    let mut runs: Vec<Vec<[f64; 4]>> = Vec::new();
    let mut before = String::new();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        if cells[0] != before {
            runs.push(Vec::new());
            before = cells[0].to_owned();
        }
        let number = |k: usize| cells[k].parse::<f64>().unwrap();
        runs.last_mut().unwrap().push([
            number(1),
            number(2),
            number(3),
            f64::from(u8::from(cells[4] == "hold")),
        ]);
    }
    runs
}

fn fitted(radius_m: f64, range: Range, (depth, force): &(Vec<f64>, Vec<f64>)) -> Report {
    let fit = Fit {
        baseline: Baseline::Offset,
        loss: Loss::Square,
        noise: Noise::White,
        range,
        ..Fit::new(Indenter::Sphere { radius_m }, 0.5)
    };
    let curve = Curve { indentation_m: depth, force_n: force, sigma_n: None };
    fit.run(&[curve], &mut Workspace::new()).unwrap()
}

/// The same model over the same range: the peer's modulus lies within the interval, its contact point (delta = 0) beside ours. And
/// what is left has a trend: these bodies are no Hertzian half-spaces, which the fit says.
#[test]
#[ignore = "needs ../shared"]
fn shared_moduli_of_measured_cells_are_those_of_a_peer() {
    for (name, radius_m, peer_pa) in PEERS {
        let runs = runs(SHARED, name);
        let curve: (Vec<f64>, Vec<f64>) = runs[0].iter().map(|r| (r[0], r[1])).unzip();
        let whole = fitted(radius_m, Range::All, &curve);
        let (low, high) = whole.modulus_interval_pa;
        let deepest = curve.0.iter().copied().fold(0.0, f64::max);
        let touched = whole.curves[0].contact_m;
        println!(
            "{name}: {:.1} Pa ({low:.1} to {high:.1}), the peer {peer_pa}; contact off the peer's by {:.3} um of {:.1}; misfit {}",
            whole.modulus_pa,
            1e6 * touched,
            1e6 * deepest,
            whole.curves[0].flags.misfit
        );
        assert!(low <= peer_pa && peer_pa <= high, "{name}: {low} to {high}");
        assert!(touched.abs() < 0.05 * deepest, "{name}: {touched}");
        assert!(whole.curves[0].flags.misfit, "{name}");
    }
}

/// What is left (root mean square) of a least-squares fit of values by columns.
fn left(columns: &[Vec<f64>], values: &[f64]) -> f64 {
    let a = nalgebra::DMatrix::from_fn(values.len(), columns.len(), |i, k| columns[k][i]);
    let b = nalgebra::DVector::from_column_slice(values);
    let x = a.clone().svd(true, true).solve(&b, 1e-14).unwrap();
    ((a * x - b).norm_squared() / values.len() as f64).sqrt()
}

/// A geometric grid.
fn grid(low: f64, high: f64, n: i32) -> impl Iterator<Item = f64> {
    (0..n).map(move |k| low * (high / low).powf(f64::from(k) / f64::from(n - 1)))
}

/// Plates of three sizes on an elastic half-space have F = 2 R E* delta. On sand the exponent is about 1.5, and the force at one depth
/// grows faster than the plate's area: no effect on the list does that, and three sizes are the experiment that shows it.
#[test]
fn sand_under_plates_is_no_elastic_body() {
    const DEPTH_M: f64 = 0.015;
    let mut per_area = Vec::new();
    for (name, radius_m) in [("sand-plate-60mm", 0.03), ("sand-plate-80mm", 0.04), ("sand-plate-100mm", 0.05)]
    {
        let runs = runs(BUNDLED, name);
        let rows: Vec<[f64; 4]> = runs.concat();
        let force: Vec<f64> = rows.iter().map(|r| r[1]).collect();
        let of = |n: f64| left(&[rows.iter().map(|r| r[0].max(0.0).powf(n)).collect()], &force);
        let exponent = grid(0.8, 2.2, 141).min_by(|a, b| of(*a).total_cmp(&of(*b))).unwrap();
        let near: Vec<f64> = rows.iter().filter(|r| (r[0] - DEPTH_M).abs() < 3e-4).map(|r| r[1]).collect();
        let mean = near.iter().sum::<f64>() / near.len() as f64;
        let (line, area) =
            (mean / (2.0 * radius_m * DEPTH_M), mean / (std::f64::consts::PI * radius_m * radius_m));
        println!(
            "{name}: exponent {exponent:.2} (left {:.1} N; straight line {:.1} N), F/(2 R delta) {:.0} kPa, F/area {:.1} kPa",
            of(exponent),
            of(1.0),
            1e-3 * line,
            1e-3 * area
        );
        assert!((1.3..1.6).contains(&exponent) && of(1.0) > 1.8 * of(exponent));
        per_area.push(area);
    }
    assert!(per_area[0] * 1.2 < per_area[1] && per_area[1] * 1.2 < per_area[2], "{per_area:?}");
}

/// A held cell: a power law with two parameters leaves less than an exponential with three, in each of four curves. A standard linear
/// solid has one time; a cell has many.
#[test]
#[ignore = "needs ../shared"]
fn shared_measured_cell_relaxes_on_many_time_scales() {
    let runs = runs(SHARED, "afm-cell-relaxation");
    for (k, run) in runs.iter().enumerate() {
        let held: Vec<&[f64; 4]> = run.iter().filter(|r| r[3] > 0.0).collect();
        let force: Vec<f64> = held.iter().map(|r| r[1]).collect();
        let times: Vec<f64> = held.iter().map(|r| r[2] - held[0][2]).collect();
        let one = vec![1.0; times.len()];
        let exponential =
            |tau: f64| left(&[one.clone(), times.iter().map(|t| (-t / tau).exp()).collect()], &force);
        let power =
            |t_0: f64, n: f64| left(&[times.iter().map(|t| (1.0 + t / t_0).powf(-n)).collect()], &force);
        let linear_solid = grid(0.05, 30.0, 60).map(exponential).fold(f64::INFINITY, f64::min);
        let powers = grid(0.01, 3.0, 30).flat_map(|t_0| grid(0.05, 0.5, 30).map(move |n| (t_0, n)));
        let (law, t_0, n) =
            powers.map(|(t_0, n)| (power(t_0, n), t_0, n)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        println!(
            "curve {}: exponential leaves {:.2} nN, (1 + t/{t_0:.2} s)^-{n:.2} leaves {:.2} nN, of {:.0} to {:.0} nN",
            k + 1,
            1e9 * linear_solid,
            1e9 * law,
            1e9 * force[0],
            1e9 * force[force.len() - 1]
        );
        assert!(law < 0.95 * linear_solid);
    }
}
