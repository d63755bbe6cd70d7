//! Table 7.1: stiffness by palpation.

use dough_mbrl::fake::{DoughKind, FakeRig};
use dough_mbrl::rollout::Setup;
use dough_mbrl::stiffness::{BandForce, Palpation, Press};
use examples::dough::mean_and_half;

use crate::{Failure, NONE};

/// The band's force from a rigid probe of 30 mm, then palpation of three doughs.
pub(crate) fn table_7_1() -> Result<[f64; 3], Failure> {
    let mut rig = FakeRig::new(DoughKind::A, NONE, 1).with_rigid_probe(0.03);
    let setup = Setup::of(rig.camera_in_world());
    let mut presses = Vec::new();
    for throw_mm in (40..=120).step_by(10) {
        for depth_mm in (2..=30).step_by(4) {
            let (throw_m, depth_m) = (1e-3 * f64::from(throw_mm), 1e-3 * f64::from(depth_mm));
            setup.handling.stretch(&mut rig, throw_m)?;
            setup.handling.go(&mut rig, [0.4, 0.0, 0.03 - depth_m], 0.1)?;
            presses.push(Press { throw_m, depth_m, force_n: rig.probe_force_n() });
            setup.handling.go(&mut rig, [0.4, 0.0, 0.1], 0.3)?;
        }
    }
    let band = BandForce::fit(&presses)?;
    println!(
        "\ntable 7.1: stiffness by palpation, N/mm (band's force fitted to {:.0} mN)",
        1e3 * band.sigma_n
    );
    let mut found = [0.0; 3];
    for (k, (name, kind, table)) in
        [("A", DoughKind::A, 0.49), ("B", DoughKind::B, 0.85), ("C", DoughKind::C, 1.23)]
            .into_iter()
            .enumerate()
    {
        let felt: Result<Vec<f64>, _> = (10..16)
            .map(|seed| {
                let mut rig = FakeRig::new(kind, NONE, seed);
                Palpation::default().run(&mut rig, &setup, &band).map(|p| p.stiffness_n_m)
            })
            .collect();
        let (mean, half) = mean_and_half(&felt?);
        println!("  dough {name}: {:.2} +- {:.2} ([Matl 2021] {table})", 1e-3 * mean, 1e-3 * half);
        found[k] = mean;
    }
    Ok(found)
}
