//! Figure 6.7: four fillings, each palpated three times.

use examples::plot::{Panel, hue};
use rayon::prelude::*;
use stretch::fake::{Filling, Rig, Shape};
use stretch::force::curve;
use stretch::membrane::MembraneModel;
use stretch::palpate::{Palpation, Programme, palpate};

use super::{Outcome, at};

/// Balloons: what is in them, and their stiffness, N/m.
const FILLINGS: [(&str, f64); 4] = [("air", 80.0), ("water", 150.0), ("pudding", 260.0), ("seeds", 450.0)];

pub(crate) fn balloons(model: &MembraneModel, panels: &mut Vec<Panel>) -> Outcome<()> {
    let times: u64 = if examples::small() { 1 } else { 3 };
    println!("\nStiffness by palpation (figure 6.7)");
    println!(
        "{:>8} {:>12} {:>12} {:>21} {:>6}",
        "filling", "true (N/m)", "felt (N/m)", "95 % interval", "steps"
    );
    let fillings = if examples::small() { 1 } else { FILLINGS.len() };
    let trials: Vec<(usize, u64)> = (0..fillings).flat_map(|k| (0..times).map(move |s| (k, s))).collect();
    let felt: Vec<(usize, Palpation)> = trials
        .into_par_iter()
        .map(|(k, seed)| {
            let mut rig =
                Rig::new(Shape::Ball { radius_m: 0.02 }, Filling::Springy(FILLINGS[k].1), 100 + seed);
            let stretches_m = vec![0.0, 0.02, 0.04, 0.06];
            let programme =
                Programme { stretches_m, pictures: 2, ..Programme::matl_2021(at(0.0, 0.03), 0.0) };
            Ok((k, palpate(&mut rig, &programme, model).map_err(|e| e.to_string())?))
        })
        .collect::<Outcome<_>>()?;
    for (k, p) in &felt {
        let (name, stiffness) = FILLINGS[*k];
        let value = p.stiffness_n_m.map_or("not yielded".to_owned(), |k| format!("{k:.0}"));
        let (low, high) = p.interval_n_m;
        println!("{name:>8} {stiffness:>12.0} {value:>12} {low:>10.0} to {high:>6.0} {:>7}", p.steps.len());
    }
    for (k, (name, _)) in FILLINGS.into_iter().enumerate() {
        let Some((_, p)) = felt.iter().find(|f| f.0 == k) else { continue };
        let mut panel = Panel::new(format!("6.7: {name}: force (N)"), "depth (mm)", "");
        let mut known: Vec<f64> = p.steps.iter().map(|s| s.stretch_m).collect();
        known.dedup();
        for (l, x) in known.iter().enumerate() {
            let fine: Vec<f64> = (0..=30).map(|i| 5e-4 * f64::from(i)).collect();
            let line = curve(model, p.radius.value_m, *x, &fine)?;
            panel.line(fine.iter().zip(line).map(|(d, f)| [1e3 * d, f]), &hue(l, 4));
            panel.name(format!("{:.0} mm", 1e3 * x), &hue(l, 4));
        }
        let path: Vec<[f64; 2]> = p.steps.iter().map(|s| [1e3 * s.indentation_m, s.load.force_n]).collect();
        panel.line(path.clone(), "crimson").dots(path, "crimson");
        panels.push(panel);
    }
    Ok(())
}
