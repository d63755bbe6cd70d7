//! Derivatives against differences.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use missing_physics::fit::finite_differences;

use super::super::setup::GLASS;
use super::*;

/// Derivatives, in closed form or of a part of the reading, are those of all of it: everything off, and everything on, so that the first
/// mode is no longer proportional to its start.
#[test]
fn derivatives_agree_with_differences() {
    let times: Vec<f64> = (0..60).map(|i| 0.02 * f64::from(i)).collect();
    let rows = times.len();
    let wave: Vec<f64> = times.iter().map(|t| 1e-3 * (-0.1 * t).exp() * (22.0 * t).cos()).collect();
    let run = Run { label: "1".into(), inputs: vec![times], outputs: vec![wave], kind: 1 };
    let model = SloshModel::new(GLASS, std::slice::from_ref(&run)).unwrap();
    let of = |scope| -> Vec<&missing_physics::model::Parameter> {
        model.spec().parameters.iter().filter(|p| p.scope == scope).collect()
    };
    let (shared, nuisance) = (of(Scope::Shared), of(Scope::PerRun));
    let (sf, nf): (Vec<usize>, Vec<usize>) = ((0..shared.len()).collect(), (0..nuisance.len()).collect());
    for on in [0.0, 1.0] {
        let shared: Vec<f64> = shared.iter().map(|p| (p.start + on * 0.3 * p.scale).min(p.upper)).collect();
        let nuisance: Vec<f64> =
            nuisance.iter().enumerate().map(|(k, p)| (0.6 + 0.2 * k as f64) * p.scale).collect();
        let mut out = vec![0.0; rows];
        let [mut exact, mut rough] = [0, 1].map(|_| vec![0.0; rows * (sf.len() + nf.len())]);
        model.jacobian(&run, &shared, &nuisance, &sf, &nf, &mut out, &mut exact).unwrap();
        finite_differences(&model, &run, &shared, &nuisance, &sf, &nf, &mut out, &mut rough).unwrap();
        for (k, (a, b)) in exact.chunks(rows).zip(rough.chunks(rows)).enumerate() {
            let size = a.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            for (a, b) in a.iter().zip(b) {
                assert!((a - b).abs() <= 1e-3 * size, "column {k} (on: {on}): {a} and {b}");
            }
        }
    }
}
