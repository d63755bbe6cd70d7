//! Derivatives against differences, the camera alone, and where a fit begins.

use super::*;
use missing_physics::fit::finite_differences;

fn run(channels: usize, spin: bool) -> Run {
    let t: Vec<f64> = (0..12).map(|i| 0.3 + 0.07 * f64::from(i)).collect();
    let mut inputs = vec![t.clone()];
    if spin {
        inputs.extend([10.0, -20.0, 5.0].map(|s| vec![s; t.len()]));
    }
    Run { label: "1".into(), inputs, outputs: vec![vec![0.0; t.len()]; channels], kind: 0 }
}

/// Derivatives against central differences, everything off and everything on, for all that can be measured.
#[test]
fn derivatives_agree_with_differences() {
    for (axes, spin) in [
        (Axes::Height, false),
        (Axes::Plane, false),
        (Axes::Space, false),
        (Axes::Space, true),
        (Axes::Accelerometer, false),
    ] {
        let model = TrajectoryModel::new(Setup {
            axes,
            mass_kg: Some(0.05),
            diameter_m: Some(0.06),
            gravity_m_s2: 9.8,
            air_density_kg_m3: 1.2,
            spin,
        });
        let channels = axes.seen().len().max(1);
        let run = run(channels, spin);
        let n_shared = model.spec().count(Scope::Shared);
        let nuisance: Vec<f64> = (0..model.nuisance_count()).map(|i| 1.0 + 0.7 * i as f64).collect();
        for on in [0.0, 1.0] {
            let shared: Vec<f64> = model.spec().parameters[..n_shared]
                .iter()
                .map(|p| (on * 0.3 * p.scale).min(p.upper))
                .collect();
            let (sf, of): (Vec<usize>, Vec<usize>) = ((0..n_shared).collect(), (0..nuisance.len()).collect());
            let rows = channels * run.len();
            let mut out = vec![0.0; rows];
            let (mut exact, mut rough) =
                (vec![0.0; rows * (sf.len() + of.len())], vec![0.0; rows * (sf.len() + of.len())]);
            model.jacobian(&run, &shared, &nuisance, &sf, &of, &mut out, &mut exact).unwrap();
            // Steps away from the bound at zero: drags are differenced on one side there.
            let inner: Vec<f64> = shared.clone();
            finite_differences(&model, &run, &inner, &nuisance, &sf, &of, &mut out, &mut rough).unwrap();
            for k in 0..sf.len() + of.len() {
                let (a, b) = (&exact[k * rows..(k + 1) * rows], &rough[k * rows..(k + 1) * rows]);
                let size = a.iter().fold(1e-3, |m: f64, v| m.max(v.abs()));
                for (a, b) in a.iter().zip(b) {
                    assert!((a - b).abs() < 2e-4 * size, "{axes:?} column {k} (on: {on}): {a} and {b}");
                }
            }
        }
    }
}

/// A plumb rod of a metre is seen by the same camera as a flight, in every coordinate, whatever `out` held before.
#[test]
fn a_rod_shows_the_camera_and_nothing_else() {
    let setup = Setup {
        axes: Axes::Space,
        mass_kg: None,
        diameter_m: None,
        gravity_m_s2: 9.8,
        air_density_kg_m3: 1.2,
        spin: false,
    };
    let model = TrajectoryModel::new(setup);
    let mut shared = vec![0.0; model.spec().count(Scope::Shared)];
    for (role, value) in model.roles.iter().zip(&mut shared) {
        *value = match role {
            Role::CameraScale => 0.02,
            Role::TiltX => -0.03,
            Role::TiltY => 0.01,
            Role::ClockRate | Role::Quadratic => 0.04,
            _ => 0.0,
        };
    }
    let rod =
        Run { label: "rod".into(), inputs: vec![vec![0.0, 1.0]], outputs: vec![vec![0.0; 2]; 3], kind: ROD };
    let nuisance = [0.3, -0.4, 0.5, 7.0, 7.0, 7.0, 0.2, 0.2, 0.2];
    let mut out = [f64::NAN; 6];
    model.predict(&rod, &shared, &nuisance, &mut out).unwrap();
    // e_z turned by -0.03 about x, then by 0.01 about y.
    let (sx, cx) = (-0.03_f64).sin_cos();
    let (sy, cy) = 0.01_f64.sin_cos();
    let top = [sy * cx, -sx, cy * cx];
    for c in 0..3 {
        assert!((out[2 * c] - nuisance[c]).abs() < 1e-15, "{out:?}");
        assert!((out[2 * c + 1] - nuisance[c] - 1.02 * top[c]).abs() < 1e-15, "{out:?}");
    }
}

#[test]
fn the_start_of_a_parabola_is_found() {
    let setup = Setup {
        axes: Axes::Space,
        mass_kg: None,
        diameter_m: None,
        gravity_m_s2: 9.8,
        air_density_kg_m3: 1.2,
        spin: false,
    };
    let model = TrajectoryModel::new(setup);
    let mut run = run(3, false);
    let truth = [0.1, -0.2, 1.5, 3.0, 0.4, 5.0, 0.0, 0.0, 0.0];
    let shared = vec![0.0; model.spec().count(Scope::Shared)];
    let mut out = vec![0.0; 36];
    model.predict(&run, &shared, &truth, &mut out).unwrap();
    for c in 0..3 {
        run.outputs[c].copy_from_slice(&out[12 * c..12 * (c + 1)]);
    }
    run.outputs[1][4] = f64::NAN;
    let mut nuisance = [0.0; 9];
    model.nuisance_start(&run, &mut nuisance);
    for (a, b) in nuisance.iter().zip(truth) {
        assert!((a - b).abs() < 1e-9, "{nuisance:?}");
    }
}
