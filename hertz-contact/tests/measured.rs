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

/// Depths and forces of a recording beside the workspace; says loudly where it is not there.
fn measured(name: &str) -> Option<(Vec<f64>, Vec<f64>)> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../shared/recordings/real/indentation")
        .join(name)
        .join("data.csv");
    let Ok(text) = std::fs::read_to_string(&file) else {
        println!("NOT TESTED: {} is not there", file.display());
        return None;
    };
    let row = |line: &str| {
        let mut cells = line.split(',').skip(1);
        let mut next = || cells.next().unwrap().parse::<f64>().unwrap();
        (next(), next())
    };
    Some(text.lines().skip(1).map(row).unzip())
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
fn moduli_of_measured_cells_are_those_of_a_peer() {
    for (name, radius_m, peer_pa) in PEERS {
        let Some(curve) = measured(name) else { return };
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
