//! Presses on a foam, its likelihood from press to press, and intervals against the number of presses.

use std::path::PathBuf;

use examples::plot::{self, Panel, hue};
use softcell::fake::{Errors, Palpator};
use softcell::stiffness::{Instrument, Palpation};

use crate::Outcome;
use crate::feel::{self, OBJECTS, PRESSURES_PA, Policy};

/// Drawn are presses on the foam, and intervals of the gel and the muscle.
const FOAM: usize = 2;
const NARROWED: [usize; 2] = [0, 4];
const COLOURS: [&str; 5] =
    ["black", "hsl(0,70%,45%)", "hsl(220,70%,60%)", "hsl(160,70%,35%)", "hsl(40,80%,45%)"];

/// Draws and writes all panels.
pub(crate) fn draw(small: bool) -> Outcome<PathBuf> {
    let mut rig = Palpator::new(Errors::matl_2021(), 77).ok_or("no tip")?;
    let tip = feel::calibrated(&mut rig)?;
    let palpation = Palpation::new(tip, Instrument::matl_2021())?;
    let [forces, seen] = presses(&mut rig)?;
    let mut panels = vec![forces, seen, likelihoods(&mut rig, &palpation)?];
    for object in NARROWED {
        panels.push(narrowing(object, if small { 2 } else { 9 })?);
    }
    Ok(plot::write("stiffness.svg", &panels, 3)?)
}

/// True forces, and what the camera sees, over the travel at each pressure.
fn presses(rig: &mut Palpator) -> Outcome<[Panel; 2]> {
    let object = OBJECTS[FOAM].object();
    let name = OBJECTS[FOAM].name;
    let mut forces = Panel::new(format!("{name}: true force"), "travel since contact, mm", "N");
    let mut seen =
        Panel::new(format!("{name}: the tip's indentation, by the camera"), "travel of the base, mm", "mm");
    for (k, p) in PRESSURES_PA.into_iter().enumerate() {
        let colour = hue(k, PRESSURES_PA.len());
        let contacts = rig.contacts(&object, p).ok_or("no contact to be solved")?;
        forces.line(contacts.iter().map(|c| [1e3 * c.travel_m, c.force_n]), &colour);
        forces.name(format!("{} kPa", 1e-3 * p), &colour);
        let press = rig.press(&object, p).ok_or("no contact to be solved")?;
        seen.dots(press.loading.iter().map(|r| [1e3 * r.travel_m, 1e3 * r.tip_m]), &colour);
    }
    Ok([forces, seen])
}

/// The likelihood over its greatest value, after each of four matched presses.
fn likelihoods(rig: &mut Palpator, palpation: &Palpation) -> Outcome<Panel> {
    let truth_pa = OBJECTS[FOAM].modulus_pa;
    let mut panel = Panel::new(
        format!("{}: likelihood, press by press", OBJECTS[FOAM].name),
        "lg(E*, Pa)",
        "of its greatest",
    );
    let mut curves: Vec<Vec<[f64; 2]>> = Vec::new();
    feel::palpate(rig, palpation.clone(), FOAM, Policy::Chosen, 4, &mut |p| {
        let points: Vec<[f64; 2]> = p.log_likelihood().collect();
        let top = points.iter().map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max);
        let near = points.iter().filter(|[e, _]| (0.4..2.5).contains(&(e / truth_pa)));
        curves.push(near.map(|[e, l]| [e.log10(), (l - top).exp()]).collect());
    })?;
    let n = curves.len();
    for (k, curve) in curves.into_iter().enumerate() {
        panel.line(curve, &hue(k, n)).name(format!("{} presses", k + 1), &hue(k, n));
    }
    panel.line([0.0, 1.0].map(|y| [truth_pa.log10(), y]), "black").name("true", "black");
    Ok(panel)
}

/// Median over rigs of the interval's ends against the number of presses.
fn narrowing(object: usize, rigs: u64) -> Outcome<Panel> {
    let mut panel = Panel::new(
        format!("{}: interval, end to end", OBJECTS[object].name),
        "presses",
        "lg of greatest over least modulus",
    );
    for (policy, colour) in Policy::ALL.into_iter().zip(COLOURS) {
        let mut factors: Vec<Vec<f64>> = Vec::new();
        for seed in 0..rigs {
            let mut rig = Palpator::new(Errors::matl_2021(), 500 + seed).ok_or("no tip")?;
            let mut palpation = Palpation::new(feel::calibrated(&mut rig)?, Instrument::matl_2021())?;
            for k in 0..feel::PRESSES {
                let press = rig
                    .press(&OBJECTS[object].object(), policy.next_pa(&palpation)?)
                    .ok_or("no contact to be solved")?;
                if factors.len() <= k {
                    factors.push(Vec::new());
                }
                // What is refused by chance is left out.
                if let Ok(estimate) = palpation.add(&press).and_then(|()| palpation.estimate()) {
                    factors[k].push(estimate.modulus_pa.factor());
                }
            }
        }
        let median = |of: &mut Vec<f64>| {
            of.sort_by(f64::total_cmp);
            of.get(of.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let points: Vec<[f64; 2]> = factors
            .iter_mut()
            .enumerate()
            .map(|(k, of)| [k as f64 + 1.0, median(of).log10()])
            .filter(|p| p[1].is_finite())
            .collect();
        panel.line(points.clone(), colour).dots(points, colour).name(policy.name(), colour);
    }
    Ok(panel)
}
