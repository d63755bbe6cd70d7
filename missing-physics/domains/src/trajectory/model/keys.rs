//! The model of a flight against the keys of the practice cases: names, signs and sizes of the true parameters.

use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, DVector};
use serde_json::Value;

use super::*;

/// A practice case of three coordinates: its runs, model and key. `practice` is its folder seen from the crate's.
fn case(practice: &str, name: &str) -> (Vec<Run>, TrajectoryModel, Value) {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join(practice).join("trajectory").join(name);
    let read = |file: &str| std::fs::read_to_string(folder.join(file)).unwrap();
    let key: Value = serde_json::from_str(&read("key.json")).unwrap();
    let header: toml::Table = read("recording.toml").parse().unwrap();
    let rig = |name: &str| header["rig"].get(name).and_then(toml::Value::as_float);
    let model = TrajectoryModel::new(Setup {
        axes: Axes::Space,
        mass_kg: rig("mass_kg"),
        diameter_m: rig("diameter_m"),
        gravity_m_s2: rig("gravity_m_s2").unwrap_or(crate::reading::GRAVITY_M_S2),
        air_density_kg_m3: 1.2,
        spin: false,
    });
    let mut runs: Vec<Run> = Vec::new();
    for line in read("data.csv").lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        if runs.last().is_none_or(|r| r.label != cells[0]) {
            let (inputs, outputs) = (vec![Vec::new()], vec![Vec::new(); 3]);
            runs.push(Run { label: cells[0].into(), inputs, outputs, kind: 0 });
        }
        let run = runs.last_mut().unwrap();
        run.inputs[0].push(cells[1].parse().unwrap());
        for (column, cell) in run.outputs.iter_mut().zip(&cells[2..]) {
            column.push(cell.parse().unwrap());
        }
    }
    (runs, model, key)
}

/// Least squares by Gauss-Newton over the shared parameters `free` and every run's start. Gives the shared parameters,
/// their standard errors and the root mean square residual of each channel in units of `sigma`.
fn fit(
    runs: &[Run],
    model: &TrajectoryModel,
    free: &[usize],
    sigma: &[f64],
) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let nuisance_count = model.axes().starts();
    let nuisance_free: Vec<usize> = (0..nuisance_count).collect();
    let mut shared = vec![0.0; model.spec().count(Scope::Shared)];
    let mut nuisances = vec![vec![0.0; model.nuisance_count()]; runs.len()];
    for (run, nuisance) in runs.iter().zip(&mut nuisances) {
        model.nuisance_start(run, nuisance);
    }
    let size = free.len() + nuisance_count * runs.len();
    let mut errors = Vec::new();
    let mut squares = vec![0.0; sigma.len()];
    let rows: usize = runs.iter().map(Run::len).sum();
    for _ in 0..12 {
        let (mut normal, mut right) = (DMatrix::<f64>::zeros(size, size), DVector::<f64>::zeros(size));
        squares.fill(0.0);
        for (r, run) in runs.iter().enumerate() {
            let n = run.len();
            let mut out = vec![0.0; n * sigma.len()];
            let mut jacobian = vec![0.0; out.len() * (free.len() + nuisance_count)];
            model
                .jacobian(run, &shared, &nuisances[r], free, &nuisance_free, &mut out, &mut jacobian)
                .unwrap();
            let slots: Vec<usize> = (0..free.len())
                .chain((0..nuisance_count).map(|i| free.len() + r * nuisance_count + i))
                .collect();
            for row in 0..out.len() {
                let sigma = sigma[row / n];
                let residual = (run.outputs[row / n][row % n] - out[row]) / sigma;
                squares[row / n] += residual * residual;
                for (a, &i) in slots.iter().enumerate() {
                    let slope = jacobian[a * out.len() + row] / sigma;
                    right[i] += slope * residual;
                    for (b, &j) in slots.iter().enumerate() {
                        normal[(i, j)] += slope * jacobian[b * out.len() + row] / sigma;
                    }
                }
            }
        }
        let inverse = normal.cholesky().unwrap().inverse();
        let step: DVector<f64> = &inverse * right;
        for (i, &slot) in free.iter().enumerate() {
            shared[slot] += step[i];
        }
        for (r, nuisance) in nuisances.iter_mut().enumerate() {
            for (i, nuisance) in nuisance.iter_mut().take(nuisance_count).enumerate() {
                *nuisance += step[free.len() + r * nuisance_count + i];
            }
        }
        errors = (0..free.len()).map(|i| inverse[(i, i)].sqrt()).collect();
    }
    let rms = squares.iter().map(|s| (s / rows as f64).sqrt()).collect();
    (free.iter().map(|&slot| shared[slot]).collect(), errors, rms)
}

/// The mechanisms of the key, freed by their names, leave nothing but noise and take the key's values.
fn mechanisms_come_out_with_their_signs_and_sizes(practice: &str, names: &[&str]) {
    for name in names {
        let (runs, model, key) = case(practice, name);
        let spec = model.spec();
        let mut truth = Vec::new();
        let mut free = Vec::new();
        for mechanism in key["mechanisms"].as_array().unwrap() {
            let id = mechanism["id"].as_str().unwrap();
            let ours = spec.mechanisms.iter().find(|m| m.id == id).unwrap();
            for &parameter in &ours.parameters {
                let value = &mechanism["parameters"][&spec.parameters[parameter].name];
                truth.push(value.as_f64().unwrap());
                free.push(spec.slots()[parameter]);
            }
        }
        let sigma: Vec<f64> =
            ["x_m", "y_m", "z_m"].iter().map(|c| key["noise_sigma"][*c].as_f64().unwrap()).collect();
        let (values, errors, rms) = fit(&runs, &model, &free, &sigma);
        for ((value, error), truth) in values.iter().zip(&errors).zip(&truth) {
            let z = (value - truth) / error;
            assert!(z.abs() < 4.0, "{name}: {value} +- {error}, the key says {truth} ({z:.1} sd)");
            // What a wrong sign would give is far away.
            assert!(((value + truth) / error).abs() > 4.0 || truth.abs() < 4.0 * error, "{name}: no power");
        }
        for (channel, rms) in rms.iter().enumerate() {
            assert!((rms - 1.0).abs() < 0.1, "{name}: channel {channel} misses by {rms} sigma");
        }
        // Without them it does not fit, so the test could fail.
        let (_, _, without) = fit(&runs, &model, &[], &sigma);
        assert!(without.iter().any(|rms| *rms > 1.1), "{name}: {without:?}");
    }
}

#[test]
fn the_mechanism_of_a_key_comes_out_with_its_sign_and_size() {
    mechanisms_come_out_with_their_signs_and_sizes("../../recordings/practice", &["c04"]);
}

#[test]
#[ignore = "needs ../shared"]
fn shared_the_mechanisms_of_all_keys_come_out_with_their_signs_and_sizes() {
    mechanisms_come_out_with_their_signs_and_sizes("../../../shared/practice", &["c02", "c04", "c05", "c07"]);
}
