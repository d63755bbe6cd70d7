//! Derivatives against central differences: everything off and everything on, for each indenter, loading, holding and letting go.

use hertz_contact::indenter::Indenter;
use missing_physics::data::Run;
use missing_physics::fit::finite_differences;
use missing_physics::model::{Model, Scope};

use super::model::IndentationModel;
use super::setup::{Condition, Setup};

const ROWS: usize = 36;

fn run() -> Run {
    let (mut depths, mut times, mut segments) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..ROWS {
        let k = i as f64;
        // Never at a kink: contact at zero, the rim, the deepest point.
        let (depth, segment) = match i {
            0..16 => (-0.3e-3 + 0.153e-3 * k, 0.0),
            16..24 => (2.02e-3 + 0.01e-3 * (k - 16.0), 1.0),
            _ => (2.05e-3 - 0.147e-3 * (k - 24.0), 2.0),
        };
        depths.push(depth);
        times.push(0.05 * k);
        segments.push(segment);
    }
    Run { label: "1".into(), inputs: vec![depths, times, segments], outputs: vec![vec![0.0; ROWS]], kind: 1 }
}

#[test]
fn derivatives_agree_with_differences() {
    let conditions = ["a", "b"].map(|name| Condition { name: name.into(), start_pa: 1e4 });
    for indenter in [
        Indenter::Sphere { radius_m: 0.01 },
        Indenter::Cylinder { radius_m: 0.004 },
        Indenter::Cone { angle_rad: 0.3 },
    ] {
        let setup =
            Setup { indenter, radius_known: true, poisson_ratio: 0.5, thickness_m: None, timed: true };
        let model = IndentationModel::new(setup, &conditions, 2.1e-3, 0.2, 1.8).unwrap();
        let run = run();
        let parameters = |scope| model.spec().parameters.iter().filter(move |p| p.scope == scope);
        let nuisance = vec![0.02e-3, 1e-3, 0.1];
        for on in [0.0, 0.8] {
            let shared: Vec<f64> = parameters(Scope::Shared)
                .map(|p| if on > 0.0 && p.start == 0.0 { on * p.scale } else { p.start })
                .collect();
            let free = (0..shared.len()).collect::<Vec<_>>();
            let mut out = [0.0; ROWS];
            let columns = free.len() + nuisance.len();
            let (mut exact, mut rough) = (vec![0.0; ROWS * columns], vec![0.0; ROWS * columns]);
            let nuisance_free = [0, 1, 2];
            model.jacobian(&run, &shared, &nuisance, &free, &nuisance_free, &mut out, &mut exact).unwrap();
            let mut plain = [0.0; ROWS];
            model.predict(&run, &shared, &nuisance, &mut plain).unwrap();
            assert!(out.iter().zip(plain).all(|(a, b)| (a - b).abs() < 1e-12), "{indenter:?}");
            finite_differences(&model, &run, &shared, &nuisance, &free, &nuisance_free, &mut out, &mut rough)
                .unwrap();
            for k in 0..columns {
                let (a, b) = (&exact[k * ROWS..][..ROWS], &rough[k * ROWS..][..ROWS]);
                let size = b.iter().fold(1e-9, |m: f64, v| m.max(v.abs()));
                for (i, (a, b)) in a.iter().zip(b).enumerate() {
                    let name = &model.spec().parameters[k.min(shared.len() - 1)].name;
                    assert!(
                        (a - b).abs() < 1e-3 * size,
                        "{indenter:?} column {k} ({name}, on: {on}) row {i}: {a} and {b}"
                    );
                }
            }
        }
    }
}
