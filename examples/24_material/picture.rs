//! Spectra by material, probabilities against how often they are right, and a restitution foretold.

use std::path::PathBuf;

use bounce_audio::fake::knock::SUBSTANCES;
use bounce_audio::material::{Senses, Verdicts};
use examples::plot::{self, Panel, hue};

use crate::judges::Judges;
use crate::rig::Tried;
use crate::{MATERIALS, Outcome, foretell};

const GREY: &str = "hsl(0,0%,75%)";

/// Draws all of it.
pub(crate) fn draw(judges: &mut Judges, tried: &[Tried], answers: &[(&str, &Verdicts)]) -> Outcome<PathBuf> {
    let colour = |material: usize| hue(material, MATERIALS);
    let mut spectra = Panel::new("sound of an impact, mean", "log10 of Hz", "dB over 360 Hz");
    let mut places = Panel::new("drops", "log10 of contact time at 1 m/s, s", "log10 of density");
    for (material, substance) in SUBSTANCES.iter().enumerate() {
        let of: Vec<_> =
            tried.iter().filter(|t| t.substance == material).filter_map(|t| t.seen.as_ref().ok()).collect();
        let levels: Vec<Vec<[f64; 2]>> = of.iter().map(|o| o.levels_db()).collect();
        let bands = levels.iter().map(Vec::len).min().unwrap_or(0);
        let mean = (0..bands).map(|k| {
            let sum: f64 = levels.iter().map(|l| l[k][1]).sum();
            [levels[0][k][0].log10(), sum / levels.len() as f64]
        });
        spectra.line(mean, &colour(material)).name(substance.name, &colour(material));
        let at = of.iter().filter_map(|o| Some([o.contact_time_s()?.log10(), o.density_kg_m3()?.log10()]));
        places.dots(at, &colour(material));
    }
    let mut panels = vec![spectra, places];
    for (name, verdicts) in answers {
        let mut panel = Panel::new(format!("by {name}"), "largest probability", "share that is right");
        panel.line([[0.0, 0.0], [1.0, 1.0]], GREY);
        for r in verdicts.reliability(10) {
            let error = (r.right * (1.0 - r.right) / r.count as f64).sqrt().max(0.5 / r.count as f64);
            let ends = [-1.96, 1.96].map(|s| [r.confidence, (r.right + s * error).clamp(0.0, 1.0)]);
            panel.line(ends, "black").dots([[r.confidence, r.right]], "black");
        }
        panels.push(panel);
    }
    let mut foretold = Panel::new("restitution foretold from one impact", "restitution", "density");
    let acrylic = tried.iter().filter(|t| t.substance == 2).filter_map(|t| t.seen.as_ref().ok());
    if let Some(seen) = acrylic.into_iter().find(|o| o.restitution().is_some()) {
        let first = seen.first(1);
        for (k, (name, weight)) in
            [("by sound", false), ("by sound and weight", true)].into_iter().enumerate()
        {
            let e = foretell::draws(judges, &first, Senses { sound: true, bounce: false, weight })?;
            let bin = |at: f64| e.iter().filter(|v| (**v - at).abs() < 0.0125).count() as f64;
            let points =
                (0..80).map(|i| 0.0125 * f64::from(i)).map(|at| [at, bin(at) / e.len() as f64 / 0.025]);
            foretold.line(points, &hue(k, 2)).name(name, &hue(k, 2));
        }
        let truth = seen.restitution().unwrap_or(0.0);
        foretold.line([[truth, 0.0], [truth, 5.0]], "black").name("an acrylic ball, as it bounced", "black");
    }
    panels.push(foretold);
    Ok(plot::write("material.svg", &panels, 3)?)
}
